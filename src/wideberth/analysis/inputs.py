"""What the questions about ranges accept: their arguments checked by name, and broadcast."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Domain:
    """An interval of finite numbers (`infinite` admits +inf too), and how to say it."""

    low: float
    high: float
    words: str
    low_open: bool = False
    high_open: bool = False
    infinite: bool = False

    def holds(self, value: FloatArray) -> NDArray[np.bool_]:
        """Return where values lie within; NaN never does."""
        above = value > self.low if self.low_open else value >= self.low
        below = value < self.high if self.high_open else value <= self.high
        return above & below & (np.isfinite(value) | self.infinite)


ANY = Domain(-math.inf, math.inf, "finite")
NOT_NEGATIVE = Domain(0.0, math.inf, "finite and not negative")
POSITIVE = Domain(0.0, math.inf, "finite and positive", low_open=True)
POSITIVE_OR_INFINITE = Domain(0.0, math.inf, "positive (infinite means at once)", low_open=True, infinite=True)
BANK = Domain(0.0, 0.5 * math.pi, "above 0 and below pi/2 (rad)", low_open=True, high_open=True)
TURN = Domain(0.0, math.pi, "above 0 and at most pi (rad)", low_open=True)

DOMAINS: Mapping[str, Domain] = {
    "ownship_speed": POSITIVE,
    "intruder_speed": NOT_NEGATIVE,
    "safety_radius": NOT_NEGATIVE,
    "computation_time": NOT_NEGATIVE,
    "max_bank": BANK,
    "turn_angle": TURN,
    "max_bank_rate": POSITIVE_OR_INFINITE,
    "roll_time_constant": NOT_NEGATIVE,
}
"""The arguments that all methods share."""


def checked(name: str, value: ArrayLike, domain: Domain | None = None) -> FloatArray:
    """Return an argument as an array.

    Parameters
    ----------
    name : str
        What the argument is called.
    value : array_like
    domain : Domain, optional
        What it may be; that of `DOMAINS` by default.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If an element lies outside; the message names the argument and says what it may be.
    """
    domain = DOMAINS[name] if domain is None else domain
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers, got {value!r}") from error
    good = domain.holds(array)
    if not good.all():
        raise ValueError(f"{name} must be {domain.words}, got {array[~good].flat[0]:g}")
    return array


def broadcast(arguments: Mapping[str, FloatArray]) -> tuple[FloatArray, tuple[int, ...]]:
    """Return arguments as a table, a row for each, and the shape that they broadcast to.

    Raises
    ------
    ValueError
        If they do not broadcast; the message names those that are no single numbers, with their shapes.
    """
    try:
        shape = np.broadcast_shapes(*(a.shape for a in arguments.values()))
    except ValueError as error:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arguments.items() if a.ndim)
        raise ValueError(f"shapes do not broadcast: {shapes}") from error
    table = np.empty((len(arguments), *shape))
    for k, array in enumerate(arguments.values()):
        table[k] = array
    return table.reshape(len(arguments), -1), shape
