"""Kernels of the ADS-B Kalman filter: three decoupled axes of position, velocity, acceleration, jerk.

States are (n, 3, 4), covariances (n, 3, 4, 4). Transition tables hold the matrices of 1, 2, ..., m internal steps: a
transition over many steps is one product, equal to walking them. ADS-B paper, section "ADS-B Signal Processing".
"""

import math

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.sensors.kernels import CONTAINMENT_RADIUS, EPU, RAYLEIGH_95, VELOCITY_BOUND
from wideberth.sensors.kernels import nic_bound_of as nic_bound_of
from wideberth.sensors.kernels import position_sigma_of as position_sigma_of
from wideberth.sensors.kernels import velocity_sigma_of as velocity_sigma_of

ABSENT, ACCEPTED, REJECTED, SWAPPED = 0, 1, 2, 3
NACP_COUNT, NACV_COUNT, NIC_COUNT = len(EPU), len(VELOCITY_BOUND), len(CONTAINMENT_RADIUS)
RAYLEIGH_95_RADIUS = RAYLEIGH_95


@jit_uncounted
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
    f00, f01, f02, f03 = phi[0, 0], phi[0, 1], phi[0, 2], phi[0, 3]
    f11, f12, f13 = phi[1, 1], phi[1, 2], phi[1, 3]
    f22, f23, f33 = phi[2, 2], phi[2, 3], phi[3, 3]
    p00, p01, p02, p03 = p[0, 0], p[0, 1], p[0, 2], p[0, 3]
    p11, p12, p13, p22, p23, p33 = p[1, 1], p[1, 2], p[1, 3], p[2, 2], p[2, 3], p[3, 3]
    # Rows of phi p, of which the product with phi needs these; buffers on the heap would cost more than the arithmetic.
    h00 = f00 * p00 + f01 * p01 + f02 * p02 + f03 * p03
    h01 = f00 * p01 + f01 * p11 + f02 * p12 + f03 * p13
    h02 = f00 * p02 + f01 * p12 + f02 * p22 + f03 * p23
    h03 = f00 * p03 + f01 * p13 + f02 * p23 + f03 * p33
    h11 = f11 * p11 + f12 * p12 + f13 * p13
    h12 = f11 * p12 + f12 * p22 + f13 * p23
    h13 = f11 * p13 + f12 * p23 + f13 * p33
    h22 = f22 * p22 + f23 * p23
    h23 = f22 * p23 + f23 * p33
    p_out[0, 0] = h00 * f00 + h01 * f01 + h02 * f02 + h03 * f03 + q[0, 0]
    p_out[1, 1] = h11 * f11 + h12 * f12 + h13 * f13 + q[1, 1]
    p_out[2, 2] = h22 * f22 + h23 * f23 + q[2, 2]
    p_out[3, 3] = f33 * p33 * f33 + q[3, 3]
    c01 = h01 * f11 + h02 * f12 + h03 * f13 + q[0, 1]
    c02, c12 = h02 * f22 + h03 * f23 + q[0, 2], h12 * f22 + h13 * f23 + q[1, 2]
    c03, c13, c23 = h03 * f33 + q[0, 3], h13 * f33 + q[1, 3], h23 * f33 + q[2, 3]
    p_out[0, 1], p_out[1, 0] = c01, c01
    p_out[0, 2], p_out[2, 0] = c02, c02
    p_out[1, 2], p_out[2, 1] = c12, c12
    p_out[0, 3], p_out[3, 0] = c03, c03
    p_out[1, 3], p_out[3, 1] = c13, c13
    p_out[2, 3], p_out[3, 2] = c23, c23
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    x_out[0] = f00 * x0 + f01 * x1 + f02 * x2 + f03 * x3
    x_out[1] = f11 * x1 + f12 * x2 + f13 * x3
    x_out[2] = f22 * x2 + f23 * x3
    x_out[3] = f33 * x3


@jit_uncounted
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
    if 0 < steps <= phi.shape[0]:
        predict_axis(x, p, phi[steps - 1], q[steps - 1], x_out, p_out)
        return
    for i in range(4):
        x_out[i] = x[i]
        for j in range(4):
            p_out[i, j] = p[i, j]
    left = steps
    while left > 0:
        n = min(left, phi.shape[0])
        predict_axis(x_out, p_out, phi[n - 1], q[n - 1], x_out, p_out)
        left -= n


@jit_uncounted
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
    c0, c1, c2, c3 = p[0, state], p[1, state], p[2, state], p[3, state]
    g0, g1, g2, g3 = c0 / variance, c1 / variance, c2 / variance, c3 / variance
    x[0] += g0 * innovation
    x[1] += g1 * innovation
    x[2] += g2 * innovation
    x[3] += g3 * innovation
    p[0, 0] -= g0 * c0
    p[1, 1] -= g1 * c1
    p[2, 2] -= g2 * c2
    p[3, 3] -= g3 * c3
    p01, p02, p03 = p[0, 1] - g0 * c1, p[0, 2] - g0 * c2, p[0, 3] - g0 * c3
    p12, p13, p23 = p[1, 2] - g1 * c2, p[1, 3] - g1 * c3, p[2, 3] - g2 * c3
    p[0, 1], p[1, 0] = p01, p01
    p[0, 2], p[2, 0] = p02, p02
    p[0, 3], p[3, 0] = p03, p03
    p[1, 2], p[2, 1] = p12, p12
    p[1, 3], p[3, 1] = p13, p13
    p[2, 3], p[3, 2] = p23, p23


@jit_uncounted
def horizontal_distance(
    x: np.ndarray, p: np.ndarray, north: float, east: float, variance_north: float, variance_east: float
) -> float:
    """Return the squared Mahalanobis distance of a horizontal position from a predicted state (3, 4), (3, 4, 4)."""
    dn, de = north - x[0, 0], east - x[1, 0]
    distance: float = dn * dn / (p[0, 0, 0] + variance_north) + de * de / (p[1, 0, 0] + variance_east)
    return distance


@jit_uncounted
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


@jit_uncounted
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


@jit_uncounted
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


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, p = np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4))
    p[:] = np.eye(4)
    tables, noises = np.zeros((2, 1, 4, 4)), np.zeros((2, 1, 4, 4))
    tables[:], noises[:] = np.eye(4), np.eye(4)
    z, r, index, codes = np.zeros((1, 6)), np.ones((1, 6)), np.zeros(1, np.int64), np.zeros((1, 4), np.int64)
    use, nis, one = np.ones((1, 4), np.bool_), np.zeros((1, 4)), np.zeros(1)
    predict_axis(x[0, 0], p[0, 0], tables[0, 0], noises[0, 0], x[0, 0], p[0, 0])
    predict_steps(x[0, 0], p[0, 0], 1, tables[0], noises[0], x[0, 0], p[0, 0])
    predict_track(x[0], p[0], 1, tables, noises, x[0], p[0])
    update_axis(x[0, 0], p[0, 0], 0, 0.0, 1.0)
    horizontal_distance(x[0], p[0], 0.0, 0.0, 1.0, 1.0)
    predicted_distance(x[0], p[0], 1, tables, noises, 0.0, 0.0, 1.0, 0.0)
    update_track(x[0], p[0], z[0], r[0], use[0], 5.0, 0.0, codes[0], nis[0])
    filter_reports(x, p, index, index, index, tables, noises, z, r, use, 5.0, one, codes, nis)
