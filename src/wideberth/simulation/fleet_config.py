"""The files of fleets that avoid each other: `scenarios/cas_*.toml`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from wideberth.avoidance.cas.config import PRESETS, CasConfig
from wideberth.part_config import PartConfig
from wideberth.vehicles.config import RotorcraftConfig


class CommunicationConfig(PartConfig):
    """How the vehicles hear of each other.

    Attributes
    ----------
    period_s : float or None
        Between a vehicle's messages; None: one at each step.
    delay_s, jitter_s : float
        The time that a message takes, and the mean of an exponential part on top, which also reorders messages.
    loss, duplicates, absurd : float
        Shares of messages that are lost, come twice, or are corrupted.
    position_sigma_m : float
        Standard deviation per axis of the positions that vehicles measure of themselves and send.
    velocities : bool
        Whether messages carry velocities; without them others know positions alone.
    hub : bool
        Messages go by a hub that only passes them on (figure 3.2): delay and loss count on both ways, a loss on the way
        up concerns all.
    outage_start_s, outage_duration_s : float
        While nothing is received.
    outage_vehicle : int or None
        Whose messages are missing then; None: everybody's.
    before_start : str
        What is known before the first message: the first state, frozen as in a delay buffer filled with it (``held``),
        straight flight before the start (``straight``), or nothing (``silent``). Vehicles that predict take ``held``
        for ``straight``.
    speed_limit_mps, jump_limit_m : float
        A message with a higher speed, or farther from where it was expected (plus its age times that speed), is absurd.
        Vehicles that predict have their own limits in `PredictionConfig`.
    """

    period_s: float | None = Field(default=None, gt=0)
    delay_s: float = Field(default=0.0, ge=0, le=60)
    jitter_s: float = Field(default=0.0, ge=0, le=10)
    loss: float = Field(default=0.0, ge=0, le=1)
    duplicates: float = Field(default=0.0, ge=0, le=1)
    absurd: float = Field(default=0.0, ge=0, le=1)
    position_sigma_m: float = Field(default=0.0, ge=0)
    velocities: bool = True
    hub: bool = False
    outage_start_s: float = Field(default=0.0, ge=0)
    outage_duration_s: float = Field(default=0.0, ge=0)
    outage_vehicle: int | None = Field(default=None, ge=0)
    before_start: Literal["silent", "held", "straight"] = "held"
    speed_limit_mps: float = Field(default=10.0, gt=0)
    jump_limit_m: float = Field(default=10.0, gt=0)


class FleetVehicleConfig(PartConfig):
    """One vehicle: where it starts, how it flies, and what it wants.

    Attributes
    ----------
    position_m, velocity_mps : tuple of float
        North, east and altitude; north, east and up. The track is the straight line from there.
    altitude_wanted_m : float or None
        None: the one it starts at.
    controller : CasConfig or None
        None: the fleet's.
    health : str
        What its messages say of it: ``nominal``, ``degraded`` (its course is less certain) or ``failed`` (it is taken
        not to avoid, too).
    """

    position_m: tuple[float, float, float]
    velocity_mps: tuple[float, float, float]
    altitude_wanted_m: float | None = None
    controller: CasConfig | None = None
    health: Literal["nominal", "degraded", "failed"] = "nominal"

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, table: Any) -> Any:
        return with_preset(table)


class FleetConfig(PartConfig):
    """A fleet and all that it flies with.

    Attributes
    ----------
    name, description : str
    duration_s, step_s : float
        Of the run and of the motion.
    architecture : str
        Who decides (3.1): each vehicle on the messages of the others (``distributed``), or a hub for all
        (``centralised``). The hub gathers the vehicles' messages and sends commands; delay, jitter and loss count on
        both ways, and an outage of everybody's messages is one of the hub. A vehicle without a fresh command follows
        its own guidance.
    decision_period_s : float or None
        Between decisions; None: at each step.
    seed : int
    vehicles : tuple of FleetVehicleConfig
        In order of their numbers: in a tie the lower climbs.
    controller : CasConfig
        A table may name a ``preset`` and changes to it.
    communication : CommunicationConfig
    rotorcraft : RotorcraftConfig
    """

    name: str = "fleet"
    description: str = ""
    duration_s: float = Field(default=60.0, gt=0, le=7200)
    step_s: float = Field(default=0.02, gt=0, le=0.5)
    architecture: Literal["distributed", "centralised"] = "distributed"
    decision_period_s: float | None = Field(default=None, gt=0, le=5)
    seed: int = Field(default=1, ge=0, lt=2**63)
    vehicles: tuple[FleetVehicleConfig, ...] = Field(min_length=2, max_length=100)
    controller: CasConfig = CasConfig()
    communication: CommunicationConfig = CommunicationConfig()
    rotorcraft: RotorcraftConfig = RotorcraftConfig()

    @property
    def controllers(self) -> tuple[CasConfig, ...]:
        """The controller of each vehicle: its own, else the fleet's."""
        return tuple(vehicle.controller or self.controller for vehicle in self.vehicles)

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, table: Any) -> Any:
        return with_preset(table)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        for name, period in (("decision_period_s", self.decision_period_s), ("period_s", self.communication.period_s)):
            steps = 1.0 if period is None else period / self.step_s
            if steps < 1 - 1e-9 or abs(steps - round(steps)) > 1e-6:
                raise ValueError(
                    f"{name} {period:g} is no multiple of step_s {self.step_s:g}: give one, or leave it out"
                )
        lost = self.communication.outage_vehicle
        if lost is not None and lost >= len(self.vehicles):
            raise ValueError(f"outage_vehicle {lost}: there are {len(self.vehicles)} vehicles, numbered from 0")
        if self.architecture == "centralised" and self.communication.hub:
            raise ValueError("communication.hub: a centralised fleet has a hub already; leave it out")
        return self


def with_preset(table: Any) -> Any:
    """Return a table with the ``preset`` of its controller written out.

    Raises
    ------
    ValueError
        If there is no such preset.
    """
    if not isinstance(table, dict) or not isinstance(table.get("controller"), dict):
        return table
    controller = dict(table["controller"])
    preset = controller.pop("preset", "default")
    if preset not in PRESETS:
        raise ValueError(f"controller.preset: there is no '{preset}' (known: {', '.join(PRESETS)})")
    return {**table, "controller": {**PRESETS[preset], **controller}}


def is_fleet(tables: Mapping[str, Any]) -> bool:
    """Return whether a scenario's tables are those of a fleet."""
    return "vehicles" in tables


def build_fleet(tables: dict[str, Any], source: str) -> FleetConfig:
    """Return the fleet of a scenario's tables; `source` names them in errors.

    Raises
    ------
    InputError
        If something in them is wrong, with all that is.
    """
    from wideberth.config import check_table
    from wideberth.config_errors import wrong_things

    wrong: list[str] = []
    config = check_table(FleetConfig, tables, "", wrong)
    if config is None:
        raise wrong_things(source, wrong)
    return config


def load_fleet(path: Path) -> FleetConfig:
    """Read a fleet from a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read or something in it is wrong, with all that is.
    """
    from wideberth.config import read_toml

    return build_fleet(read_toml(path), str(path))


def without_avoidance(tables: dict[str, Any]) -> None:
    """Disable the controller of every vehicle of a fleet's tables, in place."""
    vehicles = tables.get("vehicles")
    for table in (tables, *(vehicles if isinstance(vehicles, list) else ())):
        if isinstance(table, dict) and (table is tables or "controller" in table):
            controller = table.setdefault("controller", {})
            if isinstance(controller, dict):
                controller["disable"] = True
