"""Algorithms 1 and 2 of the ADS-B paper, the spread of a predicted miss, conflict probability, and alert levels.

Relative states are intruder minus ownship, north, east, down; m, m/s, s. Heights are half-heights.
"""

import math

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.kernels import horizontal_cpa, well_clear_interval

SIGMA_NONE, SIGMA_PAPER, SIGMA_TRACK = 0, 1, 2
CLEAR, PREVENTIVE, CORRECTIVE, WARNING = 0, 2, 3, 4  # the values of types.AlertLevel


@jit_uncounted
def condition_interval(
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    d_th: float,
    h_th: float,
    tau_th: float,
    h_c: float,
) -> tuple[float, float]:
    """Return the times (any sign) between which line 1 of algorithms 1 and 2 holds; NaN where it never does.

    Horizontally: closer than `d_th`, or converging with t_cpa <= `tau_th`; both sets meet at the closest point of
    approach, so their union is one interval. Vertically the same with `h_th` and the time to enter +-`h_c`.
    """
    a = vx * vx + vy * vy
    if a == 0.0:
        if sx * sx + sy * sy >= d_th * d_th:
            return math.nan, math.nan
        t_in, t_out = -math.inf, math.inf
    else:
        t_cpa = -(sx * vx + sy * vy) / a
        cross = sx * vy - sy * vx
        t_in, t_out = t_cpa - tau_th, t_cpa
        delta = a * d_th * d_th - cross * cross
        if delta > 0.0:
            half = math.sqrt(delta) / a
            t_in, t_out = min(t_in, t_cpa - half), t_cpa + half
    if vz == 0.0:
        if abs(sz) >= h_th:
            return math.nan, math.nan
    else:
        t_level, rate = -sz / vz, abs(vz)
        t_in = max(t_in, t_level - max(h_th / rate, h_c / rate + tau_th))
        t_out = min(t_out, t_level + h_th / rate)
    if t_in < t_out:
        return t_in, t_out
    return math.nan, math.nan


@jit_uncounted
def detection_time(
    sx: float,
    sy: float,
    sz: float,
    vx: float,
    vy: float,
    vz: float,
    d_th: float,
    h_th: float,
    tau_th: float,
    h_c: float,
    lookahead: float,
) -> float:
    """Return the first time in (0, look-ahead] at which line 1 of algorithms 1 and 2 holds (0: at once), or NaN."""
    t_in, t_out = condition_interval(sx, sy, sz, vx, vy, vz, d_th, h_th, tau_th, h_c)
    if t_out > 0.0 and t_in <= lookahead:
        return max(t_in, 0.0)
    return math.nan


@jit_uncounted
def relative_covariance(
    own: np.ndarray, intruder: np.ndarray, i: int, j: int, t_own: float, t_intruder: float
) -> float:
    """Return element (i, j) of the covariance of the relative position after straight flight for the given times.

    `own` is (6, 6), `intruder` (9, 9) or (6, 6): position, velocity, further states ignored.
    """
    a = own[i, j] + t_own * (own[i, j + 3] + own[i + 3, j]) + t_own * t_own * own[i + 3, j + 3]
    b = intruder[i, j] + t_intruder * (intruder[i, j + 3] + intruder[i + 3, j] + t_intruder * intruder[i + 3, j + 3])
    return float(a + b)


@jit_uncounted
def miss_direction(sx: float, sy: float, vx: float, vy: float, t: float) -> tuple[float, float]:
    """Return the unit vector along the horizontal miss at time `t`; normal to the velocity where the miss is zero."""
    mx, my = sx + vx * t, sy + vy * t
    miss, speed = math.hypot(mx, my), math.hypot(vx, vy)
    # Within a micrometre of the closest point's centre the direction of the miss is only rounding.
    if miss > 1e-6:
        return mx / miss, my / miss
    if speed > 0.0:
        return -vy / speed, vx / speed
    return 1.0, 0.0


@jit_uncounted
def paper_sigma(sigma_position: float, sigma_rate: float, t: float, noisy: int, printed: bool) -> float:
    """Return the sigma of a separation predicted over `t` from constant errors of `noisy` (1 or 2) aircraft."""
    # ERRATA, ADS-B paper: printed with t, which has wrong dimensions; t^2 is right.
    growth = max(t, 0.0) if printed else t * t
    return math.sqrt(noisy * (sigma_position * sigma_position + growth * sigma_rate * sigma_rate))


@jit_uncounted
def band_probability(limit: float, mean: float, sigma: float) -> float:
    """Return the probability that a normal value lies within +-`limit` (bounds included where sigma is 0)."""
    if sigma <= 0.0:
        return 1.0 if abs(mean) <= limit else 0.0
    scale = 1.0 / (sigma * math.sqrt(2.0))
    # erfc of the nearer tail keeps digits when the band is many sigmas away.
    mean = abs(mean)
    if mean > limit:
        return 0.5 * (math.erfc((mean - limit) * scale) - math.erfc((mean + limit) * scale))
    return 1.0 - 0.5 * (math.erfc((limit - mean) * scale) + math.erfc((limit + mean) * scale))


@jit_uncounted
def closest_ahead(sx: float, sy: float, vx: float, vy: float, latest: float) -> float:
    """Return the time of the horizontal closest point of approach, cut to [0, latest].

    A closest point behind us, or beyond all that line 1 looks at, predicts nothing: the nearest one ahead is taken.
    """
    t_cpa, _ = horizontal_cpa(sx, sy, vx, vy)
    return min(max(t_cpa, 0.0), latest)


@jit_uncounted
def track_sigmas(
    sx: float,
    sy: float,
    vx: float,
    vy: float,
    own: np.ndarray,
    intruder: np.ndarray,
    t_cpa: float,
    t: float,
) -> tuple[float, float]:
    """Return sigma of the horizontal miss and of the height at the closest point, from the covariances of both.

    Parameters
    ----------
    sx, sy, vx, vy : float
    own, intruder : ndarray
        As for `relative_covariance`.
    t_cpa, t : float
        How far ahead the closest point is, and how far ahead of the time of the intruder's covariance.
    """
    ex, ey = miss_direction(sx, sy, vx, vy, t_cpa)
    variance = (
        ex * ex * relative_covariance(own, intruder, 0, 0, t_cpa, t)
        + ex
        * ey
        * (relative_covariance(own, intruder, 0, 1, t_cpa, t) + relative_covariance(own, intruder, 1, 0, t_cpa, t))
        + ey * ey * relative_covariance(own, intruder, 1, 1, t_cpa, t)
    )
    sigma_h = math.sqrt(max(relative_covariance(own, intruder, 2, 2, t_cpa, t), 0.0))
    return math.sqrt(max(variance, 0.0)), sigma_h


@jit_uncounted
def detect(
    s: np.ndarray,
    v: np.ndarray,
    own_covariance: np.ndarray,
    covariance: np.ndarray,
    age: float,
    rules: np.ndarray,
    noise: np.ndarray,
    noisy: int,
    source: int,
    printed: bool,
    out: np.ndarray,
) -> None:
    """Algorithm 2 (algorithm 1 with source = SIGMA_NONE) for one intruder.

    `rules`: d_th, h_th, tau_th, d_c, h_c, m1, m2, look-ahead. `noise`: sigma of position, velocity, altitude, climb
    rate. `age` is how long the covariance lies back. `out`: detected (0, 1), t_detected, t_cpa, d_cpa, h_cpa, sigma_d,
    sigma_h.
    """
    t_detected = detection_time(s[0], s[1], s[2], v[0], v[1], v[2], rules[0], rules[1], rules[2], rules[4], rules[7])
    if printed:
        t_cpa, _ = horizontal_cpa(s[0], s[1], v[0], v[1])
    else:
        t_cpa = closest_ahead(s[0], s[1], v[0], v[1], rules[7] + rules[2])
    d_cpa = math.hypot(s[0] + v[0] * t_cpa, s[1] + v[1] * t_cpa)
    h_cpa = abs(s[2] + v[2] * t_cpa)
    sigma_d, sigma_h = 0.0, 0.0
    if source == SIGMA_PAPER:
        sigma_d = paper_sigma(noise[0], noise[1], t_cpa, noisy, printed)
        sigma_h = paper_sigma(noise[2], noise[3], t_cpa, noisy, printed)
    elif source == SIGMA_TRACK:
        sigma_d, sigma_h = track_sigmas(s[0], s[1], v[0], v[1], own_covariance, covariance, t_cpa, t_cpa + age)
    near = d_cpa - rules[5] * sigma_d < rules[3] and h_cpa - rules[6] * sigma_h < rules[4]
    detected = near and not math.isnan(t_detected)
    out[0] = 1.0 if detected else 0.0
    out[1] = t_detected if detected else math.nan
    out[2], out[3], out[4], out[5], out[6] = t_cpa, d_cpa, h_cpa, sigma_d, sigma_h


@jit
def detect_all(
    own_position: np.ndarray,
    own_velocity: np.ndarray,
    own_covariance: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    covariances: np.ndarray,
    rules: np.ndarray,
    noise: np.ndarray,
    noisy: int,
    source: int,
    printed: bool,
    out: np.ndarray,
) -> None:
    """Fill `out` (n, 7) with `detect`. States are (n, 3) or (1, 3), covariances (6, 6) and (n or 1, 9, 9)."""
    s, v = np.empty(3), np.empty(3)
    jp, jv = int(own_position.shape[0] > 1), int(own_velocity.shape[0] > 1)
    kp, kv, kc = int(positions.shape[0] > 1), int(velocities.shape[0] > 1), int(covariances.shape[0] > 1)
    for i in range(out.shape[0]):
        for k in range(3):
            s[k] = positions[i * kp, k] - own_position[i * jp, k]
            v[k] = velocities[i * kv, k] - own_velocity[i * jv, k]
        detect(s, v, own_covariance, covariances[i * kc], 0.0, rules, noise, noisy, source, printed, out[i])


@jit
def assess_all(
    own_position: np.ndarray,
    own_velocity: np.ndarray,
    own_covariance: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    covariances: np.ndarray,
    ages: np.ndarray,
    volume: np.ndarray,
    separation: np.ndarray,
    collision: np.ndarray,
    times: np.ndarray,
    near: np.ndarray,
    noise: np.ndarray,
    noisy: int,
    source: int,
    printed: bool,
    miss_filter: bool,
    out: np.ndarray,
) -> None:
    """Fill `out` (n, 7) with t_cpa, d_cpa, h_cpa, t_in, t_out, probability, level of each track.

    `volume`: DTHR, ZTHR, TTHR, TCOA; `separation` and `collision`: rules as in `detect`; `times`: corrective, warning;
    `near`: radius and half-height within which an aircraft is at least preventive.
    """
    s, v, row = np.empty(3), np.empty(3), np.empty(7)
    for i in range(out.shape[0]):
        for k in range(3):
            v[k] = velocities[i, k] - own_velocity[k]
            s[k] = positions[i, k] + velocities[i, k] * ages[i] - own_position[k]
        detect(s, v, own_covariance, covariances[i], ages[i], separation, noise, noisy, source, printed, row)
        t_loss, t_cpa, d_cpa, h_cpa, sigma_d, sigma_h = row[1], row[2], row[3], row[4], row[5], row[6]
        t_in, t_out = well_clear_interval(
            s[0],
            s[1],
            s[2],
            v[0],
            v[1],
            v[2],
            volume[0],
            volume[1],
            volume[2],
            volume[3],
            separation[7],
            miss_filter,
        )
        probability = band_probability(volume[0], d_cpa, sigma_d) * band_probability(volume[1], h_cpa, sigma_h)
        detect(s, v, own_covariance, covariances[i], ages[i], collision, noise, noisy, source, printed, row)
        # Widened, but to the well-clear volume at most: where sigma is larger, it says that little is known, not that a
        # collision is near.
        radius = collision[3] + min(collision[5] * row[5], max(volume[0] - collision[3], 0.0))
        height = collision[4] + min(collision[6] * row[6], max(volume[1] - collision[4], 0.0))
        # The height at the closest point misses an intruder that climbs or sinks through ours inside the circle.
        t_hit, _ = well_clear_interval(
            s[0],
            s[1],
            s[2],
            v[0],
            v[1],
            v[2],
            radius,
            height,
            0.0,
            0.0,
            times[1],
            False,
        )
        level = CLEAR
        if t_in >= 0.0 or t_loss >= 0.0 or (math.hypot(s[0], s[1]) <= near[0] and abs(s[2]) <= near[1]):
            level = PREVENTIVE
        if t_in <= times[0] or t_loss <= times[0]:
            level = CORRECTIVE
        if t_hit >= 0.0 or (row[0] > 0.0 and row[3] < radius and row[4] < height and row[2] <= times[1]):
            level = WARNING
        out[i, 0], out[i, 1], out[i, 2] = t_cpa, d_cpa, h_cpa
        out[i, 3], out[i, 4], out[i, 5], out[i, 6] = t_in, t_out, probability, level


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    zero, one, own, track = np.zeros((1, 3)), np.ones((1, 3)), np.eye(6), np.eye(9)[None]
    rules, noise, out = np.ones(8), np.ones(4), np.empty((1, 7))
    relative_covariance(own, track[0], 0, 0, 1.0, 1.0)
    band_probability(1.0, 1.0, 1.0)
    miss_direction(1.0, 1.0, 1.0, 1.0, 1.0)
    detect_all(one, zero, own, zero, one, track, rules, noise, 1, SIGMA_TRACK, False, out)
    assess_all(
        zero[0],
        one[0],
        own,
        one,
        zero,
        track,
        np.zeros(1),
        np.ones(4),
        rules,
        rules,
        np.ones(2),
        np.ones(2),
        noise,
        1,
        SIGMA_TRACK,
        False,
        False,
        out,
    )
