"""The kernels that the radar trackers share, against naive twins, finite differences and filterpy."""

import math

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from tests.naive.radar_tracking import chain, differences, matrix_update, plot_of, turning_after
from wideberth.frames import rotation_ned_body
from wideberth.tracking import matrix_kernels, motion_kernels, radar_kernels, unscented_kernels, update_kernels
from wideberth.tracking.motion_kernels import CONSTANT_ACCELERATION, CONSTANT_VELOCITY, TURNING

FloatArray = NDArray[np.float64]

MODELS = [CONSTANT_VELOCITY, CONSTANT_ACCELERATION, TURNING]
SENSOR = np.array([5.0, -7.0, 2.0])
MOVING = np.array([3.0, 1.0, -0.5])
POSES = [np.eye(3), rotation_ned_body(0.3, -0.4, 2.0), rotation_ned_body(-2.9, 1.2, -1.0)]


def some_state(rng: np.random.Generator, model: int) -> FloatArray:
    position = rng.uniform(-400.0, 400.0, 3)
    if model == TURNING:
        path = [rng.uniform(3.0, 40.0), rng.uniform(-3.1, 3.1), rng.uniform(-1.2, 1.2)]
        return np.concatenate([position, path, rng.normal(0.0, [1.0, 0.2, 0.1])])
    x = np.concatenate([position, rng.normal(0.0, 15.0, 3), rng.normal(0.0, 1.0, 3)])
    return x[: motion_kernels.state_count(model)]


def some_covariance(rng: np.random.Generator, n: int, size: float = 1.0) -> FloatArray:
    a = rng.normal(size=(n, n))
    return size * (a @ a.T / n + 0.1 * np.eye(n))


# --- matrix_kernels ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 3, 9])
def test_algebra_equals_numpy(n: int) -> None:
    rng = np.random.default_rng(n)
    a, b = some_covariance(rng, n), rng.normal(size=n)
    factor = np.zeros((n + 2, n + 3))  # a buffer may be larger than what is in it
    assert matrix_kernels.cholesky(a, n, factor)
    assert np.allclose(np.tril(factor[:n, :n]), np.linalg.cholesky(a), rtol=1e-12, atol=1e-14)
    assert math.isclose(
        matrix_kernels.log_determinant(factor, n), np.linalg.slogdet(a)[1], rel_tol=1e-10, abs_tol=1e-12
    )
    square = matrix_kernels.whitened_square(factor, n, b, np.zeros(n))
    assert math.isclose(square, b @ np.linalg.solve(a, b), rel_tol=1e-10)
    x = b.copy()
    matrix_kernels.solve_cholesky(factor, n, x)
    assert np.allclose(x, np.linalg.solve(a, b), rtol=1e-9)


@pytest.mark.parametrize(
    "bad",
    [[[1.0, 2.0], [2.0, 1.0]], [[0.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, -1.0]], [[1.0, math.nan], [math.nan, 1.0]]],
)
def test_cholesky_refuses_what_is_not_positive_definite(bad: list[list[float]]) -> None:
    assert not matrix_kernels.cholesky(np.array(bad), 2, np.zeros((2, 2)))


@pytest.mark.parametrize(("m", "n"), [(9, 9), (4, 9), (9, 6)])
def test_congruence(m: int, n: int) -> None:
    rng = np.random.default_rng(m * n)
    f, p = rng.normal(size=(m, n)), some_covariance(rng, n)
    f[0, 1] = 0.0
    out = np.zeros((m, m))
    matrix_kernels.congruence(f, p, n, m, np.zeros((m, n)), out)
    assert np.allclose(out, f @ p @ f.T, rtol=1e-12, atol=1e-12)
    assert np.array_equal(out, out.T)
    if m == n:
        matrix_kernels.congruence(f, p, n, n, np.zeros((n, n)), p)
        assert np.array_equal(p, out)


# --- motion_kernels ---------------------------------------------------------------------------------------------------


def propagated(model: int, dt: float, x: FloatArray) -> FloatArray:
    out = np.empty(len(x))
    motion_kernels.propagate(model, dt, x, out)
    return out


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("dt", [0.1, 1.0, -2.0])
def test_transition_is_the_derivative_of_propagate(model: int, dt: float) -> None:
    rng = np.random.default_rng(model)
    for _ in range(5):
        x = some_state(rng, model)
        f = np.full((len(x), len(x)), math.nan)
        motion_kernels.transition(model, dt, x, f)
        steps = np.full(len(x), 1e-3)
        assert np.allclose(f, differences(lambda y: propagated(model, dt, y), x, steps), rtol=1e-8, atol=1e-7)


@pytest.mark.parametrize("model", MODELS)
def test_there_and_back(model: int) -> None:
    rng = np.random.default_rng(10 + model)
    for dt in (0.1, -0.5, 3.0):
        x = some_state(rng, model)
        there = propagated(model, dt, x)
        # Simpson's three places are the same both ways.
        assert np.allclose(propagated(model, -dt, there), x, rtol=1e-12, atol=1e-9)
        same = x.copy()
        motion_kernels.propagate(model, dt, same, same)
        assert np.array_equal(same, there)


@pytest.mark.parametrize("dt", [0.1, 1.0, -1.0, -3.9])
def test_the_turning_model_equals_small_steps(dt: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        x = some_state(rng, TURNING)
        exact = turning_after(x, dt)
        # Simpson: dt^5 / 2880 of the fourth derivative of the velocity.
        rate = 1.0 + np.abs(x[7:9]).sum() + abs(x[6] / x[3])
        bound = abs(dt) ** 5 / 2880 * (abs(x[3]) + abs(x[6] * dt)) * rate**4
        assert np.abs(propagated(TURNING, dt, x)[:3] - exact[:3]).max() < bound + 1e-9
        assert np.allclose(propagated(TURNING, dt, x)[3:], exact[3:], atol=1e-12)


def test_simpson_is_of_fifth_order() -> None:
    x = np.array([0.0, 0.0, -100.0, 14.0, -0.9, 0.1, 1.3, -0.3, 0.1])
    errors = [np.linalg.norm(propagated(TURNING, dt, x)[:3] - turning_after(x, dt)[:3]) for dt in (1.0, 2.0)]
    assert 4.7 < math.log2(errors[1] / errors[0]) < 5.3


@pytest.mark.parametrize("model", [CONSTANT_VELOCITY, CONSTANT_ACCELERATION])
@pytest.mark.parametrize("dt", [0.1, 2.0, -2.0])
def test_linear_models_equal_the_matrix_exponential(model: int, dt: float) -> None:
    rng = np.random.default_rng(model)
    order = motion_kernels.state_count(model) // 3
    n, q = 3 * order, np.array([0.3, 0.5, 0.2])
    axes = [chain(order, dt, density) for density in q]
    states = [order * axis + derivative for derivative in range(order) for axis in range(3)]
    pick = np.ix_(states, states)
    f, noise = block_diag(*(a[0] for a in axes))[pick], block_diag(*(a[1] for a in axes))[pick]
    x, p = some_state(rng, model), some_covariance(rng, n)
    x_naive, p_naive = f @ x, f @ p @ f.T + noise
    motion_kernels.predict(model, dt, q, x, p, np.zeros((9, 9)), np.zeros((9, 9)))
    assert np.allclose(x, x_naive, rtol=1e-12)
    assert np.allclose(p, p_naive, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("dt", [0.5, -0.5])
def test_turning_noise_enters_through_the_rates(dt: float) -> None:
    q, p = np.array([0.3, 0.02, 0.01]), np.zeros((9, 9))
    motion_kernels.add_process_noise(TURNING, dt, q, p)
    for axis in range(3):
        at = np.ix_([3 + axis, 6 + axis], [3 + axis, 6 + axis])
        assert np.allclose(p[at], chain(2, dt, q[axis])[1])
        p[at] = 0.0
    assert not p.any()


@pytest.mark.parametrize("model", MODELS)
def test_kinematics_and_their_jacobian(model: int) -> None:
    rng = np.random.default_rng(20 + model)

    def kinematics(x: FloatArray) -> FloatArray:
        out = np.empty(9)
        motion_kernels.kinematics(model, x, out, np.zeros((9, 9)))
        return out

    for _ in range(5):
        x = some_state(rng, model)
        n, j, out = len(x), np.full((9, 9), math.nan), np.full(9, math.nan)
        motion_kernels.kinematics(model, x, out, j)
        assert np.allclose(j[:, :n], differences(kinematics, x, np.full(n, 1e-3)), rtol=1e-8, atol=1e-7)
        # The derivatives in time of where the model goes.
        position = np.array([propagated(model, t, x)[:3] for t in (-2e-2, -1e-2, 0.0, 1e-2, 2e-2)])
        velocity = (8 * (position[3] - position[1]) - (position[4] - position[0])) / 12e-2
        acceleration = (16 * (position[3] + position[1]) - position[4] - position[0] - 30 * position[2]) / 12e-4
        assert np.allclose(out[:3], x[:3])
        assert np.allclose(out[3:6], velocity, atol=1e-5)
        assert np.allclose(out[6:], acceleration if model != CONSTANT_VELOCITY else 0.0, atol=1e-4)
        p, covariance = some_covariance(rng, n), np.zeros((9, 9))
        motion_kernels.to_kinematics(model, x, p, out, covariance, np.zeros((9, 9)), np.zeros((9, 9)))
        assert np.allclose(covariance, j[:, :n] @ p @ j[:, :n].T, rtol=1e-11, atol=1e-11)


# --- radar_kernels ----------------------------------------------------------------------------------------------------


def plotted(attitude: FloatArray, position: FloatArray) -> FloatArray:
    seen, out = np.empty(3), np.empty(4)
    radar_kernels.to_sensor(SENSOR, attitude, position, seen)
    radar_kernels.to_plot(seen, out)
    return out[:3]


@pytest.mark.parametrize("attitude", POSES)
def test_plots_and_back_in_any_pose(attitude: FloatArray) -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        position = SENSOR + rng.normal(0.0, 200.0, 3)
        plot, back = plotted(attitude, position), np.empty(3)
        assert np.allclose(plot, plot_of(SENSOR, attitude, position), rtol=1e-12)
        radar_kernels.to_position(SENSOR, attitude, plot[0], plot[1], plot[2], back)
        assert np.allclose(back, position, atol=1e-9)
        jacobian, seen = np.empty((3, 3)), np.empty(3)
        radar_kernels.to_sensor(SENSOR, attitude, position, seen)
        radar_kernels.plot_jacobian(seen, attitude, jacobian)
        if abs(plot[1]) < 3.1:
            numeric = differences(lambda y: plotted(attitude, y), position, np.full(3, 1e-2))
            assert np.allclose(jacobian, numeric, rtol=1e-6, atol=1e-9)


def test_a_level_radar_measures_as_the_documents_say() -> None:
    # East of a radar that looks north, above its horizon: azimuth and elevation positive.
    assert np.allclose(
        plotted(np.eye(3), SENSOR + np.array([0.0, 100.0, -100.0])), [math.sqrt(2e4), math.pi / 2, math.pi / 4]
    )
    # Rolled to the right by 90 degrees, "below" is on the left: what is east of it lies above its horizontal plane.
    assert np.allclose(
        plotted(rotation_ned_body(math.pi / 2, 0.0, 0.0), SENSOR + np.array([0.0, 100.0, 0.0]))[2], math.pi / 2
    )


@pytest.mark.parametrize("attitude", POSES)
def test_directions_and_covariance_of_a_plot(attitude: FloatArray) -> None:
    rng = np.random.default_rng(5)
    sigma = np.array([0.4, 0.02, 0.01])
    for _ in range(10):
        position = SENSOR + rng.normal(0.0, 200.0, 3)
        r, az, el = plotted(attitude, position)
        rows, covariance = np.empty((3, 3)), np.empty((3, 3))
        radar_kernels.directions(attitude, az, el, rows)
        assert np.allclose(rows @ rows.T, np.eye(3), atol=1e-12)
        assert np.allclose(rows[0], (position - SENSOR) / r)
        jacobian, seen = np.empty((3, 3)), np.empty(3)
        radar_kernels.to_sensor(SENSOR, attitude, position, seen)
        radar_kernels.plot_jacobian(seen, attitude, jacobian)
        # The same planes as the polar derivatives, each in metres.
        assert np.allclose(rows, jacobian * np.array([1.0, r * math.cos(el), r])[:, None], atol=1e-9)
        radar_kernels.plot_covariance(attitude, r, az, el, sigma, covariance)
        back = np.linalg.inv(jacobian)
        assert np.allclose(covariance, back @ np.diag(sigma**2) @ back.T, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("attitude", POSES)
def test_straight_above_the_radar_nothing_is_infinite(attitude: FloatArray) -> None:
    above = SENSOR - 100.0 * attitude[:, 2]
    seen, plot, jacobian = np.empty(3), np.empty(3), np.empty((3, 3))
    radar_kernels.to_sensor(SENSOR, attitude, above, seen)
    radar_kernels.to_plot(seen, plot)
    radar_kernels.plot_jacobian(seen, attitude, jacobian)
    assert np.allclose(plot[[0, 2]], [100.0, math.pi / 2])
    assert np.isfinite(jacobian).all()
    rows, covariance = np.empty((3, 3)), np.empty((3, 3))
    radar_kernels.directions(attitude, plot[1], plot[2], rows)
    assert np.allclose(rows @ rows.T, np.eye(3), atol=1e-12)
    radar_kernels.plot_covariance(attitude, plot[0], plot[1], plot[2], np.array([0.4, 0.02, 0.01]), covariance)
    # An azimuth error does not move a plot at the zenith.
    assert np.allclose(np.linalg.eigvalsh(covariance), [0.0, 0.16, 1.0], atol=1e-9)
    radar_kernels.plot_jacobian(np.zeros(3), attitude, jacobian)
    assert np.isfinite(jacobian).all()


def test_range_rate_and_its_gradient() -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        x = np.concatenate([SENSOR + rng.normal(0.0, 200.0, 3), rng.normal(0.0, 20.0, 3)])
        gradient = np.empty(6)
        radar_kernels.range_rate_gradient(SENSOR, MOVING, x, gradient)
        numeric = differences(
            lambda y: np.array([radar_kernels.range_rate(SENSOR, MOVING, y)]), x, np.array([1e-2] * 3 + [1e-2] * 3)
        )[0]
        assert np.allclose(gradient, numeric, rtol=1e-7, atol=1e-9)
        later = [np.linalg.norm(x[:3] + t * x[3:] - SENSOR - t * MOVING) for t in (-1e-3, 1e-3)]
        assert math.isclose(radar_kernels.range_rate(SENSOR, MOVING, x), (later[1] - later[0]) / 2e-3, abs_tol=1e-6)
    assert np.isfinite(radar_kernels.range_rate(SENSOR, MOVING, np.concatenate([SENSOR, MOVING])))


# --- update_kernels ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
def test_update_by_elements_equals_the_matrix_form(model: int) -> None:
    rng = np.random.default_rng(30 + model)
    n = motion_kernels.state_count(model)
    for missing in ([], [2], [1, 2], [0, 1, 2, 3]):
        x, p = some_state(rng, model), some_covariance(rng, n, 4.0)
        h, innovation, variance = rng.normal(size=(4, n)), rng.normal(size=4), rng.uniform(0.1, 2.0, 4)
        innovation[missing] = math.nan
        kept = [i for i in range(4) if i not in missing]
        r = np.diag(variance)[np.ix_(kept, kept)]
        expected = matrix_update(x, p, h[kept], innovation[kept], r) if kept else (x.copy(), p.copy(), 0.0, 0.0)
        if kept:
            filterpy = ExtendedKalmanFilter(n, len(kept))
            filterpy.x, filterpy.P, filterpy.R = x.copy(), p.copy(), r
            z, hx = innovation[kept] + h[kept] @ x, h[kept] @ x
            filterpy.update(z, HJacobian=lambda _, rows=h[kept]: rows, Hx=lambda _, value=hx: value)
        nis, log_likelihood = update_kernels.update(n, 4, x, p, h, innovation, variance, np.zeros((2, n)))
        assert np.allclose(x, expected[0], rtol=1e-9, atol=1e-9)
        assert np.allclose(p, expected[1], rtol=1e-9, atol=1e-9)
        assert np.array_equal(p, p.T)
        assert math.isclose(nis, expected[2], rel_tol=1e-9, abs_tol=1e-12)
        assert math.isclose(log_likelihood, expected[3], rel_tol=1e-9, abs_tol=1e-12)
        if kept:
            assert np.allclose(x, filterpy.x, rtol=1e-9, atol=1e-9)
            assert np.allclose(p, filterpy.P, rtol=1e-9, atol=1e-9)


def test_the_order_of_the_elements_does_not_matter() -> None:
    rng = np.random.default_rng(7)
    x, p, h = rng.normal(size=6), some_covariance(rng, 6), rng.normal(size=(4, 6))
    innovation, variance = rng.normal(size=4), rng.uniform(0.1, 2.0, 4)
    results = []
    for order in ([0, 1, 2, 3], [3, 1, 0, 2]):
        xi, pi = x.copy(), p.copy()
        done = update_kernels.update(6, 4, xi, pi, h[order], innovation[order], variance[order], np.zeros((2, 6)))
        results.append(np.concatenate([xi, pi.ravel(), done]))
    assert np.allclose(results[0], results[1], rtol=1e-10, atol=1e-12)


# --- unscented_kernels ------------------------------------------------------------------------------------------------


def buffers() -> tuple[FloatArray, FloatArray, FloatArray]:
    rows = unscented_kernels.POINT_ROWS
    return np.zeros((rows, 9)), np.zeros((rows, 4)), np.zeros((unscented_kernels.WORK_ROWS, 9))


def measured(model: int, x: FloatArray, attitude: FloatArray) -> FloatArray:
    kinematics = np.empty(9)
    motion_kernels.kinematics(model, x, kinematics, np.zeros((9, 9)))
    line = kinematics[:3] - SENSOR
    rate = line @ (kinematics[3:6] - MOVING) / np.linalg.norm(line)
    return np.append(plot_of(SENSOR, attitude, kinematics[:3]), rate)


def angle_difference(a: FloatArray, b: FloatArray) -> FloatArray:
    d = a - b
    d[1:3] = np.arctan2(np.sin(d[1:3]), np.cos(d[1:3]))
    return d


@pytest.mark.parametrize("scaling", [(0.5, 2.0, 0.0), (1.0, 2.0, -3.0), (1e-2, 2.0, 0.0)])
@pytest.mark.parametrize("attitude", POSES)
@pytest.mark.parametrize("model", MODELS)
def test_unscented_equals_filterpy(model: int, attitude: FloatArray, scaling: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(40 + model)
    n = motion_kernels.state_count(model)
    spread = np.array([3.0, 3.0, 3.0, 1.0, 0.05, 0.05, 0.5, 0.05, 0.05]) if model == TURNING else np.ones(9)
    variance = np.array([0.4, 0.02, 0.02, 0.5]) ** 2
    q, dt = np.array([0.5, 0.01, 0.01]), 0.3
    points = MerweScaledSigmaPoints(n, *scaling)

    def mean(sigmas: FloatArray, weights: FloatArray) -> FloatArray:
        centre = sigmas[0]
        return np.array(centre + sum(w * angle_difference(s, centre) for s, w in zip(sigmas, weights, strict=True)))

    noise = np.zeros((n, n))
    motion_kernels.add_process_noise(model, dt, q, noise)
    for _ in range(4):
        x = some_state(rng, model)
        p = some_covariance(rng, n) * np.outer(spread[:n], spread[:n])
        theirs = UnscentedKalmanFilter(
            n,
            4,
            dt,
            hx=lambda y: measured(model, y, attitude),
            fx=lambda y, step: propagated(model, step, y),
            points=points,
            z_mean_fn=mean,
            residual_z=angle_difference,
        )
        theirs.x, theirs.P, theirs.Q, theirs.R = x.copy(), p.copy(), noise, np.diag(variance)
        sigmas, seen, work = buffers()
        theirs.predict()
        assert unscented_kernels.unscented_predict(model, dt, q, np.array(scaling), x, p, sigmas, work)
        # Weights of 1e4 and the differences that they multiply cost four digits each.
        tight = 1e-9 if scaling[0] > 0.1 else 1e-6
        assert np.allclose(x, theirs.x, rtol=tight, atol=tight)
        assert np.allclose(p, theirs.P, rtol=tight, atol=tight)
        plot = measured(model, x, attitude) + rng.normal(size=4) * np.sqrt(variance)
        theirs.x, theirs.P = x.copy(), p.copy()
        theirs.sigmas_f = points.sigma_points(x, p)
        theirs.update(plot)
        nis, log_likelihood = unscented_kernels.unscented_update(
            model, np.array(scaling), x, p, SENSOR, MOVING, attitude, plot, variance, sigmas, seen, work
        )
        assert np.allclose(x, theirs.x, rtol=tight, atol=tight)
        assert np.allclose(p, theirs.P, rtol=tight, atol=tight)
        assert math.isclose(nis, theirs.y @ np.linalg.solve(theirs.S, theirs.y), rel_tol=100 * tight)
        likelihood = multivariate_normal(np.zeros(4), theirs.S, allow_singular=True).logpdf(theirs.y)
        assert math.isclose(log_likelihood, likelihood, rel_tol=100 * tight, abs_tol=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_unscented_leaves_out_what_is_not_measured(model: int) -> None:
    rng = np.random.default_rng(50 + model)
    n, scaling = motion_kernels.state_count(model), np.array([0.5, 2.0, 0.0])
    variance = np.array([0.4, 0.02, 0.02, 0.5]) ** 2
    sigmas, seen, work = buffers()
    x, p = some_state(rng, model), 0.01 * some_covariance(rng, n)
    plot = measured(model, x, POSES[1]) + np.array([0.3, 0.01, 0.01, 0.3])
    for missing in ([2], [1, 2], [0, 1, 3]):
        partial, blurred = plot.copy(), variance.copy()
        partial[missing] = math.nan
        blurred[missing] = 1e12
        xa, pa, xb, pb = x.copy(), p.copy(), x.copy(), p.copy()
        arguments = SENSOR, MOVING, POSES[1]
        nis_a, _ = unscented_kernels.unscented_update(
            model, scaling, xa, pa, *arguments, partial, variance, sigmas, seen, work
        )
        nis_b, _ = unscented_kernels.unscented_update(
            model, scaling, xb, pb, *arguments, plot, blurred, sigmas, seen, work
        )
        assert np.allclose(xa, xb, atol=1e-9)
        assert np.allclose(pa, pb, atol=1e-9)
        assert math.isclose(nis_a, nis_b, rel_tol=1e-6, abs_tol=1e-9)
    nothing = np.full(4, math.nan)
    xa, pa = x.copy(), p.copy()
    done = unscented_kernels.unscented_update(
        model, scaling, xa, pa, SENSOR, MOVING, POSES[1], nothing, variance, sigmas, seen, work
    )
    assert done == (0.0, 0.0)
    assert np.array_equal(xa, x)
    assert np.array_equal(pa, p)


def test_unscented_azimuth_across_the_cut() -> None:
    """Behind the sensor azimuths jump from pi to -pi: the same as beside it, turned round."""
    rng = np.random.default_rng(60)
    scaling, variance = np.array([0.5, 2.0, 0.0]), np.array([0.4, 0.02, 0.02, 0.5]) ** 2
    behind = np.concatenate([SENSOR + np.array([-80.0, 0.1, -20.0]), [1.0, 5.0, 0.0]])
    p = some_covariance(rng, 6, 9.0)
    sigmas, seen, work = buffers()
    results = []
    for attitude in (np.eye(3), rotation_ned_body(0.0, 0.0, math.pi)):
        xi, pi = behind.copy(), p.copy()
        plot = measured(CONSTANT_VELOCITY, behind + np.array([0, -1.0, 0, 0, 0, 0]), attitude)
        done = unscented_kernels.unscented_update(
            CONSTANT_VELOCITY, scaling, xi, pi, SENSOR, MOVING, attitude, plot, variance, sigmas, seen, work
        )
        results.append(np.concatenate([xi, pi.ravel(), done]))
    assert np.allclose(results[0], results[1], rtol=1e-9, atol=1e-9)


def test_unscented_refuses_a_covariance_that_is_none() -> None:
    sigmas, seen, work = buffers()
    x, p, scaling = np.ones(6), np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0]), np.array([0.5, 2.0, 0.0])
    before = x.copy(), p.copy()
    assert not unscented_kernels.unscented_predict(CONSTANT_VELOCITY, 0.1, np.ones(3), scaling, x, p, sigmas, work)
    nis, log_likelihood = unscented_kernels.unscented_update(
        CONSTANT_VELOCITY, scaling, x, p, SENSOR, MOVING, np.eye(3), np.ones(4), np.ones(4), sigmas, seen, work
    )
    assert math.isnan(nis)
    assert math.isnan(log_likelihood)
    assert np.array_equal(x, before[0])
    assert np.array_equal(p, before[1])
