"""The closest approach that an avoiding turn leaves: what a detection range is worth (thesis, 2.2, figure 2.8)."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wideberth.analysis import cpa_simulation_kernels as kernels
from wideberth.analysis.escape_path_kernels import MAX_ROWS, N_COLUMNS, path_at, turn_path
from wideberth.analysis.inputs import checked_table
from wideberth.argument_checks import NOT_NEGATIVE, FloatArray, checked, choice


@dataclass(frozen=True, slots=True)
class ClosestApproach:
    """A closest point of approach; numbers where all arguments were numbers, else arrays.

    Attributes
    ----------
    cpa : float or ndarray
        Distance there, m.
    t_cpa : float or ndarray
        Its time since detection, s.
    """

    cpa: float | FloatArray
    t_cpa: float | FloatArray


def simulate_cpa(
    distance: ArrayLike,
    *,
    ownship_speed: ArrayLike,
    intruder_speed: ArrayLike,
    max_bank: ArrayLike,
    computation_time: ArrayLike,
    turn_angle: ArrayLike,
    max_bank_rate: ArrayLike,
    roll_time_constant: ArrayLike,
    bearing: ArrayLike = 0.0,
    intruder_course: ArrayLike = math.pi,
    turn: Literal["right", "left"] = "right",
) -> ClosestApproach:
    """Fly an encounter in which the ownship turns with the bank dynamics of "tgvv", and return the closest approach.

    Head-on by default. All arguments but `turn` broadcast; those not listed are as in
    `detection_range.minimum_detection_range`.

    Parameters
    ----------
    distance : array_like
        Between the aircraft at detection, m.
    ownship_speed, intruder_speed, max_bank, computation_time, turn_angle : array_like
    max_bank_rate, roll_time_constant : array_like
    bearing : array_like
        Of the intruder at detection, clockwise from the ownship's course, rad.
    intruder_course : array_like
        Clockwise from the ownship's course, rad.
    turn : {"right", "left"}
        Where the ownship turns.

    Returns
    -------
    ClosestApproach

    Raises
    ------
    ValueError
        If an element of an argument is out of its range; the message names it.
    """
    choice("turn", turn, ("right", "left"))
    table, shape = checked_table(
        {
            "distance": distance,
            "bearing": bearing,
            "intruder_course": intruder_course,
            "ownship_speed": ownship_speed,
            "intruder_speed": intruder_speed,
            "max_bank": max_bank,
            "computation_time": computation_time,
            "turn_angle": turn_angle,
            "max_bank_rate": max_bank_rate,
            "roll_time_constant": roll_time_constant,
        }
    )
    if turn == "left":
        table[1:3] *= -1.0  # bearing and course: the mirror image
    cpa, t_cpa = np.empty(table.shape[1]), np.empty(table.shape[1])
    kernels.closest_approaches(table, cpa, t_cpa)
    if not shape:
        return ClosestApproach(float(cpa[0]), float(t_cpa[0]))
    return ClosestApproach(cpa.reshape(shape), t_cpa.reshape(shape))


def relative_range(
    times: ArrayLike,
    distance: float,
    *,
    ownship_speed: float,
    intruder_speed: float,
    max_bank: float,
    computation_time: float,
    turn_angle: float,
    max_bank_rate: float,
    roll_time_constant: float,
) -> FloatArray:
    """Return the distance between the aircraft of one head-on encounter as `simulate_cpa` flies it, at given times.

    Parameters
    ----------
    times : array_like, shape (n,)
        Since detection, s, not negative.
    distance : float
        Between the aircraft at detection, m.
    ownship_speed, intruder_speed, max_bank, computation_time, turn_angle, max_bank_rate, roll_time_constant : float
        As in `detection_range.minimum_detection_range`.

    Returns
    -------
    ndarray, shape (n,)
        m.

    Raises
    ------
    ValueError
        If an argument is out of its range; the message names it.
    """
    table, _ = checked_table(
        {
            "distance": distance,
            "ownship_speed": ownship_speed,
            "intruder_speed": intruder_speed,
            "max_bank": max_bank,
            "computation_time": computation_time,
            "turn_angle": turn_angle,
            "max_bank_rate": max_bank_rate,
            "roll_time_constant": roll_time_constant,
        }
    )
    d, v_o, v_i, bank, wait, turn, rate, tau = table[:, 0]
    at = np.atleast_1d(checked("times", times, NOT_NEGATIVE))
    path, state, ranges = np.empty((MAX_ROWS, N_COLUMNS)), np.empty(4), np.empty(len(at))
    n = turn_path(v_o, wait, turn, bank, rate, tau, 1.0, path)
    for k, t in enumerate(at):
        path_at(path, n, t, 0, state)
        ranges[k] = math.hypot(d - v_i * t - state[0], state[1])
    return ranges
