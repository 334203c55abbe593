"""Averaged power of a range-compressed image, with the Hann window put to its spectrum in the same pass."""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

FloatArray = NDArray[np.float64]

_BLOCK = 8  # sweeps summed in single precision, which is as good as the image's


@jit
def add_powers(
    values: NDArray[np.float32],
    step: int,
    hann: bool,
    before: FloatArray,
    after: FloatArray,
    power: FloatArray,
    mean: FloatArray,
) -> None:
    """Sum the powers of one channel over sweeps, and its values.

    Parameters
    ----------
    values : ndarray of float32, shape (n,)
        The image, real and imaginary parts in turn, from the first sweep of the channel on. In one dimension the
        compiler knows that they are adjacent, and takes several at once: four times as fast.
    step : int
        Numbers from one sweep to the next.
    hann : bool
        Whether each bin less half of each neighbour is taken: the Hann window, with the gain 1 for a target.
    before, after : ndarray, shape (sweeps, 2)
        What stands before the first and after the last bin.
    power : ndarray, shape (bins,)
        Set to the sum of squared magnitudes.
    mean : ndarray, shape (2 bins,)
        Set to the sum of the values, where it is not empty.
    """
    sweeps, n = before.shape[0], 2 * power.shape[0]
    sums = np.zeros(n)
    wanted = mean.shape[0] == n
    if wanted:
        mean[:] = 0.0
    block = np.zeros(n, dtype=np.float32)
    half = np.float32(0.5 if hann else 0.0)
    for s in range(sweeps):
        row = values[s * step : s * step + n]
        if wanted:
            # The mean's power will be taken off: what moves is the small difference of sums.
            for j in range(2, n - 2):
                v = np.float64(row[j] - half * (row[j - 2] + row[j + 2]))
                sums[j] += v * v
                mean[j] += v
        else:
            for j in range(2, n - 2):
                u = row[j] - half * (row[j - 2] + row[j + 2])
                block[j] += u * u
        for part in range(2):
            right = row[2 + part] if n > 2 else after[s, part]
            left = row[n - 4 + part] if n > 2 else before[s, part]
            for j, beside in ((part, before[s, part] + right), (n - 2 + part, left + after[s, part])):
                if j == part or n > 2:
                    v = row[j] - half * beside
                    sums[j] += v * v
                    if wanted:
                        mean[j] += v
        if s % _BLOCK == _BLOCK - 1 or s == sweeps - 1:
            for j in range(n):
                sums[j] += block[j]
                block[j] = np.float32(0.0)
    for k in range(n // 2):
        power[k] = sums[2 * k] + sums[2 * k + 1]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    edge, values = np.zeros((2, 2)), np.zeros(16, np.float32)
    values.flags.writeable = False
    add_powers(values, 8, True, edge, edge, np.zeros(4), np.zeros(8))
