"""The minimum detection range: how far away an intruder must be detected to be avoided by a turn.

Thesis (Wikle, 2017), chapter 2: a direct head-on approach at one altitude. The ownship flies straight on for the
computation time, then turns by the turn angle and flies straight; the intruder flies straight. The four methods differ
in how they take the turn:

====== ======================== ===============================================================================
method equations                turn
====== ======================== ===============================================================================
"tgvv" (2.22), (2.23), app. A   the bank follows the ailerons with a lag: the true range
"gvv"  (2.37), (2.46)           the bank is there at once
"tt"   (2.4), Geyer et al.      as "gvv", for the time in which a turn leads abeam by the radius (to first order)
"gt"   (2.5), Sahawneh et al.   as "gvv", the circle of the turn tangent to the safety circle; falls short
====== ======================== ===============================================================================

Other encounters: `encounter_angle`, `maneuvering_intruder`; other maneuvers: `vertical_escape`, `speed_change`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.analysis import detection_range_kernels as kernels
from wideberth.analysis.cpa_simulation import ClosestApproach, simulate_cpa
from wideberth.analysis.inputs import checked_table
from wideberth.argument_checks import FloatArray, choice
from wideberth.units import DEGREE, FOOT, KNOT, NAUTICAL_MILE

__all__ = [
    "COLLISION_AVOIDANCE",
    "METHODS",
    "SELF_SEPARATION",
    "ClosestApproach",
    "DetectionRange",
    "minimum_detection_range",
    "simulate_cpa",
]

Method = Literal["tgvv", "gvv", "tt", "gt"]

METHODS: Mapping[str, int] = MappingProxyType(
    {"tgvv": kernels.TGVV, "gvv": kernels.GVV, "tt": kernels.TT, "gt": kernels.GT}
)
"""The methods, with the number by which the kernels know them."""

COLLISION_AVOIDANCE: Mapping[str, float] = MappingProxyType(
    {
        "intruder_speed": 150.0 * KNOT,
        "safety_radius": 500.0 * FOOT,
        "max_bank": 30.0 * DEGREE,
        "computation_time": 5.0,
        "turn_angle": 90.0 * DEGREE,
        "max_bank_rate": 30.0 * DEGREE,
        "roll_time_constant": 0.5,
    }
)
"""The nominal arguments of table 2.3."""

SELF_SEPARATION: Mapping[str, float] = MappingProxyType(
    {
        "safety_radius": 0.75 * NAUTICAL_MILE,
        "max_bank": 5.0 * DEGREE,
        "computation_time": 20.0,
        "turn_angle": 15.0 * DEGREE,
        "max_bank_rate": 10.0 * DEGREE,
        "roll_time_constant": 0.5,
    }
)
"""The arguments of figure 2.12; its computation time holds the pilot's delay (see `time_line`)."""


@dataclass(frozen=True, slots=True)
class DetectionRange:
    """A minimum detection range; numbers where all arguments were numbers, else arrays.

    Attributes
    ----------
    distance : float or ndarray
        m, between the aircraft at the moment of detection.
    maneuver_time : float or ndarray
        Time from the begin of the turn to the closest point of approach, s.
    case : {"A", "B"} or {1, 2} or ndarray or None
        "tgvv": whether the largest bank is reached (A) or not (B). "gvv": whether the closest point of approach comes
        after the turn (1) or within it (2). None for the other methods.
    """

    distance: float | FloatArray
    maneuver_time: float | FloatArray
    case: str | int | NDArray[np.str_] | NDArray[np.int64] | None


def minimum_detection_range(
    *,
    method: Method,
    ownship_speed: ArrayLike,
    intruder_speed: ArrayLike,
    safety_radius: ArrayLike,
    max_bank: ArrayLike,
    computation_time: ArrayLike,
    turn_angle: ArrayLike | None = None,
    max_bank_rate: ArrayLike | None = None,
    roll_time_constant: ArrayLike | None = None,
    slack: ArrayLike = 0.0,
) -> DetectionRange:
    """Return the distance at which a head-on intruder must be detected so that it passes outside the safety radius.

    All arguments but `method` broadcast.

    Parameters
    ----------
    method : {"tgvv", "gvv", "tt", "gt"}
    ownship_speed : array_like
        m/s, at least 1e-6.
    intruder_speed : array_like
        m/s, not negative.
    safety_radius : array_like
        R_s, m.
    max_bank : array_like
        rad, at least 1e-6 and below pi/2.
    computation_time : array_like
        t_c, s: from detection to the begin of the turn.
    turn_angle : array_like, optional
        chi_t, rad, in (0, pi]; "tgvv" and "gvv" need it. The thesis stops at pi/2. A half turn needs to lead abeam by
        the safety radius.
    max_bank_rate : array_like, optional
        rad/s; infinite where the aircraft banks at once. "tgvv" needs it.
    roll_time_constant : array_like, optional
        Of the lag of the roll rate, s; 0 for none. "tgvv" needs it.
    slack : array_like, optional
        delta_r: the distance is multiplied by 1 + delta_r. For "gt" only, which falls short.

    Returns
    -------
    DetectionRange

    Raises
    ------
    ValueError
        If an argument is missing or an element of it out of its range; the message names it.
    """
    choice("method", method, tuple(METHODS))
    arguments = {
        "ownship_speed": ownship_speed,
        "intruder_speed": intruder_speed,
        "safety_radius": safety_radius,
        "max_bank": max_bank,
    }
    optional = {"turn_angle": turn_angle, "max_bank_rate": max_bank_rate, "roll_time_constant": roll_time_constant}
    needed = {"tgvv": tuple(optional), "gvv": ("turn_angle",)}.get(method, ())
    for name, value in optional.items():
        if value is None and name in needed:
            raise ValueError(f"{name} is needed by method {method!r}")
        arguments[name] = 1.0 if value is None else value
    table, shape = checked_table({**arguments, "computation_time": computation_time, "slack": slack})
    v_o, v_i, *_, t_c, delta = table
    if method != "gt" and delta.any():
        raise ValueError(f"slack belongs to method 'gt', not to {method!r}")
    n = table.shape[1]
    distance, time, case = np.empty(n), np.empty(n), np.empty(n, np.int64)
    kernels.detection_ranges(METHODS[method], table[:-2], distance, time, case)
    if np.isnan(distance).any():
        raise ValueError("turn_angle: a half turn does not lead abeam by the safety radius; turn less, or bank less")
    distance = ((v_o + v_i) * t_c + distance) * (1.0 + delta)
    named = np.array(["", "A", "B"])[case] if method == "tgvv" else case
    if not shape:
        return DetectionRange(float(distance[0]), float(time[0]), named[0].item() if needed else None)
    return DetectionRange(distance.reshape(shape), time.reshape(shape), named.reshape(shape) if needed else None)
