"""Measurement updates that all trackers share: Kalman and extended Kalman by independent elements, and unscented."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]

LOG_2PI = math.log(2.0 * math.pi)


@jit_uncounted
def update(
    n: int,
    m: int,
    x: FloatArray,
    p: FloatArray,
    h: FloatArray,
    innovation: FloatArray,
    variance: FloatArray,
    work: FloatArray,
) -> tuple[float, float]:
    """Update in place with m elements whose errors are independent, one after the other.

    Equal to (3.7)-(3.9) of the thesis with a diagonal R, without an inverse, and the covariance stays symmetric.

    Parameters
    ----------
    n, m : int
        Numbers of states and of elements.
    x : ndarray, shape (n,)
    p : ndarray, shape (n, n)
    h : ndarray, shape (m, n)
        Derivatives of the elements to the states, at the prediction.
    innovation : ndarray, shape (m,)
        Measured minus predicted; angles wrapped. NaN: not measured.
    variance : ndarray, shape (m,)
    work : ndarray, shape (2, n)
        Written over.

    Returns
    -------
    nis : float
        Normalised innovation squared of all elements together.
    log_likelihood : float
    """
    gain, moved = work[0], work[1]
    for i in range(n):
        moved[i] = 0.0
    nis, log_likelihood = 0.0, 0.0
    for k in range(m):
        error = innovation[k]
        if math.isnan(error):
            continue
        for i in range(n):
            error -= h[k, i] * moved[i]
        s = variance[k]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += p[i, j] * h[k, j]
            gain[i] = total
            s += total * h[k, i]
        nis += error * error / s
        log_likelihood -= 0.5 * (error * error / s + math.log(s) + LOG_2PI)
        for i in range(n):
            moved[i] += gain[i] * error / s
        for i in range(n):
            for j in range(i + 1):
                p[i, j] -= gain[i] * gain[j] / s
                p[j, i] = p[i, j]
    for i in range(n):
        x[i] += moved[i]
    return nis, log_likelihood


def warmup() -> None:
    """Compile what Python calls."""
    update(2, 1, np.zeros(2), np.eye(2), np.eye(2), np.ones(1), np.ones(1), np.zeros((2, 2)))
