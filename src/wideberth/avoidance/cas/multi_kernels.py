"""Compiled vertical decisions among more than two vehicles (CAS thesis, 4.2.3). Units and signs as in `pair_kernels`.

What a vehicle knows of others is `views` (n, N_VIEW); `use` (n) is 1 where the row counts.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas import threshold_kernels as threshold

FloatArray = NDArray[np.float64]

# A view: position and velocity (NED) now, the altitude wanted (as a position down), age of the message, s; the variance
# on each axis of the relative position at the closest point, where a filter knows it (0: by the settings, for the age).
V_WANTED, V_AGE, V_VARIANCE = 6, 7, 8
V_SEPARATION = 9  # m, wanted of it: written by `note_separations`
N_VIEW = 10
_DECISIVE = 0.75  # of the separation: an altitude difference at the closest point that decides who passes above
_INSIDE_WEIGHT = 4.0  # of the altitude difference in that rule where the vehicles are already too close
_BAND = 0.2  # of the range of own velocities
_SEARCH_STEPS = 40


@jit_uncounted
def wanted_separation(own: FloatArray, view: FloatArray, p: FloatArray) -> float:
    """Return the miss distance that the threshold wants of another vehicle, m."""
    return threshold.needed_separation(
        p[pair.P_SEPARATION],
        own[0] - view[0],
        own[1] - view[1],
        own[2] - view[2],
        own[3] - view[3],
        own[4] - view[4],
        own[5] - view[5],
        view[V_AGE],
        view[V_VARIANCE],
        p,
    )


@jit_uncounted
def note_separations(own: FloatArray, views: FloatArray, use: FloatArray, p: FloatArray) -> None:
    """Write `wanted_separation` of every vehicle into its view."""
    for j in range(views.shape[0]):
        if use[j] > 0.0:
            views[j, V_SEPARATION] = wanted_separation(own, views[j], p)


@jit_uncounted
def most_critical(own: FloatArray, views: FloatArray, use: FloatArray, p: FloatArray) -> int:
    """Return the vehicle that comes too close first, else the one that comes closest; -1 where nobody is known."""
    best, best_in_conflict, best_value = -1, False, math.inf
    for j in range(views.shape[0]):
        if use[j] == 0.0:
            continue
        t, d = pair.closest_point(
            own[0] - views[j, 0],
            own[1] - views[j, 1],
            own[2] - views[j, 2],
            own[3] - views[j, 3],
            own[4] - views[j, 4],
            own[5] - views[j, 5],
        )
        in_conflict = d <= wanted_separation(own, views[j], p)
        value = t if in_conflict else d
        if (in_conflict and not best_in_conflict) or (in_conflict == best_in_conflict and value < best_value):
            best, best_in_conflict, best_value = j, in_conflict, value
    return best


@jit_uncounted
def forbidden_rates(
    px: float, py: float, pz: float, vx: float, vy: float, d: float, half: float
) -> tuple[float, float, float]:
    """Return the open interval of relative velocities down that lead into the protected zone, and the time until then.

    The zone is a sphere of radius `d`, or with `half` > 0 a cylinder of that half-height. Both ends are NaN where no
    velocity leads into it; infinite where it lies on that side for good.
    """
    qa = d * d - px * px - py * py
    qb = vx * px + vy * py
    qc = vx * vx + vy * vy
    if qa <= 0.0 and qb >= 0.0:
        return math.nan, math.nan, math.inf
    under = qa * qc + qb * qb
    if under <= 0.0 and qc > 0.0:
        return math.nan, math.nan, math.inf
    t = max(-qb / qc, 0.0) if qc > 0.0 else 0.0
    if half > 0.0:
        t_in, t_out = 0.0, math.inf
        if qc > 0.0:
            root = math.sqrt(max(under, 0.0))
            t_in, t_out = max((-qb - root) / qc, 0.0), (-qb + root) / qc
        if t_in <= 0.0 and abs(pz) < half:
            return -math.inf, math.inf, 0.0
        # Above at both ends of the time inside the circle is above throughout; so is below.
        up, down = -half - pz, half - pz
        above = min(up / t_in if t_in > 0.0 else (math.inf if up > 0.0 else -math.inf), up / t_out)
        below = max(down / t_in if t_in > 0.0 else (-math.inf if down < 0.0 else math.inf), down / t_out)
        if t_in <= 0.0:
            return (up / t_out, math.inf, t) if pz < 0.0 else (-math.inf, down / t_out, t)
        return above, below, t
    outside = pz * pz - qa
    if outside <= 0.0:
        return -math.inf, math.inf, 0.0
    possible, above, below = pair.tangent_rates(px, py, pz, vx, vy, d)
    if qa > 0.0:
        if not possible:
            above, below = 0.0, 0.0
        return (above, math.inf, t) if pz < 0.0 else (-math.inf, below, t)
    if not possible:
        return math.nan, math.nan, math.inf
    return above, below, t


@jit_uncounted
def passes_above(z_star: float, wanted: float, other_wanted: float, lower_number: bool, separation: float) -> bool:
    """Return whether the own vehicle is the one to pass above.

    A clear difference of altitude at the closest point decides; else the altitudes wanted, then the numbers, which both
    know alike in spite of noise and delay.
    """
    if abs(z_star) > _DECISIVE * separation:
        return z_star < 0.0
    if wanted != other_wanted:
        return wanted < other_wanted
    return lower_number


@jit_uncounted
def interval_rate(
    own: FloatArray,
    number: int,
    wanted: float,
    guidance: float,
    avoiding: bool,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    bounds: FloatArray,
) -> tuple[int, float, int]:
    """Return reason, velocity down and the binding vehicle: the nearest to guidance that passes everybody on its side.

    Parameters
    ----------
    own : ndarray, shape (6,)
    number : int
        The own row of `views`.
    wanted, guidance : float
        Position down that the vehicle wants to have, and the velocity down to get there.
    avoiding : bool
        Before: an avoidance is held while guidance is close to a bound, so that noise does not switch it off and on.
    views, use : ndarray, shape (n, N_VIEW) and (n,)
    p : ndarray, shape (N_SETTINGS,)
    bounds : ndarray, shape (n, 3)
        Scratch: a bound, its side (-1 at most, 1 at least, 0 none), and the time it concerns.

    Where no velocity keeps all sides, the one with the least largest shortfall in metres is flown.
    """
    low, high = p[pair.P_UP], p[pair.P_DOWN]
    if own[2] > p[pair.P_LOWEST]:
        high = 0.0
    lower, upper, lower_by, upper_by = -math.inf, math.inf, -1, -1
    reason = pair.CURRENT
    for j in range(views.shape[0]):
        bounds[j, 1] = 0.0
        if use[j] == 0.0:
            continue
        px, py, pz = own[0] - views[j, 0], own[1] - views[j, 1], own[2] - views[j, 2]
        vx, vy, other_w = own[3] - views[j, 3], own[4] - views[j, 4], views[j, 5]
        grown = p[pair.P_MARGIN_GROWTH] * views[j, V_AGE]
        wanted_distance = wanted_separation(own, views[j], p)
        half = p[pair.P_HALF_HEIGHT]
        if half > 0.0:
            half += grown + wanted_distance - p[pair.P_SEPARATION]
        above, below, t = forbidden_rates(px, py, pz, vx, vy, wanted_distance + grown, half)
        if math.isnan(above) or not t < p[pair.P_T_STAR_MIN]:
            continue
        z_star = pz + (own[5] - other_w) * t
        up = passes_above(z_star, wanted, views[j, V_WANTED], number < j, wanted_distance)
        if above == -math.inf and below == math.inf:
            up = passes_above(_INSIDE_WEIGHT * pz, wanted, views[j, V_WANTED], number < j, wanted_distance)
            above, below = low - other_w, high - other_w
        elif above == -math.inf:
            up = False
        elif below == math.inf:
            up = True
        bounds[j, 2] = max(t, p[pair.P_LAG])
        if up:
            bounds[j, 0], bounds[j, 1] = above + other_w, -1.0
            if bounds[j, 0] < upper:
                upper, upper_by = bounds[j, 0], j
        else:
            bounds[j, 0], bounds[j, 1] = below + other_w, 1.0
            if bounds[j, 0] > lower:
                lower, lower_by = bounds[j, 0], j
    if lower_by < 0 and upper_by < 0:
        return pair.NO_REASON, guidance, -1
    if max(lower, low) <= min(upper, high):
        if guidance > upper:
            return reason, max(upper, low), upper_by
        if guidance < lower:
            return reason, min(lower, high), lower_by
        band = _BAND * (p[pair.P_DOWN] - p[pair.P_UP])
        if avoiding and (guidance > upper - band or guidance < lower + band):
            return pair.HELD, guidance, upper_by if guidance > upper - band else lower_by
        return pair.NO_REASON, guidance, -1
    a, b = low, high
    for _ in range(_SEARCH_STEPS):
        left, right = a + (b - a) / 3.0, b - (b - a) / 3.0
        if _shortfall(left, bounds) <= _shortfall(right, bounds):
            b = right
        else:
            a = left
    return reason, 0.5 * (a + b), upper_by if upper_by >= 0 else lower_by


@jit_uncounted
def _shortfall(w: float, bounds: FloatArray) -> float:
    worst = 0.0
    for j in range(bounds.shape[0]):
        if bounds[j, 1] != 0.0:
            worst = max(worst, (bounds[j, 0] - w) * bounds[j, 1] * bounds[j, 2])
    return worst


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    own, views, use, p = np.ones(6), np.zeros((2, N_VIEW)), np.ones(2), np.ones(pair.N_SETTINGS)
    note_separations(own, views, use, p)
    most_critical(own, views, use, p)
    forbidden_rates(9.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
    interval_rate(own, 0, 0.0, 0.0, False, views, use, p, np.empty((2, 3)))
