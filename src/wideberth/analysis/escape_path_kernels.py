"""Compiled escapes: the path of an ownship that waits and then turns, or changes its velocity; and its climb.

A path is a table of rows t, x, y, vx, vy, between which it is a cubic (Hermite) and after which it is straight. It
starts at detection, in the origin; x is along the first course, y to its right. SI, rad.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.analysis.turn_kernels import (
    BANK,
    COMMAND,
    LENGTH,
    N_PHASES,
    NO_LAG,
    RATE,
    advance,
    next_panel,
    turn_phases,
)

FloatArray = NDArray[np.float64]

MAX_ROWS = 192
T, X, Y, VX, VY = 0, 1, 2, 3, 4
N_COLUMNS = 5

_COURSE_STEP = 0.03  # rad between rows: to 1e-6 of the range
_ROWS_PER_PHASE = 12
_TAIL = 15.0  # time constants until a lagged change counts as done


@jit
def write_row(path: FloatArray, n: int, t: float, x: float, y: float, vx: float, vy: float) -> int:
    """Write row `n` and return the number of rows."""
    path[n, T], path[n, X], path[n, Y], path[n, VX], path[n, VY] = t, x, y, vx, vy
    return n + 1


@jit
def turn_path(
    v: float, wait: float, turn: float, bank_max: float, rate: float, tau: float, side: float, path: FloatArray
) -> int:
    """Write the path of waiting and turning to the right (`side` 1) or left (-1); return its number of rows."""
    phases = np.empty((N_PHASES, 4))
    peak, _ = turn_phases(v, turn, bank_max, rate, tau, phases)
    n = write_row(path, 0, 0.0, 0.0, 0.0, v, 0.0)
    n = write_row(path, n, wait, v * wait, 0.0, v, 0.0)
    t, course, x, y = wait, 0.0, v * wait, 0.0
    t_row, course_row = t, course
    for k in range(N_PHASES):
        s, length = 0.0, phases[k, LENGTH]
        while s < length:
            h = next_panel(phases, k, s, peak, rate, tau, _COURSE_STEP, v)
            if k != 2:
                h = min(h, length / _ROWS_PER_PHASE)
            dchi, dx, dy = advance(v, course, s, h, phases[k, BANK], phases[k, RATE], phases[k, COMMAND], tau)
            t, course, x, y = t + h, course + dchi, x + dx, y + dy
            done = s + h >= length * (1.0 - 1e-12)
            s = length if done else s + h
            # Panels can be finer than the path needs; there are at most about 140 rows.
            far = course - course_row >= _COURSE_STEP or t - t_row >= 0.99 * length / _ROWS_PER_PHASE
            if done or (far and n < MAX_ROWS - N_PHASES):
                n = write_row(path, n, t, x, side * y, v * math.cos(course), side * v * math.sin(course))
                t_row, course_row = t, course
    return write_row(path, n, t, x, side * y, v * math.cos(turn), side * v * math.sin(turn))


@jit
def velocity_change(t: float, change: float, acceleration: float, tau: float) -> tuple[float, float]:
    """Return how much of a change of velocity (not negative) is done `t` after its command, and the distance it adds.

    The acceleration is (change - done) / tau, limited to `acceleration`: first constant, then dying away.
    """
    if t <= 0.0:
        return 0.0, 0.0
    lagging = min(acceleration * tau, change) if tau > NO_LAG else 0.0
    ramp = (change - lagging) / acceleration
    if t < ramp:
        return acceleration * t, 0.5 * acceleration * t * t
    s = t - ramp
    added = 0.5 * (change - lagging) * ramp + change * s
    if lagging == 0.0:
        return change, added
    left = math.exp(-s / tau)
    return change - lagging * left, added - lagging * tau * (1.0 - left)


@jit
def velocity_change_path(
    v: float, wait: float, vx: float, vy: float, acceleration: float, tau: float, path: FloatArray
) -> int:
    """Write the path of waiting and changing the velocity to (vx, vy); return its number of rows."""
    change = math.hypot(vx - v, vy)
    n = write_row(path, 0, 0.0, 0.0, 0.0, v, 0.0)
    n = write_row(path, n, wait, v * wait, 0.0, v, 0.0)
    if change == 0.0:
        return n
    ex, ey = (vx - v) / change, vy / change
    ramp = (change - (min(acceleration * tau, change) if tau > NO_LAG else 0.0)) / acceleration
    s = 0.0
    while True:
        t = ramp + s
        done, added = velocity_change(t, change, acceleration, tau)
        last = s >= _TAIL * tau
        if last:
            done = change
        n = write_row(path, n, wait + t, v * (wait + t) + ex * added, ey * added, v + ex * done, ey * done)
        if last:
            return n
        s += 0.25 * (tau + s / 3.0)


@jit
def path_at(path: FloatArray, n: int, t: float, row: int, out: FloatArray) -> int:
    """Write x, y, vx, vy at time `t` into `out`; return the row before `t`, looked for from `row` on."""
    while row + 1 < n and path[row + 1, T] <= t:
        row += 1
    if row + 1 >= n:
        dt = t - path[row, T]
        out[0], out[1] = path[row, X] + path[row, VX] * dt, path[row, Y] + path[row, VY] * dt
        out[2], out[3] = path[row, VX], path[row, VY]
        return row
    h = path[row + 1, T] - path[row, T]
    q = (t - path[row, T]) / h
    for i in range(2):
        p0, p1 = path[row, X + i], path[row + 1, X + i]
        d0, d1 = path[row, VX + i] * h, path[row + 1, VX + i] * h
        a, b = 2.0 * (p0 - p1) + d0 + d1, 3.0 * (p1 - p0) - 2.0 * d0 - d1
        out[i] = p0 + q * (d0 + q * (b + q * a))
        out[2 + i] = (d0 + q * (2.0 * b + 3.0 * q * a)) / h
    return row


@jit
def time_to_velocity(done: float, change: float, acceleration: float, tau: float) -> float:
    """Return after what time `velocity_change` has done a part of the change; infinite for all of it or more."""
    if done <= 0.0:
        return 0.0
    if done >= change:
        return math.inf
    lagging = min(acceleration * tau, change) if tau > NO_LAG else 0.0
    if done <= change - lagging:
        return done / acceleration
    return (change - lagging) / acceleration + tau * math.log(lagging / (change - done))


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    path, out = np.empty((MAX_ROWS, N_COLUMNS)), np.empty(4)
    n = turn_path(20.0, 5.0, 1.5, 0.5, 0.5, 0.5, 1.0, path)
    path_at(path, n, 6.0, 0, out)
    velocity_change_path(20.0, 5.0, 0.0, 0.0, 3.0, 0.5, path)
    velocity_change(1.0, 5.0, 2.0, 0.5)
    time_to_velocity(1.0, 5.0, 2.0, 0.5)
