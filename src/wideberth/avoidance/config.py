"""Configuration of the local-level planner and of the decisions around it."""

from typing import Literal, Self

from pydantic import Field, model_validator

from wideberth.avoidance.keep_out.config import KeepOut
from wideberth.part_config import PartConfig
from wideberth.units import FOOT


class LocalLevelConfig(PartConfig):
    """The local-level planner and the waypoint control around it.

    Volumes: *hard* is the planner's collision cylinder, *inner* a volume that is given up only to stay out of the hard
    one, *outer* the well-clear volume that is to be kept. Heights are half-heights.
    """

    map: Literal["flyable", "flyable_150", "flyable_38", "self_separation_150", "collision_38"] = Field(
        "flyable",
        description="the map of nodes: flyable (default); one of the two of the ADS-B paper as printed "
        "(self_separation_150, collision_38); or as many nodes, each where the aircraft really gets to (flyable_...)",
    )
    decision_period_s: float = Field(1.0, gt=0, le=10, description="time between decisions")
    grid_step_s: float = Field(1.0, gt=0, le=5, description="time between the places at which risk is evaluated")

    hard_radius_m: float = Field(900 * FOOT, gt=0)
    hard_half_height_m: float = Field(330 * FOOT, gt=0)
    inner_radius_m: float = Field(2000 * FOOT, gt=0)
    inner_half_height_m: float = Field(250 * FOOT, gt=0)
    outer_radius_m: float = Field(4000 * FOOT, gt=0)
    outer_half_height_m: float = Field(700 * FOOT, gt=0)
    outer_tau_s: float = Field(35.0, ge=0, description="modified tau of the outer volume; 0: a plain cylinder")
    buffer: float = Field(1.1, ge=1, le=3, description="factor on the inner and outer volumes while planning")
    keep_buffer: float = Field(
        1.0, ge=0.5, le=3, description="the same, for the decision to keep a maneuver; at most buffer"
    )
    return_buffer: float = Field(
        1.2, ge=1, le=3, description="the same, for the decision that the mission is safe again"
    )

    sigmas: float = Field(1.0, ge=0, le=6, description="standard deviations of position that widen the volumes")
    sigma_cap: float = Field(0.5, ge=0, description="largest such widening, as a fraction of the volume")
    growth_horizontal_mps: float = Field(4.0, ge=0, description="widening a second of look-ahead, unknown intentions")
    growth_vertical_mps: float = Field(0.5, ge=0)
    growth_time_s: float = Field(40.0, ge=0, description="look-ahead after which that widening stops")
    turn_significance: float = Field(1.5, ge=0, description="sigmas of lateral acceleration that make a turn believed")
    turn_rate_min_deg_s: float = Field(0.7, gt=0)
    turn_rate_max_deg_s: float = Field(6.0, gt=0)
    turn_time_s: float = Field(20.0, ge=0, description="how long a believed turn is continued in the prediction")
    turn_belief: float = Field(0.6, ge=0, le=1, description="belief in the continued turn; the rest in straight flight")

    weight_hard: float = Field(3000.0, ge=0, description="cost of a second inside the hard volume, in cost seconds")
    weight_inner: float = Field(300.0, ge=0)
    weight_outer: float = Field(20.0, ge=0)
    weight_near: float = Field(
        0.1, ge=0, description="cost of a second at the edge of the outer volume, falls with 1/d"
    )
    weight_goal: float = Field(0.3, ge=0, description="cost of a second of way back to the mission")
    weight_goal_vertical: float = Field(0.3, ge=0)
    beyond_s: float = Field(
        0.0,
        ge=0,
        le=300,
        description="how long after the end of a path straight flight should stay out of the hard volume as well, "
        "else the seconds inside cost as on the path; for maps shorter than a conflict takes to pass",
    )
    weight_turn: float = Field(1.0, ge=0, description="cost of a radian of course change")
    weight_left: float = Field(0.3, ge=0, description="additional cost of a radian to the left")
    weight_climb: float = Field(0.01, ge=0, description="cost of a metre of height change")
    weight_reversal: float = Field(
        60.0, ge=0, description="cost of turning or climbing against the sense already flown"
    )

    trigger_lookahead_s: float = Field(80.0, gt=0, description="a loss predicted within this time starts a maneuver")
    trigger_now_s: float = Field(
        20.0, ge=0, description="later than this a maneuver that would begin like the mission is not begun yet"
    )
    trigger: Literal["path", "detection"] = Field(
        "path",
        description="what begins a maneuver: the mission's path meets a volume; or besides, a collision is detected "
        "with the intruder inside the boundary trigger_radius_m, trigger_half_height_m, trigger_tau_s",
    )
    trigger_radius_m: float = Field(4000 * FOOT, gt=0)
    trigger_half_height_m: float = Field(700 * FOOT, gt=0)
    trigger_tau_s: float = Field(35.0, ge=0)
    trigger_collision_radius_m: float = Field(500 * FOOT, gt=0)
    trigger_collision_half_height_m: float = Field(100 * FOOT, gt=0)
    trigger_sigmas: float = Field(3.0, ge=0, le=6, description="m1 = m2 of algorithm 2 for that detection")
    settle_s: float = Field(4.0, ge=0, description="a new maneuver is not replaced sooner, but to escape")
    escape_s: float = Field(
        60.0, ge=0, description="what a new maneuver would lose within this time is escaped before it has settled"
    )
    hold_s: float = Field(8.0, ge=0, description="least time that a maneuver is flown")
    clear_s: float = Field(3.0, ge=0, description="how long the mission must look safe before it is resumed")
    renew_s: float = Field(20.0, ge=0, description="a maneuver that stays clear is not questioned for this long")
    switch_ratio: float = Field(0.6, gt=0, le=1, description="a new plan must cost less than this part of the kept one")
    switch_gain: float = Field(10.0, ge=0, description="and be better by this much")
    tentative_s: float = Field(
        35.0, ge=0, description="a track not yet confirmed is only avoided if it could be here within this time"
    )
    ghost_s: float = Field(60.0, ge=0, description="how long a lost aircraft is still avoided where it would be")

    altitude_min_m: float = Field(120.0, description="no maneuver goes below (altitude, m)")
    altitude_max_m: float = Field(3000.0, description="no maneuver goes above (altitude, m)")
    keep_out: tuple[KeepOut, ...] = Field((), description="volumes that no maneuver enters: polygons and cylinders")
    keep_out_margin_m: float = Field(30.0, ge=0, description="horizontal distance kept from them")
    turn_delay_s: float = Field(1.5, ge=0, description="time before a commanded turn takes effect")
    bank_share: float = Field(0.8, gt=0, le=1, description="share of the vehicle's largest bank that plans may use")
    climb_share: float = Field(0.95, gt=0, le=1, description="the same for its largest climb and sink rates")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.altitude_max_m <= self.altitude_min_m:
            raise ValueError("altitude_max_m must be above altitude_min_m")
        if self.keep_buffer > self.buffer:
            raise ValueError("keep_buffer must not exceed buffer")
        for name in ("radius_m", "half_height_m"):
            for volume in ("hard", "inner"):
                if getattr(self, f"{volume}_{name}") > getattr(self, f"outer_{name}"):
                    raise ValueError(f"{volume}_{name} must not exceed outer_{name}")
        return self
