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
V_SIDE = 10  # on which to pass it: -1 above, 1 below, 0 as the altitudes say
V_MARGIN = 11  # m, added to its protected zone
N_VIEW = 12
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
        wanted = wanted_separation(own, views[j], p) + views[j, V_MARGIN]
        t, d = pair.closest_pass(
            own[0] - views[j, 0],
            own[1] - views[j, 1],
            own[2] - views[j, 2],
            own[3] - views[j, 3],
            own[4] - views[j, 4],
            own[5] - views[j, 5],
            wanted,
            pair.half_height(wanted, p),
        )
        in_conflict = d <= wanted
        value = t if in_conflict else d
        if (in_conflict and not best_in_conflict) or (in_conflict == best_in_conflict and value < best_value):
            best, best_in_conflict, best_value = j, in_conflict, value
    return best


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

    Where no velocity keeps all sides, the one with the least largest shortfall in metres is flown. Forced, the bound
    that is nearer to guidance is flown although guidance keeps it.
    """
    if p[pair.P_DISABLE] > 0.0:
        return pair.NO_REASON, guidance, -1
    low, high = p[pair.P_UP], p[pair.P_DOWN]
    if own[2] > p[pair.P_LOWEST]:
        high = 0.0
    if own[2] < p[pair.P_HIGHEST]:
        low = 0.0
    lower, upper, lower_by, upper_by = -math.inf, math.inf, -1, -1
    reason = pair.CURRENT
    for j in range(views.shape[0]):
        bounds[j, 1] = 0.0
        if use[j] == 0.0:
            continue
        px, py, pz = own[0] - views[j, 0], own[1] - views[j, 1], own[2] - views[j, 2]
        vx, vy, other_w = own[3] - views[j, 3], own[4] - views[j, 4], views[j, 5]
        wanted_distance = wanted_separation(own, views[j], p)
        radius = wanted_distance + p[pair.P_MARGIN_GROWTH] * views[j, V_AGE] + views[j, V_MARGIN]
        half = pair.half_height(radius, p)
        above, below, t = pair.forbidden_rates(px, py, pz, vx, vy, radius, half)
        if math.isnan(above) or not t < p[pair.P_T_STAR_MIN]:
            continue
        size = half if half > 0.0 else wanted_distance
        inside = above == -math.inf and below == math.inf
        z_star = _INSIDE_WEIGHT * pz if inside else pz + (own[5] - other_w) * t
        up = passes_above(z_star, wanted, views[j, V_WANTED], number < j, size)
        if views[j, V_SIDE] != 0.0:
            up = views[j, V_SIDE] < 0.0
        if inside:
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
        if p[pair.P_FORCE] > 0.0:
            if lower_by < 0 or upper - guidance < guidance - lower:
                return pair.FORCED, max(min(upper, high), low), upper_by
            return pair.FORCED, min(max(lower, low), high), lower_by
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
    interval_rate(own, 0, 0.0, 0.0, False, views, use, p, np.empty((2, 3)))
