"""Unscented prediction and update: the plots of a radar in any pose, with any motion model.

Sigma points and weights are van der Merwe's scaled ones (2 n + 1 points, parameters alpha, beta, kappa). Points are
drawn afresh from the predicted covariance, process noise included, before each update.

The course of the turning model is a number that runs on, not an angle in a circle, so its mean needs no care; azimuths
are averaged about that of the centre point.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, log_determinant, whitened_square
from wideberth.tracking.motion_kernels import (
    CONSTANT_ACCELERATION,
    CONSTANT_VELOCITY,
    TURNING,
    add_process_noise,
    path_velocity,
    propagate,
    state_count,
)
from wideberth.tracking.radar_kernels import range_rate, to_plot, to_sensor, wrap
from wideberth.tracking.update_kernels import LOG_2PI

FloatArray = NDArray[np.float64]

POINT_ROWS = 19
"""Rows of the buffer of sigma points: 2 n + 1 for the nine states of the largest model."""

WORK_ROWS = 26
"""Rows (of 9) of the work buffer."""

# Where the parts of the work buffer start.
_FACTOR, _CROSS, _SPREAD, _SPREAD_FACTOR, _MEAN, _INNOVATION, _VARIANCE, _WHITENED, _SIX = (
    0,
    9,
    13,
    17,
    21,
    22,
    23,
    24,
    25,
)


@jit_uncounted
def centre_weights(n: int, alpha: float, beta: float, kappa: float) -> tuple[float, float, float, float]:
    """Return the scale n + lambda, the weights of the centre in mean and covariance, and that of every other point."""
    scale = alpha * alpha * (n + kappa)
    mean = (scale - n) / scale
    return scale, mean, mean + 1.0 - alpha * alpha + beta, 0.5 / scale


@jit_uncounted
def sigma_points(n: int, scale: float, x: FloatArray, p: FloatArray, points: FloatArray, factor: FloatArray) -> bool:
    """Write the 2 n + 1 sigma points; return False where the covariance is not positive definite."""
    if not cholesky(p, n, factor):
        return False
    root = math.sqrt(scale)
    for i in range(n):
        points[0, i] = x[i]
    for k in range(n):
        for i in range(n):
            step = root * factor[i, k] if i >= k else 0.0
            points[1 + k, i] = x[i] + step
            points[1 + n + k, i] = x[i] - step
    return True


@jit_uncounted
def unscented_predict(
    model: int,
    dt: float,
    q: FloatArray,
    scaling: FloatArray,
    x: FloatArray,
    p: FloatArray,
    points: FloatArray,
    work: FloatArray,
) -> bool:
    """Take state and covariance `dt` further in place, through sigma points.

    Parameters
    ----------
    model : int
        See `motion_kernels`.
    dt : float
        s; may be negative.
    q : ndarray, shape (3,)
        Spectral densities, as for `motion_kernels.add_process_noise`.
    scaling : ndarray, shape (3,)
        alpha, beta and kappa.
    x : ndarray, shape (n,)
    p : ndarray, shape (n, n)
    points : ndarray, shape (POINT_ROWS, 9)
        Written over.
    work : ndarray, shape (WORK_ROWS, 9)
        Written over.

    Returns
    -------
    bool
        False, with `x` and `p` as they were, where the covariance is not positive definite.
    """
    n = state_count(model)
    scale, centre_mean, centre_covariance, other = centre_weights(n, scaling[0], scaling[1], scaling[2])
    if not sigma_points(n, scale, x, p, points, work[_FACTOR : _FACTOR + 9]):
        return False
    for k in range(2 * n + 1):
        propagate(model, dt, points[k], points[k])
    for i in range(n):
        total = centre_mean * points[0, i]
        for k in range(1, 2 * n + 1):
            total += other * points[k, i]
        x[i] = total
    for i in range(n):
        for j in range(i + 1):
            total = centre_covariance * (points[0, i] - x[i]) * (points[0, j] - x[j])
            for k in range(1, 2 * n + 1):
                total += other * (points[k, i] - x[i]) * (points[k, j] - x[j])
            p[i, j] = total
            p[j, i] = total
    add_process_noise(model, dt, q, p)
    return True


@jit_uncounted
def measure(
    model: int,
    x: FloatArray,
    sensor: FloatArray,
    sensor_velocity: FloatArray,
    attitude: FloatArray,
    six: FloatArray,
    out: FloatArray,
) -> None:
    """Write range, azimuth, elevation and range rate (4) of a state of any model; `six` (6) is written over."""
    for i in range(3):
        six[i] = x[i]
    if model == TURNING:
        path_velocity(x[3], x[4], x[5], six[3:6])
    else:
        for i in range(3, 6):
            six[i] = x[i]
    out[3] = range_rate(sensor, sensor_velocity, six)
    to_sensor(sensor, attitude, six, six[3:6])
    to_plot(six[3:6], out)


@jit_uncounted
def unscented_update(
    model: int,
    scaling: FloatArray,
    x: FloatArray,
    p: FloatArray,
    sensor: FloatArray,
    sensor_velocity: FloatArray,
    attitude: FloatArray,
    plot: FloatArray,
    variance: FloatArray,
    points: FloatArray,
    seen: FloatArray,
    work: FloatArray,
) -> tuple[float, float]:
    """Update state and covariance in place with one plot.

    Parameters
    ----------
    model : int
        See `motion_kernels`.
    scaling : ndarray, shape (3,)
        alpha, beta and kappa.
    x : ndarray, shape (n,)
    p : ndarray, shape (n, n)
    sensor, sensor_velocity : ndarray, shape (3,)
        Of the radar, NED, m and m/s.
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    plot : ndarray, shape (4,)
        Range (m), azimuth, elevation (rad) and range rate (m/s); NaN: not measured.
    variance : ndarray, shape (4,)
        Of the elements of the plot, which err independently.
    points : ndarray, shape (POINT_ROWS, 9)
        Written over.
    seen : ndarray, shape (POINT_ROWS, 4)
        Written over: what the radar would measure of each point.
    work : ndarray, shape (WORK_ROWS, 9)
        Written over.

    Returns
    -------
    nis : float
        Normalised innovation squared; NaN, with `x` and `p` as they were, where a covariance is not positive definite.
    log_likelihood : float
    """
    n = state_count(model)
    scale, _, centre_covariance, other = centre_weights(n, scaling[0], scaling[1], scaling[2])
    if not sigma_points(n, scale, x, p, points, work[_FACTOR : _FACTOR + 9]):
        return math.nan, math.nan
    for k in range(2 * n + 1):
        measure(model, points[k], sensor, sensor_velocity, attitude, work[_SIX], seen[k])
    # Measured elements move to the front, each relative to the centre point, angles wrapped.
    mean, innovation, whitened, variances = work[_MEAN], work[_INNOVATION], work[_WHITENED], work[_VARIANCE]
    m = 0
    for element in range(4):
        if math.isnan(plot[element]):
            continue
        angle = element == 1 or element == 2
        centre = seen[0, element]
        offset = plot[element] - centre
        total = 0.0
        for k in range(1, 2 * n + 1):
            difference = seen[k, element] - centre
            if angle:
                difference = wrap(difference)
            seen[k, m] = difference
            total += other * difference
        seen[0, m] = 0.0
        mean[m] = total
        innovation[m] = wrap(offset - total) if angle else offset - total
        variances[m] = variance[element]
        m += 1
    spread, factor = work[_SPREAD : _SPREAD + 4], work[_SPREAD_FACTOR : _SPREAD_FACTOR + 4]
    for a in range(m):
        for b in range(a + 1):
            total = centre_covariance * mean[a] * mean[b]
            for k in range(1, 2 * n + 1):
                total += other * (seen[k, a] - mean[a]) * (seen[k, b] - mean[b])
            spread[a, b] = total
            spread[b, a] = total
        spread[a, a] += variances[a]
    if not cholesky(spread, m, factor):
        return math.nan, math.nan
    nis = whitened_square(factor, m, innovation, whitened)
    log_likelihood = -0.5 * (nis + log_determinant(factor, m) + m * LOG_2PI)
    # Row a of `cross` becomes row a of L^-1 (cross covariance)': then K y and K S K' need no inverse.
    cross = work[_CROSS : _CROSS + 4]
    for i in range(n):
        for a in range(m):
            total = 0.0
            for k in range(1, 2 * n + 1):
                total += other * (points[k, i] - x[i]) * (seen[k, a] - mean[a])
            for b in range(a):
                total -= factor[a, b] * cross[b, i]
            cross[a, i] = total / factor[a, a]
    for i in range(n):
        for a in range(m):
            x[i] += cross[a, i] * whitened[a]
        for j in range(i + 1):
            for a in range(m):
                p[i, j] -= cross[a, i] * cross[a, j]
            p[j, i] = p[i, j]
    return nis, log_likelihood


def warmup() -> None:
    """Compile what Python calls."""
    scaling, zero, eye = np.array([0.5, 2.0, 0.0]), np.zeros(3), np.eye(3)
    points, seen, work = np.zeros((POINT_ROWS, 9)), np.zeros((POINT_ROWS, 4)), np.zeros((WORK_ROWS, 9))
    for model in (CONSTANT_VELOCITY, CONSTANT_ACCELERATION, TURNING):
        n = state_count(model)
        x, p = np.ones(n), np.eye(n)
        unscented_predict(model, 0.1, np.ones(3), scaling, x, p, points, work)
        unscented_update(model, scaling, x, p, zero, zero, eye, np.ones(4), np.ones(4), points, seen, work)
