"""Configuration of the vertical controllers as planners."""

import math
from collections.abc import Mapping
from typing import Literal, Self

from pydantic import Field, model_validator

from wideberth.avoidance.cas.config import CasConfig, ThresholdConfig
from wideberth.avoidance.keep_out.config import KeepOut
from wideberth.part_config import PartConfig


class TrackThresholdConfig(ThresholdConfig):
    """What counts as a conflict, with errors like those of tracks; the keys are those of `ThresholdConfig`.

    With ``probability`` the covariance of each track counts, and the errors below only where it has none.
    """

    relative_position_sigma_m: float = Field(default=5.0, ge=0)
    relative_velocity_sigma_mps: float = Field(default=0.5, ge=0)
    position_bound_m: float = Field(default=5.0, ge=0)
    velocity_bound_mps: float = Field(default=0.5, ge=0)


class VerticalConfig(PartConfig):
    """A vertical controller as the planner of a mission (CAS thesis, 4.3). Keys named as in `CasConfig` mean the same.

    Attributes
    ----------
    zone : str
        Protected zone: ``cylinder`` (`separation_m`, `half_height_m`), or a ``sphere`` of radius `separation_m`.
    separation_m, half_height_m : float
        By default 500 ft and 100 ft.
    margin_m, margin_growth_mps : float
        Added to both for lag and guidance, and for each second since a track was last updated.
    sigmas, sigma_cap : float
        Standard deviations of height at the closest point by which the zone is widened, at most so much of it.
    several : str
        Among several aircraft ``all_at_once`` decides against all: ``cas_continuous`` by the vertical velocities that
        are tangent or better to all, ``cas_bang_bang`` until its maneuver is over with all; ``most_critical`` decides
        against one at a time.
    direction : str
        ``auto``: above or below as the altitudes at the closest point say, and the other way where that is blocked;
        ``climb`` or ``descend``: always.
    climb_rate_max_mps, sink_rate_max_mps, return_climb_rate_max_mps, return_sink_rate_max_mps : float, optional
        Limits of avoidance and of the return. By default, and at most, the vehicle's times `climb_share`.
    climb_share : float
    lag_s, guidance_gain_per_s : float, optional
        By default the vehicle's.
    lookahead_s : float, optional
        Who enters the zone horizontally later is not avoided yet. By default twice the time in which the ownship climbs
        or sinks out of the zone, whichever takes longer, and 4 lags. ``cas_bang_bang`` begins late enough without.
    t_star_min_s : float, optional
        Closest points farther ahead are not avoided yet (figure 4.26).
    other_cooperates : bool
        Belief that the others avoid too. By default they do not: what is only seen promises nothing.
    direction_at, return_time_max_s, leave_inside
        As in `CasConfig`.
    force, disable : bool
        Avoid whoever is met soon, even if far above or below; never avoid.
    delay_compensation : str
        ``timestamp``: a track or an own state of another time is moved on to now; ``estimate``: tracks are moved on by
        `delay_estimate_s`; ``none``.
    delay_estimate_s : float
    stale_s : float
        A track that was not updated for longer is no longer avoided.
    ghost_s : float
        A lost aircraft, or one whose track is not finite, is avoided for so long where it would be.
    tentative : bool
        Avoid tentative tracks too.
    detections_needed : int
        So many decisions to avoid, one after the other, begin a maneuver, and as many not to avoid end it.
    decision_period_s : float
        Time between decisions.
    path_tolerance_m : float
        The path being flown is replaced only where the one that the controller would fly now departs from it by more,
        or where it leads into a zone and the new one less.
    settle_s, urgent_s : float
        A path is not replaced for so long, unless it leads into a zone within `urgent_s`.
    horizon_s : float
        How far paths reach ahead.
    altitude_min_m, altitude_max_m : float
        No maneuver goes below or above.
    keep_out : list
        Volumes that no maneuver enters: tables with kind "polygon" or "cylinder".
    keep_out_margin_m : float
        Horizontal distance kept from them.
    threshold : TrackThresholdConfig
    """

    zone: Literal["cylinder", "sphere"] = "cylinder"
    separation_m: float = Field(default=153.0, gt=0)
    half_height_m: float = Field(default=30.5, gt=0)
    margin_m: float = Field(default=4.0, ge=0)
    margin_growth_mps: float = Field(default=0.5, ge=0)
    sigmas: float = Field(default=1.0, ge=0, le=6)
    sigma_cap: float = Field(default=0.3, ge=0, le=3)
    several: Literal["all_at_once", "most_critical"] = "all_at_once"
    direction: Literal["auto", "climb", "descend"] = "auto"
    climb_rate_max_mps: float | None = Field(default=None, gt=0)
    sink_rate_max_mps: float | None = Field(default=None, gt=0)
    return_climb_rate_max_mps: float | None = Field(default=None, gt=0)
    return_sink_rate_max_mps: float | None = Field(default=None, gt=0)
    climb_share: float = Field(default=0.95, gt=0, le=1)
    lag_s: float | None = Field(default=None, gt=0)
    guidance_gain_per_s: float | None = Field(default=None, gt=0)
    lookahead_s: float | None = Field(default=None, gt=0)
    t_star_min_s: float | None = Field(default=None, gt=0)
    other_cooperates: bool = False
    direction_at: Literal["closest_point", "rise_time"] = "closest_point"
    return_time_max_s: float | None = Field(default=None, gt=0)
    leave_inside: bool = True
    force: bool = False
    disable: bool = False
    delay_compensation: Literal["none", "estimate", "timestamp"] = "timestamp"
    delay_estimate_s: float = Field(default=0.1, ge=0)
    stale_s: float = Field(default=20.0, gt=0)
    ghost_s: float = Field(default=10.0, ge=0)
    tentative: bool = False
    detections_needed: int = Field(default=3, ge=1, le=100)
    decision_period_s: float = Field(default=0.1, gt=0, le=10)
    path_tolerance_m: float = Field(default=12.0, gt=0)
    settle_s: float = Field(default=4.0, ge=0)
    urgent_s: float = Field(default=10.0, ge=0)
    horizon_s: float = Field(default=90.0, ge=5, le=300)
    altitude_min_m: float = 50.0
    altitude_max_m: float = 3000.0
    keep_out: tuple[KeepOut, ...] = ()
    keep_out_margin_m: float = Field(default=10.0, ge=0)
    threshold: TrackThresholdConfig = TrackThresholdConfig()

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.altitude_max_m <= self.altitude_min_m:
            raise ValueError("altitude_max_m must be above altitude_min_m")
        if self.force and self.disable:
            raise ValueError("force and disable exclude each other: leave one")
        self.cas_config({})  # what it refuses is refused here
        return self

    @property
    def kernel(self) -> Literal["bang_bang", "continuous", "interval"]:
        """The controller of `CasConfig` that decides."""
        return "interval" if self.several == "all_at_once" else "continuous"

    def cas_config(self, limits: Mapping[str, float]) -> CasConfig:
        """Return the controller's own configuration.

        Parameters
        ----------
        limits : mapping of str to float
            What the vehicle has, by the names of `CasConfig`: the most of its rates, the rest where none is given here.
        """
        names = set(CasConfig.model_fields) & set(type(self).model_fields)
        own = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        for name, value in limits.items():
            own[name] = min(own.get(name, math.inf), value) if name.endswith("_max_mps") else own.get(name, value)
        if self.zone == "sphere":
            del own["half_height_m"]
        return CasConfig(**own, controller=self.kernel)

    @property
    def zone_height(self) -> float:
        """How far up and down the zone reaches, m."""
        return self.half_height_m if self.zone == "cylinder" else self.separation_m


class BangBangConfig(VerticalConfig):
    """Full climb or descent, begun as late as the dynamics allow (CAS thesis, 4.3.1).

    Attributes
    ----------
    level_off : bool
        Hold the height once that passes everybody, until the return is free; else climb or descend until then, as the
        thesis does.
    """

    level_off: bool = True

    @property
    def kernel(self) -> Literal["bang_bang", "continuous", "interval"]:
        """The controller of `CasConfig` that decides."""
        return "bang_bang"


class ContinuousConfig(VerticalConfig):
    """The vertical velocity that is tangent to the protected zone (CAS thesis, 4.3.2).

    Attributes
    ----------
    law : str
        ``full``, ``shared`` or ``shared_corrected``, where the others are believed to cooperate.
    hysteresis_m : float
        Half-width delta of the switching band (figure 4.19), of ``most_critical``; a cylinder's in its radius.
    """

    law: Literal["full", "shared", "shared_corrected"] = "full"
    hysteresis_m: float = Field(default=0.0, ge=0)
