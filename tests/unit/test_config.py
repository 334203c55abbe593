"""Scenarios: what is read, and what is said when something is wrong."""

import math
import os
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from pydantic import Field

from wideberth.config import apply_override, build_scenario, load_scenario
from wideberth.conflict.well_clear import PRESETS
from wideberth.errors import InputError
from wideberth.part_config import PartConfig
from wideberth.simulation.config import PresetName, RecordedTrafficConfig, SimulatedTrafficConfig


class LegConfig(PartConfig):
    length_m: float = Field(100.0, gt=0.0)
    bank_deg: float | None = None


class ModelConfig(PartConfig):
    range_max_m: float = 1000.0
    rate_hz: float = 10.0
    count: int = 3
    mode: str = "fast"
    legs: tuple[LegConfig, ...] = ()


class Model:
    """A part such as an outsider would write."""

    Config = ModelConfig

    def __init__(self, config: ModelConfig) -> None:
        self.config = config


class NoModel:
    """A class that is not a part."""


OUTSIDER = "tests.unit.test_config:Model"
PARTS = {key: {"kind": OUTSIDER} for key in ("ownship", "sensor", "tracker", "detection", "avoidance")}
WAYPOINTS = [
    {"lat_deg": 48.0, "lon_deg": 2.0, "altitude_m": 300.0},
    {"lat_deg": 48.1, "lon_deg": 2.0, "altitude_m": 350.0, "speed_mps": 30.0},
]
MISSION = {"speed_mps": 40.0, "waypoints": WAYPOINTS}


def scenario(**tables: Any) -> dict[str, Any]:
    return {**PARTS, "mission": MISSION, **tables}


def wrong(**tables: Any) -> str:
    with pytest.raises(InputError) as caught:
        build_scenario(scenario(**tables))
    return str(caught.value)


def test_every_value_reaches_its_place() -> None:
    built = build_scenario(
        scenario(
            name="crossing",
            seed=7,
            duration_s=120,
            step_s=0.2,
            wind={"north_mps": 3.0, "up_mps": 0.5},
            evaluation={"collision_volume": {"radius_m": 150.0, "half_height_m": 30.0}},
            tracker={"kind": OUTSIDER, "range_max_m": 5.0},
        )
    )
    assert (built.name, built.seed, built.duration_s, built.step_s) == ("crossing", 7, 120.0, 0.2)
    assert built.wind.vector().tolist() == [3.0, 0.0, -0.5]
    assert built.tracker.target is Model
    assert built.tracker.target(built.tracker.config).config.range_max_m == 5.0
    assert built.avoidance.config.range_max_m == 1000.0
    assert built.evaluation.well_clear_volume == "astm_f3442"


def test_mission_in_the_local_frame() -> None:
    built = build_scenario(scenario())
    assert built.mission is not None
    frame = built.frame()
    assert math.degrees(frame.latitude) == pytest.approx(48.0)  # no [origin]: the first waypoint
    mission = built.mission.mission(frame)
    assert mission.waypoints[0] == pytest.approx([0.0, 0.0, -300.0], abs=1e-6)
    assert mission.waypoints[1, 0] == pytest.approx(11_120, rel=1e-3)
    assert mission.waypoints[1, 2] == -350.0
    assert mission.speeds.tolist() == [40.0, 30.0]


def test_local_and_geodetic_points_agree() -> None:
    origin = {"lat_deg": 48.0, "lon_deg": 2.0}
    local = {"north_m": 100.0, "east_m": -50.0, "altitude_m": 300.0}
    built = build_scenario(scenario(origin=origin, mission={"speed_mps": 10.0, "waypoints": [local, WAYPOINTS[0]]}))
    assert built.mission is not None
    points = built.mission.mission(built.frame()).waypoints
    assert points[0].tolist() == [100.0, -50.0, -300.0]
    assert points[1] == pytest.approx([0.0, 0.0, -300.0], abs=1e-6)


def test_local_points_alone_need_an_origin() -> None:
    local = {"north_m": 100.0, "east_m": -50.0, "altitude_m": 300.0}
    other = local | {"east_m": 50.0}
    built = build_scenario(scenario(mission={"speed_mps": 10.0, "waypoints": [local, other]}))
    with pytest.raises(InputError, match=r"origin: missing"):
        built.frame()


def test_intruders() -> None:
    straight = {
        "address": "ABC123",
        "position": {"north_m": 0.0, "east_m": 0.0, "altitude_m": 1.0},
        "course_deg": 90.0,
        "speed_mps": 50.0,
        "climb_rate_mps": 2.0,
    }
    along = {"address": "abc124", "speed_mps": 50.0, "waypoints": WAYPOINTS}
    traffic = build_scenario(scenario(traffic={"intruders": [straight, along]})).traffic
    assert isinstance(traffic, SimulatedTrafficConfig)
    assert traffic.intruders[0].address == "abc123"
    assert np.allclose(traffic.intruders[0].velocity(), [0.0, 50.0, -2.0])
    assert len(traffic.intruders[1].waypoints) == 2
    twice = wrong(traffic={"intruders": [straight, {**along, "address": "abc123"}]})
    assert "traffic: two intruders have the same address: abc123" in twice
    neither = {"address": "abc123", "speed_mps": 3.0}
    assert "traffic.intruders.0: give position, course_deg and speed_mps" in wrong(traffic={"intruders": [neither]})


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"sed": 3}, "sed: unknown key: did you mean seed?"),
        ({"ownshp": {}}, "ownshp: unknown key: did you mean ownship?"),
        ({"seed": -1}, "seed: must be greater than or equal to 0, not -1"),
        ({"duration_min": 2}, "duration_min: wrong unit: write duration_s = 120, not duration_min"),
        ({"wind": {"north_kt": 10}}, "wind.north_kt: wrong unit: write north_mps = 5.14444, not north_kt"),
        ({"wind": {"north": 10}}, "wind.north: the unit is missing from the key: write north_mps"),
        ({"wind": 10}, "wind: must be a valid dictionary or instance of WindConfig, not 10"),
        (
            {"tracker": {"kind": OUTSIDER, "range_max_km": 2}},
            "tracker.range_max_km: wrong unit: write range_max_m = 2000",
        ),
        (
            {"tracker": {"kind": OUTSIDER, "range_max_m": "2nmi"}},
            "tracker.range_max_m: must be a number in m, not '2nmi': write 3704",
        ),
        ({"tracker": {"kind": OUTSIDER, "range_max_m": "x"}}, "tracker.range_max_m: must be a number in m, not 'x'"),
        ({"tracker": {"kind": OUTSIDER, "rate_hz": "x"}}, "tracker.rate_hz: must be a number, not 'x'"),
        ({"tracker": {"kind": OUTSIDER, "count": 1.5}}, "tracker.count: must be a valid integer"),
        ({"tracker": {"kind": OUTSIDER, "range_max_m": math.nan}}, "tracker.range_max_m: must be a finite number"),
        ({"tracker": {"kind": OUTSIDER, "legs": [{"lenght_m": 1}]}}, "tracker.legs.0.lenght_m: unknown key: did you"),
        ({"tracker": {"kind": OUTSIDER, "legs": [{"length_m": 0}]}}, "tracker.legs.0.length_m: must be greater than 0"),
        ({"tracker": {"kind": OUTSIDER, "x": 1}}, "tracker.x: unknown key (known: count, legs, mode, range_max_m, rat"),
        ({"tracker": {"kind": "nonsense"}}, "tracker.kind: there is no 'nonsense' (known: "),
        # Trackers of radar plots: no scenario has a radar, and among ADS-B alone they would call everything clear.
        ({"tracker": {"kind": "kalman"}}, "tracker.kind: there is no 'kalman' (known: adsb_kalman, wideberth,"),
        ({"tracker": {"kind": 3}}, "tracker.kind: must be a text, not 3"),
        ({"tracker": "adsb"}, "tracker: must be a table, not 'adsb'"),
        ({"tracker": {"kind": "no.such:Class"}}, "tracker.kind: cannot load no.such:Class: No module named 'no'"),
        ({"tracker": {"kind": "math:Class"}}, "tracker.kind: cannot load math:Class"),
        ({"tracker": {"kind": ":"}}, "tracker.kind: cannot load :"),
        ({"tracker": {"kind": "math:pi"}}, "tracker.kind: math:pi is not a class"),
        ({"tracker": {"kind": "tests.unit.test_config:NoModel"}}, "has no configuration model"),
        (
            {"traffic": {"kind": "imagined"}},
            "traffic.kind: there is no 'imagined' (known: simulated, random, recorded)",
        ),
        ({"traffic": {"kind": "recorded", "max_gap_min": 1}}, "traffic.max_gap_min: wrong unit: write max_gap_s = 60"),
        ({"mission": {"waypoints": WAYPOINTS}}, "mission: speed_mps is missing"),
        ({"mission": {"speed_mps": 3.0}}, "mission.waypoints: missing"),
        ({"mission": {"speed_mps": 3.0, "waypoints": []}}, "mission.waypoints: needs at least 2 items, not 0"),
        ({"origin": {"lat_deg": 91.0, "lon_deg": 0.0}}, "origin.lat_deg: must be less than or equal to 90, not 91.0"),
        ({"evaluation": {"well_clear_volume": "sarb"}}, "evaluation.well_clear_volume: must be 'sarp', "),
        (
            {"evaluation": {"collision_volume": {"radius_km": 1, "half_height_m": 1}}},
            "evaluation.collision_volume.radius_km: wrong unit: write radius_m = 1000",
        ),
        ({"evaluation": {"collision_volume": 3}}, "evaluation.collision_volume: must be a valid dictionary"),
    ],
)
def test_wrong_keys_are_named_with_what_to_write(tables: dict[str, Any], message: str) -> None:
    text = wrong(**tables)
    assert text.startswith("scenario: " + message) or message in text
    assert "\n" not in text, "one mistake is one line"


def test_every_mistake_is_reported_at_once() -> None:
    text = wrong(
        seed="x",
        sped=1,
        mission={"speed_mps": "25kt", "waypoints": [{"lat_deg": 91, "lon_deg": 0, "altitude_ft": 3}] * 2},
        tracker={"kind": OUTSIDER, "range_max_km": 1, "rate_hz": True, "legs": [{}, {"bank_rad": 1}]},
        avoidance={"kind": "none"},
    )
    assert text.splitlines()[0] == "scenario: 10 things are wrong"
    paths = [line.strip().split(":")[0] for line in text.splitlines()[1:]]
    assert sorted(paths) == sorted(
        [
            "seed",
            "sped",
            "mission.speed_mps",
            "mission.waypoints.0.lat_deg",
            "mission.waypoints.0.altitude_ft",
            "mission.waypoints.1.lat_deg",
            "mission.waypoints.1.altitude_ft",
            "tracker.range_max_km",
            "tracker.legs.1.bank_rad",
            "avoidance.kind",
        ]
    )


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "scenario.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"name = ", "not valid TOML"),
        (b"[a]\n[a]\n", "not valid TOML"),
        (b"\xff\xfe\x00", "not a text file in UTF-8 (byte 0)"),
        (b"x = " + b"[" * 100_000, "not valid TOML"),
        (b"\x00\x01", "not valid TOML"),
    ],
)
def test_broken_files(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_scenario(write(tmp_path, content))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_scenario(tmp_path / "missing.toml")
    with pytest.raises(InputError, match="not a file"):
        load_scenario(tmp_path)
    with pytest.raises(InputError):
        load_scenario(tmp_path / ("x" * 5000))
    if os.name == "posix" and os.getuid() != 0:
        path = write(tmp_path, "")
        path.chmod(0)
        with pytest.raises(InputError, match="Permission"):
            load_scenario(path)


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("a.b=2", 2),
        ("a.b = 2.5", 2.5),
        ("a.b=true", True),
        ("a.b=text of words", "text of words"),
        ('a.b="3"', "3"),
        ("a.b=[1, 2]", [1, 2]),
        ("a.b=x=y", "x=y"),
        ("a.b=1\nc = 2", "1\nc = 2"),
        ("a.b=", ""),
    ],
)
def test_override_values(override: str, expected: object) -> None:
    tables: dict[str, Any] = {"a": {"b": 1}}
    apply_override(tables, override)
    assert tables == {"a": {"b": expected}}


def test_override_makes_tables_and_picks_from_lists() -> None:
    tables: dict[str, Any] = {"list": [{"x": 1}, {"x": 2}]}
    apply_override(tables, "new.table.key=1")
    apply_override(tables, "list.1.x=5")
    assert tables == {"list": [{"x": 1}, {"x": 5}], "new": {"table": {"key": 1}}}


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("a.b", "write table.key=value"),
        ("=3", "write table.key=value"),
        ("a..b=3", "write table.key=value"),
        ("n.b=3", "n is not a table"),
        ("list.2.x=1", "the list has 2 items"),
        ("list.x=1", "the list has 2 items"),
    ],
)
def test_wrong_overrides(override: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        apply_override({"n": 1, "list": [1, 2]}, override)


def test_recorded_traffic_is_relative_to_the_scenario(tmp_path: Path) -> None:
    toml = "".join(f"[{k}]\nkind = '{OUTSIDER}'\n" for k in PARTS) + "[traffic]\nkind = 'recorded'\n"
    for given, expected in [
        ("data.gz", str(tmp_path / "data.gz")),
        ("-", "-"),
        ("sbs://host:30003", "sbs://host:30003"),
        (str(tmp_path / "absolute"), str(tmp_path / "absolute")),
    ]:
        traffic = load_scenario(write(tmp_path, toml), [f"traffic.path={given}"]).traffic
        assert isinstance(traffic, RecordedTrafficConfig)
        assert traffic.path == expected


def test_sensor_of_recorded_traffic_is_a_receiver() -> None:
    tables = {k: v for k, v in scenario(traffic={"kind": "recorded"}).items() if k != "sensor"}
    assert build_scenario(tables).sensor.kind == "adsb_receiver"
    assert build_scenario({**tables, "sensor": {"kind": "adsb"}}).sensor.kind == "adsb_receiver"
    assert build_scenario({**tables, "traffic": {}}).sensor.kind == "adsb"
    with pytest.raises(InputError, match=r"sensor.kind: adsb_receiver needs recorded traffic"):
        build_scenario({**tables, "traffic": {}, "sensor": {"kind": "adsb_receiver"}})


def test_volume_names_are_those_of_the_presets() -> None:
    assert set(get_args(PresetName)) == set(PRESETS)
