"""Predictions of other vehicles' courses against fine grids of time and full matrices."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import cas_parts as naive
from wideberth.avoidance.cas import prediction_kernels as kernels
from wideberth.avoidance.cas.config import PredictionConfig
from wideberth.avoidance.cas.vehicle_estimate import ReceivedState, VehicleEstimate
from wideberth.avoidance.cas.vehicle_message import Health

vectors = st.tuples(*[st.floats(-30, 30)] * 3).map(lambda x: np.round(x, 3))
slow = st.tuples(*[st.floats(-3, 3)] * 3).map(lambda x: np.round(x, 3))
accelerations = st.one_of(st.just(np.zeros(3)), slow, slow.map(lambda a: 0.1 * a))
NONE = np.full(3, np.nan)


@given(vectors, slow, accelerations, st.sampled_from([0.0, 2.0, 60.0]), st.sampled_from([1.0, 20.0]))
def test_the_closest_point_of_an_accelerated_course_is_that_of_a_fine_grid(
    p: Any, v: Any, a: Any, hold: float, lookahead: float
) -> None:
    t, d = kernels.accelerated_closest_point(p[0], p[1], p[2], v[0], v[1], v[2], a[0], a[1], a[2], hold, lookahead)
    times = np.linspace(0.0, lookahead, 20_001)
    places = naive.accelerated(p, v, a, hold, times)
    _, expected = naive.closest_of(places, times)
    fastest = float(np.linalg.norm(v) + np.linalg.norm(a) * lookahead)
    assert d <= expected + 1e-6
    assert d >= expected - fastest * lookahead / 20_000 - 1e-6
    assert 0.0 <= t <= lookahead
    assert np.linalg.norm(naive.accelerated(p, v, a, hold, np.array([t]))[0]) == pytest.approx(d, abs=1e-6)


paths = st.lists(st.tuples(st.floats(0.5, 8.0), vectors), min_size=0, max_size=4)


def nodes_of(start: Any, legs: Any) -> Any:
    rows = [[0.0, *start]]
    for duration, place in legs:
        rows.append([rows[-1][0] + round(duration, 2), *place])
    return np.array(rows)


@given(vectors, paths, vectors, paths, st.sampled_from([5.0, 40.0]))
def test_the_closest_point_of_two_paths_is_that_of_a_fine_grid(
    own: Any, own_legs: Any, other: Any, other_legs: Any, lookahead: float
) -> None:
    a, b, at = nodes_of(own, own_legs), nodes_of(other, other_legs), np.empty(3)
    t, d = kernels.paths_closest_point(a, b, lookahead, at)
    times = np.linspace(0.0, lookahead, 40_001)
    _, expected = naive.closest_of(naive.along(a, times) - naive.along(b, times), times)
    here = (naive.along(a, np.array([t])) - naive.along(b, np.array([t])))[0]
    assert here == pytest.approx(at, abs=1e-6)
    assert np.linalg.norm(here) == pytest.approx(d, abs=1e-6)
    fastest = 2 * 60.0 * math.sqrt(3) / 0.5
    assert expected - fastest * lookahead / 40_000 <= d <= expected + 1e-6


@pytest.mark.parametrize("accelerates", [False, True])
@given(st.lists(st.tuples(st.floats(0.05, 3.0), st.booleans(), st.booleans(), slow), min_size=1, max_size=4))
def test_the_filter_is_the_one_of_full_matrices(accelerates: bool, rows: Any) -> None:
    order, density = (3, 0.3) if accelerates else (2, 0.2)
    spread, variances = np.array([0.5, 2.0, 1.0]), np.array([0.4, 0.1, 0.2])
    x, c = np.zeros((3, 4)), np.zeros((3, 4, 4))
    for k in range(order):
        c[:, k, k] = spread[k]
    phi, q = np.zeros((2, 4, 4))
    time, messages = 0.0, [(0.0, NONE, variances)]
    for dt, has_velocity, has_acceleration, values in rows:
        measured = np.full((3, 3), np.nan)
        measured[0] = values
        if has_velocity:
            measured[1] = -values
        if has_acceleration and accelerates:
            measured[2] = 0.5 * values
        kernels.filter_message(x, c, dt, density, accelerates, measured, variances, phi, q)
        time += dt
        messages.append((time, measured[:, 1], variances))
    expected, covariance = naive.kalman(messages, np.zeros(3), spread, density, order)
    assert x[1, :order] == pytest.approx(expected, abs=2e-3)
    assert c[1, :order, :order] == pytest.approx(covariance, abs=3e-3)


def state(time: float, position: Any, velocity: Any = NONE, acceleration: Any = NONE, **changes: Any) -> ReceivedState:
    fields: dict[str, Any] = {
        "time": time, "measured": np.array([position, velocity, acceleration], float), "position_sigma": 0.3,
        "waypoints": np.zeros((0, 4)), "z_wanted": math.nan, "cooperates": True, "avoidance_rate": math.nan,
        "health": Health.NOMINAL,
    }  # fmt: skip
    return ReceivedState(**{**fields, **changes})


@pytest.mark.parametrize("kind", ["constant_velocity", "constant_acceleration", "kalman", "kalman_acceleration"])
@pytest.mark.parametrize("intent", [False, True])
def test_controllers_are_shown_a_straight_course_with_the_predicted_pass(kind: str, intent: bool) -> None:
    random = np.random.default_rng(3)
    config = PredictionConfig(kind=kind, intent=intent, acceleration_hold_s=4.0, intent_tolerance_mps=1e3)
    for _ in range(200):
        p, v, a = random.normal(size=3) * 20, random.normal(size=3), random.normal(size=3) * 0.3
        waypoints = np.array([[4.0, *(p + random.normal(size=3) * 9)], [15.0, *(p + random.normal(size=3) * 9)]])
        one = VehicleEstimate(config, 1.0, state(0.0, p, v, a, waypoints=waypoints))
        own = np.concatenate([random.normal(size=3) * 20, random.normal(size=3)])
        passing = one.predict(0.5, own)
        rel, vel = own[:3] - passing.position, own[3:] - passing.velocity
        if 1e-6 < passing.t_star < config.lookahead_s - 1e-6:
            vv = float(vel @ vel)
            if vv > 1e-9:
                assert -(rel @ vel) / vv == pytest.approx(passing.t_star, rel=1e-6, abs=1e-6)
            assert np.linalg.norm(rel + vel * passing.t_star) == pytest.approx(passing.d_star, abs=1e-6)
        times = np.linspace(0.0, config.lookahead_s, 30_001)
        if intent:
            nodes = np.vstack([[0.0, *(p + v * 0.5 + (a * 0.125 if "acceleration" in kind else 0))], waypoints])
            nodes[1:, 0] -= 0.5
            places = naive.along(nodes, times)
        else:
            curved = a if "acceleration" in kind else np.zeros(3)
            begun = p + v * 0.5 + curved * 0.125
            places = naive.accelerated(begun, v + curved * 0.5, curved, config.acceleration_hold_s - 0.5, times)
        _, expected = naive.closest_of(own[:3] + own[3:] * times[:, None] - places, times)
        if passing.t_star <= config.lookahead_s:
            assert passing.d_star == pytest.approx(expected, abs=0.03)
        assert (passing.variance > 0) == kind.startswith("kalman")


def test_a_filter_finds_velocities_from_positions_alone_and_knows_how_well() -> None:
    random = np.random.default_rng(5)
    config = PredictionConfig(kind="kalman", acceleration_density_m2ps3=1e-4, own_position_sigma_m=0.0)
    squares = []
    for _ in range(300):
        v, p = random.normal(size=3), random.normal(size=3) * 20
        one = VehicleEstimate(config, 1.0, state(0.0, p + 0.3 * random.normal(size=3)))
        for k in range(1, 41):
            v = v + math.sqrt(1e-4 * 0.25) * random.normal(size=3)
            p = p + v * 0.25
            one.take(state(0.25 * k, p + 0.3 * random.normal(size=3)))
        error = one.position_at(10.0) - p
        # A parallel own vehicle far away: the pass is now, with the variance of now.
        passing = one.predict(10.0, np.concatenate([p + 100.0, one.velocity()]))
        squares.append(error @ error / passing.variance)
        assert one.velocity() == pytest.approx(v, abs=0.35)
    # 900 degrees of freedom: 99.99 % of the time the sum lies within 3.9 standard deviations of sqrt(1800).
    assert sum(squares) == pytest.approx(900, abs=3.9 * math.sqrt(1800))


@pytest.mark.parametrize(("health", "factor"), [(Health.DEGRADED, 3.0), (Health.FAILED, 10.0)])
def test_health_messages_widen_the_spread(health: Health, factor: float) -> None:
    config = PredictionConfig(kind="kalman", own_position_sigma_m=0.0)
    own = np.array([10.0, 0, 0, -1.0, 0, 0])
    variances = []
    for value in (Health.NOMINAL, health):
        one = VehicleEstimate(config, 1.0, state(0.0, [0.0, 0, 0], [0.0, 0, 0], health=value))
        variances.append(one.predict(0.0, own).variance)
    certain = 0.3**2 + 10.0**2 * config.velocity_sigma_mps**2
    grown = config.acceleration_density_m2ps3 * 10.0**3 / 3
    assert variances == pytest.approx([certain + grown, certain + factor**2 * grown])


def test_fewer_satellites_are_trusted_less() -> None:
    config = PredictionConfig(kind="kalman")
    moved = []
    for sigma in (0.3, 3.0):
        one = VehicleEstimate(config, 1.0, state(0.0, [0.0, 0, 0], [0.0, 0, 0]))
        one.take(state(1.0, [2.0, 0, 0], position_sigma=sigma))
        moved.append(one.position_at(1.0)[0])
    assert moved[0] > 0.5 and moved[1] < 0.2


def test_intent_shows_that_the_other_turns_away() -> None:
    # Figure 4.1: head-on by their velocities, but the other will turn at its next waypoint.
    waypoints = np.array([[5.0, 20.0, 0.0, -15.0], [25.0, 20.0, 30.0, -15.0]])
    own = np.array([-10.0, 0, -15, 1.0, 0, 0])
    first = state(0.0, [27.5, 0, -15], [-1.5, 0, 0], waypoints=waypoints)
    assert VehicleEstimate(PredictionConfig(), 1.0, first).predict(0.0, own).d_star == pytest.approx(0.0, abs=1e-9)
    passing = VehicleEstimate(PredictionConfig(intent=True), 1.0, first).predict(0.0, own)
    assert passing.d_star > 15.0


def test_without_velocities_the_states_received_give_differences() -> None:
    one = VehicleEstimate(
        PredictionConfig(kind="constant_acceleration", acceleration_hold_s=4.0), 1.0, state(0.0, [0.0, 0, 0])
    )
    one.take(state(1.0, [1.0, 0, 0]))
    one.take(state(2.0, [2.5, 0, 0]))
    assert one.velocity()[0] == pytest.approx(1.5)
    # Half a metre a second faster within a second.
    assert one.position_at(4.0)[0] == pytest.approx(2.5 + 2 * 1.5 + 0.5 * 0.5 * 4)
