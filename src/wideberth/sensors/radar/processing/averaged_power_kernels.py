"""Averaged power of a range-compressed image, with the Hann window put to its spectrum in the same pass."""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

FloatArray = NDArray[np.float64]

_BLOCK = 8  # sweeps summed in single precision, which is as good as the image's


@jit
def add_powers(
    rows: NDArray[np.float32], hann: bool, before: FloatArray, after: FloatArray, power: FloatArray, mean: FloatArray
) -> None:
    """Sum the powers of one channel over sweeps, and its values.

    Parameters
    ----------
    rows : ndarray of float32, shape (sweeps, 2 bins)
        The image, real and imaginary parts in turn.
    hann : bool
        Whether each bin less half of each neighbour is taken: the Hann window, with the gain 1 for a target.
    before, after : ndarray, shape (sweeps, 2)
        What stands before the first and after the last bin.
    power : ndarray, shape (bins,)
        Set to the sum of squared magnitudes.
    mean : ndarray, shape (2 bins,)
        Set to the sum of the values, where it is not empty.
    """
    sweeps, n = rows.shape
    sums = np.zeros(n)
    wanted = mean.shape[0] == n
    if wanted:
        mean[:] = 0.0
    value, block = np.zeros(n, dtype=np.float32), np.zeros(n, dtype=np.float32)
    for s in range(sweeps):
        row = rows[s]
        if hann:
            for j in range(2, n - 2):
                value[j] = row[j] - np.float32(0.5) * (row[j - 2] + row[j + 2])
            for part in range(2):
                right = row[2 + part] if n > 2 else after[s, part]
                left = row[n - 4 + part] if n > 2 else before[s, part]
                value[n - 2 + part] = row[n - 2 + part] - 0.5 * (left + after[s, part])
                value[part] = row[part] - 0.5 * (before[s, part] + right)
        else:
            for j in range(n):
                value[j] = row[j]
        if wanted:
            # The mean's power will be taken off: what moves is the small difference of sums.
            for j in range(n):
                v = np.float64(value[j])
                sums[j] += v * v
                mean[j] += v
            continue
        for j in range(n):
            block[j] += value[j] * value[j]
        if s % _BLOCK == _BLOCK - 1 or s == sweeps - 1:
            for j in range(n):
                sums[j] += block[j]
                block[j] = np.float32(0.0)
    for k in range(n // 2):
        power[k] = sums[2 * k] + sums[2 * k + 1]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    rows = np.zeros((2, 8), np.float32)
    edge = np.zeros((2, 2))
    add_powers(rows, True, edge, edge, np.zeros(4), np.zeros(8))
