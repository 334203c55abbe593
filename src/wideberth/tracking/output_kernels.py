"""What a track says at a time: the filter's state predicted to it, plus the errors that do not average out."""

import math

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.kernels import predict_track


@jit_uncounted
def output_track(
    x: np.ndarray,
    p: np.ndarray,
    last: int,
    now: int,
    residual: float,
    dt: float,
    phi: np.ndarray,
    q: np.ndarray,
    bias: np.ndarray,
    latency: float,
    state: np.ndarray,
    cov: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    covariance: np.ndarray,
) -> float:
    """Predict one track to the time of the output and add what does not average out.

    Parameters
    ----------
    x, p : ndarray, shape (3, 4) and (3, 4, 4)
        The filter at its last update.
    last : int
        Internal step of that update.
    bias : ndarray, shape (2,)
    state, cov : ndarray, shape (3, 4) and (3, 4, 4)
        Buffers.
    position, velocity, acceleration : ndarray, shape (3,)
        Written.
    covariance : ndarray, shape (9, 9)
        Written where it is not zero.
    now, residual, dt, phi, q, latency
        As for `output_tracks`.

    Returns
    -------
    float
        The filter's own horizontal standard deviation (larger axis), without the bias, m.
    """
    steps = max(now - last, 0)
    remainder = residual + (now - last - steps) * dt
    predict_track(x, p, steps, phi, q, state, cov)
    for axis in range(3):
        v, a = state[axis, 1], state[axis, 2]
        position[axis] = state[axis, 0] + remainder * (v + 0.5 * remainder * a)
        velocity[axis] = v + remainder * a
        acceleration[axis] = a
        for m in range(3):
            for n in range(3):
                covariance[axis + 3 * m, axis + 3 * n] = cov[axis, m, n]
    covariance[0, 0] += bias[0]
    covariance[1, 1] += bias[0]
    covariance[2, 2] += bias[1]
    late = latency * latency
    covariance[0, 0] += late * velocity[0] * velocity[0]
    covariance[1, 1] += late * velocity[1] * velocity[1]
    covariance[0, 1] = covariance[1, 0] = late * velocity[0] * velocity[1]
    return math.sqrt(max(cov[0, 0, 0], cov[1, 0, 0]))


@jit_uncounted
def output_motion(
    i: int,
    x: np.ndarray,
    p: np.ndarray,
    steps: int,
    residual: float,
    phi: np.ndarray,
    q: np.ndarray,
    bias: np.ndarray,
    latency: float,
    position: np.ndarray,
    velocity: np.ndarray,
    covariance: np.ndarray,
) -> float:
    """Write position, velocity and their covariance of track `i`, as `output_track` does, in a fraction of its time.

    Parameters
    ----------
    i : int
    x, p : ndarray, shape (n, 3, 4), (n, 3, 4, 4)
    steps : int
        Internal steps since its last update, 1 to as many as the tables hold.
    position, velocity, covariance : ndarray, shape (n, 3), (n, 3), (n, 9, 9)
        Written at `i`.
    residual, phi, q, bias, latency
        As for `output_track`.

    Returns
    -------
    float
        As of `output_track`.
    """
    widest = 0.0
    k = steps - 1
    for axis in range(3):
        table = 1 if axis == 2 else 0
        f00, f01, f02, f03 = phi[table, k, 0, 0], phi[table, k, 0, 1], phi[table, k, 0, 2], phi[table, k, 0, 3]
        f11, f12, f13 = phi[table, k, 1, 1], phi[table, k, 1, 2], phi[table, k, 1, 3]
        s1, s2, s3 = x[i, axis, 1], x[i, axis, 2], x[i, axis, 3]
        v = f11 * s1 + f12 * s2 + f13 * s3
        a = phi[table, k, 2, 2] * s2 + phi[table, k, 2, 3] * s3
        place = f00 * x[i, axis, 0] + f01 * s1 + f02 * s2 + f03 * s3
        position[i, axis] = place + residual * (v + 0.5 * residual * a)
        velocity[i, axis] = v + residual * a
        # The products of the first two rows: the model is upper triangular, the covariance symmetric.
        c00, c01, c02, c03 = p[i, axis, 0, 0], p[i, axis, 0, 1], p[i, axis, 0, 2], p[i, axis, 0, 3]
        c11, c12, c13 = p[i, axis, 1, 1], p[i, axis, 1, 2], p[i, axis, 1, 3]
        c22, c23, c33 = p[i, axis, 2, 2], p[i, axis, 2, 3], p[i, axis, 3, 3]
        h0 = f00 * c00 + f01 * c01 + f02 * c02 + f03 * c03
        h1 = f00 * c01 + f01 * c11 + f02 * c12 + f03 * c13
        h2 = f00 * c02 + f01 * c12 + f02 * c22 + f03 * c23
        h3 = f00 * c03 + f01 * c13 + f02 * c23 + f03 * c33
        g1 = f11 * c11 + f12 * c12 + f13 * c13
        g2 = f11 * c12 + f12 * c22 + f13 * c23
        g3 = f11 * c13 + f12 * c23 + f13 * c33
        own = h0 * f00 + h1 * f01 + h2 * f02 + h3 * f03 + q[table, k, 0, 0]
        cross = h1 * f11 + h2 * f12 + h3 * f13 + q[table, k, 0, 1]
        covariance[i, axis, axis] = own + bias[table]
        covariance[i, axis, axis + 3] = cross
        covariance[i, axis + 3, axis] = cross
        covariance[i, axis + 3, axis + 3] = g1 * f11 + g2 * f12 + g3 * f13 + q[table, k, 1, 1]
        if axis < 2:
            widest = max(widest, own)
    late = latency * latency
    vn, ve = velocity[i, 0], velocity[i, 1]
    covariance[i, 0, 0] += late * vn * vn
    covariance[i, 1, 1] += late * ve * ve
    covariance[i, 0, 1] = late * vn * ve
    covariance[i, 1, 0] = late * vn * ve
    return math.sqrt(widest)


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
    state, cov = np.empty((3, 4)), np.empty((3, 4, 4))
    for i in range(slots.shape[0]):
        k = slots[i]
        spread[i] = output_track(
            x[k], p[k], last[k], now, residual, dt, phi, q, bias[k], latency, state, cov,
            position[i], velocity[i], acceleration[i], covariance[i],
        )  # fmt: skip


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, p, covariance = np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4)), np.zeros((1, 9, 9))
    p[:] = np.eye(4)
    tables, noises = np.zeros((2, 1, 4, 4)), np.zeros((2, 1, 4, 4))
    tables[:], noises[:] = np.eye(4), np.eye(4)
    index, one, three = np.zeros(1, np.int64), np.zeros(1), np.zeros((1, 3))
    output_motion(0, x, p, 1, 0.0, tables, noises, np.zeros(2), 0.0, three, three, covariance)
    output_tracks(
        x, p, index, index, 0, 0.0, 0.1, tables, noises, np.zeros((1, 2)), 0.0, three, three, three, covariance, one,
    )  # fmt: skip
