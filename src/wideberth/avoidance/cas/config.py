"""Configuration of the cooperative vertical controllers."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig
from wideberth.units import FOOT


class CasConfig(PartConfig):
    """A collision avoidance controller (CAS thesis, 4.3 and appendix A). The defaults are the best of ours.

    Attributes
    ----------
    controller : str
        ``bang_bang`` (4.3.1) and ``continuous`` (4.3.2) avoid the most critical vehicle; ``interval`` keeps the own
        vertical velocity among those that are tangent or better to all vehicles at once; ``altitudes`` flies to
        separate altitudes while a conflict is ahead (4.2.3). These are vertical. ``horizontal`` turns, ``speed`` slows
        down or hurries, ``least_deviation`` takes the one of turn, speed and climb that deviates least, ``combined``
        any mixture of them (4.2.1); ``roundabout`` turns to the right only, so that all pass round each other the same
        way (4.2.3). ``none`` never avoids.
    separation_m, margin_m : float
        Radius of the protected sphere, and what the controller adds to it for noise and lag.
    margin_growth_mps : float
        What ``interval`` adds for each second of age of the other's message.
    half_height_m : float or None
        Of a protected cylinder instead of the sphere (3.5), for ``interval``.
    climb_rate_max_mps, sink_rate_max_mps : float
        Of avoidance; the return's limits are those with ``return_``.
    lag_s, level_lag_s : float
        tau_v, of the vertical velocity behind its command, and that of the horizontal one.
    speed_max_mps : float
        Horizontal, of avoidance by speed.
    guidance_gain_per_s : float
        Commanded vertical velocity for each metre of altitude error.
    hysteresis_m : float
        Half-width delta of the switching band of ``continuous`` (figure 4.19).
    t_star_min_s : float or None
        Conflicts are avoided only where they are nearer than this (figure 4.26); None: at any time.
    law : str
        How much of the change of relative velocity a vehicle makes: ``full``, ``shared`` (half the relative command, as
        printed) or ``shared_corrected`` (half the change, errata, "CAS thesis").
    other_cooperates : bool
        Belief that the other avoids too; without it the law is ``full``.
    altitude_min_m : float
        Height above the origin below which no avoidance descends, and below which others are taken not to avoid.
    force, disable : bool
        Avoid always; never avoid.
    delay_compensation : str
        ``none``; ``estimate``: other vehicles are moved on by `delay_estimate_s`; ``timestamp``: by the message's age.
    delay_estimate_s : float
    return_time_max_s : float or None
        trmax: ``bang_bang`` returns although in conflict where it is further ahead; None: never (7 s chatters).
    tie_break : bool
        At equal altitude the vehicle of lower number climbs; without it a level head-on collides.
    direction_at : str
        Where ``bang_bang`` compares altitudes: ``closest_point`` as the text says, or ``rise_time`` as the listing.
    leave_inside : bool
        Avoid also inside the sphere without relative motion, where the listing does nothing.
    smoothing : float
        Weight of a new position against the one predicted; 1 takes messages as they are.
    stale_s : float
        Messages older than this are no longer believed.
    """

    controller: Literal[
        "bang_bang",
        "continuous",
        "interval",
        "altitudes",
        "horizontal",
        "speed",
        "combined",
        "least_deviation",
        "roundabout",
        "none",
    ] = "interval"
    separation_m: float = Field(default=12 * FOOT, gt=0)
    margin_m: float = Field(default=4 * FOOT, ge=0)
    margin_growth_mps: float = Field(default=1.5 * FOOT, ge=0)
    half_height_m: float | None = Field(default=None, gt=0)
    climb_rate_max_mps: float = Field(default=2 * FOOT, gt=0)
    sink_rate_max_mps: float = Field(default=1 * FOOT, gt=0)
    return_climb_rate_max_mps: float = Field(default=2 * FOOT, gt=0)
    return_sink_rate_max_mps: float = Field(default=1 * FOOT, gt=0)
    lag_s: float = Field(default=0.4, gt=0)
    level_lag_s: float = Field(default=0.8, gt=0)
    speed_max_mps: float = Field(default=5 * FOOT, gt=0)
    guidance_gain_per_s: float = Field(default=0.5, gt=0)
    hysteresis_m: float = Field(default=0.0, ge=0)
    t_star_min_s: float | None = Field(default=None, gt=0)
    law: Literal["full", "shared", "shared_corrected"] = "full"
    other_cooperates: bool = True
    altitude_min_m: float = 4 * FOOT
    force: bool = False
    disable: bool = False
    delay_compensation: Literal["none", "estimate", "timestamp"] = "timestamp"
    delay_estimate_s: float = Field(default=0.04, ge=0)
    return_time_max_s: float | None = Field(default=None, gt=0)
    tie_break: bool = True
    direction_at: Literal["closest_point", "rise_time"] = "closest_point"
    leave_inside: bool = True
    smoothing: float = Field(default=0.2, gt=0, le=1)
    stale_s: float = Field(default=10.0, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.half_height_m is not None and self.controller != "interval":
            raise ValueError(f"half_height_m: {self.controller} knows only the sphere; use controller = 'interval'")
        if self.hysteresis_m >= self.separation_m + self.margin_m:
            raise ValueError(f"hysteresis_m {self.hysteresis_m:g} must be below separation_m plus margin_m")
        return self


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "thesis": {
        "controller": "continuous",
        "margin_m": 0.0,
        "delay_compensation": "estimate",
        "return_time_max_s": 7.0,
        "direction_at": "rise_time",
        "leave_inside": False,
        "smoothing": 1.0,
        "stale_s": 1e6,
    },
}
"""Settings by name: ``thesis`` holds the printed numbers and the listing's rules, with the tie-break added."""


def cas_preset(name: str, **changes: Any) -> CasConfig:
    """Return a preset with changes.

    Parameters
    ----------
    name : str
        One of `PRESETS`.
    **changes
        Fields of `CasConfig`.

    Raises
    ------
    ValueError
        If there is no such preset or field, or a value is wrong.
    """
    if name not in PRESETS:
        raise ValueError(f"there is no preset '{name}' (known: {', '.join(PRESETS)})")
    return CasConfig(**{**PRESETS[name], **changes})
