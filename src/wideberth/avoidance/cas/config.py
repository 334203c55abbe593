"""Configuration of the cooperative vertical controllers."""

from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.part_config import PartConfig
from wideberth.units import FOOT


class PredictionConfig(PartConfig):
    """How the courses of other vehicles are predicted from their messages (CAS thesis, 4.1.1, 4.1.2, 6.2.2).

    Attributes
    ----------
    kind : str
        ``constant_velocity``: states as received; ``constant_acceleration``: with the acceleration received, or that
        between the last two messages; ``kalman`` and ``kalman_acceleration``: a filter with these models takes in
        whatever is received, positions alone suffice.
    intent : bool
        Fly along the waypoints of a message that has some, while the vehicle does not avoid and flies to the next one.
    intent_tolerance_mps : float
        By how much its velocity may differ from the one that leads there in time.
    acceleration_hold_s : float
        For how long an acceleration is taken to last; straight flight follows. Some lags of a helicopter; longer for
        vehicles that turn.
    lookahead_s : float
        How far curved courses and waypoints are looked at.
    position_sigma_m, velocity_sigma_mps, acceleration_sigma_mps2 : float
        Errors of what is received on each axis (one standard deviation), where the message gives no own.
    own_position_sigma_m : float
        Error of the own position.
    acceleration_density_m2ps3, jerk_density_m2ps5 : float
        Process noise of ``kalman`` and of ``kalman_acceleration``.
    unknown_velocity_mps, unknown_acceleration_mps2 : float
        Standard deviation of what the first message of a vehicle does not say.
    degraded_noise_factor, failed_noise_factor : float
        By which a health message multiplies the standard deviations of process noise.
    speed_limit_mps, jump_limit_m : float
        A message with a higher speed, or farther from where it was expected (plus the time since times that speed), is
        absurd.
    acceleration_limit_mps2, distance_limit_m : float
        A message with a larger acceleration, or a place or error farther from the origin, is absurd.
    clock_tolerance_s, clock_limit_s : float
        Differences of clocks above which a message counts as one of a wrong clock, and above which it is absurd.
    patience_s : float
        For how long a vehicle that says it avoids may move the other way before it is taken not to cooperate.
    """

    kind: Literal["constant_velocity", "constant_acceleration", "kalman", "kalman_acceleration"] = "constant_velocity"
    intent: bool = False
    intent_tolerance_mps: float = Field(default=2 * FOOT, gt=0)
    acceleration_hold_s: float = Field(default=1.0, gt=0)
    lookahead_s: float = Field(default=60.0, gt=0)
    position_sigma_m: float = Field(default=1 * FOOT, gt=0)
    velocity_sigma_mps: float = Field(default=0.3 * FOOT, gt=0)
    acceleration_sigma_mps2: float = Field(default=0.3 * FOOT, gt=0)
    own_position_sigma_m: float = Field(default=1 * FOOT, ge=0)
    acceleration_density_m2ps3: float = Field(default=0.01, gt=0)
    jerk_density_m2ps5: float = Field(default=0.01, gt=0)
    unknown_velocity_mps: float = Field(default=5 * FOOT, gt=0)
    unknown_acceleration_mps2: float = Field(default=2 * FOOT, gt=0)
    degraded_noise_factor: float = Field(default=3.0, ge=1)
    failed_noise_factor: float = Field(default=10.0, ge=1)
    speed_limit_mps: float = Field(default=10.0, gt=0)
    jump_limit_m: float = Field(default=10.0, gt=0)
    acceleration_limit_mps2: float = Field(default=20.0, gt=0)
    distance_limit_m: float = Field(default=1e5, gt=0)
    clock_tolerance_s: float = Field(default=0.5, gt=0)
    clock_limit_s: float = Field(default=60.0, gt=0)
    patience_s: float = Field(default=4.0, gt=0)

    @property
    def as_received(self) -> bool:
        """Whether states are taken as received, for which nobody has to predict."""
        return self.kind == "constant_velocity" and not self.intent


class ThresholdConfig(PartConfig):
    """What counts as a conflict, and when an avoidance starts (CAS thesis, 4.1.3, 4.2.2).

    Whatever the kind, it gives a distance that is kept like `separation_m` plus `margin_m`, and is not below it. Errors
    have grown for a message's age, but for ``bang_bang`` and ``continuous``, which take states as fresh.

    Attributes
    ----------
    kind : str
        ``deterministic``: the mean course comes closer than the separation; ``probability``: it does so with at least
        the alerting threshold's probability, by the errors below; ``table``: the same by a Monte Carlo table, with the
        errors that it was made for; ``guaranteed``: it cannot be excluded within the bounds below.
    alert_probability : float
        The alerting threshold.
    relative_position_sigma_m, relative_velocity_sigma_mps, acceleration_density_m2ps3 : float
        Errors of the relative state on each axis (one standard deviation) and white acceleration of the pair; a filter
        that knows better has its own.
    table_file : Path or None
        Of ``table``, as written by `probability_table.ConflictTable.save`; from the folder where the program runs.
    position_bound_m, velocity_bound_mps, acceleration_bound_mps2 : float
        How far the relative state may be off on each axis at most; acceleration from none.
    turn_rate_bound_radps : float
        How fast a vehicle may turn at `speed_max_mps`: added to the acceleration.
    lookahead_s : float
        For how long the distance is to be guaranteed.
    start : str
        Of ``bang_bang``: ``latest``, or by a ``hypothesis_test``: when a probable conflict is false with no more than
        `false_alarm_probability`, or an avoidance that begins now fails with `missed_probability`.
    false_alarm_probability, missed_probability : float
    """

    kind: Literal["deterministic", "probability", "table", "guaranteed"] = "deterministic"
    alert_probability: float = Field(default=0.05, gt=0, le=0.5)
    relative_position_sigma_m: float = Field(default=1.4 * FOOT, ge=0)
    relative_velocity_sigma_mps: float = Field(default=0.2 * FOOT, ge=0)
    acceleration_density_m2ps3: float = Field(default=0.0, ge=0)
    table_file: Path | None = None
    position_bound_m: float = Field(default=3 * FOOT, ge=0)
    velocity_bound_mps: float = Field(default=0.2 * FOOT, ge=0)
    acceleration_bound_mps2: float = Field(default=0.0, ge=0)
    turn_rate_bound_radps: float = Field(default=0.0, ge=0)
    lookahead_s: float = Field(default=15.0, gt=0)
    start: Literal["latest", "hypothesis_test"] = "latest"
    false_alarm_probability: float = Field(default=0.05, gt=0, lt=1)
    missed_probability: float = Field(default=0.05, gt=0, lt=1)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.kind == "table") != (self.table_file is not None):
            raise ValueError("table_file belongs to kind = 'table': give both or neither")
        return self


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
        Of a protected cylinder instead of the sphere (3.5), for ``bang_bang``, ``continuous`` and ``interval``.
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
    altitude_max_m : float or None
        Height above the origin above which no vertical avoidance climbs.
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
        Messages older than this are no longer believed. Until then the margin grows with their age, so that a shorter
        outage of the radio does no harm.
    prediction : PredictionConfig
    threshold : ThresholdConfig
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
    altitude_max_m: float | None = None
    force: bool = False
    disable: bool = False
    delay_compensation: Literal["none", "estimate", "timestamp"] = "timestamp"
    delay_estimate_s: float = Field(default=0.04, ge=0)
    return_time_max_s: float | None = Field(default=None, gt=0)
    tie_break: bool = True
    direction_at: Literal["closest_point", "rise_time"] = "closest_point"
    leave_inside: bool = True
    smoothing: float = Field(default=0.2, gt=0, le=1)
    stale_s: float = Field(default=20.0, gt=0)
    prediction: PredictionConfig = PredictionConfig()
    threshold: ThresholdConfig = ThresholdConfig()

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.half_height_m is not None and self.controller not in {"bang_bang", "continuous", "interval"}:
            raise ValueError(f"half_height_m: {self.controller} knows only the sphere; use controller = 'interval'")
        if self.altitude_max_m is not None and self.altitude_max_m <= self.altitude_min_m:
            raise ValueError("altitude_max_m must be above altitude_min_m")
        if self.hysteresis_m >= self.separation_m + self.margin_m:
            raise ValueError(f"hysteresis_m {self.hysteresis_m:g} must be below separation_m plus margin_m")
        if self.threshold.kind != "deterministic" and self.controller in {"altitudes", "none"}:
            raise ValueError(f"threshold.kind: {self.controller} knows only 'deterministic'")
        if self.threshold.start != "latest" and self.controller != "bang_bang":
            raise ValueError(f"threshold.start: {self.controller} corrects itself at each step; use 'latest'")
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
