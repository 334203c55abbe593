"""The turn with which a path is begun: against its twin, and against what a point mass flies."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import waypoint_paths as naive
from wideberth.avoidance.waypoint_paths import first_turn_kernels as ftk
from wideberth.vehicles import kernels as vk
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import parameters

DRONE = parameters(
    PointMassConfig(speed_min_mps=9.0, speed_max_mps=17.0, climb_rate_max_mps=4.0, sink_rate_max_mps=4.0)
)


def begun(points, course, radius, inertia=(0.0,) * ftk.N_INERTIA):
    points = np.array(points, float)
    out, times = np.empty((len(points) + ftk.PLACES, 3)), np.empty(len(points) + ftk.PLACES)
    n, length = ftk.flown_times(points, len(points), course, radius, np.array(inertia), 13.0, out, times)
    assert length == pytest.approx(13.0 * times[n - 1])
    return out[:n], times[:n]


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_it_does_what_its_twin_does(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-200.0, 200.0, (int(rng.integers(2, 5)), 3))
    course, radius = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(10.0, 80.0))
    state = np.array([0.0, 0.0, 0.0, 13.0, 0.0, rng.choice([0.0, rng.uniform(-0.6, 0.6)]), rng.uniform(-4.0, 4.0)])
    inertia = ftk.inertia_of(state, DRONE, 13.0)
    found, times = begun(points, course, radius, inertia)
    twin = naive.begun_places(points, course, radius, ftk.TURN_LEAST, ftk.TURN_MOST, ftk.PIECE, tuple(inertia[:3]))
    np.testing.assert_allclose(found[1 : len(twin) + 1, :2], twin, atol=1e-6)
    # Height is wanted by the way along the leg, and of the way to the waypoint as much as the climb takes to settle.
    level = np.vstack([points[0, :2], twin])
    to_waypoint = points[1, :2] - level[-1]
    settled = min(2.0 * inertia[ftk.LAG] / np.linalg.norm(to_waypoint), 1.0)
    level = np.vstack([level, level[-1] + settled * to_waypoint])
    leg = points[1, :2] - points[0, :2]
    wanted = points[0, 2] + np.clip((level - points[0, :2]) @ leg / (leg @ leg), 0.0, 1.0) * (
        points[1, 2] - points[0, 2]
    )
    wanted[-1] = wanted[-2] + settled * (points[1, 2] - wanted[-2])
    ways = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(level, axis=0), axis=1))))
    heights = naive.lagging_heights(ways, wanted, inertia[ftk.SLOPE], inertia[ftk.LAG])
    np.testing.assert_allclose(found[: len(twin) + 1, 2], heights[:-1], atol=1e-3)
    lags = abs((heights[-1] - wanted[-1]) - (heights[-2] - wanted[-2]))
    inserted = len(found) - len(points) - len(twin)
    assert inserted == (settled < 1.0 and lags > ftk.LAG_LEAST)
    if inserted:
        np.testing.assert_allclose(found[len(twin) + 1], [*level[-1], heights[-1]], atol=1e-3)
    # The rest is as it is, but for what of the height is not caught up with yet.
    np.testing.assert_array_equal(found[-len(points) + 1 :, :2], points[1:, :2])
    before, down = found[-len(points)], wanted[-1] if inserted else wanted[-2]
    below = before[2] - down
    for place, there in zip(found[-len(points) + 1 :], points[1:], strict=True):
        way = np.linalg.norm(place[:2] - before[:2])
        below = naive.caught_up(below, (there[2] - down) / way, way, *inertia[ftk.CATCH_UP :])
        assert place[2] - there[2] == pytest.approx(below, abs=5e-3)
        below = below if abs(below) >= ftk.LAG_LEAST else 0.0
        before, down = place, there[2]
    np.testing.assert_allclose(times[1:], np.cumsum(np.linalg.norm(np.diff(found, axis=0), axis=1)) / 13.0, atol=1e-6)


def test_without_a_turn_a_path_stays_as_it_is():
    points = [[0.0, 0.0, -200.0], [200.0, 20.0, -210.0], [300.0, 200.0, -200.0]]
    for course in (0.0, math.atan2(20.0, 200.0), math.nan):
        np.testing.assert_array_equal(begun(points, course, 30.0)[0], points)
    # Inside the turn, and where the ownship is.
    for place in ([0.0, 20.0, -200.0], [0.0, 0.0, -200.0]):
        np.testing.assert_array_equal(begun([points[0], place], 0.0, 30.0)[0], [points[0], place])


@pytest.mark.parametrize("turn", [30.0, 60.0, 90.0, -90.0, 120.0, 150.0])
def test_it_is_near_what_a_point_mass_flies(turn):
    """A leg of 160 m, begun at an angle: the leg itself is up to 86 m from what is flown."""
    p = parameters(PointMassConfig(speed_min_mps=9.0, speed_max_mps=17.0, climb_rate_max_mps=4.0))
    p[vk.P_CAPTURE] = math.inf
    away = math.radians(turn)
    ahead = np.array([math.cos(away), math.sin(away), 0.0])
    points = np.array([[0.0, 0.0, -200.0]]) + np.array([[0.0], [160.0], [480.0]]) * ahead
    flown = np.empty((120, vk.N_STATES))
    state = np.array([0.0, 0.0, -200.0, 13.0, 0.0, 0.0, 0.0])
    vk.fly_path(state, points, np.full(3, 13.0), 1, p, np.zeros(3), 0.1, len(flown), flown)
    path, times = begun(points[:2], 0.0, vk.turn_radius(13.0, 0.8 * p[vk.P_BANK_MAX]))
    t = 0.1 * np.arange(1, len(flown) + 1)
    expected = np.column_stack([np.interp(t, times, path[:, k]) for k in range(2)])
    until = t <= 160.0 / 13.0
    off = np.linalg.norm(flown[until, :2] - expected[until], axis=1)
    straight = np.linalg.norm(flown[until, :2] - 13.0 * t[until, None] * ahead[:2], axis=1)
    assert off.max() < 13.0 and off.max() < 0.8 * straight.max()


def compared(turn, bank, height, climb=0.0):
    """Return how far at most a begun path is from what a point mass flies, and how much higher (m, negative)."""
    p = DRONE.copy()
    p[vk.P_CAPTURE] = math.inf
    away = math.radians(turn)
    ahead = np.array([math.cos(away), math.sin(away), 0.0])
    points = np.array([[0.0, 0.0, -200.0]]) + np.array([[0.0], [160.0], [480.0]]) * ahead
    points[1:, 2] -= height
    flown = np.empty((120, vk.N_STATES))
    state = np.array([0.0, 0.0, -200.0, 13.0, 0.0, math.radians(bank), climb])
    state_then = state.copy()
    vk.fly_path(state, points, np.full(3, 13.0), 1, p, np.zeros(3), 0.1, len(flown), flown)
    path, times = begun(
        points[:2], 0.0, vk.turn_radius(13.0, 0.8 * p[vk.P_BANK_MAX]), ftk.inertia_of(state_then, p, 13.0)
    )
    t = 0.1 * np.arange(1, len(flown) + 1)
    expected = np.column_stack([np.interp(t, times, path[:, k]) for k in range(3)])
    higher = np.sign(height) * (expected[:, 2] - flown[:, 2])
    return np.linalg.norm(flown[:, :2] - expected[:, :2], axis=1).max(), higher.min()


@pytest.mark.parametrize("turn", [30.0, 60.0, 90.0, 120.0, -90.0])
def test_a_turn_to_the_other_side_begins_once_the_ownship_has_rolled_out(turn):
    """Begun at once it would be 15 to 40 m nearer to the leg."""
    off, _ = compared(turn, -math.copysign(35.0, turn), 0.0)
    assert off < 13.0
    same, _ = compared(turn, math.copysign(35.0, turn), 0.0)
    assert same < 20.0


@pytest.mark.parametrize("bank", [-35.0, 0.0, 35.0])
@pytest.mark.parametrize("height", [-45.0, 45.0])
def test_a_turn_gains_only_as_much_height_as_it_leads_along_the_leg(bank, height):
    """By the way flown the path would be 10 m higher than the ownship after a turn by 120 degrees."""
    _, least = compared(120.0, bank, height)
    assert least > -5.0


def test_a_waypoint_right_above_is_climbed_to_from_where_the_ownship_has_rolled_out():
    banked = np.array([0.0, 0.0, -100.0, 13.0, 0.0, math.radians(35.0), 0.0])
    path, times = begun([[0.0, 0.0, -100.0], [0.0, 0.0, -150.0]], 0.0, 20.0, ftk.inertia_of(banked, DRONE, 13.0))
    assert np.isfinite(path).all() and np.isfinite(times).all()
    np.testing.assert_allclose(path[-1], [0.0, 0.0, -150.0])


@pytest.mark.parametrize("turn", [0.0, 60.0, 120.0])
@pytest.mark.parametrize(("climb", "height"), [(-3.0, 40.0), (3.0, -40.0), (0.0, 40.0)])
def test_a_climb_is_begun_from_the_climb_rate_of_now(turn, climb, height):
    """From a descent of 3 m/s the ownship would be up to 7 m lower than the path after some seconds."""
    _, least = compared(turn, 0.0, height, climb)
    assert least > -2.5


def test_a_height_that_lags_is_caught_up_with_only_as_fast_as_it_can_be():
    """Out of a climb at the limit into a descent at nearly the limit: too high for long."""
    _, least = compared(60.0, 0.0, -44.0, 4.0)
    assert least > -2.4
