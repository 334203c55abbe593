"""What a piece of the ownship's path costs among the predicted intruders."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted

Floats = NDArray[np.float64]

# Risk parameters: one flat array, so that the same kernels serve the full and the fast tier.
HARD_RADIUS, HARD_HEIGHT = 0, 1  # collision volume of the planner, m (half-height)
INNER_RADIUS, INNER_HEIGHT = 2, 3  # inner volume, m
OUTER_RADIUS, OUTER_HEIGHT, OUTER_TAU = 4, 5, 6  # well-clear volume, m, m, s
SIGMAS = 7  # how many standard deviations of the intruder's position widen each volume
SIGMA_CAP = 8  # largest widening, as a fraction of the volume
GROWTH_H, GROWTH_V = 9, 10  # widening for unknown intentions, m/s and m/s of look-ahead
GROWTH_TIME = 11  # s after which that widening stops
WEIGHT_HARD, WEIGHT_INNER, WEIGHT_OUTER, WEIGHT_NEAR = 12, 13, 14, 15  # cost per second
FLOOR, CEILING = 16, 17  # m of altitude
TURN_SIGNIFICANCE = 18  # sigmas of lateral acceleration that make a turn believed
TURN_RATE_MIN, TURN_RATE_MAX = 19, 20  # rad/s
TURN_TIME = 21  # s that a turn is continued
TURN_WEIGHT = 22  # belief in the continued turn, the rest in straight flight
BEYOND = 23  # s of straight flight after a path's end that count too
N_RISK = 24

MARGIN_MAX = 1.5  # largest margin that paths are judged with
N_PREDICTION = 9  # position, velocity, two standard deviations, relevance

# What an evaluated path met: first time (s ahead, inf if never) and how long (s) in each volume.
FIRST_HARD, FIRST_INNER, FIRST_OUTER, TIME_HARD, TIME_INNER, TIME_OUTER, COST, CULPRIT = 0, 1, 2, 3, 4, 5, 6, 7
N_MET = 8

IN_OUTER, IN_INNER, IN_HARD = 1, 2, 4  # volumes of an intruder that a place is inside of
NEAR_MIN = 0.1  # least distance, in outer volumes, that the cost of being near is counted for


@jit_uncounted
def widened(size: float, sigma: float, growth: float, risk: Floats, t: float) -> float:
    """Return a dimension of a volume widened for uncertainty and unknown intentions."""
    return float(size + min(risk[SIGMAS] * sigma, risk[SIGMA_CAP] * size) + growth * min(t, risk[GROWTH_TIME]))


@jit_uncounted
def volume_risk(
    range2: float,
    height: float,
    closing: float,
    r_outer: float,
    z_outer: float,
    sigma_h: float,
    sigma_v: float,
    t: float,
    margin: float,
    risk: Floats,
) -> tuple[float, int]:
    """Return the cost of a second at a place for the volumes of one intruder, and which of them that is inside of.

    Parameters
    ----------
    range2, height : float
        Horizontal distance squared (m^2) and height apart (m).
    closing : float
        Horizontal separation times its rate, m^2/s: negative where it shrinks.
    r_outer, z_outer : float
        The outer volume, widened.
    sigma_h, sigma_v : float
        Standard deviations of the intruder's position, m.
    t, margin, risk
        As for `risk_at`.

    Returns
    -------
    cost : float
    volumes : int
        `IN_OUTER`, `IN_INNER` and `IN_HARD` added up.
    """
    depth = -1.0
    if height <= z_outer:
        if range2 <= r_outer * r_outer:
            depth = 1.0 + 1.0 - math.sqrt(range2) / r_outer
        elif closing < 0.0 and risk[OUTER_TAU] > 0.0:
            tau = (r_outer * r_outer - range2) / closing
            if tau <= margin * risk[OUTER_TAU]:
                depth = 1.0 - tau / (margin * risk[OUTER_TAU])
    cost, volumes = 0.0, 0
    if depth < 0.0:
        # The printed search has no outer volume about the hard one.
        if risk[HARD_RADIUS] <= risk[OUTER_RADIUS] and risk[HARD_HEIGHT] <= risk[OUTER_HEIGHT]:
            return cost, volumes
    else:
        volumes = IN_OUTER
        share = 0.2 + 0.8 * (1.0 - height / z_outer)
        cost += risk[WEIGHT_OUTER] * share * (0.3 + depth)
        r_inner = widened(margin * risk[INNER_RADIUS], sigma_h, risk[GROWTH_H], risk, t)
        z_inner = widened(margin * risk[INNER_HEIGHT], sigma_v, risk[GROWTH_V], risk, t)
        if range2 <= r_inner * r_inner and height <= z_inner:
            volumes += IN_INNER
            share = 0.3 + min(1.0 - math.sqrt(range2) / r_inner, 1.0 - height / z_inner)
            cost += risk[WEIGHT_INNER] * share
    r_hard = widened(risk[HARD_RADIUS], sigma_h, 0.0, risk, t)
    z_hard = widened(risk[HARD_HEIGHT], sigma_v, 0.0, risk, t)
    if range2 <= r_hard * r_hard and height <= z_hard:
        volumes += IN_HARD
        share = 0.3 + min(1.0 - math.sqrt(range2) / r_hard, 1.0 - height / z_hard)
        cost += risk[WEIGHT_HARD] * share
    return cost, volumes


@jit_uncounted
def altitude_risk(altitude: float, risk: Floats) -> float:
    """Return the cost of a second at an altitude (m) beyond the floor or the ceiling."""
    cost = 0.0
    if altitude < risk[FLOOR]:
        cost += risk[WEIGHT_HARD] * (1.0 + 0.1 * (risk[FLOOR] - altitude))
    if altitude > risk[CEILING]:
        cost += risk[WEIGHT_INNER] * (1.0 + 0.1 * (altitude - risk[CEILING]))
    return cost


@jit_uncounted
def risk_at(
    pn: float,
    pe: float,
    pd: float,
    vn: float,
    ve: float,
    vd: float,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    k: int,
    t: float,
    dt: float,
    margin: float,
    risk: Floats,
    met: Floats,
) -> float:
    """Return the cost of being at one place at one time, and note in `met` which volumes that is inside of.

    Parameters
    ----------
    pn, pe, pd, vn, ve, vd : float
        Position and velocity of the ownship, local NED.
    intruders, weight, n_intruders
        As filled by `prediction_kernels.predict_intruders`.
    k : int
        Index of the time on the grid.
    t, dt : float
        Look-ahead time and the time this sample stands for, s.
    margin : float
        Factor on the inner and outer volumes (above 1 for the decision to return).
    risk : ndarray
    met : ndarray, shape (N_MET,)
        First times and durations are updated.

    Returns
    -------
    float
        Cost of this sample.
    """
    cost = 0.0
    hard = inner = outer = False
    for m in range(n_intruders):
        row = intruders[m, k]
        if row[8] == 0.0:
            continue
        sn, se, sd = row[0] - pn, row[1] - pe, row[2] - pd
        range2, height = sn * sn + se * se, abs(sd)
        z_outer = widened(margin * risk[OUTER_HEIGHT], row[7], risk[GROWTH_V], risk, t)
        r_outer = widened(margin * risk[OUTER_RADIUS], row[6], risk[GROWTH_H], risk, t)
        scaled = math.sqrt(range2 / (r_outer * r_outer) + sd * sd / (z_outer * z_outer))
        cost += weight[m] * risk[WEIGHT_NEAR] * dt / max(scaled, NEAR_MIN)
        closing = sn * (row[3] - vn) + se * (row[4] - ve)
        rate, volumes = volume_risk(range2, height, closing, r_outer, z_outer, row[6], row[7], t, margin, risk)
        if volumes == 0:
            continue
        cost += weight[m] * dt * rate
        if volumes & IN_OUTER and not outer and met[FIRST_OUTER] == math.inf:
            met[CULPRIT] = m
        outer = outer or volumes & IN_OUTER > 0
        inner = inner or volumes & IN_INNER > 0
        hard = hard or volumes & IN_HARD > 0
    cost += dt * altitude_risk(-pd, risk)
    if hard:
        met[FIRST_HARD] = min(met[FIRST_HARD], t)
        met[TIME_HARD] += dt
    if inner:
        met[FIRST_INNER] = min(met[FIRST_INNER], t)
        met[TIME_INNER] += dt
    if outer:
        met[FIRST_OUTER] = min(met[FIRST_OUTER], t)
        met[TIME_OUTER] += dt
    met[COST] += cost
    return cost


@jit_uncounted
def clear_met(met: Floats) -> None:
    """Reset what a path met."""
    met[FIRST_HARD] = met[FIRST_INNER] = met[FIRST_OUTER] = math.inf
    met[TIME_HARD] = met[TIME_INNER] = met[TIME_OUTER] = met[COST] = 0.0
    met[CULPRIT] = -1.0


@jit_uncounted
def evaluate_path(
    states: Floats,
    stride: int,
    n: int,
    dt: float,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    margin: float,
    risk: Floats,
    met: Floats,
) -> None:
    """Evaluate a flown path on the grid of `prediction_kernels.predict_intruders`.

    Parameters
    ----------
    states : ndarray, shape (stride (n - 1) + 1, 7)
        Point-mass states (see the vehicle's kernels); every `stride`-th stands at a grid time.
    stride, n : int
    dt : float
        Step of the grid, s.
    met : ndarray, shape (N_MET,)
        Overwritten.
    """
    clear_met(met)
    for k in range(n):
        x = states[k * stride]
        a = states[min(k, n - 2) * stride]
        b = states[min(k + 1, n - 1) * stride]
        vn, ve = (b[0] - a[0]) / dt, (b[1] - a[1]) / dt
        risk_at(x[0], x[1], x[2], vn, ve, -x[6], intruders, weight, n_intruders, k, k * dt, dt, margin, risk, met)


@jit
def first_losses(
    states: Floats,
    stride: int,
    n: int,
    dt: float,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    risk: Floats,
    first: Floats,
) -> None:
    """Write into `first` (n_intruders,) when a flown path meets the outer volume of each prediction, inf if never.

    The other parameters are those of `evaluate_path`.
    """
    met = np.empty(N_MET)
    for m in range(n_intruders):
        one = slice(m, m + 1)
        evaluate_path(states, stride, n, dt, intruders[one], weight[one], 1, 1.0, risk, met)
        first[m] = met[FIRST_OUTER]


@jit_uncounted
def terminal_cost(
    pn: float, pe: float, pd: float, goal: Floats, speed: float, climb_rate: float, weights: Floats
) -> float:
    """Return the cost of ending a path away from where the mission wants to be.

    Parameters
    ----------
    pn, pe, pd : float
        End of the path.
    goal : ndarray, shape (3,)
        Point of the mission to return to.
    speed, climb_rate : float
        m/s, turn distances into seconds.
    weights : ndarray, shape (2,)
        Cost per second of way to the goal, horizontally and vertically.
    """
    distance = math.hypot(goal[0] - pn, goal[1] - pe)
    return float(weights[0] * distance / speed + weights[1] * abs(goal[2] - pd) / climb_rate)


@jit_uncounted
def cost_beyond(
    pn: float,
    pe: float,
    pd: float,
    vn: float,
    ve: float,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    k: int,
    t: float,
    risk: Floats,
) -> float:
    """Return the cost of the seconds in hard volumes when all fly straight on, level, from the end of a path.

    Without it a path that flees before an intruder looks as clear as one that lets it pass.

    Parameters
    ----------
    pn, pe, pd, vn, ve : float
        Position and velocity of the ownship at the end, local NED.
    k, t : int, float
        The end's place on the grid, and its look-ahead time, s.
    intruders, weight, n_intruders, risk
        As for `risk_at`; seconds more than ``risk[BEYOND]`` after the end cost nothing.
    """
    cost = 0.0
    if risk[BEYOND] <= 0.0:
        return cost
    for m in range(n_intruders):
        row = intruders[m, k]
        if row[8] == 0.0:
            continue
        height = abs(row[2] - pd)
        z_hard = widened(risk[HARD_HEIGHT], row[7], 0.0, risk, t)
        if height >= z_hard:
            continue
        sn, se = row[0] - pn, row[1] - pe
        rn, re = row[3] - vn, row[4] - ve
        closing = sn * rn + se * re
        speed2 = rn * rn + re * re
        if closing >= 0.0 or speed2 == 0.0:
            continue
        r_hard = widened(risk[HARD_RADIUS], row[6], 0.0, risk, t)
        t_cpa = -closing / speed2
        miss2 = max(0.0, sn * sn + se * se - t_cpa * t_cpa * speed2)
        if miss2 >= r_hard * r_hard:
            continue
        half = math.sqrt((r_hard * r_hard - miss2) / speed2)
        inside = min(t_cpa + half, risk[BEYOND]) - max(t_cpa - half, 0.0)
        if inside > 0.0:
            share = 0.3 + min(1.0 - math.sqrt(miss2) / r_hard, 1.0 - height / z_hard)
            cost += weight[m] * risk[WEIGHT_HARD] * inside * share
    return cost


@jit_uncounted
def wrap(angle: float) -> float:
    """Return the angle in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@jit_uncounted
def point_along(waypoints: Floats, index: int, pn: float, pe: float, ahead: float, out: Floats) -> None:
    """Find the point of a path a given distance ahead of the foot of a position on the leg to waypoint `index`.

    Parameters
    ----------
    waypoints : ndarray, shape (n, 3)
    index : int
        The waypoint that is flown to.
    pn, pe : float
    ahead : float
        Distance along the path, m; beyond the last waypoint the last leg is extended.
    out : ndarray, shape (3,)
        Overwritten with the point.
    """
    n = waypoints.shape[0]
    i = min(max(index, 1), n - 1)
    a, b = waypoints[i - 1], waypoints[i]
    dn, de = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dn * dn + de * de)
    s = ahead
    if length > 0.0:
        s += max(0.0, min(length, ((pn - a[0]) * dn + (pe - a[1]) * de) / length))
    while s > length and i < n - 1:
        s -= length
        i += 1
        a, b = waypoints[i - 1], waypoints[i]
        length = math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
    if length > 0.0:
        f = s / length
        out[0] = a[0] + f * (b[0] - a[0])
        out[1] = a[1] + f * (b[1] - a[1])
        out[2] = a[2] + min(f, 1.0) * (b[2] - a[2])
    else:
        for j in range(3):
            out[j] = b[j]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    risk = np.ones(N_RISK)
    out, weight = np.zeros((2, 4, N_PREDICTION)), np.zeros(2)
    m = 2
    met, point = np.zeros(N_MET), np.zeros(3)
    evaluate_path(np.ones((4, 7)), 1, 4, 1.0, out, weight, m, 1.0, risk, met)
    first_losses(np.ones((4, 7)), 1, 4, 1.0, out, weight, m, risk, np.zeros(2))
    terminal_cost(0.0, 0.0, 0.0, point, 1.0, 1.0, np.ones(2))
    cost_beyond(0.0, 0.0, 0.0, 1.0, 0.0, out, weight, m, 1, 1.0, risk)
    point_along(np.ones((2, 3)), 1, 0.0, 0.0, 1.0, point)
    wrap(1.0)
