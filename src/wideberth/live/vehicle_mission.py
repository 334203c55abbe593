"""What a simulated vehicle is to fly: a mission file, put into mission items."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.links.mavlink.mission_items import AMSL_FRAMES, Item, speed_change, waypoint
from wideberth.links.mavlink.telemetry import Home
from wideberth.types import FloatArray, Mission

_WPL = "QGC WPL 110"


@dataclass(frozen=True, slots=True)
class VehicleMission:
    """A mission, where it begins, and the limits of the vehicle where the file says them.

    Attributes
    ----------
    frame : LocalFrame
    home : Home
    items : tuple of Item
        Without home.
    start : ndarray, shape (3,)
        Where the vehicle is at first, local NED, flying.
    speed : float or None
        Of the first leg, m/s.
    limits : PartConfig or None
        Configuration of the ownship of a scenario.
    wind : ndarray, shape (3,)
        Velocity of the air, local NED, m/s: that of a scenario, else none.
    """

    frame: LocalFrame
    home: Home
    items: tuple[Item, ...]
    start: FloatArray
    speed: float | None
    limits: Any = None
    wind: FloatArray = field(default_factory=lambda: np.zeros(3))


def read_vehicle_mission(path: Path, home_altitude: float) -> VehicleMission:
    """Read a mission: a scenario (TOML), a mission table (CSV), or a ground station's file (QGC WPL 110).

    Parameters
    ----------
    path : Path
    home_altitude : float
        Of the ground at home, above mean sea level, m; a WPL file says its own.

    Raises
    ------
    InputError
        If the file cannot be read, or is none of these.
    """
    if path.suffix == ".toml":
        from wideberth.config import load_scenario

        scenario = load_scenario(path)
        if scenario.mission is None:
            raise InputError(f"{path} has no mission: it needs a [mission] table with waypoints")
        frame = scenario.frame()
        plan = _of_waypoints(scenario.mission.mission(frame), frame, home_altitude, scenario.ownship.config)
        return replace(plan, wind=scenario.wind.vector())
    if path.suffix == ".csv":
        from wideberth.simulation.mission import read_mission_file

        config, _ = read_mission_file(path)
        first = config.waypoints[0]
        if first.lat_deg is None or first.lon_deg is None:
            raise InputError(f"{path}: the first waypoint needs lat_deg and lon_deg")
        frame = LocalFrame(math.radians(first.lat_deg), math.radians(first.lon_deg))
        return _of_waypoints(config.mission(frame), frame, home_altitude, None)
    return _of_wpl(path)


def _of_waypoints(mission: Mission, frame: LocalFrame, home_altitude: float, limits: Any) -> VehicleMission:
    latitude, longitude, altitude = frame.to_geodetic(mission.waypoints)
    items: list[Item] = []
    speed = math.nan
    for k in range(1, len(mission.waypoints)):
        if mission.speeds[k] != speed:
            speed = float(mission.speeds[k])
            items.append(speed_change(speed))
        items.append(waypoint(float(latitude[k]), float(longitude[k]), float(altitude[k])))
    home = Home(float(latitude[0]), float(longitude[0]), home_altitude)
    return VehicleMission(frame, home, tuple(items), mission.waypoints[0].copy(), float(mission.speeds[1]), limits)


def _of_wpl(path: Path) -> VehicleMission:
    try:
        lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    except OSError as error:
        raise InputError(f"cannot read the mission {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file") from error
    if not lines or " ".join(lines[0]) != _WPL:
        raise InputError(f"{path}: a mission is a scenario (.toml), a table (.csv), or begins with '{_WPL}'")
    items = []
    for number, cells in enumerate(lines[1:], start=2):
        try:
            values = [float(cell) for cell in cells]
            _, _, frame_id, command, p1, p2, p3, p4, latitude, longitude, altitude, go_on = values
            item = Item(
                int(frame_id),
                int(command),
                (p1, p2, p3, p4),
                round(latitude * 1e7),
                round(longitude * 1e7),
                altitude,
                int(go_on),
            )
        except (ValueError, OverflowError):
            raise InputError(f"{path}, line {number}: 12 numbers are needed") from None
        items.append(item)
    placed = [item for item in items[1:] if item.is_global and (item.x or item.y)]
    if not items or not placed:
        raise InputError(f"{path}: the first item is home, and a waypoint with a place must follow")
    first = items[0]
    home = Home(math.radians(first.x * 1e-7), math.radians(first.y * 1e-7), first.z)
    frame = LocalFrame(home.latitude, home.longitude)
    height = placed[0].z + (0.0 if placed[0].frame in AMSL_FRAMES else home.altitude)
    start = frame.to_ned(home.latitude, home.longitude, height)
    return VehicleMission(frame, home, tuple(items[1:]), np.asarray(start), None)
