"""The kernels of the ADS-B filter against a 12-state twin, against filterpy, and their consistency."""

import math

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.naive.tracking import TwelveStates, discrete
from tests.naive.tracking import output as naive_output
from wideberth.tracking import kernels, output_kernels
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.filter_bank import FilterBank, spectral_density, transition_tables
from wideberth.tracking.motion import axis_model, model_tables

FloatArray = NDArray[np.float64]
INF = math.inf


@pytest.mark.parametrize(("tau_a", "tau_j"), [(20.0, 2.0), (INF, INF), (5.0, INF), (INF, 1.0), (0.5, 0.2)])
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_model_is_the_integral_of_the_noise(tau_a: float, tau_j: float, dt: float) -> None:
    phi, q = axis_model(dt, 0.3, tau_a, tau_j)
    phi_naive, q_naive = discrete(dt, 0.3, tau_a, tau_j)
    assert np.allclose(phi, phi_naive, rtol=1e-10, atol=1e-13)
    assert np.allclose(q, q_naive, rtol=1e-8, atol=1e-16)


def test_constant_jerk_model_as_printed() -> None:
    phi, _ = axis_model(0.1, 1.0, INF, INF)
    t = 0.1
    expected = [[1.0, t, t**2 / 2, t**3 / 6], [0.0, 1.0, t, t**2 / 2], [0.0, 0.0, 1.0, t], [0.0, 0.0, 0.0, 1.0]]
    assert np.allclose(phi, expected)


def test_tables_equal_walking() -> None:
    phi, q = axis_model(0.1, 0.3, 20.0, 2.0)
    phis, qs = model_tables(phi, q, 40)
    x, p = np.array([1.0, 2.0, 3.0, 4.0]), np.diag([4.0, 3.0, 2.0, 1.0])
    for steps in (0, 1, 7, 40, 41, 123):
        xw, pw = x, p
        for _ in range(steps):
            xw, pw = phi @ xw, phi @ pw @ phi.T + q
        xo, po = np.empty(4), np.empty((4, 4))
        kernels.predict_steps(x, p, steps, phis, qs, xo, po)
        assert np.allclose(xo, xw, rtol=1e-10)
        assert np.allclose(po, pw, rtol=1e-10)


@pytest.mark.parametrize("arguments", [(0.0, 1.0, 1.0, 1.0), (0.1, -1.0, 1.0, 1.0), (0.1, 1.0, 0.0, 1.0)])
def test_model_refuses_nonsense(arguments: tuple[float, float, float, float]) -> None:
    with pytest.raises(ValueError, match="positive"):
        axis_model(*arguments)


def test_spectral_density_gives_the_stationary_acceleration() -> None:
    density = spectral_density(2.0, 20.0, 2.0, 1e-3)
    phi, q = axis_model(0.5, density, 20.0, 2.0)
    p = np.zeros((4, 4))
    for _ in range(1000):
        p = phi @ p @ phi.T + q
    assert math.isclose(p[2, 2], 4.0, rel_tol=1e-6)
    assert spectral_density(2.0, None, 2.0, 1e-3) == 1e-3


def test_tables_are_made_once_for_the_same_settings() -> None:
    phi, q = transition_tables(AdsbKalmanConfig())
    again, other = transition_tables(AdsbKalmanConfig()), transition_tables(AdsbKalmanConfig(step_s=0.05))
    assert again[0] is phi and again[1] is q
    # Twice as many steps of half the length: the even ones are the same times.
    assert np.allclose(other[0][:, 1::2], phi, rtol=1e-9) and np.allclose(other[1][:, 1::2], q, rtol=1e-6)


def start(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    a = rng.normal(size=(3, 4, 4))
    return rng.normal(size=(3, 4)) * [100.0, 30.0, 1.0, 0.1], a @ a.transpose(0, 2, 1) + np.eye(4)


def test_three_axes_equal_the_twelve_states() -> None:
    rng = np.random.default_rng(3)
    bank = FilterBank(AdsbKalmanConfig())
    x, p = start(rng)
    twin = TwelveStates((bank.phi[0, 0], bank.phi[1, 0]), (bank.q[0, 0], bank.q[1, 0]), x, p)
    x, p = x[None].copy(), p[None].copy()
    r = np.array([[16.0, 16.0, 540.0, 17.0, 17.0, 0.03]])
    last, codes, nis = np.zeros(1, np.int64), np.empty((1, 4), np.int64), np.empty((1, 4))
    seen: set[tuple[int, int]] = set()
    step = 0
    for _ in range(60):
        gap = int(rng.integers(0, 60))
        for _ in range(gap):
            twin.predict()
        step += gap
        predicted = twin.x.copy()
        z = predicted[:6] + rng.normal(size=6) * np.sqrt(np.diag(twin.p)[:6] + r[0]) * rng.choice([0.5, 1.0, 4.0])
        use = rng.random(4) < 0.7
        kernels.filter_reports(
            x, p, last, np.zeros(1, np.int64), np.array([step]), bank.phi, bank.q, z[None], r, use[None], 5.0,
            np.zeros(1), codes, nis,
        )  # fmt: skip
        ok = True
        expected = [kernels.ABSENT] * 4
        groups = (([0, 1], 0), ([2], 1), ([5], 2), ([3, 4], 3))
        for states, k in groups:
            if use[k] and ok:
                accepted, value = twin.update(states, z[states], r[0, states], 5.0)
                expected[k] = kernels.ACCEPTED if accepted else kernels.REJECTED
                assert math.isclose(nis[0, k], value, rel_tol=1e-6)
                ok = not (k == 0 and not accepted)
        assert codes[0].tolist() == expected
        seen.update(enumerate(expected))
        xt, pt = twin.axes()
        assert np.allclose(x[0], xt, rtol=1e-8, atol=1e-8)
        assert np.allclose(p[0], pt, rtol=1e-6, atol=1e-9)
    assert {(0, kernels.ACCEPTED), (0, kernels.REJECTED), (1, kernels.ACCEPTED), (3, kernels.ACCEPTED)} <= seen


@pytest.mark.parametrize("steps", [1, 2, 13, 40])
@pytest.mark.parametrize("residual", [0.0, -0.04, 0.05])
def test_outputs_equal_their_twin(steps, residual):
    """`output_motion` writes the part of what `output_track` writes that detection needs."""
    rng = np.random.default_rng(steps)
    bank = FilterBank(AdsbKalmanConfig())
    starts = [start(rng) for _ in range(2)]
    x, p = np.array([s[0] for s in starts]), np.array([s[1] for s in starts])
    bias, latency = np.array([300.0, 50.0]), 0.4
    models = (bank.phi[0, 0], bank.phi[1, 0]), (bank.q[0, 0], bank.q[1, 0])
    expected = naive_output(x[1], p[1], *models, steps, residual, bias, latency)

    out, covariance = np.zeros((3, 3)), np.zeros((9, 9))
    spread = output_kernels.output_track(
        x[1], p[1], 7, 7 + steps, residual, bank.dt, bank.phi, bank.q, bias, latency,
        np.empty((3, 4)), np.empty((3, 4, 4)), out[0], out[1], out[2], covariance,
    )  # fmt: skip
    for got, wanted in zip((*out, covariance, spread), expected, strict=True):
        np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-8)

    position, velocity, covariances = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 9, 9))
    spread = output_kernels.output_motion(
        1, x, p, steps, residual, bank.phi, bank.q, bias, latency, position, velocity, covariances
    )
    for got, wanted in zip(
        (position[1], velocity[1], covariances[1, :6, :6], spread),
        (*expected[:2], expected[3][:6, :6], expected[4]),
        strict=True,
    ):
        np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-8)
    assert not position[0].any() and not velocity[0].any() and not covariances[0].any()
    assert not covariances[:, 6:].any() and not covariances[:, :, 6:].any()


def test_equals_filterpy() -> None:
    rng = np.random.default_rng(4)
    phi, q = axis_model(0.1, 1e-3, INF, INF)
    phis, qs = model_tables(phi, q, 10)
    ours, p = np.array([0.0, 50.0, 0.0, 0.0]), np.diag([16.0, 25.0, 1.0, 0.1])
    theirs = KalmanFilter(dim_x=4, dim_z=1)
    theirs.x, theirs.P, theirs.F, theirs.Q = ours.copy(), p.copy(), phi, q
    theirs.H, theirs.R = np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([[16.0]])
    for k in range(100):
        z = 5.0 * (k + 1) + rng.normal() * 4.0
        kernels.predict_steps(ours, p, 10, phis, qs, ours, p)
        kernels.update_axis(ours, p, 0, z - ours[0], p[0, 0] + 16.0)
        for _ in range(10):
            theirs.predict()
        theirs.update(np.array([z]))
        assert np.allclose(ours, theirs.x, rtol=1e-9, atol=1e-9)
        assert np.allclose(p, theirs.P, rtol=1e-9, atol=1e-9)


def test_swapped_velocity_is_told_from_a_wrong_one() -> None:
    use, r = np.array([False, False, False, True]), np.full(6, 16.0)
    for vn, ve, expected in (
        (60.0, 5.0, kernels.ACCEPTED),
        (5.0, 60.0, kernels.SWAPPED),
        (-60.0, -60.0, kernels.REJECTED),
    ):
        x, p = np.zeros((3, 4)), np.zeros((3, 4, 4))
        p[:], x[:2, 1] = np.eye(4), (60.0, 5.0)
        codes, nis = np.empty(4, np.int64), np.empty(4)
        kernels.update_track(x, p, np.array([0, 0, 0, vn, ve, 0.0]), r, use, 5.0, 0.0, codes, nis)
        assert codes[3] == expected


def test_time_uncertainty_widens_along_the_velocity() -> None:
    use, r = np.array([True, False, False, False]), np.full(6, 16.0)
    for north, east, expected in ((60.0, 0.0, kernels.ACCEPTED), (0.0, 60.0, kernels.REJECTED)):
        x, p = np.zeros((3, 4)), np.zeros((3, 4, 4))
        p[:], x[0, 1] = np.eye(4), 100.0
        codes, nis = np.empty(4, np.int64), np.empty(4)
        kernels.update_track(x, p, np.array([north, east, 0, 0, 0, 0.0]), r, use, 5.0, 0.3, codes, nis)
        assert codes[0] == expected


def test_innovations_are_consistent_with_white_errors() -> None:
    """NIS of truth drawn from the model, errors from R: within a band that fails falsely with probability 1e-5."""
    rng = np.random.default_rng(5)
    bank = FilterBank(AdsbKalmanConfig())
    r = np.array([16.0, 16.0, 540.0, 17.0, 17.0, 0.03])
    n, updates = 40, 60
    p0 = np.diag([16.0, 25.0, 4.0, 0.09])
    truth = np.linalg.cholesky(p0) @ rng.normal(size=(n, 3, 4, 1))
    x, p = np.zeros((n, 3, 4)), np.broadcast_to(p0, (n, 3, 4, 4)).copy()
    index, last = np.arange(n), np.zeros(n, np.int64)
    codes, nis = np.empty((n, 4), np.int64), np.empty((n, 4))
    roots = [np.linalg.cholesky(bank.q[a, 9] + 1e-15 * np.eye(4)) for a in range(2)]
    total = np.zeros(4)
    for k in range(updates):
        for axis in range(3):
            a = axis // 2
            truth[:, axis] = bank.phi[a, 9] @ truth[:, axis] + roots[a] @ rng.normal(size=(n, 4, 1))
        z = truth[:, [0, 1, 2, 0, 1, 2], [0, 0, 0, 1, 1, 1], 0] + rng.normal(size=(n, 6)) * np.sqrt(r)
        kernels.filter_reports(
            x, p, last, index, np.full(n, 10 * (k + 1)), bank.phi, bank.q, z, np.tile(r, (n, 1)),
            np.ones((n, 4), np.bool_), 9.0, np.zeros(n), codes, nis,
        )  # fmt: skip
        assert np.all(codes == kernels.ACCEPTED)
        total += nis.sum(axis=0)
    for value, degrees in zip(total, (2, 1, 1, 2), strict=True):
        low, high = chi2.ppf([5e-6, 1 - 5e-6], degrees * n * updates)
        assert low < value < high
