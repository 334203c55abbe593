"""Hypotheses of the turning model (thesis (3.48)) from a few plots: the Gauss-Newton method of thesis 3.2.3.

The state is that of an aircraft at one time, the *ending* time: position (3, NED), speed, course, flight path angle,
and their three rates. Plots come from other times, before it as a rule, and other places of the sensor.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, solve_cholesky
from wideberth.tracking.radar_kernels import plot_jacobian, to_plot, to_sensor, wrap

FloatArray = NDArray[np.float64]

NOT_CONVERGED, CONVERGED, SINGULAR = 0, 1, 2

STEP_S = 1.0
"""Longest stretch of path that is integrated by one application of Simpson's rule: with 30 deg/s good to 2e-5."""
STEEPEST_RAD = math.radians(89.999)
"""Flight path angles beyond 90 deg are set to this (thesis 3.3.5): at 90 deg the course has no meaning."""
_AWAY_M = 1.0

WORK_ROWS = 30
"""Rows of the (rows, 9) work array of `fit_turning`."""


@jit_uncounted
def position_at(x: FloatArray, t: float, out: FloatArray, jacobian: FloatArray) -> None:
    """Write where an aircraft in the ending state `x` is `t` seconds later (negative: earlier), and the derivatives.

    Thesis (3.14) and the products C A ... A of (3.24) in one: the speed and the angles are linear in time, so that only
    the positions need an integral.

    Parameters
    ----------
    x : ndarray, shape (9,)
    t : float
        s.
    out : ndarray, shape (3,)
        Position, NED.
    jacobian : ndarray, shape (3, 9)
    """
    for i in range(3):
        out[i] = x[i]
        for j in range(9):
            jacobian[i, j] = 1.0 if i == j else 0.0
    pieces = max(math.ceil(abs(t) / STEP_S), 1)
    half = t / (2 * pieces)
    for k in range(2 * pieces + 1):
        weight = half / 3.0
        if 0 < k < 2 * pieces:
            weight *= 4.0 if k % 2 == 1 else 2.0
        s = k * half
        speed, course, gamma = x[3] + s * x[6], x[4] + s * x[7], x[5] + s * x[8]
        cc, sc, cg, sg = math.cos(course), math.sin(course), math.cos(gamma), math.sin(gamma)
        out[0] += weight * speed * cc * cg
        out[1] += weight * speed * sc * cg
        out[2] -= weight * speed * sg
        for rate in range(2):
            w, first = (weight, 3) if rate == 0 else (weight * s, 6)
            jacobian[0, first] += w * cc * cg
            jacobian[1, first] += w * sc * cg
            jacobian[2, first] -= w * sg
            jacobian[0, first + 1] -= w * speed * sc * cg
            jacobian[1, first + 1] += w * speed * cc * cg
            jacobian[0, first + 2] -= w * speed * cc * sg
            jacobian[1, first + 2] -= w * speed * sc * sg
            jacobian[2, first + 2] -= w * speed * cg


@jit_uncounted
def correct_state(x: FloatArray) -> None:
    """Bring a state back to speeds above zero, courses in [-pi, pi) and path angles within 90 deg (thesis (3.44)).

    The signs of the path angle and of its and the speed's rates change with that of the speed, which leaves the path as
    it is; as printed (speed and course only) a climb would become a descent.
    """
    if x[3] < 0.0:
        x[3] = -x[3]
        x[4] += math.pi
        x[5], x[6], x[8] = -x[5], -x[6], -x[8]
    x[4] = wrap(x[4])
    if abs(x[5]) > 0.5 * math.pi:
        x[5] = math.copysign(STEEPEST_RAD, x[5])


@jit_uncounted
def _normal_equations(
    plots: FloatArray,
    times: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    weight: FloatArray,
    start: FloatArray,
    prior: FloatArray,
    x: FloatArray,
    a: FloatArray,
    b: FloatArray,
    work: FloatArray,
) -> None:
    position, seen, plot = work[0, 0:3], work[0, 3:6], work[0, 6:9]
    row, jacobian, c = work[1], work[2:5], work[5:8]
    for i in range(9):
        error = start[i] - x[i]
        b[i] = prior[i] * (wrap(error) if i == 4 else error)
        for j in range(9):
            a[i, j] = prior[i] if i == j else 0.0
    for k in range(len(times)):
        position_at(x, times[k], position, jacobian)
        to_sensor(sensor[k], attitude[k], position, seen)
        to_plot(seen, plot)
        plot_jacobian(seen, attitude[k], c)
        for element in range(3):
            error = plots[k, element] - plot[element]
            if element == 1:
                error = wrap(error)
            if math.isnan(error):
                continue
            for j in range(9):
                row[j] = (
                    c[element, 0] * jacobian[0, j] + c[element, 1] * jacobian[1, j] + c[element, 2] * jacobian[2, j]
                )
            for i in range(9):
                b[i] += weight[element] * row[i] * error
                for j in range(i + 1):
                    a[i, j] += weight[element] * row[i] * row[j]
    for i in range(9):
        for j in range(i):
            a[j, i] = a[i, j]


@jit_uncounted
def _factor(a: FloatArray, scale: FloatArray, scaled: FloatArray, factor: FloatArray) -> bool:
    """Factor the normal equations with each state scaled to a unit diagonal: metres and rad/s differ by 1e8."""
    for i in range(9):
        if not a[i, i] > 0.0:
            return False
        scale[i] = 1.0 / math.sqrt(a[i, i])
    for i in range(9):
        for j in range(9):
            scaled[i, j] = a[i, j] * scale[i] * scale[j]
    return cholesky(scaled, 9, factor)


@jit_uncounted
def fit_turning(
    plots: FloatArray,
    times: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    start: FloatArray,
    limits: FloatArray,
    prior: FloatArray,
    tolerance: float,
    max_iterations: int,
    use_noise: bool,
    x: FloatArray,
    p: FloatArray,
    work: FloatArray,
) -> tuple[int, int]:
    """Fit the turning model to plots as `gauss_newton`, in buffers of the caller.

    Parameters
    ----------
    plots, times, sensor, attitude, sigma, start, limits, prior, tolerance, max_iterations, use_noise
        As of `gauss_newton`.
    x : ndarray, shape (9,)
        Written: the state.
    p : ndarray, shape (9, 9)
        Written: its covariance.
    work : ndarray, shape (30, 9)
        Written over.

    Returns
    -------
    status : int
        `CONVERGED`, `NOT_CONVERGED` or `SINGULAR`.
    iterations : int
    """
    rows, factor, scaled = work[0:8], work[8:17], work[17:26]
    weight, b, scale = work[26], work[27], work[28]
    for element in range(3):
        weight[element] = 1.0 / (sigma[element] * sigma[element]) if use_noise else 1.0
    for i in range(9):
        x[i] = start[i]
    status, iterations = NOT_CONVERGED, 0
    while iterations < max_iterations and status == NOT_CONVERGED:
        _normal_equations(plots, times, sensor, attitude, weight, start, prior, x, p, b, rows)
        regular = _factor(p, scale, scaled, factor)
        if not regular and iterations == 0:
            # Straight above a sensor the angles have no derivatives: step aside (errata, "R-RANSAC and ER-RANSAC").
            x[0] += _AWAY_M
            x[1] += _AWAY_M
            _normal_equations(plots, times, sensor, attitude, weight, start, prior, x, p, b, rows)
            regular = _factor(p, scale, scaled, factor)
        iterations += 1
        if not regular:
            status = SINGULAR
            break
        for i in range(9):
            b[i] *= scale[i]
        solve_cholesky(factor, 9, b)
        total = 0.0
        for i in range(9):
            step = b[i] * scale[i]
            step = min(max(step, -limits[i]), limits[i])
            x[i] += step
            total += abs(step)
        if not math.isfinite(total):
            status = SINGULAR
            break
        correct_state(x)
        if total < tolerance:
            status = CONVERGED
    if status != SINGULAR:
        # (3.42): the inverse, column by column, of the equations that were factored last.
        for j in range(9):
            column = rows[j % 8]
            for i in range(9):
                column[i] = scale[j] if i == j else 0.0
            solve_cholesky(factor, 9, column)
            for i in range(9):
                p[i, j] = column[i] * scale[i]
    else:
        for i in range(9):
            for j in range(9):
                p[i, j] = math.nan
    return status, iterations


@jit
def gauss_newton(
    plots: FloatArray,
    times: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    start: FloatArray,
    limits: FloatArray,
    prior: FloatArray,
    tolerance: float,
    max_iterations: int,
    use_noise: bool,
) -> tuple[bool, int, FloatArray, FloatArray]:
    """Find the ending state whose path passes the plots (thesis (3.12)-(3.44)).

    Three plots of range, azimuth and elevation make the nine states observable (thesis 3.3.3); more are fitted by least
    squares. Three differences from the print: the path backwards in time is integrated, not taken in steps of Euler;
    the process noise of (3.29) is left out (through three plots it changes only the covariance, and the filter that
    smooths afterwards adds it); and a start straight above the sensor, where the equations are singular, is moved
    aside by a metre (errata).

    Parameters
    ----------
    plots : ndarray, shape (m, 3)
        Range (m), azimuth and elevation (rad) in the sensor's frame; NaN where not measured.
    times : ndarray, shape (m,)
        Of the plots from the ending time, s: zero or less.
    sensor : ndarray, shape (m, 3)
        Position of the sensor at each plot, NED, m.
    attitude : ndarray, shape (m, 3, 3)
        C_ned_sensor at each plot.
    sigma : ndarray, shape (3,)
        Standard deviations of range, azimuth and elevation.
    start : ndarray, shape (9,)
        Where the iteration starts; also the mean of the prior.
    limits : ndarray, shape (9,)
        Longest step of each state in an iteration (3.43); infinity for none.
    prior : ndarray, shape (9,)
        1/variance of each state about `start`; 0 for none. It needs `use_noise`: without it the equations of plots have
        the units of the plots.
    tolerance : float
        Converged once the sum of the steps of all states, in SI units, is below this (tau_GN).
    max_iterations : int
    use_noise : bool
        Weigh the plots by their variances, (3.41); else least squares, (3.40), whose matrix ``p`` is no covariance.

    Returns
    -------
    converged : bool
    iterations : int
    x : ndarray, shape (9,)
        The state after the last step, converged or not.
    p : ndarray, shape (9, 9)
        (3.42); NaN where the equations became singular.
    """
    x, p = np.empty(9), np.empty((9, 9))
    status, iterations = fit_turning(
        plots,
        times,
        sensor,
        attitude,
        sigma,
        start,
        limits,
        prior,
        tolerance,
        max_iterations,
        use_noise,
        x,
        p,
        np.empty((WORK_ROWS, 9)),
    )
    return status == CONVERGED, iterations, x, p


def warmup() -> None:
    """Compile what Python calls."""
    position_at(np.ones(9), -1.5, np.zeros(3), np.zeros((3, 9)))
    correct_state(np.ones(9))
    plots = np.array([[100.0, 0.1, 0.2], [110.0, 0.2, 0.2], [125.0, 0.25, 0.2]])
    start = np.array([90.0, 10.0, -20.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    eye = np.tile(np.eye(3), (3, 1, 1))
    args = (plots, -np.arange(3.0), np.zeros((3, 3)), eye, np.ones(3), start, np.full(9, np.inf), np.zeros(9))
    gauss_newton(*args, 1e-9, 5, True)
    fit_turning(*args, 1e-9, 5, True, np.zeros(9), np.zeros((9, 9)), np.zeros((WORK_ROWS, 9)))
