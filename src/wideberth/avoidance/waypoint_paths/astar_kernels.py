"""A* in space and time over a grid of cells, levels and eight headings (thesis 4.4; article V, eqs. 11-13).

The grid lies along the way to the goal: cell (i, j) is i cells ahead and j to the right of the start, and a level is a
step above or below the straight line from start to goal. A state is a cell, a level, a heading and a bin of arrival
times (errata, "A*/chain planner"). Costs are positive and the estimate of the rest never too high, so that with bins
fine enough the first path to reach the goal is the cheapest.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.avoidance.keep_out.kernels import N_VOLUME, volumes_entered
from wideberth.avoidance.waypoint_paths.intruder_kernels import (
    HALF_HEIGHT,
    N_INTRUDER,
    RADIUS,
    TURN_STEP,
    V_EAST,
    V_NORTH,
    inside_piece,
    place_at,
    state_at,
    stay_hull,
)
from wideberth.conflict.kernels import horizontal_cpa

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# The grid: start (local NED), its axis, sizes (m), goal in cells ahead, bounds (cells, levels), descent along the axis.
ORIGIN_NORTH, ORIGIN_EAST, ORIGIN_DOWN, AXIS_NORTH, AXIS_EAST = 0, 1, 2, 3, 4
CELL, LEVEL, GOAL, BEHIND, BEYOND, ASIDE, LEVEL_LOW, LEVEL_HIGH, SLOPE = 5, 6, 7, 8, 9, 10, 11, 12, 13
SPEED, CLIMB_MAX, SINK_MAX, FLOOR, CEILING, TIME_BIN, TIME_MAX = 14, 15, 16, 17, 18, 19, 20
N_GRID = 21

# Costs, named as in the thesis; `K_LEFT` is one of ours: among equals, turn right.
K_DIST, K_ALT, K_MAX, K_R, VARRHO, K_N, K_CPA, K_V, K_LEFT, DELTA_2 = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
N_COST = 10

SAMPLES = 8  # places on an edge at which the distance to intruders is taken
MOVES = 5  # left, straight, right, up, down
EDGE = 6  # looks at an intruder that an edge costs besides those

# Columns of a node.
CELL_I, CELL_J, CELL_LEVEL, HEADING, PARENT = 0, 1, 2, 3, 4
G, F, T = 0, 1, 2

FOUND, BEST_SO_FAR, NOWHERE = 0, 1, 2


class Search(NamedTuple):
    """Buffers of a search.

    Attributes
    ----------
    cells : ndarray of int, shape (nodes, 5)
    values : ndarray, shape (nodes, 3)
        Cost so far, with the estimate of the rest, and arrival time (s from now).
    heap : ndarray of int, shape (nodes,)
    keys, slots : ndarray of int, shape (2^k,)
        Hash table from a state to its cheapest node.
    near : ndarray of int, shape (intruders,)
    path : ndarray, shape (nodes, 3)
        The path found, local NED, m.
    times : ndarray, shape (nodes,)
        Seconds from now.
    done : ndarray of int, shape (2,)
        Nodes expanded and distances taken.
    """

    cells: Integers
    values: Floats
    heap: Integers
    keys: Integers
    slots: Integers
    near: Integers
    path: Floats
    times: Floats
    done: Integers


@jit
def heap_push(heap: Integers, size: int, node: int, values: Floats) -> int:
    """Put a node into the heap of the least `F`, and return its new size."""
    i = size
    f = values[node, F]
    while i > 0:
        up = (i - 1) // 2
        if values[heap[up], F] <= f:
            break
        heap[i] = heap[up]
        i = up
    heap[i] = node
    return size + 1


@jit
def heap_pop(heap: Integers, size: int, values: Floats) -> int:
    """Take the node of the least `F` from the heap; its size is one less afterwards."""
    top = heap[0]
    last = heap[size - 1]
    f = values[last, F]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= size - 1:
            break
        if child + 1 < size - 1 and values[heap[child + 1], F] < values[heap[child], F]:
            child += 1
        if values[heap[child], F] >= f:
            break
        heap[i] = heap[child]
        i = child
    heap[i] = last
    return int(top)


@jit
def slot_of(keys: Integers, key: int) -> int:
    """Return where a state stands in the hash table, or where it would (open addressing)."""
    mask = keys.shape[0] - 1
    i = (((key ^ (key >> 31)) & 0x7FFFFFFF) * 0x9E3779B1 >> 16) & mask
    while keys[i] != -1 and keys[i] != key:
        i = (i + 1) & mask
    return int(i)


@jit
def cell_place(i: int, j: int, level: int, grid: Floats, out: Floats) -> None:
    """Write the centre of a cell (local NED, m) into `out` (3,)."""
    x, y = i * grid[CELL], j * grid[CELL]
    out[0] = grid[ORIGIN_NORTH] + x * grid[AXIS_NORTH] - y * grid[AXIS_EAST]
    out[1] = grid[ORIGIN_EAST] + x * grid[AXIS_EAST] + y * grid[AXIS_NORTH]
    out[2] = grid[ORIGIN_DOWN] + grid[SLOPE] * min(max(x, 0.0), grid[GOAL] * grid[CELL]) - level * grid[LEVEL]


@jit
def rest_cost(i: int, j: int, level: int, grid: Floats, cost: Floats) -> float:
    """Return a bound from below of the cost from a cell to the goal: straight and diagonal steps, and the climbs."""
    along, aside = abs(grid[GOAL] - i), abs(float(j))
    steps = max(along, aside) + (math.sqrt(2.0) - 1.0) * min(along, aside)
    # What a climb costs more than the same step flown level, along the axis or on a diagonal.
    diagonal = math.hypot(math.sqrt(2.0) * grid[CELL], grid[LEVEL]) / math.hypot(grid[CELL], grid[LEVEL])
    more = min(cost[K_ALT] - cost[K_DIST], diagonal * cost[K_ALT] - math.sqrt(2.0) * cost[K_DIST])
    return float(cost[K_DIST] * steps + abs(level) * max(more, 0.0))


@jit
def threat_cost(a: Floats, b: Floats, t: float, duration: float, row: Floats, cost: Floats) -> float:
    """Return the cost c_t that one intruder puts on an edge.

    `K_MAX` inside the cylinder, by the share of the edge's time, so that where every path is blocked the shortest way
    through is the best; and, within the cylinder's heights, K_R (varrho d_s - d) / ((varrho - 1) d_s) at the nearest
    place outside it.
    """
    reach = cost[VARRHO] * row[RADIUS]
    un, ue, ud = (b[0] - a[0]) / duration, (b[1] - a[1]) / duration, (b[2] - a[2]) / duration
    if math.isnan(stay_hull(a, un, ue, ud, t, duration, TURN_STEP, row, reach, row[HALF_HEIGHT])[0]):
        return 0.0
    nearest = math.inf
    for k in range(1, SAMPLES + 1):
        s = k / SAMPLES
        pn, pe, pd = place_at(row, t + s * duration)
        if abs(pd - a[2] - s * (b[2] - a[2])) > row[HALF_HEIGHT]:
            continue
        dn, de = pn - a[0] - s * (b[0] - a[0]), pe - a[1] - s * (b[1] - a[1])
        nearest = min(nearest, dn * dn + de * de)
    total = 0.0
    if nearest < reach * reach:
        depth = (reach - math.sqrt(nearest)) / (reach - row[RADIUS])
        total += cost[K_R] * min(depth, 1.0)
    first, inside = inside_piece(a, b, t, duration, row, 1.0)
    if first < math.inf:
        total += cost[K_MAX] * max(inside / duration, 0.1)
    return total


@jit
def passing_cost(a: Floats, b: Floats, t: float, duration: float, row: Floats, cost: Floats) -> float:
    """Return c_cpa + c_v of one intruder (thesis eqs. 4.15, 4.16), as seen at the end of an edge.

    Only of one that comes nearer and will not be well above or below then. c_v is shifted to stay positive, and both
    denominators are at least 1 (errata, "A*/chain planner").
    """
    if cost[K_CPA] == 0.0 and cost[K_V] == 0.0:
        return 0.0
    pn, pe, pd, vn, ve, vd = state_at(row, t + duration)
    un, ue, ud = (b[0] - a[0]) / duration, (b[1] - a[1]) / duration, (b[2] - a[2]) / duration
    t_cpa, d_cpa = horizontal_cpa(pn - b[0], pe - b[1], vn - un, ve - ue)
    if t_cpa <= 0.0 or abs(pd - b[2] + (vd - ud) * t_cpa) > cost[DELTA_2] * row[HALF_HEIGHT]:
        return 0.0
    if d_cpa > cost[VARRHO] * row[RADIUS]:
        return 0.0
    along = un * vn + ue * ve + math.hypot(un, ue) * math.hypot(vn, ve)
    return float(cost[K_CPA] / (max(d_cpa, 1.0) * max(t_cpa, 1.0)) + cost[K_V] * along / max(t_cpa, 1.0))


@jit
def search(
    grid: Floats,
    cost: Floats,
    heading: int,
    intruders: Floats,
    count: int,
    volumes: Floats,
    vertices: Floats,
    expansions_max: int,
    distances_max: int,
    memory: Search,
) -> tuple[int, int, float]:
    """Search the cheapest path from the start to the goal.

    Parameters
    ----------
    grid, cost : ndarray, shape (N_GRID,), (N_COST,)
    heading : int
        Of the ownship: eighths of a turn from the grid's axis, clockwise.
    intruders : ndarray, shape (>= count, N_INTRUDER)
    count : int
    volumes, vertices : ndarray
        Keep-out volumes. No edge enters one, but those that the start is in already: there each edge costs `K_MAX`.
    expansions_max, distances_max : int
        The search ends after so many nodes, or looks at intruders (those near an edge are looked at `SAMPLES` times):
        this bounds its time.
    memory : Search
        Overwritten.

    Returns
    -------
    status : int
        `FOUND`; `BEST_SO_FAR` where the budget (or the grid) ran out: the path to the most promising node; `NOWHERE`
        without any move.
    n : int
        Places of the path in `memory.path`; the first is the start.
    g : float
        Its cost.
    """
    cells, values, heap, keys = memory.cells, memory.values, memory.heap, memory.keys
    keys[:] = -1
    cell, level_size = grid[CELL], grid[LEVEL]
    width, levels = int(grid[BEHIND] + grid[BEYOND]) + 1, int(grid[LEVEL_HIGH] - grid[LEVEL_LOW]) + 1
    aside = int(grid[ASIDE])
    bins = int(grid[TIME_MAX] / grid[TIME_BIN]) + 2
    a, b = np.empty(3), np.empty(3)
    cell_place(0, 0, 0, grid, a)
    allowed = volumes_entered(a[0], a[1], a[2], a[0], a[1], a[2], volumes, vertices)
    cells[0, CELL_I] = cells[0, CELL_J] = cells[0, CELL_LEVEL] = 0
    cells[0, HEADING], cells[0, PARENT] = heading, -1
    values[0, G], values[0, F], values[0, T] = 0.0, rest_cost(0, 0, 0, grid, cost), 0.0
    used, size = 1, heap_push(heap, 0, 0, values)
    best, best_score = 0, math.inf
    expanded = distances = 0
    status = BEST_SO_FAR
    # A climb's cost is K_ALT along the axis, and grows with its length on a diagonal.
    climb_unit = cost[K_ALT] / math.hypot(cell, level_size)
    # No node is expanded without enough left for the looks of all its moves.
    last_distances = distances_max - MOVES * (count * (SAMPLES + 1) + EDGE)
    while size > 0 and expanded < expansions_max and distances <= last_distances and used + MOVES <= cells.shape[0]:
        node = heap_pop(heap, size, values)
        size -= 1
        i, j, level, head = cells[node, CELL_I], cells[node, CELL_J], cells[node, CELL_LEVEL], cells[node, HEADING]
        t, g = values[node, T], values[node, G]
        key = state_key(i, j, level, head, int(t / grid[TIME_BIN]), width, aside, levels, bins, grid)
        if node > 0 and memory.slots[slot_of(keys, key)] != node:
            continue  # a cheaper way to the same state came later
        if i == grid[GOAL] and j == 0 and level == 0:
            best, status = node, FOUND
            break
        expanded += 1
        score = 2.0 * values[node, F] - g
        if node > 0 and score < best_score:
            best, best_score = node, score
        cell_place(i, j, level, grid, a)
        here = volumes_entered(a[0], a[1], a[2], a[0], a[1], a[2], volumes, vertices)
        # Whoever is too far away to matter on any edge from here is left out of them.
        longest = math.hypot(math.sqrt(2.0) * cell, level_size + abs(grid[SLOPE]) * 1.5 * cell)
        n_near = 0
        for m in range(count):
            pn, pe, _ = place_at(intruders[m], t)
            speed = math.hypot(intruders[m, V_NORTH], intruders[m, V_EAST]) / grid[SPEED]
            if math.hypot(pn - a[0], pe - a[1]) <= cost[VARRHO] * intruders[m, RADIUS] + longest * (1.0 + speed):
                memory.near[n_near] = m
                n_near += 1
        for move in range(MOVES):
            turn = move - 1 if move < 3 else 0
            rise = 0 if move < 3 else (1 if move == 3 else -1)
            new_head = (head + turn) % 8
            di = 1 if new_head in (0, 1, 7) else (-1 if new_head in (3, 4, 5) else 0)
            dj = 1 if new_head in (1, 2, 3) else (-1 if new_head in (5, 6, 7) else 0)
            ni, nj, nl = i + di, j + dj, level + rise
            if ni < -grid[BEHIND] or ni > grid[BEYOND] or abs(nj) > aside:
                continue
            if nl < grid[LEVEL_LOW] or nl > grid[LEVEL_HIGH]:
                continue
            cell_place(ni, nj, nl, grid, b)
            # Below the floor (above the ceiling) a path may only come nearer to it.
            if b[2] > max(-grid[FLOOR], a[2]) or b[2] < min(-grid[CEILING], a[2]):
                continue
            length = math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
            duration = length / grid[SPEED]
            if a[2] - b[2] > grid[CLIMB_MAX] * duration or b[2] - a[2] > grid[SINK_MAX] * duration:
                continue
            arrival = t + duration
            if arrival > grid[TIME_MAX]:
                continue
            entered = volumes_entered(a[0], a[1], a[2], b[0], b[1], b[2], volumes, vertices)
            if entered > min(here, allowed):
                continue
            flat = math.sqrt(2.0) if di != 0 and dj != 0 else 1.0
            added = entered * cost[K_MAX]
            if rise == 0:
                added += cost[K_DIST] * max(length / cell, flat)
            else:
                added += climb_unit * math.hypot(flat * cell, level_size)
            added += cost[K_N] * math.hypot(float(nj), float(nl)) + (cost[K_LEFT] if turn < 0 else 0.0)
            for k in range(n_near):
                added += threat_cost(a, b, t, duration, intruders[memory.near[k]], cost)
            distances += n_near * SAMPLES + count + EDGE
            for m in range(count):
                added += passing_cost(a, b, t, duration, intruders[m], cost)
            key = state_key(ni, nj, nl, new_head, int(arrival / grid[TIME_BIN]), width, aside, levels, bins, grid)
            slot = slot_of(keys, key)
            if keys[slot] == key and values[memory.slots[slot], G] <= g + added:
                continue
            keys[slot], memory.slots[slot] = key, used
            cells[used, CELL_I], cells[used, CELL_J], cells[used, CELL_LEVEL] = ni, nj, nl
            cells[used, HEADING], cells[used, PARENT] = new_head, node
            values[used, G], values[used, T] = g + added, arrival
            values[used, F] = g + added + rest_cost(ni, nj, nl, grid, cost)
            size = heap_push(heap, size, used, values)
            used += 1
    memory.done[0], memory.done[1] = expanded, distances
    n = 0
    node = best
    while node >= 0:
        n += 1
        node = cells[node, PARENT]
    node = best
    for k in range(n - 1, -1, -1):
        cell_place(cells[node, CELL_I], cells[node, CELL_J], cells[node, CELL_LEVEL], grid, memory.path[k])
        memory.times[k] = values[node, T]
        node = cells[node, PARENT]
    return (status if n > 1 else NOWHERE), n, float(values[best, G])


@jit
def state_key(
    i: int, j: int, level: int, head: int, time_bin: int, width: int, aside: int, levels: int, bins: int, grid: Floats
) -> int:
    """Return a number of its own for each state."""
    key = (i + int(grid[BEHIND])) + width * (j + aside)
    key = key * levels + (level - int(grid[LEVEL_LOW]))
    return int((key * 8 + head) * bins + time_bin)


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    nodes, ints = 64, np.int64
    memory = Search(
        np.zeros((nodes, 5), ints), np.zeros((nodes, 3)), np.zeros(nodes, ints), np.zeros(128, ints),
        np.zeros(128, ints), np.zeros(1, ints), np.zeros((nodes, 3)), np.zeros(nodes), np.zeros(2, ints),
    )  # fmt: skip
    search(
        np.ones(N_GRID), np.ones(N_COST), 0, np.ones((1, N_INTRUDER)), 1, np.zeros((0, N_VOLUME)), np.zeros((0, 2)),
        2, 100, memory,
    )  # fmt: skip
