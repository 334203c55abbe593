"""Where between bins a peak lies: the parabola, and the correction that spreads ranges evenly (thesis 5.6-5.8)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from wideberth.argument_checks import FINITE, POSITIVE, FloatArray, checked


def parabola_offset(left: ArrayLike, center: ArrayLike, right: ArrayLike) -> FloatArray:
    """Return where the parabola through three points, a bin apart, has its top (5.6).

    Parameters
    ----------
    left, center, right : array_like
        Magnitudes; they broadcast.

    Returns
    -------
    ndarray
        Bins from the center, within half a bin; 0 where the three lie on a line.

    Raises
    ------
    ValueError
        If one is not finite.
    """
    low, top, high = (checked(n, v, FINITE) for n, v in (("left", left), ("center", center), ("right", right)))
    bend = low - 2.0 * top + high
    bent = bend < 0.0
    offset = (low - high) / (2.0 * np.where(bent, bend, 1.0))
    return np.asarray(np.where(bent, np.clip(offset, -0.5, 0.5), 0.0))


@dataclass(frozen=True, slots=True)
class RangeSpread:
    """The correction of a parabola's offsets to evenly spread ones (5.7-5.8); the defaults are the thesis's.

    The printed factor of the beta density, 3.1871, is not that of its exponents, 2.4153; the distribution function is
    taken as it must be, from 0 to 1.

    Attributes
    ----------
    rate : float
        Of the exponential, 1/bin.
    alpha, beta : float
        Of the beta distribution, over 0 to 0.5.
    """

    rate: float = 9.18
    alpha: float = 0.6
    beta: float = 0.6

    def __post_init__(self) -> None:
        checked("rate, alpha and beta", [self.rate, self.alpha, self.beta], POSITIVE)

    def __call__(self, offset: ArrayLike) -> FloatArray:
        """Return corrected offsets.

        Parameters
        ----------
        offset : array_like
            Of `parabola_offset`, bins.

        Returns
        -------
        ndarray
            Bins, with the same sign, within half a bin.

        Raises
        ------
        ValueError
            If an offset is not finite.
        """
        x = checked("offset", offset, FINITE)
        return np.asarray(np.copysign(self.from_beta(self.to_beta(x)), x))

    def to_beta(self, offset: FloatArray) -> FloatArray:
        """Return beta distributed offsets, x_2 of (5.7), of the parabola's, both in bins: figure 5.8."""
        return np.asarray(-0.5 * np.expm1(-np.abs(offset) * self.rate))

    def from_beta(self, x: FloatArray) -> FloatArray:
        """Return evenly spread offsets of beta distributed ones (`to_beta`), both from 0 to 0.5: figure 5.9."""
        return np.asarray(0.5 * special.betainc(self.alpha, self.beta, 2.0 * x))


def fit_range_spread(offsets: ArrayLike) -> RangeSpread:
    """Return the correction whose parameters fit offsets of a target that moves evenly through many bins.

    The rate is one over the mean of the magnitudes (5.7), the beta's exponents are those of greatest likelihood.

    Parameters
    ----------
    offsets : array_like, shape (n,)
        Of `parabola_offset`, bins. 50 or more; some hundred are better.

    Returns
    -------
    RangeSpread

    Raises
    ------
    ValueError
        If there are fewer than 50, one is not finite, or all are 0.
    """
    x = np.abs(checked("offsets", offsets, FINITE)).ravel()
    if len(x) < 50:
        raise ValueError(f"offsets of 50 or more peaks are needed, got {len(x)}")
    if not x.any():
        raise ValueError("all offsets are 0: there is nothing to fit")
    rate = 1.0 / float(x.mean())
    alpha, beta, _, _ = stats.beta.fit(np.clip(-np.expm1(-x * rate), 1e-6, 1.0 - 1e-6), floc=0.0, fscale=1.0)
    return RangeSpread(rate, float(alpha), float(beta))
