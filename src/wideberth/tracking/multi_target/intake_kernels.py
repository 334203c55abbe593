"""A scan's plots made ready: those that cannot be right left out, a missing elevation put in, sorted by range."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.buffers_kernels import (
    COUNTS,
    PLOTS_NOT_FINITE,
    PLOTS_OUT_OF_RANGE,
    Scratch,
    make_scratch,
)
from wideberth.tracking.multi_target.sighting_kernels import line_of_sight
from wideberth.tracking.radar_kernels import wrap
from wideberth.tracking.rransac.plot_kernels import height_angles

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LARGEST_ANGLE = 10.0
"""rad; a plot with a larger angle is none."""

LARGEST_ELEVATION_SIGMA = 0.5
"""rad; of an elevation from a known altitude."""


@jit_uncounted
def later(key: FloatArray, a: int, b: int) -> bool:
    """Return whether index `a` comes after `b`."""
    return key[a] > key[b] or (key[a] == key[b] and a > b)


@jit_uncounted
def sift(key: FloatArray, order: IntArray, begin: int, end: int) -> None:
    """Put the head of a heap in its place."""
    root = begin
    while 2 * root + 1 < end:
        child = 2 * root + 1
        if child + 1 < end and later(key, order[child + 1], order[child]):
            child += 1
        if not later(key, order[child], order[root]):
            return
        order[root], order[child] = order[child], order[root]
        root = child


@jit_uncounted
def sort_by_key(key: FloatArray, order: IntArray, n: int) -> None:
    """Sort the first `n` of `order` by ascending ``key[order]``, ties by the index (heap sort)."""
    for begin in range(n // 2 - 1, -1, -1):
        sift(key, order, begin, n)
    for end in range(n - 1, 0, -1):
        order[0], order[end] = order[end], order[0]
        sift(key, order, 0, end)


@jit_uncounted
def elevation_at_height(
    attitude: FloatArray, azimuth: float, distance: float, below: float, sigma: float
) -> tuple[float, float]:
    """Return the elevation at which a plot lies `below` the sensor, and its variance (thesis (5.1), section 5.3).

    Parameters
    ----------
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    azimuth, distance : float
        rad, m.
    below, sigma : float
        Down coordinate from the sensor and its spread, m.

    Returns
    -------
    elevation, variance : float
        rad, rad2. Where the sphere does not reach that height, the nearest to it.
    """
    # down / distance = a cos(elevation) + b sin(elevation)
    a = attitude[2, 0] * math.cos(azimuth) + attitude[2, 1] * math.sin(azimuth)
    b = -attitude[2, 2]
    size = math.hypot(a, b)
    if size < 1e-9:
        return 0.0, LARGEST_ELEVATION_SIGMA**2
    middle, half = math.atan2(b, a), math.acos(min(max(below / (distance * size), -1.0), 1.0))
    first, second = wrap(middle + half), wrap(middle - half)
    elevation = first if abs(first) <= abs(second) else second
    slope = distance * abs(b * math.cos(elevation) - a * math.sin(elevation))
    return elevation, min(sigma / max(slope, 1e-9), LARGEST_ELEVATION_SIGMA) ** 2


@jit_uncounted
def cone_at_height(
    attitude: FloatArray, distance: float, below: float, sigma: float, z: FloatArray, variance: FloatArray
) -> bool:
    """Turn a plot whose azimuth is the angle on a cone into azimuth and elevation at a known height, in place.

    The angles are those of `height_angles`. Errors of the cone's angle and of the height are at right angles on the
    sphere, turned against azimuth and elevation by an angle that grows away from straight ahead.

    Parameters
    ----------
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    distance : float
        m.
    below, sigma : float
        Down coordinate from the sensor and its spread, m.
    z, variance : ndarray, shape (4,)
        The plot and its error variances.

    Returns
    -------
    bool
        False where the cone does not meet that height; nothing is written then.
    """
    cone, angles = z[1], z[1:3]
    if not height_angles(attitude, below, distance, cone, True, angles):
        return False
    azimuth, elevation = angles[0], angles[1]
    ce = math.cos(elevation)
    turn = math.atan2(math.sin(elevation), ce * math.cos(azimuth))
    slope = attitude[2, 0] * math.sin(turn) + attitude[2, 2] * math.cos(turn)
    along = min(sigma / max(distance * abs(slope), 1e-9), LARGEST_ELEVATION_SIGMA) ** 2
    # A wrong cone leads to another turn at the same height.
    tilt = attitude[2, 1] * math.cos(cone) - math.sin(cone) * (
        attitude[2, 0] * math.cos(turn) - attitude[2, 2] * math.sin(turn)
    )
    along += variance[1] * min((tilt / max(abs(slope), 1e-9)) ** 2, 1.0)
    c = math.sin(cone) * math.cos(turn) * math.sin(azimuth) + math.cos(cone) * math.cos(azimuth)
    c2 = min(c * c, 1.0)
    across = variance[1]
    variance[1] = (across * c2 + along * (1.0 - c2)) / max(ce * ce, 1e-6)
    variance[2] = across * (1.0 - c2) + along * c2
    return True


@jit_uncounted
def azimuth_on_cone(cone: float, elevation: float) -> float:
    """Return the azimuth at which a cone's angle has an elevation; the nearest where it is beyond."""
    return math.asin(min(max(math.sin(cone) / max(math.cos(elevation), 1e-9), -1.0), 1.0))


@jit_uncounted
def take_in(
    z: FloatArray,
    variance: FloatArray,
    begin: int,
    end: int,
    position: FloatArray,
    attitude: FloatArray,
    range_max: float,
    known_down: float,
    known_sigma: float,
    cone: bool,
    counts: IntArray,
    s: Scratch,
) -> int:
    """Put a scan's plots into `s`, sorted in `s.order`; return how many can be right. The others are counted.

    Parameters
    ----------
    z, variance : ndarray, shape (rows, 4)
    begin, end : int
        The scan's rows.
    position : ndarray, shape (3,)
        Of the sensor, NED, m.
    attitude : ndarray, shape (3, 3)
    range_max : float
        m; plots beyond it by more than a fifth and ten sigmas are not believed.
    known_down, known_sigma : float
        As in `Rules`.
    cone : bool
        Whether an azimuth without elevation is the angle out of the sensor's forward-down plane.
    counts : ndarray of int64, shape (COUNTS,)
    s : Scratch
    """
    n = 0
    for m in range(begin, end):
        distance, azimuth, elevation, rate = z[m, 0], z[m, 1], z[m, 2], z[m, 3]
        v = variance[m]
        sound = math.isfinite(distance) and math.isfinite(azimuth) and math.isfinite(v[0]) and math.isfinite(v[1])
        sound = sound and not (math.isinf(elevation) or math.isinf(rate))
        sound = sound and (math.isnan(elevation) or math.isfinite(v[2])) and (math.isnan(rate) or math.isfinite(v[3]))
        if not sound:
            counts[PLOTS_NOT_FINITE] += 1
            continue
        right = 0.0 < distance <= 1.2 * range_max + 10.0 * math.sqrt(max(v[0], 0.0)) and abs(azimuth) < LARGEST_ANGLE
        right = right and not abs(elevation) >= LARGEST_ANGLE and v[0] > 0.0 and v[1] > 0.0
        right = right and (math.isnan(elevation) or v[2] > 0.0) and (math.isnan(rate) or v[3] > 0.0)
        if not right:
            counts[PLOTS_OUT_OF_RANGE] += 1
            continue
        k = m - begin
        s.order[n], s.key[k] = k, distance
        n += 1
        for a in range(4):
            s.z[k, a], s.variance[k, a] = z[m, a], v[a]
        if math.isnan(elevation):
            if math.isnan(known_down):
                elevation = 0.0
            elif cone:
                if not cone_at_height(attitude, distance, known_down - position[2], known_sigma, s.z[k], s.variance[k]):
                    counts[PLOTS_OUT_OF_RANGE] += 1
                    n -= 1
                    continue
                azimuth, elevation = s.z[k, 1], s.z[k, 2]
            else:
                elevation, spread = elevation_at_height(
                    attitude, azimuth, distance, known_down - position[2], known_sigma
                )
                s.z[k, 2], s.variance[k, 2] = elevation, spread
        line_of_sight(attitude, azimuth, elevation, s.sight[k])
    sort_by_key(s.key, s.order, n)
    return n


@jit_uncounted
def first_above(key: FloatArray, order: IntArray, n: int, value: float) -> int:
    """Return the first place in `order` whose key is not below `value`."""
    low, high = 0, n
    while low < high:
        middle = (low + high) // 2
        if key[order[middle]] < value:
            low = middle + 1
        else:
            high = middle
    return low


def warmup() -> None:
    """Compile what Python calls."""
    s = make_scratch(1, 2, 2)
    z = np.ones((2, 4))
    take_in(z, z, 0, 2, np.zeros(3), np.eye(3), 100.0, math.nan, 1.0, False, np.zeros(COUNTS, np.int64), s)
    first_above(s.key, s.order, 2, 0.5)
    sort_by_key(s.key, s.order, 2)
    elevation_at_height(np.eye(3), 0.1, 100.0, -20.0, 5.0)
    cone_at_height(np.eye(3), 100.0, -20.0, 5.0, np.array([100.0, 0.1, math.nan, math.nan]), np.ones(4))
    azimuth_on_cone(0.1, 0.2)
