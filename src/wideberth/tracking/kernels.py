"""Kernels of the ADS-B Kalman filter: three decoupled axes of position, velocity, acceleration, jerk.

States are (n, 3, 4), covariances (n, 3, 4, 4). Transition tables hold the matrices of 1, 2, ..., m internal steps: a
transition over many steps is one product, equal to walking them. ADS-B paper, section "ADS-B Signal Processing".
"""

import math

import numpy as np

from wideberth._jit import jit
from wideberth.sensors.kernels import CONTAINMENT_RADIUS, EPU, RAYLEIGH_95, VELOCITY_BOUND
from wideberth.sensors.kernels import nic_bound_of as nic_bound_of
from wideberth.sensors.kernels import position_sigma_of as position_sigma_of
from wideberth.sensors.kernels import velocity_sigma_of as velocity_sigma_of

ABSENT, ACCEPTED, REJECTED, SWAPPED = 0, 1, 2, 3
NACP_COUNT, NACV_COUNT, NIC_COUNT = len(EPU), len(VELOCITY_BOUND), len(CONTAINMENT_RADIUS)
RAYLEIGH_95_RADIUS = RAYLEIGH_95


@jit
def predict_axis(
    x: np.ndarray, p: np.ndarray, phi: np.ndarray, q: np.ndarray, x_out: np.ndarray, p_out: np.ndarray
) -> None:
    """Write the state and covariance of one axis after the transition `phi`, which is upper triangular.

    Parameters
    ----------
    x, p : ndarray, shape (4,) and (4, 4)
    phi, q : ndarray, shape (4, 4)
        Transition and process noise.
    x_out, p_out : ndarray, shape (4,) and (4, 4)
        Written; may be `x` and `p`.
    """
    half = np.empty((4, 4))
    for i in range(4):
        for j in range(4):
            s = 0.0
            for k in range(i, 4):
                s += phi[i, k] * p[k, j]
            half[i, j] = s
    for i in range(4):
        for j in range(i, 4):
            s = 0.0
            for k in range(j, 4):
                s += half[i, k] * phi[j, k]
            s += q[i, j]
            p_out[i, j] = s
            p_out[j, i] = s
    for i in range(4):
        s = 0.0
        for k in range(i, 4):
            s += phi[i, k] * x[k]
        x_out[i] = s


@jit
def predict_steps(
    x: np.ndarray,
    p: np.ndarray,
    steps: int,
    phi: np.ndarray,
    q: np.ndarray,
    x_out: np.ndarray,
    p_out: np.ndarray,
) -> None:
    """Write the state and covariance of one axis `steps` internal steps later.

    Parameters
    ----------
    x, p : ndarray, shape (4,) and (4, 4)
    steps : int
    phi, q : ndarray, shape (m, 4, 4)
        Tables over 1 to m steps; more than m steps are walked in pieces.
    x_out, p_out : ndarray, shape (4,) and (4, 4)
        Written; may be `x` and `p`.
    """
    for i in range(4):
        x_out[i] = x[i]
        for j in range(4):
            p_out[i, j] = p[i, j]
    left = steps
    while left > 0:
        n = min(left, phi.shape[0])
        predict_axis(x_out, p_out, phi[n - 1], q[n - 1], x_out, p_out)
        left -= n


@jit
def update_axis(x: np.ndarray, p: np.ndarray, state: int, innovation: float, variance: float) -> None:
    """Update one axis in place with a measurement of one of its states.

    Parameters
    ----------
    x, p : ndarray, shape (4,) and (4, 4)
    state : int
        0 position, 1 velocity.
    innovation : float
        Measured minus predicted.
    variance : float
        Of the innovation.
    """
    column = np.empty(4)
    for i in range(4):
        column[i] = p[i, state]
    for i in range(4):
        gain = column[i] / variance
        x[i] += gain * innovation
        for j in range(i, 4):
            p[i, j] -= gain * column[j]
            p[j, i] = p[i, j]


@jit
def horizontal_distance(
    x: np.ndarray, p: np.ndarray, north: float, east: float, variance_north: float, variance_east: float
) -> float:
    """Return the squared Mahalanobis distance of a horizontal position from a predicted state (3, 4), (3, 4, 4)."""
    dn, de = north - x[0, 0], east - x[1, 0]
    distance: float = dn * dn / (p[0, 0, 0] + variance_north) + de * de / (p[1, 0, 0] + variance_east)
    return distance


@jit
def predict_track(
    x: np.ndarray,
    p: np.ndarray,
    steps: int,
    phi: np.ndarray,
    q: np.ndarray,
    x_out: np.ndarray,
    p_out: np.ndarray,
) -> None:
    """Write the three axes of one track `steps` internal steps later.

    Parameters
    ----------
    x, p : ndarray, shape (3, 4) and (3, 4, 4)
    steps : int
    phi, q : ndarray, shape (2, m, 4, 4)
        Tables of the horizontal axes and of the vertical one.
    x_out, p_out : ndarray, shape (3, 4) and (3, 4, 4)
        Written; may be `x` and `p`.
    """
    for axis in range(3):
        table = 1 if axis == 2 else 0
        predict_steps(x[axis], p[axis], steps, phi[table], q[table], x_out[axis], p_out[axis])


@jit
def update_track(
    x: np.ndarray,
    p: np.ndarray,
    z: np.ndarray,
    r: np.ndarray,
    use: np.ndarray,
    gate: float,
    time_sigma: float,
    outcome: np.ndarray,
    nis: np.ndarray,
) -> None:
    """Update a predicted track in place with one report.

    Each of horizontal position, altitude, climb rate and horizontal velocity passes its own gate; the climb rate is
    judged after the altitude has been used. Nothing is used of a report whose position fails: it may be of another
    aircraft.

    Parameters
    ----------
    x, p : ndarray, shape (3, 4) and (3, 4, 4)
    z, r : ndarray, shape (6,)
        North, east, down, velocity north, east, down, and the variances; NaN where absent.
    use : ndarray of bool, shape (4,)
        Whether to use horizontal position, altitude, climb rate, horizontal velocity.
    gate : float
        Largest Mahalanobis distance.
    time_sigma : float
        Uncertainty of the time stamp, s: moves the position along the velocity.
    outcome : ndarray of int, shape (4,)
        Written: `ABSENT`, `ACCEPTED`, `REJECTED` or, for the velocity, `SWAPPED` (north and east fit in reverse order).
    nis : ndarray, shape (4,)
        Written: normalised innovation squared, with 2, 1, 1, 2 degrees of freedom.
    """
    limit = gate * gate
    outcome[:] = ABSENT
    nis[:] = math.nan
    if use[0]:
        rn = r[0] + (time_sigma * x[0, 1]) ** 2
        re = r[1] + (time_sigma * x[1, 1]) ** 2
        nis[0] = horizontal_distance(x, p, z[0], z[1], rn, re)
        if nis[0] <= limit:
            outcome[0] = ACCEPTED
            update_axis(x[0], p[0], 0, z[0] - x[0, 0], p[0, 0, 0] + rn)
            update_axis(x[1], p[1], 0, z[1] - x[1, 0], p[1, 0, 0] + re)
        else:
            outcome[0] = REJECTED
            return
    for k in range(2):  # altitude, then climb rate
        if use[1 + k]:
            element = 2 if k == 0 else 5
            innovation = z[element] - x[2, k]
            variance = p[2, k, k] + r[element]
            nis[1 + k] = innovation * innovation / variance
            if nis[1 + k] <= limit:
                outcome[1 + k] = ACCEPTED
                update_axis(x[2], p[2], k, innovation, variance)
            else:
                outcome[1 + k] = REJECTED
    if use[3]:
        sn, se = p[0, 1, 1] + r[3], p[1, 1, 1] + r[4]
        dn, de = z[3] - x[0, 1], z[4] - x[1, 1]
        nis[3] = dn * dn / sn + de * de / se
        if nis[3] <= limit:
            outcome[3] = ACCEPTED
            update_axis(x[0], p[0], 1, dn, sn)
            update_axis(x[1], p[1], 1, de, se)
        elif (z[4] - x[0, 1]) ** 2 / sn + (z[3] - x[1, 1]) ** 2 / se <= limit:
            outcome[3] = SWAPPED
        else:
            outcome[3] = REJECTED


@jit
def filter_reports(
    x: np.ndarray,
    p: np.ndarray,
    last: np.ndarray,
    slots: np.ndarray,
    steps: np.ndarray,
    phi: np.ndarray,
    q: np.ndarray,
    z: np.ndarray,
    r: np.ndarray,
    use: np.ndarray,
    gate: float,
    time_sigma: np.ndarray,
    outcome: np.ndarray,
    nis: np.ndarray,
) -> None:
    """Predict tracks in place to the time of their reports and update them, one report after the other.

    Parameters
    ----------
    x, p : ndarray, shape (n, 3, 4) and (n, 3, 4, 4)
    last : ndarray of int, shape (n,)
        Internal step of each filter's state; moved.
    slots, steps : ndarray of int, shape (k,)
        The filter of each report, and its internal step.
    phi, q : ndarray, shape (2, m, 4, 4)
    z, r : ndarray, shape (k, 6)
    use : ndarray of bool, shape (k, 4)
    gate : float
    time_sigma : ndarray, shape (k,)
    outcome, nis : ndarray, shape (k, 4)
        Written; see `update_track`.
    """
    for i in range(slots.shape[0]):
        s = slots[i]
        predict_track(x[s], p[s], steps[i] - last[s], phi, q, x[s], p[s])
        update_track(x[s], p[s], z[i], r[i], use[i], gate, time_sigma[i], outcome[i], nis[i])
        last[s] = steps[i]


@jit
def predicted_distance(
    x: np.ndarray,
    p: np.ndarray,
    steps: int,
    phi: np.ndarray,
    q: np.ndarray,
    north: float,
    east: float,
    variance: float,
    time_sigma: float,
) -> float:
    """Return the squared Mahalanobis distance of a horizontal position from a track `steps` internal steps later."""
    state = np.empty((3, 4))
    cov = np.empty((3, 4, 4))
    predict_track(x, p, steps, phi, q, state, cov)
    rn = variance + (time_sigma * state[0, 1]) ** 2
    re = variance + (time_sigma * state[1, 1]) ** 2
    return horizontal_distance(state, cov, north, east, rn, re)


@jit
def output_tracks(
    x: np.ndarray,
    p: np.ndarray,
    last: np.ndarray,
    slots: np.ndarray,
    now: int,
    residual: float,
    dt: float,
    phi: np.ndarray,
    q: np.ndarray,
    bias: np.ndarray,
    latency: float,
    position: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    covariance: np.ndarray,
    spread: np.ndarray,
) -> None:
    """Predict tracks to the time of the output and add what does not average out.

    Parameters
    ----------
    x, p : ndarray, shape (n, 3, 4) and (n, 3, 4, 4)
        All filters at their last updates.
    last : ndarray of int, shape (n,)
        Internal step of each filter's last update.
    slots : ndarray of int, shape (k,)
        Which filters.
    now : int
        Internal step nearest to the time of the output.
    residual : float
        Time of the output minus that of step `now`, s: the mean is moved over it.
    dt : float
        Internal step, s.
    phi, q : ndarray, shape (2, m, 4, 4)
    bias : ndarray, shape (n, 2)
        Variance of the slowly varying position error of each horizontal axis, and of the altitude, m2.
    latency : float
        Standard deviation of the uncompensated latency, s: along the velocity.
    position, velocity, acceleration : ndarray, shape (k, 3)
        Written.
    covariance : ndarray, shape (k, 9, 9)
        Written; must be zero before.
    spread : ndarray, shape (k,)
        Written: the filter's own horizontal standard deviation (larger axis), without the bias, m.
    """
    state = np.empty((3, 4))
    cov = np.empty((3, 4, 4))
    for i in range(slots.shape[0]):
        s = slots[i]
        steps = max(now - last[s], 0)
        remainder = residual + (now - last[s] - steps) * dt
        predict_track(x[s], p[s], steps, phi, q, state, cov)
        for axis in range(3):
            v, a = state[axis, 1], state[axis, 2]
            position[i, axis] = state[axis, 0] + remainder * (v + 0.5 * remainder * a)
            velocity[i, axis] = v + remainder * a
            acceleration[i, axis] = a
            for m in range(3):
                for n in range(3):
                    covariance[i, axis + 3 * m, axis + 3 * n] = cov[axis, m, n]
        spread[i] = math.sqrt(max(cov[0, 0, 0], cov[1, 0, 0]))
        covariance[i, 0, 0] += bias[s, 0]
        covariance[i, 1, 1] += bias[s, 0]
        covariance[i, 2, 2] += bias[s, 1]
        for m in range(2):
            for n in range(2):
                covariance[i, m, n] += latency * latency * velocity[i, m] * velocity[i, n]


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, p = np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4))
    p[:] = np.eye(4)
    tables, noises = np.zeros((2, 1, 4, 4)), np.zeros((2, 1, 4, 4))
    tables[:], noises[:] = np.eye(4), np.eye(4)
    z, r, index, codes = np.zeros((1, 6)), np.ones((1, 6)), np.zeros(1, np.int64), np.zeros((1, 4), np.int64)
    use, nis, one, three = np.ones((1, 4), np.bool_), np.zeros((1, 4)), np.zeros(1), np.zeros((1, 3))
    predict_axis(x[0, 0], p[0, 0], tables[0, 0], noises[0, 0], x[0, 0], p[0, 0])
    predict_steps(x[0, 0], p[0, 0], 1, tables[0], noises[0], x[0, 0], p[0, 0])
    predict_track(x[0], p[0], 1, tables, noises, x[0], p[0])
    update_axis(x[0, 0], p[0, 0], 0, 0.0, 1.0)
    horizontal_distance(x[0], p[0], 0.0, 0.0, 1.0, 1.0)
    predicted_distance(x[0], p[0], 1, tables, noises, 0.0, 0.0, 1.0, 0.0)
    update_track(x[0], p[0], z[0], r[0], use[0], 5.0, 0.0, codes[0], nis[0])
    filter_reports(x, p, index, index, index, tables, noises, z, r, use, 5.0, one, codes, nis)
    output_tracks(
        x, p, index, index, 0, 0.0, 0.1, tables, noises, np.zeros((1, 2)), 0.0, three, three, three,
        np.zeros((1, 9, 9)), one,
    )  # fmt: skip
