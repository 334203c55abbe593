"""Wrong keys of a scenario in words: where, what, and what to write instead."""

import difflib
from collections.abc import Iterable, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wideberth.errors import InputError
from wideberth.units import UNITS, parse_quantity

# Unit suffixes of keys, and the same unit in `units.UNITS`; those without a second name are not converted.
_SUFFIXES: dict[str, str] = {
    "m": "m",
    "km": "km",
    "ft": "ft",
    "nmi": "nmi",
    "nm": "nmi",
    "mps": "m/s",
    "kmh": "km/h",
    "kt": "kt",
    "kn": "kt",
    "ft_per_min": "ft/min",
    "fpm": "ft/min",
    "ft_per_s": "ft/s",
    "fps": "ft/s",
    "deg": "deg",
    "rad": "rad",
    "deg_s": "deg/s",
    "deg_per_s": "deg/s",
    "rad_s": "rad/s",
    "rad_per_s": "rad/s",
    "s": "s",
    "ms": "ms",
    "min": "min",
    "h": "h",
    "hz": "",
    "khz": "",
    "mhz": "",
    "ghz": "",
    "w": "",
    "mw": "",
    "db": "",
    "dbi": "",
    "mps2": "",
    "mps3": "",
    "g": "",
}
_DIMENSION = {unit: dimension for dimension, units in UNITS.items() for unit in units}


def wrong_things(source: str, wrong: Sequence[str]) -> InputError:
    """Return the error that says all that is wrong with a file, a line each."""
    head = f"{source}: " if len(wrong) == 1 else f"{source}: {len(wrong)} things are wrong\n  "
    return InputError(head + "\n  ".join(wrong))


def split_unit(key: str) -> tuple[str, str | None]:
    """Return the name and the unit suffix of a key: ``range_max_km`` is ``("range_max", "km")``."""
    for suffix in sorted(_SUFFIXES, key=len, reverse=True):
        if key.endswith("_" + suffix):
            return key[: -len(suffix) - 1], suffix
    return key, None


def unknown_key(key: str, value: object, known: Iterable[str]) -> str:
    """Return what is wrong with a key that is not one of the known ones, and which was meant."""
    known = sorted(known)
    name, suffix = split_unit(key)
    for other in known:
        other_name, other_suffix = split_unit(other)
        if other_name == name and other_suffix != suffix:
            if suffix is None:
                return f"the unit is missing from the key: write {other}"
            return f"wrong unit: write {other}{_converted(value, suffix, other_suffix)}, not {key}"
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    if close:
        return f"unknown key: did you mean {close[0]}?"
    return f"unknown key (known: {', '.join(known)})" if known else "unknown key: this table takes none"


def _converted(value: object, suffix: str, wanted: str | None) -> str:
    unit, other = _SUFFIXES[suffix], _SUFFIXES.get(wanted or "", "")
    dimension = _DIMENSION.get(unit)
    if dimension is None or dimension != _DIMENSION.get(other) or isinstance(value, bool):
        return ""
    if not isinstance(value, int | float):
        return ""
    return f" = {float(value) * UNITS[dimension][unit] / UNITS[dimension][other]:.6g}"


def _not_a_number(key: str, value: object) -> str:
    _, suffix = split_unit(key)
    unit = _SUFFIXES.get(suffix or "", "")
    message = f"must be a number{f' in {unit}' if unit else ''}, not {_shown(value)}"
    if unit and isinstance(value, str):
        dimension = _DIMENSION[unit]
        try:
            number = parse_quantity(value, dimension) / UNITS[dimension][unit]
        except ValueError:
            return message
        return f"{message}: write {number:.6g}"
    return message


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _models_in(annotation: Any) -> set[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {annotation}
    return set().union(*(_models_in(a) for a in get_args(annotation)))


def _known_keys(model: type[BaseModel], location: Sequence[int | str]) -> set[str]:
    models = {model}
    for key in location:
        fields = [m.model_fields[key] for m in models if isinstance(key, str) and key in m.model_fields]
        models = set().union(*(_models_in(f.annotation) for f in fields)) or models
    return {name for m in models for name in m.model_fields}


def _path(data: Any, location: Sequence[int | str], *, missing: bool) -> list[str]:
    # Pydantic puts the names of union members into the location; only what stands in the data is a key.
    path = []
    for i, key in enumerate(location):
        in_list = isinstance(data, list | tuple) and isinstance(key, int) and key < len(data)
        if in_list or (isinstance(data, dict) and key in data):
            data = data[key]
        elif not (missing and i == len(location) - 1):
            continue
        path.append(str(key))
    return path


def _words(error: ErrorDetails, model: type[BaseModel]) -> str:
    location, kind, value = error["loc"], error["type"], error["input"]
    key = str(location[-1]) if location else ""
    if kind == "extra_forbidden":
        return unknown_key(key, value, _known_keys(model, location[:-1]))
    if kind == "missing":
        return "missing"
    if kind == "too_short":
        return f"needs at least {error['ctx']['min_length']} items, not {error['ctx']['actual_length']}"
    if kind in {"float_type", "float_parsing", "int_type", "int_parsing"}:
        return _not_a_number(key, value)
    if kind == "value_error":
        return error["msg"].removeprefix("Value error, ")
    return f"{error['msg'].replace('Input should be', 'must be').replace('Input should', 'must')}, not {_shown(value)}"


def problems(error: ValidationError, model: type[BaseModel], data: Any, prefix: str = "") -> list[str]:
    """Return one line for each wrong key: its dotted path and what to do.

    Parameters
    ----------
    error : pydantic.ValidationError
    model : type
        The model that refused.
    data : object
        The table that it refused.
    prefix : str
        The path of the table in the scenario.
    """
    lines = []
    details = error.errors(include_url=False)
    # A key in the wrong unit is one mistake: do not also call the right key missing.
    misspelt = {
        (e["loc"][:-1], split_unit(str(e["loc"][-1]))[0])
        for e in details
        if e["type"] == "extra_forbidden" and e["loc"]
    }
    for e in details:
        if e["type"] == "missing" and (e["loc"][:-1], split_unit(str(e["loc"][-1]))[0]) in misspelt:
            continue
        if e["type"] == "too_short" and any(o is not e and o["loc"][: len(e["loc"])] == e["loc"] for o in details):
            continue  # the items that are there were refused for their own reasons
        path = [p for p in (prefix, *_path(data, e["loc"], missing=e["type"] == "missing")) if p]
        lines.append(f"{'.'.join(path) or 'scenario'}: {_words(e, model)}")
    return lines
