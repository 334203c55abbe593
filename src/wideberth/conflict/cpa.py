"""Closest point of approach of aircraft in straight flight."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.conflict.states import finite_array

FloatArray = NDArray[np.float64]


def horizontal_cpa(relative_position: ArrayLike, relative_velocity: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return time and distance of the horizontal closest point of approach.

    Parameters
    ----------
    relative_position, relative_velocity : array_like, shape (..., 2) or (..., 3)
        North, east (and down, not used), m and m/s.

    Returns
    -------
    t_cpa, d_cpa : ndarray, shape (...)
        s from now, negative where it is past, 0 without relative motion; and the distance, m.

    Raises
    ------
    ValueError
        If an input is not finite or has another shape.
    """
    s, v = _pair(relative_position, relative_velocity, (2, 3))
    return _cpa(s[..., :2], v[..., :2])


def spatial_cpa(relative_position: ArrayLike, relative_velocity: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return time and distance of the closest point of approach in space; arguments (..., 3) as in `horizontal_cpa`."""
    return _cpa(*_pair(relative_position, relative_velocity, (3,)))


def _pair(position: ArrayLike, velocity: ArrayLike, sizes: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    s = finite_array("relative_position", position, "(..., 3)")
    v = finite_array("relative_velocity", velocity, "(..., 3)")
    if s.shape[-1] not in sizes or v.shape[-1] != s.shape[-1]:
        raise ValueError(f"relative position and velocity must both be (..., {sizes[-1]}), got {s.shape} and {v.shape}")
    return s, v


def _cpa(s: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    speed = np.linalg.norm(v, axis=-1)
    moving = speed > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        # The direction first: squares of tiny speeds would underflow.
        e = np.where(moving[..., None], v / speed[..., None], 0.0)
        t = np.where(moving, -np.sum(s * e, axis=-1) / speed, 0.0)
    miss = s - e * np.sum(s * e, axis=-1)[..., None]
    return t, np.linalg.norm(miss, axis=-1)
