"""When an intruder that turns, climbs and accelerates is inside the cylinder around an ownship that flies waypoints.

The search is certified: from each instant it moves on by as long as nothing can happen, given the relative velocity
there and the largest acceleration of the segment, and by the tolerance at least. So no stay that lasts longer than the
tolerance is missed, whatever the path. Local NED, m, m/s, s.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.cylinder_kernels import (
    BEYOND,
    FIRST_ALERT,
    FIRST_ENTRY,
    N_FIRST,
    leg,
    near_now,
    note_stay,
)
from wideberth.conflict.turning_kernels import turning_acceleration_bounds, turning_position, turning_velocity
from wideberth.tracking.motion_kernels import CONSTANT_ACCELERATION, CONSTANT_VELOCITY, TURNING, state_count

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_BISECTIONS = 50


@jit_uncounted
def maneuver_state(
    model: int, x: FloatArray, maneuver_time: float, t: float
) -> tuple[float, float, float, float, float, float]:
    """Return position and velocity after `t` seconds; straight on after `maneuver_time`."""
    curved = min(t, maneuver_time)
    if model == TURNING:
        n, e, d = turning_position(curved, x)
        vn, ve, vd = turning_velocity(curved, x)
    else:
        n, e, d = x[0] + curved * x[3], x[1] + curved * x[4], x[2] + curved * x[5]
        vn, ve, vd = x[3], x[4], x[5]
        if model == CONSTANT_ACCELERATION:
            half = 0.5 * curved * curved
            n, e, d = n + half * x[6], e + half * x[7], d + half * x[8]
            vn, ve, vd = vn + curved * x[6], ve + curved * x[7], vd + curved * x[8]
    straight = t - curved
    return n + straight * vn, e + straight * ve, d + straight * vd, vn, ve, vd


@jit_uncounted
def acceleration_bounds(model: int, x: FloatArray, maneuver_time: float, t0: float, t1: float) -> tuple[float, float]:
    """Return bounds of the horizontal and of the vertical acceleration between two times."""
    if model == CONSTANT_VELOCITY or t0 >= maneuver_time:
        return 0.0, 0.0
    if model == TURNING:
        return turning_acceleration_bounds(t0, min(t1, maneuver_time), x)
    return math.hypot(x[6], x[7]), abs(x[8])


@jit_uncounted
def soonest(gap: float, speed: float, acceleration: float) -> float:
    """Return the time before which a distance cannot be covered: 0 without a gap, infinite without motion."""
    if gap <= 0.0:
        return 0.0
    return 2.0 * gap / (speed + math.sqrt(speed * speed + 2.0 * acceleration * gap))


@jit
def find_inside(
    model: int,
    x: FloatArray,
    maneuver_time: float,
    a: FloatArray,
    velocity: tuple[float, float, float],
    start: float,
    begin: float,
    end: float,
    radius: float,
    half_height: float,
    tolerance: float,
) -> float:
    """Return the first time inside on the way from `begin` to `end`, which may be earlier: then the last; NaN for none.

    The ownship is at `a` (3) at `start` and flies with `velocity`. Within the tolerance of the entry, nearer where the
    stay is longer than it: then the bound is found by bisection.
    """
    a_h, a_v = acceleration_bounds(model, x, maneuver_time, min(begin, end), max(begin, end))
    direction = 1.0 if end >= begin else -1.0
    t, before = begin, math.nan
    while True:
        n, e, d, vn, ve, vd = maneuver_state(model, x, maneuver_time, t)
        own = t - start
        h = math.hypot(n - a[0] - own * velocity[0], e - a[1] - own * velocity[1]) - radius
        v = abs(d - a[2] - own * velocity[2]) - half_height
        if h <= 0.0 and v <= 0.0:
            break
        if t == end:
            return math.nan
        step = soonest(h, math.hypot(vn - velocity[0], ve - velocity[1]), a_h)
        step = max(step, soonest(v, abs(vd - velocity[2]), a_v), tolerance)
        before = t
        t += direction * step
        if (t - end) * direction >= 0.0:
            t = end
    if math.isnan(before):
        return t
    within, outside = t, before
    for _ in range(_BISECTIONS):
        middle = 0.5 * (within + outside)
        if abs(within - outside) <= 1e-9:
            break
        n, e, d, _vn, _ve, _vd = maneuver_state(model, x, maneuver_time, middle)
        own = middle - start
        h = math.hypot(n - a[0] - own * velocity[0], e - a[1] - own * velocity[1]) - radius
        if h <= 0.0 and abs(d - a[2] - own * velocity[2]) <= half_height:
            within = middle
        else:
            outside = middle
    return within


@jit
def curved_path_intervals(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    model: int,
    x: FloatArray,
    maneuver_time: float,
    lookahead: float,
    tolerance: float,
    radius: float,
    half_height: float,
    distance_threshold: float,
    height_threshold: float,
    time_threshold: float,
    hover: bool,
    penetration: BoolArray,
    alert: BoolArray,
    entry: FloatArray,
    exit_: FloatArray,
    first: FloatArray,
) -> None:
    """Judge one maneuvering intruder against every segment of the path until the look-ahead.

    Parameters
    ----------
    own, speeds, waypoints, radius, half_height, distance_threshold, height_threshold, time_threshold, hover
        As for `cylinder_kernels.path_intervals`.
    model : int
        Of `tracking.motion_kernels`.
    x : ndarray, shape (9,)
        The intruder's state now, by that model; of constant velocity only six are used.
    maneuver_time : float
        How long the acceleration or the rates last.
    lookahead, tolerance : float
        Finite; no stay longer than the tolerance is missed until the look-ahead.
    penetration, alert, entry, exit_, first : ndarray
        Written, as by `path_intervals`. A curved path may leave and come back on one segment: first entry, last exit.
    """
    near = near_now(own, x[:3], distance_threshold, height_threshold)
    first[FIRST_ENTRY] = first[FIRST_ALERT] = first[BEYOND] = math.nan
    start = 0.0
    beyond = (0.0, 0.0, 0.0)
    for i in range(waypoints.shape[0]):
        t_in = t_out = math.nan
        if start <= lookahead:
            a = own if i == 0 else waypoints[i - 1]
            duration, vx, vy, vz = leg(a, waypoints[i], speeds[i])
            if duration > 0.0:
                beyond = (vx, vy, vz)
            until, velocity = min(start + duration, lookahead), (vx, vy, vz)
            t_in = find_inside(
                model, x, maneuver_time, a, velocity, start, start, until, radius, half_height, tolerance
            )
            if not math.isnan(t_in):
                t_out = find_inside(
                    model, x, maneuver_time, a, velocity, start, until, t_in, radius, half_height, tolerance
                )
                if math.isnan(t_out):
                    t_out = t_in  # shorter than the tolerance
            start += duration
        note_stay(i, t_in, t_out, near, time_threshold, penetration, alert, entry, exit_, first)
    if start <= lookahead:
        if hover:
            beyond = (0.0, 0.0, 0.0)
        end = waypoints[waypoints.shape[0] - 1]
        first[BEYOND] = find_inside(
            model, x, maneuver_time, end, beyond, start, start, lookahead, radius, half_height, tolerance
        )


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    own, speeds, waypoints, x = np.zeros(3), np.ones(2), np.ones((2, 3)), np.ones(9)
    flags, more, entry, exit_ = np.zeros(2, np.bool_), np.zeros(2, np.bool_), np.zeros(2), np.zeros(2)
    for model in (CONSTANT_VELOCITY, CONSTANT_ACCELERATION, TURNING):
        maneuver_state(model, x[: state_count(model)], 1.0, 1.0)
        curved_path_intervals(
            own, speeds, waypoints, model, x, 1.0, 1.0, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0, False,
            flags, more, entry, exit_, np.zeros(N_FIRST),
        )  # fmt: skip
