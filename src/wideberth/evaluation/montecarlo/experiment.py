"""An experiment: the encounters to draw, the parts that meet them, and what counts; one TOML file."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.config import ScenarioConfig, apply_override, build_scenario, check_table, read_toml
from wideberth.config_errors import wrong_things
from wideberth.errors import InputError
from wideberth.part_config import PartConfig
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT


class EncounterConfig(PartConfig):
    """How encounters are drawn (ADS-B paper, "Simulation results"; readings: ERRATA, "ADS-B paper").

    The ownship starts at the centre of the encounter circle and flies north. The first intruder starts at the points of
    the circle in turn, the others at points drawn without replacement from the rest; all fly straight and level.
    """

    circle_nmi: Annotated[float, Field(gt=0, le=100, description="radius of the encounter circle")]
    points: Annotated[int, Field(ge=1, le=10_000, description="evenly spaced starting points on the circle")] = 20
    runs_per_point: Annotated[int, Field(ge=1, description="runs for each point of the first intruder")] = 1000
    intruders: Annotated[tuple[int, ...], Field(min_length=1, description="numbers of intruders, one set each")] = (
        1,
        2,
        3,
        4,
        5,
    )
    ownship_speed_kt: Annotated[float, Field(gt=0, le=500)] = 80.0
    ownship_altitude_m: Annotated[float, Field(ge=0, le=20_000)] = 1500.0
    intruder_speed_min_kt: Annotated[float, Field(ge=0)] = 39.0
    intruder_speed_max_kt: Annotated[float, Field(gt=0, le=1200)] = 250.0
    altitude_offset_ft: Annotated[
        float, Field(ge=0, description="intruders fly level at a height uniform within +- this of the ownship's")
    ] = 160.0
    redraw: Annotated[
        Literal["speed_and_heading", "heading"],
        Field(description="what is drawn anew until the relative velocity points into the circle"),
    ] = "speed_and_heading"
    duration_s: Annotated[float, Field(gt=0, le=7200, description="longest run; it ends once all have passed")] = 180.0

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.intruder_speed_max_kt < self.intruder_speed_min_kt:
            raise ValueError("intruder_speed_max_kt is below intruder_speed_min_kt: swap them")
        if any(n < 1 for n in self.intruders):
            raise ValueError("intruders: each number must be at least 1")
        if len(set(self.intruders)) != len(self.intruders):
            raise ValueError("intruders: a number is given twice")
        if max(self.intruders) > self.points:
            raise ValueError(
                f"intruders: {max(self.intruders)} intruders cannot start at {self.points} different points"
            )
        if max(self.intruders) > 64:
            raise ValueError("intruders: at most 64")
        return self


class ErrorsConfig(PartConfig):
    """Readings of the error model that concern sensor and tracker alike (ERRATA, "ADS-B paper")."""

    altitude: Annotated[
        Literal["white", "bias"],
        Field(description="altitude error: new in each message, or one value for each aircraft"),
    ] = "white"
    start: Annotated[
        Literal["stationary", "zero"], Field(description="spread of the position error at the start of a run")
    ] = "stationary"


class ScoringConfig(PartConfig):
    """What counts as an event, as its detection, and as a violation. Heights are half-heights.

    `threshold_...` and `tau_s` are the boundary of line 1 of algorithms 1 and 2, `volume_...` the volume of line 2.
    """

    paper: Annotated[
        Literal["collision", "self_separation"], Field(description="which of the paper's tables stand beside")
    ] = "collision"
    threshold_radius_m: Annotated[float, Field(gt=0)] = 4000 * FOOT
    threshold_half_height_m: Annotated[float, Field(gt=0)] = 700 * FOOT
    tau_s: Annotated[float, Field(ge=0)] = 35.0
    lookahead_s: Annotated[float, Field(gt=0, le=3600)] = 60.0
    volume_radius_m: Annotated[float, Field(gt=0)] = 500 * FOOT
    volume_half_height_m: Annotated[float, Field(gt=0)] = 100 * FOOT
    other_radius_m: Annotated[float, Field(gt=0, description="the other reading of the volume")] = 500 * FOOT
    other_half_height_m: Annotated[float, Field(gt=0)] = 50 * FOOT
    violation_radius_m: Annotated[float, Field(gt=0, description="the collision volume that must not be entered")] = (
        500 * FOOT
    )
    violation_half_height_m: Annotated[float, Field(gt=0)] = 100 * FOOT
    aircraft_radius_m: Annotated[float, Field(gt=0)] = 10 * FOOT
    aircraft_half_height_m: Annotated[float, Field(gt=0)] = 1.5 * FOOT
    m1: Annotated[float, Field(ge=0, description="sigmas of algorithm 2, horizontal")] = 1.0
    m2: Annotated[float, Field(ge=0, description="sigmas of algorithm 2, vertical")] = 1.0
    position_sigma_m: Annotated[float, Field(ge=0)] = 124 * FOOT
    velocity_sigma_mps: Annotated[float, Field(ge=0)] = 8 * KNOT
    altitude_sigma_m: Annotated[float, Field(ge=0)] = 75.9 * FOOT
    climb_rate_sigma_mps: Annotated[float, Field(ge=0)] = 27.96 * FOOT_PER_MINUTE
    alarm_probability: Annotated[
        float, Field(gt=0, lt=1, description="of entering the volume at which the default detector raises an alarm")
    ]
    early_alarm_probability: Annotated[
        float | None,
        Field(
            gt=0, lt=1, description="the same where the closest point is early_alarm_s ahead or more; None: the same"
        ),
    ] = None
    early_alarm_s: Annotated[float, Field(gt=0)] = 20.0


@dataclass(frozen=True, slots=True)
class Experiment:
    """A checked experiment.

    Attributes
    ----------
    name, description : str
    seed : int
    encounter : EncounterConfig
    errors : ErrorsConfig
    scoring : ScoringConfig
    scenario : ScenarioConfig
        The parts: ownship, sensor, tracker, detection, avoidance; without mission and traffic.
    """

    name: str
    description: str
    seed: int
    encounter: EncounterConfig
    errors: ErrorsConfig
    scoring: ScoringConfig
    scenario: ScenarioConfig

    @property
    def encounters(self) -> int:
        """Encounters for each number of intruders, unless others are asked for."""
        return self.encounter.points * self.encounter.runs_per_point

    def resolved(self) -> dict[str, Any]:
        """Return every setting, defaults included, as plain values that `build_experiment` takes."""
        table = self.scenario.resolved()
        for key in ("traffic", "mission", "wind", "navigation", "evaluation", "origin", "avoid"):
            table.pop(key, None)
        for key in ("encounter", "errors", "scoring"):
            table[key] = getattr(self, key).model_dump(mode="json", exclude_none=True)
        return table

    def digest(self) -> str:
        """Return a short hash over all settings: two experiments with the same digest give the same rows."""
        table = {k: v for k, v in self.resolved().items() if k not in ("name", "description")}
        return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()[:16]


_TABLES: Mapping[str, type[PartConfig]] = {
    "encounter": EncounterConfig,
    "errors": ErrorsConfig,
    "scoring": ScoringConfig,
}
_NOT_HERE = ("traffic", "mission", "origin", "wind", "navigation", "duration_s", "avoid", "evaluation")
_ORIGIN = {"lat_deg": 40.25, "lon_deg": -111.65}  # anywhere: encounters are local


def build_experiment(tables: Mapping[str, Any], source: str = "experiment") -> Experiment:
    """Check an experiment's tables.

    Parameters
    ----------
    tables : mapping
        As read from TOML, or from `Experiment.resolved`.
    source : str
        What to call it in messages.

    Raises
    ------
    InputError
        With one line for each thing that is wrong.
    """
    wrong = [f"{key}: not for an experiment, which sets it itself" for key in _NOT_HERE if key in tables]
    checked: dict[str, Any] = {}
    for key, model in _TABLES.items():
        table = tables.get(key, {})
        if not isinstance(table, dict):
            wrong.append(f"{key}: must be a table, not {table!r:.60}")
            continue
        checked[key] = check_table(model, table, key, wrong)
    base = {k: v for k, v in tables.items() if k not in _TABLES and k not in _NOT_HERE}
    if checked.get("errors") is not None:
        base = _with_errors(base, checked["errors"], wrong)
    scenario = None
    try:
        scenario = build_scenario({**base, "origin": _ORIGIN}, source)
    except InputError as error:
        text = str(error).removeprefix(f"{source}: ")
        wrong += [line.strip() for line in text.splitlines() if not line.endswith("things are wrong")]
    if scenario is not None and not 0.0999 < scenario.step_s < 0.1001:
        wrong.append(f"step_s: must be 0.1, the rate of the paper's filter and detection, not {scenario.step_s:g}")
    if wrong or scenario is None:
        raise wrong_things(source, wrong)
    return Experiment(
        name=scenario.name, description=scenario.description, seed=scenario.seed, scenario=scenario, **checked
    )


def load_experiment(path: Path, overrides: Sequence[str] = ()) -> Experiment:
    """Read and check an experiment.

    Parameters
    ----------
    path : Path
        A TOML file.
    overrides : sequence of str
        ``table.key=value`` each, applied in order before the check.

    Raises
    ------
    InputError
        With one line for each thing that is wrong.
    """
    tables = read_toml(Path(path))
    for override in overrides:
        apply_override(tables, override)
    return build_experiment(tables, source=str(path))


def _with_errors(tables: Mapping[str, Any], errors: ErrorsConfig, wrong: list[str]) -> dict[str, Any]:
    """Return the tables with sensor and tracker told what the altitude error is, where they do not say themselves."""
    merged = dict(tables)
    noise = {"altitude_white_sigma_ft": 12.0} if errors.altitude == "bias" else {}
    if "sensors" in tables:
        wrong.append("sensors: an experiment has one sensor: write it as [sensor]")
        return merged
    told: dict[str, dict[str, Any]] = {
        "sensor": {"altitude_error": errors.altitude, "start": errors.start},
        "tracker": {"altitude_bias_sigma_ft": 75.9 if errors.altitude == "bias" else 0.0},
    }
    for key, settings in told.items():
        table = merged.get(key, {})
        if not isinstance(table, Mapping):
            continue  # refused by the scenario
        for name, value in settings.items():
            if name in table and table[name] != value:
                wrong.append(f"{key}.{name}: contradicts the table errors, which sets it; leave it out")
        merged[key] = {**settings, **table}
    if noise and isinstance(merged["sensor"], Mapping):
        merged["sensor"] = {**merged["sensor"], "noise": {**noise, **merged["sensor"].get("noise", {})}}
    return merged
