"""How an echo's power is spread over range bins, and whether adjacent bins are over their thresholds."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted

FloatArray = NDArray[np.float64]


@jit_uncounted
def shifted_sinc(sine: float, rest: float, whole: int) -> float:
    """Return sin(pi x) / (pi x) at x = rest + whole, given ``sine = sin(pi rest)``."""
    x = rest + whole
    if x == 0.0:
        return 1.0
    return (sine if whole % 2 == 0 else -sine) / (math.pi * x)


@jit_uncounted
def bin_response(sine: float, rest: float, whole: int, hann: bool) -> float:
    """Return the magnitude of a bin so many bins (`shifted_sinc`) from a target, the target's own power being 1."""
    response = shifted_sinc(sine, rest, whole)
    if hann:
        response += 0.5 * (shifted_sinc(sine, rest, whole - 1) + shifted_sinc(sine, rest, whole + 1))
    return abs(response)


@jit_uncounted
def spread_power(
    at: FloatArray, rate: FloatArray, times: FloatArray, hann: bool, coherent: bool, noise_gain: float, out: FloatArray
) -> None:
    """Fill `out` (k, 2 reach + 1) with each echo's share of power in the bins around it.

    Parameters
    ----------
    at : ndarray, shape (k,)
        Of the echo from the middle of its bin in the middle of the frame, bins.
    rate : ndarray, shape (k,)
        Bins a second.
    times : ndarray, shape (sweeps,)
        Of the sweeps from the middle of the frame, s.
    hann, coherent : bool
        Window; whether amplitudes are summed, or powers.
    noise_gain : float
        Noise power of a windowed bin over that of a rectangular one.
    """
    reach = out.shape[1] // 2
    n = times.shape[0]
    out[:] = 0.0
    for i in range(out.shape[0]):
        for s in range(n):
            away = at[i] + rate[i] * times[s]
            near = math.floor(away + 0.5)
            # One sine for all bins: they are whole numbers apart.
            sine, rest = math.sin(math.pi * (away - near)), away - near
            for b in range(out.shape[1]):
                response = bin_response(sine, rest, int(near) - (b - reach), hann)
                out[i, b] += response if coherent else response * response
        for b in range(out.shape[1]):
            mean = out[i, b] / n
            out[i, b] = (mean * mean if coherent else mean) / noise_gain


@jit
def group_probabilities(p: FloatArray, group: int, out: FloatArray) -> None:
    """Fill `out` (k,) with the probability that `group` adjacent bins are over their thresholds, each as `p` (k, bins).

    The bins are independent.
    """
    runs = np.empty(group)  # probability of 0, 1, ... bins over their thresholds up to here
    for i in range(p.shape[0]):
        runs[:] = 0.0
        runs[0] = 1.0
        found = 0.0
        for b in range(p.shape[1]):
            over = p[i, b]
            found += over * runs[group - 1]
            ended = 0.0
            for k in range(group):
                ended += runs[k]
            for k in range(group - 1, 0, -1):
                runs[k] = runs[k - 1] * over
            runs[0] = (1.0 - over) * ended
        out[i] = found


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    one = np.ones(1)
    bin_response(1.0, 0.5, 0, True)
    spread_power(one, one, one, True, True, 1.0, np.empty((1, 3)))
    group_probabilities(np.ones((1, 3)), 2, np.empty(1))
