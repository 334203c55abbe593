"""Refinement of a path among moving cylinders: waypoints are left out, and moved by a pattern search.

The search is that of Hooke and Jeeves ("Direct search" solution of numerical and statistical problems, J. ACM 8, 1961)
over the places of the waypoints: less time in cylinders first, then a shorter way.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.keep_out.kernels import N_VOLUME, path_enters
from wideberth.avoidance.waypoint_paths.first_turn_kernels import N_INERTIA, PLACES, flown_times, leg_times
from wideberth.avoidance.waypoint_paths.intruder_kernels import N_INTRUDER, inside_piece
from wideberth.avoidance.waypoint_paths.limits_kernels import path_flaws

Floats = NDArray[np.float64]

# What the ownship can fly (m/s, m), bounds of altitude (m), and the search: first and last step (m), the vertical step
# in horizontal ones, and the most looks of a leg at an intruder. From `INERTIA` on: what it first goes on with.
SPEED, TURN_RADIUS, CLIMB_MAX, SINK_MAX, FLOOR, CEILING, STEP, STEP_LEAST, VERTICAL, LOOKS_MAX, INERTIA = range(11)
N_REFINEMENT = INERTIA + N_INERTIA

LEVEL_DIRECTIONS = 8  # ahead, back, right, left, and between them; after these up and down
# Between them because a place that touches a cylinder can often move neither along the chord nor aside alone.
_BETWEEN = math.sqrt(0.5)
CLOSED = 16  # beside the bits of `path_flaws`
_SECONDS = 1e-6  # of time in cylinders, and
_METRES = 0.1  # of length: less is no gain
_SAME_LENGTH = 1e-10  # m
_LONGER = 2.0  # times its first length a path may become: away from everybody is no way to the goal


@jit_uncounted
def faults(
    points: Floats, times: Floats, n: int, course: float, volumes: Floats, vertices: Floats, limits: Floats
) -> int:
    """Return what is wrong with a path: bits of `path_flaws`, and `CLOSED` where it enters a closed volume."""
    flaws = path_flaws(points, times, n, course, limits[TURN_RADIUS], limits[CLIMB_MAX], limits[SINK_MAX])
    entered = volumes.shape[0] > 0 and path_enters(points, n, volumes, vertices) >= 0
    return flaws | (CLOSED if entered else 0)


@jit_uncounted
def leave_out(points: Floats, n: int, first: int, count: int, out: Floats) -> int:
    """Write a path without `count` places from `first` on into `out`, and return how many places it has."""
    for i in range(n - count):
        source = i if i < first else i + count
        out[i, 0], out[i, 1], out[i, 2] = points[source, 0], points[source, 1], points[source, 2]
    return n - count


@jit_uncounted
def move_place(points: Floats, n: int, k: int, direction: int, step: float, limits: Floats, out: Floats) -> None:
    """Write a path with place `k` moved by a step into `out`: level, by its neighbours' chord, or up or down."""
    leave_out(points, n, n, 0, out)
    along_n, along_e = points[k + 1, 0] - points[k - 1, 0], points[k + 1, 1] - points[k - 1, 1]
    size = max(math.hypot(along_n, along_e), 1e-6)
    along_n, along_e = along_n / size, along_e / size
    way = step if direction % 2 == 0 else -step
    if direction < LEVEL_DIRECTIONS:
        ahead, right = 1.0, 0.0
        if direction >= 4:
            ahead, right = _BETWEEN, (_BETWEEN if direction < 6 else -_BETWEEN)
        elif direction >= 2:
            ahead, right = 0.0, 1.0
        out[k, 0] += way * (ahead * along_n - right * along_e)
        out[k, 1] += way * (ahead * along_e + right * along_n)
    else:
        # A height outside the bounds may only come nearer to them.
        lowest, highest = max(-limits[FLOOR], points[k, 2]), min(-limits[CEILING], points[k, 2])
        out[k, 2] = max(highest, min(lowest, points[k, 2] - way * limits[VERTICAL]))


@jit_uncounted
def time_inside(
    points: Floats, times: Floats, first: int, n: int, intruders: Floats, count: int, most: float, culprit: int
) -> tuple[float, int, int]:
    """Return the time in cylinders from a leg on; it is enough to know that it is more than `most`.

    Parameters
    ----------
    points, times : ndarray, shape (>= n, 3), (>= n,)
        The path: local NED, and seconds from now.
    first, n : int
        The leg, and the places of the path.
    intruders : ndarray, shape (>= count, N_INTRUDER)
    count : int
    most : float
        s.
    culprit : int
        Who is looked at first.

    Returns
    -------
    inside : float
        s.
    culprit : int
        With whom it became more than `most`; else as it was.
    looks : int
        At an intruder from a leg.
    """
    total, looks = 0.0, 0
    for j in range(count):
        m = culprit if j == 0 else (j - 1 if j <= culprit else j)
        for i in range(first, n - 1):
            total += inside_piece(points[i], points[i + 1], times[i], times[i + 1] - times[i], intruders[m], 1.0)[1]
            looks += 1
            if total > most:
                return total, m, looks
    return total, culprit, looks


@jit
def refine(
    points: Floats,
    n: int,
    course: float,
    intruders: Floats,
    count: int,
    volumes: Floats,
    vertices: Floats,
    limits: Floats,
    trial: Floats,
    flown: Floats,
    times: Floats,
    arrivals: Floats,
) -> tuple[int, int]:
    """Make a path shorter, and free if it is not, in place.

    Waypoints are left out, half of them at once, then fewer; then the pattern search moves those that are left, up and
    down only as long as the path is not free. A change is taken if it means less time in cylinders, or as much on a
    shorter way, and nothing is wrong with the new path that was not wrong with the old one.

    Parameters
    ----------
    points : ndarray, shape (>= n, 3)
        The path, local NED, m; the first place and the last are held.
    n : int
    course : float
        Of the ownship at the first place, rad; NaN where any will do.
    intruders : ndarray, shape (>= count, N_INTRUDER)
    count : int
    volumes, vertices : ndarray
        Keep-out volumes.
    limits : ndarray, shape (N_REFINEMENT,)
    trial, times : ndarray, shape (>= n, 3), (>= n,)
    flown, arrivals : ndarray, shape (>= n + PLACES, 3), (>= n + PLACES,)
        All overwritten.

    Returns
    -------
    n : int
        Places of the path that is left.
    looks : int
        At an intruder from a leg; a trial is one more.
    """
    speed, radius, inertia = limits[SPEED], limits[TURN_RADIUS], limits[INERTIA:]
    leg_times(points, n, speed, times)
    wrong = faults(points, times, n, course, volumes, vertices, limits)
    # The first turn counts as it is flown: else a sharp one would be a free way to lose time.
    places, length = flown_times(points, n, course, radius, inertia, speed, flown, arrivals)
    longest = _LONGER * length
    # No trial is begun without enough left for the looks of its whole path.
    looks_max = limits[LOOKS_MAX] - 1 - (n - 1 + PLACES) * count
    if looks_max < 0:
        return n, 0
    inside, culprit, looks = time_inside(flown, arrivals, 0, places, intruders, count, math.inf, 0)
    directions = LEVEL_DIRECTIONS + (2 if limits[VERTICAL] > 0.0 else 0)
    step = limits[STEP]
    block = max(1, (n - 2) // 2)
    direction = -1  # leave out; then move
    k, gained = 1, False
    while step >= limits[STEP_LEAST] and n > 2 and looks <= looks_max:
        least = _METRES
        looks += 1
        if direction < 0:
            # One place less to look at is worth it by itself: a place on a straight way is left out, too.
            m, least = leave_out(points, n, k, min(block, n - 1 - k), trial), -_SAME_LENGTH
        else:
            m = n
            move_place(points, n, k, direction, step, limits, trial)
        places, new_length = flown_times(trial, m, course, radius, inertia, speed, flown, arrivals)
        better, new_wrong = False, ~wrong
        # Who is free already gains by a shorter way alone.
        if new_length < (longest if inside > 0.0 else length - least):
            leg_times(trial, m, speed, times)
            new_wrong = faults(trial, times, m, course, volumes, vertices, limits)
        if new_wrong & ~wrong == 0:
            shorter = new_length < length - least
            # A path that is free stays so before the first leg that changes. With the second place the turn changes.
            first = places - m + k - 1 if inside == 0.0 and k > 1 else 0
            new_inside, culprit, taken = time_inside(
                flown, arrivals, first, places, intruders, count, inside if shorter else inside - _SECONDS,
                culprit if inside == 0.0 else 0,
            )  # fmt: skip
            looks += taken
            better = new_inside < inside - _SECONDS or (new_inside <= inside and shorter)
        if better:
            leave_out(trial, m, m, 0, points)
            n, length, inside, wrong, gained = m, new_length, new_inside, new_wrong, True
            k = min(k, n - 2)
            continue
        if block == 1:
            direction += 1
            # Who is free gains next to nothing by a slower climb, and keeps less margin while it lasts.
            if direction < (directions if inside > 0.0 else LEVEL_DIRECTIONS):
                continue
        direction = -1
        k += max(1, block // 2)
        if k < n - 1:
            continue
        k = 1
        if block > 1:
            block = min(block, n - 2) // 2
            block = max(block, 1)
        elif not gained:
            step *= 0.5
        gained = False
    return n, looks


def warmup() -> None:
    """Compile what Python calls of this module."""
    refine(
        np.zeros((3, 3)), 3, 0.0, np.ones((1, N_INTRUDER)), 1, np.zeros((0, N_VOLUME)), np.zeros((0, 2)),
        np.ones(N_REFINEMENT), np.zeros((3, 3)), np.zeros((3 + PLACES, 3)), np.zeros(3), np.zeros(3 + PLACES),
    )  # fmt: skip
