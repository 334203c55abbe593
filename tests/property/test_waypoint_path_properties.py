"""Whatever the traffic and the fences: paths begin and end where they must, within limits, never in closed volumes."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.avoidance.keep_out.config import CylinderKeepOut, PolygonKeepOut
from wideberth.avoidance.keep_out.kernels import path_enters, volumes_entered
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.waypoint_paths import intruder_kernels as ik
from wideberth.avoidance.waypoint_paths.astar import GridSearch, Limits
from wideberth.avoidance.waypoint_paths.chain import Chain
from wideberth.avoidance.waypoint_paths.config import AStarChainConfig
from wideberth.avoidance.waypoint_paths.path_planner import PathPlanner
from wideberth.avoidance.waypoint_paths.prediction import Prediction
from wideberth.avoidance.waypoint_paths.refinement import Refinement
from wideberth.avoidance.waypoint_paths.work import LOOK, Work, judgement

LIMITS = Limits(speed=13.0, radius=25.0, climb_max=4.0, sink_max=3.0)


def world(rng):
    volumes = []
    for _ in range(int(rng.integers(0, 3))):
        north, east = rng.uniform(-200, 900), rng.uniform(-400, 400)
        if rng.random() < 0.5:
            volumes.append(CylinderKeepOut(centre_m=(north, east), radius_m=rng.uniform(20, 150)))
        else:
            half = rng.uniform(20, 150, 2)
            corners = [(north + a * half[0], east + b * half[1]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            volumes.append(PolygonKeepOut(vertices_m=tuple(corners), altitude_max_m=rng.uniform(120, 400)))
    rows = np.zeros((int(rng.integers(0, 5)), ik.N_INTRUDER))
    for row in rows:
        row[:3] = [*rng.uniform(-500, 1200, 2), -200.0 + rng.uniform(-60, 60)]
        row[3:6] = [*rng.uniform(-20, 20, 2), rng.uniform(-1, 1)]
        row[6:8] = 153.0, 30.5
        if rng.random() < 0.3:
            row[8:10] = rng.uniform(-0.1, 0.1), 20.0
    return tuple(volumes), Prediction(rows, (), np.zeros(len(rows), bool), lambda: np.zeros((len(rows), 2)))


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_paths_keep_what_they_promise(seed, with_chain, constant_altitude):
    rng = np.random.default_rng(seed)
    volumes, prediction = world(rng)
    floor, ceiling = 170.0, float(rng.choice([215.0, 3000.0]))
    config = AStarChainConfig(
        keep_out=volumes, constant_altitude=constant_altitude, altitude_min_m=floor, altitude_max_m=ceiling,
        expansions_max=int(rng.integers(20, 1500)),
    )  # fmt: skip
    arrays = keep_out_arrays(volumes, config.keep_out_margin_m)
    start = np.array([0.0, 0.0, -200.0])
    goal = np.array([rng.uniform(150, 1200), rng.uniform(-300, 300), -rng.uniform(180, 210)])
    course = float(rng.choice([rng.uniform(-math.pi, math.pi), math.nan]))
    path = PathPlanner(config, arrays, with_chain).plan(start, course, goal, LIMITS, prediction)
    if path is None:
        return
    np.testing.assert_allclose(path.points[0], start, atol=1e-6)
    assert np.isfinite(path.points).all() and (np.diff(path.times) > 0.0).all()
    if path.complete:
        np.testing.assert_allclose(path.points[-1, :2], goal[:2], atol=1e-6)
    if volumes_entered(*start, *start, *arrays) == 0:
        assert path_enters(path.points, len(path.points), *arrays) == -1
    altitude = -path.points[:, 2]
    assert altitude.min() >= min(floor, 200.0) - 1e-6 and altitude.max() <= max(ceiling, 200.0) + 1e-6
    if constant_altitude:
        np.testing.assert_allclose(path.points[:, 2], -200.0, atol=1e-6)
    lengths = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(np.diff(path.times), lengths / LIMITS.speed, rtol=1e-6)
    climb = np.diff(altitude) / np.diff(path.times)
    if len(climb) > 1:  # the last leg of an unfinished search is the mission's way back
        assert climb[:-1].max() <= 1.06 * LIMITS.climb_max and climb[:-1].min() >= -1.06 * LIMITS.sink_max


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_a_search_keeps_its_budget_and_is_repeatable(seed):
    rng = np.random.default_rng(seed)
    volumes, prediction = world(rng)
    most = int(rng.integers(10, 300))
    config = AStarChainConfig(keep_out=volumes, expansions_max=most, distances_max=20_000)
    search = GridSearch(config, keep_out_arrays(volumes, 0.0))
    start, goal = np.array([0.0, 0.0, -200.0]), np.array([900.0, 50.0, -200.0])
    first, again = (search.find(start, 0.0, goal, LIMITS, prediction.rows) for _ in range(2))
    assert (first is None) == (again is None)
    if first is not None and again is not None:
        assert first.expansions <= most
        assert first.distances <= 20_000 + 5 * 8 * len(prediction.rows)
        np.testing.assert_array_equal(first.points, again.points)
        assert first.cost == again.cost


def crowd(rng, count):
    """Aircraft on all sides, most of them on their way to the middle, some turning: hardly a path is free."""
    rows = np.zeros((count, ik.N_INTRUDER))
    for row in rows:
        angle, away, speed = rng.uniform(-math.pi, math.pi), rng.uniform(100, 900), rng.uniform(0, 25)
        row[:3] = [300.0 + away * math.cos(angle), away * math.sin(angle), -200.0 + rng.uniform(-30, 30)]
        row[3:6] = [-speed * math.cos(angle), -speed * math.sin(angle), rng.uniform(-1, 1)]
        row[6:8] = 153.0, 30.5
        if rng.random() < 0.5:
            row[8:10] = rng.uniform(-0.2, 0.2), 8.0
    return Prediction(rows, (), np.zeros(count, bool), lambda: np.zeros((count, 2)))


class Counted(PathPlanner):
    """Keeps count of the work of the parts itself."""

    counted = 0

    def judge(self, points, course, limits, prediction, cell=0.0, complete=True):
        self.counted += judgement(len(points), len(prediction.rows))
        return super().judge(points, course, limits, prediction, cell, complete)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_a_decision_does_no_more_work_than_it_may(seed):
    rng = np.random.default_rng(seed)
    most = int(rng.choice([50_000, 450_000, rng.integers(50_000, 1_000_000)]))
    prediction = crowd(rng, int(rng.integers(1, 33)))
    config = AStarChainConfig(work_max=most)
    planner = Counted(config, keep_out_arrays((), 0.0), with_chain=True)
    parts = ((planner._search, "find"), (planner._chain, "settle"), (planner._refinement, "refined"))
    for part, name in parts:
        setattr(part, name, counting(planner, getattr(part, name), name))
    start, goals = np.array([0.0, 0.0, -200.0]), np.array([[600.0, 0.0, -200.0], [900.0, 200.0, -200.0]])
    flown = np.array([start, [300.0, rng.uniform(-300, 300), -200.0], goals[0]])
    work = Work(most)
    planner.follow(flown, 0.0, 100.0, LIMITS, prediction, work)
    part = work.split(0.5)
    found = planner.plan(start, 0.0, goals[0], LIMITS, prediction, part)
    assert found is not None and found.inside >= 0.0
    np.testing.assert_array_equal(found.points[0], start)
    if found.complete:
        np.testing.assert_array_equal(found.points[-1], goals[0])
    work.join(part)
    planner.plan(start, 0.0, goals[1], LIMITS, prediction, work)
    assert work.left >= 0
    assert planner.counted == most - work.left


def counting(planner, whole, name):
    """Return a part that adds what it took to the count, and is checked to take no more than it is allowed."""

    def counted(*args, **kwargs):
        found = whole(*args, **kwargs)
        if name == "find":
            taken, most, weight = 0 if found is None else found.distances, kwargs["distances_max"], 1
        else:
            taken, most, weight = found[-1], args[-1], LOOK if name == "refined" else 1
        assert taken <= most
        planner.counted += weight * taken
        return found

    return counted


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(0, 20_000))
def test_every_part_stops_where_its_work_ends(seed, most):
    rng = np.random.default_rng(seed)
    rows = crowd(rng, int(rng.integers(0, 20))).rows
    config, volumes = AStarChainConfig(), keep_out_arrays((), 0.0)
    path = np.column_stack([np.linspace(0.0, 900.0, 8), rng.uniform(-200, 200, 8), np.full(8, -200.0)])
    found = GridSearch(config, volumes).find(path[0], 0.0, path[-1], LIMITS, rows, distances_max=most)
    assert found is None or found.distances <= most
    assert Chain(config, volumes).settle(path, 0.0, 100.0, LIMITS, rows, most)[2] <= most
    assert Refinement(config, volumes).refined(path, 0.0, 100.0, LIMITS, rows, most)[1] <= most
