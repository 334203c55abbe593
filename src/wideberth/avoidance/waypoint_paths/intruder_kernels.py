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


@jit_uncounted
def place_at(row: Floats, t: float) -> tuple[float, float, float]:
    """Return where an intruder is after `t` seconds: along its turn while that lasts, then straight."""
    rate = row[TURN_RATE]
    down = row[DOWN] + row[V_DOWN] * t
    if rate == 0.0:
        return row[NORTH] + row[V_NORTH] * t, row[EAST] + row[V_EAST] * t, down
    turning = min(max(t, 0.0), row[TURN_TIME])
    c, s = math.cos(rate * turning), math.sin(rate * turning)
    vn, ve = row[V_NORTH], row[V_EAST]
    north = row[NORTH] + (s * vn - (1.0 - c) * ve) / rate
    east = row[EAST] + ((1.0 - c) * vn + s * ve) / rate
    rest = t - turning
    return north + (c * vn - s * ve) * rest, east + (s * vn + c * ve) * rest, down


@jit_uncounted
def velocity_at(row: Floats, t: float) -> tuple[float, float, float]:
    """Return the velocity of an intruder after `t` seconds, m/s."""
    angle = row[TURN_RATE] * min(max(t, 0.0), row[TURN_TIME])
    c, s = math.cos(angle), math.sin(angle)
    return c * row[V_NORTH] - s * row[V_EAST], s * row[V_NORTH] + c * row[V_EAST], row[V_DOWN]


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
    straight = row[TURN_RATE] == 0.0
    n = 1 if straight else math.ceil(duration / TURN_STEP)
    step = duration / n
    un, ue, ud = (b[0] - a[0]) / duration, (b[1] - a[1]) / duration, (b[2] - a[2]) / duration
    for k in range(n):
        since = k * step
        pn, pe, pd = place_at(row, t + since)
        if straight:
            vn, ve, vd = row[V_NORTH], row[V_EAST], row[V_DOWN]
        else:
            qn, qe, qd = place_at(row, t + since + step)
            vn, ve, vd = (qn - pn) / step, (qe - pe) / step, (qd - pd) / step
        t_in, t_out = cylinder_stay(
            pn - a[0] - un * since, pe - a[1] - ue * since, pd - a[2] - ud * since, vn - un, ve - ue, vd - ud,
            scale * row[RADIUS], scale * row[HALF_HEIGHT],
        )  # fmt: skip
        t_out = min(t_out, step)
        if t_in < t_out:
            first = min(first, since + t_in)
            total += t_out - t_in
    return first, total


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
