"""Averaged power of a range-compressed image, with the Hann window put to its spectrum in the same pass."""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

FloatArray = NDArray[np.float64]


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
    value = np.zeros(n)
    wanted = mean.shape[0] == n
    if wanted:
        mean[:] = 0.0
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
        for j in range(n):
            sums[j] += value[j] * value[j]
        if wanted:
            for j in range(n):
                mean[j] += value[j]
    for k in range(n // 2):
        power[k] = sums[2 * k] + sums[2 * k + 1]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    rows = np.zeros((2, 8), np.float32)
    edge = np.zeros((2, 2))
    add_powers(rows, True, edge, edge, np.zeros(4), np.zeros(8))
