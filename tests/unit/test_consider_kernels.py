"""Biases that are considered, against a filter that has them as states; and reports against a measured model."""

import numpy as np
import pytest

from tests.naive import fusion as naive
from tests.naive import multi_target as imm
from wideberth.tracking.multi_target.bank_kernels import make_bank
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.consider_kernels import (
    BIASES,
    POSITION_TIME_S,
    carry_cross,
    consider,
    forget_biases,
    mix_cross,
    predict_cross,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT
from wideberth.tracking.multi_target.report_kernels import (
    ABSENT,
    ACCEPTED,
    ALTITUDE,
    CLIMB,
    POSITION,
    REJECTED,
    VELOCITY,
    absorb_report,
    distance_square,
    element_rows,
    element_variance,
    joint_variance,
    judge,
    known,
    make_report_scratch,
    start_axis,
)
from wideberth.tracking.multi_target.state import motion_of

BIAS = np.array([900.0, 900.0, 500.0, 0.09])
MOTION = motion_of(MultiTargetConfig())


def joint(rng, n=9):
    """A covariance of states and biases."""
    a = rng.normal(size=(n, n + BIASES))
    c = 0.2 * np.sqrt(BIAS) * rng.normal(size=(n, BIASES))
    return a @ a.T + c @ np.diag(1.0 / BIAS) @ c.T + 0.1 * np.eye(n), c


def made_bank(seed, age=0.7):
    """A bank of one track near what it says in reports, and such a report with variances."""
    rng = np.random.default_rng(seed)
    bank = make_bank(1)
    bank.mu[0] = rng.dirichlet(np.ones(HYPOTHESES))
    centre = np.concatenate([300.0 * rng.normal(size=3), 30.0 * rng.normal(size=3), rng.normal(size=3)])
    for j in range(HYPOTHESES):
        n = 6 if j == STRAIGHT else 9
        p, c = joint(rng, n)
        bank.x[0, j] = 0.0
        bank.p[0, j] = 0.0
        bank.cross[0, j] = 0.0
        bank.x[0, j, :n] = (centre + 0.3 * rng.normal(size=9))[:n]
        bank.p[0, j, :n, :n], bank.cross[0, j, :n] = p, c
    bank.address[0] = 0
    z = naive.report(centre, age, np.sqrt(BIAS) * rng.normal(size=4) * 0.3)
    return bank, z, np.array([25.0, 25.0, 9.0, 1.0, 1.0, 2.0])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("n", [6, 9])
def test_a_considered_bias_is_a_state_without_gain(seed, n):
    rng = np.random.default_rng(seed)
    p, c = joint(rng, n)
    x, h, g = rng.normal(size=n), rng.normal(size=n), rng.normal(size=BIASES)
    expected = naive.consider(x, p, c, h, g, BIAS, 1.3, 0.5)
    got = consider(n, x, p, c, h, g, BIAS, 1.3, 0.5, np.zeros(9))
    for value, right in zip((x, p, c, got), expected, strict=True):
        np.testing.assert_allclose(value, right, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_an_update_without_the_biases_carries_their_covariance(seed):
    rng = np.random.default_rng(seed)
    p, c = joint(rng)
    h, r = rng.normal(size=(3, 9)), np.diag([1.0, 2.0, 3.0])
    keep = np.eye(9) - p @ h.T @ np.linalg.inv(h @ p @ h.T + r) @ h
    expected = keep @ c
    assert carry_cross(9, p, c, keep @ p, np.zeros((9, 9)), np.zeros(9))
    np.testing.assert_allclose(c, expected, rtol=1e-7, atol=1e-7)
    assert not carry_cross(9, -p, c, p, np.zeros((9, 9)), np.zeros(9))


def test_mixing_and_forgetting():
    rng = np.random.default_rng(3)
    weight = rng.dirichlet(np.ones(HYPOTHESES), size=HYPOTHESES).T.copy()
    cross = rng.normal(size=(HYPOTHESES, 9, BIASES))
    cross[STRAIGHT, 6:] = 0.0
    expected = np.einsum("ij,iab->jab", weight, cross)
    expected[STRAIGHT, 6:] = 0.0
    mix_cross(weight, cross, np.zeros((HYPOTHESES, 9)))
    np.testing.assert_allclose(cross, expected, atol=1e-12)
    forget_biases(cross)
    assert not cross.any()


@pytest.mark.parametrize("dt", [0.1, 0.7])
def test_the_covariance_moves_with_the_state(dt):
    """Against the derivative of an integrated turn; the kernel's transition is of second order in the step."""
    rng = np.random.default_rng(4)
    x = np.tile([10.0, -20, -100, 22, 9, -1.5, -0.4, 0.9, 0.1], (HYPOTHESES, 1))
    cross = rng.normal(size=(HYPOTHESES, 9, BIASES))
    cross[STRAIGHT, 6:] = 0.0
    kept = np.array([1.0, 1.0, 1.0, 1.0])
    kept[:2] = np.exp(-dt / POSITION_TIME_S)
    eye = 1e-4 * np.eye(9)
    slope = np.array([(imm.fly(x[1] + d, dt) - imm.fly(x[1] - d, dt)) / 2e-4 for d in eye]).T
    straight = np.eye(9)
    straight[:3, 3:6] = dt * np.eye(3)
    expected = [(straight if j == STRAIGHT else slope) @ cross[j] * kept for j in range(HYPOTHESES)]
    predict_cross(dt, x, cross, np.zeros((9, 9)), np.zeros((HYPOTHESES, 9)))
    np.testing.assert_allclose(cross, expected, atol=0.02 * dt)


@pytest.mark.parametrize("age", [-0.4, 0.0, 0.3, 2.5])
def test_rows_are_the_derivatives_of_a_report(age):
    rng = np.random.default_rng(5)
    x = 10.0 * rng.normal(size=9)
    expected_h, expected_g = naive.report_slopes(x, age)
    h, g = np.zeros(9), np.zeros(BIASES)
    for k in range(6):
        element_rows(k, age, x, True, h, g)
        np.testing.assert_allclose(h, expected_h[k], atol=1e-6)
        np.testing.assert_allclose(g, expected_g[k], atol=1e-6)
        element_rows(k, age, x, False, h, g)
        assert not h[6:].any()


def test_joint_and_element_variances():
    rng = np.random.default_rng(6)
    p, c = joint(rng)
    h, g = rng.normal(size=(2, 9)), rng.normal(size=(2, BIASES))
    rows = np.hstack([h, g])
    expected = rows @ np.block([[p, c], [c.T, np.diag(BIAS)]]) @ rows.T
    for a in range(2):
        for b in range(2):
            assert joint_variance(9, p, c, BIAS, h, g, a, b) == pytest.approx(expected[a, b])
    x = rng.normal(size=9)
    assert element_variance(1, x, np.ones(6), 0.5) == pytest.approx(1.0 + 0.25 * x[4] ** 2)
    assert element_variance(4, x, np.ones(6), 0.5) == 1.0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("k", "pair"), [(0, True), (2, False), (5, False), (3, True)])
def test_distance_is_that_of_the_best_hypothesis(seed, k, pair):
    bank, z, r = made_bank(seed)
    elements = [k, k + 1] if pair else [k]
    z = z + 4.0
    expected = min(
        naive.innovation_square(bank.x[0, j], bank.p[0, j], bank.cross[0, j], BIAS, elements, 0.7, z, r, 0.1)
        for j in range(HYPOTHESES)
    )
    got = distance_square(bank, 0, k, pair, 0.7, z, r, 0.1, BIAS, make_report_scratch())
    assert got == pytest.approx(expected, rel=1e-6)


def test_each_group_is_judged_by_itself_unless_the_position_is_wrong():
    bank, z, r = made_bank(1)
    s = make_report_scratch()

    def codes(change):
        judge(bank, 0, 0.7, change, r, 0.1, BIAS, 25.0, s)
        return [int(s.codes[k]) for k in (POSITION, ALTITUDE, CLIMB, VELOCITY)]

    assert codes(z) == [ACCEPTED] * 4
    assert codes(z + np.array([0, 0, 900.0, 0, 0, 0])) == [ACCEPTED, REJECTED, ACCEPTED, ACCEPTED]
    assert codes(z + np.array([0, 0, 0, 90.0, 0, 0])) == [ACCEPTED, ACCEPTED, ACCEPTED, REJECTED]
    assert codes(z + np.array([0, 0, 0, 0, 0, 90.0])) == [ACCEPTED, ACCEPTED, REJECTED, ACCEPTED]
    assert codes(z + np.array([900.0, 0, 0, 0, 0, 0])) == [REJECTED, ABSENT, ABSENT, ABSENT]
    lacking = z.copy()
    lacking[[0, 2, 5]] = np.nan
    assert codes(lacking) == [ABSENT, ABSENT, ABSENT, ACCEPTED] and not known(lacking, POSITION)


@pytest.mark.parametrize("seed", range(4))
def test_a_report_updates_all_hypotheses_one_element_after_the_other(seed):
    bank, z, r = made_bank(seed)
    s = make_report_scratch()
    s.codes[:] = ACCEPTED
    s.codes[CLIMB] = REJECTED
    expected, value = [], np.zeros(HYPOTHESES)
    for j in range(HYPOTHESES):
        n = 6 if j == STRAIGHT else 9
        x, p, c = bank.x[0, j].copy(), bank.p[0, j, :n, :n].copy(), bank.cross[0, j, :n].copy()
        for k in range(5):
            h, g = naive.report_slopes(x, 0.7)
            noise = r[k] + (0.1 * x[3 + k]) ** 2 * (k < 3)
            x[:n], p, c, likelihood = naive.consider(x[:n], p, c, h[k, :n], g[k], BIAS, z[k], noise)
            value[j] += likelihood
        expected.append((n, x, p, c))
    mu = bank.mu[0] * np.exp(value - value.max())
    absorb_report(bank, 0, 0.7, z, r, 0.1, BIAS, s)
    for j, (n, x, p, c) in enumerate(expected):
        np.testing.assert_allclose(bank.x[0, j], x, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(bank.p[0, j, :n, :n], p, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(bank.cross[0, j, :n], c, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(bank.mu[0], mu / mu.sum(), atol=1e-5)


def test_a_first_report_makes_a_track_that_shares_its_errors_with_the_biases():
    bank, latency = made_bank(2)[0], 0.3
    z, variance = np.array([100.0, 200, -300, 50, -60, 2]), np.array([25.0, 25, 9])
    rates = np.array([4.0, 4.0, 5.0])
    for axis in range(3):
        start_axis(bank, 0, axis, z[axis], variance[axis], z[3 + axis], rates[axis], latency, BIAS, MOTION)
    x, p, c = naive.first_track(z, variance, rates, latency, BIAS)
    for j in range(HYPOTHESES):
        np.testing.assert_allclose(bank.x[0, j, :6], x)
        np.testing.assert_allclose(bank.cross[0, j, :6], c, atol=1e-9)
        second_order = np.diag(np.concatenate([BIAS[3] * rates, np.zeros(3)]))
        np.testing.assert_allclose(bank.p[0, j, :6, :6], p + second_order, atol=1e-9)
        assert np.linalg.eigvalsh(bank.p[0, j]).min() > -1e-9
