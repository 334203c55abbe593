"""Small dense algebra without allocation: the leading n x n part of buffers that the caller owns."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]


@jit_uncounted
def cholesky(a: FloatArray, n: int, out: FloatArray) -> bool:
    """Write the lower factor of a symmetric matrix; return whether the matrix is positive definite.

    The upper triangle of `out` is left as it is.
    """
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= out[i, k] * out[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                out[i, i] = math.sqrt(total)
            else:
                out[i, j] = total / out[j, j]
    return True


@jit_uncounted
def solve_cholesky(factor: FloatArray, n: int, b: FloatArray) -> None:
    """Solve L L' x = b in place."""
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= factor[i, k] * b[k]
        b[i] = total / factor[i, i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, n):
            total -= factor[k, i] * b[k]
        b[i] = total / factor[i, i]


@jit_uncounted
def whitened_square(factor: FloatArray, n: int, b: FloatArray, work: FloatArray) -> float:
    """Return b' (L L')^-1 b."""
    square = 0.0
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= factor[i, k] * work[k]
        work[i] = total / factor[i, i]
        square += work[i] * work[i]
    return square


@jit_uncounted
def log_determinant(factor: FloatArray, n: int) -> float:
    """Return log det (L L')."""
    total = 0.0
    for i in range(n):
        total += math.log(factor[i, i])
    return 2.0 * total


@jit_uncounted
def congruence(f: FloatArray, p: FloatArray, n: int, m: int, work: FloatArray, out: FloatArray) -> None:
    """Write F P F' for F (m, n) and a symmetric P (n, n); `work` holds (m, n), and `out` may be P where m = n."""
    for i in range(m):
        for j in range(n):
            work[i, j] = 0.0
        for k in range(n):
            value = f[i, k]
            if value != 0.0:
                for j in range(n):
                    work[i, j] += value * p[k, j]
    for i in range(m):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += work[i, k] * f[j, k]
            out[i, j] = total
            out[j, i] = total


def warmup() -> None:
    """Compile what Python calls."""
    a, out, work = np.eye(2), np.zeros((2, 2)), np.zeros((2, 2))
    cholesky(a, 2, out)
    solve_cholesky(out, 2, np.ones(2))
    whitened_square(out, 2, np.ones(2), np.zeros(2))
    log_determinant(out, 2)
    congruence(a, a, 2, 2, work, out)
