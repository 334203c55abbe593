"""Truncated Taylor series in time of many trajectories at once, with their exact derivatives to the start.

A `Series` holds the coefficients c_0, c_1, ... of a quantity along a trajectory and, for each coefficient, its
gradient to the start. Sums, products and functions of series follow by the usual recurrences, so that a Lie derivative
of order k is k! c_k, and its gradient a row of an observability matrix: exact but for rounding, without differences.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the coefficients (first axis) of a product."""
    first = a[0] * b[0]
    out = np.zeros((len(a), *first.shape))
    out[0] = first
    for k in range(1, len(a)):
        out[k] = sum(a[i] * b[k - i] for i in range(k + 1))
    return out


def _quotient(a: FloatArray, b: FloatArray) -> FloatArray:
    first = a[0] / b[0]
    out = np.zeros((len(a), *first.shape))
    out[0] = first
    for k in range(1, len(a)):
        out[k] = (a[k] - sum(out[i] * b[k - i] for i in range(k))) / b[0]
    return out


@dataclass(frozen=True)
class Series:
    """A quantity along trajectories.

    Parameters
    ----------
    value : ndarray, shape (orders, points)
        Taylor coefficients.
    gradient : ndarray, shape (orders, points, states)
        Their derivatives to the states at the start.
    """

    value: FloatArray
    gradient: FloatArray

    @cached_property
    def _wide(self) -> FloatArray:
        return self.value[..., None]

    def __add__(self, other: "Series") -> "Series":
        return Series(self.value + other.value, self.gradient + other.gradient)

    def __sub__(self, other: "Series") -> "Series":
        return Series(self.value - other.value, self.gradient - other.gradient)

    def __mul__(self, other: "Series") -> "Series":
        gradient = _product(self._wide, other.gradient) + _product(other._wide, self.gradient)
        return Series(_product(self.value, other.value), gradient)

    def __truediv__(self, other: "Series") -> "Series":
        value = _quotient(self.value, other.value)
        rest = self.gradient - _product(value[..., None], other.gradient)
        return Series(value, _quotient(rest, other._wide))

    def scaled(self, factor: float) -> "Series":
        """Return a multiple."""
        return Series(factor * self.value, factor * self.gradient)

    def shifted(self, constant: float) -> "Series":
        """Return the quantity plus a constant."""
        value = self.value.copy()
        value[0] += constant
        return Series(value, self.gradient)

    def derivative(self) -> "Series":
        """Return the derivative in time, one order shorter."""
        order = np.arange(1.0, len(self.value))
        return Series(self.value[1:] * order[:, None], self.gradient[1:] * order[:, None, None])

    def shortened(self) -> "Series":
        """Return the same without the highest order."""
        return Series(self.value[:-1], self.gradient[:-1])


def sqrt(a: Series) -> Series:
    """Return the square root of a series; NaN where it starts at zero."""
    value = np.zeros_like(a.value)
    value[0] = np.sqrt(a.value[0])
    for k in range(1, len(value)):
        value[k] = (a.value[k] - sum(value[i] * value[k - i] for i in range(1, k))) / (2.0 * value[0])
    return Series(value, _quotient(a.gradient, 2.0 * value[..., None]))


def sin_cos(a: Series) -> tuple[Series, Series]:
    """Return sine and cosine of a series."""
    s, c = np.zeros_like(a.value), np.zeros_like(a.value)
    s[0], c[0] = np.sin(a.value[0]), np.cos(a.value[0])
    for k in range(1, len(s)):
        s[k] = sum(i * a.value[i] * c[k - i] for i in range(1, k + 1)) / k
        c[k] = -sum(i * a.value[i] * s[k - i] for i in range(1, k + 1)) / k
    wide_s, wide_c = s[..., None], c[..., None]
    return Series(s, _product(wide_c, a.gradient)), Series(c, -_product(wide_s, a.gradient))


def atan2(y: Series, x: Series) -> Series:
    """Return the angle of a point; NaN derivatives where it starts at the origin."""
    square = _product(x.value, x.value) + _product(y.value, y.value)
    value = np.zeros_like(y.value)
    value[0] = np.arctan2(y.value[0], x.value[0])
    if len(value) > 1:
        order = np.arange(1.0, len(value))[:, None]
        turning = _product(x.value[:-1], y.value[1:] * order) - _product(y.value[:-1], x.value[1:] * order)
        value[1:] = _quotient(turning, square[:-1]) / order
    gradient = _product(x.value[..., None], y.gradient) - _product(y.value[..., None], x.gradient)
    return Series(value, _quotient(gradient, square[..., None]))
