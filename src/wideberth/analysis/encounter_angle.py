"""From how far away an intruder must be detected at any bearing, so that a turn keeps it outside the safety radius.

The thesis (6.2.1) leaves other encounters than head-on as future work. Here the intruder comes from any bearing,
straight and level, at a given speed and on the worst of all courses that would lead it into the safety volume if the
ownship flew on: crossing, overtaking, and not only through the centre. The ownship waits for the computation time and
then makes the best of its turns. Without wind, at bearing 0 and for an intruder through the centre that comes head-on,
the range is `minimum_detection_range` by "tgvv".

Frame: bearings and courses clockwise from the ownship's heading before the turn; distances between the aircraft at the
moment of detection.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis import encounter_angle_kernels as kernels
from wideberth.analysis.inputs import checked_table
from wideberth.argument_checks import FINITE, NOT_NEGATIVE, FloatArray, checked, choice

Courses = Literal["entry", "collision"]
Side = Literal["best", "right", "left"]

SIDES: Mapping[str, tuple[float, ...]] = MappingProxyType({"best": (1.0, -1.0), "right": (1.0,), "left": (-1.0,)})
"""The sides to which the ownship may turn: 1 right, -1 left."""


@dataclass(frozen=True, slots=True)
class RequiredRange:
    """Required ranges, of the shape to which the arguments broadcast; shape () for numbers.

    Attributes
    ----------
    distance : ndarray
        m. 0 where no intruder of that speed can enter the safety volume from that bearing; infinite where no distance
        is enough, because the intruder stays on a collision course after the maneuver.
    intruder_course : ndarray
        The worst course, over ground, rad in [-pi, pi]; NaN where `distance` is 0.
    closing_speed : ndarray
        On that course before the maneuver, m/s; NaN where `distance` is 0.
    escape : ndarray of int
        Which of the possible maneuvers, in the order that the function states, is the best against the worst course; -1
        where the range is only bounded by straight flight passing outside.
    """

    distance: FloatArray
    intruder_course: FloatArray
    closing_speed: FloatArray
    escape: NDArray[np.int64]


def required_range(
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
    turn: Side = "best",
    turn_fractions: Sequence[float] = (1.0,),
    courses: Courses = "entry",
    tailwind: ArrayLike = 0.0,
    crosswind: ArrayLike = 0.0,
) -> RequiredRange:
    """Return from what distance on an intruder at a bearing must be detected to be avoided by a turn.

    From every distance at or beyond the one returned, one of the turns keeps the intruder outside the safety radius
    for ever, whatever its course. Arrays broadcast: bearings (n, 1) with intruder speeds (m,) give (n, m). It is
    fastest where the ownship's arguments are numbers, for its turn is then flown once.

    Parameters
    ----------
    bearing : array_like
        Of the intruder at detection, rad, any.
    ownship_speed : array_like
        Airspeed, m/s, positive.
    intruder_speed : array_like
        Over ground, m/s, not negative; without wind the same as its airspeed.
    safety_radius : array_like
        m.
    max_bank : array_like
        rad, below pi/2.
    computation_time : array_like
        From detection to the begin of the turn, s.
    turn_angle : array_like
        Of the heading, rad, in (0, pi].
    max_bank_rate : array_like
        rad/s; infinite where the aircraft banks at once.
    roll_time_constant : array_like
        s.
    turn : {"best", "right", "left"}
        Where the ownship may turn: where it is best for each course of the intruder, or always to one side.
    turn_fractions : sequence of float
        It may turn by these fractions of the turn angle, whichever is best. Abeam, a full turn of 90 degrees can be the
        wrong answer to an intruder that would have passed close by; several fractions ask for less range.
    courses : {"entry", "collision"}
        The intruder's courses: all that lead within the safety radius, or those that lead to the centre only. The
        latter takes a fiftieth of the time and is an under-estimate, except head-on.
    tailwind, crosswind : array_like
        Uniform wind along the ownship's heading and from its left to its right, m/s. It moves both aircraft alike;
        what it changes is how an intruder of a speed over ground moves through the air.

    Returns
    -------
    RequiredRange
        `escape` counts the fractions to the right (left with ``turn="left"``), then those to the left.

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.

    Notes
    -----
    The worst course is searched for: 999 of 1000 ranges fall short by less than 2e-5, the worst seen by 2e-4.

    For each course one escape is taken, safe from all distances from which the intruder would enter. An ownship that
    chose by the distance as well could do with less at some bearings abeam.
    """
    choice("turn", turn, tuple(SIDES))
    fractions = np.atleast_1d(np.asarray(turn_fractions, np.float64))
    if fractions.ndim != 1 or not fractions.size or not ((fractions > 0) & (fractions <= 1)).all():
        raise ValueError(f"turn_fractions must be one or more numbers above 0 and at most 1, got {turn_fractions!r}")
    sides = np.repeat(SIDES[turn], len(fractions))
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
            "tailwind": tailwind,
            "crosswind": crosswind,
        }
    )
    out, escape = np.empty((table.shape[1], 3)), np.empty(table.shape[1], np.int64)
    kernels.turn_ranges(sides, np.tile(fractions, len(SIDES[turn])), entry_only(courses), table, out, escape)
    return answer(out, escape, shape)


def entry_only(courses: str) -> bool:
    """Return whether all courses that enter are meant, and not only those through the centre."""
    choice("courses", courses, ("entry", "collision"))
    return courses == "entry"


def answer(out: FloatArray, escape: NDArray[np.int64], shape: tuple[int, ...]) -> RequiredRange:
    """Return what a kernel wrote, in the shape asked for."""
    distance, course, closing = (np.ascontiguousarray(column).reshape(shape) for column in out.T)
    return RequiredRange(distance, course, closing, escape.reshape(shape))


def collision_closing_speed(bearing: ArrayLike, ownship_speed: ArrayLike, intruder_speed: ArrayLike) -> FloatArray:
    """Return the largest speed at which an intruder at a bearing can close on a collision course.

    Parameters
    ----------
    bearing : array_like
        rad, clockwise from the ownship's course. The arguments broadcast.
    ownship_speed, intruder_speed : array_like
        m/s, not negative.

    Returns
    -------
    ndarray
        m/s; 0 where none can: an intruder that is slower reaches the ownship from bearings of less than
        asin(intruder_speed / ownship_speed) only.

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.
    """
    b = checked("bearing", bearing, FINITE)
    v_o = checked("ownship_speed", ownship_speed, NOT_NEGATIVE)
    v_i = checked("intruder_speed", intruder_speed, NOT_NEGATIVE)
    left = v_i**2 - (v_o * np.sin(b)) ** 2
    return np.where(left >= 0, np.maximum(v_o * np.cos(b) + np.sqrt(np.maximum(left, 0.0)), 0.0), 0.0)
