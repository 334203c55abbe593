"""Compiled vertical controllers for one pair of vehicles (CAS thesis, 4.3, listings A.2 and A.3).

Relative quantities are own minus other, NED: a negative relative down position means that the own vehicle is higher.
m, m/s, s. `p` holds the settings (indices ``P_...``).
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import threshold_kernels as threshold

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Indices into the settings; rates are velocities down, so that climbing ones are negative.
P_SEPARATION = 0  # m, with the margin
P_HALF_HEIGHT = 1  # m, of a cylinder; 0: a sphere
P_UP = 2  # m/s, negative
P_DOWN = 3
P_RETURN_UP = 4
P_RETURN_DOWN = 5
P_LAG = 6  # s
P_GAIN = 7  # 1/s
P_HYSTERESIS = 8  # m
P_T_STAR_MIN = 9  # s
P_LAW = 10
P_COOPERATES = 11  # 1 where the other is believed to avoid too
P_LOWEST = 12  # m down: no avoidance descends below
P_FORCE = 13
P_DISABLE = 14
P_COMPENSATION = 15
P_DELAY = 16  # s, estimated
P_RETURN_TIME = 17  # s
P_TIE_BREAK = 18
P_RISE_TIME = 19  # 1: the bang-bang controller compares altitudes after the rise time
P_LEAVE_INSIDE = 20
P_SMOOTHING = 21
P_STALE = 22  # s
P_CONTROLLER = 23
P_MARGIN_GROWTH = 24  # m/s, of the margin with a message's age
P_KINDS = 25  # what `maneuver_kernels` may change
P_LEVEL_LAG = 26  # s, of the horizontal velocity
P_SPEED_MAX = 27  # m/s
P_HIGHEST = 28  # m down: no avoidance climbs above
P_SIDE = 29  # -1: pass above, 1: below, 0: as the altitudes say
# From `threshold.P_THRESHOLD` on: how conflicts are told.
N_SETTINGS = threshold.P_END

FULL, SHARED, SHARED_CORRECTED = 0, 1, 2
UNCOMPENSATED, ESTIMATE, TIMESTAMP = 0, 1, 2
NONE, BANG_BANG, CONTINUOUS, INTERVAL, ALTITUDES, MANEUVERS = 0, 1, 2, 3, 4, 5
# Why a vehicle avoids.
NO_REASON, CURRENT, RETURN, HELD, INSIDE, FORCED = 0, 1, 2, 3, 4, 5

RISE_TIMES = 4.0  # time constants after which a velocity counts as reached (4.14)


@jit_uncounted
def limited(value: float, low: float, high: float) -> float:
    """Return `value` limited to [low, high]."""
    return min(max(value, low), high)


@jit_uncounted
def guidance_rate(z: float, z_wanted: float, p: FloatArray) -> float:
    """Return the velocity down that guidance commands to come to `z_wanted`."""
    return limited(p[P_GAIN] * (z_wanted - z), p[P_RETURN_UP], p[P_RETURN_DOWN])


@jit_uncounted
def closest_point(px: float, py: float, pz: float, vx: float, vy: float, vz: float) -> tuple[float, float]:
    """Return t* >= 0 and d* of straight flight (4.11), (4.12); t* is 0 where there is no relative motion."""
    vv = vx * vx + vy * vy + vz * vz
    t = 0.0
    if vv > 0.0:
        t = max(0.0, -(px * vx + py * vy + pz * vz) / vv)
    dx, dy, dz = px + vx * t, py + vy * t, pz + vz * t
    return t, math.sqrt(dx * dx + dy * dy + dz * dz)


@jit_uncounted
def _reach(t: float, px: float, py: float, pz: float, vx: float, vy: float, vz: float, steep: float) -> float:
    dx, dy = px + vx * t, py + vy * t
    return max(math.sqrt(dx * dx + dy * dy), steep * abs(pz + vz * t))


@jit_uncounted
def closest_pass(
    px: float, py: float, pz: float, vx: float, vy: float, vz: float, d: float, half: float
) -> tuple[float, float]:
    """Return t* >= 0 and the miss there, which is `d` where the protected zone is touched.

    Of a sphere the distance, as `closest_point`; of a cylinder (`half` > 0) the larger one of the horizontal distance
    and the height scaled by d / half.
    """
    if half <= 0.0:
        return closest_point(px, py, pz, vx, vy, vz)
    steep = d / half
    t, least = 0.0, _reach(0.0, px, py, pz, vx, vy, vz, steep)
    qb, qc = px * vx + py * vy, vx * vx + vy * vy
    # The larger of two convex functions is least where one of them is, or where both are equal.
    a, b, c = qc - (steep * vz) ** 2, qb - steep * steep * pz * vz, px * px + py * py - (steep * pz) ** 2
    root = math.sqrt(max(b * b - a * c, 0.0))
    for k in range(4):
        at = -1.0
        if k == 0 and qc > 0.0:
            at = -qb / qc
        elif k == 1 and vz != 0.0:
            at = -pz / vz
        elif k >= 2 and a != 0.0:
            at = (-b + root) / a if k == 2 else (-b - root) / a
        elif k == 2 and b != 0.0:
            at = -0.5 * c / b
        if 0.0 < at < math.inf:
            miss = _reach(at, px, py, pz, vx, vy, vz, steep)
            if miss < least:
                t, least = at, miss
    return t, least


@jit_uncounted
def half_height(d: float, p: FloatArray) -> float:
    """Return the half-height of the protected cylinder where the radius `d` is wanted; 0 for a sphere."""
    return p[P_HALF_HEIGHT] + d - p[P_SEPARATION] if p[P_HALF_HEIGHT] > 0.0 else 0.0


@jit_uncounted
def wanted_separation(px: float, py: float, pz: float, vx: float, vy: float, vz: float, p: FloatArray) -> float:
    """Return the miss distance that the threshold wants of a pair, by the settings' errors of states that are fresh."""
    return threshold.needed_separation(p[P_SEPARATION], px, py, pz, vx, vy, vz, 0.0, 0.0, p)


@jit_uncounted
def tangent_rates(px: float, py: float, pz: float, vx: float, vy: float, d: float) -> tuple[bool, float, float]:
    """Return whether the relative velocity down can be tangent to the sphere, and both roots of (4.16), + first.

    The first root passes above, the second below: outside the cylinder of radius d and inside it. There is none inside
    the sphere, nor where the horizontal miss exceeds d (4.23), (4.25).
    """
    outside = px * px + py * py + pz * pz - d * d
    qa = pz * pz - outside
    qb = vx * px + vy * py
    qc = vx * vx + vy * vy
    under_root = outside * (qa * qc + qb * qb)
    if not under_root > 0.0 or qa == 0.0:
        return False, 0.0, 0.0
    root = math.sqrt(under_root)
    return True, (-pz * qb + root) / qa, (-pz * qb - root) / qa


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
    possible, above, below = tangent_rates(px, py, pz, vx, vy, d)
    if qa > 0.0:
        if not possible:
            above, below = 0.0, 0.0
        return (above, math.inf, t) if pz < 0.0 else (-math.inf, below, t)
    if not possible:
        return math.nan, math.nan, math.inf
    return above, below, t


@jit_uncounted
def side(z: float, first: bool, p: FloatArray) -> int:
    """Return -1 to pass above, 1 below, 0 undecided; `first` climbs at equal altitudes (errata, "CAS thesis")."""
    if p[P_SIDE] != 0.0:
        return -1 if p[P_SIDE] < 0.0 else 1
    if z < 0.0:
        return -1
    if z > 0.0:
        return 1
    if p[P_TIE_BREAK] == 0.0:
        return 0
    return -1 if first else 1


@jit_uncounted
def shared_rate(relative: float, w: float, other_w: float, cooperates: bool, p: FloatArray) -> float:
    """Return the own velocity down that makes this vehicle's part of the relative velocity (4.19), (4.20)."""
    if cooperates and p[P_LAW] == SHARED:
        return 0.5 * relative + other_w
    if cooperates and p[P_LAW] == SHARED_CORRECTED:
        # Half of the relative velocity would settle at half of what is needed (errata, "CAS thesis").
        return w + 0.5 * (relative - (w - other_w))
    return relative + other_w


@jit_uncounted
def _inside(px: float, py: float, pz: float, d: float, half: float) -> bool:
    if half > 0.0:
        return bool(px * px + py * py < d * d and abs(pz) < half)
    return bool(px * px + py * py + pz * pz < d * d)


@jit_uncounted
def continuous(
    z: float,
    w: float,
    other_w: float,
    px: float,
    py: float,
    pz: float,
    vx: float,
    vy: float,
    guidance: float,
    avoiding: bool,
    first: bool,
    p: FloatArray,
) -> tuple[int, float, float, float]:
    """Decide once by tangent velocities (4.3.2, listing A.3).

    Parameters
    ----------
    z, w, other_w : float
        Own position and velocity down, and the other's velocity down.
    px, py, pz, vx, vy : float
        Relative position and horizontal velocity.
    guidance : float
        Velocity down that guidance wants.
    avoiding, first : bool
        Whether the vehicle avoids already; whether it climbs in a tie.
    p : ndarray, shape (N_SETTINGS,)

    Returns
    -------
    reason, command, t_star, d_star
        `NO_REASON` where guidance flies.
    """
    delta, soon = p[P_HYSTERESIS], p[P_T_STAR_MIN]
    vz = w - other_w
    d = wanted_separation(px, py, pz, vx, vy, vz, p)
    half = half_height(d, p)
    t_now, d_now = closest_pass(px, py, pz, vx, vy, vz, d, half)
    t_back, d_back = closest_pass(px, py, pz, vx, vy, guidance - other_w, d, half)
    inside = _inside(px, py, pz, d, half)
    reason = NO_REASON
    if d_now <= d - delta and 0.0 < t_now < soon:
        reason = CURRENT
    elif d_back <= d and 0.0 < t_back < soon:
        reason = RETURN
    elif d - delta <= d_now <= d + delta and avoiding and 0.0 < t_now < soon:
        reason = HELD
    elif inside and p[P_LEAVE_INSIDE] > 0.0:
        reason = INSIDE
    elif p[P_FORCE] > 0.0:
        reason = FORCED
    if reason == NO_REASON or p[P_DISABLE] > 0.0:
        return NO_REASON, guidance, t_now, d_now
    which = side(pz + vz * (t_now if t_now > 0.0 else t_back), first, p)
    if half > 0.0:
        above, below, _ = forbidden_rates(px, py, pz, vx, vy, d, half)
        possible = not (math.isnan(above) or inside)
        if possible and math.isinf(above):
            which = 1  # within the radius and below
        elif possible and math.isinf(below):
            which = -1
    else:
        possible, above, below = tangent_rates(px, py, pz, vx, vy, d)
    if which == 0 or not (possible or inside):
        return NO_REASON, guidance, t_now, d_now
    if possible:
        cooperates = p[P_COOPERATES] > 0.0 and z - pz <= p[P_LOWEST]
        command = shared_rate(above if which < 0 else below, w, other_w, cooperates, p)
        command = limited(command, p[P_UP], p[P_DOWN])
    else:
        reason = INSIDE
        command = p[P_UP] if which < 0 else p[P_DOWN]
    if z > p[P_LOWEST]:
        command = min(command, 0.0)
    if z < p[P_HIGHEST]:
        command = max(command, 0.0)
    return reason, command, t_now, d_now


@jit_uncounted
def bang_bang(
    z: float,
    w: float,
    other_w: float,
    px: float,
    py: float,
    pz: float,
    vx: float,
    vy: float,
    guidance: float,
    avoiding: bool,
    command: float,
    first: bool,
    p: FloatArray,
) -> tuple[int, float, float, float]:
    """Decide once by full climb or descent, begun as late as the lag allows (4.3.1, listing A.2).

    `command` is that of the avoidance begun, where `avoiding`; the other parameters and the result are those of
    `continuous`.
    """
    vz = w - other_w
    d = wanted_separation(px, py, pz, vx, vy, vz, p)
    half = half_height(d, p)
    t_now, d_now = closest_pass(px, py, pz, vx, vy, vz, d, half)
    if p[P_DISABLE] > 0.0:
        return NO_REASON, guidance, t_now, d_now
    cooperates = p[P_COOPERATES] > 0.0 and z - pz <= p[P_LOWEST]
    low, high = z > p[P_LOWEST], z < p[P_HIGHEST]
    if avoiding:
        other = other_w
        if cooperates:
            other = p[P_RETURN_UP] if command < 0.0 else p[P_RETURN_DOWN]
        t_back, d_back = closest_pass(px, py, pz, vx, vy, guidance - other, d, half)
        safe = d_back >= d
        if safe and p[P_SIDE] * (pz + (guidance - other) * t_back) < 0.0:
            # It would pass on the other side, where it is not to pass at all.
            above, _, _ = forbidden_rates(px, py, pz, vx, vy, d, half)
            safe = math.isnan(above)
        over = safe or t_back >= p[P_RETURN_TIME] or (low and guidance > 0.0) or (high and guidance < 0.0)
        if over and p[P_FORCE] == 0.0:
            return NO_REASON, guidance, t_now, d_now
        return HELD, command, t_now, d_now
    tested = p[threshold.P_HYPOTHESIS_TEST] > 0.0
    if not (d_now <= d or tested or p[P_FORCE] > 0.0):
        return NO_REASON, guidance, t_now, d_now
    rise = RISE_TIMES * p[P_LAG]
    qx, qy, qz = px + vx * rise, py + vy * rise, pz + vz * rise
    at = qz
    if p[P_RISE_TIME] == 0.0:
        at = pz + vz * t_now
    which = side(at if at != 0.0 else pz, first, p)
    if p[P_COOPERATES] == 0.0 and (low or high):
        which = -1 if low else 1
    if which == 0 or (which > 0 and low) or (which < 0 and high):
        return NO_REASON, guidance, t_now, d_now
    command = p[P_UP] if which < 0 else p[P_DOWN]
    other = other_w
    if cooperates:
        other = p[P_DOWN] if which < 0 else p[P_UP]
    t_turned, d_turned = closest_pass(qx, qy, qz, vx, vy, command - other, d, half)
    begins = d_turned <= d
    if tested:
        begins = threshold.begins_by_test(
            p[P_SEPARATION],
            d_now,
            threshold.spread(t_now, p),
            d_turned,
            threshold.spread(rise + t_turned, p),
            p,
        )
    if begins:
        return CURRENT, command, t_now, d_now
    if p[P_FORCE] > 0.0:
        return FORCED, command, t_now, d_now
    return NO_REASON, guidance, t_now, d_now


@jit_uncounted
def decide_pairs(
    own: FloatArray,
    other: FloatArray,
    z_wanted: FloatArray,
    first: FloatArray,
    p: FloatArray,
    reasons: IntArray,
    commands: FloatArray,
    closest: FloatArray,
) -> None:
    """Decide once for many pairs, each on its own.

    Parameters
    ----------
    own, other : ndarray, shape (n, 6)
        Position and velocity, NED.
    z_wanted, first : ndarray, shape (n,)
        Position down of guidance; 1 where the own vehicle climbs in a tie.
    p : ndarray, shape (N_SETTINGS,)
    reasons : ndarray of int64, shape (n,)
        Before and after; not `NO_REASON` where the vehicle avoids.
    commands : ndarray, shape (n,)
        Before and after.
    closest : ndarray, shape (n, 2)
        t* and d*, written.
    """
    for i in range(own.shape[0]):
        z, w, other_w = own[i, 2], own[i, 5], other[i, 5]
        px, py, pz = own[i, 0] - other[i, 0], own[i, 1] - other[i, 1], z - other[i, 2]
        vx, vy = own[i, 3] - other[i, 3], own[i, 4] - other[i, 4]
        guidance = guidance_rate(z, z_wanted[i], p)
        avoiding, leads = reasons[i] != NO_REASON, first[i] > 0.0
        if p[P_CONTROLLER] == BANG_BANG:
            reason, command, t, d = bang_bang(
                z, w, other_w, px, py, pz, vx, vy, guidance, avoiding, commands[i], leads, p
            )
        else:
            reason, command, t, d = continuous(z, w, other_w, px, py, pz, vx, vy, guidance, avoiding, leads, p)
        reasons[i], commands[i], closest[i, 0], closest[i, 1] = reason, command, t, d


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    state, one, p = np.ones((1, 6)), np.ones(1), np.ones(N_SETTINGS)
    decide_pairs(state, state, one, one, p, np.zeros(1, np.int64), one, np.empty((1, 2)))
    guidance_rate(1.0, 1.0, p)
    closest_point(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    tangent_rates(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    forbidden_rates(9.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
    closest_pass(9.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 1.0)
