"""From a checked scenario to the things that run: pipeline, world, traffic."""

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wideberth.config import ScenarioConfig
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.part_config import PartConfig
from wideberth.parts import Part
from wideberth.pipeline import Pipeline
from wideberth.sensor_watch import SensorWatch
from wideberth.sensors.adsb.receiver import AdsbReceiver
from wideberth.sensors.adsb.report import AdsbReport, TrafficSource
from wideberth.sensors.adsb.report_list import ReportList
from wideberth.sensors.adsb.sources import open_traffic
from wideberth.sensors.radar.simulated import SimulatedRadar
from wideberth.simulation.config import (
    NavigationConfig,
    RandomTrafficConfig,
    RecordedTrafficConfig,
    SimulatedTrafficConfig,
)
from wideberth.simulation.modelled_sensors import ModelledRadar, ModelledSensor, ReceivedTraffic
from wideberth.simulation.navigation import SimulatedNavigation
from wideberth.simulation.random_encounters import draw_intruders
from wideberth.simulation.recorded import RecordedTraffic
from wideberth.simulation.simulated import SimulatedTraffic
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import Observer, Sensor, SimWorld, TruthSource
from wideberth.types import FloatArray, Mission
from wideberth.vehicles.config import FixedWingConfig
from wideberth.vehicles.mission_path import MissionPath

PRE_ROLL = 10.0  # s of reports before the mission's start that the receiver still gets
MARGIN = 60.0  # s of recorded traffic before and after the run from which the truth is made


class UnknownTraffic:
    """The true states of live traffic, which nobody knows."""

    def truth(self, t: float) -> Truth:
        """Return no aircraft."""
        return Truth.empty(t)


@dataclass(frozen=True, slots=True)
class Traffic:
    """What flies around the ownship, and how it is seen.

    Attributes
    ----------
    truth : TruthSource
    sensors : tuple of Sensor
    known : bool
        Whether `truth` is the truth; False for live traffic.
    source : TrafficSource or None
        Where reports come from, None for simulated traffic.
    end : float
        No traffic after this time, s; infinite for simulated and live traffic.
    """

    truth: TruthSource
    sensors: tuple[Sensor, ...]
    known: bool
    source: TrafficSource | None
    end: float


def build_pipeline(scenario: ScenarioConfig, counter: Callable[[], float], *, live: bool = False) -> Pipeline:
    """Return the pipeline of a scenario.

    Parameters
    ----------
    scenario : ScenarioConfig
    counter : callable
        Gives the CPU seconds for its stage times.
    live : bool
        Whether the scans are those of a flight's inputs, not of the scenario's sensors.
    """
    sensors = scenario.inputs if live else scenario.sensors
    intervals = {name: interval for sensor in sensors for name, interval in sensor.look_intervals.items()}
    planner = None
    if scenario.avoid:
        vehicle = scenario.ownship.target(scenario.ownship.config)
        planner = scenario.avoidance.target(scenario.avoidance.config, vehicle.params)
    detector = scenario.detection.target(scenario.detection.config)
    return Pipeline(
        tracker=scenario.tracker.target(scenario.tracker.config),
        detector=detector,
        planner=planner,
        lost_memory=getattr(scenario.avoidance.config, "ghost_s", 60.0),
        counter=counter,
        watch=SensorWatch(intervals, getattr(detector, "near_radius", 0.0)),
    )


@dataclass(frozen=True, slots=True)
class LoadedRecording:
    """A recording of traffic in memory, so that many runs need not read it again.

    Attributes
    ----------
    name : str
    reports : tuple of AdsbReport
        In the order of receipt.
    counters, rejects : mapping of str to int
        What was counted when it was read.
    """

    name: str
    reports: tuple[AdsbReport, ...]
    counters: Mapping[str, int]
    rejects: Mapping[str, int]


def load_recording(path: str, fmt: str = "auto") -> LoadedRecording:
    """Read a whole recording.

    Raises
    ------
    InputError
        If it cannot be read, or is a live receiver.
    """
    source = open_traffic(path, fmt)
    if source.live:
        source.close()
        raise InputError(f"traffic '{path}' is live: a recording is wanted here")
    return _load(source)


def _load(source: TrafficSource) -> LoadedRecording:
    reports = tuple(source.poll(math.inf))
    loaded = LoadedRecording(source.name, reports, source.counters, dict(source.health(math.inf).rejects))
    source.close()
    return loaded


def build_traffic(
    scenario: ScenarioConfig,
    mission: Mission,
    frame: LocalFrame,
    longest: float,
    loaded: LoadedRecording | None = None,
) -> Traffic:
    """Return the traffic of a scenario.

    Parameters
    ----------
    scenario : ScenarioConfig
    mission : Mission
        Its start is when traffic is wanted first.
    frame : LocalFrame
    longest : float
        How long the run may last, s.
    loaded : LoadedRecording, optional
        Taken instead of reading the scenario's recording.

    Raises
    ------
    InputError
        If recorded traffic is not named, cannot be read, or has nothing at the time of the mission.
    """
    if not isinstance(scenario.traffic, RecordedTrafficConfig):
        simulated = SimulatedTraffic(_intruders(scenario, mission), frame, mission.t_start, scenario.wind.vector())
        sensors = tuple(_modelled(part, scenario.seed, simulated) for part in scenario.sensors)
        return Traffic(simulated, sensors, True, None, math.inf)
    if loaded is not None:
        return _recorded(scenario, scenario.traffic, mission, frame, longest, loaded)
    if scenario.traffic.path is None:
        raise InputError("traffic.path: missing; name the recording or receiver with --traffic")
    source = open_traffic(scenario.traffic.path, scenario.traffic.format)
    if source.live:
        receiver = ReceivedTraffic(AdsbReceiver(scenario.sensor.config, source, frame, scenario.sensor.name))
        return Traffic(UnknownTraffic(), (receiver,), False, source, math.inf)
    return _recorded(scenario, scenario.traffic, mission, frame, longest, _load(source))


def _intruders(scenario: ScenarioConfig, mission: Mission) -> SimulatedTrafficConfig:
    if isinstance(scenario.traffic, RandomTrafficConfig):
        return SimulatedTrafficConfig(
            intruders=draw_intruders(scenario.traffic, mission, scenario.seed),
            ownship_rcs_m2=scenario.traffic.ownship_rcs_m2,
        )
    assert isinstance(scenario.traffic, SimulatedTrafficConfig)
    return scenario.traffic


def _modelled(part: Part, seed: int, traffic: SimulatedTraffic) -> Sensor:
    """Return a sensor model in simulated traffic; the noise of each sensor is its own."""
    target: Any = part.target
    if issubclass(target, SimulatedRadar):
        radar = target(part.config, seed, traffic.rcs_m2, traffic.ownship_rcs_m2, part.name)
        return ModelledRadar(radar, traffic)
    heard = traffic.broadcasting
    names = [traffic.ids[i] for i in heard], [traffic.callsigns[i] for i in heard]
    if part.name == part.default_name:
        return ModelledSensor(target(part.config, seed, *names), traffic, heard=heard)
    own_seed = int(np.random.SeedSequence([seed, zlib.crc32(part.name.encode())]).generate_state(1, np.uint64)[0] >> 1)
    return ModelledSensor(target(part.config, own_seed, *names), traffic, part.name, heard)


def _recorded(
    scenario: ScenarioConfig,
    config: RecordedTrafficConfig,
    mission: Mission,
    frame: LocalFrame,
    longest: float,
    loaded: LoadedRecording,
) -> Traffic:
    times = np.array([report.t for report in loaded.reports])
    if not times.size:
        raise InputError(f"traffic '{loaded.name}' holds no report")
    if mission.t_start > times.max() or mission.t_start + longest < times.min():
        raise InputError(
            f"traffic '{loaded.name}' has no report during the mission: it covers {times.min():.0f} to"
            f" {times.max():.0f} s Unix time, the mission starts at {mission.t_start:.0f} s (start_time_s)"
        )
    first, last = mission.t_start - MARGIN, mission.t_start + longest + MARGIN
    window = [report for report in loaded.reports if first <= report.t <= last]
    heard = [report for report in window if report.t >= mission.t_start - PRE_ROLL]
    source = ReportList(loaded.name, heard, loaded.counters, loaded.rejects)
    receiver = ReceivedTraffic(AdsbReceiver(scenario.sensor.config, source, frame, scenario.sensor.name))
    truth = RecordedTraffic(window, frame, config.max_gap_s)
    return Traffic(truth, (receiver,), True, source, float(times.max()))


def build_world(
    scenario: ScenarioConfig, mission: Mission, traffic: Traffic, observer: Observer | None = None
) -> SimWorld:
    """Return the simulated world of a scenario; `observer` is told the true states of every sub-step.

    Raises
    ------
    InputError
        If the mission cannot be flown along the arcs that are asked for.
    """
    wind: FloatArray = scenario.wind.vector()
    vehicle = scenario.ownship.target(scenario.ownship.config, wind)
    # Without faults the pipeline is told the true state, with a covariance of zero, as it is by the fast Monte Carlo.
    faulty = scenario.navigation != NavigationConfig()
    navigation = SimulatedNavigation(scenario.navigation, scenario.seed) if faulty else None
    path = _mission_path(scenario.ownship.config, mission)
    return SimWorld(mission, vehicle, traffic.truth, traffic.sensors, observer, navigation, path)


def _mission_path(config: PartConfig, mission: Mission) -> MissionPath | None:
    """Return the lines and arcs of a mission that is to be flown along such; None: straight legs."""
    if not isinstance(config, FixedWingConfig) or config.path_manager == "straight":
        return None
    try:
        return MissionPath(config, mission.waypoints, mission.speeds)
    except ValueError as error:
        raise InputError(f"ownship.path_manager {config.path_manager}: {error}") from error
