"""One flight of the ground radar system, and what is kept of it: violations and causes, tracks, paths, CPU time."""

import functools
import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.escape_paths import way_out_exists
from wideberth import __version__
from wideberth.assembly import build_traffic
from wideberth.config import ScenarioConfig, apply_override, build_scenario, read_toml
from wideberth.run import fly_unaware, run_scenario
from wideberth.simulation.config import CylinderConfig
from wideberth.types import AlertLevel, FloatArray, Snapshot, TrackStatus

SCENARIOS = Path("scenarios")
NEAR = 30.0
"""A track this near to an aircraft is its track, m."""
LOST = 1.0
"""A track that is away for longer is lost, s."""


@dataclass(frozen=True, slots=True)
class Job:
    """One flight: a case, the scenario with its overrides, the seed, whether it avoids, and whether a map is kept.

    With `fixed_wing` twelve states fly in place of a point mass.
    """

    case: str
    scenario: str
    overrides: tuple[str, ...]
    seed: int
    avoid: bool
    mapped: bool = False
    fixed_wing: bool = False

    @property
    def key(self) -> str:
        """What tells it from others."""
        return f"{self.case}/{self.seed}/{'with' if self.avoid else 'without'}"


def scenario_of(job: Job) -> ScenarioConfig:
    """Return the scenario that a job flies."""
    path = SCENARIOS / f"{job.scenario}.toml"
    tables = read_toml(path)
    for override in job.overrides:
        apply_override(tables, override)
    tables["seed"], tables["avoid"] = job.seed, job.avoid
    if job.fixed_wing:
        capture = tables["ownship"]["waypoint_capture_m"]
        tables["ownship"] = {"kind": "fixed_wing", "aircraft": "zagi", "waypoint_capture_m": capture}
    return build_scenario(tables, source=str(path), folder=SCENARIOS)


class Watcher:
    """Looks at every step of a flight with the truth beside it."""

    def __init__(self, scenario: ScenarioConfig) -> None:
        assert scenario.mission is not None
        frame = scenario.frame()
        mission = scenario.mission.mission(frame)
        self._traffic = build_traffic(scenario, mission, frame, 3600.0).truth
        self._start = mission.t_start
        radar = scenario.sensors[0].config
        self._radar = np.array([radar.north_m, radar.east_m, -radar.altitude_m])
        self._reach = radar.range_limit
        self.times: list[float] = []
        self.own: list[FloatArray] = []
        self.own_velocity: list[FloatArray] = []
        self.truths: list[FloatArray] = []
        self.tracked: list[set[int]] = []
        self.cycles: list[float] = []
        self.waited: dict[int, float] = {}  # time in the radar's reach until a good track, s
        self.good: dict[int, float] = {}
        self.alerted: dict[int, float] = {}
        self.own_alerts = 0
        self.first_maneuver: float | None = None
        self.taken = 0.0

    def __call__(self, elapsed: float, planned: float, snapshot: Snapshot) -> None:
        """Take note of a step."""
        began = time.process_time()
        self._look(elapsed, snapshot)
        self.taken += time.process_time() - began

    def _look(self, elapsed: float, snapshot: Snapshot) -> None:
        t = snapshot.t
        truth = self._traffic.truth(t).positions
        own = np.array(snapshot.ownship.position)
        since = elapsed - self.times[-1] if self.times else 0.0
        self.times.append(elapsed)
        self.own.append(own)
        self.own_velocity.append(np.array(snapshot.ownship.velocity))
        self.truths.append(truth)
        self.cycles.append(sum(snapshot.stage_times.values()))
        if snapshot.maneuver is not None and self.first_maneuver is None:
            self.first_maneuver = elapsed
        places = {track.id: track for track in snapshot.tracks if track.status is TrackStatus.CONFIRMED}
        tracked = set()
        for i, place in enumerate(truth):
            if i not in self.good and np.linalg.norm(place - self._radar) <= self._reach:
                # Only within reach: some leave it again before they are tracked.
                self.waited[i] = self.waited[i] + since if i in self.waited else 0.0
            near = [
                one for one in places.values() if not one.is_ownship and np.linalg.norm(one.position - place) <= NEAR
            ]
            if near:
                tracked.add(i)
                self.good.setdefault(i, elapsed)
        self.tracked.append(tracked)
        for threat in snapshot.threats:
            track = places.get(threat.track_id)
            if threat.level < AlertLevel.CORRECTIVE or track is None:
                continue
            away = np.linalg.norm(truth - track.position, axis=1) if len(truth) else np.empty(0)
            for near_it in np.flatnonzero(away <= NEAR):
                self.alerted.setdefault(int(near_it), elapsed)
            self.own_alerts += bool(np.linalg.norm(own - track.position) <= NEAR and not (away <= 2 * NEAR).any())

    def ahead(self, k: int) -> Any:
        """Return the function that gives the intruders' true positions so many seconds after step `k`."""
        t = self._start + self.times[k]
        return lambda later: self._traffic.truth(t + later).positions


@functools.cache
def _digest(scenario: str, overrides: tuple[str, ...], fixed_wing: bool) -> str:
    resolved = scenario_of(Job("", scenario, overrides, 0, True, fixed_wing=fixed_wing)).resolved()
    return hashlib.sha256(json.dumps([__version__, resolved], sort_keys=True, default=str).encode()).hexdigest()[:16]


def digest_of(job: Job) -> str:
    """Return what tells flights of the same version and scenario from others; seed and avoidance are no part of it."""
    return _digest(job.scenario, job.overrides, job.fixed_wing)


def fly(job: Job) -> dict[str, Any]:
    """Fly one job and return its row, JSON types only."""
    row = {"key": job.key, "digest": digest_of(job), "case": job.case, "seed": job.seed, "avoid": job.avoid}
    if job.avoid:
        return row | _flight(job)
    # Of the twin only the true states are compared: no sensor looks.
    return row | {"violations": fly_unaware(scenario_of(job))["violation_count"], "causes": []}


def _flight(job: Job) -> dict[str, Any]:
    scenario = scenario_of(job)
    watcher = Watcher(scenario)
    began = time.process_time()
    summary = run_scenario(scenario, None, progress=watcher)
    taken = time.process_time() - began - watcher.taken
    cycles = 1e3 * np.array(watcher.cycles)
    row: dict[str, Any] = {
        "violations": summary["violation_count"],
        "intruders": len(watcher.truths[0]),
        "completed": summary["mission_completed"],
        "path_ratio": summary["path_length_m"] / summary["mission_path_length_m"],
        "good_track_s": [watcher.waited[i] for i in sorted(watcher.good) if i in watcher.waited],
        "never_tracked": sum(i not in watcher.good for i in watcher.waited),
        "own_alerts": watcher.own_alerts,
        "least_bad": summary["least_bad_maneuvers"],
        "reversals": summary["reversals"],
        "cycle_ms": {"mean": float(cycles.mean()), "max": float(cycles.max()), "steps": len(cycles)},
        "real_time_factor": watcher.times[-1] / taken,
        "causes": [],
    }
    if summary["violation_count"]:
        row["causes"] = _causes(scenario, watcher)
    if job.mapped:
        # One in ten steps is enough for a map.
        row["map"] = {
            "t": watcher.times[::10],
            "own": np.round(watcher.own[::10], 1).tolist(),
            "intruders": np.round(watcher.truths[::10], 1).tolist(),
        }
    return row


def _causes(scenario: ScenarioConfig, watcher: Watcher) -> list[str]:
    """Return why each intruder that was too near came that near."""
    volume = scenario.evaluation.collision_volume
    assert isinstance(volume, CylinderConfig)
    apart = np.array(watcher.truths) - np.array(watcher.own)[:, None, :]
    inside = (np.hypot(apart[..., 0], apart[..., 1]) <= volume.radius_m) & (
        np.abs(apart[..., 2]) <= volume.half_height_m
    )
    vehicle = scenario.ownship.target(scenario.ownship.config)
    limits: Any = scenario.avoidance.config

    def open_at(k: int) -> bool:
        return way_out_exists(
            watcher.own[k],
            watcher.own_velocity[k],
            vehicle.params,
            watcher.ahead(k),
            radius=volume.radius_m,
            half_height=volume.half_height_m,
            floor=limits.altitude_min_m,
            ceiling=limits.altitude_max_m,
        )

    return [_cause(watcher, int(i), int(np.argmax(inside[:, i])), open_at) for i in np.flatnonzero(inside.any(axis=0))]


def _cause(watcher: Watcher, i: int, k_inside: int, open_at: Any) -> str:
    if i not in watcher.good or watcher.good[i] >= watcher.times[k_inside]:
        return "never tracked before"
    k_good = int(np.searchsorted(watcher.times, watcher.good[i] - 1e-6))
    if not open_at(k_good):
        return "no feasible path at first detection"
    step = watcher.times[1] - watcher.times[0]
    away, longest = 0, 0
    for k in range(k_good, k_inside):
        away = 0 if i in watcher.tracked[k] else away + 1
        longest = max(longest, away)
    if longest * step > LOST:
        return "track lost"
    decided = min(watcher.alerted.get(i, np.inf), np.inf if watcher.first_maneuver is None else watcher.first_maneuver)
    k_decided = min(int(np.searchsorted(watcher.times, decided)), k_inside)
    return "planner" if open_at(k_decided) else "late detection"
