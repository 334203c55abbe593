"""Naive twins of vertical avoidance among aircraft: fine grids of time, and one step after the other."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.naive import cas

FloatArray = NDArray[np.float64]


def cylinder_pass(p: FloatArray, v: FloatArray, d: float, half: float) -> float:
    """The smallest over time of the larger one of horizontal distance and height, in units of the cylinder's radius."""
    t = np.concatenate([np.linspace(0.0, 100.0, 100_001), np.linspace(100.0, 2000.0, 20_001)])
    at = p + v * t[:, None]
    return float(np.maximum(np.hypot(at[:, 0], at[:, 1]), np.abs(at[:, 2]) * d / half).min())


def entry(p: FloatArray, v: FloatArray, d: float) -> float:
    """The first of many times at which the horizontal distance is below d."""
    t = np.linspace(0.0, 200.0, 200_001)
    below = np.hypot(p[0] + v[0] * t, p[1] + v[1] * t) < d
    return float(t[np.argmax(below)]) if below.any() else np.inf


def fly_ahead(start: FloatArray, way: FloatArray, other: FloatArray, dt: float, config: Any) -> FloatArray:
    """Positions and velocities down of the continuous controller against one other, along places with velocities."""
    z, w, avoiding, out = start[2], start[5], False, []
    for k, place in enumerate(way):
        own = np.array([place[0], place[1], z, place[2], place[3], w])
        theirs = np.array([*(other[:3] + other[3:] * dt * k), *other[3:]])
        reason, rate = cas.continuous(own, theirs, place[4], avoiding, True, config)
        avoiding = reason != "none"
        out.append((z, w))
        change = (rate - w) * (1.0 - np.exp(-dt / config.lag_s))
        z, w = z + (w + change / 2) * dt, w + change
    return np.array(out)


def passed(own: FloatArray, others: FloatArray, radius: float, half: float, dt: float) -> tuple[float, FloatArray]:
    """Seconds in anybody's cylinder, and everybody's smallest miss in times of its size; `own` (n, 3)."""
    t = dt * np.arange(len(own))
    offset = own[None] - others[:, None, :3] - others[:, None, 3:6] * t[None, :, None]
    miss = np.maximum(np.hypot(offset[..., 0], offset[..., 1]) / radius, np.abs(offset[..., 2]) / half)
    return dt * float((miss < 1.0).any(axis=0).sum()), miss.min(axis=1)
