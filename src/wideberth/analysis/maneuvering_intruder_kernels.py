"""Compiled required range against an intruder that maneuvers within limits.

The intruder starts on a collision course and makes one turn, at any time and of any angle within its limit, and changes
its speed from detection on to one of its limits, or not. Path and escape are taken relative to each other as a table in
the manner of `escape_path_kernels`, of which `encounter_angle_kernels.reach` then says what distance it needs.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.analysis.encounter_angle_kernels import closing_speed, reach
from wideberth.analysis.escape_path_kernels import (
    MAX_ROWS,
    N_COLUMNS,
    VX,
    VY,
    T,
    path_at,
    turn_path,
    write_row,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Columns of the intruder's limits.
TURN_ANGLE, TURN_RATE, ACCELERATION, SLOWEST, FASTEST, HORIZON = 0, 1, 2, 3, 4, 5
N_LIMITS = 6

_TURN_ROWS = 8
_STARTS, _TURNS, _ZOOMS, _ZOOM_STEPS = 9, 13, 4, 5
_GAUSS = math.sqrt(0.6)


@jit
def intruder_velocity(
    t: float, v: float, course: float, start: float, turn: float, rate: float, speed: float, acceleration: float
) -> tuple[float, float]:
    """Return the velocity of an intruder that turns by `turn` from `start` on, and goes to `speed` from 0 on."""
    if turn != 0.0 and t > start:
        course += math.copysign(min(rate * (t - start), abs(turn)), turn)
    change = speed - v
    if change != 0.0:
        v += math.copysign(min(acceleration * t, abs(change)), change)
    return v * math.cos(course), v * math.sin(course)


@jit
def relative_path(
    path: FloatArray,
    n: int,
    v: float,
    course: float,
    start: float,
    turn: float,
    rate: float,
    speed: float,
    acceleration: float,
    horizon: float,
    times: FloatArray,
    out: FloatArray,
) -> int:
    """Write the ownship's path less the way of the intruder into `out`, up to `horizon`; return its number of rows."""
    count = 0
    for j in range(n):
        times[count] = path[j, T]
        count += 1
    if turn != 0.0:
        for j in range(_TURN_ROWS + 1):
            times[count] = start + abs(turn) / rate * j / _TURN_ROWS
            count += 1
    if speed != v:
        times[count] = abs(speed - v) / acceleration
        count += 1
    if not math.isinf(horizon):
        times[count] = horizon
        count += 1
    times[:count].sort()
    own = np.empty(4)
    row = m = 0
    t0 = zx = zy = 0.0
    for j in range(count):
        t = times[j]
        if t > horizon:
            break
        if j > 0 and t <= t0:
            continue
        h = t - t0
        for i in range(3):
            weight = 8.0 / 18.0 if i == 1 else 5.0 / 18.0
            at = t0 + 0.5 * h * (1.0 + (i - 1) * _GAUSS)
            ux, uy = intruder_velocity(at, v, course, start, turn, rate, speed, acceleration)
            zx, zy = zx + weight * h * ux, zy + weight * h * uy
        ux, uy = intruder_velocity(t, v, course, start, turn, rate, speed, acceleration)
        row = path_at(path, n, t, row, own)
        m = write_row(out, m, t, own[0] - zx, own[1] - zy, own[2] - ux, own[3] - uy)
        t0 = t
    return m


@jit
def can_follow(path: FloatArray, n: int, bearing: float, course: float, widest: float, speed: float) -> bool:
    """Return whether a turn within `widest` leads an intruder onto a collision course with the ownship's last leg.

    Then no distance is enough: from however far away, it comes at a constant bearing.
    """
    vx, vy = path[n - 1, VX], path[n - 1, VY]
    across = math.cos(bearing) * vy - math.sin(bearing) * vx
    if abs(across) > speed or speed == 0.0:
        return False
    along = math.cos(bearing) * vx + math.sin(bearing) * vy
    for k in range(2):
        # Angle of the intruder's velocity from the bearing line, for which nothing is left across it.
        angle = math.asin(across / speed) if k == 0 else math.pi - math.asin(across / speed)
        turn = bearing + angle - course
        turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
        if abs(turn) <= widest and along > speed * math.cos(angle):
            return True
    return False


@jit
def worst_maneuver(
    path: FloatArray,
    n: int,
    bearing: float,
    v_i: float,
    course: float,
    radius: float,
    limits: FloatArray,
    times: FloatArray,
    relative: FloatArray,
) -> tuple[float, float, float, float]:
    """Return the range required by an escape against the worst maneuver, and its start, turn and final speed."""
    bx, by = math.cos(bearing), math.sin(bearing)
    horizon = limits[HORIZON]
    open_ended = math.isinf(horizon)
    widest, rate = limits[TURN_ANGLE], limits[TURN_RATE]
    # A turn that begins after the closest point of approach of straight flight comes too late.
    m = relative_path(path, n, v_i, course, 0.0, 0.0, rate, v_i, 1.0, horizon, times, relative)
    best, latest = reach(relative, m, bx, by, 0.0, 0.0, radius, open_ended, math.inf)
    best_start, best_turn, best_speed = 0.0, 0.0, v_i
    if math.isinf(best):
        return best, best_start, best_turn, best_speed
    for s in range(3):
        speed = v_i if s == 0 else (limits[FASTEST] if s == 1 else limits[SLOWEST])
        if s > 0 and (speed == v_i or limits[ACCELERATION] == 0.0):
            continue
        if open_ended and can_follow(path, n, bearing, course, widest, speed):
            return math.inf, 0.0, math.nan, speed
        found, at_start, at_turn = -math.inf, 0.0, 0.0
        low_start, high_start, low_turn, high_turn = 0.0, latest, -widest, widest
        for zoom in range(_ZOOMS + 1):
            starts = (_STARTS if zoom == 0 else _ZOOM_STEPS) if widest > 0.0 else 1
            turns = (_TURNS if zoom == 0 else _ZOOM_STEPS) if widest > 0.0 else 1
            for i in range(starts):
                for j in range(turns):
                    start = low_start + (high_start - low_start) * i / max(starts - 1, 1)
                    turn = low_turn + (high_turn - low_turn) * j / (turns - 1) if widest > 0.0 else 0.0
                    m = relative_path(
                        path, n, v_i, course, start, turn, rate, speed, limits[ACCELERATION], horizon, times, relative
                    )
                    value, _ = reach(relative, m, bx, by, 0.0, 0.0, radius, open_ended, math.inf)
                    if value > found:
                        found, at_start, at_turn = value, start, turn
            if starts == 1 or math.isinf(found):
                break
            dt, dturn = (high_start - low_start) / (starts - 1), (high_turn - low_turn) / (turns - 1)
            low_start, high_start = max(at_start - dt, 0.0), at_start + dt
            low_turn, high_turn = max(at_turn - dturn, -widest), min(at_turn + dturn, widest)
        if found > best:
            best, best_start, best_turn, best_speed = found, at_start, at_turn, speed
    return best, best_start, best_turn, best_speed


@jit
def maneuvering_ranges(
    sides: FloatArray,
    arguments: FloatArray,
    limits: FloatArray,
    out: FloatArray,
    out_side: IntArray,
) -> None:
    """Write range and the intruder's course, start, turn and final speed (n, 5), and the ownship's side."""
    # A row for each argument.
    bearing, v_o, v_i, radius, wait = arguments[0], arguments[1], arguments[2], arguments[3], arguments[4]
    bank_max, turn, rate, tau = arguments[5], arguments[6], arguments[7], arguments[8]
    paths, rows = np.empty((sides.shape[0], MAX_ROWS, N_COLUMNS)), np.zeros(sides.shape[0], np.int64)
    times, relative = np.empty(MAX_ROWS + 16), np.empty((MAX_ROWS + 16, N_COLUMNS))
    for i in range(bearing.shape[0]):
        for k in range(sides.shape[0]):
            rows[k] = turn_path(v_o[i], wait[i], turn[i], bank_max[i], rate[i], tau[i], sides[k], paths[k])
        out[i, 0], out_side[i] = 0.0, -1
        for c in range(1, 5):
            out[i, c] = math.nan
        direction = bearing[i] + math.pi
        for root in (1, -1):
            closing = closing_speed(direction, v_o[i], 0.0, v_i[i], root)
            if math.isnan(closing) or (root < 0 and v_i[i] > v_o[i]):
                continue
            course = math.atan2(closing * math.sin(direction), v_o[i] + closing * math.cos(direction))
            least, side = math.inf, -1
            start = angle = speed = math.nan
            for k in range(sides.shape[0]):
                d, at, by, to = worst_maneuver(
                    paths[k], rows[k], bearing[i], v_i[i], course, radius[i], limits[i], times, relative
                )
                if side < 0 or d < least:
                    least, side, start, angle, speed = d, k, at, by, to
            if least > out[i, 0]:
                out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = least, course, start, angle, speed
                out_side[i] = side


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    out, side = np.empty((1, 5)), np.empty(1, np.int64)
    maneuvering_ranges(np.ones(1), np.ones((9, 1)), np.ones((1, N_LIMITS)), out, side)
