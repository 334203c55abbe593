"""Compiled trajectory predictions (CAS thesis, 4.1.2): closest points of curved courses, and the filter of a vehicle.

Courses here are relative ones (own minus other), NED; m, m/s, s. A filter has four states an axis, as those of
`tracking.kernels`, of which the last is not used.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.kernels import predict_axis, update_axis

FloatArray = NDArray[np.float64]

STATES = 4  # position, velocity, acceleration, and one that stays 0
_HALVINGS = 60


@jit_uncounted
def squared_distance(
    t: float, px: float, py: float, pz: float, vx: float, vy: float, vz: float, ax: float, ay: float, az: float
) -> float:
    """Return the squared distance after `t` with constant acceleration."""
    half = 0.5 * t * t
    x, y, z = px + vx * t + ax * half, py + vy * t + ay * half, pz + vz * t + az * half
    return x * x + y * y + z * z


@jit
def accelerated_closest_point(
    px: float,
    py: float,
    pz: float,
    vx: float,
    vy: float,
    vz: float,
    ax: float,
    ay: float,
    az: float,
    hold: float,
    lookahead: float,
) -> tuple[float, float]:
    """Return t* and d* until the look-ahead, with an acceleration for `hold` seconds and straight flight after it.

    Half the derivative of the squared distance is a cubic in t: it is monotone between the roots of its own derivative,
    and each piece where it rises through zero holds one closest point.
    """
    until = min(hold, lookahead)
    aa = ax * ax + ay * ay + az * az
    va = vx * ax + vy * ay + vz * az
    pv, b = px * vx + py * vy + pz * vz, vx * vx + vy * vy + vz * vz + px * ax + py * ay + pz * az
    # slope(t) = pv + b t + 1.5 va t^2 + 0.5 aa t^3
    first = last = until
    under = 9.0 * va * va - 6.0 * aa * b
    if under > 0.0 and aa > 0.0:
        root = math.sqrt(under)
        first = min(max((-3.0 * va - root) / (3.0 * aa), 0.0), until)
        last = min(max((-3.0 * va + root) / (3.0 * aa), 0.0), until)
    best_t = 0.0
    best = squared_distance(0.0, px, py, pz, vx, vy, vz, ax, ay, az)
    begin = 0.0
    for piece in range(3):
        end = (first, last, until)[piece]
        low, high = begin, end
        if pv + low * (b + low * (1.5 * va + low * 0.5 * aa)) < 0.0:
            t = high
            if pv + high * (b + high * (1.5 * va + high * 0.5 * aa)) > 0.0:
                for _ in range(_HALVINGS):
                    t = 0.5 * (low + high)
                    if pv + t * (b + t * (1.5 * va + t * 0.5 * aa)) < 0.0:
                        low = t
                    else:
                        high = t
            squared = squared_distance(t, px, py, pz, vx, vy, vz, ax, ay, az)
            if squared < best:
                best, best_t = squared, t
        begin = end
    if lookahead > until:
        half = 0.5 * until * until
        qx, qy, qz = px + vx * until + ax * half, py + vy * until + ay * half, pz + vz * until + az * half
        wx, wy, wz = vx + ax * until, vy + ay * until, vz + az * until
        ww = wx * wx + wy * wy + wz * wz
        if ww > 0.0:
            t = min(max(-(qx * wx + qy * wy + qz * wz) / ww, 0.0), lookahead - until)
            squared = squared_distance(t, qx, qy, qz, wx, wy, wz, 0.0, 0.0, 0.0)
            if squared < best:
                best, best_t = squared, until + t
    return best_t, math.sqrt(best)


@jit_uncounted
def place_on_path(path: FloatArray, leg: int, t: float, axis: int) -> float:
    """Return a coordinate at `t` on the leg that ends at node `leg`; `path` (n, 4) is t, north, east, down.

    Before the first node and after the last one it stays there.
    """
    last = path.shape[0] - 1
    if leg <= 0:
        return float(path[0, 1 + axis])
    if leg > last:
        return float(path[last, 1 + axis])
    share = (t - path[leg - 1, 0]) / (path[leg, 0] - path[leg - 1, 0])
    return float(path[leg - 1, 1 + axis] + share * (path[leg, 1 + axis] - path[leg - 1, 1 + axis]))


@jit
def paths_closest_point(own: FloatArray, other: FloatArray, lookahead: float, at: FloatArray) -> tuple[float, float]:
    """Return t* and d* of two vehicles that fly along nodes of time and position.

    Parameters
    ----------
    own, other : ndarray, shape (m, 4) and (n, 4)
        Times from now, increasing, and places, NED: straight between them, at rest after the last.
    lookahead : float
        s.
    at : ndarray, shape (3,)
        Written: own minus other at t*.
    """
    i = j = 0
    while i < own.shape[0] and own[i, 0] <= 0.0:
        i += 1
    while j < other.shape[0] and other[j, 0] <= 0.0:
        j += 1
    t, best, best_t = 0.0, math.inf, 0.0
    while True:
        end = lookahead
        if i < own.shape[0]:
            end = min(end, own[i, 0])
        if j < other.shape[0]:
            end = min(end, other[j, 0])
        x0, x1 = place_on_path(own, i, t, 0) - place_on_path(other, j, t, 0), 0.0
        y0, y1 = place_on_path(own, i, t, 1) - place_on_path(other, j, t, 1), 0.0
        z0, z1 = place_on_path(own, i, t, 2) - place_on_path(other, j, t, 2), 0.0
        x1 = place_on_path(own, i, end, 0) - place_on_path(other, j, end, 0) - x0
        y1 = place_on_path(own, i, end, 1) - place_on_path(other, j, end, 1) - y0
        z1 = place_on_path(own, i, end, 2) - place_on_path(other, j, end, 2) - z0
        length = x1 * x1 + y1 * y1 + z1 * z1
        share = 0.0
        if length > 0.0:
            share = min(max(-(x0 * x1 + y0 * y1 + z0 * z1) / length, 0.0), 1.0)
        x, y, z = x0 + share * x1, y0 + share * y1, z0 + share * z1
        squared = x * x + y * y + z * z
        if squared < best:
            best, best_t = squared, t + share * (end - t)
            at[0], at[1], at[2] = x, y, z
        if end >= lookahead:
            return best_t, math.sqrt(best)
        t = end
        if i < own.shape[0] and own[i, 0] <= t:
            i += 1
        if j < other.shape[0] and other[j, 0] <= t:
            j += 1


@jit_uncounted
def filter_matrices(dt: float, density: float, accelerates: bool, phi: FloatArray, q: FloatArray) -> None:
    """Write transition and process noise (4, 4) over `dt`.

    `density` is that of white acceleration (m2/s3), or with `accelerates` of white jerk (m2/s5).
    """
    for a in range(STATES):
        for b in range(STATES):
            phi[a, b] = q[a, b] = 0.0
        phi[a, a] = 1.0
    phi[0, 1] = dt
    n = 2
    if accelerates:
        phi[0, 2], phi[1, 2] = 0.5 * dt * dt, dt
        n = 3
    for a in range(n):
        for b in range(n):
            # The noise enters at the last state: state a is its (n - a)-fold integral.
            i, j = n - 1 - a, n - 1 - b
            q[a, b] = density * dt ** (i + j + 1) / (math.gamma(i + 1.0) * math.gamma(j + 1.0) * (i + j + 1))


@jit_uncounted
def predict_vehicle(x: FloatArray, c: FloatArray, phi: FloatArray, q: FloatArray) -> None:
    """Take state (3, 4) and covariance (3, 4, 4) of a vehicle on, in place."""
    for axis in range(3):
        predict_axis(x[axis], c[axis], phi, q, x[axis], c[axis])


@jit_uncounted
def filter_message(
    x: FloatArray,
    c: FloatArray,
    dt: float,
    density: float,
    accelerates: bool,
    measured: FloatArray,
    variances: FloatArray,
    phi: FloatArray,
    q: FloatArray,
) -> None:
    """Take a vehicle's estimate on to its message and take in what the message holds, in place.

    Parameters
    ----------
    x, c : ndarray, shape (3, 4) and (3, 4, 4)
    dt : float
        Since the estimate, s.
    density, accelerates
        As for `filter_matrices`.
    measured : ndarray, shape (3, 3)
        Rows position, velocity, acceleration; NaN where not received.
    variances : ndarray, shape (3,)
        Of these on each axis.
    phi, q : ndarray, shape (4, 4)
        Scratch.
    """
    filter_matrices(dt, density, accelerates, phi, q)
    predict_vehicle(x, c, phi, q)
    for axis in range(3):
        for state in range(3):
            value = measured[state, axis]
            if math.isfinite(value):
                update_axis(x[axis], c[axis], state, value - x[axis, state], c[axis, state, state] + variances[state])


def warmup() -> None:
    """Compile what Python calls."""
    accelerated_closest_point(9.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0, 9.0)
    path = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]])
    paths_closest_point(path, path, 2.0, np.empty(3))
    x, c, phi, q = np.zeros((3, STATES)), np.zeros((3, STATES, STATES)), np.zeros((4, 4)), np.zeros((4, 4))
    filter_matrices(1.0, 1.0, True, phi, q)
    predict_vehicle(x, c, phi, q)
    filter_message(x, c, 1.0, 1.0, True, np.zeros((3, 3)), np.ones(3), phi, q)
