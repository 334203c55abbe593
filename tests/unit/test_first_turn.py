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


def begun(points, course, radius):
    points = np.array(points, float)
    out, times = np.empty((len(points) + ftk.PLACES, 3)), np.empty(len(points) + ftk.PLACES)
    n, length = ftk.flown_times(points, len(points), course, radius, 13.0, out, times)
    assert length == pytest.approx(13.0 * times[n - 1])
    return out[:n], times[:n]


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_it_does_what_its_twin_does(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-200.0, 200.0, (int(rng.integers(2, 5)), 3))
    course, radius = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(10.0, 80.0))
    found, times = begun(points, course, radius)
    twin = naive.begun_path(points, course, radius, ftk.TURN_LEAST, ftk.TURN_MOST, ftk.PIECE)
    np.testing.assert_allclose(found, twin, atol=1e-6)
    np.testing.assert_allclose(times[1:], np.cumsum(np.linalg.norm(np.diff(twin, axis=0), axis=1)) / 13.0, atol=1e-6)


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
