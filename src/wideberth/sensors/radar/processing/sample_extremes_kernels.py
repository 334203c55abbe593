"""Greatest and least sample of each sweep and channel, in one pass over a frame."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

_LANES = 64  # samples taken side by side


@jit
def sample_extremes(values: NDArray[np.float32], high: NDArray[np.float32], low: NDArray[np.float32]) -> None:
    """Fill `high` and `low` (rows,) with the greatest and least of each row of `values` (rows * n,).

    NaN where a sample is not finite.
    """
    n = values.shape[0] // high.shape[0]
    top, bottom, odd = np.empty(_LANES, np.float32), np.empty(_LANES, np.float32), np.empty(_LANES, np.float32)
    whole = n // _LANES * _LANES
    for r in range(high.shape[0]):
        row = values[r * n : (r + 1) * n]
        for j in range(_LANES):
            top[j], bottom[j], odd[j] = row[0], row[0], np.float32(0.0)
        for start in range(0, whole, _LANES):
            part = row[start : start + _LANES]
            for j in range(_LANES):
                v = part[j]
                top[j] = v if v > top[j] else top[j]
                bottom[j] = v if v < bottom[j] else bottom[j]
                odd[j] += v - v  # not 0 of what is not finite
        for j in range(n - whole):
            v = row[whole + j]
            top[j] = v if v > top[j] else top[j]
            bottom[j] = v if v < bottom[j] else bottom[j]
            odd[j] += v - v
        greatest, least, finite = top[0], bottom[0], True
        for j in range(_LANES):
            greatest = max(greatest, top[j])
            least = min(least, bottom[j])
            finite = finite and odd[j] == 0.0
        high[r], low[r] = (greatest, least) if finite else (np.float32(math.nan), np.float32(math.nan))


def warmup() -> None:
    """Compile what Python calls, for samples that may be written and that may not."""
    extreme = np.zeros(2, np.float32)
    for writeable in (True, False):
        values = np.zeros(4, np.float32)
        values.flags.writeable = writeable
        sample_extremes(values, extreme, extreme)
