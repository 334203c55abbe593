"""Compiled conflict thresholds (CAS thesis, 4.1.3): how far apart the mean course must pass for no conflict.

Each kind turns into a distance that is kept like the radius of the protected zone, so that all controllers know all
kinds. Relative quantities are own minus other, NED; m, m/s, s. `p` holds the settings (indices ``P_...``).
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.detection_kernels import band_probability
from wideberth.conflict.guaranteed_kernels import POLYNOMIAL, guaranteed_distance

FloatArray = NDArray[np.float64]

DETERMINISTIC, PROBABILITY, TABLE, GUARANTEED = 0, 1, 2, 3

# The thresholds' part of a controller's settings, after those of `pair_kernels`.
P_THRESHOLD = 30
P_VARIANCE = 31  # m2, of the relative position
P_RATE_VARIANCE = 32  # m2/s2, of the relative velocity
P_DENSITY = 33  # m2/s3, of white acceleration
P_POSITION_BOUND = 34  # m, on each axis, as the next two
P_VELOCITY_BOUND = 35  # m/s
P_ACCELERATION_BOUND = 36  # m/s2
P_LOOKAHEAD = 37  # s, of guaranteed distances
P_TABLE_TIME = 38  # s, of the table's last row
P_TABLE_SPEED = 39  # m/s, of the table's last column
P_ALERT_PROBABILITY = 40
P_HYPOTHESIS_TEST = 41  # 1: an avoidance starts by the test of `begins_by_test`
P_FALSE_ALARM = 42
P_MISSED = 43
P_DISTANCES = 44  # where the alert distances begin
TABLE_TIMES, TABLE_SPEEDS = 16, 8
N_DISTANCES = TABLE_TIMES * TABLE_SPEEDS
P_END = P_DISTANCES + N_DISTANCES

_INSIDE = 0.98  # of the distance now: what is asked for beyond the protected radius
_TOLERANCE = 0.01  # m, of guaranteed distances


@jit_uncounted
def spread(t: float, p: FloatArray) -> float:
    """Return the standard deviation of the relative position on each axis after `t`, by the settings' errors, m."""
    return math.sqrt(p[P_VARIANCE] + t * t * (p[P_RATE_VARIANCE] + t * p[P_DENSITY] / 3.0))


@jit_uncounted
def widened_by_spread(d: float, sigma: float, p: FloatArray) -> float:
    """Return the largest mean miss distance at which a miss below `d` is as probable as the alerting threshold, m.

    Not below `d`. The distances are those of `settings.alert_distances`: how many sigmas to add, over
    sigma / (d + sigma): good to 1 % of the probability for a sigma up to ten times `d`.
    """
    at = sigma / (d + sigma) * (N_DISTANCES - 1)
    k = min(int(at), N_DISTANCES - 2)
    low, high = p[P_DISTANCES + k], p[P_DISTANCES + k + 1]
    return max(d, float(d + sigma * (low + (at - k) * (high - low))))


@jit_uncounted
def widened_by_table(d: float, t: float, speed: float, p: FloatArray) -> float:
    """Return the same by a Monte Carlo table: `settings` holds it in units of `d` over time and relative speed."""
    row = min(t / p[P_TABLE_TIME], 1.0) * (TABLE_TIMES - 1)
    column = min(speed / p[P_TABLE_SPEED], 1.0) * (TABLE_SPEEDS - 1)
    i, j = min(int(row), TABLE_TIMES - 2), min(int(column), TABLE_SPEEDS - 2)
    a, b = row - i, column - j
    at = P_DISTANCES + TABLE_SPEEDS * i + j
    before = p[at] + b * (p[at + 1] - p[at])
    after = p[at + TABLE_SPEEDS] + b * (p[at + TABLE_SPEEDS + 1] - p[at + TABLE_SPEEDS])
    return max(d, float(d * (before + a * (after - before))))


@jit
def guaranteed_shortfall(
    px: float, py: float, pz: float, vx: float, vy: float, vz: float, age: float, p: FloatArray
) -> float:
    """Return by how much the guaranteed miss distance falls short of the nominal one until the look-ahead, m.

    Position, velocity and acceleration of the pair may be off by the settings' bounds on each axis; they have grown
    for `age` already. Components of an acceleration that changes stay within what a constant one at its bound does, so
    that turns are covered by speed times rate of turn.
    """
    until = p[P_LOOKAHEAD]
    motion, columns = np.zeros((3, 3)), np.zeros((3, 3, 9))
    motion[0, 0], motion[0, 1], motion[0, 2] = px, py, pz
    motion[1, 0], motion[1, 1], motion[1, 2] = vx, vy, vz
    acceleration = p[P_ACCELERATION_BOUND]
    velocity = p[P_VELOCITY_BOUND] + age * acceleration
    position = p[P_POSITION_BOUND] + age * (p[P_VELOCITY_BOUND] + 0.5 * age * acceleration)
    for i in range(3):
        columns[0, i, i], columns[1, i, 3 + i], columns[2, i, 6 + i] = position, velocity, acceleration
    bound = guaranteed_distance(POLYNOMIAL, motion, columns, 9, math.sqrt(3.0) * acceleration, until, False, _TOLERANCE)
    vv = vx * vx + vy * vy + vz * vz
    t = min(max(-(px * vx + py * vy + pz * vz) / vv, 0.0), until) if vv > 0.0 else 0.0
    dx, dy, dz = px + vx * t, py + vy * t, pz + vz * t
    return max(math.sqrt(dx * dx + dy * dy + dz * dz) - bound, 0.0)


@jit_uncounted
def needed_separation(
    d: float,
    px: float,
    py: float,
    pz: float,
    vx: float,
    vy: float,
    vz: float,
    age: float,
    variance: float,
    p: FloatArray,
) -> float:
    """Return at which distance the mean course must pass, so that the threshold sees no conflict.

    Parameters
    ----------
    d : float
        Radius of the protected zone.
    px, py, pz, vx, vy, vz : float
        Relative position and velocity.
    age : float
        For how long errors have grown already.
    variance : float
        Of the relative position at the closest point on each axis; 0: by `spread`.
    p : ndarray, shape (P_END,)

    More than `d` is asked for only as far as the distance now allows.
    """
    kind = int(p[P_THRESHOLD])
    if kind == DETERMINISTIC:
        return d
    vv = vx * vx + vy * vy + vz * vz
    t = max(-(px * vx + py * vy + pz * vz) / vv, 0.0) if vv > 0.0 else 0.0
    if kind == PROBABILITY:
        needed = widened_by_spread(d, math.sqrt(variance) if variance > 0.0 else spread(t + age, p), p)
    elif kind == TABLE:
        needed = widened_by_table(d, t + age, math.sqrt(vv), p)
    else:
        needed = d + guaranteed_shortfall(px, py, pz, vx, vy, vz, age, p)
    return max(d, min(needed, _INSIDE * math.sqrt(px * px + py * py + pz * pz)))


@jit_uncounted
def begins_by_test(d: float, miss: float, sigma: float, turned_miss: float, turned_sigma: float, p: FloatArray) -> bool:
    """Return whether an avoidance begins now, by a test of "conflict" against "no conflict" (CAS thesis, 4.2.2).

    Parameters
    ----------
    d : float
        Radius of the protected zone.
    miss, sigma : float
        Mean miss distance of the current course and its standard deviation.
    turned_miss, turned_sigma : float
        Those of the course when the avoidance begins now.
    p : ndarray, shape (P_END,)

    A conflict that is probable enough is left alone while an alarm may yet prove false and the avoidance succeeds
    surely enough: it begins where a false alarm, or else a failure, has the probabilities of the settings.
    """
    conflict = band_probability(d, miss, sigma)
    if conflict < p[P_ALERT_PROBABILITY]:
        return False
    return bool(conflict >= 1.0 - p[P_FALSE_ALARM] or band_probability(d, turned_miss, turned_sigma) >= p[P_MISSED])


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    p = np.ones(P_END)
    spread(1.0, p)
    needed_separation(1.0, 9.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, p)
    guaranteed_shortfall(9.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, p)
    begins_by_test(1.0, 0.0, 1.0, 2.0, 1.0, p)
