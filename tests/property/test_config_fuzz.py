"""Configurations survive the way through TOML, and no input brings a traceback."""

import contextlib
import string
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tests.unit.test_config import OUTSIDER, PARTS
from wideberth.config import ScenarioConfig, apply_override, build_scenario, load_scenario
from wideberth.errors import InputError
from wideberth.toml_text import to_toml

number = st.floats(allow_nan=False, allow_infinity=False)
keys = st.text(min_size=1, max_size=8)
scalars = st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=20))
values = st.recursive(
    scalars, lambda s: st.one_of(st.lists(s, max_size=4), st.dictionaries(keys, s, max_size=4)), max_leaves=12
)
words = st.text(st.characters(codec="utf-8", categories=["L", "N", "Z", "P"]), min_size=1, max_size=20)


@given(st.dictionaries(keys, values, max_size=6))
def test_toml_reads_back_as_the_same_table(table: dict[str, Any]) -> None:
    assert tomllib.loads(to_toml(table)) == table


def place(point: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(point.get(key) for key in ("lat_deg", "lon_deg", "north_m", "east_m"))


def missions() -> st.SearchStrategy[list[dict[str, Any]]]:
    # A mission at one place is refused: tests/scenario/test_faults.py.
    return st.lists(positions(), min_size=2, max_size=4, unique_by=place)


def positions() -> st.SearchStrategy[dict[str, Any]]:
    altitude = st.floats(-100, 20_000)
    geodetic = st.fixed_dictionaries(
        {"lat_deg": st.floats(-90, 90), "lon_deg": st.floats(-180, 180), "altitude_m": altitude}
    )
    local = st.fixed_dictionaries(
        {"north_m": st.floats(-1e5, 1e5), "east_m": st.floats(-1e5, 1e5), "altitude_m": altitude}
    )
    return geodetic | local


speeds = st.floats(0.1, 300)
intruders = st.lists(
    st.fixed_dictionaries(
        {
            "address": st.text(string.hexdigits, min_size=6, max_size=6),
            "position": positions(),
            "course_deg": st.floats(-360, 360),
            "speed_mps": speeds,
        },
        optional={"callsign": words, "climb_rate_mps": st.floats(-50, 50)},
    ),
    max_size=3,
    unique_by=lambda i: str(i["address"]).lower(),
)
scenarios = st.fixed_dictionaries(
    {
        **{key: st.just(table) for key, table in PARTS.items()},
        "tracker": st.fixed_dictionaries(
            {"kind": st.just(OUTSIDER)}, optional={"range_max_m": number, "count": st.integers(), "mode": words}
        ),
    },
    optional={
        "name": words,
        "description": st.text(st.characters(codec="utf-8"), max_size=20),
        "seed": st.integers(0, 2**63 - 1),
        "duration_s": st.floats(0.1, 1e5),
        "step_s": st.floats(0.01, 1),
        "origin": st.fixed_dictionaries({"lat_deg": st.floats(-90, 90), "lon_deg": st.floats(-180, 180)}),
        "mission": st.fixed_dictionaries({"speed_mps": speeds, "waypoints": missions()}),
        "wind": st.fixed_dictionaries({}, optional={"north_mps": st.floats(-50, 50), "up_mps": st.floats(-5, 5)}),
        "evaluation": st.fixed_dictionaries(
            {},
            optional={
                "well_clear_volume": st.sampled_from(["sarp", "nmac"]),
                "collision_volume": st.just("sarp")
                | st.fixed_dictionaries({"radius_m": st.floats(1, 500), "half_height_m": st.floats(1, 500)}),
                "horizontal_miss_filter": st.booleans(),
            },
        ),
        "traffic": st.fixed_dictionaries({"intruders": intruders})
        | st.fixed_dictionaries(
            {"kind": st.just("recorded")}, optional={"path": st.just("sbs://a:1"), "max_gap_s": speeds}
        ),
    },
)


@given(scenarios)
def test_resolved_configuration_reads_back_as_the_same_scenario(tables: dict[str, Any]) -> None:
    built = build_scenario(tables)
    again = build_scenario(tomllib.loads(to_toml(built.resolved())))
    assert again == built
    assert again.resolved() == built.resolved()


def load_bytes(content: bytes, overrides: list[str]) -> ScenarioConfig | None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scenario.toml"
        path.write_bytes(content)
        with contextlib.suppress(InputError):
            return load_scenario(path, overrides)
    return None


@given(st.binary(max_size=200))
def test_random_bytes_are_refused_in_words(content: bytes) -> None:
    built = load_bytes(content, [])
    assert built is None or isinstance(built, ScenarioConfig)


@given(
    st.dictionaries(
        st.sampled_from(["name", "seed", "mission", "traffic", "wind", "tracker", "origin", "evaluation"]) | keys,
        values | st.dictionaries(st.sampled_from(["kind", "waypoints", "intruders", "lat_deg", "path"]), values),
        max_size=5,
    ),
    st.lists(st.text(max_size=20), max_size=2),
)
def test_any_table_is_taken_or_refused_in_words(table: dict[str, Any], overrides: list[str]) -> None:
    built = load_bytes(to_toml({**PARTS, **table}).encode(), overrides)
    assert built is None or isinstance(built, ScenarioConfig)


@given(st.text(max_size=30), values)
def test_overrides_are_applied_or_refused_in_words(override: str, value: object) -> None:
    with contextlib.suppress(InputError):
        tables: dict[str, Any] = {"a": {"b": value}, "c": [1]}
        apply_override(tables, override)
        assert tables != {}
