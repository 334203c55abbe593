"""Straight-line following: joining, turning, passing and completing."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.naive import vehicles as naive
from wideberth.vehicles import kernels
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import parameters

FloatArray = NDArray[np.float64]
P = parameters(PointMassConfig())
CALM = np.zeros(3)


def state(north: float, east: float, altitude: float, course_deg: float, speed: float = 41.0) -> FloatArray:
    return np.array([north, east, -altitude, speed, math.radians(course_deg), 0.0, 0.0])


def fly(
    x: FloatArray,
    waypoints: Sequence[tuple[float, float, float]],
    seconds: float,
    index: int = 1,
    wind: FloatArray = CALM,
    speed: float = 41.0,
    p: FloatArray = P,
) -> tuple[FloatArray, int]:
    """Waypoints as north, east, altitude."""
    points = np.array(waypoints) * [1.0, 1.0, -1.0]
    n = round(seconds / 0.1)
    out = np.empty((n, 7))
    index = kernels.fly_path(x, points, np.full(len(points), speed), index, p, wind, 0.1, n, out)
    return out, index


@pytest.mark.parametrize("speed", [31.0, 41.0, 45.0])
@pytest.mark.parametrize("offset", [50.0, 300.0, 2000.0])
def test_line_is_joined_without_overshoot(offset: float, speed: float) -> None:
    out, _ = fly(state(0, offset, 300, 0, speed), [(0, 0, 300), (20000, 0, 300)], 150, speed=speed)
    assert out[:, 1].min() > -max(2.0, 0.01 * offset)
    assert abs(out[-1, 1]) < 1.0


def test_line_is_joined_from_anywhere_at_any_course() -> None:
    for bearing in range(0, 360, 45):
        for course in range(0, 360, 60):
            x = state(3000 * math.cos(bearing), 3000 * math.sin(bearing), 300, course)
            out, index = fly(x, [(0, 0, 300), (9000, 0, 300)], 480)
            assert index == 2, (bearing, course)
            assert np.hypot(out[:, 0] - 9000, out[:, 1]).min() < 520


@pytest.mark.parametrize("bearing", range(0, 360, 60))
@pytest.mark.parametrize("distance", [10.0, 200.0, 600.0, 4000.0])
def test_first_waypoint_is_joined_from_anywhere_and_not_circled(bearing: int, distance: float) -> None:
    a = math.radians(bearing)
    x = state(distance * math.cos(a), distance * math.sin(a), 300, 0)
    _, index = fly(x, [(0, 0, 300), (0, 4000, 300)], distance / 41 + 200, index=0)
    assert index == 2


@pytest.mark.parametrize("turn", [20.0, 60.0, 90.0, 120.0])
def test_turns_are_anticipated(turn: float) -> None:
    a = math.radians(turn)
    end = (6000 + 6000 * math.cos(a), 6000 * math.sin(a), 300.0)
    out, index = fly(state(0, 0, 300, 0), [(0, 0, 300), (6000, 0, 300), end], 275)
    assert index == 2
    # Offset to the outside of the second leg: what an unanticipated turn would overshoot.
    outside = (out[:, 0] - 6000) * math.sin(a) - out[:, 1] * math.cos(a)
    after = (out[:, 0] - 6000) * math.cos(a) + out[:, 1] * math.sin(a) > 0
    assert outside[after].max() < (40.0 if turn <= 90 else 140.0)
    assert abs(outside[-1]) < 3.0


def test_reversal_is_flown_over_and_back() -> None:
    out, index = fly(state(0, 0, 300, 0), [(0, 0, 300), (5000, 0, 300), (0, 0, 300)], 300)
    assert out[:, 0].max() > 5000.0
    assert index == 3


def test_repeated_waypoints_are_passed_at_once() -> None:
    path = [(0, 0, 300.0), (0, 0, 300.0), (4000, 0, 300.0), (4000, 0, 300.0), (4000, 0, 300.0), (4000, 4000, 300.0)]
    out, index = fly(state(0, 0, 300, 0), path, 220)
    plain, _ = fly(state(0, 0, 300, 0), [path[0], path[2], path[5]], 220)
    assert index == 6
    assert np.abs(out - plain).max() < 1e-9


def test_all_waypoints_at_one_place_complete() -> None:
    out, index = fly(state(0, 0, 300, 30), [(0, 0, 300.0)] * 3, 20)
    assert index == 3 and np.all(np.isfinite(out))


def test_after_the_last_waypoint_course_and_altitude_are_kept() -> None:
    out, index = fly(state(0, 0, 300, 90), [(0, 0, 300), (0, 3000, 350)], 300)
    assert index == 2
    assert out[-1, 4] == pytest.approx(math.pi / 2, abs=1e-4) and out[-1, 2] == pytest.approx(-350, abs=0.1)
    assert out[-1, 1] > 10000


def test_altitude_follows_the_leg() -> None:
    out, _ = fly(state(0, 0, 300, 0), [(0, 0, 300), (8000, 0, 500)], 190)
    # After the lag of the start, the feed-forward leaves no error on the slope.
    on_leg = (out[:, 0] > 1500) & (out[:, 0] < 7500)
    assert np.abs(-out[on_leg, 2] - (300 + out[on_leg, 0] / 40)).max() < 1.0


def test_altitude_error_is_flown_off_within_the_limits_without_overshoot() -> None:
    out, _ = fly(state(0, 0, 500, 0), [(0, 0, 300), (20000, 0, 300)], 120)
    assert out[:, 6].min() >= -5.0 - 1e-9
    assert -out[:, 2].max() > 299.0 and -out[-1, 2] == pytest.approx(300, abs=0.5)


def test_speed_over_ground_is_kept_in_wind() -> None:
    wind = np.array([3.0, 4.0, 0.0])
    out, _ = fly(state(0, 0, 300, 0), [(0, 0, 300), (20000, 0, 300)], 100, wind=wind, speed=38.0)
    assert (out[-1, 0] - out[-11, 0]) / 1.0 == pytest.approx(38.0, abs=0.01)
    assert abs(out[-1, 1]) < 1.0


def test_waypoint_missed_by_far_is_flown_back_to_in_a_mission_only() -> None:
    path = [(0, 0, 300.0), (3000, 0, 300.0), (9000, 0, 300.0)]
    x = state(3500, 1500, 300, 0)
    out, index = fly(x, path, 30)
    assert index == 1
    out, index = fly(x, path, 320)
    assert index == 3 and np.hypot(out[:, 0] - 3000, out[:, 1]).min() < 501
    maneuver = P.copy()
    maneuver[kernels.P_CAPTURE] = math.inf
    _, index = fly(x, path, 1, p=maneuver)
    assert index == 2


def test_speed_to_arrive() -> None:
    x = state(0, 0, 300, 0)
    assert kernels.speed_to_arrive(100.0, x, np.array([300.0, 400.0, 0.0]), 112.5, 30.0, 46.0) == pytest.approx(40.0)
    assert kernels.speed_to_arrive(100.0, x, np.array([300.0, 400.0, 0.0]), 200.0, 30.0, 46.0) == 30.0
    assert kernels.speed_to_arrive(100.0, x, np.array([300.0, 400.0, 0.0]), 100.0, 30.0, 46.0) == 46.0


def test_flying_ahead_keeps_the_start_and_equals_the_loop() -> None:
    x = state(0, 100, 300, 20)
    path = np.array([[0.0, 0.0, -300.0], [2000.0, 0.0, -350.0], [2000.0, 3000.0, -300.0]])
    speeds = np.full(3, 40.0)
    out = np.empty((500, 7))
    index = kernels.fly_path(x, path, speeds, 1, P, CALM, 0.2, 500, out)
    assert np.array_equal(x, state(0, 100, 300, 20))
    y, i, u = x.copy(), 1, np.empty(3)
    for k in range(500):
        i = kernels.follow_path(y, path, speeds, i, P, CALM, u)
        kernels.point_mass_step(y, u, CALM, P, 0.2)
        assert np.array_equal(y, out[k])
    assert i == index


def test_follower_equals_its_naive_twin() -> None:
    random = np.random.default_rng(7)
    indices = set()
    for k in range(1500):
        n = int(random.integers(1, 6))
        path = random.uniform([-3000, -3000, -600], [3000, 3000, -100], (n, 3))
        if n > 2 and random.random() < 0.3:
            path[n // 2] = path[n // 2 - 1]
        speeds = random.uniform(25, 50, n)
        index = int(random.integers(0, n + 1))
        wind = random.normal(0, 6, 3) * (k % 3 > 0)  # every third flight in a calm
        x = np.array([0.0, 0.0, -random.uniform(100, 600), 40.0, random.uniform(-math.pi, math.pi), 0.0, 0.0])
        x[:2] = random.uniform(-3000, 3000, 2)
        x[6] = random.uniform(-5, 5)
        if n > 1 and random.random() < 0.5:  # near the waypoint, where the verdict changes
            x[:2] = path[min(index, n - 1), :2] + random.normal(0, 300, 2)
        u = np.empty(3)
        reached = kernels.follow_path(x, path, speeds, index, P, wind, u)
        expected, expected_index = naive.follow(x, path, speeds, index, P, wind)
        assert reached == expected_index
        indices.add(reached - index)
        assert np.allclose(u[[0, 2]], expected[[0, 2]], atol=1e-9)
        assert abs(naive.turned(u[1] - expected[1])) < 1e-9
    assert {0, 1} <= indices
