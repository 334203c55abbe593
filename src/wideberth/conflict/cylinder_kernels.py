"""When an intruder in straight flight is inside the cylinder around an ownship that flies along waypoints.

Algorithms 3, 4 and 5 of the thesis (4.3), corrected. The cylinder is closed: a touch counts, also one of no duration
(thesis, algorithm 3 line 19 and algorithm 4 line 5). Local NED, m, m/s, s.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.conflict.kernels import horizontal_cpa, horizontal_interval, vertical_interval

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# What `path_intervals` writes to `first`.
FIRST_ENTRY, FIRST_ALERT, BEYOND = 0, 1, 2
N_FIRST = 3


@jit_uncounted
def horizontal_stay(sx: float, sy: float, vx: float, vy: float, radius: float) -> tuple[float, float]:
    """Return first and last time >= 0 within the closed circle (thesis, algorithm 4); NaN where there is none."""
    if sx * sx + sy * sy == radius * radius and sx * vx + sy * vy >= 0.0 and (vx != 0.0 or vy != 0.0):
        return 0.0, 0.0
    return horizontal_interval(sx, sy, vx, vy, radius, 0.0, True)


@jit_uncounted
def vertical_stay(h: float, rate: float, half_height: float) -> tuple[float, float]:
    """Return first and last time >= 0 within +-half_height, bounds included (thesis, algorithm 5); NaN for none.

    Errata, "Collision detection with waypoints": the printed times have the wrong sign, and the side of the exit
    depends on the sign of the rate alone.
    """
    if abs(h) == half_height and h * rate > 0.0:
        return 0.0, 0.0
    return vertical_interval(h, rate, half_height, 0.0)


@jit_uncounted
def cylinder_stay(
    sx: float, sy: float, sz: float, vx: float, vy: float, vz: float, radius: float, half_height: float
) -> tuple[float, float]:
    """Return first and last time >= 0 in the closed cylinder, in straight flight; NaN where it is never entered."""
    z_in, z_out = vertical_stay(sz, vz, half_height)
    if math.isnan(z_in):
        return math.nan, math.nan
    h_in, h_out = horizontal_stay(sx, sy, vx, vy, radius)
    t_in, t_out = max(h_in, z_in), min(h_out, z_out)
    if t_in <= t_out:  # never so with NaN
        return t_in, t_out
    return math.nan, math.nan


@jit_uncounted
def leg(a: FloatArray, b: FloatArray, speed: float) -> tuple[float, float, float, float]:
    """Return how long the leg from `a` to `b` (3) lasts, and the velocity on it.

    0 s for a repeated point, infinite where the ownship stands still; both without velocity.
    """
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    duration = length / speed
    if math.isinf(duration):
        return duration, 0.0, 0.0, 0.0
    return duration, x / duration, y / duration, z / duration


@jit_uncounted
def near_now(own: FloatArray, p: FloatArray, distance_threshold: float, height_threshold: float) -> bool:
    """Return whether an intruder at `p` counts whenever it enters.

    Errata, "Collision detection with waypoints": |h_r0|, and tau_t and tau_T are one threshold.
    """
    return math.hypot(p[0] - own[0], p[1] - own[1]) <= distance_threshold and abs(p[2] - own[2]) <= height_threshold


@jit_uncounted
def note_stay(
    i: int,
    t_in: float,
    t_out: float,
    near: bool,
    time_threshold: float,
    penetration: BoolArray,
    alert: BoolArray,
    entry: FloatArray,
    exit_: FloatArray,
    first: FloatArray,
) -> None:
    """Write what a stay on segment `i` (NaN: none) means; see `path_intervals`, whose arrays these are."""
    penetration[i] = t_in <= t_out
    alert[i] = penetration[i] and (near or t_in <= time_threshold)
    entry[i], exit_[i] = t_in, t_out
    if penetration[i] and math.isnan(first[FIRST_ENTRY]):
        first[FIRST_ENTRY] = t_in
    if alert[i] and math.isnan(first[FIRST_ALERT]):
        first[FIRST_ALERT] = t_in


@jit_uncounted
def path_intervals(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    p: FloatArray,
    v: FloatArray,
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
    """Judge one intruder against every segment of the path (thesis, algorithm 3).

    Parameters
    ----------
    own, p, v : ndarray, shape (3,)
        Positions of ownship and intruder now, and the intruder's velocity.
    speeds : ndarray, shape (n,)
        Along the path in three dimensions, on the segment that ends at each waypoint. 0: it is never reached.
    waypoints : ndarray, shape (n, 3)
        n >= 1; where the ownship flies from `own`.
    radius, half_height : float
    distance_threshold, height_threshold, time_threshold : float
        An entry counts for the alert where the intruder is within both distances now, or the entry within the time.
    hover : bool
        What the ownship does beyond the last waypoint: stay there, else fly on along the last leg.
    penetration, alert, entry, exit_ : ndarray, shape (n,)
        Written, by segment; times from now, NaN where the cylinder is not entered.
    first : ndarray, shape (N_FIRST,)
        Written: first entry, first one that counts for the alert, first one beyond the last waypoint; NaN for none.
    """
    near = near_now(own, p, distance_threshold, height_threshold)
    first[FIRST_ENTRY] = first[FIRST_ALERT] = first[BEYOND] = math.nan
    start = 0.0
    bx = by = bz = 0.0  # the velocity beyond the last waypoint
    for i in range(waypoints.shape[0]):
        t_in = t_out = math.nan
        if start < math.inf:  # else it stands still, and never gets here
            a = own if i == 0 else waypoints[i - 1]
            duration, vx, vy, vz = leg(a, waypoints[i], speeds[i])
            if duration > 0.0:
                bx, by, bz = vx, vy, vz
            t_in, t_out = cylinder_stay(
                p[0] + v[0] * start - a[0],
                p[1] + v[1] * start - a[1],
                p[2] + v[2] * start - a[2],
                v[0] - vx,
                v[1] - vy,
                v[2] - vz,
                radius,
                half_height,
            )
            if t_in <= duration:
                t_in, t_out = start + t_in, start + min(t_out, duration)
            else:
                t_in = t_out = math.nan
            start += duration
        note_stay(i, t_in, t_out, near, time_threshold, penetration, alert, entry, exit_, first)
    if start < math.inf:
        if hover:
            bx = by = bz = 0.0
        end = waypoints[waypoints.shape[0] - 1]
        t_in, _ = cylinder_stay(
            p[0] + v[0] * start - end[0],
            p[1] + v[1] * start - end[1],
            p[2] + v[2] * start - end[2],
            v[0] - bx,
            v[1] - by,
            v[2] - bz,
            radius,
            half_height,
        )
        first[BEYOND] = start + t_in


@jit_uncounted
def path_intervals_all(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
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
    """Do `path_intervals` for k intruders: `positions`, `velocities` (k, 3); written (k, n), `first` (k, N_FIRST)."""
    for k in range(positions.shape[0]):
        path_intervals(
            own,
            speeds,
            waypoints,
            positions[k],
            velocities[k],
            radius,
            half_height,
            distance_threshold,
            height_threshold,
            time_threshold,
            hover,
            penetration[k],
            alert[k],
            entry[k],
            exit_[k],
            first[k],
        )


@jit_uncounted
def path_closest(
    own: FloatArray, speeds: FloatArray, waypoints: FloatArray, p: FloatArray, v: FloatArray, lookahead: float
) -> tuple[float, float, float]:
    """Return time, horizontal and vertical separation where an intruder is horizontally nearest until the look-ahead.

    Arguments as for `path_intervals`; after the last waypoint nothing is judged.
    """
    t_nearest, d_nearest, h_nearest = math.nan, math.inf, math.nan
    start = 0.0
    for i in range(waypoints.shape[0]):
        if start > lookahead:
            break
        a = own if i == 0 else waypoints[i - 1]
        duration, vx, vy, vz = leg(a, waypoints[i], speeds[i])
        sx, sy, sz = p[0] + v[0] * start - a[0], p[1] + v[1] * start - a[1], p[2] + v[2] * start - a[2]
        ux, uy, uz = v[0] - vx, v[1] - vy, v[2] - vz
        t_cpa, _ = horizontal_cpa(sx, sy, ux, uy)
        t = min(max(t_cpa, 0.0), min(duration, lookahead - start))
        d = math.hypot(sx + ux * t, sy + uy * t)
        if d < d_nearest:
            t_nearest, d_nearest, h_nearest = start + t, d, abs(sz + uz * t)
        start += duration
    return t_nearest, d_nearest, h_nearest


@jit_uncounted
def path_closest_all(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    lookahead: float,
    out: FloatArray,
) -> None:
    """Fill `out` (k, 3) with `path_closest` of k intruders; `positions` and `velocities` are (k, 3)."""
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = path_closest(own, speeds, waypoints, positions[i], velocities[i], lookahead)


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    own, speeds, waypoints, states = np.zeros(3), np.ones(2), np.ones((2, 3)), np.ones((1, 3))
    flags, more_flags = np.zeros((1, 2), np.bool_), np.zeros((1, 2), np.bool_)
    entry, exit_, first = np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, N_FIRST))
    path_intervals_all(
        own, speeds, waypoints, states, states, 1.0, 1.0, 1.0, 1.0, 1.0, False, flags, more_flags, entry, exit_, first
    )
    horizontal_stay(1.0, 1.0, 1.0, 1.0, 1.0)
    vertical_stay(1.0, 1.0, 1.0)
    path_closest_all(own, speeds, waypoints, states, states, 1.0, np.empty((1, 3)))
    near_now(own, own, 1.0, 1.0)
