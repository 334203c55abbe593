"""A miss distance that no motion within given bounds falls short of.

At one time the relative position is c + G d with |d_i| <= 1: a zonotope. Its distance from the origin is the largest
u.c - sum |u.g_i| over unit vectors u, and every u gives a bound, so that an unfinished search is safe. (It is the
square root of the maximum over tau of the errata, "guaranteed miss distance": strong duality holds in both, and this
one has no matrix to invert.) Over time a branch and bound search holds the bound between the times it looks at.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.turning_kernels import moment, turning_position

FloatArray = NDArray[np.float64]

POLYNOMIAL, TURNING = 0, 1

_SWEEPS = 200
_STACK = 256
_SHORTEST = 1e-4  # s; a shorter interval is not divided further


@jit_uncounted
def support(u: FloatArray, c: FloatArray, g: FloatArray) -> float:
    """Return how far the zonotope `c` (3), `g` (3, k) lies beyond the origin along the unit vector `u` at least."""
    bound = float(u[0] * c[0] + u[1] * c[1] + u[2] * c[2])
    for i in range(g.shape[1]):
        bound -= abs(u[0] * g[0, i] + u[1] * g[1, i] + u[2] * g[2, i])
    return bound


@jit_uncounted
def nearest(c: FloatArray, g: FloatArray, d: FloatArray, u: FloatArray, tolerance: float) -> float:
    """Find the point of a zonotope nearest to the origin, one coordinate after the other.

    Parameters
    ----------
    c, g : ndarray, shapes (3,) and (3, k)
    d : ndarray, shape (k,)
        Where to begin; written: the d of the point.
    u : ndarray, shape (3,)
        Written: the direction of the point; zero where the zonotope holds the origin.
    tolerance : float
        m; the search ends where distance and bound are as near as that.

    Returns
    -------
    float
        A bound of the distance, 0 or larger.
    """
    k = g.shape[1]
    r0, r1, r2 = c[0], c[1], c[2]
    for i in range(k):
        r0, r1, r2 = r0 + g[0, i] * d[i], r1 + g[1, i] * d[i], r2 + g[2, i] * d[i]
    bound = 0.0
    for _ in range(_SWEEPS):
        for i in range(k):
            square = g[0, i] * g[0, i] + g[1, i] * g[1, i] + g[2, i] * g[2, i]
            if square > 0.0:
                new = d[i] - (g[0, i] * r0 + g[1, i] * r1 + g[2, i] * r2) / square
                step = min(max(new, -1.0), 1.0) - d[i]
                d[i] += step
                r0, r1, r2 = r0 + step * g[0, i], r1 + step * g[1, i], r2 + step * g[2, i]
        distance = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        if distance <= tolerance:
            u[0] = u[1] = u[2] = 0.0
            return 0.0
        u[0], u[1], u[2] = r0 / distance, r1 / distance, r2 / distance
        bound = max(support(u, c, g), 0.0)
        if distance - bound <= tolerance:
            break
    return bound


@jit_uncounted
def polynomial_zonotope(t: float, motion: FloatArray, columns: FloatArray, c: FloatArray, g: FloatArray) -> None:
    """Write c and G at `t`: `motion` (3, 3) is position, velocity, acceleration, `columns` (3, 3, k) their bounds."""
    half = 0.5 * t * t
    for a in range(3):
        c[a] = motion[0, a] + t * motion[1, a] + half * motion[2, a]
        for i in range(g.shape[1]):
            g[a, i] = columns[0, a, i] + t * columns[1, a, i] + half * columns[2, a, i]


@jit_uncounted
def _integral(n: int, angle: float, rate: float, t: float) -> tuple[float, float]:
    """Return the integrals of s^n cos and s^n sin (angle + rate s) over [0, t]."""
    re, im = moment(n, rate * t)
    cos, sin, scale = math.cos(angle), math.sin(angle), t ** (n + 1)
    return scale * (cos * re - sin * im), scale * (sin * re + cos * im)


@jit_uncounted
def turning_zonotope(t: float, motion: FloatArray, columns: FloatArray, c: FloatArray, g: FloatArray) -> None:
    """Write c and G (3, 9) at `t`, to first order in the bounds of the turning model's states.

    `motion` (3, 3): the state in row order; `columns` (1, 2, 9): the bounds, and (first six) position and velocity of
    the ownship.
    """
    x, bounds, own = motion.reshape(9), columns[0, 0], columns[0, 1]
    c[0], c[1], c[2] = turning_position(t, x)
    for a in range(3):
        c[a] -= own[a] + t * own[3 + a]
        for i in range(9):
            g[a, i] = bounds[i] if i == a else 0.0
    # N + iE is half the sum of integrals over chi + gamma and chi - gamma; down is an integral over gamma.
    for k in range(2):
        sign = 1.0 if k == 0 else -1.0
        angle, rate = x[4] + sign * x[5], x[7] + sign * x[8]
        re0, im0 = _integral(0, angle, rate, t)
        re1, im1 = _integral(1, angle, rate, t)
        re2, im2 = _integral(2, angle, rate, t)
        zr, zi = x[3] * re0 + x[6] * re1, x[3] * im0 + x[6] * im1
        yr, yi = x[3] * re1 + x[6] * re2, x[3] * im1 + x[6] * im2
        g[0, 3] += 0.5 * bounds[3] * re0
        g[1, 3] += 0.5 * bounds[3] * im0
        g[0, 4] -= 0.5 * bounds[4] * zi
        g[1, 4] += 0.5 * bounds[4] * zr
        g[0, 5] -= 0.5 * bounds[5] * sign * zi
        g[1, 5] += 0.5 * bounds[5] * sign * zr
        g[0, 6] += 0.5 * bounds[6] * re1
        g[1, 6] += 0.5 * bounds[6] * im1
        g[0, 7] -= 0.5 * bounds[7] * yi
        g[1, 7] += 0.5 * bounds[7] * yr
        g[0, 8] -= 0.5 * bounds[8] * sign * yi
        g[1, 8] += 0.5 * bounds[8] * sign * yr
    re0, im0 = _integral(0, x[5], x[8], t)
    re1, im1 = _integral(1, x[5], x[8], t)
    re2, _ = _integral(2, x[5], x[8], t)
    g[2, 3] -= bounds[3] * im0
    g[2, 5] -= bounds[5] * (x[3] * re0 + x[6] * re1)
    g[2, 6] -= bounds[6] * im1
    g[2, 8] -= bounds[8] * (x[3] * re1 + x[6] * re2)


@jit_uncounted
def turning_remainder(t: float, motion: FloatArray, columns: FloatArray) -> float:
    """Return how far the first order of `turning_zonotope` can be from the turning model after `t`, m."""
    x, bounds = motion.reshape(9), columns[0, 0]
    fastest = max(abs(x[3]), abs(x[3] + t * x[6]))
    total = 0.0
    for k in range(3):  # Simpson's rule, exact for a cubic
        s = 0.5 * k * t
        speed, angle = bounds[3] + s * bounds[6], bounds[4] + bounds[5] + s * (bounds[7] + bounds[8])
        total += (1.0, 4.0, 1.0)[k] * (speed * angle + 0.5 * (fastest + speed) * angle * angle)
    return total * t / 6.0


@jit_uncounted
def look(
    kind: int,
    t: float,
    horizontal: bool,
    motion: FloatArray,
    columns: FloatArray,
    c: FloatArray,
    g: FloatArray,
) -> float:
    """Write c and G at `t`, without the vertical if `horizontal`; return how far they may be wrong, m."""
    remainder = 0.0
    if kind == TURNING:
        turning_zonotope(t, motion, columns, c, g)
        remainder = turning_remainder(t, motion, columns)
    else:
        polynomial_zonotope(t, motion, columns, c, g)
    if horizontal:
        c[2] = 0.0
        for i in range(g.shape[1]):
            g[2, i] = 0.0
    return remainder


@jit
def guaranteed_distance(
    kind: int,
    motion: FloatArray,
    columns: FloatArray,
    k: int,
    acceleration: float,
    lookahead: float,
    horizontal: bool,
    tolerance: float,
) -> float:
    """Return a bound of the distance over [0, look-ahead].

    Parameters
    ----------
    kind : int
        POLYNOMIAL or TURNING.
    motion, columns : ndarray
        As for `polynomial_zonotope` or `turning_zonotope`.
    k : int
        Columns of G.
    acceleration : float
        A bound of the relative acceleration, m/s2.
    lookahead : float
        Finite, s.
    horizontal : bool
    tolerance : float
        m; the bound is at most that below the largest one there is by these means.
    """
    c, g, d, u = np.empty((2, 3)), np.empty((2, 3, k)), np.zeros(k), np.empty((3, 3))
    begins, ends = np.empty(_STACK), np.empty(_STACK)
    begins[0], ends[0], depth = 0.0, lookahead, 1
    low = np.inf  # of the intervals that are done
    target = np.inf  # no bound can be larger
    while depth > 0:
        depth -= 1
        a, b = begins[depth], ends[depth]
        remainder = 0.0
        for side in range(2):
            remainder = look(kind, a if side == 0 else b, horizontal, motion, columns, c[side], g[side])
            target = min(target, nearest(c[side], g[side], d, u[side], 0.25 * tolerance) - remainder)
        norm = 0.0
        for i in range(3):
            u[2, i] = u[0, i] + u[1, i]
            norm += u[2, i] * u[2, i]
        if norm > 0.0:
            for i in range(3):
                u[2, i] /= math.sqrt(norm)
        between = 0.0
        for i in range(3):
            between = max(between, min(support(u[i], c[0], g[0]), support(u[i], c[1], g[1])))
        # Between two times a path is nearer than at both by its acceleration at most.
        between -= acceleration * (b - a) * (b - a) / 8.0 + remainder
        if target <= 0.0:
            return 0.0
        if between >= target - 0.5 * tolerance or b - a < _SHORTEST or depth + 2 > _STACK:
            low = min(low, between)
        else:
            middle = 0.5 * (a + b)
            begins[depth], ends[depth] = middle, b
            begins[depth + 1], ends[depth + 1] = a, middle
            depth += 2
    return max(low, 0.0)


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    motion = np.eye(3)
    nearest(motion[0], motion, np.zeros(3), np.zeros(3), 0.1)
    guaranteed_distance(POLYNOMIAL, motion, np.zeros((3, 3, 2)), 2, 0.0, 1.0, False, 0.1)
    guaranteed_distance(TURNING, motion, np.zeros((1, 2, 9)), 9, 1.0, 1.0, False, 0.1)
