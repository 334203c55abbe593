"""Configuration of the vehicle models."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig
from wideberth.units import FOOT


class PointMassConfig(PartConfig):
    """A small fixed wing flown at 80 kt by default (point_mass.PointMass).

    Speeds are airspeeds. `path_gain_per_s` is the k_path of straight-line following times the ground speed, so that a
    path is joined alike at any speed; `waypoint_capture_m` is how far abeam a mission waypoint may be passed before it
    is flown back to.
    """

    speed_min_mps: float = Field(default=30.0, gt=0)
    speed_max_mps: float = Field(default=46.0, gt=0)
    speed_time_constant_s: float = Field(default=3.0, gt=0)
    acceleration_max_mps2: float = Field(default=1.5, gt=0)
    bank_max_deg: float = Field(default=35.0, gt=0, lt=80)
    bank_rate_max_deg_s: float = Field(default=30.0, gt=0)
    bank_time_constant_s: float = Field(default=0.4, gt=0)
    course_gain_per_s: float = Field(default=0.6, gt=0)
    climb_rate_max_mps: float = Field(default=5.0, gt=0)
    sink_rate_max_mps: float = Field(default=5.0, gt=0)
    climb_time_constant_s: float = Field(default=1.0, gt=0)
    vertical_acceleration_max_mps2: float = Field(default=3.0, gt=0)
    chi_inf_deg: float = Field(default=60.0, gt=0, le=90)
    path_gain_per_s: float = Field(default=0.2, gt=0)
    altitude_gain_per_s: float = Field(default=0.25, gt=0)
    waypoint_capture_m: float = Field(default=500.0, gt=0)

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        _check_limits(self.speed_min_mps, self.speed_max_mps, self.climb_rate_max_mps, self.sink_rate_max_mps)
        return self


def _check_limits(speed_min: float, speed_max: float, climb_rate: float, sink_rate: float) -> None:
    if speed_max < speed_min:
        raise ValueError(f"speed_max_mps {speed_max:g} is below speed_min_mps {speed_min:g}: swap them")
    for name, value in (("climb_rate_max_mps", climb_rate), ("sink_rate_max_mps", sink_rate)):
        if value >= speed_min:
            raise ValueError(f"{name} {value:g} is not below speed_min_mps {speed_min:g}")


# What each aircraft keeps within with a reserve of power: the climb is flown at any of the speeds.
_AIRCRAFT_LIMITS: Mapping[str, Mapping[str, float]] = {
    "aerosonde": {
        "speed_min_mps": 20.0,
        "speed_max_mps": 29.0,
        "climb_rate_max_mps": 3.0,
        "sink_rate_max_mps": 4.0,
        "bank_time_constant_s": 0.35,
    },
    "zagi": {
        "speed_min_mps": 11.0,
        "speed_max_mps": 15.0,
        "climb_rate_max_mps": 1.2,
        "sink_rate_max_mps": 2.0,
        "bank_rate_max_deg_s": 30.0,
        "bank_time_constant_s": 0.35,
    },
}


Turbulence = Literal["none", "low_light", "low_moderate", "medium_light", "medium_moderate"]


class FixedWingConfig(PartConfig):
    """A fixed wing as a rigid body with an autopilot (fixed_wing.FixedWing).

    The limits default to those of the aircraft. Those named as in `PointMassConfig` mean the same, and are what
    planners reckon with; the time constants are those that the autopilot's loops are made for.

    Attributes
    ----------
    aircraft : str
        ``aerosonde`` (11 kg, 20 to 29 m/s) or ``zagi`` (1.6 kg flying wing, 11 to 15 m/s).
    step_s : float
        Step of the motion and of the autopilot.
    air_density_kgm3 : float
    turbulence : str
        Dryden gusts: ``none``, or those at 50 m (``low_light``, ``low_moderate``) or 600 m (``medium_...``).
    gust_seed : int
    path_manager : str
        How a scenario's mission is flown: ``straight`` legs, the turns anticipated; ``fillet``, an arc inside each
        corner; ``dubins``, over each waypoint with the course of the leg that follows.
    turn_radius_m : float, optional
        Of those arcs, which need it: at least that of the bank limit at the mission's speeds.
    """

    aircraft: Literal["aerosonde", "zagi"] = "aerosonde"
    step_s: float = Field(default=0.01, gt=0, le=0.02)
    air_density_kgm3: float = Field(default=1.2682, gt=0.5, lt=1.6)
    turbulence: Turbulence = "none"
    gust_seed: int = Field(default=0, ge=0)
    path_manager: Literal["straight", "fillet", "dubins"] = "straight"
    turn_radius_m: float | None = Field(default=None, gt=0)
    speed_min_mps: float = Field(gt=0)
    speed_max_mps: float = Field(gt=0)
    speed_time_constant_s: float = Field(default=2.0, gt=0)
    acceleration_max_mps2: float = Field(default=1.0, gt=0)
    bank_max_deg: float = Field(default=35.0, gt=0, le=50)
    bank_rate_max_deg_s: float = Field(default=45.0, gt=0)
    bank_time_constant_s: float = Field(gt=0)
    course_gain_per_s: float = Field(default=0.6, gt=0, le=1.5)
    climb_rate_max_mps: float = Field(gt=0)
    sink_rate_max_mps: float = Field(gt=0)
    climb_time_constant_s: float = Field(default=1.0, gt=0)
    vertical_acceleration_max_mps2: float = Field(default=2.0, gt=0)
    chi_inf_deg: float = Field(default=60.0, gt=0, le=90)
    path_gain_per_s: float = Field(default=0.2, gt=0)
    altitude_gain_per_s: float = Field(default=0.25, gt=0)
    waypoint_capture_m: float = Field(default=500.0, gt=0)

    @model_validator(mode="before")
    @classmethod
    def _limits_of_the_aircraft(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        return {**_AIRCRAFT_LIMITS.get(str(values.get("aircraft", "aerosonde")), {}), **values}

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        _check_limits(self.speed_min_mps, self.speed_max_mps, self.climb_rate_max_mps, self.sink_rate_max_mps)
        return self

    @model_validator(mode="after")
    def _arcs_have_a_radius(self) -> Self:
        if self.path_manager == "straight" and self.turn_radius_m is not None:
            raise ValueError('turn_radius_m is of arcs: set path_manager = "fillet" or "dubins", or leave it out')
        if self.path_manager != "straight" and self.turn_radius_m is None:
            raise ValueError(f'path_manager = "{self.path_manager}" needs turn_radius_m')
        return self


class MultirotorConfig(PartConfig):
    """A multirotor (multirotor.Multirotor).

    Speeds are airspeeds. The keys named as in `PointMassConfig` mean the same; `bank_max_deg` is that of the turn which
    planners reckon with, `tilt_max_deg` what it tilts to at most.

    Attributes
    ----------
    step_s : float
        Step of the motion and of the velocity loop.
    attitude_time_constant_s, thrust_time_constant_s : float
        Lags of tilt and thrust behind their commands.
    drag_per_s : float
        Deceleration per airspeed.
    thrust_max_weights : float
        Largest thrust, in weights.
    """

    step_s: float = Field(default=0.01, gt=0, le=0.02)
    speed_min_mps: float = Field(default=3.0, gt=0)
    speed_max_mps: float = Field(default=15.0, gt=0)
    speed_time_constant_s: float = Field(default=0.8, ge=0.5)
    acceleration_max_mps2: float = Field(default=3.0, gt=0)
    attitude_time_constant_s: float = Field(default=0.12, gt=0, le=0.3)
    thrust_time_constant_s: float = Field(default=0.06, gt=0, le=0.3)
    drag_per_s: float = Field(default=0.2, ge=0)
    tilt_max_deg: float = Field(default=35.0, gt=0, lt=60)
    tilt_rate_max_deg_s: float = Field(default=220.0, gt=0)
    thrust_max_weights: float = Field(default=2.0, gt=1)
    yaw_rate_max_deg_s: float = Field(default=90.0, gt=0)
    bank_max_deg: float = Field(default=15.0, gt=0, lt=60)
    bank_rate_max_deg_s: float = Field(default=60.0, gt=0)
    bank_time_constant_s: float = Field(default=0.5, gt=0)
    course_gain_per_s: float = Field(default=0.8, gt=0)
    climb_rate_max_mps: float = Field(default=2.0, gt=0)
    sink_rate_max_mps: float = Field(default=1.5, gt=0)
    climb_time_constant_s: float = Field(default=0.8, gt=0)
    vertical_acceleration_max_mps2: float = Field(default=2.0, gt=0)
    chi_inf_deg: float = Field(default=60.0, gt=0, le=90)
    path_gain_per_s: float = Field(default=0.2, gt=0)
    altitude_gain_per_s: float = Field(default=0.25, gt=0)
    waypoint_capture_m: float = Field(default=500.0, gt=0)

    @model_validator(mode="after")
    def _limits_in_order(self) -> Self:
        _check_limits(self.speed_min_mps, self.speed_max_mps, self.climb_rate_max_mps, self.sink_rate_max_mps)
        return self


class RotorcraftConfig(PartConfig):
    """A helicopter flown by velocity (rotorcraft.Rotorcraft); the defaults are those of the CAS thesis (3.6).

    Attributes
    ----------
    level_time_constant_s, vertical_time_constant_s : float
        Of the velocities behind their commands.
    speed_max_mps, climb_rate_max_mps, sink_rate_max_mps : float
    coupling : float
        Peak of the lateral velocity for each m/s of a step in vertical velocity (5.3.1 has 0.2 ft/s for 2 ft/s); 0
        leaves the axes apart.
    position_gain_per_s, altitude_gain_per_s : float
        Commanded velocity for each metre to the waypoint.
    ground_altitude_m : float
        Height of the ground above the origin.
    """

    level_time_constant_s: float = Field(default=0.8, gt=0)
    vertical_time_constant_s: float = Field(default=0.4, gt=0)
    speed_max_mps: float = Field(default=5 * FOOT, gt=0)
    climb_rate_max_mps: float = Field(default=2 * FOOT, gt=0)
    sink_rate_max_mps: float = Field(default=1 * FOOT, gt=0)
    coupling: float = Field(default=0.0, ge=0, le=1)
    position_gain_per_s: float = Field(default=0.3, gt=0)
    altitude_gain_per_s: float = Field(default=0.5, gt=0)
    ground_altitude_m: float = 0.0
