"""Algorithms 1 and 2 of the ADS-B paper: will an intruder come within a collision or self-separation distance?

Line 1 asks for a time t in (0, T] at which the intruder is near (d_th, h_th) or converging with little time left
(tau_th); it is solved in closed form, not sampled. Line 2 compares the separation at the closest point of approach with
(d_c, h_c); algorithm 2 first takes m1 and m2 standard deviations off it.
"""

import math
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.conflict import detection_kernels as kernels
from wideberth.conflict.states import finite_array, pair_states
from wideberth.conflict.uncertainty import PAPER_NOISE, ConstantNoise
from wideberth.units import FOOT, NAUTICAL_MILE

FloatArray = NDArray[np.float64]
Variant = Literal["printed", "corrected"]


@dataclass(frozen=True, slots=True)
class DetectionRules:
    """Thresholds of algorithms 1 and 2; m and s.

    Attributes
    ----------
    d_th, h_th : float
        Horizontal and vertical distance within which an intruder is looked at.
    tau_th : float
        Time to the closest point, or to the vertical zone, within which a converging intruder is looked at.
    d_c, h_c : float
        Separation that must not be lost at the closest point of approach.
    lookahead : float
        T.
    m1, m2 : float
        Standard deviations taken off the horizontal and vertical separation (algorithm 2).
    heights : {"half", "full"}
        Whether `h_th` and `h_c` are half-heights (the paper's numbers: +-700 ft, +-100 ft) or full heights, which
        line 1 and line 2 halve as printed.

    Raises
    ------
    ValueError
        If a value is negative or not finite.
    """

    d_th: float
    h_th: float
    tau_th: float
    d_c: float
    h_c: float
    lookahead: float
    m1: float = 1.0
    m2: float = 1.0
    heights: Literal["half", "full"] = "half"

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name != "heights" and not (math.isfinite(value) and value >= 0):
                raise ValueError(f"detection rules: {item.name} must be finite and not negative, got {value}")
        if self.heights not in ("half", "full"):
            raise ValueError(f"detection rules: heights must be 'half' or 'full', got {self.heights!r}")

    def array(self, *, uncertain: bool = True) -> FloatArray:
        """Return the values in the kernel's order, heights halved where full; without `uncertain` m1 = m2 = 0."""
        half = 0.5 if self.heights == "full" else 1.0
        m1, m2 = (self.m1, self.m2) if uncertain else (0.0, 0.0)
        return np.array(
            [self.d_th, self.h_th * half, self.tau_th, self.d_c, self.h_c * half, m1, m2, self.lookahead], float
        )


# ADS-B paper, simulation section; look-ahead and the reading of the heights: ERRATA, ADS-B paper.
PAPER_SELF_SEPARATION = DetectionRules(5 * NAUTICAL_MILE, 1000 * FOOT, 45.0, 4000 * FOOT, 700 * FOOT, 110.0)
PAPER_COLLISION = DetectionRules(4000 * FOOT, 700 * FOOT, 35.0, 500 * FOOT, 100 * FOOT, 60.0)


@dataclass(frozen=True, slots=True)
class Detection:
    """What algorithm 1 or 2 says of each pair; arrays of shape (n,), or () for a single pair.

    Attributes
    ----------
    detected : ndarray of bool
    t_detected : ndarray
        First time within the look-ahead at which line 1 holds, s from now; NaN where nothing is detected.
    t_cpa : ndarray
        Time of the closest point of approach that is judged, s from now.
    d_cpa, h_cpa : ndarray
        Horizontal and vertical separation there, m, not negative.
    sigma_dcpa, sigma_hcpa : ndarray
        Their standard deviations, m; 0 for algorithm 1.
    """

    detected: NDArray[np.bool_]
    t_detected: FloatArray
    t_cpa: FloatArray
    d_cpa: FloatArray
    h_cpa: FloatArray
    sigma_dcpa: FloatArray
    sigma_hcpa: FloatArray


def algorithm_1(
    rules: DetectionRules,
    own_position: ArrayLike,
    own_velocity: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    *,
    variant: Variant = "corrected",
) -> Detection:
    """Detect conflicts or collisions of aircraft whose states are known (ADS-B paper, algorithm 1).

    Parameters
    ----------
    rules : DetectionRules
        `m1` and `m2` are not used.
    own_position, own_velocity, intruder_position, intruder_velocity : array_like, shape (n, 3) or (3,)
        Local NED, m and m/s. A single state serves all pairs.
    variant : {"corrected", "printed"}
        ``"printed"`` judges the closest point of approach even where it is past, or beyond everything that line 1 looks
        at; ``"corrected"`` takes the nearest point between now and T + tau_th.

    Returns
    -------
    Detection

    Raises
    ------
    ValueError
        If an input is not finite or has another shape.
    """
    return _run(
        rules.array(uncertain=False),
        pair_states(own_position, own_velocity, intruder_position, intruder_velocity),
        np.zeros((6, 6)),
        np.zeros((1, 9, 9)),
        PAPER_NOISE,
        kernels.SIGMA_NONE,
        variant,
    )


def algorithm_2(
    rules: DetectionRules,
    own_position: ArrayLike,
    own_velocity: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    *,
    noise: ConstantNoise = PAPER_NOISE,
    intruder_covariance: ArrayLike | None = None,
    own_covariance: ArrayLike | None = None,
    variant: Variant = "corrected",
) -> Detection:
    """Detect conflicts or collisions of aircraft whose states are uncertain (ADS-B paper, algorithm 2).

    Parameters
    ----------
    rules, own_position, own_velocity, intruder_position, intruder_velocity, variant
        As in `algorithm_1`. ``variant="printed"`` also lets the variance grow with t in place of t^2.
    noise : ConstantNoise
        Standard deviations, used where no covariance is given.
    intruder_covariance : array_like, shape (n, 9, 9) or (9, 9), optional
        Covariance of position, velocity, acceleration of each track; projected to the closest point of approach and
        onto the direction of the miss. The acceleration is not used: the prediction is straight.
    own_covariance : array_like, shape (6, 6), optional
        Covariance of the ownship's position and velocity, used together with the track's; zero if absent.

    Returns
    -------
    Detection

    Raises
    ------
    ValueError
        If an input is not finite or has another shape.
    """
    states = pair_states(own_position, own_velocity, intruder_position, intruder_velocity)
    covariance, own = np.zeros((1, 9, 9)), np.zeros((6, 6))
    if intruder_covariance is not None:
        covariance = finite_array("intruder_covariance", intruder_covariance, "(n, 9, 9) or (9, 9)")
        if covariance.shape[-2:] != (9, 9) or covariance.ndim not in (2, 3):
            raise ValueError(f"intruder_covariance must have shape (n, 9, 9) or (9, 9), got {covariance.shape}")
        covariance = covariance.reshape(-1, 9, 9)
        if covariance.shape[0] not in (1, states[1]):
            raise ValueError(f"intruder_covariance has {covariance.shape[0]} rows but there are {states[1]} pairs")
    if own_covariance is not None:
        own = finite_array("own_covariance", own_covariance, "(6, 6)")
        if own.shape != (6, 6):
            raise ValueError(f"own_covariance must have shape (6, 6), got {own.shape}")
    source = kernels.SIGMA_PAPER if intruder_covariance is None else kernels.SIGMA_TRACK
    return _run(rules.array(), states, own, covariance, noise, source, variant)


def _run(
    rules: FloatArray,
    pairs: tuple[tuple[FloatArray, FloatArray, FloatArray, FloatArray], int, bool],
    own_covariance: FloatArray,
    covariance: FloatArray,
    noise: ConstantNoise,
    source: int,
    variant: Variant,
) -> Detection:
    if variant not in ("printed", "corrected"):
        raise ValueError(f"variant must be 'printed' or 'corrected', got {variant!r}")
    (own_p, own_v, p, v), n, single = pairs
    out = np.empty((n, 7))
    kernels.detect_all(
        own_p,
        own_v,
        own_covariance,
        p,
        v,
        covariance,
        rules,
        noise.array(),
        noise.noisy_aircraft,
        source,
        variant == "printed",
        out,
    )
    columns = [out[:, k].reshape(()) if single else out[:, k].copy() for k in range(7)]
    return Detection(np.asarray(columns[0] > 0.5), *columns[1:])
