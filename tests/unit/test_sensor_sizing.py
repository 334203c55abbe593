import math
from pathlib import Path

import numpy as np
import pytest

from wideberth.analysis.sensor_sizing import available_range, closing_speed, protected
from wideberth.analysis.sizing_config import (
    AdsbSizingConfig,
    AircraftConfig,
    build_sensor,
    load_aircraft,
    load_sensor,
)
from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import confirmed_range
from wideberth.units import NAUTICAL_MILE

SIZING = Path(__file__).resolve().parents[2] / "sizing"
AIRCRAFT = AircraftConfig(speed_min_mps=5.0, speed_cruise_mps=10.0, speed_max_mps=20.0)
RADAR = RadarConfig()


def eight_seconds(bearing, intruder_speed, aircraft):
    """Eight seconds of closing, to stand in for the real thing."""
    return 8.0 * closing_speed(bearing, aircraft.speed_cruise_mps, intruder_speed)


def test_closing_speed_keeps_the_bearing():
    bearings = np.radians([0.0, 50.0, 120.0, 180.0, -120.0])
    closing = closing_speed(bearings, 10.0, 20.0)
    assert closing[0] == pytest.approx(30.0) and closing[3] == pytest.approx(10.0)
    assert closing[2] == pytest.approx(closing[4])
    for angle, speed in zip(bearings, closing, strict=True):
        # The intruder's velocity: the ownship's (along x) less the closing velocity along the line of sight.
        velocity = np.array([10.0, 0.0]) - speed * np.array([math.cos(angle), math.sin(angle)])
        assert np.hypot(*velocity) == pytest.approx(20.0)


def test_slow_intruders_cannot_come_from_everywhere():
    closing = closing_speed(np.radians([0.0, 30.0, 89.0, 180.0]), 10.0, 6.0)
    assert np.all(closing[:2] > 0) and np.all(np.isnan(closing[2:]))
    assert np.isnan(closing_speed(math.pi, 10.0, 10.0))  # as fast, behind: never there


def test_radar_by_bearing():
    bearings = np.radians([0.0, 30.0, 90.0])
    found = available_range(RADAR, bearings, 30.0, rcs=0.1)
    np.testing.assert_array_equal(found, confirmed_range(0.1, 30.0, RADAR, azimuth=bearings))
    assert found[2] == 0.0


def test_adsb_sees_all_round_as_far_as_its_class():
    sensor = AdsbSizingConfig(power_class="A1", loss_1090=0.0)
    found = available_range(sensor, [0.0, 3.0], 100.0)
    # Three messages received, the last one 0.6 s old.
    np.testing.assert_allclose(found, 20 * NAUTICAL_MILE - 300.0 - 60.0, rtol=1e-12)
    lossy = available_range(AdsbSizingConfig(power_class="A1"), 0.0, 100.0)
    assert found[0] - 300.0 <= lossy < found[0]
    assert available_range(AdsbSizingConfig(power_class="A3"), 0.0, 100.0) > 4 * lossy
    assert available_range(AdsbSizingConfig(loss_1090=1.0), 0.0, 100.0) == 0.0


def test_protection_is_available_less_required():
    bearings, speeds = np.radians([-90.0, 0.0, 45.0, 180.0]), np.array([6.0, 15.0, 60.0])
    found = protected(RADAR, AIRCRAFT, bearings, speeds, required_range=eight_seconds, rcs=0.1)
    assert found.margin.shape == found.protected.shape == (4, 3)
    meets = np.isfinite(found.closing_speed)
    np.testing.assert_array_equal(meets, [[False, True, True], [True] * 3, [False, True, True], [False, True, True]])
    np.testing.assert_allclose(found.required_range[meets], 8.0 * found.closing_speed[meets])
    assert np.all(found.required_range[~meets] == 0) and np.all(found.protected[~meets])
    np.testing.assert_allclose(found.margin, found.available_range - found.required_range)
    np.testing.assert_array_equal(found.protected, found.margin >= 0)
    # Ahead it sees the slow ones in time; aside and behind it sees nothing.
    np.testing.assert_array_equal(
        found.protected, [[True, False, False], [True, True, False], [True, True, False], [True, False, False]]
    )
    np.testing.assert_array_equal(found.protected_bearings, [False] * 4)


def test_adsb_protects_where_the_radar_does_not():
    bearings = np.radians(np.arange(-180.0, 180.0, 30.0))
    found = protected(AdsbSizingConfig(power_class="A1"), AIRCRAFT, bearings, [77.0], required_range=eight_seconds)
    assert found.protected.all() and found.protected_bearings.all()


def test_a_cross_section_for_each_speed_and_another_ownship_speed():
    speeds = [20.0, 20.0]
    found = protected(RADAR, AIRCRAFT, [0.0], speeds, required_range=eight_seconds, rcs=[0.01, 1.0], ownship_speed=15.0)
    np.testing.assert_allclose(found.closing_speed, 35.0)
    np.testing.assert_allclose(found.required_range, 280.0)
    assert found.available_range[0, 0] < found.available_range[0, 1]


def test_what_only_passes_near_is_asked_for_as_well():
    # As fast and right behind: no collision course, yet it may be inside the safety radius.
    found = protected(RADAR, AIRCRAFT, [math.pi], [10.0], required_range=lambda b, v, a: np.full(b.shape, 150.0))
    assert np.isnan(found.closing_speed[0, 0]) and found.required_range[0, 0] == 150.0
    assert found.margin[0, 0] == -150.0 and not found.protected[0, 0]


def test_the_turn_in_the_names_of_the_detection_ranges():
    arguments = AircraftConfig().turn_arguments()
    assert arguments["ownship_speed"] == pytest.approx(25 * 1852 / 3600, abs=1e-3)
    assert arguments["max_bank"] == arguments["max_bank_rate"] == pytest.approx(math.pi / 6)
    assert arguments["turn_angle"] == pytest.approx(math.pi / 2)
    assert (arguments["safety_radius"], arguments["computation_time"]) == (152.4, 5.0)
    assert arguments["roll_time_constant"] == 0.5


def test_no_range_is_enough():
    found = protected(RADAR, AIRCRAFT, [0.0], [20.0], required_range=lambda b, v, a: np.full(b.shape, np.inf))
    assert not found.protected.any() and found.margin[0, 0] == -np.inf


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"bearings": [math.nan]}, "bearings must be finite"),
        ({"bearings": 0.0}, "bearings must be a list"),
        ({"bearings": []}, "bearings must be a list"),
        ({"intruder_speeds": [0.0]}, "intruder_speeds must be positive"),
        ({"intruder_speeds": [[1.0]]}, "intruder_speeds must be a list"),
        ({"rcs": -1.0}, "rcs must be positive"),
        ({"rcs": [1.0, 2.0, 3.0]}, "rcs must be one number"),
        ({"ownship_speed": 0.0}, "ownship_speed must be positive"),
        ({"required_range": lambda b, v, a: np.array([1.0])}, "required_range must return"),
        ({"required_range": lambda b, v, a: -b - 1.0}, "required_range must return"),
    ],
)
def test_bad_arguments_are_refused_by_name(arguments, message):
    good = {"bearings": [0.0, 1.0], "intruder_speeds": [20.0, 30.0], "required_range": eight_seconds}
    with pytest.raises(ValueError, match=message):
        protected(RADAR, AIRCRAFT, **(good | arguments))


def test_the_files():
    radar = load_sensor(SIZING / "radar_table_5_1.toml")
    assert radar == RadarConfig()
    adsb = load_sensor(SIZING / "adsb_a1.toml")
    assert isinstance(adsb, AdsbSizingConfig) and adsb.range_nmi == 20.0
    wing, rotor = load_aircraft(SIZING / "small_fixed_wing.toml"), load_aircraft(SIZING / "multirotor.toml")
    assert wing.model_copy(update={"name": "aircraft"}) == AircraftConfig()
    assert rotor.speed_min_mps == 0.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({}, "sensor: kind: missing"),
        ({"kind": "lidar"}, r"kind: there is no 'lidar' \(known: radar, ground_radar, adsb\)"),
        ({"kind": ["radar"]}, "kind: there is no"),
        ({"kind": "radar", "sweep_time_s": 0.002}, r"sweep_time_s: wrong unit: write sweep_time_ms = 2, not"),
        ({"kind": "radar", "bandwidth_khz": 5e5}, r"bandwidth_khz: wrong unit: write bandwidth_mhz, not"),
        ({"kind": "radar", "noise_figure": 6}, "noise_figure: the unit is missing from the key: write noise_figure_db"),
        ({"kind": "radar", "channels": 0, "losses_db": -1}, "2 things are wrong"),
        ({"kind": "radar", "confirm_hits": 11}, "sensor: confirm_hits 11 is more than confirm_window 10"),
        ({"kind": "adsb", "confirm_hits": 6}, "confirm_hits 6 is more than confirm_window 5"),
        ({"kind": "adsb", "power_class": "B2"}, "power_class"),
    ],
)
def test_wrong_sensors_are_refused_by_key(table, message):
    with pytest.raises(InputError, match=message):
        build_sensor(table)


def test_wrong_files_are_refused(tmp_path):
    path = tmp_path / "aircraft.toml"
    path.write_text("speed_cruise_kt = 25.0\n", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"aircraft\.toml: speed_cruise_kt: wrong unit: write speed_cruise_mps = 12\.8611"
    ):
        load_aircraft(path)
    path.write_text("speed_min_mps = 30.0\n", encoding="utf-8")
    with pytest.raises(InputError, match="are not in this order"):
        load_aircraft(path)
    with pytest.raises(InputError, match="no such file"):
        load_sensor(tmp_path / "none.toml")
