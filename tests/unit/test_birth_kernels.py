"""New tracks: the fit against weighted least squares, the pairs against their rule, and no births from noise."""

import math

import numpy as np
import pytest

from tests.made_windows import SIGMA, flight, plot_of, window_of
from tests.naive import multi_target as naive
from wideberth.tracking.multi_target.birth_kernels import birth, consensus, reachable
from wideberth.tracking.multi_target.fit_kernels import begin_fit, fit_plot, look_back, make_fit_scratch, refit
from wideberth.tracking.radar_kernels import plot_covariance, to_plot, to_position

SPEED_SIGMA, SPEED_MAX, GATE = 30.0, 100.0, 18.0


def give(window, m=0, prior=-5.0, least=3, budget=1000):
    s = make_fit_scratch(len(window.t))
    return birth(window, m, 5, SPEED_SIGMA, SPEED_MAX, GATE, prior, least, 0.0, budget, s), s


@pytest.mark.parametrize("seed", range(3))
def test_the_second_fit_is_weighted_least_squares(seed):
    rng = np.random.default_rng(seed)
    plots, truth = flight(rng, 8)
    window = window_of([[z] for z in plots])
    s = make_fit_scratch(8)
    s.x[:] = truth
    s.chosen[:] = 0
    refit(window, 7, SPEED_SIGMA, s)
    places, covariances = [], []
    t = window.t - window.t[7]
    for k, z in enumerate(plots):
        place, spread, at = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
        to_position(np.zeros(3), np.eye(3), *z[:3], place)
        to_plot(truth[:3] + t[k] * truth[3:], at)
        plot_covariance(np.eye(3), *at, SIGMA, spread)
        places.append(place)
        covariances.append(spread)
    x, p = naive.straight_line_fit(t, np.array(places), np.array(covariances), SPEED_SIGMA)
    # The tangent plane and the sphere differ by some 0.1 m at 1 deg and 350 m.
    np.testing.assert_allclose(s.x[:3], x[:3], atol=0.5)
    assert np.abs(s.x - x) @ np.linalg.solve(p, np.abs(s.x - x)) < 1.0
    np.testing.assert_allclose(np.sqrt(np.diag(s.p)), np.sqrt(np.diag(p)), rtol=0.02)


def test_a_fit_is_the_same_in_any_order():
    plots, truth = flight(np.random.default_rng(5), 4)
    window = window_of([[z] for z in plots])
    ends = []
    for order in ((2, 1, 0), (0, 1, 2)):
        s = make_fit_scratch(4)
        begin_fit(window, 3, 0, SPEED_SIGMA, s)
        for k in order:
            look_back(window, k, window.t[k] - window.t[3], s)
            fit_plot(window, k, 0, window.t[k] - window.t[3], s.x, s.p, s)
        ends.append((s.x.copy(), np.sqrt(np.diag(s.p))))
    # Not to the last digit, as directions are taken where the fit stands: a third of a sigma.
    assert (np.abs(ends[0][0] - ends[1][0]) < 0.33 * ends[0][1]).all()
    np.testing.assert_allclose(ends[0][1], ends[1][1], rtol=0.05)
    assert np.linalg.norm(ends[0][0][:3] - truth[:3]) < 25.0


def test_births_are_honest():
    """Mean of the normalised error squared over 300 births: 6 within four standard errors."""
    rng, squares = np.random.default_rng(6), []
    for _ in range(300):
        velocity = rng.normal(size=3) * [15.0, 15.0, 5.0]
        plots, truth = flight(rng, 6, velocity=velocity)
        (_, hits, _), s = give(window_of([[z] for z in plots]))
        if hits:
            e = s.x - truth
            squares.append(e @ np.linalg.solve(s.p, e))
    assert len(squares) > 290
    assert np.mean(squares) == pytest.approx(6.0, abs=4 * math.sqrt(12 / 300) + 0.3)


def test_a_birth_uses_its_plots_up():
    plots, _ = flight(np.random.default_rng(7), 6)
    window = window_of([[z] for z in plots])
    (odds, hits, _), s = give(window)
    assert hits == 6 and odds > 10.0 and window.used[:, 0].all() and (s.chosen == 0).all()
    assert give(window)[0][1] == 0


def test_the_flight_is_found_among_false_plots():
    rng = np.random.default_rng(8)
    plots, truth = flight(rng, 10)
    scans = []
    for k, z in enumerate(plots):
        false = [
            [600 * rng.random() ** (1 / 3), rng.uniform(-3.1, 3.1), math.asin(rng.random()), math.nan]
            for _ in range(20)
        ]
        scans.append([*false, z] if k % 4 else [*false, z][: 21 - (k == 4)])
    window = window_of(scans, density=2.2e-8)
    found = []
    for m in range(window.filled[window.cursor[0]]):
        (odds, hits, _), s = give(window, m, prior=math.log(0.05 / 20), least=3)
        if hits and odds > 7.0:
            found.append(s.x.copy())
    assert len(found) == 1
    assert np.linalg.norm(found[0][:3] - truth[:3]) < 15.0


def test_two_plots_and_false_plots_alone_are_no_birth():
    plots, _ = flight(np.random.default_rng(9), 6)
    scans = [[], [], [], [], [plots[4]], [plots[5]]]
    assert give(window_of(scans))[0][1] == 0
    rng, born = np.random.default_rng(10), 0
    for _ in range(20):
        scans = [
            [[600 * rng.random() ** (1 / 3), rng.uniform(-3.1, 3.1), math.asin(rng.random()), math.nan]] * 1
            for _ in range(15)
        ]
        (odds, hits, _), _ = give(window_of(scans))
        born += bool(hits) and odds > 7.0
    assert born == 0


def test_pairs_must_be_within_reach():
    p = np.array([300.0, 0.0, -100.0])
    cases = [
        (p + np.array([5.0, 0, 0]), None, True),
        (p + np.array([60.0, 0, 0]), None, False),
        (p + np.array([0, 40.0, 0]), None, True),
        (p + np.array([0, 120.0, 0]), None, False),
    ]
    for other, velocity, expected in cases:
        window = window_of([[plot_of(other)], [plot_of(p, None, velocity)]])
        assert reachable(window, 1, 0, 0, 0, 0.1, SPEED_MAX, 4.0) is expected


def test_the_range_rate_rules_pairs_out():
    p = np.array([300.0, 0.0, -100.0])
    opening = p / np.linalg.norm(p)
    for shift, expected in ((3.0, True), (-9.0, False)):
        # It says 30 m/s outwards: 0.1 s ago it was 3 m nearer.
        window = window_of([[plot_of(p - shift * opening)], [plot_of(p, None, 30.0 * opening)]], dt=0.1)
        assert reachable(window, 1, 0, 0, 0, 0.1, SPEED_MAX, 1.0) is expected


def test_the_range_rate_is_relative_to_a_sensor_that_moves():
    p = np.array([300.0, 0.0, -100.0])
    opening = p / np.linalg.norm(p)
    window = window_of([[plot_of(p)], [plot_of(p, None, -30.0 * opening)]], dt=0.1)
    assert not reachable(window, 1, 0, 0, 0, 0.1, 20.0, 0.5)
    window.velocity[1] = 30.0 * opening
    assert reachable(window, 1, 0, 0, 0, 0.1, 20.0, 0.5)


def test_range_rates_sharpen_the_velocity():
    rng = np.random.default_rng(11)
    spread = []
    for rates in (False, True):
        plots, truth = flight(rng, 4, rates=rates)
        (_, hits, _), s = give(window_of([[z] for z in plots]))
        assert hits == 4
        u = truth[:3] / np.linalg.norm(truth[:3])
        spread.append(math.sqrt(u @ s.p[3:, 3:] @ u))
    assert spread[1] < 0.5 * spread[0]


def test_the_score_is_the_sum_over_hits_and_misses():
    """Hand count for three hits with one miss between, against the kernel."""
    plots, _ = flight(np.random.default_rng(12), 4)
    window = window_of([[plots[0]], [], [plots[2]], [plots[3]]])
    s = make_fit_scratch(4)
    score, hits = consensus(window, 3, 0, 2, 0, SPEED_SIGMA, SPEED_MAX, GATE, s)
    t = make_fit_scratch(4)
    begin_fit(window, 3, 0, SPEED_SIGMA, t)
    expected = math.log(1 - 0.8)
    for k in (2, 0):
        look_back(window, k, window.t[k] - window.t[3], t)
        _, log_likelihood = fit_plot(window, k, 0, window.t[k] - window.t[3], t.x, t.p, t)
        expected += log_likelihood + math.log(0.8) - math.log(1e-8)
    assert hits == 3 and score == pytest.approx(expected, abs=1e-6)


def test_the_budget_is_kept():
    rng = np.random.default_rng(13)
    scans = [[plot_of(np.array([300.0, 0.0, -100.0]) + rng.normal(size=3)) for _ in range(20)] for _ in range(4)]
    (_, _, tried), _ = give(window_of(scans), budget=7)
    assert tried == 7


def test_plots_without_elevation_give_birth_in_the_plane():
    plots, truth = flight(np.random.default_rng(14), 6, start=(300.0, 100.0, -5.0))
    for z in plots:
        z[2] = math.nan
    (odds, hits, _), s = give(window_of([[z] for z in plots]))
    assert hits == 6 and odds > 5.0
    assert np.linalg.norm(s.x[:2] - truth[:2]) < 40.0 and math.sqrt(s.p[2, 2]) > 50.0
