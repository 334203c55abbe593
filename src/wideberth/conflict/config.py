"""Configuration of conflict detection."""

from typing import Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT

VolumeName = Literal["sarp", "do365_phase1", "do365_buffered", "do365_noncooperative", "astm_f3442", "nmac"]


class DetectionConfig(PartConfig):
    """Alerting on tracks with algorithm 2 of the ADS-B paper and the exact interval of a well-clear volume."""

    well_clear_volume: VolumeName = Field("sarp", description="volume whose loss is corrective")
    miss_filter: bool = Field(False, description="modified tau counts only towards a miss of at most DTHR")
    collision_volume: VolumeName = Field("nmac", description="volume whose predicted entry is a warning")

    lookahead_s: float = Field(110.0, gt=0, le=600, description="T; a loss predicted within it is preventive")
    corrective_time_s: float = Field(60.0, gt=0, description="a loss predicted within this time is corrective")
    warning_time_s: float = Field(30.0, gt=0, description="a collision predicted within this time is a warning")
    near_factor: float = Field(
        1.5, ge=1, le=10, description="closer than this multiple of DTHR and ZTHR is at least preventive"
    )

    m1: float = Field(1.0, ge=0, le=6, description="sigmas taken off the horizontal miss for self-separation")
    m2: float = Field(1.0, ge=0, le=6, description="sigmas taken off the vertical miss for self-separation")
    collision_m1: float = Field(3.0, ge=0, le=6, description="the same for collision")
    collision_m2: float = Field(3.0, ge=0, le=6)
    variant: Literal["corrected", "printed"] = Field("corrected", description="algorithm 2 as corrected or as printed")

    sigma: Literal["track", "paper"] = Field("track", description="sigmas from the track's covariance or the constants")
    position_sigma_m: float = Field(124 * FOOT, ge=0, description="the paper's constants, for sigma = 'paper'")
    velocity_sigma_mps: float = Field(8 * KNOT, ge=0)
    altitude_sigma_m: float = Field(75.9 * FOOT, ge=0)
    climb_rate_sigma_mps: float = Field(27.96 * FOOT_PER_MINUTE, ge=0)
    noisy_aircraft: Literal[1, 2] = Field(1, description="whether one or both aircraft have these errors")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.warning_time_s <= self.corrective_time_s <= self.lookahead_s:
            raise ValueError("warning_time_s <= corrective_time_s <= lookahead_s must hold")
        return self


class PathCylinderConfig(PartConfig):
    """Alerting along the path that is to be flown, with algorithms 3 to 5 of the thesis (4.3).

    Attributes
    ----------
    safety_radius_m, safety_height_m : float
        R_s and h_s, the full height of the cylinder.
    distance_threshold_m, height_threshold_m : float
        tau_p, tau_h: an intruder within both now counts whenever it enters.
    time_threshold_s : float
        tau_T: an entry until then counts, and is corrective.
    warning_time_s : float
        An entry until then is a warning.
    lookahead_s : float
        Nothing is judged later.
    motion : str
        How intruders go on: straight, or as their estimated acceleration says.
    maneuver_time_s : float
        For how long they do so; then straight on.
    tolerance_s : float
        No stay in the cylinder that lasts longer is missed where intruders do not fly straight.
    beyond : str
        What the ownship does after the last waypoint.
    """

    safety_radius_m: float = Field(500 * FOOT, gt=0)
    safety_height_m: float = Field(200 * FOOT, gt=0)
    distance_threshold_m: float = Field(800.0, ge=0)
    height_threshold_m: float = Field(100.0, ge=0)
    time_threshold_s: float = Field(25.0, ge=0)
    warning_time_s: float = Field(15.0, ge=0)
    lookahead_s: float = Field(120.0, gt=0, le=600)
    motion: Literal["constant_velocity", "constant_acceleration", "turning"] = "constant_velocity"
    maneuver_time_s: float = Field(10.0, gt=0, le=600)
    tolerance_s: float = Field(0.01, ge=1e-4, le=1.0)
    beyond: Literal["along_last_leg", "hover"] = "along_last_leg"

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.warning_time_s <= self.time_threshold_s <= self.lookahead_s:
            raise ValueError("warning_time_s <= time_threshold_s <= lookahead_s must hold")
        return self
