"""The refinement of paths: against its twin, what it promises, and known cases."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import waypoint_paths as naive
from wideberth.avoidance.keep_out import kernels as kk
from wideberth.avoidance.keep_out.config import PolygonKeepOut
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.waypoint_paths import first_turn_kernels as ftk
from wideberth.avoidance.waypoint_paths import intruder_kernels as ik
from wideberth.avoidance.waypoint_paths import limits_kernels as lk
from wideberth.avoidance.waypoint_paths.astar import Limits
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.refinement import Refinement

LIMITS = Limits(speed=13.0, radius=25.0, climb_max=4.0, sink_max=3.0)
CELL = 100.0
seeds = st.integers(0, 2**32 - 1)


def judged(path, rows, course, volumes):
    points = np.array(path)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    times = np.concatenate(([0.0], np.cumsum(lengths) / LIMITS.speed))
    limits = LIMITS.radius, LIMITS.climb_max, LIMITS.sink_max
    flaws = lk.path_flaws(points, times, len(points), course, *limits)
    wrong = {flaw for flaw in (lk.STEEP_FIRST, lk.SHARP_FIRST, lk.STEEP, lk.SHARP) if flaws & flaw}
    if kk.path_enters(points, len(points), *volumes) >= 0:
        wrong.add("closed")
    flown = naive.begun_path(points, course, LIMITS.radius, ftk.TURN_LEAST, ftk.TURN_MOST, ftk.PIECE)
    legs = np.linalg.norm(np.diff(flown, axis=0), axis=1)
    times = np.concatenate(([0.0], np.cumsum(legs) / LIMITS.speed))
    inside = ik.path_inside(flown, times, len(flown), rows, len(rows), 1.0, np.empty(len(rows)))[1]
    return wrong, inside, float(legs.sum())


def drawn(seed, constant_altitude=False):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    points = np.column_stack([np.linspace(0.0, 900.0, n), rng.uniform(-200, 200, n), -200.0 + rng.uniform(-20, 20, n)])
    if constant_altitude:
        points[:, 2] = -200.0
    rows = np.zeros((int(rng.integers(0, 4)), ik.N_INTRUDER))
    for row in rows:
        row[:3] = [*rng.uniform(0, 900, 2), -200.0 + rng.uniform(-40, 40)]
        row[3:6] = [*rng.uniform(-15, 15, 2), rng.uniform(-0.5, 0.5)]
        row[6:8] = rng.uniform(50.0, 153.0), 30.5
    volumes = []
    if rng.random() < 0.5:
        north, east = rng.uniform(200, 700), rng.uniform(-200, 200)
        corners = [(north + a * 40.0, east + b * 40.0) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        volumes = [PolygonKeepOut(vertices_m=tuple(corners))]
    config = AStarConfig(
        keep_out=tuple(volumes), constant_altitude=constant_altitude, altitude_min_m=190.0, altitude_max_m=230.0
    )
    arrays = keep_out_arrays(config.keep_out, config.keep_out_margin_m)
    course = float(rng.choice([rng.uniform(-1.0, 1.0), math.nan]))
    return config, arrays, points, rows, course


@settings(max_examples=25)
@given(seeds, st.booleans())
def test_it_does_what_its_twin_does(seed, constant_altitude):
    config, volumes, points, rows, course = drawn(seed, constant_altitude)
    found, _ = Refinement(config, volumes).refined(points, course, CELL, LIMITS, rows, 10**7)
    vertical = 0.0 if constant_altitude else config.cell_height_m / config.cell_m
    twin = naive.refined_path(
        points, 0.5 * CELL, 0.03 * CELL, vertical, (-190.0, -230.0), lambda path: judged(path, rows, course, volumes)
    )
    np.testing.assert_allclose(found, twin, atol=1e-6)


@settings(max_examples=60)
@given(seeds, st.booleans(), st.integers(1, 3000))
def test_whatever_the_path_it_gets_no_worse_and_the_looks_are_bounded(seed, constant_altitude, most):
    config, volumes, points, rows, course = drawn(seed, constant_altitude)
    before = points.copy()
    found, looks = Refinement(config, volumes).refined(points, course, CELL, LIMITS, rows, most)
    np.testing.assert_array_equal(points, before)
    np.testing.assert_array_equal(found[[0, -1]], points[[0, -1]])
    wrong, inside, length = judged(found, rows, course, volumes)
    wrong_before, inside_before, length_before = judged(points, rows, course, volumes)
    assert wrong <= wrong_before
    assert inside <= inside_before + 1e-9
    if inside >= inside_before - 1e-6:
        assert length <= length_before + 1e-9
    assert looks <= most + 2 * len(points) * max(1, len(rows))
    altitude, altitude_before = -found[:, 2], -points[:, 2]
    assert altitude.min() >= min(190.0, altitude_before.min()) - 1e-9
    assert altitude.max() <= max(230.0, altitude_before.max()) + 1e-9
    if constant_altitude:
        np.testing.assert_array_equal(found[:, 2], -200.0)


def test_a_detour_round_nobody_becomes_the_straight_way():
    config = AStarConfig()
    points = np.array([[0.0, 0, -200], [200, 150, -230], [400, 200, -230], [600, 90, -210], [900, 0, -200]])
    found, _ = Refinement(config, keep_out_arrays((), 0.0)).refined(
        points, 0.3, CELL, LIMITS, np.zeros((0, ik.N_INTRUDER)), 10_000
    )
    np.testing.assert_array_equal(found, points[[0, -1]])


def test_round_a_standing_cylinder_little_is_left_to_gain():
    """The shortest way from 450 m before a circle of 150 m to as much behind it: two tangents and an arc."""
    row = np.zeros((1, ik.N_INTRUDER))
    row[0, :3], row[0, 6:8] = [450.0, 0.0, -200.0], [150.0, 30.5]
    config = AStarConfig(constant_altitude=True)
    points = np.array([[0.0, 0, -200], [300, 300, -200], [600, 300, -200], [900, 0, -200]])
    found, _ = Refinement(config, keep_out_arrays((), 0.0)).refined(points, math.nan, CELL, LIMITS, row, 10_000)
    tangent, angle = math.sqrt(450.0**2 - 150.0**2), 2.0 * math.asin(150.0 / 450.0)
    shortest = 2.0 * tangent + 150.0 * angle
    length = np.linalg.norm(np.diff(found, axis=0), axis=1).sum()
    assert shortest < length < 1.03 * shortest
    assert judged(found, row, math.nan, keep_out_arrays((), 0.0))[1] == pytest.approx(0.0)


def test_a_path_that_is_not_free_becomes_free():
    row = np.zeros((1, ik.N_INTRUDER))
    row[0, :3], row[0, 6:8] = [450.0, 60.0, -200.0], [150.0, 30.5]
    points = np.array([[0.0, 0, -200], [450, -60, -200], [900, 0, -200]])
    for constant_altitude in (True, False):
        config = AStarConfig(constant_altitude=constant_altitude)
        found, _ = Refinement(config, keep_out_arrays((), 0.0)).refined(points, math.nan, CELL, LIMITS, row, 10_000)
        assert judged(points, row, math.nan, keep_out_arrays((), 0.0))[1] > 5.0
        assert judged(found, row, math.nan, keep_out_arrays((), 0.0))[1] == 0.0


def test_a_place_that_touches_a_moving_cylinder_slides_along_it():
    """Round a head-on and one from the right: moved along the chord and aside alone the place stays 6 % too far out."""
    rows = np.zeros((2, ik.N_INTRUDER))
    rows[0, :6], rows[1, :6] = [442.0, 68.5, -200.0, -17.2, 0.8, 0.0], [100.0, 395.0, -200.0, 0.0, -15.0, 0.0]
    rows[:, 6:8] = 171.0, 36.0
    points = np.array([[-331.0, 0, -200], [-26, 312, -200], [500, 0, -200]])
    config = AStarConfig(constant_altitude=True)
    found, _ = Refinement(config, keep_out_arrays((), 0.0)).refined(points, math.nan, CELL, LIMITS, rows, 10_000)
    assert judged(points, rows, math.nan, keep_out_arrays((), 0.0))[1:] == (0.0, pytest.approx(1047.885, abs=1e-3))
    assert judged(found, rows, math.nan, keep_out_arrays((), 0.0))[1] == 0.0
    assert judged(found, rows, math.nan, keep_out_arrays((), 0.0))[2] < 0.96 * 1048.0


def test_places_on_a_straight_way_are_left_out():
    row = np.zeros((1, ik.N_INTRUDER))
    row[0, :3], row[0, 6:8] = [300.0, 0.0, -200.0], [150.0, 30.5]
    east = [0.0, 180.0, 180.0, 135.0, 90.0, 45.0, 0.0]
    points = np.column_stack([[0.0, 200.0, 400.0, 525.0, 650.0, 775.0, 900.0], east, np.full(7, -200.0)])
    config = AStarConfig(constant_altitude=True)
    found, _ = Refinement(config, keep_out_arrays((), 0.0)).refined(points, math.nan, CELL, LIMITS, row, 10_000)
    assert len(found) <= 4
