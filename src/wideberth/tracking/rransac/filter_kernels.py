"""One stored track of R-RANSAC: prediction, what the radar should see of it, and its update with a plot."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, congruence, log_determinant
from wideberth.tracking.motion_kernels import TURNING, predict, propagate, state_count, transition
from wideberth.tracking.radar_kernels import directions, plot_jacobian, to_plot, to_sensor, wrap
from wideberth.tracking.rransac.state_kernels import POLAR, PSEUDO, UNSCENTED, Scan, Settings, Work
from wideberth.tracking.unscented_kernels import unscented_predict, unscented_update
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]


# Not inlined where it is called, as few use it.
@jit
def _predict_unscented(s: Settings, model: int, dt: float, x: FloatArray, p: FloatArray, work: Work) -> bool:
    return unscented_predict(model, dt, s.spectral, s.scaling, x, p, work.points, work.unscented)


@jit_uncounted
def predict_track(s: Settings, model: int, dt: float, x: FloatArray, p: FloatArray, work: Work) -> None:
    """Take a state and covariance `dt` further: the full discrete step (errata to thesis (4.8) and (3.5))."""
    # A covariance that has no sigma points is predicted as it is; gating then finds it unsound.
    if s.update != UNSCENTED or not _predict_unscented(s, model, dt, x, p, work):
        predict(model, dt, s.spectral, x, p, work.f, work.square)
    for i in range(state_count(model)):
        p[i, i] += s.process_per_s[i] * dt
    if s.dimensions == 2:
        hold_altitude(s, model, x, p)
    if model == TURNING:
        x[4] = wrap(x[4])


@jit_uncounted
def retrace_track(model: int, dt: float, x: FloatArray, p: FloatArray, work: Work) -> None:
    """Take a state and covariance to an earlier time, `dt` below zero, as they describe the path and no noise."""
    n = state_count(model)
    transition(model, dt, x, work.f)
    congruence(work.f, p, n, n, work.square, p)
    propagate(model, dt, x, x)


@jit_uncounted
def hold_altitude(s: Settings, model: int, x: FloatArray, p: FloatArray) -> None:
    """Put the vertical states of a two-dimensional tracker to the known altitude, without uncertainty (thesis 5.3)."""
    for k in range(2, state_count(model), 3):
        x[k] = -s.altitude if k == 2 else 0.0
        for i in range(state_count(model)):
            p[i, k] = 0.0
            p[k, i] = 0.0


@jit_uncounted
def expected_plot(x: FloatArray, sensor: FloatArray, attitude: FloatArray, seen: FloatArray, out: FloatArray) -> None:
    """Write range, azimuth and elevation of a state, and the position in the sensor's axes (3)."""
    to_sensor(sensor, attitude, x, seen)
    to_plot(seen, out)


@jit_uncounted
def tangent_variances(distance: float, elevation: float, sigma: FloatArray, out: FloatArray) -> None:
    """Write the variances (3, m2) of a plot along the line of sight, across it, and across it up.

    Near the zenith an error of the azimuth moves a plot no less than the error of the elevation lets it.
    """
    ground = max(abs(math.cos(elevation)), math.sin(min(sigma[2], 1.5)))
    out[0] = sigma[0] * sigma[0]
    out[1] = (distance * ground * sigma[1]) ** 2
    out[2] = (distance * sigma[2]) ** 2


@jit_uncounted
def prepare_gate(s: Settings, i: int, x: FloatArray, p: FloatArray, scan: Scan, work: Work) -> bool:
    """Write what gating needs of track `i`: expected plot, axes, and the innovation covariance; False if unsound."""
    seen = work.rows[0, 0:3]
    expected = work.predicted[i]
    expected_plot(x, scan.sensor, scan.attitude, seen, expected)
    directions(scan.attitude, expected[1], expected[2], work.axes[i])
    tangent_variances(expected[0], expected[2], scan.sigma, work.variance[i])
    congruence(work.axes[i], p, 3, 3, work.square, work.f)
    for k in range(3):
        work.f[k, k] += work.variance[i, k]
    sound = cholesky(work.f, 3, work.factor[i])
    work.score[i] = log_determinant(work.factor[i], 3) if sound else math.nan
    return sound


@jit_uncounted
def gate_distance(s: Settings, i: int, x: FloatArray, position: FloatArray, work: Work) -> float:
    """Return the squared Mahalanobis distance of a plot's position from track `i`; in two dimensions without height."""
    axes, factor = work.axes[i], work.factor[i]
    n, e, d = position[0] - x[0], position[1] - x[1], position[2] - x[2]
    square = 0.0
    a = (axes[0, 0] * n + axes[0, 1] * e + axes[0, 2] * d) / factor[0, 0]
    square = a * a
    if square > s.gate_square:
        return float(square)
    b = (axes[1, 0] * n + axes[1, 1] * e + axes[1, 2] * d - factor[1, 0] * a) / factor[1, 1]
    square += b * b
    if s.dimensions == 2:
        return float(square)
    c = axes[2, 0] * n + axes[2, 1] * e + axes[2, 2] * d - factor[2, 0] * a - factor[2, 1] * b
    c /= factor[2, 2]
    return float(square + c * c)


@jit_uncounted
def inside_box(
    s: Settings, box: FloatArray, sigma: FloatArray, plot: FloatArray, expected: FloatArray
) -> tuple[bool, float]:
    """Return whether each element is within its threshold (thesis (3.10), (3.45)), and the sum of squares in sigma."""
    a = (plot[0] - expected[0]) / sigma[0]
    b = wrap(plot[1] - expected[1]) / sigma[1]
    c = 0.0 if s.dimensions == 2 else (plot[2] - expected[2]) / sigma[2]
    return abs(a) < box[0] and abs(b) < box[1] and abs(c) < box[2], a * a + b * b + c * c


@jit
def _unscented(
    s: Settings,
    model: int,
    x: FloatArray,
    p: FloatArray,
    plot: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    work: Work,
) -> float:
    """Update a state with range and angles through sigma points; return the normalised innovation."""
    four, variance, standing = work.rows[5, 0:4], work.rows[6, 0:4], work.rows[7, 0:3]
    for k in range(3):
        four[k] = plot[k]
        variance[k] = sigma[k] * sigma[k]
        standing[k] = 0.0
    four[3] = math.nan
    nis, _ = unscented_update(
        model, s.scaling, x, p, sensor, standing, attitude, four, variance, work.points, work.seen, work.unscented
    )
    return nis


@jit_uncounted
def update_track(
    s: Settings,
    model: int,
    x: FloatArray,
    p: FloatArray,
    plot: FloatArray,
    position: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    work: Work,
) -> float:
    """Update a state with one plot, given as range and angles and as position; return the normalised innovation."""
    n = state_count(model)
    if s.update == UNSCENTED:
        return _unscented(s, model, x, p, plot, sensor, attitude, sigma, work)
    seen, expected, axes = work.rows[0, 0:3], work.rows[1, 0:3], work.rows[2:5, 0:3]
    innovation, variance, h = work.rows[5, 0:3], work.rows[6, 0:3], work.h
    for k in range(3):
        for j in range(n):
            h[k, j] = 0.0
    if s.update == PSEUDO:
        for k in range(3):
            h[k, k] = 1.0
            innovation[k] = position[k] - x[k]
            variance[k] = s.fixed_variance[k]
    else:
        expected_plot(x, sensor, attitude, seen, expected)
        if s.update == POLAR:
            plot_jacobian(seen, attitude, axes)
            for k in range(3):
                innovation[k] = plot[k] - expected[k]
                variance[k] = sigma[k] * sigma[k]
            innovation[1] = wrap(innovation[1])
        else:
            directions(attitude, expected[1], expected[2], axes)
            tangent_variances(expected[0], expected[2], sigma, variance)
            for k in range(3):
                innovation[k] = 0.0
                for j in range(3):
                    innovation[k] += axes[k, j] * (position[j] - x[j])
        for k in range(3):
            for j in range(3):
                h[k, j] = axes[k, j]
    if s.dimensions == 2:
        innovation[2] = math.nan
    nis, _ = update(n, 3, x, p, h, innovation, variance, work.rows[7:9])
    if s.dimensions == 2:
        hold_altitude(s, model, x, p)
    return nis


@jit_uncounted
def is_visible(scan: Scan, expected: FloatArray) -> bool:
    """Return whether a sensor could see what it expects at this range and these angles."""
    return bool(
        expected[0] <= scan.range_max
        and abs(expected[1]) <= scan.azimuth_half
        and abs(expected[2]) <= scan.elevation_half
    )


def warmup() -> None:
    """Compile a part: the rest is called by `scan_kernels` alone, and compiled with it."""
    tangent_variances(100.0, 0.1, np.ones(3), np.zeros(3))
