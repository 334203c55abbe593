"""Kernels of A* and the chain against their twins and at known values."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import waypoint_paths as naive
from wideberth.avoidance.keep_out import kernels as kk
from wideberth.avoidance.waypoint_paths import astar_kernels as ak
from wideberth.avoidance.waypoint_paths import chain_kernels as ck
from wideberth.avoidance.waypoint_paths import intruder_kernels as ik
from wideberth.avoidance.waypoint_paths import limits_kernels as lk

seeds = st.integers(0, 2**32 - 1)
NO_VOLUMES = np.zeros((0, kk.N_VOLUME)), np.zeros((0, 2))


def array(module, size, values):
    assert len(values) == size
    out = np.zeros(size)
    for name, value in values.items():
        out[getattr(module, name)] = value
    return out


def row(position, velocity, radius=150.0, half_height=30.0, turn_rate=0.0, turn_time=0.0):
    return np.array([*position, *velocity, radius, half_height, turn_rate, turn_time])


def grid_of(**changes):
    values = dict.fromkeys(["ORIGIN_NORTH", "ORIGIN_EAST", "ORIGIN_DOWN", "AXIS_EAST", "SLOPE"], 0.0) | {
        "AXIS_NORTH": 1.0, "CELL": 100.0, "LEVEL": 50.0, "GOAL": 4, "BEHIND": 1, "BEYOND": 5, "ASIDE": 2,
        "LEVEL_LOW": -1, "LEVEL_HIGH": 1, "SPEED": 13.0, "CLIMB_MAX": 8.0, "SINK_MAX": 8.0, "FLOOR": -1e5,
        "CEILING": 1e5, "TIME_BIN": 1e-4, "TIME_MAX": 80.0,
    }  # fmt: skip
    return values | changes


COSTS = {
    "K_DIST": 100.0, "K_ALT": 559.0, "K_MAX": 1e6, "K_R": 500.0, "VARRHO": 2.3, "K_N": 1.0, "K_CPA": 500.0,
    "K_V": 0.05, "K_LEFT": 1.0, "DELTA_2": 2.639,
}  # fmt: skip


def memory(nodes=40_000, intruders=8):
    slots = 1 << math.ceil(math.log2(2 * nodes))
    ints = np.int64
    return ak.Search(
        np.zeros((nodes, 5), ints), np.zeros((nodes, 3)), np.zeros(nodes, ints), np.zeros(slots, ints),
        np.zeros(slots, ints), np.zeros(intruders, ints), np.zeros((nodes, 3)), np.zeros(nodes), np.zeros(2, ints),
    )  # fmt: skip


def search(grid, rows, heading=0, cost=COSTS, volumes=NO_VOLUMES, expansions=7000, distances=10**9, buffers=None):
    buffers = buffers or memory()
    rows = np.array(rows).reshape(-1, ik.N_INTRUDER)
    status, n, g = ak.search(
        array(ak, ak.N_GRID, grid), array(ak, ak.N_COST, cost), heading, rows, len(rows), *volumes, expansions,
        distances, buffers,
    )  # fmt: skip
    return status, buffers.path[:n].copy(), buffers.times[:n].copy(), g, buffers.done.copy()


@settings(max_examples=40)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60))
def test_the_heap_gives_the_least_first(keys):
    values = np.zeros((len(keys), 3))
    values[:, ak.F] = keys
    heap, size = np.zeros(len(keys), np.int64), 0
    for node in range(len(keys)):
        size = ak.heap_push(heap, size, node, values)
    order = []
    while size:
        order.append(ak.heap_pop(heap, size, values))
        size -= 1
    assert sorted(order) == list(range(len(keys)))
    assert [keys[k] for k in order] == sorted(keys)


@settings(max_examples=8)
@given(seeds)
def test_a_star_finds_what_dijkstra_finds(seed):
    rng = np.random.default_rng(seed)
    rows = [
        row([*rng.uniform(-300, 700, 2), rng.uniform(-40, 40)], [*rng.uniform(-15, 15, 2), rng.uniform(-1, 1)], 90.0)
        for _ in range(int(rng.integers(0, 3)))
    ]
    grid = grid_of(GOAL=3, BEYOND=4, TIME_MAX=45.0, SLOPE=rng.uniform(-0.1, 0.1))
    heading = int(rng.integers(0, 8))
    status, path, times, g, _ = search(grid, rows, heading)
    twin = naive.cheapest_path(grid, COSTS, heading, np.array(rows).reshape(-1, ik.N_INTRUDER))
    if twin == math.inf:
        assert status != ak.FOUND
        return
    assert status == ak.FOUND
    assert g == pytest.approx(twin, rel=1e-9)
    np.testing.assert_allclose(path[0], [0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(path[-1, :2], [300.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(np.diff(times), np.linalg.norm(np.diff(path, axis=0), axis=1) / 13.0)


def test_costs_of_free_air():
    cost = {**COSTS, "K_N": 0.0}
    status, path, times, g, done = search(grid_of(), [], cost=cost)
    assert (status, len(path), g) == (ak.FOUND, 5, pytest.approx(400.0))
    assert times[-1] == pytest.approx(400.0 / 13.0)
    assert done[0] == 4  # straight to the goal, nothing else is looked at
    # A wall that only the level above is open over: two climbing steps at 559 each for two of 100.
    wall = np.array([[-20.0, 20.0, 0.0, 4.0, 0.0]])
    corners = np.array([[180.0, -900.0], [220.0, -900.0], [220.0, 900.0], [180.0, 900.0]])
    status, path, _, g, _ = search(grid_of(), [], cost=cost, volumes=(wall, corners))
    assert (status, g) == (ak.FOUND, pytest.approx(2 * 559.0 + 2 * 100.0))
    assert abs(path[:, 2]).max() == pytest.approx(50.0)


def test_threat_costs_at_known_distances():
    a, b = np.array([0.0, 0.0, 0.0]), np.array([100.0, 0.0, 0.0])
    cost = array(ak, ak.N_COST, COSTS)

    def beside(distance, height=0.0):
        return ak.threat_cost(a, b, 0.0, 10.0, row([0.0, distance, height], [10.0, 0.0, 0.0]), cost)

    assert beside(2.3 * 150.0 + 0.01) == 0.0
    assert beside(150.0 * (1.0 + 2.3) / 2.0) == pytest.approx(250.0)
    assert beside(150.1) == pytest.approx(500.0, abs=1.0)
    assert beside(149.9) == pytest.approx(1e6 + 500.0, rel=1e-6)
    assert beside(149.9, 31.0) == 0.0


def test_flying_against_an_intruder_costs_least():
    cost = array(ak, ak.N_COST, {**COSTS, "K_CPA": 0.0, "K_V": 1.0})
    a, b = np.zeros(3), np.array([100.0, 0.0, 0.0])
    head_on = ak.passing_cost(a, b, 0.0, 10.0, row([500.0, 10.0, 0.0], [-15.0, 0.0, 0.0]), cost)
    overtaken = ak.passing_cost(a, b, 0.0, 10.0, row([-300.0, 10.0, 0.0], [15.0, 0.0, 0.0]), cost)
    assert head_on == pytest.approx(0.0)
    assert overtaken == pytest.approx(2 * 10.0 * 15.0 / ((250.0) / 5.0))


def test_the_budget_ends_the_search_with_the_best_path_so_far():
    around = [row([200.0, 0.0, 0.0], [0.0, 0.0, 0.0], 90.0, 1e4)]
    grid = grid_of(GOAL=12, BEYOND=14, ASIDE=6, TIME_MAX=300.0)
    full = search(grid, around)
    assert full[0] == ak.FOUND
    cut = search(grid, around, expansions=15)
    assert cut[0] == ak.BEST_SO_FAR
    assert cut[4][0] <= 15
    assert 1 < len(cut[1]) <= len(full[1])
    few = search(grid, around, distances=200)
    assert few[4][1] <= 200 + ak.MOVES * ak.SAMPLES
    small = search(grid, around, buffers=memory(nodes=60))
    assert small[0] == ak.BEST_SO_FAR


def test_where_there_is_no_way_there_is_no_path():
    cage = np.array([[-1e5, 1e5, 0.0, 4.0, 0.0]]), np.array([[90.0, -9e3], [95.0, -9e3], [95.0, 9e3], [90.0, 9e3]])
    back = np.array([[-1e5, 1e5, 4.0, 4.0, 0.0]]), np.array([[-9e3, 9e3], [-9e3, 40.0], [9e3, 40.0], [9e3, 9e3]])
    front = np.array([[-1e5, 1e5, 8.0, 4.0, 0.0]]), np.array([[-9e3, -9e3], [-9e3, -40.0], [9e3, -40.0], [9e3, -9e3]])
    volumes = tuple(np.vstack(parts) for parts in zip(cage, back, front, strict=True))
    status, path, *_ = search(grid_of(), [], volumes=volumes)
    assert status == ak.NOWHERE
    assert len(path) == 1


@settings(max_examples=25)
@given(seeds)
def test_turning_and_straight_predictions_equal_their_twin(seed):
    rng = np.random.default_rng(seed)
    turning = row(rng.normal(0, 500, 3), rng.normal(0, 20, 3), 150.0, 30.0, rng.choice([0.0, rng.normal(0, 0.1)]), 8.0)
    for t in (-3.0, 0.0, 5.0, 30.0):
        np.testing.assert_allclose(ik.place_at(turning, t), naive.place_at(turning, t), atol=1e-3)
        step = 1e-4
        ahead, behind = np.array(ik.place_at(turning, t + step)), np.array(ik.place_at(turning, t - step))
        if abs(t - 8.0) > step and t > 0.0:
            np.testing.assert_allclose((ahead - behind) / (2 * step), ik.state_at(turning, t)[3:], atol=1e-5)


@settings(max_examples=25)
@given(seeds)
def test_time_in_a_cylinder_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    straight = row(rng.normal(0, 150, 3) * [1, 1, 0.2], rng.normal(0, 10, 3) * [1, 1, 0.1])
    a, b = rng.normal(0, 100, 3) * [1, 1, 0.2], rng.normal(0, 100, 3) * [1, 1, 0.2]
    first, inside = ik.inside_piece(a, b, 2.0, 12.0, straight, 1.1)
    assert inside == pytest.approx(naive.seconds_inside(a, b, 2.0, 12.0, straight, 1.1), abs=0.03)
    assert (first < math.inf) == (inside > 0.0)
    turning = straight.copy()
    turning[ik.TURN_RATE], turning[ik.TURN_TIME] = 1e-9, 100.0
    assert ik.inside_piece(a, b, 2.0, 12.0, turning, 1.1)[1] == pytest.approx(inside, abs=1e-3)
    points, times, entries = np.array([a, b]), np.array([2.0, 14.0]), np.zeros(1)
    entry, total = ik.path_inside(points, times, 2, straight[None], 1, 1.1, entries)
    assert total == pytest.approx(inside)
    assert entry == entries[0]
    assert entry == (pytest.approx(2.0 + first) if inside > 0.0 else math.inf)


@settings(max_examples=300)
@given(seeds)
def test_of_a_turning_intruder_no_stay_is_missed(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-300, 300, 3) * [1, 1, 0.1], rng.uniform(-300, 300, 3) * [1, 1, 0.1]
    t, duration = rng.uniform(0.0, 10.0), rng.uniform(0.1, 40.0)
    turn = rng.uniform(0.02, 0.6) * rng.choice([-1.0, 1.0]), rng.uniform(0.0, 12.0)
    one = row(rng.uniform(-300, 300, 3) * [1, 1, 0.1], rng.uniform(-20, 20, 3) * [1, 1, 0.05], 100.0, 30.0, *turn)
    entry, inside = ik.inside_piece(a, b, t, duration, one, 1.0)
    twin = naive.seconds_inside_turning(a, b, t, duration, one, ik.TURN_STEP)
    assert inside == pytest.approx(twin, abs=1e-6)
    assert (entry < math.inf) == (inside > 0.0)


CHAIN = {
    "K": 2.5, "K_SH": 200.0, "K_SV": 200.0, "KAPPA": 2.5, "B": 4.0, "K_B": 25.0, "THETA_MAX": math.radians(45),
    "LAMBDA": 20.0, "GAMMA_MAX": math.radians(20), "F_MAX": 20.0, "DELTA_1": 2.3, "DELTA_2": 2.639,
    "REST_LENGTH": 100.0, "SPEED": 13.0, "FLOOR": -1e5, "CEILING": 1e5, "STEP": 0.05, "SETTLED": 0.05,
    "STEPS_MAX": 400,
}  # fmt: skip


@settings(max_examples=25)
@given(seeds)
def test_chain_forces_equal_their_twin(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    points = np.cumsum(rng.normal([60, 0, 0], [40, 60, 25], (n, 3)), axis=0)
    velocities = rng.normal(0, 2, (n, 3))
    velocities[[0, -1]] = 0.0
    rows = np.array([row(rng.normal(200, 150, 3) * [1, 1, 0.2], rng.normal(0, 12, 3)) for _ in range(2)])
    times, force = np.zeros(n), np.zeros((n, 3))
    ck.chain_forces(points, velocities, n, 0.3, rows, 2, array(ck, ck.N_CHAIN, CHAIN), times, force)
    twin = naive.chain_forces(points, velocities, 0.3, rows, CHAIN)
    np.testing.assert_allclose(force[1:-1], twin[1:-1], atol=1e-9)


@given(st.floats(0.0, 2 * math.pi), st.floats(-1.0, 1.0))
def test_threat_forces_go_to_zero_at_their_reach(bearing, share):
    chain, intruder = array(ck, ck.N_CHAIN, CHAIN), row([0.0, 0.0, 0.0], [-15.0, 3.0, 1.0])
    reach, reach_v = 2.3 * 150.0, 2.639 * 30.0

    def force(distance, height):
        place = distance * math.cos(bearing), distance * math.sin(bearing), height
        return np.linalg.norm(ck.threat_force(*place, 0.0, 1.0, 0.0, intruder, chain))

    for near in (1e-3, 1e-6):
        assert force(reach - near, share * reach_v) < 0.5 * near + 1e-12
        assert force(abs(share) * reach, reach_v - near) < 5.0 * near + 1e-12
    assert force(reach + 1e-9, 0.0) == 0.0
    assert force(0.0, 0.0) > 0.0  # the same place has a way out too


def test_the_repulsion_at_known_values():
    assert ck.repulsion(152.0, 153.0, 352.0, 200.0, 20.0) == 20.0
    assert ck.repulsion(173.0, 153.0, 352.0, 200.0, 20.0) == pytest.approx(200.0 * (1 / 20 - 1 / 199))
    assert ck.repulsion(352.0, 153.0, 352.0, 200.0, 20.0) == pytest.approx(0.0)


def relax(points, rows, volumes=NO_VOLUMES, **changes):
    n, settled = len(points), np.array(points, float)
    rows = np.array(rows, float).reshape(-1, ik.N_INTRUDER)
    times = np.zeros(n)
    steps = ck.relax(
        settled, n, 0.0, rows, len(rows), *volumes, array(ck, ck.N_CHAIN, CHAIN | changes), np.zeros((n, 3)),
        np.zeros((n, 3)), times,
    )  # fmt: skip
    return settled, times, steps


def test_a_chain_in_free_air_becomes_straight_and_keeps_its_ends():
    points = np.array([[0.0, 0, 0], [100, 80, -20], [200, -60, 10], [300, 30, 0], [400, 0, 0]])
    settled, times, steps = relax(points, [], STEPS_MAX=3000)
    np.testing.assert_array_equal(settled[[0, -1]], points[[0, -1]])
    np.testing.assert_allclose(settled[:, 1:], 0.0, atol=0.3)
    assert steps < 3000
    assert times[-1] == pytest.approx(400.0 / 13.0, rel=1e-3)


def test_a_chain_keeps_its_floor_and_its_budget():
    points = np.array([[100.0 * k, 0.0, -60.0] for k in range(7)])
    above = row([700.0, 5.0, -75.0], [-13.0, 0.0, 0.0])
    settled, _, steps = relax(points, [above], FLOOR=50.0)
    assert -settled[:, 2].max() >= 50.0
    assert steps <= 400
    assert relax(points, [above], STEPS_MAX=3)[2] == 3


def test_a_chain_stays_out_of_keep_outs():
    points = np.array([[0.0, 0, 0], [100, 100, 0], [200, 100, 0], [300, 100, 0], [400, 0, 0]])
    volumes = np.array([[-1e5, 1e5, 0.0, 1.0, 60.0]]), np.array([[200.0, 20.0]])
    settled, _, _ = relax(points, [], volumes)
    assert kk.path_enters(settled, len(settled), *volumes) == -1
    assert settled[2, 1] < 99.0


def test_limits_of_paths():
    def flyable(points, course=0.0, radius=20.0):
        points = np.array(points, float)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        times = np.concatenate(([0.0], np.cumsum(lengths) / 13.0))
        return lk.path_flaws(points, times, len(points), course, radius, 4.0, 3.0) == 0

    assert flyable([[0, 0, 0], [100, 0, 0], [200, 100, 0]])
    assert not flyable([[0, 0, 0], [100, 0, 0], [0, 1, 0]])  # back
    assert not flyable([[0, 0, 0], [10, 0, 0], [20, 10, 0]])  # the turn does not fit
    assert not flyable([[0, 0, 0], [-100, 0, 0]])
    assert flyable([[0, 0, 0], [-100, 0, 0]], course=math.nan)
    assert flyable([[0, 0, 0], [0, 0, 0], [100, 0, 0]])
    assert flyable([[0, 0, 0], [100, 0, -30]]) and not flyable([[0, 0, 0], [100, 0, -36]])
    assert not flyable([[0, 0, 0], [100, 0, 27]])
