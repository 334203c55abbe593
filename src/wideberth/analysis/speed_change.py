"""From how far away an intruder must be detected so that slowing down, stopping or stepping aside is enough.

For a multirotor, whose velocity changes without a turn. Stopping resolves no head-on approach, for the intruder comes
all the way: the range is then infinite. Frame and notions as in `encounter_angle`.
"""

import numpy as np
from numpy.typing import ArrayLike

from wideberth.analysis import encounter_angle_kernels as kernels
from wideberth.analysis.encounter_angle import SIDES, Courses, RequiredRange, Side, answer, entry_only
from wideberth.analysis.inputs import checked_table
from wideberth.argument_checks import choice


def speed_change_range(
    bearing: ArrayLike,
    *,
    ownship_speed: ArrayLike,
    intruder_speed: ArrayLike,
    safety_radius: ArrayLike,
    computation_time: ArrayLike,
    new_speed: ArrayLike,
    acceleration: ArrayLike,
    time_constant: ArrayLike = 0.0,
    new_course: ArrayLike = 0.0,
    turn: Side = "best",
    courses: Courses = "entry",
) -> RequiredRange:
    """Return from what distance on an intruder at a bearing must be detected to be avoided by a change of velocity.

    The velocity goes straight to the new one with (new - velocity) / time constant, limited to `acceleration`. All
    arguments but `turn` and `courses` broadcast. Speeds are over ground: a multirotor stops over ground.

    Parameters
    ----------
    bearing : array_like
        Of the intruder at detection, clockwise from the ownship's course, rad, any.
    ownship_speed : array_like
        m/s, positive.
    intruder_speed : array_like
        m/s, not negative.
    safety_radius : array_like
        m.
    computation_time : array_like
        From detection to the begin of the maneuver, s.
    new_speed : array_like
        m/s, not negative; 0 stops.
    acceleration : array_like
        Its limit, m/s2; infinite for none.
    time_constant : array_like
        s; 0 for no lag.
    new_course : array_like
        By how much the course changes, rad: pi/2 with the same speed steps aside, pi flies back.
    turn : {"best", "right", "left"}
        The side to which the course changes.
    courses : {"entry", "collision"}
        As in `encounter_angle.required_range`.

    Returns
    -------
    RequiredRange
        `escape`: 0 to the right, 1 to the left (0 with ``turn="left"``).

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.
    """
    choice("turn", turn, tuple(SIDES))
    table, shape = checked_table(
        {
            "bearing": bearing,
            "ownship_speed": ownship_speed,
            "intruder_speed": intruder_speed,
            "safety_radius": safety_radius,
            "computation_time": computation_time,
            "new_speed": new_speed,
            "new_course": new_course,
            "acceleration": acceleration,
            "time_constant": time_constant,
        }
    )
    out, escape = np.empty((table.shape[1], 3)), np.empty(table.shape[1], np.int64)
    kernels.velocity_change_ranges(np.array(SIDES[turn]), entry_only(courses), table, out, escape)
    return answer(out, escape, shape)
