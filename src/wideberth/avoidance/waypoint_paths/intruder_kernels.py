"""Where an intruder is predicted to be, and how a piece of the ownship's path meets its collision cylinder."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.conflict.cylinder_kernels import cylinder_stay

Floats = NDArray[np.float64]

# One prediction: position and velocity now (local NED), the cylinder about it, and the turn that it makes.
NORTH, EAST, DOWN, V_NORTH, V_EAST, V_DOWN, RADIUS, HALF_HEIGHT, TURN_RATE, TURN_TIME = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
N_INTRUDER = 10

TURN_STEP = 0.5  # s: in so short pieces a turning intruder flies straight
_ROUNDING = 1e-6  # m


@jit_uncounted
def state_at(row: Floats, t: float) -> tuple[float, float, float, float, float, float]:
    """Return position and velocity of an intruder after `t` seconds: along its turn while that lasts, then straight."""
    rate = row[TURN_RATE]
    vn, ve, vd = row[V_NORTH], row[V_EAST], row[V_DOWN]
    down = row[DOWN] + vd * t
    if rate == 0.0:
        return row[NORTH] + vn * t, row[EAST] + ve * t, down, vn, ve, vd
    turning = min(max(t, 0.0), row[TURN_TIME])
    c, s = math.cos(rate * turning), math.sin(rate * turning)
    north = row[NORTH] + (s * vn - (1.0 - c) * ve) / rate
    east = row[EAST] + ((1.0 - c) * vn + s * ve) / rate
    rest = t - turning
    vn, ve = c * vn - s * ve, s * vn + c * ve
    return north + vn * rest, east + ve * rest, down, vn, ve, vd


@jit_uncounted
def place_at(row: Floats, t: float) -> tuple[float, float, float]:
    """Return where an intruder is after `t` seconds."""
    pn, pe, pd, _vn, _ve, _vd = state_at(row, t)
    return pn, pe, pd


@jit_uncounted
def stay_hull(
    a: Floats, un: float, ue: float, ud: float, t: float, until: float, step: float, row: Floats,
    radius: float, half_height: float,
) -> tuple[float, float]:  # fmt: skip
    """Return first and last time (s, up to `until`) at which an intruder can be in a cylinder; NaN for none.

    The cylinder is about the ownship, which begins at `a` at time `t`. A turning intruder, or one that flies chords of
    its turn that last up to `step`, is never farther from the chord of the whole than a T^2 / 8 for each of the two
    times, with its acceleration a: of the one chord the cylinder so much larger is taken.
    """
    pn, pe, pd = place_at(row, t)
    qn, qe, qd = place_at(row, t + until)
    acceleration = abs(row[TURN_RATE]) * math.hypot(row[V_NORTH], row[V_EAST])
    slack = 0.125 * acceleration * (until * until + step * step) + _ROUNDING
    t_in, t_out = cylinder_stay(
        pn - a[0], pe - a[1], pd - a[2], (qn - pn) / until - un, (qe - pe) / until - ue, (qd - pd) / until - ud,
        radius + slack, half_height + _ROUNDING,
    )  # fmt: skip
    return (t_in, min(t_out, until)) if t_in <= until else (math.nan, math.nan)


@jit_uncounted
def inside_piece(a: Floats, b: Floats, t: float, duration: float, row: Floats, scale: float) -> tuple[float, float]:
    """Return when a straight piece of path enters a cylinder (s after its start, inf if never), and for how long.

    Parameters
    ----------
    a, b : ndarray, shape (>= 3,)
        Ends of the piece, local NED.
    t, duration : float
        When it begins, and how long it takes, s.
    row : ndarray, shape (N_INTRUDER,)
    scale : float
        Factor on the cylinder.
    """
    first, total = math.inf, 0.0
    if duration <= 0.0:
        return first, total
    radius, half_height = scale * row[RADIUS], scale * row[HALF_HEIGHT]
    un, ue, ud = (b[0] - a[0]) / duration, (b[1] - a[1]) / duration, (b[2] - a[2]) / duration
    since = 0.0
    if row[TURN_RATE] != 0.0 and t < row[TURN_TIME]:
        # Chords as long as the turn lasts; only those on which it can be inside are looked at.
        n = math.ceil(duration / TURN_STEP)
        step = duration / n
        chords = min(n, math.ceil((row[TURN_TIME] - t) / step))
        since = duration if chords == n else chords * step
        t_in, t_out = stay_hull(a, un, ue, ud, t, since, step, row, radius, half_height)
        if t_in <= t_out:
            for k in range(int(t_in / step), min(chords, int(t_out / step) + 1)):
                entry, stay = inside_straight(a, un, ue, ud, t, k * step, step, row, radius, half_height, True)
                first, total = min(first, entry), total + stay
    if since < duration:
        entry, stay = inside_straight(a, un, ue, ud, t, since, duration - since, row, radius, half_height, False)
        first, total = min(first, entry), total + stay
    return first, total


@jit_uncounted
def inside_straight(
    a: Floats, un: float, ue: float, ud: float, t: float, since: float, step: float, row: Floats,
    radius: float, half_height: float, chord: bool,
) -> tuple[float, float]:  # fmt: skip
    """Return when (s after `t`, inf if never) and for how long it is inside from `since` on for `step` seconds.

    The intruder flies straight, where it turns the chord.
    """
    pn, pe, pd, vn, ve, vd = state_at(row, t + since)
    if chord:
        qn, qe, qd = place_at(row, t + since + step)
        vn, ve, vd = (qn - pn) / step, (qe - pe) / step, (qd - pd) / step
    t_in, t_out = cylinder_stay(
        pn - a[0] - un * since, pe - a[1] - ue * since, pd - a[2] - ud * since, vn - un, ve - ue, vd - ud,
        radius, half_height,
    )  # fmt: skip
    t_out = min(t_out, step)
    return (since + t_in, t_out - t_in) if t_in < t_out else (math.inf, 0.0)


@jit_uncounted
def path_inside(
    points: Floats, times: Floats, n: int, intruders: Floats, count: int, scale: float, culprit: Floats
) -> tuple[float, float]:
    """Return when a path first enters a cylinder (s, inf if never), and the time inside all of them together.

    Parameters
    ----------
    points, times : ndarray, shape (>= n, 3), (>= n,)
        The path: local NED, and seconds from now.
    n : int
    intruders : ndarray, shape (>= count, N_INTRUDER)
    count : int
    scale : float
        Factor on the cylinders.
    culprit : ndarray, shape (>= count,)
        Overwritten with when the path enters each cylinder, inf if never.
    """
    first, total = math.inf, 0.0
    for m in range(count):
        culprit[m] = math.inf
        for i in range(n - 1):
            entry, inside = inside_piece(
                points[i], points[i + 1], times[i], times[i + 1] - times[i], intruders[m], scale
            )
            if entry < math.inf:
                culprit[m] = min(culprit[m], times[i] + entry)
            total += inside
        first = min(first, culprit[m])
    return first, total


def warmup() -> None:
    """Compile what Python calls of this module."""
    path_inside(np.zeros((2, 3)), np.arange(2.0), 2, np.ones((1, N_INTRUDER)), 1, 1.0, np.zeros(1))
