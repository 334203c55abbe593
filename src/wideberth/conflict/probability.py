"""Probability that two aircraft in straight flight lose their separation (Paielli and Erzberger, 1997).

With the combined covariance S of the relative position and the unit normal e to the relative velocity, the miss
distance is e.dp with variance e.S e, so that no more than two values of the normal distribution are needed.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from wideberth.conflict import detection_kernels as kernels
from wideberth.conflict.cpa import horizontal_cpa
from wideberth.conflict.states import finite_array


def conflict_probability(
    relative_position: ArrayLike,
    relative_velocity: ArrayLike,
    covariance: ArrayLike,
    separation: float,
    half_height: float | None = None,
) -> float:
    """Return the probability that the separation at the closest point of approach is lost.

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (3,)
        NED, m and m/s.
    covariance : array_like, shape (3, 3)
        Of the relative position at the closest point of approach, both aircraft combined, m^2.
    separation : float
        Horizontal separation s_c, m.
    half_height : float, optional
        Vertical separation h_c, m; horizontal probability alone where absent.

    Returns
    -------
    float
        Phi((s_c - m) / sigma) - Phi((-s_c - m) / sigma), times the same in the vertical (level 3-D formula).

    Raises
    ------
    ValueError
        If an input is not finite, has another shape, or a separation is negative.

    Notes
    -----
    Where the closest point is past, the separation now is judged, along its own direction.
    """
    s = finite_array("relative_position", relative_position, "(3,)")
    v = finite_array("relative_velocity", relative_velocity, "(3,)")
    c = finite_array("covariance", covariance, "(3, 3)")
    if s.shape != (3,) or v.shape != (3,) or c.shape != (3, 3):
        raise ValueError(f"shapes must be (3,), (3,) and (3, 3), got {s.shape}, {v.shape} and {c.shape}")
    for name, value in (("separation", separation), ("half_height", 0.0 if half_height is None else half_height)):
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{name} must be finite and not negative, got {value}")
    t = max(float(horizontal_cpa(s, v)[0]), 0.0)
    e = np.array(kernels.miss_direction(s[0], s[1], v[0], v[1], t))
    mean = float(e @ (s[:2] + v[:2] * t))
    probability = kernels.band_probability(float(separation), mean, math.sqrt(max(float(e @ c[:2, :2] @ e), 0.0)))
    if half_height is not None:
        height = float(s[2] + v[2] * t)
        probability *= kernels.band_probability(float(half_height), height, math.sqrt(max(float(c[2, 2]), 0.0)))
    return probability
