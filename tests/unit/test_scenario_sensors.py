"""Several sensors in a scenario: what is read, what fits together, and what then senses."""

import math
import tomllib
from typing import Any

import numpy as np
import pytest

from wideberth.assembly import build_pipeline, build_traffic, build_world
from wideberth.config import ScenarioConfig, apply_override, build_scenario
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.experiment import build_experiment
from wideberth.toml_text import to_toml
from wideberth.types import Scan

PLACE = {"north_m": 400.0, "east_m": 0.0, "altitude_m": 300.0}
TRAFFIC = {"intruders": [{"address": "a00001", "position": PLACE, "course_deg": 90.0, "speed_mps": 20.0}]}
MISSION = {"speed_mps": 40.0, "waypoints": [{**PLACE, "north_m": 0.0}, {**PLACE, "north_m": 9000.0}]}
RADAR = {"kind": "radar", "channels": 16, "array_rows": 4, "azimuth_fov_deg": 360.0, "elevation_fov_deg": 180.0}
LISTED = {**RADAR, "transmit_power_w": 1e4, "azimuth_beamwidth_deg": 360.0, "elevation_beamwidth_deg": 360.0}
RECORDED = {"kind": "recorded", "path": "-"}


def scenario(tracker: str = "wideberth", **tables: Any) -> dict[str, Any]:
    return {
        "origin": {"lat_deg": 40.0, "lon_deg": -111.0},
        "mission": MISSION,
        "traffic": TRAFFIC,
        "tracker": {"kind": tracker},
        **tables,
    }


def wrong(**tables: Any) -> str:
    with pytest.raises(InputError) as caught:
        build_scenario(scenario(**tables))
    return str(caught.value)


def sensed(built: ScenarioConfig, steps: int = 30) -> list[list[Scan]]:
    assert built.mission is not None
    frame = built.frame()
    mission = built.mission.mission(frame)
    world = build_world(built, mission, build_traffic(built, mission, frame, 100.0))
    return [world.sense(0.1 * k)[1] for k in range(steps)]


def test_one_sensor_is_written_as_before() -> None:
    built = build_scenario(scenario("adsb_kalman"))
    assert [part.name for part in built.sensors] == ["adsb"] and built.sensor is built.sensors[0]
    assert built.resolved()["sensor"]["kind"] == "adsb" and "sensors" not in built.resolved()
    listed = build_scenario(scenario("adsb_kalman", sensors=[{"kind": "adsb"}]))
    assert listed == built
    for a, b in zip(sensed(built), sensed(listed), strict=True):
        assert np.array_equal(a[0].z, b[0].z)


def test_a_list_of_sensors_reads_back_from_its_resolved_configuration() -> None:
    sensors = [{"kind": "adsb"}, RADAR, {**RADAR, "name": "south", "north_m": -500.0, "update_interval_s": 0.5}]
    built = build_scenario(scenario(sensors=sensors))
    assert [(part.kind, part.name) for part in built.sensors] == [
        ("adsb", "adsb"),
        ("radar", "radar"),
        ("radar", "south"),
    ]
    assert [table["name"] for table in built.resolved()["sensors"]] == ["adsb", "radar", "south"]
    assert build_scenario(tomllib.loads(to_toml(built.resolved()))) == built


def test_every_sensor_has_its_own_name_rate_and_noise() -> None:
    south = {**LISTED, "name": "south", "update_interval_s": 0.5}
    adsb = [{"kind": "adsb", "loss_1090": 0.0}, {"kind": "adsb", "loss_1090": 0.0, "name": "second"}]
    built = build_scenario(scenario(sensors=[LISTED, south, *adsb], seed=3))
    scans = [scan for step in sensed(built) for scan in step]
    count = {name: sum(scan.sensor == name for scan in scans) for name in ("radar", "south", "adsb", "second")}
    assert count == {"radar": 30, "south": 6, "adsb": 30, "second": 30}
    first = {name: next(s.z for s in scans if s.sensor == name and len(s.z)) for name in count}
    assert not np.array_equal(first["radar"], first["south"], equal_nan=True)
    assert not np.array_equal(first["adsb"], first["second"])


def test_taking_a_sensor_out_changes_nothing_in_the_others() -> None:
    both = build_scenario(scenario(sensors=[{**LISTED, "name": "a"}, {**LISTED, "name": "b"}]))
    alone = build_scenario(scenario(sensors=[{**LISTED, "name": "b"}]))
    for x, y in zip(sensed(both, 5), sensed(alone, 5), strict=True):
        assert x[1].sensor == y[0].sensor == "b" and np.array_equal(x[1].z, y[0].z, equal_nan=True)


def test_a_key_of_a_listed_sensor_can_be_set() -> None:
    tables = scenario(sensors=[RADAR, {"kind": "adsb"}])
    apply_override(tables, "sensors.0.update_interval_s=0.25")
    assert build_scenario(tables).sensors[0].config.update_interval_s == 0.25


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"sensor": RADAR, "sensors": [RADAR]}, "a list of sensors as well: make this table one more [["),
        ({"sensors": []}, "sensors: must be a list with a table for each sensor: write [[sensors]] above each"),
        ({"sensors": RADAR}, "sensors: must be a list"),
        ({"sensors": [RADAR, 3]}, "sensors.1: must be a table, not 3"),
        ({"sensors": [RADAR, {"kind": "lidar"}]}, "sensors.1.kind: there is no 'lidar' (known: adsb, adsb_rec"),
        ({"sensors": [{**RADAR, "range_max_km": 1}]}, "sensors.0.range_max_km: wrong unit: write range_max_m = 1000"),
        ({"sensors": [{**RADAR, "name": 3}]}, "sensors.0.name: must be a text, not 3"),
        ({"sensors": [{**RADAR, "name": ""}]}, "sensors.0.name: must be a text"),
        ({"sensors": [RADAR, RADAR]}, "sensors.1.name: sensors.0 is called 'radar' as well: give each its own"),
        ({"sensors": [{**RADAR, "boresight_azimuths_deg": [0, 180]}, {**RADAR, "name": "radar/2"}]}, "'radar/2'"),
        ({"sensor": RADAR, "tracker": "adsb_kalman"}, "does not hear radar plots: take wideberth or rransac"),
        ({"sensor": {"kind": "adsb"}, "tracker": "rransac"}, "does not hear ADS-B: take adsb_kalman or wideberth"),
        ({"sensors": [{}, RADAR], "tracker": "adsb_kalman"}, "does not hear radar plots: take wideberth"),
        ({"sensor": {"kind": "radar"}, "tracker": "er_rransac"}, "does not hear plots of a line array: take wide"),
        ({"sensor": RADAR, "traffic": RECORDED}, "radar needs simulated traffic; recorded traffic takes adsb"),
        ({"sensors": [{}, {"name": "b"}], "traffic": RECORDED}, "recorded traffic is heard by one receiver"),
        ({"sensor": {"kind": "adsb_receiver"}}, "sensor.kind: adsb_receiver needs recorded traffic"),
        ({"sensor": {**RADAR, "name": "x"}}, "sensor.name: "),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_what_to_do(tables: dict[str, Any], message: str) -> None:
    assert message in wrong(**tables)


@pytest.mark.parametrize("tracker", ["wideberth", "rransac", "er_rransac"])
def test_trackers_of_plots_are_parts_where_all_sensors_are_radars(tracker: str) -> None:
    assert build_scenario(scenario(tracker, sensors=[RADAR, {**RADAR, "name": "b"}])).tracker.kind == tracker


def test_a_scenario_with_a_silent_radar_is_never_clear() -> None:
    built = build_scenario(scenario(sensor={**LISTED, "silent_from_s": 2.0}, avoid=False, traffic={}))
    assert built.mission is not None
    frame = built.frame()
    mission = built.mission.mission(frame)
    world = build_world(built, mission, build_traffic(built, mission, frame, 100.0))
    pipeline = build_pipeline(built, lambda: 0.0)
    for k in range(80):
        snapshot = pipeline.step(0.1 * k, *world.sense(0.1 * k), world.mission)
        # Last heard after 1.9 s, and a second may be chance.
        if k > 29:
            assert snapshot.sensors["radar"].state.startswith("silent for") and snapshot.alert_state >= 1
            assert math.isfinite(snapshot.sensors["radar"].age)
        elif k < 29:
            assert snapshot.sensors["radar"].state == "ok"


def test_radar_and_adsb_together_sense_the_same_sky() -> None:
    built = build_scenario(scenario(sensors=[{"kind": "adsb"}, LISTED]))
    kinds = {scan.kind for step in sensed(built) for scan in step}
    assert kinds == {"adsb", "radar"}


def test_an_experiment_has_one_sensor() -> None:
    with pytest.raises(InputError, match="sensors: an experiment has one sensor: write it as"):
        build_experiment({"sensors": [RADAR]})


def test_a_known_altitude_lets_r_ransac_hear_a_line_array() -> None:
    tracker = {"kind": "rransac", "preset": "flight_test", "known_altitude_m": 100.0}
    built = build_scenario({**scenario(), "sensor": {"kind": "radar"}, "tracker": tracker})
    assert built.tracker.kind == "rransac"
