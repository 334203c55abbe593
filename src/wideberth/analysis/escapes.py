"""The range that avoiding takes with what an aircraft may do: turn, climb or descend, slow down."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wideberth.analysis.encounter_angle import required_range
from wideberth.analysis.sizing_config import AircraftConfig
from wideberth.analysis.speed_change import speed_change_range
from wideberth.analysis.vertical_escape import vertical_escape_range
from wideberth.argument_checks import FloatArray, choice

ESCAPES = ("turn", "climb", "slow_down")


def escape_range(escape: str, bearing: ArrayLike, intruder_speed: ArrayLike, aircraft: AircraftConfig) -> FloatArray:
    """Return the range that one escape takes, against the worst of all courses that enter the safety volume.

    Parameters
    ----------
    escape : {"turn", "climb", "slow_down"}
    bearing, intruder_speed : array_like
        rad, clockwise from the nose; m/s. They broadcast.
    aircraft : AircraftConfig

    Returns
    -------
    ndarray
        m; 0 where no intruder of that speed can come from there; infinite where no range is enough.

    Raises
    ------
    ValueError
        If the escape is unknown, a bearing not finite, or a speed negative or not finite.
    """
    choice("escape", escape, ESCAPES)
    turn: dict[str, Any] = dict(aircraft.turn_arguments())
    if escape == "turn":
        fractions = aircraft.turn_fractions
        return required_range(bearing, intruder_speed=intruder_speed, turn_fractions=fractions, **turn).distance
    common = {name: turn[name] for name in ("ownship_speed", "safety_radius", "computation_time")}
    if escape == "climb":
        return vertical_escape_range(
            bearing,
            intruder_speed=intruder_speed,
            half_height=0.5 * aircraft.safety_height_m,
            climb_rate=aircraft.climb_rate_max_mps,
            descent_rate=aircraft.sink_rate_max_mps,
            vertical_acceleration=aircraft.vertical_acceleration_mps2,
            **common,
        ).distance
    return speed_change_range(
        bearing,
        intruder_speed=intruder_speed,
        new_speed=aircraft.speed_min_mps,
        acceleration=aircraft.acceleration_mps2,
        **common,
    ).distance


def range_by_escapes(bearing: FloatArray, intruder_speed: FloatArray, aircraft: AircraftConfig) -> FloatArray:
    """Return the range that avoiding takes with the best of the aircraft's escapes: a `RequiredRangeFunction`.

    The kind of escape is chosen by where the intruder is seen and how fast it is, not by its course.

    Parameters
    ----------
    bearing, intruder_speed : ndarray
        rad, clockwise from the nose; m/s.
    aircraft : AircraftConfig

    Returns
    -------
    ndarray
        m, as `escape_range`.
    """
    ranges = [escape_range(escape, bearing, intruder_speed, aircraft) for escape in aircraft.escapes]
    return np.asarray(np.min(ranges, axis=0))
