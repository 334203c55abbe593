"""Configuration of the vehicle models."""

from typing import Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig


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
        if self.speed_max_mps < self.speed_min_mps:
            raise ValueError(
                f"speed_max_mps {self.speed_max_mps:g} is below speed_min_mps {self.speed_min_mps:g}: swap them"
            )
        for name in ("climb_rate_max_mps", "sink_rate_max_mps"):
            if getattr(self, name) >= self.speed_min_mps:
                raise ValueError(f"{name} {getattr(self, name):g} is not below speed_min_mps {self.speed_min_mps:g}")
        return self
