"""Numbers that a caller hands in: refused by name where they make no sense."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def _refuse_unless(good: NDArray[np.bool_] | np.bool_, name: str, words: str) -> None:
    if not np.all(good):
        raise ValueError(f"{name} must be {words}")


def finite(name: str, value: ArrayLike) -> FloatArray:
    """Return the value as an array.

    Raises
    ------
    ValueError
        If an element is not a finite number.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers") from None
    _refuse_unless(np.isfinite(array), name, "finite")
    return array


def positive(name: str, value: ArrayLike) -> FloatArray:
    """Return the value as an array.

    Raises
    ------
    ValueError
        If an element is not finite and positive.
    """
    array = finite(name, value)
    _refuse_unless(array > 0, name, "positive")
    return array


def not_negative(name: str, value: ArrayLike) -> FloatArray:
    """Return the value as an array.

    Raises
    ------
    ValueError
        If an element is not finite, or negative.
    """
    array = finite(name, value)
    _refuse_unless(array >= 0, name, "0 or more")
    return array


def probability(name: str, value: ArrayLike, *, ends: bool = False) -> FloatArray:
    """Return the value as an array.

    Raises
    ------
    ValueError
        If an element is not between 0 and 1; these two are refused as well unless `ends`.
    """
    array = finite(name, value)
    inside = (array >= 0) & (array <= 1) if ends else (array > 0) & (array < 1)
    _refuse_unless(inside, name, "between 0 and 1" if ends else "more than 0 and less than 1")
    return array


def count(name: str, value: ArrayLike) -> FloatArray:
    """Return the value as an array.

    Raises
    ------
    ValueError
        If an element is not a whole number of at least 1.
    """
    array = finite(name, value)
    _refuse_unless((array >= 1) & (array == np.floor(array)), name, "a whole number of at least 1")
    return array


def choice(name: str, value: object, known: tuple[object, ...]) -> None:
    """Check that a value is one of those known.

    Raises
    ------
    ValueError
        If it is not.
    """
    if value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(str, known))}, not {value!r}")
