"""Naive twins of the ADS-B error model: straight from the definitions."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

FloatArray = NDArray[np.float64]


def truth(
    t: float, t0: float, t1: float, p0: FloatArray, v0: FloatArray, p1: FloatArray, v1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at a time: the spline between, straight on outside."""
    if np.isnan(p0[0]) or t >= t1:
        return p1 + v1 * (t - t1), v1
    if t <= t0:
        return p0 + v0 * (t - t0), v0
    spline = CubicHermiteSpline([t0, t1], [p0, p1], [v0, v1])
    return spline(t), spline(t, 1)


def encoded(value: float, step: float) -> float:
    return value if step == 0 else math.floor(value / step + 0.5) * step


def report(
    position: FloatArray, velocity: FloatArray, error: FloatArray, gross: FloatArray, swapped: bool, n: FloatArray
) -> FloatArray:
    """Return z of the paper's default model with white altitude error, in the paper's units."""
    ft, kt = 0.3048, 1852 / 3600
    fpm = ft / 60
    sigma_v = 10.0 / math.sqrt(-2 * math.log(0.05))
    horizontal = [encoded(x, 5.0) for x in position[:2] + error + gross]
    north, east = (encoded(x, kt) for x in velocity[:2] + sigma_v * n[2:4])
    if swapped:
        north, east = east, north
    down = encoded(position[2] + 75.9 * ft * n[4], 25 * ft)
    sigma_c = 27.96 * fpm if abs(velocity[2]) <= 500 * fpm else 0.05 / 1.645 * abs(velocity[2])
    climb = encoded(velocity[2] + sigma_c * n[5], 64 * fpm)
    return np.array([*horizontal, down, north, east, climb])
