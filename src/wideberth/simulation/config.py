"""The tables of a scenario that belong to the world: origin, mission, wind, traffic, evaluation."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from wideberth.frames import LocalFrame
from wideberth.part_config import PartConfig
from wideberth.types import FloatArray, Mission

PresetName = Literal["sarp", "do365_phase1", "do365_buffered", "do365_noncooperative", "astm_f3442", "nmac"]
Latitude = Annotated[float, Field(ge=-90.0, le=90.0)]
Longitude = Annotated[float, Field(ge=-180.0, le=180.0)]
CrossSection = Annotated[float, Field(gt=0.0, le=1e6)]
Speed = Annotated[float, Field(ge=0.0, le=1000.0)]


class OriginConfig(PartConfig):
    """WGS84 origin of the local frame."""

    lat_deg: Latitude
    lon_deg: Longitude

    def frame(self) -> LocalFrame:
        """Return the local frame about this origin."""
        return LocalFrame(math.radians(self.lat_deg), math.radians(self.lon_deg))


class PositionConfig(PartConfig):
    """A point: latitude and longitude, or north and east of the origin; always with an altitude."""

    lat_deg: Latitude | None = None
    lon_deg: Longitude | None = None
    north_m: float | None = None
    east_m: float | None = None
    altitude_m: Annotated[float, Field(ge=-1000.0, le=100_000.0)]

    @model_validator(mode="after")
    def _one_pair(self) -> Self:
        geodetic = (self.lat_deg is not None, self.lon_deg is not None)
        local = (self.north_m is not None, self.east_m is not None)
        if not ((all(geodetic) and not any(local)) or (all(local) and not any(geodetic))):
            raise ValueError("give either lat_deg and lon_deg, or north_m and east_m")
        return self

    @property
    def is_geodetic(self) -> bool:
        """Whether the point is given as latitude and longitude."""
        return self.lat_deg is not None

    def ned(self, frame: LocalFrame) -> FloatArray:
        """Return the point in the local frame, shape (3,), m."""
        if self.lat_deg is not None and self.lon_deg is not None:
            return frame.to_ned(math.radians(self.lat_deg), math.radians(self.lon_deg), self.altitude_m)
        point = frame.to_ned(frame.latitude, frame.longitude, self.altitude_m)
        point[:2] = self.north_m, self.east_m
        return point


class WaypointConfig(PositionConfig):
    """A point of a path, with the ground speed wanted on the leg that ends there."""

    speed_mps: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None


def path_arrays(
    waypoints: Sequence[WaypointConfig], speed_mps: float | None, frame: LocalFrame
) -> tuple[FloatArray, FloatArray]:
    """Return the points (n, 3) of a path in the local frame, m, and the speed (n,) on the leg to each, m/s."""
    points = np.stack([w.ned(frame) for w in waypoints])
    speeds = [speed_mps if w.speed_mps is None else w.speed_mps for w in waypoints]
    return points, np.array(speeds, float)


def _check_speeds(waypoints: Sequence[WaypointConfig], speed_mps: float | None) -> None:
    if speed_mps is None and any(w.speed_mps is None for w in waypoints):
        raise ValueError("speed_mps is missing: give one for all waypoints, or one at each")


class MissionConfig(PartConfig):
    """The path that the ownship is to fly; the first waypoint is where it starts.

    A waypoint that repeats the one before is passed with it; two must differ.
    """

    waypoints: Annotated[tuple[WaypointConfig, ...], Field(min_length=2)]
    speed_mps: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    start_time_s: float = 0.0

    @model_validator(mode="after")
    def _speeds_known(self) -> Self:
        _check_speeds(self.waypoints, self.speed_mps)
        return self

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Self:
        if len({(w.lat_deg, w.lon_deg, w.north_m, w.east_m) for w in self.waypoints}) < 2:
            raise ValueError("waypoints are all at one place: give two at least that differ by more than height")
        return self

    def mission(self, frame: LocalFrame) -> Mission:
        """Return the mission in the local frame."""
        waypoints, speeds = path_arrays(self.waypoints, self.speed_mps, frame)
        return Mission(waypoints=waypoints, speeds=speeds, t_start=self.start_time_s)


class WindConfig(PartConfig):
    """A constant wind: where the air moves to."""

    north_mps: Annotated[float, Field(ge=-150.0, le=150.0)] = 0.0
    east_mps: Annotated[float, Field(ge=-150.0, le=150.0)] = 0.0
    up_mps: Annotated[float, Field(ge=-50.0, le=50.0)] = 0.0

    def vector(self) -> FloatArray:
        """Return the velocity of the air in the local frame (north, east, down), shape (3,), m/s."""
        return np.array([self.north_mps, self.east_mps, -self.up_mps])


class NavigationConfig(PartConfig):
    """What is wrong with the ownship's own position and velocity, as told to the pipeline.

    Guidance and the sensors on board know their true state: only what the pipeline is told is wrong.

    Attributes
    ----------
    position_sigma_m, velocity_sigma_mps : float
        Of the errors on each axis.
    time_constant_s : float
        Over which errors keep their values; 0: they are white.
    jump_at_s, jump_until_s : float or None
        When the position is shifted, after the mission's start; until the end, if that is left out.
    jump_north_m, jump_east_m, jump_up_m : float
    lost_from_s, lost_until_s : float or None
        When no telemetry comes; until the end, if that is left out.
    """

    position_sigma_m: Annotated[float, Field(ge=0.0, le=10_000.0)] = 0.0
    velocity_sigma_mps: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    time_constant_s: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    jump_at_s: Annotated[float, Field(ge=0.0)] | None = None
    jump_until_s: Annotated[float, Field(ge=0.0)] | None = None
    jump_north_m: Annotated[float, Field(ge=-1e6, le=1e6)] = 0.0
    jump_east_m: Annotated[float, Field(ge=-1e6, le=1e6)] = 0.0
    jump_up_m: Annotated[float, Field(ge=-1e5, le=1e5)] = 0.0
    lost_from_s: Annotated[float, Field(gt=0.0)] | None = None
    lost_until_s: Annotated[float, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _faults_are_whole(self) -> Self:
        if self.jump_at_s is None and any((self.jump_north_m, self.jump_east_m, self.jump_up_m)):
            raise ValueError("jump_at_s is missing: give when the position jumps")
        for start, end in (("jump_at_s", "jump_until_s"), ("lost_from_s", "lost_until_s")):
            first, last = getattr(self, start), getattr(self, end)
            if last is not None and (first is None or last <= first):
                raise ValueError(f"{end} needs a {start} before it")
        return self


class LegConfig(PartConfig):
    """A part of a flight with constant rates (turning model, thesis (3.48)).

    Attributes
    ----------
    duration_s : float
    acceleration_mps2 : float
        Along the path.
    turn_rate_dps : float
        Clockwise.
    path_angle_rate_dps : float
        Upwards.
    """

    duration_s: Annotated[float, Field(gt=0.0, le=3600.0)]
    acceleration_mps2: Annotated[float, Field(ge=-50.0, le=50.0)] = 0.0
    turn_rate_dps: Annotated[float, Field(ge=-60.0, le=60.0)] = 0.0
    path_angle_rate_dps: Annotated[float, Field(ge=-30.0, le=30.0)] = 0.0


class IntruderConfig(PartConfig):
    """A simulated aircraft: on a straight course from a position, through legs and straight on, or along waypoints.

    `rcs_m2` is its mean radar cross-section: about 1 m2 is a light aircraft, 0.1 m2 a large drone. One that does not
    broadcast (`broadcasts = false`) has no ADS-B: only radars see it. With `kind = "jsbsim"` an `aircraft` of JSBSim's
    library (``c172p``) flies the path that is described, with its own dynamics.
    """

    kind: Literal["path", "jsbsim"] = "path"
    aircraft: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$", max_length=64)] | None = None

    address: Annotated[str, Field(pattern=r"^[0-9a-f]{6}$")]
    callsign: str | None = None
    position: PositionConfig | None = None
    course_deg: Annotated[float, Field(ge=-360.0, le=360.0)] | None = None
    speed_mps: Speed | None = None
    climb_rate_mps: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.0
    waypoints: tuple[WaypointConfig, ...] = ()
    rcs_m2: CrossSection = 1.0
    broadcasts: bool = True
    legs: Annotated[tuple[LegConfig, ...], Field(max_length=1000)] = ()

    @field_validator("address", mode="before")
    @classmethod
    def _lower_case(cls, value: object) -> object:
        return value.lower() if isinstance(value, str) else value

    @model_validator(mode="after")
    def _straight_or_waypoints(self) -> Self:
        straight = self.position is not None and self.course_deg is not None and self.speed_mps is not None
        if self.waypoints:
            if self.position is not None or self.course_deg is not None or self.climb_rate_mps != 0.0:
                raise ValueError("give either waypoints, or position, course_deg and climb_rate_mps, not both")
            if self.legs:
                raise ValueError("legs go with position, course_deg and speed_mps, not with waypoints")
            if len(self.waypoints) < 2:
                raise ValueError("waypoints needs at least two points")
            _check_speeds(self.waypoints, self.speed_mps)
        elif not straight:
            raise ValueError("give position, course_deg and speed_mps, or waypoints")
        return self

    @model_validator(mode="after")
    def _aircraft_is_named(self) -> Self:
        if self.kind == "jsbsim" and self.aircraft is None:
            raise ValueError('kind "jsbsim" needs an aircraft of its library, such as "c172p"')
        if self.kind != "jsbsim" and self.aircraft is not None:
            raise ValueError('aircraft goes with kind = "jsbsim"')
        return self

    def velocity(self) -> FloatArray:
        """Return the velocity of a straight course in the local frame, shape (3,), m/s."""
        course, speed = math.radians(self.course_deg or 0.0), self.speed_mps or 0.0
        return np.array([speed * math.cos(course), speed * math.sin(course), -self.climb_rate_mps])


class SimulatedTrafficConfig(PartConfig):
    """Traffic made by the simulation, seen through the sensors' error models.

    `ownship_rcs_m2` is the cross-section of the ownship, a small drone's by default, for radars on the ground.
    """

    intruders: tuple[IntruderConfig, ...] = ()
    ownship_rcs_m2: CrossSection = 0.1

    @model_validator(mode="after")
    def _addresses_differ(self) -> Self:
        addresses = [i.address for i in self.intruders]
        twice = sorted({a for a in addresses if addresses.count(a) > 1})
        if twice:
            raise ValueError(f"two intruders have the same address: {', '.join(twice)}")
        return self


class RandomTrafficConfig(PartConfig):
    """Intruders drawn from the seed so that they come near the ownship's mission.

    Attributes
    ----------
    intruders_min, intruders_max : int
        Their number is uniform.
    time_min_s, time_max_s : float
        When each is closest, after the mission's start.
    miss_max_m, height_max_m : float
        Horizontal distance then, uniform from 0, and height difference, uniform to both sides.
    speed_min_mps, speed_max_mps, path_angle_max_deg : float
        Then; courses are uniform.
    closing_speed_min_mps : float
        Least horizontal relative speed then.
    start_distance_min_m : float
        Least distance from the ownship at the start.
    maneuvering : bool
        Whether they fly legs, each straight, a turn, a turn with a change of speed, or a change of the path angle.
    leg_min_s, leg_max_s, turn_rate_max_dps, acceleration_max_mps2, path_angle_rate_max_dps : float
    rcs_m2, ownship_rcs_m2 : float
        Mean radar cross-sections.
    """

    intruders_min: Annotated[int, Field(ge=0, le=64)] = 1
    intruders_max: Annotated[int, Field(ge=0, le=64)] = 4
    time_min_s: Annotated[float, Field(gt=0.0)] = 20.0
    time_max_s: Annotated[float, Field(gt=0.0, le=36_000.0)] = 45.0
    miss_max_m: Annotated[float, Field(ge=0.0)] = 100.0
    height_max_m: Annotated[float, Field(ge=0.0)] = 20.0
    speed_min_mps: Annotated[float, Field(gt=0.0)] = 10.0
    speed_max_mps: Annotated[float, Field(gt=0.0, le=1000.0)] = 22.0
    path_angle_max_deg: Annotated[float, Field(ge=0.0, le=30.0)] = 3.0
    closing_speed_min_mps: Annotated[float, Field(gt=0.0)] = 3.0
    start_distance_min_m: Annotated[float, Field(ge=0.0)] = 250.0
    maneuvering: bool = False
    leg_min_s: Annotated[float, Field(gt=0.0)] = 5.0
    leg_max_s: Annotated[float, Field(gt=0.0)] = 20.0
    turn_rate_max_dps: Annotated[float, Field(ge=0.0, le=30.0)] = 8.0
    acceleration_max_mps2: Annotated[float, Field(ge=0.0, le=20.0)] = 0.2
    path_angle_rate_max_dps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.5
    rcs_m2: CrossSection = 1.0
    ownship_rcs_m2: CrossSection = 0.1

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("intruders", "time", "speed", "leg"):
            unit = {"intruders": "", "time": "_s", "speed": "_mps", "leg": "_s"}[name]
            low, high = getattr(self, f"{name}_min{unit}"), getattr(self, f"{name}_max{unit}")
            if low > high:
                raise ValueError(f"{name}_min{unit} {low:g} is above {name}_max{unit} {high:g}")
        return self


class VariationConfig(PartConfig):
    """A key of the scenario that is drawn anew for each run of a Monte Carlo.

    Attributes
    ----------
    key : str
        As `--set` takes it: ``traffic.intruders.0.course_deg``.
    distribution : {"uniform", "normal", "choice"}
    low, high : float
        Of the uniform one.
    mean, sigma : float
        Of the normal one.
    values : tuple
        Of which the choice takes one, all equally probable.
    add : bool
        Whether the number is added to what the scenario says.
    """

    key: Annotated[str, Field(min_length=1)]
    distribution: Literal["uniform", "normal", "choice"] = "uniform"
    low: float | None = None
    high: float | None = None
    mean: float = 0.0
    sigma: Annotated[float, Field(ge=0.0)] | None = None
    values: tuple[bool | int | float | str, ...] = ()
    add: bool = False

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.distribution == "uniform" and (self.low is None or self.high is None or self.low > self.high):
            raise ValueError("uniform needs low and high, low not above high")
        if self.distribution == "normal" and self.sigma is None:
            raise ValueError("normal needs sigma")
        if self.distribution == "choice" and (not self.values or self.add):
            raise ValueError("choice needs values, and cannot add")
        return self


class MonteCarloConfig(PartConfig):
    """How `wideberth montecarlo` flies the scenario many times.

    Attributes
    ----------
    runs : int
        Each with its own noise.
    vary : tuple of VariationConfig
        What differs besides.
    """

    runs: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    vary: tuple[VariationConfig, ...] = ()

    @model_validator(mode="after")
    def _keys_differ(self) -> Self:
        keys = [variation.key for variation in self.vary]
        if len(set(keys)) != len(keys):
            raise ValueError("vary: a key is drawn twice")
        return self


class RecordedTrafficConfig(PartConfig):
    """Traffic from a file, standard input (`-`) or a live receiver (`beast://host:port`, `gdl90://host:port`, ...)."""

    path: str | None = None
    format: str = "auto"
    max_gap_s: Annotated[float, Field(gt=0.0)] = 15.0


TRAFFIC: Mapping[str, type[PartConfig]] = {
    "simulated": SimulatedTrafficConfig,
    "random": RandomTrafficConfig,
    "recorded": RecordedTrafficConfig,
}


class CylinderConfig(PartConfig):
    """A cylinder about the intruder."""

    radius_m: Annotated[float, Field(gt=0.0)]
    half_height_m: Annotated[float, Field(gt=0.0)]


def _volume_tag(value: Any) -> str:
    return "preset" if isinstance(value, str) else "cylinder"


class EvaluationConfig(PartConfig):
    """What a run is judged by; all counts are made on true states."""

    well_clear_volume: PresetName = "astm_f3442"
    collision_volume: Annotated[
        Annotated[PresetName, Tag("preset")] | Annotated[CylinderConfig, Tag("cylinder")], Discriminator(_volume_tag)
    ] = "nmac"
    horizontal_miss_filter: bool = False
