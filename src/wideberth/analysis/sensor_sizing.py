"""Whether a sensor sees far enough: the range at which it holds a track beside the range that avoiding takes."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis.encounter_angle import collision_closing_speed
from wideberth.analysis.sizing_config import AdsbSizingConfig, AircraftConfig, GroundRadarConfig, SensorConfig
from wideberth.argument_checks import FINITE, POSITIVE, FloatArray, checked
from wideberth.sensors.confirmation import confirmation_range
from wideberth.sensors.radar.coverage import confirmed_range
from wideberth.units import NAUTICAL_MILE

BoolArray = NDArray[np.bool_]


class RequiredRangeFunction(Protocol):
    """The range at which an intruder must have a track so that the aircraft can still avoid it."""

    def __call__(self, bearing: FloatArray, intruder_speed: FloatArray, aircraft: AircraftConfig) -> FloatArray:
        """Return the ranges, m, of bearings (rad, clockwise from the nose) and speeds (m/s) of one shape.

        Not a number where no intruder of that speed can come from there; infinite where no range is enough.
        """
        ...


@dataclass(frozen=True, slots=True)
class Protection:
    """What a sensor does for an aircraft, for each bearing (first axis) and intruder speed (second axis).

    Attributes
    ----------
    bearings : ndarray, shape (b,)
        rad, clockwise from the ownship's nose.
    intruder_speeds : ndarray, shape (s,)
        m/s.
    closing_speed : ndarray, shape (b, s)
        On a collision course, m/s; not a number where there is none (one that passes near may still be possible).
    required_range, available_range, margin : ndarray, shape (b, s)
        What avoiding takes, what the sensor gives, and how much more that is, m. Where nothing is required, the
        margin is what is available. What is available holds for the fastest of all courses from that bearing.
    protected : ndarray of bool, shape (b, s)
        Whether the margin is 0 or more.
    """

    bearings: FloatArray
    intruder_speeds: FloatArray
    closing_speed: FloatArray
    required_range: FloatArray
    available_range: FloatArray
    margin: FloatArray
    protected: BoolArray

    @property
    def protected_bearings(self) -> BoolArray:
        """Whether a bearing is protected from intruders of every speed, shape (b,)."""
        return np.asarray(self.protected.all(axis=1))


def closing_speed(bearing: ArrayLike, ownship_speed: ArrayLike, intruder_speed: ArrayLike) -> FloatArray:
    """Return how fast an intruder on a collision course closes that is seen at a bearing.

    On a collision course the bearing does not change. A slower intruder ahead has two such courses; this is the one
    that closes faster.

    Parameters
    ----------
    bearing : array_like
        rad, clockwise from the ownship's nose. The arrays broadcast.
    ownship_speed, intruder_speed : array_like
        m/s.

    Returns
    -------
    ndarray
        m/s; not a number where the intruder is too slow to collide from there.

    Raises
    ------
    ValueError
        If a bearing is not finite, or a speed not finite and positive.
    """
    own = checked("ownship_speed", ownship_speed, POSITIVE)
    intruder = checked("intruder_speed", intruder_speed, POSITIVE)
    closing = collision_closing_speed(bearing, own, intruder)
    return np.asarray(np.where(closing > 1e-9 * own, closing, np.nan))


def fastest_closing(bearing: FloatArray, ownship_speed: float, intruder_speed: FloatArray) -> FloatArray:
    """Return the greatest speed at which an intruder at a bearing can close, on whatever course.

    That is the course to where the ownship is now. Half of the intruder's speed is the least returned: a sensor's range
    needs something that closes.

    Parameters
    ----------
    bearing : ndarray
        rad, clockwise from the ownship's nose.
    ownship_speed : float
        m/s.
    intruder_speed : ndarray
        m/s, positive.

    Returns
    -------
    ndarray
        m/s.
    """
    return np.maximum(intruder_speed + ownship_speed * np.cos(bearing), 0.5 * intruder_speed)


def available_range(
    sensor: SensorConfig,
    bearing: ArrayLike,
    closing: ArrayLike,
    *,
    rcs: ArrayLike = 1.0,
    elevation: ArrayLike = 0.0,
) -> FloatArray:
    """Return the range at which a sensor has a confirmed track of an intruder that closes from a bearing.

    Parameters
    ----------
    sensor : RadarConfig or AdsbSizingConfig
        ADS-B sees all round, but only aircraft that send; their range is that of the sensor's `power_class`.
    bearing : array_like
        rad, clockwise from the ownship's nose. The arrays broadcast.
    closing : array_like
        Closing speed, m/s.
    rcs : array_like
        Radar cross-section of the intruder, m2.
    elevation : array_like
        rad, up from the horizon.

    Returns
    -------
    ndarray
        m; 0 outside the field of view.

    Raises
    ------
    ValueError
        If a bearing or elevation is not finite, or a speed or cross-section not finite and positive.
    """
    angle, speed = checked("bearing", bearing, FINITE), checked("closing", closing, POSITIVE)
    section = checked("rcs", rcs, POSITIVE)
    up = checked("elevation", elevation, FINITE)
    if not isinstance(sensor, AdsbSizingConfig):
        return confirmed_range(section, speed, sensor, azimuth=angle, elevation=up)
    _, speed, _, _ = np.broadcast_arrays(angle, speed, section, up)
    received = 1.0 - sensor.loss
    confirmed = confirmation_range(
        lambda ranges: np.full(ranges.shape, received),
        speed,
        update_interval=sensor.interval_s,
        range_limit=sensor.range_nmi * NAUTICAL_MILE,
        range_min=0.0,
        hits=sensor.confirm_hits,
        window=sensor.confirm_window,
        confirmed_with=sensor.confirmation_probability,
    )
    # The state that a message carries is old by the latency when it arrives.
    return np.maximum(confirmed - speed * sensor.latency_s, 0.0)


def protected(
    sensor: SensorConfig,
    aircraft: AircraftConfig,
    bearings: ArrayLike,
    intruder_speeds: ArrayLike,
    *,
    required_range: RequiredRangeFunction,
    rcs: ArrayLike = 1.0,
    ownship_speed: float | None = None,
) -> Protection:
    """Return from which bearings and intruder speeds a sensor on board protects an aircraft.

    Parameters
    ----------
    sensor : RadarConfig or AdsbSizingConfig
    aircraft : AircraftConfig
    bearings : array_like, shape (b,)
        rad, clockwise from the nose.
    intruder_speeds : array_like, shape (s,)
        m/s.
    required_range : callable
        See `RequiredRangeFunction`.
    rcs : array_like
        Radar cross-section of the intruders, m2; one, or one for each speed.
    ownship_speed : float or None
        m/s; None: the aircraft's cruise speed.

    Returns
    -------
    Protection

    Raises
    ------
    ValueError
        If a bearing is not finite, a speed or cross-section not finite and positive, an array not a list, what
        `required_range` returns negative or of another shape, or the sensor on the ground (see `ground_sizing`).
    """
    if isinstance(sensor, GroundRadarConfig):
        raise ValueError("sensor: a radar on the ground protects a volume, not bearings: use ground_sizing")
    angles, speeds = checked("bearings", bearings, FINITE), checked("intruder_speeds", intruder_speeds, POSITIVE)
    for name, array in (("bearings", angles), ("intruder_speeds", speeds)):
        if array.ndim != 1 or array.size == 0:
            raise ValueError(f"{name} must be a list of at least one number")
    section = checked("rcs", rcs, POSITIVE)
    if section.ndim > 1 or section.size not in (1, speeds.size):
        raise ValueError("rcs must be one number, or one for each of intruder_speeds")
    if ownship_speed is not None:
        speed = float(checked("ownship_speed", ownship_speed, POSITIVE))
        aircraft = aircraft.model_copy(update={"speed_cruise_mps": speed})
    own = aircraft.speed_cruise_mps
    grid_angle, grid_speed = np.meshgrid(angles, speeds, indexing="ij")
    closing = closing_speed(grid_angle, own, grid_speed)
    required = np.array(required_range(grid_angle, grid_speed, aircraft), dtype=np.float64)
    if required.shape != closing.shape or np.any(required < 0.0):
        raise ValueError("required_range must return a number of 0 or more for each bearing and speed")
    required[np.isnan(required)] = 0.0
    available = available_range(sensor, grid_angle, fastest_closing(grid_angle, own, grid_speed), rcs=section)
    margin = available - required
    return Protection(angles, speeds, closing, required, available, margin, margin >= 0.0)
