"""The fast tier: one encounter from the first broadcast to the last score, compiled, from the kernels of the pipeline.

Each encounter is flown twice on the same noise: the twin without avoidance, in which detection is judged, and the run
with avoidance. Until the first maneuver both are the same, so the second begins there, as a fork of the first.
"""

import math
from typing import NamedTuple

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.decision_kernels import (
    ACTIVE,
    KEEP,
    LEAST_BAD,
    MISSION,
    NEW,
    ON_DETECTION,
    TRIGGER_KIND,
    Memory,
    Settings,
)
from wideberth.avoidance.planner_kernels import detected, plan
from wideberth.conflict.alarm_kernels import N_SCORES, PROBABILITY
from wideberth.conflict.kernels import horizontal_cpa
from wideberth.evaluation.montecarlo.flight_kernels import FLOWN, Flight, begin_flight, move, new_flight, take_over
from wideberth.evaluation.montecarlo.geometry_kernels import OWN_SPEED, draw_encounter
from wideberth.evaluation.montecarlo.judge_kernels import (
    FIRST,
    SCORES,
    TRUE,
    TRUE_OTHER,
    Judge,
    begin_judge,
    copy_judge,
    judge_step,
    new_judge,
)
from wideberth.evaluation.montecarlo.relevance_kernels import all_passed, find_needed
from wideberth.evaluation.montecarlo.sensing_kernels import (
    Buffers,
    SensingSettings,
    SensingState,
    any_due,
    begin_sensing,
    copy_sensing,
    hear_all,
    move_tracks,
    new_buffers,
    new_sensing,
    track_output,
)
from wideberth.evaluation.montecarlo.separation_kernels import HORIZONTAL, VERTICAL
from wideberth.tracking.life_kernels import ACCEPTED_COUNT, CONFIRM, STARTED
from wideberth.vehicles.kernels import BANK, HEADING, ground_velocity, wrap_angle

STEP = 0.1  # s, of everything but decisions

# Columns of a row, in the order of `rows.FLOAT_COLUMNS` and of the integers after them.
NORTH, EAST, HEIGHT, V_NORTH, V_EAST, T_CPA, MISS, T_TRUE, T_TRUE_OTHER = 0, 1, 2, 3, 4, 5, 6, 7, 8
T_FIRST, SCORE_FIRST = 9, 13
T_TRUE_IN_RUN, T_DETECTED_IN_RUN = 17, 18
HORIZONTAL_ALONE, VERTICAL_ALONE, HORIZONTAL_RUN, VERTICAL_RUN = 19, 20, 21, 22
T_MANEUVER, DURATION_ALONE, DURATION, EXTRA_PATH = 23, 24, 25, 26
N_FLOAT_COLUMNS = 27
INSIDE_ALONE, INSIDE, MANEUVERS, LEAST_BAD_COUNT = 0, 1, 2, 3
N_INTEGER_COLUMNS = 4

DONE, NEEDS_FULL_TIER, NOT_DRAWN = 0, 1, 2
"""What became of an encounter."""

ALIGNED = 0.1  # rad off the mission's course at which the ownship is back on it


class RunSettings(NamedTuple):
    """All that encounters of an experiment share.

    Attributes
    ----------
    geometry : ndarray
        Of `geometry_kernels`.
    sensing : SensingSettings
    planner : Settings
    scoring : ndarray, shape (judge_kernels.N_SCORING,)
    mission, mission_speeds : ndarray, shape (2, 3), (2,)
    steps : int
        Longest run, in steps.
    decision_steps : int
        Steps between decisions.
    reach, reach_time : float
        An intruder that moves away and is farther than this, m, and farther than it flies in this time, s, matters to
        nothing.
    """

    geometry: np.ndarray
    sensing: SensingSettings
    planner: Settings
    scoring: np.ndarray
    mission: np.ndarray
    mission_speeds: np.ndarray
    steps: int
    decision_steps: int
    reach: float
    reach_time: float


class Scene(NamedTuple):
    """A run as it is now.

    Attributes
    ----------
    own, own_velocity : ndarray, shape (3,)
    positions : ndarray, shape (m, 3)
        Of the intruders.
    needed, use : ndarray of bool, shape (m,)
        Who matters now; who of them is tracked.
    sensing : SensingState
    judge : Judge
    """

    own: np.ndarray
    own_velocity: np.ndarray
    positions: np.ndarray
    needed: np.ndarray
    use: np.ndarray
    sensing: SensingState
    judge: Judge


@jit
def new_scene(m: int) -> Scene:
    """Return a scene with `m` intruders, to be begun."""
    return Scene(
        np.zeros(3), np.zeros(3), np.zeros((m, 3)), np.ones(m, np.bool_), np.zeros(m, np.bool_),
        new_sensing(m), new_judge(m),
    )  # fmt: skip


@jit_uncounted
def take_step(
    seed: int,
    encounter: int,
    t: float,
    t_before: float,
    start: np.ndarray,
    velocities: np.ndarray,
    run: RunSettings,
    scene: Scene,
    buffers: Buffers,
) -> bool:
    """Fly the intruders to time `t`, sense, track and judge, the ownship being there; False for the full tracker."""
    own, own_velocity, positions, needed = scene.own, scene.own_velocity, scene.positions, scene.needed
    sensing, judge = scene.sensing, scene.judge
    for i in range(positions.shape[0]):
        for j in range(3):
            positions[i, j] = start[i, j] + t * velocities[i, j]
    find_needed(own, own_velocity, positions, velocities, run.reach, run.reach_time, needed)
    if any_due(t, sensing.due, needed) and not hear_all(
        seed, positions.shape[0], encounter, t, t_before, own, start, velocities, needed, run.sensing, sensing, buffers
    ):
        return False
    if not move_tracks(t, needed, run.sensing, sensing, buffers):
        return False
    judge_step(
        t, own, own_velocity, positions, velocities, needed, sensing.integers, sensing.position, sensing.velocity,
        sensing.covariance, run.scoring, judge.marks, judge.inside, judge.scores,
    )  # fmt: skip
    return True


@jit_uncounted
def nothing_detected(run: RunSettings, scene: Scene, memory: Memory) -> bool:
    """Return whether the planner would leave all as it is, no maneuver being flown and nothing detected."""
    if memory.plan[ACTIVE] > 0.0 or run.planner.policy[TRIGGER_KIND] != ON_DETECTION:
        return False
    sensing = scene.sensing
    for i in range(scene.use.shape[0]):
        scene.use[i] = scene.needed[i] and sensing.integers[i, STARTED] > 0
    # Of all the tracks; the planner looks at fewer.
    return not detected(
        scene.own, scene.own_velocity, sensing.position, sensing.velocity, sensing.covariance, scene.use,
        run.planner.trigger,
    )  # fmt: skip


@jit
def take_decision(t: float, bank: float, run: RunSettings, scene: Scene, memory: Memory, buffers: Buffers) -> int:
    """Let the planner decide on the tracks there are, in the order in which they were first heard."""
    sensing = scene.sensing
    m = sensing.counts[0]
    position, velocity, acceleration = np.empty((m, 3)), np.empty((m, 3)), np.empty((m, 3))
    covariance, tentative, keys = np.empty((m, 9, 9)), np.empty(m, np.bool_), np.empty(m, np.int64)
    n = 0
    for j in range(m):
        i = sensing.order[j]
        if not scene.needed[i]:
            continue
        track_output(t, i, run.sensing, sensing, buffers)
        position[n], velocity[n], acceleration[n] = sensing.position[i], sensing.velocity[i], sensing.acceleration[i]
        covariance[n] = sensing.covariance[i]
        tentative[n] = sensing.integers[i, ACCEPTED_COUNT] < run.sensing.track[CONFIRM]
        keys[n] = i
        n += 1
    return plan(
        t, scene.own, scene.own_velocity, bank, position[:n], velocity[:n], acceleration[:n], covariance[:n], keys[:n],
        tentative[:n], run.mission, run.mission_speeds, 1, run.planner, memory, np.empty(n),
    )  # fmt: skip


@jit_uncounted
def fly_avoiding(
    seed: int,
    encounter: int,
    k: int,
    start: np.ndarray,
    velocities: np.ndarray,
    run: RunSettings,
    scene: Scene,
    mission_velocity: np.ndarray,
    memory: Memory,
    flight: Flight,
    buffers: Buffers,
    floats: np.ndarray,
    integers: np.ndarray,
) -> bool:
    """Fly on from the first maneuver, chosen at step `k`, to the end; write what concerns the run with avoidance.

    Returns
    -------
    bool
        False where a track needs the full tracker.
    """
    planner, mission, mission_speeds = run.planner, run.mission, run.mission_speeds
    own, own_velocity = scene.own, scene.own_velocity
    for j in range(3):
        own[j] = flight.x[j]
    t = k * STEP
    maneuvers, least_bad = 1, int(memory.plan[LEAST_BAD])
    floats[:, T_MANEUVER] = t
    take_over(memory, planner.vehicle, flight)
    length = own[0] - mission[0, 0]
    wanted = True  # the planner's maneuver stands
    while k < run.steps:
        k += 1
        t_before, t = t, k * STEP
        move(t, t_before, planner, mission, mission_speeds, flight)
        x = flight.x
        length += math.sqrt((x[0] - own[0]) ** 2 + (x[1] - own[1]) ** 2 + (x[2] - own[2]) ** 2)
        own[0], own[1], own[2] = x[0], x[1], x[2]
        ground_velocity(x, flight.wind, own_velocity)
        if not take_step(seed, encounter, t, t_before, start, velocities, run, scene, buffers):
            return False
        if k % run.decision_steps == 0:
            action = MISSION
            if not nothing_detected(run, scene, memory):
                action = take_decision(t, x[BANK], run, scene, memory, buffers)
            wanted = action in (NEW, KEEP)
            if action == NEW:
                maneuvers += 1
                least_bad += int(memory.plan[LEAST_BAD])
                take_over(memory, planner.vehicle, flight)
        if not wanted:
            flight.numbers[FLOWN] = 0.0
        elif flight.numbers[FLOWN] == 0.0:
            take_over(memory, planner.vehicle, flight)  # run out of time, and wanted still
        if (
            not wanted
            and abs(wrap_angle(x[HEADING])) < ALIGNED
            and all_passed(own, own_velocity, mission_velocity, scene.positions, velocities)
        ):
            break
    goal = mission[1]
    left = math.sqrt((goal[0] - own[0]) ** 2 + (goal[1] - own[1]) ** 2 + (goal[2] - own[2]) ** 2)
    floats[:, DURATION] = t
    floats[:, EXTRA_PATH] = length + left - (goal[0] - mission[0, 0])
    integers[:, MANEUVERS], integers[:, LEAST_BAD_COUNT] = maneuvers, least_bad
    return True


@jit_uncounted
def write_run(judge: Judge, floats: np.ndarray, integers: np.ndarray) -> None:
    """Write what the run with avoidance was scored by."""
    for i in range(judge.inside.shape[0]):
        marks = judge.marks[i]
        floats[i, T_TRUE_IN_RUN], floats[i, T_DETECTED_IN_RUN] = marks[TRUE], marks[FIRST + PROBABILITY]
        floats[i, HORIZONTAL_RUN], floats[i, VERTICAL_RUN] = marks[HORIZONTAL], marks[VERTICAL]
        integers[i, INSIDE] = judge.inside[i]


@jit_uncounted
def write_twin(
    judge: Judge, start: np.ndarray, velocities: np.ndarray, run: RunSettings, floats: np.ndarray, integers: np.ndarray
) -> None:
    """Write the encounter, and what the twin without avoidance was scored by."""
    for i in range(judge.inside.shape[0]):
        marks = judge.marks[i]
        floats[i, NORTH], floats[i, EAST] = start[i, 0], start[i, 1]
        floats[i, HEIGHT] = run.mission[0, 2] - start[i, 2]
        floats[i, V_NORTH], floats[i, V_EAST] = velocities[i, 0], velocities[i, 1]
        floats[i, T_CPA], floats[i, MISS] = horizontal_cpa(
            start[i, 0], start[i, 1], velocities[i, 0] - run.geometry[OWN_SPEED], velocities[i, 1]
        )
        floats[i, T_TRUE], floats[i, T_TRUE_OTHER] = marks[TRUE], marks[TRUE_OTHER]
        for j in range(N_SCORES):
            floats[i, T_FIRST + j], floats[i, SCORE_FIRST + j] = marks[FIRST + j], marks[SCORES + j]
        floats[i, HORIZONTAL_ALONE], floats[i, VERTICAL_ALONE] = marks[HORIZONTAL], marks[VERTICAL]
        integers[i, INSIDE_ALONE] = judge.inside[i]


@jit_uncounted
def fly_encounter(
    seed: int,
    encounter: int,
    avoid: bool,
    run: RunSettings,
    twin: Scene,
    forked: Scene,
    memory: Memory,
    flight: Flight,
    buffers: Buffers,
    start: np.ndarray,
    velocities: np.ndarray,
    floats: np.ndarray,
    integers: np.ndarray,
) -> int:
    """Fly one encounter without and with avoidance, and write its rows.

    Parameters
    ----------
    seed, encounter : int
        Which one; the number of intruders is that of the rows.
    avoid : bool
        False: only the twin is flown, and stands for both.
    run : RunSettings
    twin, forked, memory, flight, buffers
        For the caller to keep.
    start, velocities : ndarray, shape (m, 3)
        Buffers.
    floats, integers : ndarray, shape (m, N_FLOAT_COLUMNS), (m, N_INTEGER_COLUMNS)
        Written.

    Returns
    -------
    int
        `DONE`, `NEEDS_FULL_TIER` or `NOT_DRAWN`.
    """
    m = start.shape[0]
    if not draw_encounter(seed, m, encounter, run.geometry, start, velocities):
        return NOT_DRAWN
    for i in range(m):
        for j in range(3):
            start[i, j] += run.mission[0, j]
    begin_sensing(seed, m, encounter, run.sensing, twin.sensing, buffers)
    begin_judge(twin.judge)
    memory.plan[:] = 0.0
    memory.held[0] = 0
    own, own_velocity, speed = twin.own, twin.own_velocity, run.mission_speeds[1]
    for j in range(3):
        own[j], own_velocity[j] = run.mission[0, j], 0.0
    own_velocity[0] = speed
    floats[:] = math.nan
    integers[:] = 0
    maneuvered = False
    t_before = math.nan
    t = 0.0
    for k in range(run.steps + 1):
        t = k * STEP
        if k > 0:
            # As the world integrates it, to the last bit: a waypoint may be passed just now or a step later.
            own[0] += speed * (t - t_before)
        if not take_step(seed, encounter, t, t_before, start, velocities, run, twin, buffers):
            return NEEDS_FULL_TIER
        if (
            avoid
            and not maneuvered
            and k % run.decision_steps == 0
            and not nothing_detected(run, twin, memory)
            and take_decision(t, 0.0, run, twin, memory, buffers) == NEW
        ):
            maneuvered = True
            copy_sensing(twin.sensing, forked.sensing)
            copy_judge(twin.judge, forked.judge)
            begin_flight(speed, own, flight)
            if not fly_avoiding(
                seed, encounter, k, start, velocities, run, forked, own_velocity, memory, flight, buffers, floats,
                integers,
            ):  # fmt: skip
                return NEEDS_FULL_TIER
            write_run(forked.judge, floats, integers)
        if all_passed(own, own_velocity, own_velocity, twin.positions, velocities):
            break
        t_before = t
    write_twin(twin.judge, start, velocities, run, floats, integers)
    floats[:, DURATION_ALONE] = t
    if not maneuvered:
        write_run(twin.judge, floats, integers)
        floats[:, DURATION] = t
        floats[:, EXTRA_PATH] = 0.0
    return DONE


@jit
def fly_encounters(
    seed: int,
    intruders: int,
    first: int,
    avoid: bool,
    run: RunSettings,
    memory: Memory,
    floats: np.ndarray,
    integers: np.ndarray,
    status: np.ndarray,
) -> None:
    """Fly the encounters from `first` on; `status` (n,) says what became of each.

    `floats` (n, intruders, N_FLOAT_COLUMNS) and `integers` (n, intruders, N_INTEGER_COLUMNS) are written.
    """
    twin, forked = new_scene(intruders), new_scene(intruders)
    flight, buffers = new_flight(memory.times.shape[0]), new_buffers(intruders)
    start, velocities = np.zeros((intruders, 3)), np.zeros((intruders, 3))
    for n in range(status.shape[0]):
        status[n] = fly_encounter(
            seed, first + n, avoid, run, twin, forked, memory, flight, buffers, start, velocities,
            floats[n], integers[n],
        )  # fmt: skip


def warmup() -> None:
    """Compile what the full tier calls; `tiers.prepare` compiles `fly_encounters`, a minute's work for few."""
    write_run(new_judge(1), np.zeros((1, N_FLOAT_COLUMNS)), np.zeros((1, N_INTEGER_COLUMNS), np.int64))
