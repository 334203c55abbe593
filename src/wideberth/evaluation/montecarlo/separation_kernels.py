"""Separation on true states, step by step: which volumes were entered, and the closest approach."""

import math

import numpy as np

from wideberth._jit import jit
from wideberth.conflict.kernels import well_clear_violation

FOOT = 0.3048
# Bits; the same as in `rows`.
FULL, THIRD, AIRCRAFT, NMAC, LOSS, LOSS_FILTERED, ASTM = 1, 2, 4, 8, 16, 32, 64

# Sizes, m and s.
RADIUS, HALF_HEIGHT, AIRCRAFT_RADIUS, AIRCRAFT_HALF_HEIGHT = 0, 1, 2, 3
LOSS_DTHR, LOSS_ZTHR, LOSS_TTHR, LOSS_TCOA, ASTM_RADIUS, ASTM_HALF_HEIGHT = 4, 5, 6, 7, 8, 9
N_SIZES = 10

NMAC_RADIUS, NMAC_HALF_HEIGHT = 500 * FOOT, 100 * FOOT

# The closest approach: larger and smaller of horizontal / radius and vertical / half-height, and both, m.
WORSE, BETTER, HORIZONTAL, VERTICAL = 0, 1, 2, 3
N_CLOSEST = 4
_SAME = 1e-9  # ratios as close as this are equal: of level flight past each other the nearest instant counts


@jit
def segment_inside(a: np.ndarray, b: np.ndarray, radius: float, half_height: float) -> bool:
    """Return whether the straight way from `a` to `b` (relative positions) enters a cylinder, bounds excluded."""
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    low, high = 0.0, 1.0
    if dz == 0.0:
        if abs(a[2]) >= half_height:
            return False
    else:
        u, w = (-half_height - a[2]) / dz, (half_height - a[2]) / dz
        low, high = max(low, min(u, w)), min(high, max(u, w))
        if low >= high:
            return False
    outside = a[0] * a[0] + a[1] * a[1] - radius * radius
    q = dx * dx + dy * dy
    if q == 0.0:
        return outside < 0.0
    half_b = a[0] * dx + a[1] * dy
    root = half_b * half_b - q * outside
    if root <= 0.0:
        return False
    root = math.sqrt(root)
    return max(low, (-half_b - root) / q) < min(high, (-half_b + root) / q)


@jit
def approach(s: np.ndarray, u: float, a: np.ndarray, sizes: np.ndarray, closest: np.ndarray) -> None:
    """Take the point at `u` of the way from `a` to `s` into the closest approach."""
    x, y, z = a[0] + u * (s[0] - a[0]), a[1] + u * (s[1] - a[1]), a[2] + u * (s[2] - a[2])
    horizontal, vertical = math.sqrt(x * x + y * y), abs(z)
    h, w = horizontal / sizes[RADIUS], vertical / sizes[HALF_HEIGHT]
    worse, better = max(h, w), min(h, w)
    if worse < closest[WORSE] - _SAME or (worse < closest[WORSE] + _SAME and better < closest[BETTER]):
        closest[WORSE], closest[BETTER], closest[HORIZONTAL], closest[VERTICAL] = worse, better, horizontal, vertical


@jit
def score_step(
    before: np.ndarray, now: np.ndarray, velocity: np.ndarray, sizes: np.ndarray, closest: np.ndarray
) -> int:
    """Score one intruder over one step; return the bits of the volumes that were entered.

    Parameters
    ----------
    before, now : ndarray, shape (3,)
        Relative positions at the beginning and the end of the step; in between the way is straight.
    velocity : ndarray, shape (3,)
        Relative velocity at the end.
    sizes : ndarray, shape (N_SIZES,)
    closest : ndarray, shape (N_CLOSEST,)
        Updated; infinite before the first step.
    """
    dx, dy = now[0] - before[0], now[1] - before[1]
    q = dx * dx + dy * dy
    u = 1.0
    if q > 0.0:
        u = min(max(-(before[0] * dx + before[1] * dy) / q, 0.0), 1.0)
    if 0.0 < u < 1.0:
        approach(now, u, before, sizes, closest)
    approach(now, 1.0, before, sizes, closest)
    nx, ny = before[0] + u * dx, before[1] + u * dy
    nearest = math.sqrt(nx * nx + ny * ny)
    bits = 0
    if nearest < max(sizes[RADIUS], NMAC_RADIUS):
        if segment_inside(before, now, sizes[RADIUS], sizes[HALF_HEIGHT]):
            bits |= FULL
        if segment_inside(before, now, sizes[RADIUS] / 3.0, sizes[HALF_HEIGHT] / 3.0):
            bits |= THIRD
        if segment_inside(before, now, sizes[AIRCRAFT_RADIUS], sizes[AIRCRAFT_HALF_HEIGHT]):
            bits |= AIRCRAFT
        if segment_inside(before, now, NMAC_RADIUS, NMAC_HALF_HEIGHT):
            bits |= NMAC
    if nearest < sizes[ASTM_RADIUS] and segment_inside(before, now, sizes[ASTM_RADIUS], sizes[ASTM_HALF_HEIGHT]):
        bits |= ASTM
    for miss_filter in (False, True):
        if well_clear_violation(
            now[0], now[1], now[2], velocity[0], velocity[1], velocity[2],
            sizes[LOSS_DTHR], sizes[LOSS_ZTHR], sizes[LOSS_TTHR], sizes[LOSS_TCOA], miss_filter,
        ):  # fmt: skip
            bits |= LOSS_FILTERED if miss_filter else LOSS
    return bits


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    one = np.ones(3)
    score_step(one, 2.0 * one, one, np.ones(N_SIZES), np.full(N_CLOSEST, np.inf))
