"""A radar from a TOML file: its settings, where it stands, and how its raw samples lie in a file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wideberth.config import check_table, read_toml
from wideberth.config_errors import wrong_things
from wideberth.errors import InputError
from wideberth.frames import rotation_ned_body
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.raw.config import PoseConfig, RawLayoutConfig
from wideberth.types import FloatArray


@dataclass(frozen=True, slots=True)
class RadarSetup:
    """A radar, its place and its files.

    Attributes
    ----------
    name : str
    radar : RadarConfig
    pose : PoseConfig
    layout : RawLayoutConfig
    """

    name: str
    radar: RadarConfig
    pose: PoseConfig
    layout: RawLayoutConfig

    @property
    def position(self) -> FloatArray:
        """Local NED (3,), m."""
        return np.array([self.pose.north_m, self.pose.east_m, -self.pose.altitude_m])

    @property
    def angles(self) -> FloatArray:
        """Roll, pitch and yaw (3,) of the array's axes, rad."""
        radar = self.radar
        return np.radians([self.pose.roll_deg, radar.boresight_elevation_deg, radar.boresight_azimuths_deg[0]])

    @property
    def attitude(self) -> FloatArray:
        """Rotation C_ned_sensor (3, 3)."""
        return rotation_ned_body(*(float(angle) for angle in self.angles))


def load_radar(given: str) -> RadarSetup:
    """Return the radar that is meant: a preset's name, or a TOML file.

    In the file the keys of `RadarConfig` stand at the top (`kind` is passed over), over those of the preset that
    `preset` names; tables `pose` and `layout` may follow.

    Parameters
    ----------
    given : str

    Raises
    ------
    InputError
        If there is no such preset or file, or with one line for each thing that is wrong in it.
    """
    if given in PRESETS:
        return RadarSetup(given, PRESETS[given], PoseConfig(), RawLayoutConfig())
    path = Path(given)
    if not path.exists() and path.suffix != ".toml":
        raise InputError(f"{given}: neither a radar by name ({', '.join(PRESETS)}) nor a TOML file")
    tables = read_toml(path)
    tables.pop("kind", None)
    wrong: list[str] = []
    base: dict[str, Any] = {}
    preset = tables.pop("preset", None)
    if preset is not None and preset not in PRESETS:
        wrong.append(f"preset: there is no {preset!r:.60} (known: {', '.join(PRESETS)})")
    elif preset is not None:
        base = PRESETS[preset].model_dump()
    pose = check_table(PoseConfig, tables.pop("pose", {}), "pose", wrong)
    layout = check_table(RawLayoutConfig, tables.pop("layout", {}), "layout", wrong)
    radar = check_table(RadarConfig, _over(base, tables), "", wrong)
    if wrong or radar is None or pose is None or layout is None:
        raise wrong_things(str(path), [line.removeprefix("scenario: ") for line in wrong])
    return RadarSetup(path.stem, radar, pose, layout)


def _over(base: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """Return a preset's tables with those of a file over them, key by key."""
    both = dict(base)
    for key, value in given.items():
        deeper = isinstance(value, dict) and isinstance(both.get(key), dict)
        both[key] = _over(both[key], value) if deeper else value
    return both
