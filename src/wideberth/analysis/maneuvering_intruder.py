"""From how far away an intruder must be detected that may itself maneuver, within limits.

The intruder is on a collision course; after detection it may make one turn, beginning at any time, and may go to its
slowest or fastest speed. The ownship turns once, to the side that is better against the worst of that, and does not
look again: where the limits let the intruder turn onto a new collision course, no distance is enough. A `horizon` asks
for safety until then only: the time by which the ownship will have decided anew.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis import maneuvering_intruder_kernels as kernels
from wideberth.analysis.encounter_angle import SIDES, Side
from wideberth.analysis.inputs import checked_table
from wideberth.argument_checks import FloatArray, choice


@dataclass(frozen=True, slots=True)
class ManeuveringRange:
    """Required ranges against a maneuvering intruder, of the shape to which the arguments broadcast; () for numbers.

    Attributes
    ----------
    distance : ndarray
        m. 0 where there is no collision course from that bearing; infinite where no distance is enough.
    intruder_course : ndarray
        At detection, clockwise from the ownship's, rad; NaN where `distance` is 0, as the following.
    turn_start : ndarray
        When the worst turn of the intruder begins, s after detection.
    turn : ndarray
        The worst turn, rad, positive to the right; NaN where one onto a new collision course makes `distance` infinite.
    final_speed : ndarray
        The worst speed, m/s.
    escape : ndarray of int
        The ownship's turn: 0 right, 1 left (0 with ``turn="left"``); -1 where `distance` is 0.
    """

    distance: FloatArray
    intruder_course: FloatArray
    turn_start: FloatArray
    turn: FloatArray
    final_speed: FloatArray
    escape: NDArray[np.int64]


def maneuvering_intruder_range(
    bearing: ArrayLike,
    *,
    ownship_speed: ArrayLike,
    intruder_speed: ArrayLike,
    safety_radius: ArrayLike,
    max_bank: ArrayLike,
    computation_time: ArrayLike,
    turn_angle: ArrayLike,
    max_bank_rate: ArrayLike,
    roll_time_constant: ArrayLike,
    intruder_turn_angle: ArrayLike,
    intruder_turn_rate: ArrayLike,
    intruder_acceleration: ArrayLike = 0.0,
    intruder_slowest: ArrayLike | None = None,
    intruder_fastest: ArrayLike | None = None,
    horizon: ArrayLike = math.inf,
    turn: Side = "best",
) -> ManeuveringRange:
    """Return from what distance on a turn avoids an intruder at a bearing whatever it does within its limits.

    All arguments but `turn` broadcast; those not listed are as in `encounter_angle.required_range`. An element takes
    milliseconds.

    Parameters
    ----------
    bearing, ownship_speed, intruder_speed, safety_radius, max_bank, computation_time, turn_angle : array_like
    max_bank_rate, roll_time_constant : array_like
    intruder_turn_angle : array_like
        The most it turns, to either side, rad, in [0, pi].
    intruder_turn_rate : array_like
        rad/s, positive.
    intruder_acceleration : array_like
        Along its course, m/s2, not negative; 0: it keeps its speed.
    intruder_slowest, intruder_fastest : array_like, optional
        Its speeds, m/s; by default `intruder_speed`. Needs an acceleration.
    horizon : array_like
        s after detection until which separation is asked for; infinite for ever.
    turn : {"best", "right", "left"}
        Where the ownship turns.

    Returns
    -------
    ManeuveringRange

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.

    Notes
    -----
    The worst maneuver is searched for on a grid that closes in on it, to about 1e-3 of the range.
    """
    choice("turn", turn, tuple(SIDES))
    table, shape = checked_table(
        {
            "bearing": bearing,
            "ownship_speed": ownship_speed,
            "intruder_speed": intruder_speed,
            "safety_radius": safety_radius,
            "computation_time": computation_time,
            "max_bank": max_bank,
            "turn_angle": turn_angle,
            "max_bank_rate": max_bank_rate,
            "roll_time_constant": roll_time_constant,
            "intruder_turn_angle": intruder_turn_angle,
            "intruder_turn_rate": intruder_turn_rate,
            "intruder_acceleration": intruder_acceleration,
            "intruder_slowest": intruder_speed if intruder_slowest is None else intruder_slowest,
            "intruder_fastest": intruder_speed if intruder_fastest is None else intruder_fastest,
            "horizon": horizon,
        }
    )
    if (table[12] > table[2]).any():
        raise ValueError("intruder_slowest must be at most intruder_speed")
    if (table[13] < table[2]).any():
        raise ValueError("intruder_fastest must be at least intruder_speed")
    out, side = np.empty((table.shape[1], 5)), np.empty(table.shape[1], np.int64)
    kernels.maneuvering_ranges(np.array(SIDES[turn]), table[:9], np.ascontiguousarray(table[9:].T), out, side)
    distance, course, start, angle, final = (np.ascontiguousarray(column).reshape(shape) for column in out.T)
    return ManeuveringRange(distance, course, start, angle, final, side.reshape(shape))
