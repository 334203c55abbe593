"""Naive twins of the Monte Carlo's scores: volumes by sampling, alarms by matrices and the normal distribution."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

FloatArray = NDArray[np.float64]


def way(a: FloatArray, b: FloatArray, n: int = 2001) -> FloatArray:
    """Return places on the straight way from `a` to `b`, (n, 3)."""
    return a + (b - a) * np.linspace(0.0, 1.0, n)[:, None]


def enters(places: FloatArray, radius: float, half_height: float) -> bool:
    """Return whether any place is inside a cylinder, bounds excluded."""
    inside = (np.hypot(places[:, 0], places[:, 1]) < radius) & (np.abs(places[:, 2]) < half_height)
    return bool(inside.any())


def ratios(places: FloatArray, radius: float, half_height: float) -> FloatArray:
    """Return max(horizontal / radius, vertical / half-height) of each place."""
    return np.maximum(np.hypot(places[:, 0], places[:, 1]) / radius, np.abs(places[:, 2]) / half_height)


def alarm_scores(
    s: FloatArray,
    v: FloatArray,
    covariance: FloatArray,
    volume: tuple[float, float],
    latest: float,
    noise: tuple[float, float, float, float],
    early: float,
    early_time: float,
) -> tuple[float, float, float, float]:
    """Return the scores of the four detectors for an intruder at `s` with `v`, of which line 1 holds.

    Parameters
    ----------
    s, v : ndarray, shape (3,)
    covariance : ndarray, shape (9, 9)
    volume : tuple of float
        Radius and half-height.
    latest : float
        The closest point is looked for in [0, latest].
    noise : tuple of float
        Sigma of position, velocity, altitude, climb rate.
    early, early_time : float
        Decimal orders by which the default is surer at that time and beyond.
    """
    t = min(max(-float(s[:2] @ v[:2]) / float(v[:2] @ v[:2]), 0.0), latest)
    miss = s + v * t
    d, h = math.hypot(miss[0], miss[1]), abs(miss[2])
    paper_d, paper_h = math.hypot(noise[0], t * noise[1]), math.hypot(noise[2], t * noise[3])
    predict = np.hstack([np.eye(3), t * np.eye(3)])
    p = predict @ covariance[:6, :6] @ predict.T
    e = miss[:2] / d
    sigma_d, sigma_h = math.sqrt(e @ p[:2, :2] @ e), math.sqrt(p[2, 2])
    inside = (norm.cdf(volume[0], d, sigma_d) - norm.cdf(-volume[0], d, sigma_d)) * (
        norm.cdf(volume[1], h, sigma_h) - norm.cdf(-volume[1], h, sigma_h)
    )
    surer = early * min(t / early_time, 1.0)
    return (
        max(d / volume[0], h / volume[1]),
        max((d - volume[0]) / paper_d, (h - volume[1]) / paper_h),
        max((d - volume[0]) / sigma_d, (h - volume[1]) / sigma_h),
        surer - math.log10(inside) if inside > 0.0 else math.inf,
    )
