"""Figures 2.7 to 2.12 of the thesis (section 2.2), as sweeps: what each changes, and what stays fixed.

The thesis prints the nominal values (table 2.3), and those, the levels and the axis of figure 2.12. The levels and axes
of the other figures are not in its text: they are chosen here, and listed as such among the inputs.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from wideberth.analysis.cpa_simulation import relative_range
from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, METHODS, SELF_SEPARATION
from wideberth.analysis.inputs import DOMAINS
from wideberth.analysis.range_samples import Mark, sample
from wideberth.analysis.range_sweep import SI_UNITS, SYMBOLS, Curve, Input, Panel, Sweep, words
from wideberth.argument_checks import FloatArray, checked
from wideberth.units import DEGREE, KNOT

_ALL = tuple(METHODS)
_POINTS = 201
_TABLE_2_3 = "table 2.3"
_TEXT_2_12 = "section 2.2, on figure 2.12"
_CHOSEN = "chosen; the thesis's text does not say"
_GIVEN = "given"
# Factors on the nominal values, which are those of one level: the common one of all panels.
_LEVELS: tuple[tuple[str, str, Mapping[str, tuple[float, ...]]], ...] = (
    ("a", "roll dynamics", {"max_bank_rate": (1.0, 1.5, 2.0, 4.0), "roll_time_constant": (1.0, 0.6, 0.4, 0.2)}),
    ("b", "intruder speed", {"intruder_speed": (0.0, 1.0, 2.0)}),
    ("c", "safety radius", {"safety_radius": (0.5, 1.0, 2.0)}),
    ("d", "largest bank angle", {"max_bank": (0.5, 1.0, 1.5)}),
    ("e", "computation time", {"computation_time": (0.4, 1.0, 2.0)}),
    ("f", "turn angle", {"turn_angle": (1 / 3, 2 / 3, 1.0)}),
)
_SELF_SEPARATION_SPEEDS = tuple(speed * KNOT for speed in (250.0, 500.0, 750.0, 1000.0, 1250.0))


@dataclass(frozen=True, slots=True)
class _Asked:
    """What the user asked for: arguments of the ranges, and the interval where it is not the default."""

    given: Mapping[str, float]
    interval: tuple[float | None, float | None]
    points: int

    def fixed(self, defaults: Mapping[str, float], **more: float) -> dict[str, float]:
        return {**defaults, **more, **{k: v for k, v in self.given.items() if k in defaults or k in more}}

    def axis(self, start: float, stop: float) -> FloatArray:
        low, high = (
            chosen if asked is None else asked for asked, chosen in zip(self.interval, (start, stop), strict=True)
        )
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueError(f"the interval from {low:g} to {high:g} (SI) is empty: its end must be above its start")
        return np.linspace(low, high, self.points)


@dataclass(frozen=True, slots=True)
class Figure:
    """How a figure is made.

    Attributes
    ----------
    title : str
    swept : str or None
        The argument of the ranges that it sweeps, so that it cannot be given too.
    dimension : str
        Of the interval: a key of `units.UNITS`.
    make : callable
    """

    title: str
    swept: str | None
    dimension: str
    make: Callable[["Figure", str, _Asked], Sweep] = field(repr=False)


def sweep(
    name: str,
    given: Mapping[str, float] | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
    points: int = _POINTS,
) -> Sweep:
    """Return the numbers of a figure.

    Parameters
    ----------
    name : str
        Key of `FIGURES`, such as ``"2.7"``.
    given : mapping of str to float, optional
        Arguments of `minimum_detection_range` that are not to be the thesis's, SI. Levels are multiples of theirs.
    start, stop : float, optional
        Of the swept quantity, SI; else as in the thesis, or chosen.
    points : int
        How many to compute, at least 2.

    Returns
    -------
    Sweep
        With gaps where a method has no answer.

    Raises
    ------
    ValueError
        If the name is not known, an argument is out of its range or is the one that is swept, the interval is empty, or
        no method has an answer anywhere.
    """
    if name not in FIGURES:
        raise ValueError(f"there is no sweep {name!r}; there are {', '.join(FIGURES)}")
    if points < 2:
        raise ValueError(f"points must be at least 2, got {points}")
    figure, arguments = FIGURES[name], dict(given or {})
    for argument, value in arguments.items():
        if argument not in SYMBOLS:
            raise ValueError(f"{argument} is no argument of the detection range")
        checked(argument, value, DOMAINS[argument])
    if figure.swept in arguments:
        raise ValueError(f"{figure.swept} is what {name} sweeps: give its interval")
    made = figure.make(figure, name, _Asked(arguments, (start, stop), points))
    if not any(np.isfinite(curve.values[panel.y]).any() for panel in made.panels for curve in panel.curves):
        raise ValueError(f"no method has an answer anywhere: {made.gaps[0][2].reason}")
    return replace(made, changed=bool(arguments) or start is not None or stop is not None or points < _POINTS)


def _curves(
    methods: Sequence[str],
    levels: Sequence[tuple[str, bool, Mapping[str, float]]],
    x: FloatArray,
    swept: Callable[[Mapping[str, float]], Mapping[str, FloatArray]],
) -> tuple[Curve, ...]:
    """Return a curve for each method and level; `swept` gives the changing arguments from the fixed ones."""
    curves = []
    for level, nominal, fixed in levels:
        changing = swept(fixed)
        kept = {name: value for name, value in fixed.items() if name not in changing}
        for method, found in sample(methods, x, changing, kept).items():
            curves.append(
                Curve(method, level, nominal, kept, changing, x, found.values, found.case, found.gaps, found.changes)
            )
    return tuple(curves)


def _levels(
    fixed: Mapping[str, float], factors: Mapping[str, tuple[float, ...]]
) -> list[tuple[str, bool, Mapping[str, float]]]:
    levels: dict[str, tuple[str, bool, Mapping[str, float]]] = {}
    for chosen in zip(*factors.values(), strict=True):
        changes = {name: fixed[name] * factor for name, factor in zip(factors, chosen, strict=True)}
        told = ", ".join(words(name, value) for name, value in changes.items())
        levels.setdefault(told, (told, all(factor == 1.0 for factor in chosen), {**fixed, **changes}))
    return list(levels.values())


def _against_speed(
    quantity: str, methods: Sequence[str], first: Sequence[str]
) -> Callable[[Figure, str, _Asked], Sweep]:
    """Return the maker of a figure with a panel for each parameter, against the ownship's speed."""

    def make(figure: Figure, name: str, asked: _Asked) -> Sweep:
        fixed = asked.fixed(COLLISION_AVOIDANCE)
        x = asked.axis(0.0, 200.0 * KNOT)
        panels, inputs = [], _inputs("", fixed, asked, _TABLE_2_3)
        inputs.append(_interval("", "ownship_speed", x, asked, _CHOSEN))
        for letter, title, factors in _LEVELS:
            if letter == "a" and not first:
                continue
            levels = _levels(fixed, factors)
            chosen = first if letter == "a" else methods
            curves = _curves(chosen, levels, x, lambda _: {"ownship_speed": x})
            panels.append(Panel(letter, title, "ownship_speed", quantity, curves))
            inputs.append(_level_input(letter, tuple(factors), levels, _CHOSEN))
        return Sweep(name, figure.title, tuple(panels), tuple(inputs))

    return make


def _level_input(
    letter: str, names: Sequence[str], levels: Sequence[tuple[str, bool, Mapping[str, float]]], source: str
) -> Input:
    told = f"levels of {' and '.join(name.replace('_', ' ') for name in names)}"
    values = tuple(level[2][name] for level in levels for name in names)
    return _input(letter, told, "; ".join(level[0] for level in levels), values, names, source)


def _input(
    panels: str, told: str, in_words: str, values: tuple[float, ...], names: Sequence[str], source: str
) -> Input:
    units = dict.fromkeys(SI_UNITS[SYMBOLS[name][1]] if name in SYMBOLS else "s" for name in names)
    return Input(panels, told, in_words, values, ", ".join(units), source)


def _error(figure: Figure, name: str, asked: _Asked) -> Sweep:
    """Return figure 2.10, whose first panel is against the roll dynamics, at one speed of the ownship."""
    rest = replace(asked, given={k: v for k, v in asked.given.items() if k != "ownship_speed"})
    others = _against_speed("error", ("gvv", "tt", "gt"), ())(figure, name, rest)
    fixed = asked.fixed(COLLISION_AVOIDANCE, ownship_speed=150.0 * KNOT)
    x = np.linspace(0.0, 1.0 / (30.0 * DEGREE), asked.points)
    with np.errstate(divide="ignore"):
        rates = 1.0 / x
    levels = [
        (words("roll_time_constant", tau), tau == 0.5, {**fixed, "roll_time_constant": tau})
        for tau in (0.0, 0.25, 0.5, 0.75, 1.0)
    ]
    curves = _curves(("gvv",), levels, x, lambda _: {"max_bank_rate": rates})
    speed, where = fixed["ownship_speed"], "section 2.2, on figure 2.10(a)"
    speed_source = _GIVEN if "ownship_speed" in asked.given else where
    rolls = (30.0 * DEGREE, math.inf)
    inputs = (
        *others.inputs,
        _input("a", "ownship speed", words("ownship_speed", speed), (speed,), ("ownship_speed",), speed_source),
        _input("a", "swept: max bank rate", "30 deg/s to infinite", rolls, ("max_bank_rate",), where),
        _level_input("a", ("roll_time_constant",), levels, f"{where}: 0 to 1 s; levels chosen"),
    )
    title = f"roll dynamics at {words('ownship_speed', speed)}, levels of τ"
    panel = Panel("a", title, "inverse_bank_rate", "error", curves)
    return replace(others, panels=(panel, *others.panels), inputs=inputs)


def _relative_range(figure: Figure, name: str, asked: _Asked) -> Sweep:
    """Return figure 2.8: one encounter from each method's distance."""
    fixed = asked.fixed(COLLISION_AVOIDANCE, ownship_speed=25.0 * KNOT)
    flown = {key: value for key, value in fixed.items() if key != "safety_radius"}
    one = np.array([fixed["ownship_speed"]])
    found = sample(_ALL, one, {"ownship_speed": one}, {k: v for k, v in fixed.items() if k != "ownship_speed"})
    closest = [float(s.values["t_cpa"][0]) for s in found.values()]
    t = asked.axis(0.0, 5.0 * math.ceil(0.25 * max(1.0, np.nanmax(closest, initial=0.0))))
    checked("time", t[0], DOMAINS["computation_time"])
    curves = []
    for method, samples in found.items():
        distance, cpa, t_cpa = (float(samples.values[key][0]) for key in ("distance", "cpa", "t_cpa"))
        case, arguments = np.full(len(t), samples.case[0]), {**fixed, "distance": distance}
        if math.isnan(distance):
            gap = replace(samples.gaps[0], first=float(t[0]), last=float(t[-1]), count=len(t), missing=("range",))
            values = {"range": np.full(len(t), np.nan)}
            curves.append(Curve(method, "", True, fixed, {}, t, values, case, (gap,)))
            continue
        marks = (Mark(t_cpa, cpa, "closest approach"),) if t[0] <= t_cpa <= t[-1] else ()
        values = {"range": relative_range(t, distance, **flown)}
        curves.append(Curve(method, "", True, arguments, {}, t, values, case, (), marks))
    inputs = _inputs("", fixed, asked, _TABLE_2_3, ownship_speed="section 2.2, on figure 2.8")
    inputs.append(_interval("", "time", t, asked, _CHOSEN))
    return Sweep(name, figure.title, (Panel("", "", "time", "range", tuple(curves)),), tuple(inputs))


def _self_separation(figure: Figure, name: str, asked: _Asked) -> Sweep:
    """Return figure 2.12."""
    fixed = asked.fixed(SELF_SEPARATION)
    speeds = (asked.given["intruder_speed"],) if "intruder_speed" in asked.given else _SELF_SEPARATION_SPEEDS
    x = asked.axis(0.0, 1250.0 * KNOT)
    levels = [(words("intruder_speed", v), False, {**fixed, "intruder_speed": v}) for v in speeds]
    curves = _curves(_ALL, levels, x, lambda _: {"ownship_speed": x})
    others = tuple(curve for curve in curves if curve.method != "tgvv")
    panels = tuple(
        Panel(letter, title, "ownship_speed", quantity, others if quantity == "error" else curves, "nmi")
        for letter, title, quantity in (
            ("a", "minimum detection range", "distance"),
            ("b", "closest approach", "cpa"),
            ("c", "error against TGVV", "error"),
            ("d", "time to maneuver", "maneuver_time"),
        )
    )  # fmt: skip
    source = _GIVEN if "intruder_speed" in asked.given else _TEXT_2_12
    inputs = _inputs("", fixed, asked, _TEXT_2_12, unit="nmi")
    inputs += [
        _level_input("", ("intruder_speed",), levels, source),
        _interval("", "ownship_speed", x, asked, _TEXT_2_12),
    ]
    return Sweep(name, figure.title, panels, tuple(inputs))


def _pilot_delay(figure: Figure, name: str, asked: _Asked) -> Sweep:
    """Return how a pilot's delay lengthens the range, in both sets of arguments."""
    delay = asked.axis(0.0, 30.0)
    panels, inputs = [], [_interval("", "pilot_delay", delay, asked, _CHOSEN)]
    without = "table 2.3; the 20 s of figure 2.12 are then 15 s of delay"
    for letter, title, defaults, source, own_speed, others in (
        ("a", "collision avoidance", COLLISION_AVOIDANCE, _TABLE_2_3, 25.0, (50.0, 150.0, 300.0)),
        ("b", "self-separation", SELF_SEPARATION, _TEXT_2_12, 250.0, (250.0, 750.0, 1250.0)),
    ):
        base = {**defaults, "computation_time": COLLISION_AVOIDANCE["computation_time"]}
        base.pop("intruder_speed", None)
        fixed = asked.fixed(base, ownship_speed=own_speed * KNOT)
        speeds = [asked.given["intruder_speed"]] if "intruder_speed" in asked.given else [v * KNOT for v in others]
        levels = [
            (words("intruder_speed", v), v == speeds[len(speeds) // 2], {**fixed, "intruder_speed": v}) for v in speeds
        ]
        curves = _curves(_ALL, levels, delay, lambda fixed: {"computation_time": fixed["computation_time"] + delay})
        unit = "nmi" if letter == "b" else "ft"
        panels.append(Panel(letter, title, "pilot_delay", "distance", curves, unit))
        inputs += _inputs(letter, fixed, asked, source, unit=unit, ownship_speed=_CHOSEN, computation_time=without)
        inputs.append(
            _level_input(letter, ("intruder_speed",), levels, _GIVEN if "intruder_speed" in asked.given else _CHOSEN)
        )
    return Sweep(name, figure.title, tuple(panels), tuple(inputs))


def _inputs(
    panels: str, fixed: Mapping[str, float], asked: _Asked, source: str, unit: str = "ft", **sources: str
) -> list[Input]:
    return [
        _input(
            panels, name.replace("_", " "), f"{SYMBOLS[name][0]} = {words(name, value, unit)}", (value,), (name,),
            _GIVEN if name in asked.given else sources.get(name, source),
        )
        for name, value in sorted(fixed.items(), key=lambda item: list(SYMBOLS).index(item[0]))
    ]  # fmt: skip


def _interval(panels: str, name: str, x: FloatArray, asked: _Asked, source: str) -> Input:
    unit, factor = SYMBOLS[name][1:] if name in SYMBOLS else ("s", 1.0)
    told = f"{x[0] / factor:g} to {x[-1] / factor:g} {unit}, {len(x)} points"
    given = any(end is not None for end in asked.interval)
    ends = float(x[0]), float(x[-1])
    return _input(panels, f"swept: {name.replace('_', ' ')}", told, ends, (name,), _GIVEN if given else source)


_SPEED: dict[str, Any] = {"swept": "ownship_speed", "dimension": "speed"}
FIGURES: Mapping[str, Figure] = MappingProxyType(
    {
        "2.7": Figure("Minimum detection range", make=_against_speed("distance", _ALL, ("tgvv", "gvv")), **_SPEED),
        "2.8": Figure("Relative range and the closest approach", None, "time", _relative_range),
        "2.9": Figure("Closest approach that each range leads to", make=_against_speed("cpa", _ALL, _ALL), **_SPEED),
        "2.10": Figure("Error of the range against TGVV", None, "speed", _error),
        "2.11": Figure("Time to maneuver", make=_against_speed("maneuver_time", _ALL, ("tgvv", "gvv")), **_SPEED),
        "2.12": Figure("Self-separation", make=_self_separation, **_SPEED),
        "pilot-delay": Figure("Minimum detection range with a pilot's delay", None, "time", _pilot_delay),
    }
)
"""The figures by number, and what a pilot's delay costs, which section 2.2 gives no figure of."""
