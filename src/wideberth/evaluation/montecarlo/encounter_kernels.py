"""The fast tier: one encounter from the first broadcast to the last score, compiled, from the kernels of the pipeline.

Each encounter is flown twice on the same noise: the twin without avoidance, in which detection is judged, and the run
with avoidance. Until the first maneuver both are the same, so the second begins there, as a fork of the first.
"""

import math
from typing import NamedTuple

import numpy as np

from wideberth._jit import jit
from wideberth.avoidance.decision_kernels import (
    ACTIVE,
    KEEP,
    LEAST_BAD,
    MISSION,
    N_POINTS,
    NEW,
    ON_DETECTION,
    TRIGGER_KIND,
    Memory,
    Settings,
)
from wideberth.avoidance.planner_kernels import detected, plan
from wideberth.conflict.alarm_kernels import N_SCORES, PROBABILITY
from wideberth.conflict.kernels import horizontal_cpa
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
from wideberth.vehicles.kernels import (
    AIRSPEED,
    BANK,
    HEADING,
    N_STATES,
    P_SPEED_MAX,
    P_SPEED_MIN,
    follow_path,
    ground_velocity,
    point_mass_step,
    speed_to_arrive,
    wrap_angle,
)

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


class Flight(NamedTuple):
    """The ownship that flies a maneuver, as `simulation.world.SimWorld` does.

    Attributes
    ----------
    x : ndarray, shape (N_STATES,)
    points, speeds, times : ndarray, shape (n + 1, 3), (n + 1,), (n + 1,)
        The maneuver in flight; the first point is where it was begun.
    numbers : ndarray, shape (4,)
        Whether it is flown (0, 1), its waypoint, when it was chosen (s), and how many points.
    """

    x: np.ndarray
    points: np.ndarray
    speeds: np.ndarray
    times: np.ndarray
    numbers: np.ndarray


FLOWN, INDEX, CHOSEN, COUNT = 0, 1, 2, 3


@jit
def find_needed(
    own: np.ndarray,
    own_velocity: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    reach: float,
    reach_time: float,
    needed: np.ndarray,
) -> None:
    """Write which intruders matter now to detection, planning or separation: see `RunSettings.reach`.

    One that moves away and is out of the planner's reach whatever the ownship does can be left alone. Its broadcasts
    wait until it is needed again, so that nothing depends on that.
    """
    for i in range(positions.shape[0]):
        dx, dy = positions[i, 0] - own[0], positions[i, 1] - own[1]
        vx, vy = velocities[i, 0], velocities[i, 1]
        away = dx * (vx - own_velocity[0]) + dy * (vy - own_velocity[1]) >= 0.0
        far = reach + reach_time * math.sqrt(vx * vx + vy * vy)
        needed[i] = not (away and dx * dx + dy * dy > far * far)


@jit
def all_passed(
    own: np.ndarray,
    own_velocity: np.ndarray,
    mission_velocity: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
) -> bool:
    """Return whether all intruders move away from the ownship, also if it flew along the mission."""
    for i in range(positions.shape[0]):
        dx, dy = positions[i, 0] - own[0], positions[i, 1] - own[1]
        vx, vy = velocities[i, 0], velocities[i, 1]
        if dx * (vx - own_velocity[0]) + dy * (vy - own_velocity[1]) < 0.0:
            return False
        if dx * (vx - mission_velocity[0]) + dy * (vy - mission_velocity[1]) < 0.0:
            return False
    return True


@jit
def move(t: float, t_before: float, run: RunSettings, flight: Flight, wind: np.ndarray, command: np.ndarray) -> None:
    """Fly the ownship from `t_before` to `t`."""
    planner, x, numbers = run.planner, flight.x, flight.numbers
    n = int(numbers[COUNT])
    if numbers[FLOWN] > 0.0 and t_before >= flight.times[n - 1]:
        numbers[FLOWN] = 0.0
    if numbers[FLOWN] > 0.0:
        i = int(numbers[INDEX])
        if i < n:
            flight.speeds[i] = speed_to_arrive(
                t_before, x, flight.points[i], flight.times[i],
                max(planner.vehicle[P_SPEED_MIN], 1.0), planner.vehicle[P_SPEED_MAX],
            )  # fmt: skip
        numbers[INDEX] = follow_path(x, flight.points[:n], flight.speeds[:n], i, planner.free, wind, command)
    else:
        follow_path(x, run.mission, run.mission_speeds, 1, planner.vehicle, wind, command)
    point_mass_step(x, command, wind, planner.vehicle, t - t_before)


@jit
def take_over(memory: Memory, vehicle: np.ndarray, flight: Flight) -> None:
    """Begin to fly the planner's maneuver from here."""
    n = int(memory.plan[N_POINTS])
    flight.points[:n] = memory.points[:n]
    for k in range(3):
        flight.points[0, k] = flight.x[k]
    flight.times[:n] = memory.times[:n]
    flight.speeds[:n] = vehicle[P_SPEED_MIN]
    flight.numbers[FLOWN], flight.numbers[INDEX] = 1.0, 1.0
    flight.numbers[CHOSEN], flight.numbers[COUNT] = memory.times[0], n


@jit
def take_decision(
    t: float,
    own: np.ndarray,
    own_velocity: np.ndarray,
    bank: float,
    run: RunSettings,
    sensing: SensingState,
    memory: Memory,
    buffers: Buffers,
    needed: np.ndarray,
) -> int:
    """Let the planner decide on the tracks there are, in the order in which they were first heard."""
    planner = run.planner
    if memory.plan[ACTIVE] == 0.0 and planner.policy[TRIGGER_KIND] == ON_DETECTION:
        use = needed & (sensing.integers[:, STARTED] > 0)
        if not detected(
            own, own_velocity, sensing.position, sensing.velocity, sensing.covariance, use, planner.trigger
        ):
            return MISSION  # as the planner would say, which looks at fewer
    m = sensing.counts[0]
    position, velocity, acceleration = np.empty((m, 3)), np.empty((m, 3)), np.empty((m, 3))
    covariance, tentative, keys = np.empty((m, 9, 9)), np.empty(m, np.bool_), np.empty(m, np.int64)
    n = 0
    for j in range(m):
        i = sensing.order[j]
        if not needed[i]:
            continue
        track_output(t, i, run.sensing, sensing, buffers)
        position[n], velocity[n], acceleration[n] = sensing.position[i], sensing.velocity[i], sensing.acceleration[i]
        covariance[n] = sensing.covariance[i]
        tentative[n] = sensing.integers[i, ACCEPTED_COUNT] < run.sensing.track[CONFIRM]
        keys[n] = i
        n += 1
    return plan(
        t, own, own_velocity, bank, position[:n], velocity[:n], acceleration[:n], covariance[:n], keys[:n],
        tentative[:n], run.mission, run.mission_speeds, 1, run.planner, memory, np.empty(n),
    )  # fmt: skip


@jit
def fly_avoiding(
    seed: int,
    encounter: int,
    k: int,
    start: np.ndarray,
    velocities: np.ndarray,
    run: RunSettings,
    sensing: SensingState,
    judge: Judge,
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
    m = start.shape[0]
    wind, command, own_velocity = np.zeros(3), np.empty(3), np.empty(3)
    mission_velocity = np.zeros(3)
    mission_velocity[0] = run.mission_speeds[1]
    positions, before = np.empty((m, 3)), np.empty(3)
    t = k * STEP
    integers[:, MANEUVERS] = 1
    integers[:, LEAST_BAD_COUNT] = int(memory.plan[LEAST_BAD])
    floats[:, T_MANEUVER] = t
    take_over(memory, run.planner.vehicle, flight)
    length = flight.x[0] - run.mission[0, 0]
    own = flight.x[:3]
    due, x, p, last, kept, life = sensing.due, sensing.x, sensing.p, sensing.last, sensing.floats, sensing.integers
    seen_position, seen_velocity, covariance = sensing.position, sensing.velocity, sensing.covariance
    numbers, phi, q, bias, track = (
        run.sensing.numbers, run.sensing.phi, run.sensing.q, run.sensing.bias, run.sensing.track,
    )  # fmt: skip
    reach, reach_time, needed = run.reach, run.reach_time, np.ones(m, np.bool_)
    scoring, marks, inside, scratch = run.scoring, judge.marks, judge.inside, judge.buffers
    wanted = True  # the planner's maneuver stands
    while k < run.steps:
        k += 1
        t_before, t = t, k * STEP
        for j in range(3):
            before[j] = own[j]
        move(t, t_before, run, flight, wind, command)
        length += math.sqrt((own[0] - before[0]) ** 2 + (own[1] - before[1]) ** 2 + (own[2] - before[2]) ** 2)
        ground_velocity(flight.x, wind, own_velocity)
        for i in range(m):
            for j in range(3):
                positions[i, j] = start[i, j] + t * velocities[i, j]
        find_needed(own, own_velocity, positions, velocities, reach, reach_time, needed)
        if any_due(t, due, needed) and not hear_all(
            seed, m, encounter, t, t_before, own, start, velocities, needed, run.sensing, sensing, buffers
        ):
            return False
        if not move_tracks(
            t, x, p, last, kept, life, numbers, phi, q, bias, track, seen_position, seen_velocity, covariance, needed,
        ):  # fmt: skip
            return False
        judge_step(
            t, own, own_velocity, positions, velocities, needed, life, seen_position, seen_velocity, covariance,
            scoring, marks, inside, scratch,
        )  # fmt: skip
        if k % run.decision_steps == 0:
            action = take_decision(t, own, own_velocity, flight.x[BANK], run, sensing, memory, buffers, needed)
            wanted = action in (NEW, KEEP)
            if action == NEW:
                integers[:, MANEUVERS] += 1
                integers[:, LEAST_BAD_COUNT] += int(memory.plan[LEAST_BAD])
                take_over(memory, run.planner.vehicle, flight)
        if not wanted:
            flight.numbers[FLOWN] = 0.0
        elif flight.numbers[FLOWN] == 0.0:
            take_over(memory, run.planner.vehicle, flight)  # run out of time, and wanted still
        if (
            not wanted
            and abs(wrap_angle(flight.x[HEADING])) < ALIGNED
            and all_passed(own, own_velocity, mission_velocity, positions, velocities)
        ):
            break
    goal = run.mission[1]
    left = math.sqrt((goal[0] - own[0]) ** 2 + (goal[1] - own[1]) ** 2 + (goal[2] - own[2]) ** 2)
    floats[:, DURATION] = t
    floats[:, EXTRA_PATH] = length + left - (goal[0] - run.mission[0, 0])
    return True


@jit
def begin_flight(run: RunSettings, own: np.ndarray, flight: Flight) -> None:
    """Put the ownship where straight flight along the mission has taken it."""
    flight.x[:] = 0.0
    flight.x[0], flight.x[1], flight.x[2] = own[0], own[1], own[2]
    flight.x[AIRSPEED] = run.mission_speeds[1]
    flight.numbers[:] = 0.0


@jit
def write_run(judge: Judge, floats: np.ndarray, integers: np.ndarray) -> None:
    """Write what the run with avoidance was scored by."""
    for i in range(judge.inside.shape[0]):
        marks = judge.marks[i]
        floats[i, T_TRUE_IN_RUN], floats[i, T_DETECTED_IN_RUN] = marks[TRUE], marks[FIRST + PROBABILITY]
        floats[i, HORIZONTAL_RUN], floats[i, VERTICAL_RUN] = marks[HORIZONTAL], marks[VERTICAL]
        integers[i, INSIDE] = judge.inside[i]


@jit
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


@jit
def fly_encounter(
    seed: int,
    encounter: int,
    avoid: bool,
    run: RunSettings,
    sensing: SensingState,
    forked_sensing: SensingState,
    judge: Judge,
    forked_judge: Judge,
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
    sensing, forked_sensing, judge, forked_judge, memory, flight, buffers
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
    begin_sensing(seed, m, encounter, run.sensing, sensing, buffers)
    begin_judge(judge)
    memory.plan[:] = 0.0
    memory.held[0] = 0
    own_velocity, own, positions = np.zeros(3), run.mission[0].copy(), np.empty((m, 3))
    own_velocity[0] = run.mission_speeds[1]
    floats[:] = math.nan
    integers[:] = 0
    due, x, p, last, kept, life = sensing.due, sensing.x, sensing.p, sensing.last, sensing.floats, sensing.integers
    seen_position, seen_velocity, covariance = sensing.position, sensing.velocity, sensing.covariance
    numbers, phi, q, bias, track = (
        run.sensing.numbers, run.sensing.phi, run.sensing.q, run.sensing.bias, run.sensing.track,
    )  # fmt: skip
    reach, reach_time, needed = run.reach, run.reach_time, np.ones(m, np.bool_)
    scoring, marks, inside, scratch = run.scoring, judge.marks, judge.inside, judge.buffers
    forked = False
    t_before = math.nan
    t = 0.0
    for k in range(run.steps + 1):
        t = k * STEP
        if k > 0:
            # As the world integrates it, to the last bit: a waypoint may be passed just now or a step later.
            own[0] += run.mission_speeds[1] * (t - t_before)
        for i in range(m):
            for j in range(3):
                positions[i, j] = start[i, j] + t * velocities[i, j]
        find_needed(own, own_velocity, positions, velocities, reach, reach_time, needed)
        if any_due(t, due, needed) and not hear_all(
            seed, m, encounter, t, t_before, own, start, velocities, needed, run.sensing, sensing, buffers
        ):
            return NEEDS_FULL_TIER
        if not move_tracks(
            t, x, p, last, kept, life, numbers, phi, q, bias, track, seen_position, seen_velocity, covariance, needed,
        ):  # fmt: skip
            return NEEDS_FULL_TIER
        judge_step(
            t, own, own_velocity, positions, velocities, needed, life, seen_position, seen_velocity, covariance,
            scoring, marks, inside, scratch,
        )  # fmt: skip
        if avoid and not forked and k % run.decision_steps == 0:
            action = take_decision(t, own, own_velocity, 0.0, run, sensing, memory, buffers, needed)
            if action == NEW:
                forked = True
                copy_sensing(sensing, forked_sensing)
                copy_judge(judge, forked_judge)
                begin_flight(run, own, flight)
                if not fly_avoiding(
                    seed, encounter, k, start, velocities, run, forked_sensing, forked_judge, memory, flight, buffers,
                    floats, integers,
                ):  # fmt: skip
                    return NEEDS_FULL_TIER
                write_run(forked_judge, floats, integers)
        if all_passed(own, own_velocity, own_velocity, positions, velocities):
            break
        t_before = t
    write_twin(judge, start, velocities, run, floats, integers)
    floats[:, DURATION_ALONE] = t
    if not forked:
        write_run(judge, floats, integers)
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
    sensing, forked_sensing = new_sensing(intruders), new_sensing(intruders)
    judge, forked_judge = new_judge(intruders), new_judge(intruders)
    buffers = new_buffers(intruders)
    rings = memory.times.shape[0]
    flight = Flight(np.zeros(N_STATES), np.zeros((rings, 3)), np.zeros(rings), np.zeros(rings), np.zeros(4))
    start, velocities = np.zeros((intruders, 3)), np.zeros((intruders, 3))
    for n in range(status.shape[0]):
        status[n] = fly_encounter(
            seed, first + n, avoid, run, sensing, forked_sensing, judge, forked_judge, memory, flight, buffers,
            start, velocities, floats[n], integers[n],
        )  # fmt: skip


def warmup() -> None:
    """Compile what the full tier calls; `tiers.prepare` compiles `fly_encounters`, a minute's work for few."""
    zero = np.zeros((1, 3))
    find_needed(zero[0], zero[0], zero, zero, 1.0, 1.0, np.ones(1, np.bool_))
    all_passed(zero[0], zero[0], zero[0], zero, zero)
    write_run(new_judge(1), np.zeros((1, N_FLOAT_COLUMNS)), np.zeros((1, N_INTEGER_COLUMNS), np.int64))
