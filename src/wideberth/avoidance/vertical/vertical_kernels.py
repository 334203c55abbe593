"""Compiled vertical avoidance among aircraft that are only seen: one decision, and the flight that follows from it.

m, m/s, s, NED. `views`, `use`, `p` and `bounds` are those of `multi_kernels`; rates are velocities down.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas import threshold_kernels as threshold

FloatArray = NDArray[np.float64]

# A place of the way ahead: horizontal position and velocity, the altitude wanted there (down), and its rate.
NORTH, EAST, V_NORTH, V_EAST, WANTED, SLOPE = 0, 1, 2, 3, 4, 5
N_PLACE = 6
# A state of the flight ahead: position and velocity down, and what was decided there.
DOWN, RATE, REASON, COMMAND, TARGET = 0, 1, 2, 3, 4
N_AHEAD = 5

_NOBODY = -1  # own number in ties among views: lower than all, as the others do not take part in the choice
_APPROACH = 0.2  # of 1 / lag: floor and ceiling are approached without overshoot


@jit_uncounted
def zone_radius(own: FloatArray, view: FloatArray, p: FloatArray) -> float:
    """Return the miss that is wanted of another aircraft, m."""
    grown = p[pair.P_MARGIN_GROWTH] * view[multi.V_AGE] + view[multi.V_MARGIN]
    return float(multi.wanted_separation(own, view, p) + grown)


@jit_uncounted
def time_to_entry(own: FloatArray, view: FloatArray, d: float) -> float:
    """Return when the horizontal distance falls below `d`, s: 0 where it is below, infinite where it never will be."""
    px, py, vx, vy = own[0] - view[0], own[1] - view[1], own[3] - view[3], own[4] - view[4]
    qa, qb, qc = px * px + py * py - d * d, px * vx + py * vy, vx * vx + vy * vy
    if qa <= 0.0:
        return 0.0
    under = qb * qb - qa * qc
    if qb >= 0.0 or under <= 0.0:
        return math.inf
    return float((-qb - math.sqrt(under)) / qc)


@jit_uncounted
def vertical_miss(own: FloatArray, view: FloatArray, p: FloatArray, lookahead: float) -> tuple[bool, float]:
    """Return whether some vertical velocity would meet the other soon, and the relative position down where both pass.

    "Soon" is a zone that begins within `lookahead`, and a closest point within P_T_STAR_MIN.
    """
    px, py, pz = own[0] - view[0], own[1] - view[1], own[2] - view[2]
    vx, vy, vz = own[3] - view[3], own[4] - view[4], own[5] - view[5]
    d = zone_radius(own, view, p)
    half = pair.half_height(d, p)
    above, _, t = pair.forbidden_rates(px, py, pz, vx, vy, d, half)
    if math.isnan(above) or not t < p[pair.P_T_STAR_MIN] or time_to_entry(own, view, d) > lookahead:
        return False, pz
    t, _ = pair.closest_pass(px, py, pz, vx, vy, vz, d, half)
    return True, pz + vz * t


@jit_uncounted
def against_one(
    own: FloatArray, view: FloatArray, guidance: float, avoiding: bool, command: float, p: FloatArray
) -> tuple[int, float, float, float]:
    """Decide against one aircraft, by `pair_kernels`: reason, velocity down, t*, d*; `p` is as before afterwards."""
    separation, cylinder, kind = p[pair.P_SEPARATION], p[pair.P_HALF_HEIGHT], p[threshold.P_THRESHOLD]
    d = zone_radius(own, view, p)
    p[pair.P_HALF_HEIGHT] = pair.half_height(d, p)
    p[pair.P_SEPARATION], p[threshold.P_THRESHOLD] = d, threshold.DETERMINISTIC
    p[pair.P_SIDE] = view[multi.V_SIDE]
    px, py, pz = own[0] - view[0], own[1] - view[1], own[2] - view[2]
    vx, vy = own[3] - view[3], own[4] - view[4]
    if p[pair.P_CONTROLLER] == pair.BANG_BANG:
        reason, rate, t, miss = pair.bang_bang(
            own[2], own[5], view[5], px, py, pz, vx, vy, guidance, avoiding, command, True, p
        )
    else:
        reason, rate, t, miss = pair.continuous(
            own[2], own[5], view[5], px, py, pz, vx, vy, guidance, avoiding, True, p
        )
    p[pair.P_SEPARATION], p[pair.P_HALF_HEIGHT], p[threshold.P_THRESHOLD] = separation, cylinder, kind
    p[pair.P_SIDE] = 0.0
    return reason, rate, t, miss


@jit_uncounted
def decide(
    own: FloatArray,
    wanted: float,
    guidance: float,
    avoiding: bool,
    command: float,
    target: int,
    among_all: bool,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    bounds: FloatArray,
) -> tuple[int, float, int]:
    """Return reason, velocity down and the aircraft avoided (a row of `views`, -1 for none).

    Parameters
    ----------
    own : ndarray, shape (6,)
    wanted, guidance : float
        Position down that the mission wants here, and the velocity down to get there.
    avoiding, command, target : bool, float, int
        What was decided before.
    among_all : bool
        Against all at once: tangents to all (`interval_rate`), or full climb or descent until it is over with all; else
        against the most critical one.
    views, use : ndarray, shape (n, N_VIEW) and (n,)
    p : ndarray, shape (N_SETTINGS,)
    bounds : ndarray, shape (n, 3)
        Scratch.
    """
    if p[pair.P_DISABLE] > 0.0:
        return pair.NO_REASON, guidance, -1
    bang_bang = p[pair.P_CONTROLLER] == pair.BANG_BANG
    if among_all and not bang_bang:
        return multi.interval_rate(own, _NOBODY, wanted, guidance, avoiding, views, use, p, bounds)
    if among_all:
        best, best_reason, best_rate, soonest = -1, pair.NO_REASON, guidance, math.inf
        for j in range(views.shape[0]):
            if use[j] == 0.0:
                continue
            reason, rate, t, _ = against_one(own, views[j], guidance, avoiding, command, p)
            if reason != pair.NO_REASON and t < soonest:
                best, best_reason, best_rate, soonest = j, reason, rate, t
        return best_reason, best_rate, best
    j = target
    if not bang_bang or not avoiding or target < 0 or use[target] == 0.0:
        j = multi.most_critical(own, views, use, p)
    if j < 0:
        return pair.NO_REASON, guidance, -1
    reason, rate, _, _ = against_one(own, views[j], guidance, avoiding, command, p)
    return reason, rate, j


@jit_uncounted
def level_passes(own: FloatArray, views: FloatArray, use: FloatArray, p: FloatArray) -> bool:
    """Return whether level flight from here passes everybody far enough away, on the side where it is to pass."""
    for j in range(views.shape[0]):
        if use[j] == 0.0:
            continue
        px, py, pz = own[0] - views[j, 0], own[1] - views[j, 1], own[2] - views[j, 2]
        vx, vy, vz = own[3] - views[j, 3], own[4] - views[j, 4], -views[j, 5]
        d = zone_radius(own, views[j], p)
        half = pair.half_height(d, p)
        t, miss = pair.closest_pass(px, py, pz, vx, vy, vz, d, half)
        if miss < d:
            return False
        if views[j, multi.V_SIDE] * (pz + vz * t) < 0.0:
            above, _, _ = pair.forbidden_rates(px, py, pz, vx, vy, d, half)
            if not math.isnan(above):
                return False
    return True


@jit
def fly_ahead(
    start: FloatArray,
    places: FloatArray,
    avoiding: bool,
    command: float,
    target: int,
    among_all: bool,
    level_off: bool,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    lookahead: float,
    dt: float,
    acceleration: float,
    out: FloatArray,
) -> None:
    """Fly the controller ahead along a way, while the others go straight on.

    Parameters
    ----------
    start : ndarray, shape (6,)
        Position and velocity now.
    places : ndarray, shape (n, N_PLACE)
        The way ahead, every `dt`.
    avoiding, command, target, among_all, use, p
        As for `decide`.
    level_off : bool
        Whether the height is held, instead of a command of ``bang_bang``, where that passes everybody.
    views : ndarray, shape (m, N_VIEW)
        Kept.
    lookahead : float
        Zones that begin later are not avoided yet, s.
    dt, acceleration : float
        Step, and the largest vertical acceleration.
    out : ndarray, shape (n, N_AHEAD)
        Position and velocity down, reason, command and aircraft avoided at each place.
    """
    views, bounds, own, heeded = views.copy(), np.empty((views.shape[0], 3)), np.empty(6), use.copy()
    z, w = start[2], start[5]
    share = -math.expm1(-dt / p[pair.P_LAG])
    limit = _APPROACH / p[pair.P_LAG]
    for k in range(places.shape[0]):
        own[0], own[1], own[2] = places[k, NORTH], places[k, EAST], z
        own[3], own[4], own[5] = places[k, V_NORTH], places[k, V_EAST], w
        if k == 0:
            own[3], own[4] = start[3], start[4]
        for j in range(views.shape[0]):
            heeded[j] = use[j]
            if time_to_entry(own, views[j], zone_radius(own, views[j], p)) > lookahead:
                heeded[j] = 0.0
        wanted = places[k, WANTED]
        guidance = pair.limited(
            p[pair.P_GAIN] * (wanted - z) + places[k, SLOPE], p[pair.P_RETURN_UP], p[pair.P_RETURN_DOWN]
        )
        reason, command, target = decide(
            own, wanted, guidance, avoiding, command, target, among_all, views, heeded, p, bounds
        )
        avoiding = reason != pair.NO_REASON
        out[k, DOWN], out[k, RATE], out[k, REASON], out[k, COMMAND], out[k, TARGET] = z, w, reason, command, target
        rate = command
        if level_off and avoiding and level_passes(own, views, heeded, p):
            rate = 0.0
        flown = pair.limited(rate, limit * min(p[pair.P_HIGHEST] - z, 0.0), limit * max(p[pair.P_LOWEST] - z, 0.0))
        change = pair.limited((flown - w) * share, -acceleration * dt, acceleration * dt)
        z += (w + 0.5 * change) * dt
        w += change
        for j in range(views.shape[0]):
            for i in range(3):
                views[j, i] += views[j, 3 + i] * dt


@jit
def pass_by(
    places: FloatArray,
    down: FloatArray,
    views: FloatArray,
    use: FloatArray,
    radius: float,
    half: float,
    dt: float,
    least: FloatArray,
) -> tuple[float, float]:
    """Return for how long, s, a flight is inside the zone of anybody, and from when on; write how near each is passed.

    Parameters
    ----------
    places : ndarray, shape (n, N_PLACE)
    down : ndarray, shape (n,)
        Position down at each place.
    views, use : ndarray, shape (m, N_VIEW) and (m,)
    radius, half : float
        Of the protected zone; `half` 0: a sphere.
    dt : float
    least : ndarray, shape (m,)
        The smallest miss in times of the zone's size: 1 touches it.
    """
    inside, entry = 0.0, math.inf
    least[:] = math.inf
    for k in range(places.shape[0]):
        entered = False
        for j in range(views.shape[0]):
            if use[j] == 0.0:
                continue
            t = k * dt
            dx = places[k, NORTH] - views[j, 0] - views[j, 3] * t
            dy = places[k, EAST] - views[j, 1] - views[j, 4] * t
            dz = down[k] - views[j, 2] - views[j, 5] * t
            level = dx * dx + dy * dy
            miss = math.sqrt(level + dz * dz) / radius
            if half > 0.0:
                miss = max(math.sqrt(level) / radius, abs(dz) / half)
            least[j] = min(least[j], miss)
            entered = entered or miss < 1.0
        if entered:
            inside += dt
            entry = min(entry, k * dt)
    return inside, entry


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    p = np.ones(pair.N_SETTINGS)
    views, use, own, places = np.zeros((1, multi.N_VIEW)), np.ones(1), np.ones(6), np.ones((2, N_PLACE))
    time_to_entry(own, views[0], 1.0)
    vertical_miss(own, views[0], p, 1.0)
    level_passes(own, views, use, p)
    decide(own, 0.0, 0.0, False, 0.0, -1, True, views, use, p, np.empty((1, 3)))
    fly_ahead(own, places, False, 0.0, -1, True, True, views, use, p, 1.0, 0.1, 1.0, np.empty((2, N_AHEAD)))
    pass_by(places, np.ones(2), views, use, 1.0, 1.0, 0.1, np.empty(1))
