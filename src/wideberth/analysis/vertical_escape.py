"""From how far away an intruder must be detected so that climbing or descending is enough.

The ownship keeps its horizontal velocity and gains height; it must have gained half of the safety volume's height
before the intruder is within the safety radius (thesis, 2.1: the second kind of maneuver). Frame and notions as in
`encounter_angle`.
"""

import numpy as np
from numpy.typing import ArrayLike

from wideberth.analysis import encounter_angle_kernels as kernels
from wideberth.analysis.encounter_angle import Courses, RequiredRange, answer, entry_only
from wideberth.analysis.inputs import checked_table


def vertical_escape_range(
    bearing: ArrayLike,
    *,
    ownship_speed: ArrayLike,
    intruder_speed: ArrayLike,
    safety_radius: ArrayLike,
    half_height: ArrayLike,
    computation_time: ArrayLike,
    climb_rate: ArrayLike,
    descent_rate: ArrayLike,
    vertical_acceleration: ArrayLike,
    time_constant: ArrayLike = 0.0,
    intruder_climb_rate: ArrayLike = 0.0,
    courses: Courses = "entry",
) -> RequiredRange:
    """Return from what distance on an intruder at a bearing must be detected to be avoided by climbing or descending.

    The vertical speed goes from 0 to its new value with (new - speed) / time constant, limited to
    `vertical_acceleration`. All arguments but `courses` broadcast.

    Parameters
    ----------
    bearing : array_like
        Of the intruder at detection, clockwise from the ownship's course, rad, any.
    ownship_speed, intruder_speed : array_like
        Horizontal, m/s; the ownship's positive, the intruder's not negative.
    safety_radius, half_height : array_like
        Of the safety volume: R_s and h_s / 2, m.
    computation_time : array_like
        From detection to the begin of the maneuver, s.
    climb_rate, descent_rate : array_like
        Of the ownship, m/s, not negative; 0 where it cannot or must not.
    vertical_acceleration : array_like
        Its limit, m/s2; infinite for none.
    time_constant : array_like
        s; 0 for no lag.
    intruder_climb_rate : array_like
        m/s, positive up, constant: the intruder would be level with the ownship at the closest point of approach.
    courses : {"entry", "collision"}
        As in `encounter_angle.required_range`.

    Returns
    -------
    RequiredRange
        `escape`: 0 to climb, 1 to descend. Infinite where neither can.

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.
    """
    table, shape = checked_table(
        {
            "bearing": bearing,
            "ownship_speed": ownship_speed,
            "intruder_speed": intruder_speed,
            "safety_radius": safety_radius,
            "half_height": half_height,
            "computation_time": computation_time,
            "climb_rate": climb_rate,
            "descent_rate": descent_rate,
            "vertical_acceleration": vertical_acceleration,
            "time_constant": time_constant,
            "intruder_climb_rate": intruder_climb_rate,
        }
    )
    half, wait, up, down, acceleration, tau, intruder = table[4:]
    climbs = np.stack(
        [
            np.stack([wait, half, rate, acceleration, tau, sense * intruder], axis=-1)
            for rate, sense in ((up, 1.0), (down, -1.0))
        ],
        axis=1,
    )
    out, escape = np.empty((table.shape[1], 3)), np.empty(table.shape[1], np.int64)
    kernels.climb_ranges(entry_only(courses), table[:4], climbs, out, escape)
    return answer(out, escape, shape)
