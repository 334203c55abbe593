"""The avoidance kernels against their naive twins."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import avoidance as naive
from wideberth.avoidance import decision_kernels as dk
from wideberth.avoidance import graph_kernels as gk
from wideberth.avoidance import kernels as rk
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner, limits_array, printed_risk_array, risk_array
from wideberth.avoidance.prediction_kernels import predict_intruders
from wideberth.types import Mission, Ownship, Track, TrackStatus
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.kernels import fly_path
from wideberth.vehicles.point_mass import parameters

seeds = st.integers(0, 2**32 - 1)
VEHICLE = parameters(PointMassConfig())
RISK = risk_array(LocalLevelConfig())


def random_traffic(rng, m, near=4000.0):
    position = np.column_stack([rng.uniform(-near, near, (m, 2)), rng.uniform(-1100, -500, m)])
    velocity = np.column_stack([rng.uniform(-90, 90, (m, 2)), rng.uniform(-6, 6, m)])
    acceleration = rng.normal(0, [1.5, 1.5, 0.2], (m, 3))
    root = rng.normal(0, [20, 20, 8, 2, 2, 1, 0.4, 0.4, 0.2], (m, 9, 9))
    return position, velocity, acceleration, np.einsum("mki,mkj->mij", root, root) / 9


def predict(rng, m, dt, n, risk=RISK, near=4000.0):
    """Return the rows (h, n, 9), weights and owners of random traffic about (0, 0, -800)."""
    traffic = random_traffic(rng, m, near)
    out, weight, owner = np.empty((2 * m, n, rk.N_PREDICTION)), np.empty(2 * m), np.empty(2 * m, np.int64)
    count = predict_intruders(np.array([0.0, 0, -800]), 46.0, 5.0, *traffic, risk, dt, n, out, weight, owner)
    return out[:count], weight[:count], owner[:count], traffic


@settings(max_examples=40)
@given(seeds)
def test_prediction_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    m, dt, n = 3, float(rng.choice([0.5, 1.0])), 12
    out, weight, owner, (position, velocity, acceleration, covariance) = predict(rng, m, dt, n)
    q = naive.named(RISK)
    found = list(owner)
    for i in range(m):
        sigma_a = math.sqrt((covariance[i, 6, 6] + covariance[i, 7, 7]) / 2)
        rate = naive.believed_turn_rate(complex(*velocity[i, :2]), complex(*acceleration[i, :2]), sigma_a, RISK)
        hypotheses = [(0.0, 1.0)] if rate == 0.0 else [(0.0, 1 - q["turn_weight"]), (rate, q["turn_weight"])]
        for r, belief in hypotheses:
            twin = naive.predicted(position[i], velocity[i], r, q["turn_time"], dt, n)
            rows = [k for k in range(len(out)) if found[k] == i and np.allclose(out[k, :, :6], twin, atol=1e-6)]
            if not rows:  # left out: it can never be met
                speed = 46.0 + max(np.hypot(*velocity[i, :2]), 0.0)
                far = np.hypot(twin[:, 0], twin[:, 1]) - 46.0 * dt * np.arange(n)
                high = np.abs(twin[:, 2] + 800) - 5.0 * dt * np.arange(n)
                assert np.all((far > q["outer_radius"] + q["outer_tau"] * speed) | (high > q["outer_height"]))
                continue
            assert weight[rows[0]] == pytest.approx(belief)
            spreads = [naive.spread(covariance[i], k * dt) for k in range(n)]
            assert np.allclose(out[rows[0], :, 6:8], spreads, rtol=1e-9)


def test_what_is_left_out_of_a_prediction_could_not_have_mattered():
    """Nothing marked as irrelevant is inside any volume, wherever the ownship can be by then."""
    rng = np.random.default_rng(3)
    risk = RISK.copy()
    risk[rk.WEIGHT_NEAR] = 0.0
    marked = 0
    for _ in range(30):
        out, weight, _, _ = predict(rng, 4, 1.0, 15, near=15e3)
        for h, k in itertools.product(range(len(out)), range(15)):
            if out[h, k, 8] == 1.0:
                continue
            marked += 1
            row = out[h : h + 1].copy()
            row[0, k, 8] = 1.0
            course = math.atan2(row[0, k, 1], row[0, k, 0])
            own = 46.0 * k * np.array([math.cos(course), math.sin(course)])
            down = -800 + np.clip(row[0, k, 2] + 800, -5.0 * k, 5.0 * k)
            met = np.zeros(rk.N_MET)
            rk.clear_met(met)
            rk.risk_at(
                own[0], own[1], down, 46 * math.cos(course), 46 * math.sin(course), 0.0,
                row, weight[h : h + 1], 1, k, float(k), 1.0, 1.0, risk, met,
            )  # fmt: skip
            assert met[rk.TIME_OUTER] == 0.0
    assert marked > 50


@settings(max_examples=60)
@given(seeds)
def test_risk_of_a_place_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    out, weight, _, _ = predict(rng, 4, 1.0, 8, near=1500.0)
    risk = RISK.copy()
    if seed % 3 == 0:
        risk = printed_risk_array(LocalLevelConfig())
    own = np.array(
        [*rng.normal(0, 400, 2), rng.choice([-800.0, -60.0, -3050.0]) + rng.normal(0, 60), *rng.normal(0, 30, 3)]
    )
    k, margin = int(rng.integers(8)), float(rng.uniform(1, 1.5))
    met, twin = np.zeros(rk.N_MET), naive.Met()
    rk.clear_met(met)
    cost = rk.risk_at(*own, out, weight, len(out), k, float(k), 0.5, margin, risk, met)
    assert cost == pytest.approx(naive.risk_at(own, out[:, k], weight, float(k), 0.5, margin, risk, twin), rel=1e-9)
    assert met[rk.CULPRIT] == twin.culprit
    for name, index in (("hard", rk.FIRST_HARD), ("inner", rk.FIRST_INNER), ("outer", rk.FIRST_OUTER)):
        assert met[index] == twin.first(name)


def test_the_printed_search_sees_the_collision_volume():
    risk = printed_risk_array(LocalLevelConfig())
    row = np.array([[[200.0, 0, -800, -40, 0, 0, 0, 0, 1]]])
    met = np.zeros(rk.N_MET)
    rk.clear_met(met)
    cost = rk.risk_at(0.0, 0.0, -800.0, 40.0, 0.0, 0.0, row, np.ones(1), 1, 0, 0.0, 1.0, 1.0, risk, met)
    assert met[rk.TIME_HARD] == 1.0
    assert cost > 0.2 * risk[rk.WEIGHT_HARD]


@settings(max_examples=25)
@given(seeds)
def test_evaluation_of_a_path_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    n, dt = 10, 1.0
    out, weight, _, _ = predict(rng, 3, dt, n, near=1200.0)
    x = np.array([0.0, 0, -800, 40, rng.uniform(-3, 3), 0, 0])
    path = np.array([x[:3], [*rng.uniform(-2000, 2000, 2), -850]])
    states = np.empty((dk.STRIDE * (n - 1) + 1, 7))
    dk.look_ahead(x, path, np.full(2, 40.0), 1, VEHICLE, dt, states)
    met = np.zeros(rk.N_MET)
    rk.evaluate_path(states, dk.STRIDE, n, dt, out, weight, len(out), 1.1, RISK, met)
    twin = naive.evaluate(states[:: dk.STRIDE], dt, out, weight, 1.1, RISK)
    assert met[rk.COST] == pytest.approx(twin.cost, rel=1e-9)
    assert met[rk.FIRST_OUTER] == twin.first("outer") and met[rk.FIRST_HARD] == twin.first("hard")
    for name, index in (("hard", rk.TIME_HARD), ("inner", rk.TIME_INNER), ("outer", rk.TIME_OUTER)):
        assert met[index] == pytest.approx(len(twin.inside[name]) * dt)


@given(st.lists(st.tuples(*[st.floats(-5e3, 5e3)] * 2, st.floats(-2000, -100)), min_size=2, max_size=5), seeds)
def test_point_along_a_path_equals_its_twin(points, seed):
    rng = np.random.default_rng(seed)
    waypoints = np.array(points)
    if np.hypot(*np.diff(waypoints[:, :2], axis=0).T).min() < 1.0:
        return
    index, position, ahead = int(rng.integers(0, len(points) + 2)), rng.uniform(-6e3, 6e3, 3), rng.uniform(0, 2e4)
    out = np.empty(3)
    rk.point_along(waypoints, index, position[0], position[1], ahead, out)
    assert np.allclose(out, naive.point_along(waypoints, index, position, ahead), atol=1e-6)


def test_point_along_a_path_of_one_place_is_that_place():
    out = np.empty(3)
    rk.point_along(np.tile([5.0, 6.0, -7.0], (3, 1)), 1, 100.0, 0.0, 50.0, out)
    assert out.tolist() == [5.0, 6.0, -7.0]


def test_terminal_cost_is_seconds_of_way_weighted():
    goal = np.array([3000.0, 4000.0, -500.0])
    assert rk.terminal_cost(0.0, 0.0, -400.0, goal, 50.0, 4.0, np.array([0.5, 2.0])) == pytest.approx(50.0 + 50.0)


@settings(max_examples=40)
@given(seeds)
def test_cost_beyond_a_path_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    out, weight, _, _ = predict(rng, 4, 1.0, 8, near=1500.0)
    risk = RISK.copy()
    risk[rk.BEYOND] = rng.uniform(1, 40)
    end, velocity, k = np.array([*rng.normal(0, 400, 2), rng.normal(-800, 150)]), rng.normal(0, 40, 2), 7
    cost = rk.cost_beyond(*end, *velocity, out, weight, len(out), k, float(k), risk)
    twin = naive.beyond(end, velocity, out[:, k], weight, float(k), risk)
    assert cost == pytest.approx(twin, abs=0.02 * risk[rk.WEIGHT_HARD])
    risk[rk.BEYOND] = 0.0
    assert rk.cost_beyond(*end, *velocity, out, weight, len(out), k, float(k), risk) == 0.0


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles_are_the_same_direction(angle):
    wrapped = rk.wrap(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


RINGS = [
    [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 25.0), (0.0, -25.0)],
    [(c, h) for c in (0.0, 0.5, -0.5) for h in (0.0, 50.0)],
    [(c, h) for c in (0.0, 0.5, -0.5) for h in (0.0, 75.0)],
]
STEPS = [3, 4, 5]


def search(geometry, rings, steps, start, dt, limits, traffic, risk, goal, senses=(0, 0)):
    sizes = [len(ring) for ring in rings]
    ring_start = np.array([0, *itertools.accumulate(sizes)], np.int64)
    nodes = np.array([node for ring in rings for node in ring])
    labels, parent = np.zeros((len(nodes), gk.N_LABEL)), np.zeros(len(nodes), np.int64)
    path = np.zeros(len(rings), np.int64)
    count = gk.search_map(
        start, geometry, ring_start, np.array(steps, np.int64), nodes[:, 0].copy(), nodes[:, 1].copy(), dt, limits,
        traffic[0], traffic[1], len(traffic[0]), risk, np.zeros((0, 5)), np.zeros((0, 2)), goal, np.array([0.3, 0.2]),
        *senses, labels, parent, path,
    )  # fmt: skip
    return count, labels, parent, path


def start_label(course=0.4):
    start = np.zeros(gk.N_LABEL)
    start[gk.DOWN], start[gk.COURSE] = -800.0, course
    return start


def limits_of(**changes):
    limits = limits_array(LocalLevelConfig(), VEHICLE)
    for name, value in changes.items():
        limits[getattr(gk, name)] = value
    return limits


@settings(max_examples=15)
@given(seeds)
def test_the_sweep_over_the_printed_map_finds_what_dijkstra_finds(seed):
    """With no limits on the edges the graph is fixed: the sweep, Dijkstra and trying every path must agree."""
    rng = np.random.default_rng(seed)
    traffic = predict(rng, 2, 1.0, sum(STEPS) + 1, near=700.0)
    risk = printed_risk_array(LocalLevelConfig())
    limits = limits_of(SPEED=40.0, SPEED_MAX=1e3, CLIMB_MAX=1e3, SINK_MAX=1e3, TURN_RATE=1e3, HEADING_REACH=4.0)
    start, goal = start_label(), np.array([600.0, 200.0, -800.0])
    count, labels, parent, path = search(gk.RINGS, RINGS, STEPS, start, 1.0, limits, traffic, risk, goal)
    graph = naive.ring_graph(
        start, RINGS, STEPS, 1.0, 40.0, 1e3, traffic[0], traffic[1], risk, goal, np.array([0.3, 0.2])
    )
    cost, best = naive.dijkstra(graph, -1, -2)
    assert cost == pytest.approx(min(naive.all_paths(graph, -1, -2)), rel=1e-9)
    assert count == len(RINGS)
    assert labels[path[-1], gk.LABEL_COST] == pytest.approx(cost, rel=1e-9)
    flown = [-1, *path.tolist(), -2]
    assert sum(graph[a][b] for a, b in itertools.pairwise(flown)) == pytest.approx(cost, rel=1e-9)
    assert [int(parent[b]) for b in path] == flown[:-2]
    assert len(best) == len(RINGS) + 1


def test_on_the_printed_map_edges_beyond_the_limits_do_not_exist():
    nobody = (np.empty((0, 13, rk.N_PREDICTION)), np.empty(0))
    goal = np.array([600.0, 200.0, -875.0])
    limits = limits_of(SPEED=40.0, SPEED_MAX=46.0, CLIMB_MAX=0.0, SINK_MAX=0.0)
    count, labels, _, path = search(gk.RINGS, RINGS, STEPS, start_label(), 1.0, limits, nobody, RISK, goal)
    nodes = [node for ring in RINGS for node in ring]
    assert count == 3 and all(nodes[k][1] == 0.0 for k in path)
    climbing = [k for k, node in enumerate(nodes) if node[1] != 0.0]
    assert np.all(np.isinf(labels[climbing, gk.LABEL_COST]))
    limits = limits_of(SPEED=40.0, SPEED_MAX=1.0)
    assert search(gk.RINGS, RINGS, STEPS, start_label(), 1.0, limits, nobody, RISK, goal)[0] == 0


FLOWN = [[(c, h) for c in (0.0, 0.6, -0.6) for h in (0.0, 60.0, -60.0)]] * 3
FLOWN_STEPS = [4, 30, 6]


@settings(max_examples=6)
@given(seeds)
def test_labels_of_the_flyable_map_are_where_flying_their_edge_leads(seed):
    """Each label is its parent's edge flown, and no other source would have reached the node for less."""
    rng = np.random.default_rng(seed)
    traffic = predict(rng, 2, 1.0, sum(FLOWN_STEPS) + 1, near=1500.0)
    limits = limits_of(SPEED=40.0)
    start, goal = start_label(), np.array([1500.0, 500.0, -800.0])
    count, labels, parent, path = search(gk.FLYABLE, FLOWN, FLOWN_STEPS, start, 1.0, limits, traffic, RISK, goal)
    assert count == 3
    named = {
        "turn_rate": limits[gk.TURN_RATE], "speed": 40.0, "sink": limits[gk.SINK_MAX], "climb": limits[gk.CLIMB_MAX],
        "acceleration": limits[gk.CLIMB_ACCELERATION],
    }  # fmt: skip
    nodes = [node for ring in FLOWN for node in ring]
    # Every node of the first ring, and a sample of the others.
    for node in (*range(9), *rng.choice(np.arange(9, 27), 4, replace=False).tolist()):
        ring = node // 9
        if not np.isfinite(labels[node, gk.LABEL_COST]):
            assert ring == 2
        sources = [-1] if ring == 0 else range(9 * ring - 9, 9 * ring)
        for source in sources:
            if source != parent[node] and source % 4:
                continue
            label = start if source < 0 else labels[source]
            height_before = 0.0 if source < 0 else nodes[source][1]
            course = start[gk.COURSE] + nodes[node][0]
            edge = naive.fly_edge(
                label, course, -800.0 - nodes[node][1], sum(FLOWN_STEPS[:ring]), FLOWN_STEPS[ring], 1.0,
                limits[gk.TURN_DELAY] if ring == 0 else 0.0, named, traffic[0], traffic[1], RISK, gk.FINE_TIME,
            )  # fmt: skip
            turn = math.remainder(course - label[gk.COURSE], 2 * math.pi)
            cost = label[gk.LABEL_COST] + edge.cost + limits[gk.COST_TURN] * abs(turn)
            cost += limits[gk.COST_CLIMB] * abs(nodes[node][1] - height_before)
            cost += limits[gk.COST_LEFT] * max(-turn, 0.0)
            if ring == 2:
                away = goal - edge.end[:3]
                cost += 0.3 * np.hypot(away[0], away[1]) / 40.0 + 0.2 * abs(away[2]) / limits[gk.CLIMB_MAX]
            if source == parent[node]:
                assert np.allclose(labels[node, :3], edge.end[:3], atol=1e-6)
                assert math.cos(labels[node, gk.COURSE] - edge.end[3]) == pytest.approx(1.0)
                assert labels[node, gk.LABEL_COST] == pytest.approx(cost, rel=1e-9)
            else:
                # In the last ring only the best node's cost need be the least.
                least = labels[node if ring < 2 else path[2], gk.LABEL_COST]
                assert cost >= least * (1 - 1e-9)
    assert labels[path[-1], gk.LABEL_COST] == labels[18:, gk.LABEL_COST].min()
    assert parent[path[2]] == path[1] and parent[path[1]] == path[0] and parent[path[0]] == -1


@pytest.mark.parametrize("sense", [1, -1])
def test_a_sense_already_flown_is_kept_on_the_flyable_map(sense):
    """An aircraft ahead, neither side better: the path turns as before, even where the goal is on the other side."""
    row = np.zeros((1, sum(FLOWN_STEPS) + 1, rk.N_PREDICTION))
    row[0, :, 0], row[0, :, 2], row[0, :, 8] = 1200.0, -800.0, 1.0
    limits = limits_of(SPEED=40.0, CLIMB_MAX=0.0, SINK_MAX=0.0, COST_REVERSAL=1e6)
    goal = np.array([1600.0, -200.0 * sense, -800.0])
    start = start_label(0.0)
    _, _, _, path = search(
        gk.FLYABLE, FLOWN, FLOWN_STEPS, start, 1.0, limits, (row, np.ones(1)), RISK, goal, (sense, 0)
    )
    courses = [FLOWN[0][k % 9][0] for k in path]
    assert all(course * sense >= 0 for course in courses) and any(course * sense > 0 for course in courses)


def test_the_cheapest_labels_come_first():
    rng = np.random.default_rng(5)
    labels, order = np.zeros((30, gk.N_LABEL)), np.full(30, -7, np.int64)
    labels[:, gk.LABEL_COST] = rng.integers(0, 6, 30)
    labels[4, gk.LABEL_COST] = math.inf
    gk.sort_labels(labels, 3, 20, order)
    cost = labels[order[:20], gk.LABEL_COST]
    assert sorted(order[:20]) == list(range(3, 23)) and np.all(np.diff(cost[:-1]) >= 0) and cost[-1] == math.inf


def test_an_encounter_on_the_small_map():
    """A whole encounter on the small map: mission, a new maneuver, kept, and back to the mission."""
    planner = LocalLevelPlanner(LocalLevelConfig(map="collision_38", hold_s=3.0), VEHICLE)
    mission = Mission(np.array([[0.0, 0, -900], [9e3, 0, -900]]), np.full(2, 40.0), 0.0)
    x, actions = np.array([0.0, 0, -900, 40, 0, 0, 0]), []
    points, speeds, index = mission.waypoints, mission.speeds, 1
    flown = None
    for t in range(45):
        own = Ownship(t, x[:3].copy(), np.array([x[3] * math.cos(x[4]), x[3] * math.sin(x[4]), -x[6]]))
        position = np.array([2000.0 - 60 * t, 10.0, -905])
        track = Track(
            "a1b2c3", t, position, np.array([-60.0, 0, 0]), np.zeros(3), np.eye(9), TrackStatus.CONFIRMED, t
        )  # fmt: skip
        maneuver, events = planner.decide(t, own, [track], [], mission)
        actions += events
        if maneuver is not flown:
            flown, index = maneuver, 1
            points, speeds = mission.waypoints, mission.speeds
            if maneuver is not None:
                points = np.vstack([x[:3], maneuver.waypoints])
                speeds = np.full(len(points), 40.0)
        states = np.empty((2, 7))
        index = fly_path(x, points, speeds, index, VEHICLE, np.zeros(3), 0.5, 2, states)
        x = states[1]
        away = position - [60.0, 0, 0] - x[:3]
        assert math.hypot(away[0], away[1]) > 152.4 or abs(away[2]) > 30.48
    assert actions[0].startswith("intruder A1B2C3") and actions[-1] == "clear of traffic: return to the mission"
    assert flown is None
