"""The Gauss-Newton hypotheses of the turning model, against numerical integration, SciPy, and the example's errata."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from wideberth.tracking.gauss_newton_kernels import correct_state, gauss_newton, position_at

DEG = math.radians(1.0)
# The example of thesis 3.3.4, with down for altitude.
TRUE = np.array([80.0, 60.0, -110.0, 14.0, -50 * DEG, -2 * DEG, 1.3, -6 * DEG, 3 * DEG])
TIMES = np.array([0.0, -1.5, -3.9])
PRINTED_START = np.array([0.0, 0.0, -200.0, 15.0, 0.0, 0.0, 0.0, 0.0, 0.0])
LIMITS = np.array([1000.0, 1000.0, 1000.0, 50.0, 20 * DEG, 5 * DEG, 0.2, DEG, DEG])
SIGMA = np.array([0.4, DEG, DEG])
FREE = np.full(9, np.inf)
NONE = np.zeros(9)


def path(x, t):
    """Position at `t` by a numerical solver."""

    def velocity(s, _):
        v, chi, gamma = x[3:6] + s * x[6:9]
        return [v * math.cos(chi) * math.cos(gamma), v * math.sin(chi) * math.cos(gamma), -v * math.sin(gamma)]

    return solve_ivp(velocity, (0.0, t), x[:3], rtol=1e-10, atol=1e-10).y[:, -1]


def plot_of(position, sensor, attitude):
    n, e, d = attitude.T @ (position - sensor)
    return np.array([math.sqrt(n * n + e * e + d * d), math.atan2(e, n), math.atan2(-d, math.hypot(n, e))])


def plots_of(x, times, sensor=None, attitude=None):
    sensor = np.zeros((len(times), 3)) if sensor is None else sensor
    attitude = np.tile(np.eye(3), (len(times), 1, 1)) if attitude is None else attitude
    plots = np.array([plot_of(path(x, t), s, a) for t, s, a in zip(times, sensor, attitude, strict=True)])
    return plots, sensor, attitude


def fit(plots, sensor, attitude, *, start=PRINTED_START, limits=LIMITS, prior=NONE, times=TIMES, most=60, noise=True):
    return gauss_newton(plots, times, sensor, attitude, SIGMA, start, limits, prior, 1e-10, most, noise)


@pytest.mark.parametrize("t", [0.0, -0.1, -2.7, -15.0, 4.0])
def test_positions_are_integrals_of_the_velocity(t):
    position, jacobian = np.zeros(3), np.zeros((3, 9))
    position_at(TRUE, t, position, jacobian)
    np.testing.assert_allclose(position, path(TRUE, t), atol=1e-4)
    for j in range(9):
        step = np.zeros(9)
        step[j] = 1e-5
        up, down = np.zeros(3), np.zeros(3)
        position_at(TRUE + step, t, up, np.zeros((3, 9)))
        position_at(TRUE - step, t, down, np.zeros((3, 9)))
        np.testing.assert_allclose(jacobian[:, j], (up - down) / 2e-5, atol=1e-5)


def test_a_state_is_corrected_without_a_change_of_path():
    x = np.array([1.0, 2.0, 3.0, -14.0, 170 * DEG, 10 * DEG, 0.5, 0.1, 0.05])
    corrected = x.copy()
    correct_state(corrected)
    assert corrected[3] == 14.0
    assert -math.pi <= corrected[4] < math.pi
    for t in (0.0, -2.0):
        np.testing.assert_allclose(path(corrected, t), path(x, t), atol=1e-9)
    corrected[5] = 2.0
    correct_state(corrected)
    assert corrected[5] == math.radians(89.999)


def test_the_state_is_found_from_exact_plots_of_a_moving_and_tilted_sensor():
    rng = np.random.default_rng(3)
    sensor = rng.normal(size=(3, 3)) * 20
    attitude = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(3)])
    attitude *= np.sign(np.linalg.det(attitude))[:, None, None]
    plots, sensor, attitude = plots_of(TRUE, TIMES, sensor, attitude)
    start = TRUE + np.array([5, -5, 5, 2, 0.2, 0.1, -0.5, 0.05, -0.03])
    converged, _, x, _ = fit(plots, sensor, attitude, start=start)
    assert converged
    np.testing.assert_allclose(x, TRUE, atol=1e-3)


def test_more_plots_are_fitted_as_by_scipy():
    times = -np.arange(12) * 0.5
    plots, sensor, attitude = plots_of(TRUE, times)
    plots += np.random.default_rng(5).normal(size=plots.shape) * SIGMA
    plots[4] = np.nan
    prior = np.array([0, 0, 0, 0, 0, 0, 1.0, (8 * DEG) ** -2, (3 * DEG) ** -2])
    start = TRUE.copy()
    start[6:] = 0.0
    converged, _, x, p = fit(plots, sensor, attitude, start=start, limits=FREE, prior=prior, times=times)

    def residuals(x):
        r = [(plots[k] - plots_of(x, times[k : k + 1])[0][0]) / SIGMA for k in range(len(times)) if k != 4]
        return np.concatenate([*r, np.sqrt(prior[6:]) * (x[6:] - start[6:])])

    expected = least_squares(residuals, TRUE, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    assert converged
    np.testing.assert_allclose(x, expected.x, atol=1e-4)
    np.testing.assert_allclose(p, np.linalg.inv(expected.jac.T @ expected.jac), rtol=1e-2, atol=1e-6)


def test_a_start_straight_above_the_sensor_is_moved_aside():
    plots, sensor, attitude = plots_of(TRUE, TIMES)
    converged, _, x, _ = fit(plots, sensor, attitude, start=PRINTED_START)
    assert converged
    np.testing.assert_allclose(x, TRUE, atol=1e-3)


def test_two_plots_leave_the_state_open():
    plots, sensor, attitude = plots_of(TRUE, TIMES[:2])
    converged, iterations, _, p = fit(plots, sensor, attitude, times=TIMES[:2])
    assert not converged
    assert iterations >= 1
    assert np.isnan(p).all() or np.linalg.cond(p) > 1e12


def example(limits, draws, aside=(1.0, 1.0)):
    plots, sensor, attitude = plots_of(TRUE, TIMES)
    rng = np.random.default_rng(0)
    start = PRINTED_START.copy()
    start[:2] += aside
    found = []
    for _ in range(draws):
        noisy = plots + rng.normal(size=(3, 3)) * SIGMA
        converged, iterations, x, _ = fit(noisy, sensor, attitude, start=start, limits=limits, most=30)
        if converged:
            found.append((iterations, x))
    return found


def right(found):
    """How many are the flight that the plots are of: within 20 m and 10 m/s, and not straight up or down."""
    states = [x for _, x in found if np.linalg.norm(x[:3] - TRUE[:3]) < 20.0 and abs(x[3] - TRUE[3]) < 10.0]
    return sum(abs(x[5]) < math.radians(80.0) for x in states)


def test_the_example_of_the_thesis_converges_as_its_errata_say():
    """With table 3.5's limits 196 of 200 draws in 17 iterations (median), and the RMS errors that are listed.

    Bounds: 99.9 % of the counts of another 200 draws at 0.98; RMS errors within a third, as few outliers make them.
    """
    found = example(LIMITS, 200)
    assert len(found) >= 188 and right(found) == len(found)
    assert 15 <= np.median([iterations for iterations, _ in found]) <= 19
    error = np.array([x - TRUE for _, x in found])
    error[:, 4] = (error[:, 4] + math.pi) % (2 * math.pi) - math.pi
    rms = np.sqrt(np.mean(error**2, axis=0))
    rms[[4, 5, 7, 8]] /= DEG
    np.testing.assert_allclose(rms, [1.9, 1.9, 1.8, 2.4, 12.5, 10.8, 1.2, 6.6, 5.6], rtol=0.33)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("aside", "least", "most"), [((-1.0, -1.0), 22, 56), ((1.0, 1.0), 38, 80), ((1.0, -1.0), 70, 116)]
)
def test_without_limits_few_draws_converge(aside, least, most):
    """About 35 of 200 (errata) are those of a start moved back by a metre; the other ways make it 58, 70 and 93.

    Bounds are three standard deviations of a count at 38, 58 and 93 of 200. Most of what converges is no such flight.
    """
    found = example(FREE, 200, aside)
    assert least <= len(found) <= most
    assert right(found) < 0.5 * len(found)
