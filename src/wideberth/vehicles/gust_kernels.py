"""Compiled Dryden gusts: white noise through shaping filters, discretised exactly for a constant airspeed.

The filters are those of Beard and McLain, section 4.4. State ``g`` (5): the one of u, two of v, two of w. ``gust`` (6):
L_u, L_v, L_w (m), sigma_u, sigma_v, sigma_w (m/s).
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]

N_FILTER = 5
N_GUST = 6


@jit_uncounted
def decay_moment(order: int, x: float) -> float:
    """Return the integral of s^order exp(-x s) over s from 0 to 1, for x >= 0 and order 0, 1 or 2."""
    if x < 1.0:  # the closed form loses its digits to differences
        total, term = 0.0, 1.0
        for k in range(20):
            total += term / (k + order + 1.0)
            term *= -x / (k + 1.0)
        return total
    decay = math.exp(-x)
    if order == 0:
        return (1.0 - decay) / x
    if order == 1:
        return (1.0 - decay * (1.0 + x)) / (x * x)
    return (2.0 - decay * (2.0 + 2.0 * x + x * x)) / (x * x * x)


@jit_uncounted
def lateral_gust(g: FloatArray, first: int, rate: float, dt: float, n1: float, n2: float) -> float:
    """Advance (s + rate / sqrt(3)) / (s + rate)^2, driven by white noise of intensity 1, and return its output.

    `g[first]` and `g[first + 1]` are its states, `n1` and `n2` independent standard normal numbers.
    """
    decay, x = math.exp(-rate * dt), 2.0 * rate * dt
    # The noise of both states over the step has this covariance; its Cholesky factor spreads n1 and n2.
    q11, q12, q22 = dt * decay_moment(0, x), dt * dt * decay_moment(1, x), dt**3 * decay_moment(2, x)
    root = math.sqrt(q11)
    g[first + 1] = decay * (g[first + 1] + dt * g[first]) + q12 / root * n1
    g[first + 1] += math.sqrt(max(q22 - q12 * q12 / q11, 0.0)) * n2
    g[first] = decay * g[first] + root * n1
    return float(g[first] + rate * (1.0 / math.sqrt(3.0) - 1.0) * g[first + 1])


@jit_uncounted
def dryden_step(
    g: FloatArray, speed: float, dt: float, normals: FloatArray, gust: FloatArray
) -> tuple[float, float, float]:
    """Advance the filters by `dt` seconds at an airspeed (m/s, positive) and return the gust in body axes, m/s.

    `normals` (5) are independent standard normal numbers.
    """
    rate = speed / gust[0]
    g[0] = math.exp(-rate * dt) * g[0] + math.sqrt(dt * decay_moment(0, 2.0 * rate * dt)) * normals[0]
    along = gust[3] * math.sqrt(2.0 * rate) * g[0]
    rate = speed / gust[1]
    right = gust[4] * math.sqrt(3.0 * rate) * lateral_gust(g, 1, rate, dt, normals[1], normals[2])
    rate = speed / gust[2]
    below = gust[5] * math.sqrt(3.0 * rate) * lateral_gust(g, 3, rate, dt, normals[3], normals[4])
    return along, right, below


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    decay_moment(0, 0.1)
    lateral_gust(np.zeros(N_FILTER), 1, 1.0, 0.1, 0.0, 0.0)
    dryden_step(np.zeros(N_FILTER), 10.0, 0.1, np.zeros(5), np.ones(N_GUST))
