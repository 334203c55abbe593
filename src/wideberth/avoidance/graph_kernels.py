"""The local-level map searched as a layered graph: one forward sweep, because an edge always leads to a later ring."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.keep_out.kernels import N_VOLUME, volumes_entered
from wideberth.avoidance.kernels import N_PREDICTION, N_RISK, cost_beyond, terminal_cost, wrap
from wideberth.avoidance.search_risk_kernels import (
    Around,
    Traffic,
    lay_out,
    look_around,
    make_around,
    near_on_way,
    volumes_risk,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# How the nodes of the map are placed (ADS-B paper, "Self-separation and collision avoidance", figure 7).
RINGS = 0  # as printed: fixed places on concentric rings, straight edges flown in equal times
FLYABLE = (
    1  # where the aircraft arrives when it turns and climbs within its limits towards the node's course and height
)

# Limits of the aircraft and shape of the search.
SPEED, SPEED_MAX, TURN_RATE, CLIMB_MAX, SINK_MAX, CLIMB_ACCELERATION = 0, 1, 2, 3, 4, 5
TURN_DELAY = 6  # s before a turn takes effect (roll-in)
COST_TURN, COST_CLIMB = 7, 8  # per rad of course change, per m of height change
COST_REVERSAL = 9  # for turning or climbing against the sense already flown
HEADING_REACH = 10  # largest course change on one edge, rad
COST_LEFT = 11  # per rad to the left: among equals, turn right
N_LIMITS = 12

COMMITTED_RINGS = 3  # rings in which a path must not go against the sense already flown
FINE_TIME = 30.0  # s of look-ahead up to which the risk of an edge is sampled at every grid time

# A label: where the best path to a node arrives.
NORTH, EAST, DOWN, COURSE, CLIMB, LABEL_COST = 0, 1, 2, 3, 4, 5
N_LABEL = 6


@jit_uncounted
def stride_of(k_start: int, n_steps: int, dt: float) -> int:
    """Return how many grid steps lie between two samples of an edge's risk."""
    # Far ahead every second sample is enough to choose by; the chosen path is judged at all of them.
    return 2 if k_start * dt >= FINE_TIME and n_steps % 2 == 0 else 1


@jit_uncounted
def fly_edge(
    label: Floats,
    course_target: float,
    down_target: float,
    k_start: int,
    n_steps: int,
    dt: float,
    delay: float,
    limits: Floats,
    traffic: Traffic,
    around: Around,
    risk: Floats,
    volumes: Floats,
    vertices: Floats,
    allowed: int,
    bound: float,
    end: Floats,
) -> float:
    """Fly one edge within the aircraft's limits and add up its risk; stop once the cost passes `bound`.

    Parameters
    ----------
    label : ndarray, shape (N_LABEL,)
        Start of the edge.
    course_target, down_target : float
        Course (rad) and down (m) of the node that the edge leads to.
    k_start, n_steps : int
        The edge covers the grid times k_start + 1 ... k_start + n_steps.
    dt, delay : float
        Step of the grid, and time before a turn takes effect, s.
    traffic : Traffic
    around : Around
        What can be met from the edge's start, by `look_around`.
    volumes, vertices : ndarray
        Keep-out volumes: an edge that enters more than `allowed` of them cannot be flown.
    allowed : int
    bound : float
        Cost at which the edge cannot win any more.
    end : ndarray, shape (N_LABEL,)
        Overwritten with the arrival.

    Returns
    -------
    float
        Cost of the path up to the end of this edge, or infinity once it passed `bound`.
    """
    pn, pe, pd, course, climb = label[NORTH], label[EAST], label[DOWN], label[COURSE], label[CLIMB]
    cost = label[LABEL_COST]
    if cost + around.near_left[0] + around.volumes_left[0] >= bound:
        return math.inf
    speed = limits[SPEED]
    stride = stride_of(k_start, n_steps, dt)
    grid = dt
    dt = stride * grid
    most = limits[TURN_RATE] * dt
    turn = wrap(course_target - course)  # still to be flown
    flown = course
    vn, ve = speed * math.cos(course), speed * math.sin(course)
    for step in range(1, n_steps // stride + 1):
        middle = course
        if step * dt > delay:
            change = max(-most, min(most, turn))
            middle = course + 0.5 * change
            course += change
            turn -= change
        if middle != flown:  # most of an edge is flown straight
            flown = middle
            vn, ve = speed * math.cos(middle), speed * math.sin(middle)
        wanted = max(-limits[SINK_MAX], min(limits[CLIMB_MAX], (pd - down_target) / (2.0 * dt)))
        climb += max(-limits[CLIMB_ACCELERATION] * dt, min(limits[CLIMB_ACCELERATION] * dt, wanted - climb))
        before_n, before_e, before_d = pn, pe, pd
        pn += vn * dt
        pe += ve * dt
        pd -= climb * dt
        if (
            volumes.shape[0] > 0
            and volumes_entered(before_n, before_e, before_d, pn, pe, pd, volumes, vertices) > allowed
        ):
            return math.inf
        k = k_start + stride * step
        around.way[step - 1, 0], around.way[step - 1, 1], around.way[step - 1, 2] = pn, pe, pd
        cost += dt * volumes_risk(pn, pe, pd, vn, ve, k, k * grid, step - 1, traffic, around, risk)
        if cost + around.near_left[0] + around.volumes_left[step] >= bound:
            return math.inf
    cost += near_on_way(k_start, stride, n_steps // stride, grid, traffic, around, bound - cost)
    end[NORTH], end[EAST], end[DOWN], end[COURSE], end[CLIMB] = pn, pe, pd, course, climb
    return float(cost)


@jit_uncounted
def fly_ring_edge(
    label: Floats,
    place: Floats,
    k_start: int,
    n_steps: int,
    dt: float,
    limits: Floats,
    traffic: Traffic,
    around: Around,
    risk: Floats,
    volumes: Floats,
    vertices: Floats,
    allowed: int,
    bound: float,
    end: Floats,
) -> float:
    """Go straight to a node of a ring in the time of the ring; infinity where the aircraft cannot.

    The cost is the paper's: equal for all edges, plus the sum of the reciprocal distances to the intruders; an edge
    that touches the collision volume carries the planner's penalty, so that a least-bad path exists.
    """
    duration = n_steps * dt
    vn, ve = (place[0] - label[NORTH]) / duration, (place[1] - label[EAST]) / duration
    vd = (place[2] - label[DOWN]) / duration
    speed = math.hypot(vn, ve)
    if speed > limits[SPEED_MAX] or -vd > limits[CLIMB_MAX] or vd > limits[SINK_MAX]:
        return math.inf
    course = math.atan2(ve, vn) if speed > 0.1 else label[COURSE]
    if abs(wrap(course - label[COURSE])) > min(limits[HEADING_REACH], limits[TURN_RATE] * duration):
        return math.inf
    if (
        volumes.shape[0] > 0
        and volumes_entered(label[NORTH], label[EAST], label[DOWN], place[0], place[1], place[2], volumes, vertices)
        > allowed
    ):
        return math.inf
    cost = label[LABEL_COST] + 1.0
    for step in range(1, n_steps + 1):
        f = step * dt
        pn, pe, pd = label[NORTH] + vn * f, label[EAST] + ve * f, label[DOWN] + vd * f
        k = k_start + step
        around.way[step - 1, 0], around.way[step - 1, 1], around.way[step - 1, 2] = pn, pe, pd
        cost += dt * volumes_risk(pn, pe, pd, vn, ve, k, k * dt, step - 1, traffic, around, risk)
        if cost + around.near_left[0] + around.volumes_left[step] >= bound:
            return math.inf
    cost += near_on_way(k_start, 1, n_steps, dt, traffic, around, bound - cost)
    end[NORTH], end[EAST], end[DOWN], end[COURSE], end[CLIMB] = place[0], place[1], place[2], course, -vd
    return float(cost)


@jit_uncounted
def opposite(values: Floats, source: int, node: int, sense: int, band: float) -> bool:
    """Return whether going to `node` is where the path turns (or climbs) against a sense, for the first time."""
    if values[node] * sense >= -band:
        return False
    return source < 0 or values[source] * sense >= -band


@jit_uncounted
def sort_labels(labels: Floats, first: int, count: int, order: Integers) -> None:
    """Write the labels first ... first + count - 1 into `order`, the cheapest first (insertion sort)."""
    for i in range(count):
        node = first + i
        j = i
        while j > 0 and labels[order[j - 1], LABEL_COST] > labels[node, LABEL_COST]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = node


@jit
def search_map(
    start: Floats,
    geometry: int,
    ring_start: Integers,
    ring_steps: Integers,
    headings: Floats,
    heights: Floats,
    dt: float,
    limits: Floats,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    risk: Floats,
    volumes: Floats,
    vertices: Floats,
    goal: Floats,
    goal_weights: Floats,
    turn_sense: int,
    climb_sense: int,
    labels: Floats,
    parent: Integers,
    path: Integers,
) -> int:
    """Find the cheapest path through the map by a forward sweep over its rings.

    ADS-B paper, "Self-separation and collision avoidance": Dijkstra's algorithm on the local-level map; the graph is
    layered in time, so the sweep visits every edge once and finds the same path. An edge is left as soon as it cannot
    win any more.

    Parameters
    ----------
    start : ndarray, shape (N_LABEL,)
        The ownship: position, course, climb rate; its cost is ignored.
    geometry : int
        `RINGS` or `FLYABLE`.
    ring_start : ndarray of int, shape (rings + 1,)
        First node of each ring; the last entry is the number of nodes.
    ring_steps : ndarray of int, shape (rings,)
        Duration of each ring in grid steps.
    headings, heights : ndarray, shape (nodes,)
        Course (rad) and height (m, up) of each node against the ownship's.
    limits, risk : ndarray
        See the constants.
    volumes, vertices : ndarray
        Keep-out volumes: no edge enters one; where the start is inside of some, no more of them than there.
    goal, goal_weights : ndarray, shape (3,), (2,)
        Where the mission wants to be after the last ring, and the weights of `terminal_cost`.
    turn_sense, climb_sense : int
        Sense (-1, 0, 1; right and up positive) of the maneuver already flown against the same threats.
    labels : ndarray, shape (nodes, N_LABEL)
    parent : ndarray of int, shape (nodes,)
        Both overwritten; in the last ring the costs are sure for the best node only, and infinite where no path led.
    path : ndarray of int, shape (rings,)
        Overwritten with the nodes of the best path.

    Returns
    -------
    int
        Number of nodes of the path: the number of rings, or 0 where no edge of the first ring can be flown.
    """
    n_rings = ring_steps.shape[0]
    end, place = np.empty(N_LABEL), np.empty(3)
    order = np.empty(labels.shape[0], np.int64)
    speed = limits[SPEED_MAX] if geometry == RINGS else limits[SPEED]
    traffic = lay_out(speed, intruders, weight, n_intruders, int(ring_steps.sum()) + 1, dt, risk)
    around = make_around(ring_steps.max(), n_intruders)
    k_start = 0
    vertical = max(limits[CLIMB_MAX], 0.1)
    allowed = volumes_entered(
        start[NORTH], start[EAST], start[DOWN], start[NORTH], start[EAST], start[DOWN], volumes, vertices
    )
    labels[:, LABEL_COST] = math.inf
    parent[:] = -1
    best, best_cost = -1, math.inf
    for ring in range(n_rings):
        last = ring == n_rings - 1
        n_steps = ring_steps[ring]
        k_end = k_start + n_steps
        elapsed = k_end * dt
        stride = 1 if geometry == RINGS else stride_of(k_start, n_steps, dt)
        # Cheapest sources first: what they leave as the best cost cuts the others short.
        n_sources = 1
        order[0] = -1
        if ring > 0:
            n_sources = ring_start[ring] - ring_start[ring - 1]
            sort_labels(labels, ring_start[ring - 1], n_sources, order)
        for rank in range(n_sources):
            source = order[rank]
            label = start if source < 0 else labels[source]
            before = 0.0 if source < 0 else label[LABEL_COST]
            if before >= best_cost:
                break
            climb = max(limits[CLIMB_MAX], limits[SINK_MAX], abs(label[CLIMB]))
            look_around(
                label[NORTH], label[EAST], label[DOWN], speed, climb,
                k_start, stride, n_steps // stride, dt, traffic, risk, around,
            )  # fmt: skip
            for node in range(ring_start[ring], ring_start[ring + 1]):
                bound = best_cost if last else labels[node, LABEL_COST]
                if before + around.near_left[0] + around.volumes_left[0] >= bound:
                    continue
                course_target = start[COURSE] + headings[node]
                down_target = start[DOWN] - heights[node]
                saved = label[LABEL_COST]
                if geometry == RINGS:
                    place[0] = start[NORTH] + limits[SPEED] * elapsed * math.cos(course_target)
                    place[1] = start[EAST] + limits[SPEED] * elapsed * math.sin(course_target)
                    place[2] = down_target
                    label[LABEL_COST] = before
                    cost = fly_ring_edge(
                        label, place, k_start, n_steps, dt, limits, traffic, around, risk,
                        volumes, vertices, allowed, bound, end,
                    )  # fmt: skip
                else:
                    turn = wrap(course_target - label[COURSE])
                    if abs(turn) > limits[HEADING_REACH]:
                        continue
                    rise = heights[node] if source < 0 else heights[node] - heights[source]
                    extra = limits[COST_TURN] * abs(turn) + limits[COST_CLIMB] * abs(rise)
                    if turn < 0.0:
                        extra -= limits[COST_LEFT] * turn
                    if ring < COMMITTED_RINGS:
                        if opposite(headings, source, node, turn_sense, 0.01):
                            extra += limits[COST_REVERSAL]
                        if opposite(heights, source, node, climb_sense, 1.0):
                            extra += limits[COST_REVERSAL]
                    label[LABEL_COST] = before + extra
                    cost = fly_edge(
                        label, course_target, down_target, k_start, n_steps, dt,
                        limits[TURN_DELAY] if ring == 0 else 0.0, limits, traffic, around, risk,
                        volumes, vertices, allowed, bound, end,
                    )  # fmt: skip
                label[LABEL_COST] = saved
                if last and cost < bound:
                    cost += terminal_cost(end[NORTH], end[EAST], end[DOWN], goal, limits[SPEED], vertical, goal_weights)
                    vn, ve = limits[SPEED] * math.cos(end[COURSE]), limits[SPEED] * math.sin(end[COURSE])
                    cost += cost_beyond(
                        end[NORTH], end[EAST], end[DOWN], vn, ve, intruders, weight, n_intruders,
                        k_end, k_end * dt, risk,
                    )  # fmt: skip
                if cost < bound:
                    labels[node, :LABEL_COST] = end[:LABEL_COST]
                    labels[node, LABEL_COST] = cost
                    parent[node] = source
                    if last:
                        best, best_cost = node, cost
        k_start = k_end
    if best < 0:
        return 0
    node = best
    for ring in range(n_rings - 1, -1, -1):
        path[ring] = node
        node = parent[node]
    return int(n_rings)


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    zeros, one = np.zeros(1), np.ones(1, np.int64)
    for geometry in (RINGS, FLYABLE):
        search_map(
            np.zeros(N_LABEL), geometry, np.array([0, 1]), one, zeros, zeros, 1.0, np.ones(N_LIMITS),
            np.ones((2, 4, N_PREDICTION)), np.ones(2), 1, np.ones(N_RISK), np.zeros((0, N_VOLUME)), np.zeros((0, 2)),
            np.zeros(3), np.ones(2), 0, 0, np.zeros((1, N_LABEL)), np.zeros(1, np.int64), np.zeros(1, np.int64),
        )  # fmt: skip
