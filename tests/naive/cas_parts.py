"""Naive twins of predictions and thresholds: fine grids of time, full matrices, and drawing."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

FloatArray = NDArray[np.float64]


def closest_of(positions: FloatArray, times: FloatArray) -> tuple[float, float]:
    """Time and distance of the closest of many relative positions."""
    distances = np.linalg.norm(positions, axis=1)
    k = int(np.argmin(distances))
    return float(times[k]), float(distances[k])


def accelerated(p: FloatArray, v: FloatArray, a: FloatArray, hold: float, times: FloatArray) -> FloatArray:
    """Relative positions at times: accelerated at first, then straight on."""
    curved = np.minimum(times, hold)[:, None]
    straight = np.maximum(times - hold, 0.0)[:, None]
    places: FloatArray = p + v * curved + a * curved**2 / 2 + (v + a * hold) * straight
    return places


def along(path: FloatArray, times: FloatArray) -> FloatArray:
    """Places along nodes of time and place."""
    return np.array([np.interp(times, path[:, 0], path[:, k]) for k in (1, 2, 3)]).T


def kalman(
    messages: list[tuple[float, FloatArray, FloatArray]],
    start: FloatArray,
    spread: FloatArray,
    density: float,
    order: int,
) -> tuple[FloatArray, FloatArray]:
    """State and covariance of one axis after messages: time, values (NaN where missing), variances.

    The process noise is integrated in small steps.
    """
    x, c, now = start[:order].copy(), np.diag(spread[:order]), messages[0][0]
    for time, values, variances in messages[1:]:
        n = 2000
        dt = (time - now) / n
        f = np.eye(order) + dt * np.eye(order, k=1)
        if order == 3:
            f[0, 2] = dt * dt / 2
        noise = np.zeros((order, order))
        noise[-1, -1] = density * dt
        for _ in range(n if dt > 0 else 0):
            x, c = f @ x, f @ c @ f.T + noise
        now = time
        rows = [k for k in range(order) if np.isfinite(values[k])]
        h = np.eye(order)[rows]
        gain = c @ h.T @ np.linalg.inv(h @ c @ h.T + np.diag(variances[rows]))
        x, c = x + gain @ (values[rows] - h @ x), c - gain @ h @ c
    return x, c


def widened_separation(d: float, sigma: float, alert: float) -> float:
    """Largest mean miss distance with at least that probability of a miss below d, on a fine grid."""
    m = np.linspace(d, d + 6 * sigma, 20_001)
    enough = norm.cdf((d - m) / sigma) - norm.cdf((-d - m) / sigma) >= alert
    return float(m[enough].max(initial=d))


def drawn_violations(
    t_star: float,
    miss: float,
    speed: float,
    sigmas: tuple[float, float],
    density: float,
    until: float,
    separation: float,
    n: int,
    random: np.random.Generator,
) -> float:
    """Share of drawn courses that come too close; white acceleration in many small kicks."""
    steps = 400 if density > 0 else 1
    dt = until / steps
    p = np.array([-speed * t_star, miss, 0.0]) + sigmas[0] * random.normal(size=(n, 3))
    v = np.array([speed, 0.0, 0.0]) + sigmas[1] * random.normal(size=(n, 3))
    close = np.zeros(n, bool)
    for _ in range(steps):
        vv = np.maximum((v * v).sum(axis=1), 1e-12)
        t = np.clip(-(p * v).sum(axis=1) / vv, 0.0, dt)[:, None]
        close |= np.linalg.norm(p + v * t, axis=1) < separation
        p = p + v * dt
        v = v + math.sqrt(density * dt) * random.normal(size=(n, 3))
    return float(close.mean())
