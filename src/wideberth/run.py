"""One run of a scenario: the loop, the recording, the scores and the report."""

import dataclasses
import gc
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wideberth.assembly import LoadedRecording, Traffic, build_pipeline, build_traffic, build_world
from wideberth.config import ScenarioConfig
from wideberth.errors import InputError
from wideberth.evaluation.metrics import RunMetrics
from wideberth.pipeline import Pipeline
from wideberth.recording import Recorder
from wideberth.simulation.clock import Clock, SimClock, WallClock
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import SimWorld
from wideberth.types import FloatArray, Mission, Snapshot

OVERTIME = 600.0  # s that a mission may take beyond twice its planned duration

UNJUDGED = ("alerts", "maneuvers", "least_bad_maneuvers", "reversals", "worst_alert", "unknown_alert_steps", "steps")
"""Scores of what the pipeline did, which nobody knows where only true states are flown."""

Progress = Callable[[float, float, Snapshot], None]


def planned_duration(mission: Mission) -> float:
    """Return how long the mission takes without avoidance and wind, s."""
    legs = np.diff(mission.waypoints, axis=0)
    return float(np.sum(np.hypot(legs[:, 0], legs[:, 1]) / mission.speeds[1:]))


def run_scenario(
    scenario: ScenarioConfig,
    out: Path | None,
    progress: Progress | None = None,
    report: bool = True,
    counter: Callable[[], float] = time.thread_time,
    loaded: LoadedRecording | None = None,
) -> dict[str, Any]:
    """Run a scenario from the mission's start until it is completed.

    Parameters
    ----------
    scenario : ScenarioConfig
        With a mission.
    out : Path or None
        Folder for ``summary.json``, ``recording.mcap`` and the report; None: only the summary is returned.
    progress : callable, optional
        Told the time since the start, the planned duration (both s) and the snapshot after each step.
    report : bool
        Whether to write the report as well.
    counter : callable
        CPU seconds.
    loaded : LoadedRecording, optional
        Taken instead of reading the scenario's recording.

    Returns
    -------
    dict
        The summary, as in ``summary.json``.

    Raises
    ------
    InputError
        If there is no mission, or traffic cannot be used, or `out` cannot be written.
    """
    if scenario.mission is None:
        raise InputError("mission: missing; give one in the scenario or with --mission FILE.csv")
    if not scenario.sensors:
        raise InputError("sensor: missing; this scenario has inputs of a flight only: fly it with wideberth fly")
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    planned = planned_duration(mission)
    longest = _longest(scenario, mission)
    traffic = build_traffic(scenario, mission, frame, longest, loaded)
    clock: Clock = SimClock(mission.t_start)
    if traffic.source is not None and traffic.source.live:
        clock = WallClock()
        mission = Mission(mission.waypoints, mission.speeds, clock.now)
    metrics = RunMetrics.of(scenario.evaluation)

    def observe(t: float, position: FloatArray, velocity: FloatArray, truth: Truth) -> None:
        metrics.update(t, position, velocity, truth if traffic.known else None)

    world = build_world(scenario, mission, traffic, observe)
    pipeline = build_pipeline(scenario, counter)
    # To collect all that is loaded would take as long as a hundred cycles, and fall into one of them.
    gc.freeze()
    try:
        if out is None:
            _loop(scenario, world, pipeline, traffic, clock, mission, metrics, None, progress, planned, longest)
            return _summary(scenario, metrics, mission, world, traffic, pipeline.counters)
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{out}: cannot be made a folder: {error.strerror}") from error
        path = out / "recording.mcap"
        with Recorder(path, scenario.resolved(), mission=mission, frame=frame) as recorder:
            _loop(scenario, world, pipeline, traffic, clock, mission, metrics, recorder, progress, planned, longest)
            summary = _summary(scenario, metrics, mission, world, traffic, pipeline.counters)
            recorder.write_summary(summary)
    finally:
        gc.unfreeze()
        if traffic.source is not None:
            traffic.source.close()
    try:
        (out / "summary.json").write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")
    except OSError as error:
        raise InputError(f"{out / 'summary.json'}: cannot be written: {error.strerror}") from error
    if report:
        from wideberth.evaluation.report import write_report
        from wideberth.recording import read_recording

        write_report(out, read_recording(path), summary, title=scenario.name)
    return summary


def fly_unaware(scenario: ScenarioConfig) -> dict[str, Any]:
    """Fly a scenario without avoidance, and judge only the true states: no sensor looks, and nothing is tracked.

    Guidance flies by true states, so separations, losses and path are those of `run_scenario` to the last bit.

    Parameters
    ----------
    scenario : ScenarioConfig
        With a mission, without avoidance, and with traffic whose true states are known.

    Returns
    -------
    dict
        The summary, None for `UNJUDGED`.

    Raises
    ------
    InputError
        If the scenario is not such a one, or its traffic cannot be used.
    """
    if scenario.mission is None:
        raise InputError("mission: missing; give one in the scenario")
    if scenario.avoid:
        raise InputError("avoid: only a flight without avoidance can do without sensors; set avoid = false")
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    longest = _longest(scenario, mission)
    traffic = build_traffic(scenario, mission, frame, longest)
    try:
        if not traffic.known:
            raise InputError("traffic: live, its true states are not known; fly it with wideberth run")
        metrics = RunMetrics.of(scenario.evaluation)
        world = build_world(scenario, mission, dataclasses.replace(traffic, sensors=()), metrics.update)
        step = 0
        while not world.done and world.time - mission.t_start < longest:
            step += 1
            world.sense(mission.t_start + step * scenario.step_s)
        summary = _summary(scenario, metrics, mission, world, traffic, {})
    finally:
        if traffic.source is not None:
            traffic.source.close()
    intruders = [{**row, "alerts": None} for row in summary["per_intruder"]]
    return summary | dict.fromkeys(UNJUDGED) | {"per_intruder": intruders}


def _longest(scenario: ScenarioConfig, mission: Mission) -> float:
    """Return how long a run may take, s."""
    return scenario.duration_s or 2.0 * planned_duration(mission) + OVERTIME


def _loop(
    scenario: ScenarioConfig,
    world: SimWorld,
    pipeline: Pipeline,
    traffic: Traffic,
    clock: Clock,
    mission: Mission,
    metrics: RunMetrics,
    recorder: Recorder | None,
    progress: Progress | None,
    planned: float,
    longest: float,
) -> None:
    """Step until the mission is completed or the time is up."""
    step = 0
    t = mission.t_start
    while True:
        ownship, scans = world.sense(t)
        snapshot = pipeline.step(t, ownship, scans, world.mission)
        world.actuate(t, snapshot.maneuver)
        metrics.observe(snapshot)
        if recorder is not None:
            recorder.write(snapshot, scans, world.truth(t) if traffic.known else None, ownship)
        if progress is not None:
            progress(t - mission.t_start, planned, snapshot)
        if world.done or t - mission.t_start >= longest:
            return
        step += 1
        t = mission.t_start + step * scenario.step_s
        clock.wait_until(t)


def _summary(
    scenario: ScenarioConfig,
    metrics: RunMetrics,
    mission: Mission,
    world: SimWorld,
    traffic: Traffic,
    tracker: Mapping[str, int],
) -> dict[str, Any]:
    extra: dict[str, Any] = {"scenario": scenario.name, "avoidance": scenario.avoid, "tracker": tracker}
    notes = []
    if traffic.source is not None:
        extra["traffic"] = traffic.source.name
        extra["decoder"] = traffic.source.counters
        notes.append("altitudes are pressure altitudes, the mission's taken as such")
    if not world.done:
        notes.append("the mission was not completed in time")
    after = world.time - traffic.end
    if after > 0:
        notes.append(f"the recording ended {after:.0f} s before the run did: nothing is known of the traffic since")
    summary = metrics.summary(seed=scenario.seed, mission=mission, mission_completed=world.done, extra=extra)
    summary["notes"] = [*summary.get("notes", []), *notes]
    return summary
