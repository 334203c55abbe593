"""Checking and shaping of the states of aircraft pairs."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def finite_array(name: str, value: ArrayLike, shape: str) -> FloatArray:
    """Return a contiguous array of finite numbers; a ValueError names the argument and its expected shape otherwise."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {shape}: {error}") from None
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains values that are not finite")
    return array


def pair_states(
    own_position: ArrayLike, own_velocity: ArrayLike, intruder_position: ArrayLike, intruder_velocity: ArrayLike
) -> tuple[tuple[FloatArray, FloatArray, FloatArray, FloatArray], int, bool]:
    """Check the states of aircraft pairs.

    Returns
    -------
    states : tuple of ndarray, each of shape (n, 3) or (1, 3)
        Contiguous, in the order of the arguments.
    n : int
        Number of pairs.
    single : bool
        Whether every argument was a single state of shape (3,).

    Raises
    ------
    ValueError
        Naming the argument that is not finite, not of shape (n, 3) or (3,), or of another length.
    """
    arrays = []
    count, single, counted = 1, True, ""
    for name, value in (
        ("own_position", own_position),
        ("own_velocity", own_velocity),
        ("intruder_position", intruder_position),
        ("intruder_velocity", intruder_velocity),
    ):
        array = np.asarray(finite_array(name, value, "(n, 3) or (3,)"))
        if np.ndim(value) not in (1, 2) or array.shape[-1] != 3:
            raise ValueError(f"{name} must have shape (n, 3) or (3,), got {np.shape(value)}")
        if array.ndim == 2:
            single = False
            if array.shape[0] != 1:
                if counted and array.shape[0] != count:
                    raise ValueError(f"{name} has {array.shape[0]} rows but {counted} has {count}")
                count, counted = array.shape[0], name
        arrays.append(array.reshape(-1, 3))
    return (arrays[0], arrays[1], arrays[2], arrays[3]), count, single
