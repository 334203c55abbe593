"""What range bins make of an echo, as one would first write it: every sweep, every bin, every run of bins."""

import itertools

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def spread_power(
    at: FloatArray, rate: FloatArray, times: FloatArray, hann: bool, coherent: bool, reach: int
) -> FloatArray:
    """Return shares of power (k, 2 reach + 1) without the noise gain; arguments as of the kernel."""
    away = at[:, None, None] + rate[:, None, None] * times[:, None] - np.arange(-reach, reach + 1)
    response = np.sinc(away)
    if hann:
        response = response + 0.5 * (np.sinc(away - 1.0) + np.sinc(away + 1.0))
    response = np.abs(response)
    return np.asarray(response.mean(axis=1) ** 2 if coherent else (response**2).mean(axis=1))


def group_probability(p: FloatArray, group: int) -> float:
    """Return the probability of a run of `group` bins or more, by all outcomes; `p` is (bins,)."""
    total = 0.0
    for outcome in itertools.product((0, 1), repeat=len(p)):
        chance = float(np.prod(np.where(outcome, p, 1.0 - p)))
        total += chance * ("1" * group in "".join(map(str, outcome)))
    return total
