"""Geometry of two aircraft in straight flight: closest approach and the interval inside a well-clear volume.

All kernels take the relative state s, v (ownship minus intruder or the reverse: every result is even in the sign) in
any right frame whose third axis is vertical; m, m/s, s. Volumes are WCV_TAUMOD (DTHR, ZTHR half-height, TTHR, TCOA) of
Munoz, Narkawicz and Chamberlain; a cylinder is one with TTHR = TCOA = 0. DTHR and ZTHR are positive.

Bounds belong to the volume, but a touch of no duration (grazing, or leaving from the bound at this instant) is no
conflict.
"""

import math

import numpy as np

from wideberth._jit import jit_uncounted


@jit_uncounted
def horizontal_cpa(sx: float, sy: float, vx: float, vy: float) -> tuple[float, float]:
    """Return time (s, signed; 0 without relative motion) and distance (m) of the horizontal closest point of approach.

    A past closest point has a negative time; callers that look ahead clamp it to zero themselves.
    """
    a = vx * vx + vy * vy
    if a == 0.0:
        return 0.0, math.sqrt(sx * sx + sy * sy)
    # The cross product keeps the digits of the miss that sqrt(s.s - (s.v)^2 / v.v) loses far away.
    return -(sx * vx + sy * vy) / a, abs(sx * vy - sy * vx) / math.sqrt(a)


@jit_uncounted
def horizontal_interval(
    sx: float, sy: float, vx: float, vy: float, dthr: float, tthr: float, miss_filter: bool
) -> tuple[float, float]:
    """Return first and last time >= 0 inside the circle DTHR or with modified tau <= TTHR; NaN where there is none.

    With `miss_filter` modified tau counts only where the miss distance is at most DTHR (the definition of WCV_TAUMOD).
    The last time is inf where the aircraft never leave.
    """
    a = vx * vx + vy * vy
    sv = sx * vx + sy * vy
    outside = sx * sx + sy * sy - dthr * dthr
    if a == 0.0:
        if outside <= 0.0:
            return 0.0, math.inf
        return math.nan, math.nan
    cross = sx * vy - sy * vx
    # A quarter of the discriminant of |s + v t|^2 = DTHR^2; negative: the path misses the circle.
    delta = a * dthr * dthr - cross * cross
    if outside >= 0.0 and (sv >= 0.0 or (miss_filter and delta < 0.0)):
        return math.nan, math.nan
    # Modified tau <= TTHR while closing: a t^2 + b t + c <= 0.
    b = 2.0 * sv + tthr * a
    c = outside + tthr * sv
    root_squared = 4.0 * delta + (tthr * a) ** 2
    if outside <= 0.0 or c <= 0.0:
        t_in = 0.0
    else:
        if root_squared < 0.0 or b >= 0.0:
            return math.nan, math.nan
        t_in = 2.0 * c / (math.sqrt(root_squared) - b)
    if outside <= 0.0 or delta >= 0.0:
        root = math.sqrt(max(delta, 0.0))
        # The form without cancellation on either side of the closest point.
        t_out = (root - sv) / a if sv <= 0.0 else -outside / (root + sv)
    else:
        root = math.sqrt(root_squared)
        t_out = (root - b) / (2.0 * a) if b <= 0.0 else -2.0 * c / (root + b)
    return t_in, t_out


@jit_uncounted
def vertical_interval(sz: float, vz: float, zthr: float, tcoa: float) -> tuple[float, float]:
    """Return first and last time >= 0 within +-ZTHR or with time to co-altitude <= TCOA; NaN where there is none."""
    height, rate = abs(sz), abs(vz)
    approaching = sz * vz < 0.0
    reach = max(zthr, tcoa * rate) if approaching else zthr
    if (height > reach and not approaching) or (height == zthr and sz * vz > 0.0):
        return math.nan, math.nan
    t_in = 0.0 if height <= reach else (height - reach) / rate
    if rate == 0.0:
        return t_in, math.inf
    return t_in, ((zthr + height) / rate if approaching else (zthr - height) / rate)


@jit_uncounted
def well_clear_interval(
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    dthr: float,
    zthr: float,
    tthr: float,
    tcoa: float,
    lookahead: float,
    miss_filter: bool,
) -> tuple[float, float]:
    """Return the times of entering and leaving the volume, cut to [0, look-ahead]; NaN where it is not entered."""
    z_in, z_out = vertical_interval(sz, vz, zthr, tcoa)
    if not z_in <= lookahead:
        return math.nan, math.nan
    h_in, h_out = horizontal_interval(sx, sy, vx, vy, dthr, tthr, miss_filter)
    t_in = max(h_in, z_in)
    t_out = min(h_out, z_out)
    if h_in <= lookahead and t_in < t_out:
        return t_in, min(t_out, lookahead)
    return math.nan, math.nan


@jit_uncounted
def well_clear_violation(
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    dthr: float,
    zthr: float,
    tthr: float,
    tcoa: float,
    miss_filter: bool,
) -> bool:
    """Return whether the aircraft are in the volume now: exactly where `well_clear_interval` begins at 0."""
    height = abs(sz)
    if height >= zthr and (sz * vz > 0.0 or (height > zthr and (sz * vz == 0.0 or height > tcoa * abs(vz)))):
        return False
    outside = sx * sx + sy * sy - dthr * dthr
    if outside < 0.0:
        return True
    a = vx * vx + vy * vy
    if a == 0.0:
        return outside == 0.0
    sv = sx * vx + sy * vy
    if sv >= 0.0:
        return False
    cross = sx * vy - sy * vx
    if a * dthr * dthr >= cross * cross:
        return outside + tthr * sv <= 0.0
    c = outside + tthr * sv
    return not miss_filter and (c < 0.0 or (c == 0.0 and 2.0 * sv + tthr * a < 0.0))


@jit_uncounted
def conflict_intervals(
    own_position: np.ndarray,
    own_velocity: np.ndarray,
    intruder_position: np.ndarray,
    intruder_velocity: np.ndarray,
    dthr: float,
    zthr: float,
    tthr: float,
    tcoa: float,
    lookahead: float,
    miss_filter: bool,
    t_in: np.ndarray,
    t_out: np.ndarray,
) -> None:
    """Fill `t_in`, `t_out` (n) with `well_clear_interval`; each input is (n, 3) or (1, 3), which serves all pairs."""
    jp, jv = int(own_position.shape[0] > 1), int(own_velocity.shape[0] > 1)
    kp, kv = int(intruder_position.shape[0] > 1), int(intruder_velocity.shape[0] > 1)
    for i in range(t_in.shape[0]):
        t_in[i], t_out[i] = well_clear_interval(
            own_position[i * jp, 0] - intruder_position[i * kp, 0],
            own_position[i * jp, 1] - intruder_position[i * kp, 1],
            own_position[i * jp, 2] - intruder_position[i * kp, 2],
            own_velocity[i * jv, 0] - intruder_velocity[i * kv, 0],
            own_velocity[i * jv, 1] - intruder_velocity[i * kv, 1],
            own_velocity[i * jv, 2] - intruder_velocity[i * kv, 2],
            dthr,
            zthr,
            tthr,
            tcoa,
            lookahead,
            miss_filter,
        )


@jit_uncounted
def violations(
    own_position: np.ndarray,
    own_velocity: np.ndarray,
    intruder_position: np.ndarray,
    intruder_velocity: np.ndarray,
    dthr: float,
    zthr: float,
    tthr: float,
    tcoa: float,
    miss_filter: bool,
    violated: np.ndarray,
) -> None:
    """Fill `violated` (n, bool) with `well_clear_violation`; each input is (n, 3) or (1, 3), which serves all pairs."""
    jp, jv = int(own_position.shape[0] > 1), int(own_velocity.shape[0] > 1)
    kp, kv = int(intruder_position.shape[0] > 1), int(intruder_velocity.shape[0] > 1)
    for i in range(violated.shape[0]):
        violated[i] = well_clear_violation(
            own_position[i * jp, 0] - intruder_position[i * kp, 0],
            own_position[i * jp, 1] - intruder_position[i * kp, 1],
            own_position[i * jp, 2] - intruder_position[i * kp, 2],
            own_velocity[i * jv, 0] - intruder_velocity[i * kv, 0],
            own_velocity[i * jv, 1] - intruder_velocity[i * kv, 1],
            own_velocity[i * jv, 2] - intruder_velocity[i * kv, 2],
            dthr,
            zthr,
            tthr,
            tcoa,
            miss_filter,
        )


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    zero, one, volume = np.zeros((1, 3)), np.ones((1, 3)), (1000.0, 200.0, 35.0, 0.0)
    conflict_intervals(one, zero, zero, one, *volume, 60.0, True, np.empty(1), np.empty(1))
    violations(one, zero, zero, one, *volume, True, np.empty(1, np.bool_))
    horizontal_cpa(1.0, 1.0, 1.0, 1.0)
