"""Compiled required range at any bearing: the worst course of an intruder that would enter the safety volume.

Seen from the ownship's start the intruder is at D b, b the unit vector to its bearing, and flies straight at velocity
u. With c(t) = p(t) - u t, p the ownship's path, it is nearer than R exactly if D lies within sqrt(R^2 - across^2) of
along, the components of c beside and along b. Every D is safe beyond the largest along + sqrt(R^2 - across^2), the
*reach*: head-on that is (2.23). If both flew straight on they would pass within R from D up to R / |sin eps|, eps the
angle between the relative velocity and the line from the intruder to the ownship; from farther it needs no escape.

All is seen from the air: a uniform wind moves both alike. It only changes which velocities an intruder of a given speed
over ground can have. Frame: x along the ownship's heading, y to its right. SI, rad.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.analysis.escape_path_kernels import (
    MAX_ROWS,
    N_COLUMNS,
    VX,
    VY,
    T,
    X,
    Y,
    time_to_velocity,
    turn_path,
    velocity_change,
    velocity_change_path,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Columns of the table of climbs; a climb is used where the table of paths is empty.
WAIT, HALF_HEIGHT, VERTICAL_RATE, ACCELERATION, LAG, AGAINST = 0, 1, 2, 3, 4, 5
N_CLIMB = 6

_COURSES, _ZOOMS, _ZOOM_COURSES = 33, 6, 9
_WITHIN = 1e-6  # what begins farther beyond by less than this part counts: it may be rounding
_STILL = 1e-9  # relative speeds below this part of the aircraft's own are rounding


@jit
def reach_in_segment(
    h: float,
    a0: float,
    a1: float,
    x0: float,
    x1: float,
    da0: float,
    da1: float,
    dx0: float,
    dx1: float,
    radius: float,
) -> tuple[float, float]:
    """Return the maximum of along + sqrt(R^2 - across^2) in a segment that has one inside, and its time; -inf if none.

    a, x: along and across at the ends, da, dx their rates. Secant steps within a bracket.
    """
    da0, da1, dx0, dx1 = da0 * h, da1 * h, dx0 * h, dx1 * h
    aa, ab = 2.0 * (a0 - a1) + da0 + da1, 3.0 * (a1 - a0) - 2.0 * da0 - da1
    xa, xb = 2.0 * (x0 - x1) + dx0 + dx1, 3.0 * (x1 - x0) - 2.0 * dx0 - dx1
    low, high = 0.0, 1.0
    m_low = da0 * math.sqrt(max(radius * radius - x0 * x0, 0.0)) - x0 * dx0
    m_high = da1 * math.sqrt(max(radius * radius - x1 * x1, 0.0)) - x1 * dx1
    q = 0.5
    for i in range(60):
        q = low + (high - low) * m_low / (m_low - m_high) if i % 3 != 2 else 0.5 * (low + high)
        x = x0 + q * (dx0 + q * (xb + q * xa))
        dx = dx0 + q * (2.0 * xb + 3.0 * q * xa)
        da = da0 + q * (2.0 * ab + 3.0 * q * aa)
        m = da * math.sqrt(max(radius * radius - x * x, 0.0)) - x * dx
        if m > 0.0:
            low, m_low = q, m
        else:
            high, m_high = q, m
        if high - low < 1e-9 or abs(m) < 1e-12 * radius * (abs(da) + abs(dx)):
            break
    x = x0 + q * (dx0 + q * (xb + q * xa))
    if abs(x) > radius:
        return -math.inf, 0.0
    return a0 + q * (da0 + q * (ab + q * aa)) + math.sqrt(radius * radius - x * x), q * h


@jit
def reach(
    path: FloatArray,
    n: int,
    bx: float,
    by: float,
    ux: float,
    uy: float,
    radius: float,
    open_ended: bool,
    within: float,
) -> tuple[float, float]:
    """Return the distance beyond which an intruder on bearing (bx, by) is safe from, and the time that decides it.

    The distances from which it is not come in stretches, one for each time that the path crosses the line of bearing.
    Those that begin beyond `within` do not count: from there straight flight is enough. Infinite: all count.

    `open_ended`: the ownship flies on straight after its path, for ever. Infinite where no distance is enough.
    """
    best, best_t = radius, 0.0
    near, far, far_t = math.inf, -math.inf, 0.0  # of the stretch at hand
    within *= 1.0 + _WITHIN
    t0 = a0 = x0 = da0 = dx0 = m0 = k0 = root0 = 0.0
    for j in range(n):
        t = path[j, T]
        cx, cy = path[j, X] - ux * t, path[j, Y] - uy * t
        wx, wy = path[j, VX] - ux, path[j, VY] - uy
        a, x = cx * bx + cy * by, bx * cy - by * cx
        da, dx = wx * bx + wy * by, bx * wy - by * wx
        root = math.sqrt(max(radius * radius - x * x, 0.0))
        m, k = da * root - x * dx, -da * root - x * dx
        if j > 0 and m0 > 0.0 and m <= 0.0 and t > t0:
            value, dt = reach_in_segment(t - t0, a0, a, x0, x, da0, da, dx0, dx, radius)
            if value > far:
                far, far_t = value, t0 + dt
        if j > 0 and k0 > 0.0 and k <= 0.0 and t > t0:
            value, _ = reach_in_segment(t - t0, -a0, -a, x0, x, -da0, -da, dx0, dx, radius)
            near = min(near, -value)
        if root > 0.0:
            near = min(near, a - root)
            if a + root > far:
                far, far_t = a + root, t
        else:
            # Where it begins may have been missed: then it counts.
            if far > best and (near <= within or math.isinf(near)):
                best, best_t = far, far_t
            near, far, far_t = math.inf, -math.inf, 0.0
        t0, a0, x0, da0, dx0, m0, k0, root0 = t, a, x, da, dx, m, k, root
    relative = math.hypot(da0, dx0)
    if open_ended and relative > _STILL * math.hypot(ux, uy):
        # On a straight leg the ends of a stretch lie at a fixed distance across.
        if abs(dx0) <= _STILL * relative:
            if da0 > 0.0 and root0 > 0.0 and near <= within:
                return math.inf, math.inf
        else:
            across = radius * da0 / relative * math.copysign(1.0, dx0)
            dt = (across - x0) / dx0
            value = a0 + da0 * dt + radius * abs(dx0) / relative
            if dt > 0.0 and value > far:
                far, far_t = value, t0 + dt
            dt = (-across - x0) / dx0
            if dt > 0.0:
                near = min(near, a0 + da0 * dt - radius * abs(dx0) / relative)
    if far > best and (near <= within or math.isinf(near)):
        best, best_t = far, far_t
    return best, best_t


@jit
def climb_reach(climb: FloatArray, closing: float, angle: float, radius: float) -> float:
    """Return the distance beyond which a climb is enough, the intruder's vertical rate `AGAINST` that of the climb.

    The intruder would be at the ownship's height at the closest point of approach. Halved until it fits: the farther
    away, the more height is gained before the intruder is within R.
    """
    wait, half, rate = float(climb[WAIT]), climb[HALF_HEIGHT], climb[VERTICAL_RATE]
    against = climb[AGAINST]
    if rate <= 0.0:
        return math.inf
    equal = time_to_velocity(against, rate, climb[ACCELERATION], climb[LAG])
    sine, cosine = abs(math.sin(angle)), math.cos(angle)
    if cosine <= 0.0:
        return radius
    # Enough height even if the intruder came all the way with the ownship's climb.
    gained = half + abs(against) * radius / closing
    high = wait + gained / rate + rate / climb[ACCELERATION] + climb[LAG]
    low, high = 0.0, float(closing * high / cosine + radius / cosine)
    for _ in range(60):
        d = 0.5 * (low + high)
        miss = d * sine
        if miss >= radius:
            high = d
            continue
        t_cpa = d * cosine / closing
        inside = math.sqrt(radius * radius - miss * miss) / closing
        # Height between them, least where both climb alike, or at an end of the time within R.
        t = min(max(equal + wait, t_cpa - inside), t_cpa + inside)
        _, height = velocity_change(t - wait, rate, climb[ACCELERATION], climb[LAG])
        if height - against * (t - t_cpa) >= half:
            high = d
        else:
            low = d
    return high


@jit
def needed(
    paths: FloatArray,
    rows: IntArray,
    climbs: FloatArray,
    bearing: float,
    angle: float,
    closing: float,
    v: float,
    radius: float,
    enough: float,
) -> tuple[float, int]:
    """Return the distance that the best escape needs on one course of the intruder, and which escape it is.

    What cannot exceed `enough` is not worked out.
    """
    straight = radius / abs(math.sin(angle)) if angle != 0.0 else math.inf
    if straight <= enough:
        return straight, -1
    best, which = math.inf, -1
    if rows.shape[0] == 0:
        for k in range(climbs.shape[0]):
            value = climb_reach(climbs[k], closing, angle, radius)
            if which < 0 or value < best:
                best, which = value, k
        return min(best, straight), which
    direction = bearing + math.pi + angle
    bx, by = math.cos(bearing), math.sin(bearing)
    ux, uy = v + closing * math.cos(direction), closing * math.sin(direction)
    for k in range(rows.shape[0]):
        value, _ = reach(paths[k], rows[k], bx, by, ux, uy, radius, True, straight)
        if which < 0 or value < best:
            best, which = value, k
        if best <= enough:
            break
    return min(best, straight), which


@jit
def closing_speed(direction: float, gx: float, gy: float, v_i: float, root: int) -> float:
    """Return the speed at which an intruder of speed `v_i` closes in a direction; NaN where it cannot.

    (gx, gy): the ownship's velocity over ground. An intruder that is slower has two courses for it (`root` 1 and -1).
    """
    along = gx * math.cos(direction) + gy * math.sin(direction)
    left = along * along - gx * gx - gy * gy + v_i * v_i
    # A direction at the edge of those that are possible, but for rounding.
    if left < 0.0 and left > -1e-12 * (gx * gx + gy * gy):
        left = 0.0
    if left < 0.0:
        return math.nan
    closing = root * math.sqrt(left) - along
    return closing if closing > _STILL * max(abs(along), v_i) else math.nan


@jit
def worst_course(
    paths: FloatArray,
    rows: IntArray,
    climbs: FloatArray,
    bearing: float,
    v: float,
    gx: float,
    gy: float,
    v_i: float,
    radius: float,
    entry: bool,
) -> tuple[float, float, float, int]:
    """Return required range, the intruder's worst course over ground, closing speed on it, and the escape taken then.

    With `entry` over all courses that lead within R, else over those that lead to the centre. The range is 0 and the
    rest NaN and -1 where no course does.
    """
    best, course, speed, which = 0.0, math.nan, math.nan, -1
    ground = math.hypot(gx, gy)
    low0, high0 = -0.5 * math.pi, 0.5 * math.pi
    if v_i <= ground:
        half = math.asin(v_i / ground)
        middle = math.atan2(-gy, -gx) - bearing - math.pi
        middle -= 2.0 * math.pi * math.floor(middle / (2.0 * math.pi) + 0.5)
        low0, high0 = max(low0, middle - half), min(high0, middle + half)
    for root in (1, -1):
        if root < 0 and v_i > ground:
            break
        low, high = low0, high0
        at = math.nan
        for zoom in range(-1, _ZOOMS + 1):
            n = 1 if zoom < 0 else (_COURSES if zoom == 0 else _ZOOM_COURSES)
            if zoom == 0:
                if not entry:
                    break
                # Farther off the centre, straight flight passes outside from the range already required.
                limit = math.asin(min(radius / best, 1.0)) if best > 0.0 else 0.5 * math.pi
                low, high = max(low0, -limit), min(high0, limit)
            if zoom > 0:
                if math.isnan(at):
                    break
                step = (high - low) / ((_COURSES if zoom == 1 else _ZOOM_COURSES) - 1)
                low, high = max(low0, at - step), min(high0, at + step)
            if low > high:
                break
            for i in range(n):
                angle = 0.0 if zoom < 0 else low + (high - low) * i / (n - 1)
                if not low <= angle <= high:
                    continue
                direction = bearing + math.pi + angle
                closing = closing_speed(direction, gx, gy, v_i, root)
                if math.isnan(closing):
                    continue
                value, escape = needed(paths, rows, climbs, bearing, angle, closing, v, radius, best)
                if value > best:
                    best, at, speed, which = value, angle, closing, escape
                    course = math.atan2(gy + closing * math.sin(direction), gx + closing * math.cos(direction))
            if math.isinf(best):
                return best, course, speed, which
    return best, course, speed, which


@jit
def same(array: FloatArray, i: int) -> bool:
    """Return whether an element equals the one before it."""
    return i > 0 and array[i] == array[i - 1]


@jit
def turn_ranges(
    sides: FloatArray,
    fractions: FloatArray,
    entry: bool,
    arguments: FloatArray,
    out: FloatArray,
    out_escape: IntArray,
) -> None:
    """Write range, course, closing speed (n, 3) and escape of each element, for turns to `sides` by `fractions`."""
    # A row for each argument.
    bearing, v_o, v_i, radius, wait = arguments[0], arguments[1], arguments[2], arguments[3], arguments[4]
    bank_max, turn, rate, tau, tailwind = arguments[5], arguments[6], arguments[7], arguments[8], arguments[9]
    crosswind = arguments[10]
    paths, rows = np.empty((sides.shape[0], MAX_ROWS, N_COLUMNS)), np.zeros(sides.shape[0], np.int64)
    climbs = np.empty((0, N_CLIMB))
    for i in range(bearing.shape[0]):
        known = (
            same(v_o, i) and same(wait, i) and same(bank_max, i) and same(turn, i) and same(rate, i) and same(tau, i)
        )
        if not known:
            for k in range(sides.shape[0]):
                angle = fractions[k] * turn[i]
                rows[k] = turn_path(v_o[i], wait[i], angle, bank_max[i], rate[i], tau[i], sides[k], paths[k])
        out[i, 0], out[i, 1], out[i, 2], out_escape[i] = worst_course(
            paths, rows, climbs, bearing[i], v_o[i], v_o[i] + tailwind[i], crosswind[i], v_i[i], radius[i], entry
        )


@jit
def velocity_change_ranges(
    sides: FloatArray,
    entry: bool,
    arguments: FloatArray,
    out: FloatArray,
    out_escape: IntArray,
) -> None:
    """Write as `turn_ranges`, for changes of velocity to a new speed and course to the `sides`."""
    # A row for each argument.
    bearing, v_o, v_i, radius, wait = arguments[0], arguments[1], arguments[2], arguments[3], arguments[4]
    new_speed, new_course, acceleration, tau = arguments[5], arguments[6], arguments[7], arguments[8]
    paths, rows = np.empty((sides.shape[0], MAX_ROWS, N_COLUMNS)), np.zeros(sides.shape[0], np.int64)
    climbs = np.empty((0, N_CLIMB))
    for i in range(bearing.shape[0]):
        for k in range(sides.shape[0]):
            vx, vy = new_speed[i] * math.cos(new_course[i]), sides[k] * new_speed[i] * math.sin(new_course[i])
            rows[k] = velocity_change_path(v_o[i], wait[i], vx, vy, acceleration[i], tau[i], paths[k])
        out[i, 0], out[i, 1], out[i, 2], out_escape[i] = worst_course(
            paths, rows, climbs, bearing[i], v_o[i], v_o[i], 0.0, v_i[i], radius[i], entry
        )


@jit
def climb_ranges(
    entry: bool,
    arguments: FloatArray,
    climbs: FloatArray,
    out: FloatArray,
    out_escape: IntArray,
) -> None:
    """Write as `turn_ranges`, for the climbs (n, escapes, 6) of each element."""
    # A row for each argument.
    bearing, v_o, v_i, radius = arguments[0], arguments[1], arguments[2], arguments[3]
    paths, rows = np.empty((0, 0, N_COLUMNS)), np.empty(0, np.int64)
    for i in range(bearing.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out_escape[i] = worst_course(
            paths, rows, climbs[i], bearing[i], v_o[i], v_o[i], 0.0, v_i[i], radius[i], entry
        )


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    one, out, escape = np.ones(1), np.empty((1, 3)), np.empty(1, np.int64)
    turn_ranges(one, one, True, np.ones((11, 1)), out, escape)
    velocity_change_ranges(one, True, np.ones((9, 1)), out, escape)
    climb_ranges(True, np.ones((4, 1)), np.ones((1, 1, N_CLIMB)), out, escape)
    path = np.zeros((MAX_ROWS, N_COLUMNS))
    reach(path, 2, 1.0, 0.0, -1.0, 0.0, 1.0, True, math.inf)
