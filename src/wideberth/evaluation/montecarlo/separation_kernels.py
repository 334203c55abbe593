"""Separation on true states, step by step: which volumes were entered, and the closest approach."""

import math

import numpy as np

from wideberth._jit import jit_uncounted
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


@jit_uncounted
def segment_inside(
    ax: float, ay: float, az: float, dx: float, dy: float, dz: float, radius: float, half_height: float
) -> bool:
    """Return whether the straight way from a relative position `a` by `d` enters a cylinder, bounds excluded."""
    low, high = 0.0, 1.0
    if dz == 0.0:
        if abs(az) >= half_height:
            return False
    else:
        u, w = (-half_height - az) / dz, (half_height - az) / dz
        low, high = max(low, min(u, w)), min(high, max(u, w))
        if low >= high:
            return False
    outside = ax * ax + ay * ay - radius * radius
    q = dx * dx + dy * dy
    if q == 0.0:
        return outside < 0.0
    half_b = ax * dx + ay * dy
    root = half_b * half_b - q * outside
    if root <= 0.0:
        return False
    root = math.sqrt(root)
    return max(low, (-half_b - root) / q) < min(high, (-half_b + root) / q)


@jit_uncounted
def approach(i: int, x: float, y: float, z: float, sizes: np.ndarray, closest: np.ndarray) -> None:
    """Take a relative position into the closest approach of intruder `i`."""
    horizontal, vertical = math.sqrt(x * x + y * y), abs(z)
    h, w = horizontal / sizes[RADIUS], vertical / sizes[HALF_HEIGHT]
    worse, better = max(h, w), min(h, w)
    if worse < closest[i, WORSE] - _SAME or (worse < closest[i, WORSE] + _SAME and better < closest[i, BETTER]):
        closest[i, WORSE], closest[i, BETTER] = worse, better
        closest[i, HORIZONTAL], closest[i, VERTICAL] = horizontal, vertical


@jit_uncounted
def score_step(
    i: int,
    ax: float,
    ay: float,
    az: float,
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    sizes: np.ndarray,
    closest: np.ndarray,
) -> int:
    """Score one intruder over one step; return the bits of the volumes that were entered.

    Parameters
    ----------
    i : int
        The intruder.
    ax, ay, az, sx, sy, sz : float
        Relative positions at the beginning and the end of the step; in between the way is straight.
    vx, vy, vz : float
        Relative velocity at the end.
    sizes : ndarray, shape (N_SIZES,)
    closest : ndarray, shape (m, N_CLOSEST) or wider
        Updated; infinite before the first step.
    """
    dx, dy, dz = sx - ax, sy - ay, sz - az
    q = dx * dx + dy * dy
    u = 1.0
    if q > 0.0:
        u = min(max(-(ax * dx + ay * dy) / q, 0.0), 1.0)
    nx, ny = ax + u * dx, ay + u * dy
    if 0.0 < u < 1.0:
        approach(i, nx, ny, az + u * dz, sizes, closest)
    approach(i, sx, sy, sz, sizes, closest)
    nearest = math.sqrt(nx * nx + ny * ny)
    bits = 0
    if nearest < max(sizes[RADIUS], NMAC_RADIUS):
        if segment_inside(ax, ay, az, dx, dy, dz, sizes[RADIUS], sizes[HALF_HEIGHT]):
            bits |= FULL
        if segment_inside(ax, ay, az, dx, dy, dz, sizes[RADIUS] / 3.0, sizes[HALF_HEIGHT] / 3.0):
            bits |= THIRD
        if segment_inside(ax, ay, az, dx, dy, dz, sizes[AIRCRAFT_RADIUS], sizes[AIRCRAFT_HALF_HEIGHT]):
            bits |= AIRCRAFT
        if segment_inside(ax, ay, az, dx, dy, dz, NMAC_RADIUS, NMAC_HALF_HEIGHT):
            bits |= NMAC
    if nearest < sizes[ASTM_RADIUS] and segment_inside(
        ax, ay, az, dx, dy, dz, sizes[ASTM_RADIUS], sizes[ASTM_HALF_HEIGHT]
    ):
        bits |= ASTM
    dthr, zthr, tthr, tcoa = sizes[LOSS_DTHR], sizes[LOSS_ZTHR], sizes[LOSS_TTHR], sizes[LOSS_TCOA]
    # The filter only takes away: without a loss by the one there is none by the other.
    if well_clear_violation(sx, sy, sz, vx, vy, vz, dthr, zthr, tthr, tcoa, False):
        bits |= LOSS
        if well_clear_violation(sx, sy, sz, vx, vy, vz, dthr, zthr, tthr, tcoa, True):
            bits |= LOSS_FILTERED
    return bits


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    score_step(0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, np.ones(N_SIZES), np.full((1, N_CLOSEST), np.inf))
