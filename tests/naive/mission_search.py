"""Naive twin of the mission search's kernel: every instant, every aircraft, the public well-clear test."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.conflict.well_clear import WellClearVolume, violation

FloatArray = NDArray[np.float64]


def meetings(
    states: FloatArray,
    step: float,
    start: FloatArray,
    velocity: FloatArray,
    volumes: list[tuple[WellClearVolume, bool]],
    cross_radius: float,
    cross_height: float,
    ceiling: float,
) -> tuple[FloatArray, FloatArray, int]:
    """Return first crossing (k,), first loss (k, v) and the number inside the first volume at the end."""
    m, k = states.shape[:2]
    t_cross, t_loss = np.full(k, math.nan), np.full((k, len(volumes)), math.nan)
    inside_at_end = 0
    for i in range(m):
        own = start + velocity * i * step
        for a in range(k):
            p, v = states[i, a, :3], states[i, a, 3:]
            if not np.isfinite(p).all():
                continue
            near = math.hypot(*(p - own)[:2]) <= cross_radius and abs(p[2] - own[2]) <= cross_height
            if near and -p[2] < ceiling and math.isnan(t_cross[a]):
                t_cross[a] = i * step
            for j, (volume, miss_filter) in enumerate(volumes):
                if violation(volume, own, velocity, p, v, miss_filter=miss_filter):
                    if math.isnan(t_loss[a, j]):
                        t_loss[a, j] = i * step
                    if j == 0 and i == m - 1:
                        inside_at_end += 1
    return t_cross, t_loss, inside_at_end
