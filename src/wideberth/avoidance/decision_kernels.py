"""One decision: fly the mission, keep the maneuver, or fly a new one.

All three are flown ahead with the vehicle's own dynamics and guidance and judged by the same risk, so that a maneuver
is kept until another is clearly better, and the mission is resumed only when flying it is safe.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.graph_kernels import (
    CLIMB,
    CLIMB_MAX,
    COMMITTED_RINGS,
    COURSE,
    DOWN,
    EAST,
    N_LABEL,
    NORTH,
    SPEED,
    search_map,
)
from wideberth.avoidance.keep_out.kernels import volumes_entered
from wideberth.avoidance.kernels import (
    COST,
    FIRST_HARD,
    FIRST_INNER,
    FIRST_OUTER,
    TIME_HARD,
    TIME_INNER,
    cost_beyond,
    evaluate_path,
    point_along,
    terminal_cost,
)
from wideberth.vehicles.kernels import (
    N_PARAMS,
    N_STATES,
    P_CAPTURE,
    fly_path,
    waypoint_passed,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What was decided.
MISSION, KEEP, NEW, RETURN = 0, 1, 2, 3

# The maneuver being flown, kept by the caller between decisions.
ACTIVE, T_CHOSEN, TURN_SENSE, CLIMB_SENSE, LEAST_BAD, SAFE_SINCE, N_POINTS, POINT_INDEX = 0, 1, 2, 3, 4, 5, 6, 7
N_PLAN = 8

# When to decide what.
DT, TRIGGER, HOLD, CLEAR_TIME, SWITCH_RATIO, SWITCH_GAIN, RETURN_MARGIN, RENEW = 0, 1, 2, 3, 4, 5, 6, 7
TRIGGER_NOW, SETTLE, TRIGGER_KIND, HORIZON, TENTATIVE, KEEP_MARGIN, ESCAPE = 8, 9, 10, 11, 12, 13, 14
N_POLICY = 15

# What a maneuver waits for: the path ahead alone, or a detection as well.
ON_PATH, ON_DETECTION = 0, 1

EXHAUSTED = 10.0  # s before its last waypoint's time a maneuver must be replaced
CARRY_ON = 60.0  # s that a maneuver goes straight on after the map, so that it does not end where the traffic passes
COST_KEEP_OUT = 1e6  # of a flown path that enters a keep-out volume
SAME_PLACE = 150.0  # m: closer than this a plan begins like the mission


STRIDE = 2  # flight is integrated in half steps of the grid


@jit
def look_ahead(
    x: Floats, points: Floats, speeds: Floats, index: int, vehicle: Floats, dt: float, states: Floats
) -> None:
    """Fly a path ahead: `states` (STRIDE (n - 1) + 1, 7) starts with now and goes on in steps of ``dt / STRIDE``."""
    states[0] = x
    n = states.shape[0] - 1
    fly_path(x, points, speeds, index, vehicle, np.zeros(3), dt / STRIDE, n, states[1:])


@jit
def free_of_capture(vehicle: Floats) -> Floats:
    """Return the vehicle's parameters for flying a maneuver, whose waypoints are never flown back to."""
    free = vehicle.copy()
    free[P_CAPTURE] = math.inf
    return free


@jit
def advance_index(x: Floats, points: Floats, index: int, vehicle: Floats) -> int:
    """Return the point of a path that is flown to now."""
    while index < points.shape[0] and waypoint_passed(x, points, index, vehicle, np.zeros(3)):
        index += 1
    return index


@jit_uncounted
def first_sense(values: Floats, path: Integers, count: int, band: float) -> int:
    """Return the sense (-1, 0, 1) in which a path first turns (or climbs), within the rings it is committed to."""
    for ring in range(min(COMMITTED_RINGS, count)):
        value = values[path[ring]]
        if abs(value) > band:
            return 1 if value > 0.0 else -1
    return 0


class Settings(NamedTuple):
    """What a planner is made of; arrays as the kernels that use them say.

    Attributes
    ----------
    vehicle, free : ndarray, shape (vehicles.kernels.N_PARAMS,)
        The point mass, for flying the mission and for flying a maneuver (`free_of_capture`).
    geometry : int
    ring_start, ring_steps, headings, heights : ndarray
        The map, as for `search_map`.
    risk, search_risk : ndarray, shape (N_RISK,)
        What flown paths are judged by, and what the map is searched with (the same, unless the search is as printed).
    goal_weights : ndarray, shape (2,)
    policy : ndarray, shape (N_POLICY,)
    trigger : ndarray, shape (8,)
        Rules of `conflict.detection_kernels.detect` for the trigger `ON_DETECTION`.
    volumes, vertices : ndarray
        Keep-out volumes, of `keep_out.kernels.KeepOuts`.
    """

    vehicle: Floats
    free: Floats
    geometry: int
    ring_start: Integers
    ring_steps: Integers
    headings: Floats
    heights: Floats
    risk: Floats
    search_risk: Floats
    goal_weights: Floats
    policy: Floats
    trigger: Floats
    volumes: Floats
    vertices: Floats


class Memory(NamedTuple):
    """What a planner remembers, and its buffers.

    Attributes
    ----------
    plan : ndarray, shape (N_PLAN,)
        The maneuver being flown.
    points, speeds, times : ndarray, shape (rings + 2, 3), (rings + 2,), (rings + 2,)
        Its waypoints; the first is where it began, the last straight on after the map.
    held : ndarray of int, shape (1 + n,)
        How many aircraft it avoids, and their keys.
    limits : ndarray, shape (N_LIMITS,)
        Of the aircraft; its speed is the one wanted now.
    states : ndarray, shape (STRIDE (n - 1) + 1, 7)
        Flight ahead over n grid times.
    labels, parent, path : ndarray
        Of `search_map`.
    met : ndarray, shape (3, N_MET)
        What flying the mission, the maneuver kept and the new one would meet.
    """

    plan: Floats
    points: Floats
    speeds: Floats
    times: Floats
    held: Integers
    limits: Floats
    states: Floats
    labels: Floats
    parent: Integers
    path: Integers
    met: Floats


@jit
def flight_enters(states: Floats, volumes: Floats, vertices: Floats) -> bool:
    """Return whether a flown path enters a keep-out volume that its start is not in."""
    if volumes.shape[0] == 0:
        return False
    a = states[0]
    allowed = volumes_entered(a[0], a[1], a[2], a[0], a[1], a[2], volumes, vertices)
    for k in range(states.shape[0] - 1):
        a, b = states[k], states[k + 1]
        if volumes_entered(a[0], a[1], a[2], b[0], b[1], b[2], volumes, vertices) > allowed:
            return True
    return False


@jit_uncounted
def path_cost(
    states: Floats,
    goal: Floats,
    speed: float,
    climb_rate: float,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    settings: Settings,
    met: Floats,
) -> float:
    """Return what a flown path cost: its risk, what lies beyond its end, and being away from the mission there."""
    x = states[states.shape[0] - 1]
    k = (states.shape[0] - 1) // STRIDE
    beyond = cost_beyond(
        x[0], x[1], x[2], x[3] * math.cos(x[4]), x[3] * math.sin(x[4]), intruders, weight, n_intruders,
        k, k * settings.policy[DT], settings.risk,
    )  # fmt: skip
    return float(met[COST] + beyond + terminal_cost(x[0], x[1], x[2], goal, speed, climb_rate, settings.goal_weights))


@jit
def decide(
    t: float,
    x: Floats,
    mission: Floats,
    mission_speeds: Floats,
    mission_index: int,
    intruders: Floats,
    weight: Floats,
    n_intruders: int,
    settings: Settings,
    memory: Memory,
) -> int:
    """Decide what to fly; `memory.states` holds the flight ahead along the mission.

    Parameters
    ----------
    t : float
        Now, s.
    x : ndarray, shape (7,)
        The ownship as a point-mass state in the ground frame.
    mission, mission_speeds, mission_index
        The mission and its next waypoint.
    intruders, weight, n_intruders
        As filled by `prediction_kernels.predict_intruders` on the grid of `memory.states`.
    settings : Settings
    memory : Memory
        Updated.

    Returns
    -------
    int
        `MISSION`, `KEEP`, `NEW` or `RETURN`.
    """
    risk, policy, limits, plan, states = settings.risk, settings.policy, memory.limits, memory.plan, memory.states
    ring_steps, headings, heights = settings.ring_steps, settings.headings, settings.heights
    labels, path = memory.labels, memory.path
    met_mission, met_kept, met_new = memory.met[0], memory.met[1], memory.met[2]
    dt = policy[DT]
    n = (states.shape[0] - 1) // STRIDE + 1
    goal, start = np.empty(3), np.empty(N_LABEL)
    # The speed the mission wants, not the one of this moment: a plan flown slowly would look safe and never be flown.
    wanted = mission_speeds[min(mission_index, mission_speeds.shape[0] - 1)]
    limits[SPEED] = wanted
    point_along(mission, mission_index, x[0], x[1], wanted * (n - 1) * dt, goal)
    active = plan[ACTIVE] > 0.0
    climb_rate = max(limits[CLIMB_MAX], 0.1)

    margin = policy[RETURN_MARGIN] if active else 1.0
    evaluate_path(states, STRIDE, n, dt, intruders, weight, n_intruders, margin, risk, met_mission)
    soon = states[STRIDE * min(n - 1, ring_steps[0] + ring_steps[min(1, ring_steps.shape[0] - 1)])].copy()
    threatened = met_mission[FIRST_OUTER] <= policy[TRIGGER] or met_mission[FIRST_HARD] < math.inf
    if not active and not threatened:
        return MISSION
    if active:
        if threatened:
            plan[SAFE_SINCE] = math.inf
        else:
            plan[SAFE_SINCE] = min(plan[SAFE_SINCE], t)
            if t - plan[T_CHOSEN] >= policy[HOLD] and t - plan[SAFE_SINCE] >= policy[CLEAR_TIME]:
                plan[:] = 0.0
                return RETURN

    kept_cost = math.inf
    exhausted = False
    if active:
        n_points = int(plan[N_POINTS])
        index = int(plan[POINT_INDEX])
        look_ahead(x, memory.points[:n_points], memory.speeds[:n_points], index, settings.free, dt, states)
        # With a smaller margin than it was chosen with: an estimate that wavers is no reason for another path.
        evaluate_path(states, STRIDE, n, dt, intruders, weight, n_intruders, policy[KEEP_MARGIN], risk, met_kept)
        kept_cost = path_cost(states, goal, wanted, climb_rate, intruders, weight, n_intruders, settings, met_kept)
        exhausted = index >= n_points or t > memory.times[n_points - 1] - EXHAUSTED
        settled = t - plan[T_CHOSEN] >= policy[SETTLE]
        if flight_enters(states, settings.volumes, settings.vertices):
            kept_cost += COST_KEEP_OUT
            exhausted = True
        # What would be lost late can wait: by then the traffic is better known.
        if not settled and min(met_kept[FIRST_HARD], met_kept[FIRST_INNER]) > policy[ESCAPE] and not exhausted:
            return KEEP
        if met_kept[FIRST_OUTER] > policy[ESCAPE] and t - plan[T_CHOSEN] < policy[RENEW] and not exhausted:
            return KEEP

    start[NORTH], start[EAST], start[DOWN] = x[0], x[1], x[2]
    start[COURSE], start[CLIMB] = x[4], x[6]
    turn_sense, climb_sense = int(plan[TURN_SENSE]), int(plan[CLIMB_SENSE])
    count = search_map(
        start, settings.geometry, settings.ring_start, ring_steps, headings, heights, dt, limits,
        intruders, weight, n_intruders, settings.search_risk, settings.volumes, settings.vertices,
        goal, settings.goal_weights, turn_sense, climb_sense, labels, memory.parent, path,
    )  # fmt: skip
    if count == 0:
        return KEEP if active else MISSION
    new_points, new_times = np.empty((count + 2, 3)), np.empty(count + 2)
    new_speeds = np.full(count + 2, wanted)
    new_points[0, 0], new_points[0, 1], new_points[0, 2], new_times[0] = x[0], x[1], x[2], t
    elapsed = 0.0
    for ring in range(count):
        elapsed += ring_steps[ring] * dt
        new_points[ring + 1] = labels[path[ring], :3]
        new_times[ring + 1] = t + elapsed
    end = labels[path[count - 1]]
    new_points[count + 1, 0] = end[NORTH] + CARRY_ON * wanted * math.cos(end[COURSE])
    new_points[count + 1, 1] = end[EAST] + CARRY_ON * wanted * math.sin(end[COURSE])
    new_points[count + 1, 2] = end[DOWN]
    new_times[count + 1] = new_times[count] + CARRY_ON
    look_ahead(x, new_points, new_speeds, 1, settings.free, dt, states)
    evaluate_path(states, STRIDE, n, dt, intruders, weight, n_intruders, 1.0, risk, met_new)
    new_cost = path_cost(states, goal, wanted, climb_rate, intruders, weight, n_intruders, settings, met_new)
    if flight_enters(states, settings.volumes, settings.vertices):
        new_cost += COST_KEEP_OUT
    if not active and met_mission[FIRST_OUTER] > policy[TRIGGER_NOW]:
        # Where the plan begins like the mission, waiting costs nothing, and the traffic shows what it does.
        label = labels[path[min(1, count - 1)]]
        if math.hypot(label[NORTH] - soon[0], label[EAST] - soon[1]) < SAME_PLACE and abs(label[DOWN] - soon[2]) < 20.0:
            return MISSION
    turned = first_sense(headings, path, count, 0.08)
    climbed = first_sense(heights, path, count, 1.0)
    if active:
        rescued = (met_kept[TIME_HARD] > 0.0 and met_new[TIME_HARD] < 0.5 * met_kept[TIME_HARD]) or (
            met_kept[TIME_INNER] > 0.0
            and met_new[TIME_INNER] < 0.5 * met_kept[TIME_INNER]
            and met_new[TIME_HARD] <= met_kept[TIME_HARD]
        )
        reverses = turned * turn_sense < 0 or climbed * climb_sense < 0
        better = new_cost < policy[SWITCH_RATIO] * kept_cost and kept_cost - new_cost > policy[SWITCH_GAIN]
        if not rescued and not exhausted and (reverses or not better):
            return KEEP
    memory.points[: count + 2] = new_points
    memory.times[: count + 2] = new_times
    memory.speeds[: count + 2] = new_speeds
    if not active:
        plan[TURN_SENSE] = plan[CLIMB_SENSE] = 0.0
        plan[SAFE_SINCE] = math.inf
    if turned != 0:
        plan[TURN_SENSE] = turned
    if climbed != 0:
        plan[CLIMB_SENSE] = climbed
    plan[ACTIVE], plan[T_CHOSEN], plan[N_POINTS], plan[POINT_INDEX] = 1.0, t, count + 2, 1.0
    plan[LEAST_BAD] = 1.0 if met_new[TIME_HARD] > 0.0 else 0.0
    return NEW


def warmup() -> None:
    """Compile what Python calls of this module; `planner_kernels` compiles the rest."""
    free_of_capture(np.ones(N_PARAMS))
    advance_index(np.ones(N_STATES), np.ones((2, 3)), 0, np.ones(N_PARAMS))
