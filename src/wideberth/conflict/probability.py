"""Probability of losing separation: in straight flight (Paielli and Erzberger, 1997), and along waypoints.

With the combined covariance S of the relative position and the unit normal e to the relative velocity, the miss
distance is e.dp with variance e.S e, so that no more than two values of the normal distribution are needed.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import POSITIVE, POSITIVE_OR_INFINITE
from wideberth.conflict import probability_kernels as kernels
from wideberth.conflict.cylinder import checked_path, scalar, vector
from wideberth.conflict.states import finite_array

FloatArray = NDArray[np.float64]

_ROUNDING = 1e-9  # of the largest element: asymmetry and negative eigenvalues that are only rounding


def conflict_probability(
    relative_position: ArrayLike,
    relative_velocity: ArrayLike,
    covariance: ArrayLike,
    radius: float,
    half_height: float | None = None,
) -> float | FloatArray:
    """Return the probability that the separation at the closest point of approach is lost.

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (..., 3) or (..., 2)
        NED, m and m/s.
    covariance : array_like, shape (..., 3, 3) or (..., 2, 2)
        Of the relative position at the closest point of approach, both aircraft combined, m^2. The leading dimensions
        of all three go together as numpy's do.
    radius : float
        Horizontal separation s_c, m.
    half_height : float, optional
        Vertical separation h_c, m, which needs three dimensions; horizontal probability alone where absent or infinite.

    Returns
    -------
    float, or ndarray of the leading dimensions
        Phi((s_c - m) / sigma) - Phi((-s_c - m) / sigma), times the same in the vertical (level 3-D formula; errata,
        "Conflict probability").

    Raises
    ------
    ValueError
        If an input is not finite or has another shape, a separation is not positive, or a covariance is not symmetric
        and positive semi-definite.

    Notes
    -----
    Where the closest point is past, the separation now is judged, along its own direction. Without horizontal relative
    velocity it is the probability of being inside the disc; its height is then judged where it comes nearest to ours.
    Past the closest point this is more than drawing gives, as the disc counts as endless across. Height and miss
    distance are taken as independent, as the formula has it: their covariance is not used.
    """
    s = finite_array("relative_position", relative_position, "(..., 3) or (..., 2)")
    v = finite_array("relative_velocity", relative_velocity, "(..., 3) or (..., 2)")
    c = finite_array("covariance", covariance, "(..., 3, 3) or (..., 2, 2)")
    if s.shape[-1] not in (2, 3) or v.shape[-1] != s.shape[-1] or c.ndim < 2 or c.shape[-2:] != 2 * s.shape[-1:]:
        raise ValueError(
            "shapes must be (..., 3), (..., 3) and (..., 3, 3), or with 2 in place of 3,"
            f" got {s.shape}, {v.shape} and {c.shape}"
        )
    dimensions = s.shape[-1]
    if half_height is not None and dimensions == 2:
        raise ValueError("half_height needs states and covariances of three dimensions")
    _check_covariance(c)
    try:
        shape = np.broadcast_shapes(s.shape[:-1], v.shape[:-1], c.shape[:-2])
    except ValueError:
        raise ValueError(f"leading dimensions do not fit together: {s.shape}, {v.shape} and {c.shape}") from None
    n = math.prod(shape)
    positions, velocities, covariances = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3, 3))
    positions[:, :dimensions] = np.broadcast_to(s, (*shape, dimensions)).reshape(n, dimensions)
    velocities[:, :dimensions] = np.broadcast_to(v, (*shape, dimensions)).reshape(n, dimensions)
    covariances[:, :dimensions, :dimensions] = np.broadcast_to(c, (*shape, dimensions, dimensions)).reshape(
        n, dimensions, dimensions
    )
    out = np.empty(n)
    kernels.passing_probabilities(
        positions,
        velocities,
        covariances,
        scalar("radius", radius, POSITIVE),
        math.inf if half_height in (None, math.inf) else scalar("half_height", half_height, POSITIVE),
        out,
    )
    return float(out[0]) if not shape else out.reshape(shape)


def path_conflict_probability(
    *,
    own_position: ArrayLike,
    own_speed: ArrayLike,
    waypoints: ArrayLike,
    intruder_position: ArrayLike,
    intruder_velocity: ArrayLike,
    covariance: ArrayLike,
    safety_radius: float,
    safety_height: float,
    lookahead: float = math.inf,
) -> FloatArray:
    """Return the probability of a conflict on each segment of the ownship's path.

    Parameters
    ----------
    own_position, own_speed, waypoints, intruder_position, intruder_velocity, safety_radius, safety_height
        As for `cylinder.path_conflict`; states are means.
    covariance : array_like, shape (6, 6)
        Of the relative position and velocity now, both aircraft combined (SI).
    lookahead : float
        Nothing is judged later, s; needed where the ownship stands still.

    Returns
    -------
    ndarray, shape (n,)
        At least one segment sees a conflict with a probability between the largest of them and their sum.

    Raises
    ------
    ValueError
        As `cylinder.path_conflict` and `conflict_probability`, or if an endless segment has no look-ahead.

    Notes
    -----
    The integral over the disc swept in a segment is exact for a known velocity. The velocity's uncertainty enters by
    what it makes of the position at the closest point of the segment, which stands for the whole segment; height and
    horizontal miss are taken as independent.
    """
    path = checked_path(
        own_position=own_position,
        own_speed=own_speed,
        waypoints=waypoints,
        safety_radius=safety_radius,
        safety_height=safety_height,
        distance_threshold=math.inf,
        height_threshold=math.inf,
        time_threshold=math.inf,
        beyond="along_last_leg",
    )
    p, v = vector("intruder_position", intruder_position), vector("intruder_velocity", intruder_velocity)
    c = finite_array("covariance", covariance, "(6, 6)")
    if c.shape != (6, 6):
        raise ValueError(f"covariance must have shape (6, 6), got {c.shape}")
    _check_covariance(c)
    until = scalar("lookahead", lookahead, POSITIVE_OR_INFINITE)
    if math.isinf(until) and not path.speeds.all():
        raise ValueError("a segment with own_speed 0 does not end: give a finite lookahead")
    out = np.empty(path.waypoints.shape[0])
    kernels.path_probabilities(
        path.own_position,
        path.speeds,
        path.waypoints,
        p,
        v,
        np.array(c),
        until,
        path.radius,
        path.half_height,
        out,
    )
    return out


def _check_covariance(c: FloatArray) -> None:
    scale = _ROUNDING * float(np.abs(c).max(initial=0.0))
    if (np.abs(c - np.swapaxes(c, -1, -2)) > scale).any():
        raise ValueError("covariance must be symmetric")
    if c.size and float(np.linalg.eigvalsh(c).min()) < -scale:
        raise ValueError("covariance must be positive semi-definite: it has a negative eigenvalue")
