"""Raw samples of a scenario's first radar, flown without avoidance: a file, the radar's settings, noise, the truth."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path

import numpy as np

from wideberth.assembly import build_traffic, build_world
from wideberth.config import ScenarioConfig
from wideberth.errors import InputError
from wideberth.frames import euler_angles
from wideberth.run import planned_duration
from wideberth.sensors.radar.config import RadarConfig, SimulatedRadarConfig
from wideberth.sensors.radar.raw.recording import write_raw
from wideberth.sensors.radar.simulated import RawLook, SimulatedRadar
from wideberth.sensors.radar.sweeps.receiver import Samples
from wideberth.sensors.radar.sweeps.simulate import simulate_frames
from wideberth.simulation.config import RecordedTrafficConfig
from wideberth.simulation.simulated import SimulatedTraffic
from wideberth.toml_text import to_toml
from wideberth.types import FloatArray, Ownship

_NEU_NED = np.array([1.0, 1.0, -1.0])
_NOISE_SEED = 0x4015E
"""Sets the noise run's noise apart from that of the looks."""


@dataclass(frozen=True, slots=True)
class RawFiles:
    """What was written.

    Attributes
    ----------
    raw, radar, truth : Path
    noise : Path or None
    frames : int
    """

    raw: Path
    radar: Path
    truth: Path
    noise: Path | None
    frames: int


def simulate_recording(
    scenario: ScenarioConfig,
    out: Path,
    *,
    duration: float | None = None,
    noise_frames: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> RawFiles:
    """Fly a scenario's mission without avoidance and write what its first radar's first unit samples.

    Beside the samples, ``raw.npy``, there are ``raw.toml`` (the radar, as `load_radar` reads it, with its place at the
    start), ``raw_truth.npz`` (arrays `time`, `truth_pos`, `truth_vel`, `truth_visible`, `ownship_id` and, on board,
    `own_pos`, `own_vel`, `own_att`, all as in a plot file) and, if wanted, ``raw_noise.npy``, a run without targets.

    Parameters
    ----------
    scenario : ScenarioConfig
    out : Path
        Of the samples, .npy.
    duration : float or None
        s; None: until the mission's end.
    noise_frames : int
        Of the run without targets; 0: there is none.
    progress : callable
        Told how many frames are done, of how many.

    Raises
    ------
    InputError
        If there is no mission, no radar, or no simulated traffic, or the file cannot be written.
    """
    part = next((sensor for sensor in scenario.sensors if issubclass(sensor.target, SimulatedRadar)), None)
    if part is None:
        raise InputError('there is no radar: give the scenario a [sensor] of kind = "radar"')
    if scenario.mission is None:
        raise InputError("mission: missing; give one in the scenario")
    if isinstance(scenario.traffic, RecordedTrafficConfig):
        raise InputError("traffic: recorded; a radar's samples need simulated traffic")
    config: SimulatedRadarConfig = part.config.model_copy(update={"level": "samples", "noise_run_frames": 0})
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    longest = planned_duration(mission) if duration is None else duration
    traffic = build_traffic(scenario, mission, frame, longest)
    assert isinstance(traffic.truth, SimulatedTraffic)
    truth = traffic.truth
    world = build_world(scenario, mission, replace(traffic, sensors=()))
    radar = SimulatedRadar(config, scenario.seed, truth.rcs_m2, truth.ownship_rcs_m2, part.name)
    n = math.floor(longest / config.update_interval_s + 1e-9) + 1
    times: FloatArray = mission.t_start + config.update_interval_s * np.arange(n, dtype=np.float64)
    ground = config.mount == "ground"
    log = _TruthLog(n, len(truth.ids) + ground)

    def states(t: float) -> tuple[FloatArray, FloatArray]:
        now = truth.truth(t)
        return now.positions, now.velocities

    def looks() -> Iterator[Samples]:
        for k, t in enumerate(times.tolist()):
            ownship, _ = world.sense(t)
            look = radar.raw_look(t, states, ownship)
            log.write(k, look, ownship)
            yield look.samples
            progress(k + 1, n)

    plain = RadarConfig.model_validate({key: getattr(config, key) for key in RadarConfig.model_fields})
    names = {word: out.with_name(f"{out.stem}{word}") for word in (".toml", "_truth.npz", "_noise.npy")}
    try:
        write_raw(out, looks(), n)
        names[".toml"].write_text(_settings(plain, config, float(times[0]), log))
        log.save(names["_truth.npz"], times, ownship=len(truth.ids) if ground else None)
        if noise_frames:
            quiet = simulate_frames(plain, repeat((), noise_frames), plain.averages, (scenario.seed, _NOISE_SEED))
            write_raw(names["_noise.npy"], quiet, noise_frames)
    except OSError as error:
        raise InputError(f"{out}: cannot be written: {error.strerror or error}") from error
    return RawFiles(out, names[".toml"], names["_truth.npz"], names["_noise.npy"] if noise_frames else None, n)


class _TruthLog:
    """Where the radar and all aircraft are in each frame; aircraft that are not there are at zero, not visible."""

    def __init__(self, frames: int, aircraft: int) -> None:
        self.positions, self.velocities = np.zeros((2, frames, aircraft, 3))
        self.visible = np.zeros((frames, aircraft), np.bool_)
        self.place, self.motion, self.angles = np.zeros((3, frames, 3))

    def write(self, k: int, look: RawLook, ownship: Ownship) -> None:
        there = np.isfinite(look.positions).all(axis=1)
        self.positions[k, there], self.velocities[k, there] = look.positions[there], look.velocities[there]
        self.visible[k] = look.visible
        self.place[k], self.motion[k], self.angles[k] = look.position, ownship.velocity, euler_angles(look.attitude)

    def save(self, path: Path, times: FloatArray, ownship: int | None) -> None:
        onboard = {"own_pos": self.place * _NEU_NED, "own_vel": self.motion * _NEU_NED, "own_att": self.angles}
        with path.open("wb") as file:
            np.savez_compressed(
                file,
                time=times,
                truth_pos=self.positions * _NEU_NED,
                truth_vel=self.velocities * _NEU_NED,
                truth_visible=self.visible,
                **(onboard if ownship is None else {"ownship_id": np.int64(ownship)}),
            )


def _settings(radar: RadarConfig, simulated: SimulatedRadarConfig, t: float, log: _TruthLog) -> str:
    """Return the TOML of the radar's first unit, at its place at the start."""
    roll, pitch, yaw = np.degrees(log.angles[0]).tolist()
    north, east, down = log.place[0].tolist()
    half = 0.5 * ((radar.averages - 1) * radar.sweep_interval + 1e-3 * radar.sweep_time_ms)
    table = radar.model_dump(exclude_none=True)
    if simulated.mount == "ground":
        roll, pitch, yaw = 0.0, radar.boresight_elevation_deg, radar.boresight_azimuths_deg[0]
    table |= {"boresight_azimuths_deg": [yaw], "boresight_elevation_deg": pitch}
    table["pose"] = {"north_m": north, "east_m": east, "altitude_m": -down, "roll_deg": roll}
    # Samples are of the aircraft in the middle of a frame.
    table["layout"] = {"t_start_s": t - half, "frame_interval_s": radar.update_interval_s}
    return to_toml(table)
