"""The parts that a scenario chose: their classes, and whether they fit together."""

import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from wideberth import tracking

_KINDS = {"adsb": "ADS-B", "radar": "radar plots", "radar_cone": "plots of a line array"}


@dataclass(frozen=True, slots=True)
class Part:
    """A part that a table chose.

    Attributes
    ----------
    kind : str
        Its name in the folder's `PARTS`, or ``package.module:Class``.
    target : type
        The class itself.
    config : PartConfig
        Its checked settings, an instance of the class's `Config`.
    name : str
        What a sensor is called; empty for other parts.
    """

    kind: str
    target: type
    config: Any
    name: str = ""

    @property
    def default_name(self) -> str:
        """What a sensor is called that the scenario gives no name."""
        return str(getattr(self.target, "name", self.kind))

    @property
    def unit_names(self) -> tuple[str, ...]:
        """What the units of a sensor are called: a radar may have several."""
        names: Callable[[str], tuple[str, ...]] = getattr(self.config, "unit_names", lambda name: (name,))
        return names(self.name)

    @property
    def scan_kinds(self) -> frozenset[str]:
        """Which kinds of scan a sensor gives; none where it does not say."""
        if hasattr(self.config, "scan_kinds"):
            return frozenset(self.config.scan_kinds)
        kind = getattr(self.config, "scan_kind", None)
        return frozenset() if kind is None else frozenset({kind})

    @property
    def look_intervals(self) -> Mapping[str, float]:
        """How often each unit of a radar looks around, s, by name; empty for other sensors."""
        if hasattr(self.config, "unit_intervals"):
            intervals: Mapping[str, float] = self.config.unit_intervals(self.name)
            return intervals
        looks = hasattr(self.config, "update_interval_s") and any(kind.startswith("radar") for kind in self.scan_kinds)
        return dict.fromkeys(self.unit_names, self.config.update_interval_s) if looks else {}


def load_class(address: str) -> type | str:
    """Return the class at ``package.module:Class``, or what is wrong in words."""
    module_name, _, class_name = address.partition(":")
    try:
        target = getattr(importlib.import_module(module_name), class_name)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        return f"cannot load {address}: {error}"
    return target if isinstance(target, type) else f"{address} is not a class"


def heard_by(tracker: type | str) -> frozenset[str]:
    """Return which kinds of scan a tracker's class takes; none where it does not say."""
    return frozenset(getattr(tracker, "hears", ()))


def misfits(sensors: Mapping[str, Part], tracker: Part, recorded: bool) -> list[str]:
    """Return what does not fit together, in words: sensors with each other, the traffic and the tracker.

    Parameters
    ----------
    sensors : mapping of str to Part
        By their paths in the scenario.
    tracker : Part
    recorded : bool
        Whether the traffic is recorded or live, not simulated.

    Returns
    -------
    list of str
    """
    wrong = _same_names(sensors)
    for path, sensor in sensors.items():
        if sensor.kind == "adsb_receiver" and not recorded:
            wrong.append(
                f"{path}.kind: adsb_receiver needs recorded traffic; simulated traffic takes adsb, the error model"
            )
        elif recorded and getattr(sensor.config, "scan_kind", "adsb") != "adsb":
            wrong.append(f"{path}.kind: {sensor.kind} needs simulated traffic; recorded traffic takes adsb")
    if recorded and len(sensors) > 1:
        wrong.append("sensors: recorded traffic is heard by one receiver: leave one sensor")
    return wrong + _unheard(sensors.values(), tracker)


def input_misfits(inputs: Mapping[str, Part], tracker: Part) -> list[str]:
    """Return what does not fit together of a flight's inputs, by their paths in the scenario, and the tracker."""
    return _same_names(inputs) + _unheard(inputs.values(), tracker)


def _same_names(parts: Mapping[str, Part]) -> list[str]:
    """Return which sensors have a name that another has, in words."""
    wrong, names = list[str](), dict[str, str]()
    for path, part in parts.items():
        for name in part.unit_names:
            if name in names:
                wrong.append(f"{path}.name: {names[name]} is called '{name}' as well: give each its own name")
            names[name] = path
    return wrong


def _unheard(sensors: Iterable[Part], tracker: Part) -> list[str]:
    """Return what the tracker cannot hear, in words."""
    given = frozenset[str]().union(*(sensor.scan_kinds for sensor in sensors))
    # Settings may narrow or widen what the class hears.
    hears = getattr(tracker.config, "hears", None) or heard_by(tracker.target) or given
    if given <= hears:
        return []
    able = [name for name, address in tracking.PARTS.items() if given <= heard_by(load_class(address))]
    unheard = " and ".join(_KINDS.get(kind, kind) for kind in sorted(given - hears))
    return [
        f"tracker.kind: {tracker.kind} does not hear {unheard}: "
        + (f"take {' or '.join(able)}" if able else "no tracker hears all of these sensors, take one out")
    ]
