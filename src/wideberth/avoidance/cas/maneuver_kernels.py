"""Compiled choice among turns, changes of speed, climbs and combinations (CAS thesis, 4.2.1, 4.2.3).

Candidate velocities are tried against all vehicles at once; the one that deviates least from what guidance wants is
flown. Units, signs and views as in `pair_kernels` and `multi_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair

FloatArray = NDArray[np.float64]

# What may be changed: bits of `P_KINDS`.
RIGHT, LEFT, SPEED, VERTICAL, COMBINED = 1, 2, 4, 8, 16

_TURN_STEP, _TURN_STEPS = math.radians(5.0), 24
_SPEED_STEPS = 20
_COMBINED_TURNS, _COMBINED_SPEEDS, _COMBINED_RATES = 4, 4, 6  # on each side; in all; in all
_COMBINED_TURN = math.radians(15.0)
_SHORTFALL_COST = 1000.0  # m/s of deviation for each metre of missing separation
_CHANGE_COST = 0.15  # of a change of the command, so that a choice is kept
_DECISIVE = 0.25  # of the separation: a miss distance that decides on which side two pass
_ROUND = 0.75  # the same in the roundabout: who passes clear anyway is not gone round
_ABOVE = 0.95  # of the separation: at such a difference of height the side does not matter
_CLIMB_STEPS = 5  # up to twice the change that is tangent without lag
_ON_THE_LINE = 1e-6  # m, on the other side: nothing but rounding
_INSIDE = 0.98  # of the distance now
_RELEASE = 2.0  # of the separation, that guidance's velocity must keep before an avoidance ends


@jit_uncounted
def passing_side(pn: float, pe: float, vn: float, ve: float, p: FloatArray) -> float:
    """Return on which side two vehicles pass: 1, or -1 where each keeps the other on its left.

    Position and velocity are relative ones, and both vehicles find the same: the side on which they would pass anyway
    where that is clear, else the other on the left. The roundabout keeps the other on the left up to a larger miss
    distance. To go round all of them, however far they pass, leads out of the crowd into the next conflict.
    """
    speed = math.hypot(vn, ve)
    across = pn * ve - pe * vn
    decisive = _ROUND if int(p[pair.P_KINDS]) == RIGHT else _DECISIVE
    if not abs(across) > decisive * p[pair.P_SEPARATION] * speed:
        return -1.0
    return 1.0 if across > 0.0 else -1.0


@jit_uncounted
def shortfall(
    cn: float,
    ce: float,
    cd: float,
    own: FloatArray,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    widening: float,
    sided: bool,
) -> tuple[float, int]:
    """Return the largest missing separation of a commanded velocity, m, and to whom; 0 and -1 where all is kept.

    The lag moves the path by (velocity - command) * time constant; that is all it does to the closest point later on.
    With `sided` a horizontal distance on the other side than `passing_side` counts as missing. The separations wanted
    are in the views (`multi_kernels.note_separations`).
    """
    worst, whom = 0.0, -1
    level, vertical = p[pair.P_LEVEL_LAG], p[pair.P_LAG]
    for j in range(views.shape[0]):
        if use[j] == 0.0:
            continue
        pn, pe, pd = own[0] - views[j, 0], own[1] - views[j, 1], own[2] - views[j, 2]
        now = pn * pn + pe * pe + pd * pd
        side = passing_side(pn, pe, own[3] - views[j, 3], own[4] - views[j, 4], p)
        pn += (own[3] - cn) * level
        pe += (own[4] - ce) * level
        pd += (own[5] - cd) * vertical
        vn, ve, vd = cn - views[j, 3], ce - views[j, 4], cd - views[j, 5]
        t, d = pair.closest_point(pn, pe, pd, vn, ve, vd)
        if not t < p[pair.P_T_STAR_MIN]:
            continue
        wanted = (views[j, multi.V_SEPARATION] + p[pair.P_MARGIN_GROWTH] * views[j, multi.V_AGE]) * widening
        # Nearer than that already: then not nearer still.
        wanted = min(wanted, _INSIDE * math.sqrt(now))
        across = pn * ve - pe * vn
        if sided and t > 0.0 and across * side < 0.0 and abs(pd + vd * t) < _ABOVE * wanted:
            beyond = abs(across) / math.hypot(vn, ve)
            d = -beyond if beyond > _ON_THE_LINE else d
        if wanted - d > worst:
            worst, whom = wanted - d, j
    return worst, whom


@jit_uncounted
def try_velocity(
    cn: float,
    ce: float,
    cd: float,
    own: FloatArray,
    preferred: FloatArray,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    held: FloatArray,
    best: FloatArray,
) -> None:
    """Put a candidate and its cost into `best` (4) where it is cheaper; `held` (3) is the command before."""
    deviation = math.sqrt((cn - preferred[0]) ** 2 + (ce - preferred[1]) ** 2 + (cd - preferred[2]) ** 2)
    change = math.sqrt((cn - held[0]) ** 2 + (ce - held[1]) ** 2 + (cd - held[2]) ** 2)
    cost = deviation + _CHANGE_COST * change
    if cost >= best[3]:
        return
    missing, _ = shortfall(cn, ce, cd, own, views, use, p, 1.0, True)
    cost += _SHORTFALL_COST * missing
    if cost < best[3]:
        best[0], best[1], best[2], best[3] = cn, ce, cd, cost


@jit_uncounted
def preferred_velocity(own: FloatArray, start: FloatArray, wanted: float, p: FloatArray, preferred: FloatArray) -> None:
    """Write the velocity (3) that guidance wants: along the straight track, back to it, and back to its altitude.

    `start` (6) is a state on the track. Time lost is not made up for.
    """
    vn, ve = start[3], start[4]
    speed = math.hypot(vn, ve)
    preferred[2] = pair.guidance_rate(own[2], wanted, p)
    if speed < 1e-6:
        preferred[0], preferred[1] = p[pair.P_GAIN] * (start[0] - own[0]), p[pair.P_GAIN] * (start[1] - own[1])
        pace = math.hypot(preferred[0], preferred[1])
        if pace > p[pair.P_SPEED_MAX]:
            preferred[0] *= p[pair.P_SPEED_MAX] / pace
            preferred[1] *= p[pair.P_SPEED_MAX] / pace
        return
    north, east = vn / speed, ve / speed
    right = (own[1] - start[1]) * north - (own[0] - start[0]) * east
    turn = -math.atan(p[pair.P_GAIN] * right / speed)
    turn = pair.limited(turn, -0.25 * math.pi, 0.25 * math.pi)
    preferred[0] = speed * (north * math.cos(turn) - east * math.sin(turn))
    preferred[1] = speed * (east * math.cos(turn) + north * math.sin(turn))


@jit_uncounted
def choose_velocity(
    own: FloatArray,
    number: int,
    wanted: float,
    avoiding: bool,
    preferred: FloatArray,
    held: FloatArray,
    views: FloatArray,
    use: FloatArray,
    p: FloatArray,
    bounds: FloatArray,
    best: FloatArray,
) -> tuple[int, int]:
    """Write the velocity to fly into `best` (4), and return reason and the vehicle avoided first.

    Parameters
    ----------
    own : ndarray, shape (6,)
    number : int
        The own row of `views`.
    wanted : float
        Position down of guidance.
    avoiding : bool
    preferred, held : ndarray, shape (3,)
        Velocity of guidance, and the command before.
    views, use : ndarray, shape (n, N_VIEW) and (n,)
    p : ndarray, shape (N_SETTINGS,)
    bounds : ndarray, shape (n, 3)
        Scratch.
    best : ndarray, shape (4,)
        The velocity, and its cost.
    """
    best[0], best[1], best[2], best[3] = preferred[0], preferred[1], preferred[2], math.inf
    multi.note_separations(own, views, use, p)
    missing, whom = shortfall(
        preferred[0], preferred[1], preferred[2], own, views, use, p, _RELEASE if avoiding else 1.0, False
    )
    if whom < 0:
        return pair.NO_REASON, -1
    kinds = int(p[pair.P_KINDS])
    low = own[2] > p[pair.P_LOWEST]
    speed = math.hypot(preferred[0], preferred[1])
    try_velocity(preferred[0], preferred[1], preferred[2], own, preferred, views, use, p, held, best)
    for k in range(1, _TURN_STEPS + 1):
        s, c = math.sin(k * _TURN_STEP), math.cos(k * _TURN_STEP)
        if kinds & RIGHT:
            cn, ce = preferred[0] * c - preferred[1] * s, preferred[1] * c + preferred[0] * s
            try_velocity(cn, ce, preferred[2], own, preferred, views, use, p, held, best)
        if kinds & LEFT:
            cn, ce = preferred[0] * c + preferred[1] * s, preferred[1] * c - preferred[0] * s
            try_velocity(cn, ce, preferred[2], own, preferred, views, use, p, held, best)
    if kinds & SPEED and speed > 1e-6:
        for k in range(_SPEED_STEPS + 1):
            ratio = p[pair.P_SPEED_MAX] * k / (_SPEED_STEPS * speed)
            cn, ce = preferred[0] * ratio, preferred[1] * ratio
            try_velocity(cn, ce, preferred[2], own, preferred, views, use, p, held, best)
    if kinds & VERTICAL:
        _, rate, _ = multi.interval_rate(own, number, wanted, preferred[2], avoiding, views, use, p, bounds)
        top = 0.0 if low else p[pair.P_DOWN]
        for k in range(_CLIMB_STEPS + 1):
            cd = preferred[2] + (rate - preferred[2]) * (1.0 + k / _CLIMB_STEPS)
            cd = pair.limited(cd, p[pair.P_UP], top)
            try_velocity(preferred[0], preferred[1], cd, own, preferred, views, use, p, held, best)
    if kinds & COMBINED and speed > 1e-6:
        top = 0.0 if low else p[pair.P_DOWN]
        for a in range(-_COMBINED_TURNS, _COMBINED_TURNS + 1):
            s, c = math.sin(a * _COMBINED_TURN), math.cos(a * _COMBINED_TURN)
            north, east = preferred[0] * c - preferred[1] * s, preferred[1] * c + preferred[0] * s
            for b in range(_COMBINED_SPEEDS + 1):
                ratio = p[pair.P_SPEED_MAX] * b / (_COMBINED_SPEEDS * speed)
                for k in range(_COMBINED_RATES + 1):
                    rate = p[pair.P_UP] + (top - p[pair.P_UP]) * k / _COMBINED_RATES
                    try_velocity(north * ratio, east * ratio, rate, own, preferred, views, use, p, held, best)
    return (pair.HELD if missing == 0.0 else pair.CURRENT), whom


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    own, views, use, p = np.ones(6), np.zeros((2, multi.N_VIEW)), np.ones(2), np.ones(pair.N_SETTINGS)
    preferred, best = np.ones(3), np.ones(4)
    preferred_velocity(own, own, 1.0, p, preferred)
    choose_velocity(own, 0, 1.0, False, preferred, preferred, views, use, p, np.empty((2, 3)), best)
    shortfall(1.0, 0.0, 0.0, own, views, use, p, 1.0, True)
