"""A scenario: one TOML file that names every part and sets it.

Each table is checked by the model of the part that its `kind` names; every wrong key is reported at once.
"""

import importlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field, ValidationError

from wideberth.config_errors import problems, unknown_key, wrong_things
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.live import AUTOPILOTS, INPUTS
from wideberth.part_config import PartConfig
from wideberth.parts import Part, input_misfits, load_class, misfits
from wideberth.simulation.config import (
    TRAFFIC,
    EvaluationConfig,
    MissionConfig,
    MonteCarloConfig,
    NavigationConfig,
    OriginConfig,
    PositionConfig,
    RandomTrafficConfig,
    RecordedTrafficConfig,
    SimulatedTrafficConfig,
    WindConfig,
)

# The folder that holds the parts of each table. A table without `kind` takes the folder's first part.
PART_FOLDERS: Mapping[str, str] = {
    "ownship": "vehicles",
    "sensor": "sensors",
    "tracker": "tracking",
    "detection": "conflict",
    "avoidance": "avoidance",
}
_LARGEST_FILE = 16_000_000
Checked = TypeVar("Checked", bound=PartConfig)


class _GeneralConfig(PartConfig):
    """The keys and tables that no part owns."""

    name: Annotated[str, Field(min_length=1)] = "scenario"
    description: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    duration_s: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    step_s: Annotated[float, Field(gt=0.0, le=10.0)] = 0.1
    avoid: bool = True
    origin: OriginConfig | None = None
    mission: MissionConfig | None = None
    wind: WindConfig = WindConfig()
    navigation: NavigationConfig = NavigationConfig()
    evaluation: EvaluationConfig = EvaluationConfig()
    montecarlo: MonteCarloConfig = MonteCarloConfig()


@dataclass(frozen=True, slots=True)
class ScenarioConfig:
    """A checked scenario.

    Attributes
    ----------
    name, description : str
    seed : int
    duration_s : float or None
        None: until the mission is complete.
    step_s : float
        Step of the pipeline.
    avoid : bool
        False: everything runs, but nothing is avoided.
    origin : OriginConfig or None
        None: the first point given by latitude and longitude, see `frame`.
    mission : MissionConfig or None
        None: to be given with the run.
    wind : WindConfig
    navigation : NavigationConfig
    evaluation : EvaluationConfig
    montecarlo : MonteCarloConfig
    traffic : SimulatedTrafficConfig, RandomTrafficConfig or RecordedTrafficConfig
    sensors : tuple of Part
        One at least, with names that differ; none only where there are inputs.
    ownship, tracker, detection, avoidance : Part
    autopilot : Part or None
        What a flight flies.
    inputs : tuple of Part
        What a flight has in place of the sensors, with names that differ.
    """

    name: str
    description: str
    seed: int
    duration_s: float | None
    step_s: float
    avoid: bool
    origin: OriginConfig | None
    mission: MissionConfig | None
    wind: WindConfig
    navigation: NavigationConfig
    evaluation: EvaluationConfig
    montecarlo: MonteCarloConfig
    traffic: SimulatedTrafficConfig | RandomTrafficConfig | RecordedTrafficConfig
    sensors: tuple[Part, ...]
    ownship: Part
    tracker: Part
    detection: Part
    avoidance: Part
    autopilot: Part | None = None
    inputs: tuple[Part, ...] = ()

    @property
    def sensor(self) -> Part:
        """The sensor of a scenario that has one, else the first."""
        return self.sensors[0]

    def frame(self) -> LocalFrame:
        """Return the local frame: about `origin`, else the first waypoint or intruder with a latitude and longitude.

        Raises
        ------
        InputError
            If there is none.
        """
        if self.origin is not None:
            return self.origin.frame()
        points: list[PositionConfig] = list(self.mission.waypoints) if self.mission else []
        if isinstance(self.traffic, SimulatedTrafficConfig):
            for intruder in self.traffic.intruders:
                points += [intruder.position] if intruder.position else intruder.waypoints
        for point in points:
            if point.lat_deg is not None and point.lon_deg is not None:
                return OriginConfig(lat_deg=point.lat_deg, lon_deg=point.lon_deg).frame()
        raise InputError("origin: missing; give [origin] lat_deg and lon_deg, as no waypoint has a latitude")

    def resolved(self) -> dict[str, Any]:
        """Return every setting, defaults included, as plain values that `build_scenario` and TOML take."""
        table: dict[str, Any] = {}
        for key in _GeneralConfig.model_fields:
            value = getattr(self, key)
            table[key] = _plain(value) if isinstance(value, PartConfig) else value
        kinds = {model: kind for kind, model in TRAFFIC.items()}
        table["traffic"] = {"kind": kinds[type(self.traffic)], **_plain(self.traffic)}
        for key in PART_FOLDERS:
            if key == "sensor":
                table |= _sensor_tables(self.sensors)
            else:
                part: Part = getattr(self, key)
                table[key] = {"kind": part.kind, **_plain(part.config)}
        if self.autopilot is not None:
            table["autopilot"] = _plain(self.autopilot.config) | {"kind": self.autopilot.kind}
        if self.inputs:
            table["inputs"] = [_plain(i.config) | {"kind": i.kind, "name": i.name} for i in self.inputs]
        return {k: v for k, v in table.items() if v is not None}


def _plain(config: PartConfig) -> dict[str, Any]:
    return config.model_dump(mode="json", exclude_none=True)


def _sensor_tables(sensors: Sequence[Part]) -> dict[str, Any]:
    if not sensors:
        return {}
    if len(sensors) == 1 and sensors[0].name == sensors[0].default_name:
        return {"sensor": {"kind": sensors[0].kind, **_plain(sensors[0].config)}}
    return {"sensors": [{"kind": s.kind, "name": s.name, **_plain(s.config)} for s in sensors]}


def read_toml(path: Path) -> dict[str, Any]:
    """Return the table of a TOML file.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read, or is not TOML.
    """
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: not a file")
        if path.stat().st_size > _LARGEST_FILE:
            raise InputError(f"{path}: too large for a scenario")
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file in UTF-8 (byte {error.start})") from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not valid TOML: {str(error) or 'nested too deeply'}") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None


def apply_override(tables: dict[str, Any], override: str) -> None:
    """Set one key of a scenario's tables in place.

    Parameters
    ----------
    tables : dict
    override : str
        ``table.key=value``; a number in the path picks an item of a list. The value is read as TOML, else is text.

    Raises
    ------
    InputError
        If there is no ``=``, or the path leads through something that is not a table.
    """
    path, equals, text = override.partition("=")
    keys = [k.strip() for k in path.split(".")]
    if not equals or not all(keys):
        raise InputError(f"--set {override}: write table.key=value")
    node: Any = tables
    for i, key in enumerate(keys):
        last = i == len(keys) - 1
        where = ".".join(keys[: i + 1])
        if isinstance(node, list):
            if not (key.isdecimal() and int(key) < len(node)):
                raise InputError(f"--set {override}: {where} does not exist, the list has {len(node)} items (from 0)")
            index: Any = int(key)
        elif isinstance(node, dict):
            index = key
            if not last:
                node.setdefault(key, {})
        else:
            raise InputError(f"--set {override}: {'.'.join(keys[:i])} is not a table")
        if last:
            node[index] = _parse_value(text.strip())
        else:
            node = node[index]


def value_at(tables: Mapping[str, Any], key: str) -> Any:
    """Return what stands at a path such as ``traffic.intruders.0.course_deg``.

    Raises
    ------
    InputError
        If there is nothing.
    """
    node: Any = tables
    for part in key.split("."):
        try:
            node = node[int(part)] if isinstance(node, list) else node[part]
        except (KeyError, IndexError, ValueError, TypeError):
            raise InputError(f"{key}: the scenario gives no value there") from None
    return node


def _parse_value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError, ValueError):
        return text
    return parsed["value"] if parsed.keys() == {"value"} else text


def load_scenario(path: Path, overrides: Sequence[str] = ()) -> ScenarioConfig:
    """Read and check a scenario.

    Parameters
    ----------
    path : Path
        A TOML file; a relative path in its `traffic` table is relative to it.
    overrides : sequence of str
        ``table.key=value`` each, applied in order before the check.

    Raises
    ------
    InputError
        With one line for each thing that is wrong.
    """
    path = Path(path)
    tables = read_toml(path)
    for override in overrides:
        apply_override(tables, override)
    return build_scenario(tables, source=str(path), folder=path.parent)


def build_scenario(tables: Mapping[str, Any], source: str = "scenario", folder: Path | None = None) -> ScenarioConfig:
    """Check a scenario's tables.

    Parameters
    ----------
    tables : mapping
        As read from TOML, or from `ScenarioConfig.resolved`.
    source : str
        What to call it in messages.
    folder : Path or None
        What a relative path of recorded traffic is relative to; None: it is left as it is.

    Raises
    ------
    InputError
        With one line for each thing that is wrong.
    """
    wrong: list[str] = []
    known = {*_GeneralConfig.model_fields, *PART_FOLDERS, "sensors", "traffic", "autopilot", "inputs"}
    general = check_table(
        _GeneralConfig, {k: v for k, v in tables.items() if k in _GeneralConfig.model_fields}, "", wrong
    )
    wrong += [f"{k}: {unknown_key(k, v, known)}" for k, v in tables.items() if k not in known]
    traffic = _traffic(tables.get("traffic", {}), folder, wrong)
    recorded = isinstance(traffic, RecordedTrafficConfig)
    inputs = _inputs(tables.get("inputs", []), wrong)
    flown_only = bool(inputs) and "sensor" not in tables and "sensors" not in tables
    sensors = {} if flown_only else _sensors(tables, recorded, wrong)
    parts: dict[str, Any] = {
        key: _part(_known_parts(key), key, tables.get(key, {}), wrong) for key in PART_FOLDERS if key != "sensor"
    }
    if "autopilot" in tables:
        parts["autopilot"] = _part(AUTOPILOTS, "autopilot", tables["autopilot"], wrong)
    if traffic and not wrong:
        wrong += misfits(sensors, parts["tracker"], recorded) + input_misfits(inputs, parts["tracker"])
    if wrong or general is None or traffic is None:
        raise wrong_things(source, wrong)
    settings: dict[str, Any] = {key: getattr(general, key) for key in _GeneralConfig.model_fields}
    parts |= {"sensors": tuple(sensors.values()), "inputs": tuple(inputs.values())}
    return ScenarioConfig(**settings, **parts, traffic=traffic)


def check_table(model: type[Checked], table: dict[str, Any], prefix: str, wrong: list[str]) -> Checked | None:
    """Return a table as its model; None where it is wrong, with a line for each mistake added to `wrong`."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        wrong += problems(error, model, table, prefix)
        return None


def _kind(key: str, table: object, default: str, wrong: list[str]) -> tuple[str, dict[str, Any]] | None:
    if not isinstance(table, Mapping):
        wrong.append(f"{key}: must be a table, not {table!r:.60}")
        return None
    kind = table.get("kind", default)
    if not isinstance(kind, str):
        wrong.append(f"{key}.kind: must be a text, not {kind!r:.60}")
        return None
    return kind, {k: v for k, v in table.items() if k != "kind"}


def _traffic(
    table: object, folder: Path | None, wrong: list[str]
) -> SimulatedTrafficConfig | RandomTrafficConfig | RecordedTrafficConfig | None:
    chosen = _kind("traffic", table, "simulated", wrong)
    if chosen is None:
        return None
    kind, settings = chosen
    if kind not in TRAFFIC:
        wrong.append(f"traffic.kind: there is no '{kind}' (known: {', '.join(TRAFFIC)})")
        return None
    config = check_table(TRAFFIC[kind], settings, "traffic", wrong)
    if isinstance(config, RecordedTrafficConfig):
        is_file = config.path is not None and config.path != "-" and "://" not in config.path
        if is_file and folder is not None:
            return config.model_copy(update={"path": str(folder / str(config.path))})
        return config
    return config if isinstance(config, SimulatedTrafficConfig | RandomTrafficConfig) else None


def _sensors(tables: Mapping[str, Any], recorded: bool, wrong: list[str]) -> dict[str, Part]:
    """Return the sensors of `[sensor]` or `[[sensors]]` by their paths in the file."""
    if "sensors" not in tables:
        listed = [("sensor", tables.get("sensor", {}))]
    elif "sensor" in tables:
        wrong.append("sensor: there is a list of sensors as well: make this table one more [[sensors]]")
        return {}
    elif not isinstance(tables["sensors"], list) or not tables["sensors"]:
        wrong.append("sensors: must be a list with a table for each sensor: write [[sensors]] above each")
        return {}
    else:
        listed = [(f"sensors.{k}", table) for k, table in enumerate(tables["sensors"])]
    sensors: dict[str, Part] = {}
    for path, table in listed:
        given, name = _named(path, table, wrong) if path != "sensor" else (table, None)
        # ADS-B is an error model for simulated traffic, and a receiver for recorded traffic.
        if recorded and isinstance(given, Mapping) and given.get("kind", "adsb") == "adsb":
            given = {**given, "kind": "adsb_receiver"}
        part = _part(_known_parts("sensor"), path, given, wrong)
        if part is not None:
            sensors[path] = replace(part, name=name or part.default_name)
    return sensors


def _named(path: str, table: object, wrong: list[str]) -> tuple[object, str | None]:
    """Return a table of a list without its name, and the name, if it has one."""
    if not isinstance(table, Mapping):
        return table, None
    name = table.get("name")
    if name is not None and not (isinstance(name, str) and name):
        wrong.append(f"{path}.name: must be a text, not {name!r:.60}")
    return {k: v for k, v in table.items() if k != "name"}, name


def _inputs(listed: object, wrong: list[str]) -> dict[str, Part]:
    """Return the inputs of `[[inputs]]` by their paths in the file."""
    if not isinstance(listed, list):
        wrong.append("inputs: must be a list with a table for each input: write [[inputs]] above each")
        return {}
    inputs: dict[str, Part] = {}
    for k, table in enumerate(listed):
        given, name = _named(f"inputs.{k}", table, wrong)
        part = _part(INPUTS, f"inputs.{k}", given, wrong)
        if part is not None:
            inputs[f"inputs.{k}"] = replace(part, name=name or part.kind)
    return inputs


def _known_parts(key: str) -> Mapping[str, str]:
    """Return the parts of the folder of a table."""
    folder = importlib.import_module(f"wideberth.{PART_FOLDERS[key]}")
    parts: Mapping[str, str] = getattr(folder, "PARTS", {})
    return parts


def _part(parts: Mapping[str, str], path: str, table: object, wrong: list[str]) -> Part | None:
    """Return which of the parts a table chooses; `path` is where the table stands in the file."""
    chosen = _kind(path, table, next(iter(parts), ""), wrong)
    if chosen is None:
        return None
    kind, settings = chosen
    if kind not in parts and ":" not in kind:
        known = ", ".join(parts) or "none yet"
        wrong.append(f"{path}.kind: there is no '{kind}' (known: {known}; package.module:Class is taken as well)")
        return None
    target = load_class(parts.get(kind, kind))
    if isinstance(target, str):
        wrong.append(f"{path}.kind: {target}")
        return None
    model = target if issubclass(target, PartConfig) else getattr(target, "Config", None)
    if not (isinstance(model, type) and issubclass(model, PartConfig)):
        wrong.append(f"{path}.kind: {kind} has no configuration model (a class attribute Config)")
        return None
    config = check_table(model, settings, path, wrong)
    return None if config is None else Part(kind, target, config)
