"""Numbers that a caller hands in: refused by name where they make no sense."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Domain:
    """An interval of finite numbers (`infinite` admits +inf too, `whole` only whole ones), and how to say it."""

    low: float
    high: float
    words: str
    low_open: bool = False
    high_open: bool = False
    infinite: bool = False
    whole: bool = False

    def holds(self, value: FloatArray) -> NDArray[np.bool_]:
        """Return where values lie within; NaN never does."""
        above = value > self.low if self.low_open else value >= self.low
        below = value < self.high if self.high_open else value <= self.high
        inside = above & below & (np.isfinite(value) | self.infinite)
        return inside & (value == np.floor(value)) if self.whole else inside


FINITE = Domain(-math.inf, math.inf, "finite")
NOT_NEGATIVE = Domain(0.0, math.inf, "finite and not negative")
POSITIVE = Domain(0.0, math.inf, "positive and finite", low_open=True)
POSITIVE_OR_INFINITE = Domain(0.0, math.inf, "positive (infinite means at once)", low_open=True, infinite=True)
PROBABILITY = Domain(0.0, 1.0, "between 0 and 1")
UNSURE = Domain(0.0, 1.0, "more than 0 and less than 1", low_open=True, high_open=True)
COUNT = Domain(1.0, math.inf, "a whole number of at least 1", whole=True)


def checked(name: str, value: ArrayLike, domain: Domain) -> FloatArray:
    """Return an argument as an array.

    Parameters
    ----------
    name : str
        What the argument is called.
    value : array_like
    domain : Domain
        What it may be.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If an element lies outside; the message names the argument and says what it may be.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers, got {value!r}") from error
    good = domain.holds(array)
    if not good.all():
        raise ValueError(f"{name} must be {domain.words}, got {array[~good].flat[0]:g}")
    return array


def choice(name: str, value: object, known: tuple[object, ...]) -> None:
    """Check that a value is one of those known.

    Raises
    ------
    ValueError
        If it is not; the message names the argument and lists them.
    """
    if value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(str, known))}, not {value!r}")
