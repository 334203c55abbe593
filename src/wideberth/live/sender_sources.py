"""What senders put onto the wire: scans of a scenario or of a recording of a run, and reports in them."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from wideberth.assembly import build_traffic, build_world
from wideberth.config import ScenarioConfig, load_scenario
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.recording import read_recording
from wideberth.run import planned_duration
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.radar.simulated import SimulatedRadar
from wideberth.simulation.modelled_sensors import ModelledRadar
from wideberth.types import FloatArray, Ownship, Scan

Scans = Iterator[tuple[float, list[Scan]]]
Reports = Iterator[tuple[float, list[AdsbReport]]]

RADAR_KINDS = ("radar", "radar_cone")
_ABSENT = 1e8
"""Where an ownship is that no radar is to see, m."""


def scans_of(
    path: Path, *, ownship: bool = False, duration: float | None = None, seed: int | None = None
) -> tuple[Scans, LocalFrame]:
    """Return the scans of a scenario (TOML) or of a recording (MCAP), by step, and their local frame.

    Parameters
    ----------
    path : Path
    ownship : bool
        Whether the ownship of a scenario flies its mission, without avoidance, in the picture of radars on the ground.
        If not they do not see it: where the real one flies is not known here. A recording is as it is.
    duration : float, optional
        s of scenario time; by default the scenario's, else what the mission takes.
    seed : int, optional
        Of the errors, instead of the scenario's.

    Raises
    ------
    InputError
        If it is neither, cannot be used, has a radar on an ownship that does not fly, or is a recording and a seed is
        given.
    """
    if path.suffix == ".mcap":
        if seed is not None:
            raise InputError(f"--seed {seed}: {path} is a recording, whose errors are what they are")
        recording = read_recording(path)
        steps = ((step.t, step.scans) for step in recording.steps())
        if duration is not None:
            end = recording.t_start + duration
            return ((t, scans) for t, scans in steps if t <= end), recording.frame
        return steps, recording.frame
    scenario = load_scenario(path, () if seed is None else (f"seed={seed}",))
    return _simulated(scenario, ownship=ownship, duration=duration), scenario.frame()


def _simulated(scenario: ScenarioConfig, *, ownship: bool, duration: float | None) -> Scans:
    if scenario.mission is None:
        raise InputError("mission: missing; a sender takes its start time from it")
    for part in scenario.sensors:
        if not ownship and issubclass(part.target, SimulatedRadar) and part.config.mount == "ownship":
            raise InputError(f"radar '{part.name}' is on the ownship, which must fly: add --ownship mission")
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    wanted = duration or scenario.duration_s or planned_duration(mission)
    traffic = build_traffic(scenario, mission, frame, wanted)
    if traffic.source is not None and traffic.source.live:
        traffic.source.close()
        raise InputError("the scenario's traffic is live: send what it comes from")
    world = build_world(scenario, mission, traffic)
    start, count = mission.t_start, math.floor(wanted / scenario.step_s + 1e-6) + 1
    times = (start + k * scenario.step_s for k in range(count))
    if ownship:
        return ((t, world.sense(t)[1]) for t in times)
    still, away = np.zeros(3), np.full(3, _ABSENT)

    def scans(t: float) -> list[Scan]:
        found: list[Scan] = []
        for sensor in traffic.sensors:
            place = away if isinstance(sensor, ModelledRadar) else mission.waypoints[0]
            found += sensor.sense(t, Ownship(t, place, still))
        return found

    return ((t, scans(t)) for t in times)


def radar_scans(scans: Scans, sensor: str | None = None) -> Scans:
    """Return the radars' scans alone, each at its own time; of one sensor where it is named."""
    for _, found in scans:
        for scan in found:
            if scan.kind in RADAR_KINDS and sensor in (None, scan.sensor):
                yield scan.t, [scan]


def reports_of_scans(scans: Scans, frame: LocalFrame) -> Reports:
    """Return the ADS-B scans as reports, by step."""
    for t, found in scans:
        reports = [report for scan in found if scan.kind == "adsb" for report in _reports(scan, frame)]
        if reports:
            yield t, reports


def _reports(scan: Scan, frame: LocalFrame) -> list[AdsbReport]:
    placed = np.asarray(np.isfinite(scan.z[:, :2]).all(axis=1))
    ground: FloatArray = np.where(placed[:, None], scan.z[:, :3], 0.0)
    latitude, longitude, _ = frame.to_geodetic(ground)
    velocity = frame.velocity_from_ned(latitude, longitude, scan.z[:, 3:])
    reports = []
    for k, address in enumerate(scan.source_ids):
        report = AdsbReport(
            float(scan.t_valid[k]),
            address,
            pressure_altitude=-float(scan.z[k, 2]),
            velocity_north=float(velocity[k, 0]),
            velocity_east=float(velocity[k, 1]),
            climb_rate=-float(velocity[k, 2]),
            info=scan.sources[k],
        )
        if placed[k]:
            report = replace(report, latitude=float(latitude[k]), longitude=float(longitude[k]))
        reports.append(report)
    return reports
