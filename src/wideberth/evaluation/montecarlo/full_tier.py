"""One encounter through the full pipeline: as a scenario that `run` flies, and scored as the fast tier scores.

The same noise, the same parts, the same decisions; the tests hold the fast tier against it.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wideberth.assembly import build_pipeline, build_traffic, build_world
from wideberth.config import ScenarioConfig, build_scenario
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import encounter_kernels as ek
from wideberth.evaluation.montecarlo import geometry_kernels as gk
from wideberth.evaluation.montecarlo import judge_kernels as jk
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.fast_settings import geometry_array, mission_length, run_settings
from wideberth.evaluation.montecarlo.relevance_kernels import all_passed, find_needed
from wideberth.simulation.truth import Truth
from wideberth.tracking.life_kernels import N_INTEGERS, STARTED
from wideberth.types import FloatArray, Maneuver, Snapshot, Track
from wideberth.units import KNOT
from wideberth.vehicles import kernels as vk


@dataclass(frozen=True, slots=True)
class FullEncounter:
    """What the full tier made of an encounter.

    Attributes
    ----------
    floats, integers : ndarray, shape (m, N_FLOAT_COLUMNS), (m, N_INTEGER_COLUMNS)
        As of the fast tier.
    maneuvers : tuple of Maneuver
        In the order in which they were chosen.
    cycle_times : tuple of float
        CPU time of each step of the run with avoidance, s.
    """

    floats: FloatArray
    integers: np.ndarray
    maneuvers: tuple[Maneuver, ...]
    cycle_times: tuple[float, ...]


def address_of(intruder: int) -> str:
    """Return the address of an encounter's intruder."""
    return f"{0xA00000 + intruder + 1:06x}"


def draw(experiment: Experiment, seed: int, intruders: int, encounter: int) -> tuple[FloatArray, FloatArray]:
    """Return the positions relative to the ownship's start, and the velocities, (intruders, 3) each, NED.

    Raises
    ------
    InputError
        If no intruder of these speeds can enter the circle.
    """
    positions, velocities = np.empty((intruders, 3)), np.empty((intruders, 3))
    if not gk.draw_encounter(seed, intruders, encounter, geometry_array(experiment), positions, velocities):
        raise InputError("encounter: no intruder of these speeds can enter the circle at one of its points")
    return positions, velocities


def encounter_scenario(
    experiment: Experiment, seed: int, intruders: int, encounter: int, *, avoid: bool = True
) -> ScenarioConfig:
    """Return an encounter as a scenario that stands by itself.

    Parameters
    ----------
    experiment : Experiment
    seed : int
    intruders, encounter : int
        Which encounter.
    avoid : bool

    Raises
    ------
    InputError
        If there is no such encounter.
    """
    if not 1 <= intruders <= experiment.encounter.points:
        raise InputError(f"{intruders} intruders cannot start at {experiment.encounter.points} different points")
    positions, velocities = draw(experiment, seed, intruders, encounter)
    altitude = experiment.encounter.ownship_altitude_m
    tables = experiment.resolved()
    for key in ("encounter", "errors", "scoring"):
        del tables[key]
    tables["sensor"]["encounter"] = {"intruders": intruders, "number": encounter}
    tables["mission"] = {
        "speed_mps": experiment.encounter.ownship_speed_kt * KNOT,
        "waypoints": [
            {"north_m": 0.0, "east_m": 0.0, "altitude_m": altitude},
            {"north_m": mission_length(experiment), "east_m": 0.0, "altitude_m": altitude},
        ],
    }
    tables["traffic"] = {
        "kind": "simulated",
        "intruders": [
            {
                "address": address_of(i),
                "callsign": f"INTR{i + 1}",
                "position": {"north_m": p[0], "east_m": p[1], "altitude_m": altitude - p[2]},
                "course_deg": math.degrees(math.atan2(v[1], v[0])),
                "speed_mps": math.hypot(v[0], v[1]),
            }
            for i, (p, v) in enumerate(zip(positions.tolist(), velocities.tolist(), strict=True))
        ],
    }
    return build_scenario(
        {
            **tables,
            "name": f"{experiment.name} {intruders}-{encounter}",
            "seed": seed,
            "duration_s": experiment.encounter.duration_s,
            "origin": {"lat_deg": 40.25, "lon_deg": -111.65},
            "avoid": avoid,
            "evaluation": {"well_clear_volume": "sarp"},
        }
    )


class _Run:
    """One flight of an encounter, judged at every step."""

    def __init__(self, scenario: ScenarioConfig, run: ek.RunSettings, counter: Callable[[], float]) -> None:
        assert scenario.mission is not None
        frame = scenario.frame()
        mission = scenario.mission.mission(frame)
        traffic = build_traffic(scenario, mission, frame, scenario.duration_s or 0.0)
        self.world = build_world(scenario, mission, traffic)
        self.pipeline = build_pipeline(scenario, counter)
        self.run = run
        m = len(self.world.truth(0.0).ids)
        self.judge = jk.new_judge(m)
        jk.begin_judge(self.judge)
        self.needed = np.ones(m, np.bool_)
        self.seen = np.zeros((m, N_INTEGERS), np.int64)
        self.tracks = (np.zeros((m, 3)), np.zeros((m, 3)), np.zeros((m, 9, 9)))
        self.t = 0.0

    def step(self, k: int) -> tuple[Snapshot, Truth]:
        """Take step `k` of the pipeline, and judge it."""
        self.t = k * ek.STEP
        ownship, scans = self.world.sense(self.t)
        snapshot = self.pipeline.step(self.t, ownship, scans, self.world.mission)
        self.world.actuate(self.t, snapshot.maneuver)
        truth = self.world.truth(self.t)
        by_id = {track.id: track for track in snapshot.tracks}
        for i, name in enumerate(truth.ids):
            self._see(i, by_id.get(name))
        own, velocity = ownship.position, ownship.velocity
        run, judge = self.run, self.judge
        find_needed(own, velocity, truth.positions, truth.velocities, run.reach, run.reach_time, self.needed)
        jk.judge_step(
            self.t, own, velocity, truth.positions, truth.velocities, self.needed, self.seen, *self.tracks,
            run.scoring, judge.marks, judge.inside, judge.scores,
        )  # fmt: skip
        return snapshot, truth

    def _see(self, i: int, track: Track | None) -> None:
        self.seen[i, STARTED] = track is not None
        if track is not None:
            self.tracks[0][i], self.tracks[1][i], self.tracks[2][i] = track.position, track.velocity, track.covariance

    def passed(self, truth: Truth) -> bool:
        """Return whether all intruders move away."""
        ownship = self.world.vehicle.ownship(self.t)
        along = np.array([self.run.mission_speeds[1], 0.0, 0.0])
        return bool(all_passed(ownship.position, ownship.velocity, along, truth.positions, truth.velocities))


def fly_full(
    experiment: Experiment,
    seed: int,
    intruders: int,
    encounter: int,
    *,
    avoid: bool = True,
    counter: Callable[[], float] = time.thread_time,
) -> FullEncounter:
    """Fly an encounter through the full pipeline, without and with avoidance, and score it like the fast tier.

    Parameters
    ----------
    experiment : Experiment
    seed : int
    intruders, encounter : int
        Which encounter.
    avoid : bool
        False: only the twin without avoidance is flown, and stands for both.
    counter : callable
        CPU seconds.

    Raises
    ------
    InputError
        If there is no such encounter.
    """
    run = run_settings(experiment)
    floats = np.full((intruders, ek.N_FLOAT_COLUMNS), math.nan)
    integers = np.zeros((intruders, ek.N_INTEGER_COLUMNS), np.int64)
    start, velocities = draw(experiment, seed, intruders, encounter)
    start = start + run.mission[0]

    twin = _Run(encounter_scenario(experiment, seed, intruders, encounter, avoid=False), run, counter)
    times = []
    for k in range(run.steps + 1):
        snapshot, truth = twin.step(k)
        times.append(sum(snapshot.stage_times.values()))
        if twin.passed(truth):
            break
    ek.write_twin(twin.judge, start, velocities, run, floats, integers)
    floats[:, ek.DURATION_ALONE] = twin.t
    maneuvers: list[Maneuver] = []
    last = twin
    if avoid:
        last = _Run(encounter_scenario(experiment, seed, intruders, encounter), run, counter)
        times = []
        for k in range(run.steps + 1):
            snapshot, truth = last.step(k)
            times.append(sum(snapshot.stage_times.values()))
            if snapshot.maneuver is not None and (not maneuvers or snapshot.maneuver.t != maneuvers[-1].t):
                maneuvers.append(snapshot.maneuver)
            aligned = abs(last.world.vehicle.state[vk.HEADING]) < ek.ALIGNED
            if snapshot.maneuver is None and aligned and last.passed(truth):
                break
    ek.write_run(last.judge, floats, integers)
    if maneuvers:
        floats[:, ek.T_MANEUVER] = maneuvers[0].t
    floats[:, ek.DURATION] = last.t
    own = last.world.vehicle.state[:3]
    left = float(np.linalg.norm(run.mission[1] - own))
    floats[:, ek.EXTRA_PATH] = last.world.path_length + left - (run.mission[1, 0] - run.mission[0, 0])
    integers[:, ek.MANEUVERS] = len(maneuvers)
    integers[:, ek.LEAST_BAD_COUNT] = sum(maneuver.least_bad for maneuver in maneuvers)
    return FullEncounter(floats, integers, tuple(maneuvers), tuple(times))
