"""Telemetry as the ownship's state, and the time when it was true."""

import math

import numpy as np
import pytest

from tests.mavlink_loop import FRAME, HOME, place
from wideberth.frames import rotation_ned_body
from wideberth.links.mavlink.boot_clock import BootClock
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.telemetry import Telemetry, rotation_of
from wideberth.types import Ownship

T = 1_700_000_000.0


def position(boot: float, ned=None, velocity=(10.0, 2.0, -1.0)):
    ned = place(50.0, -20.0, 80.0) if ned is None else ned
    latitude, longitude, altitude = FRAME.to_geodetic(ned)
    return mavlink.MAVLink_global_position_int_message(
        round(boot * 1e3),
        round(math.degrees(latitude) * 1e7),
        round(math.degrees(longitude) * 1e7),
        round(float(altitude) * 1e3),
        round((float(altitude) - HOME.altitude) * 1e3),
        *(round(v * 100) for v in velocity),
        0,
    )


def home():
    return mavlink.MAVLink_home_position_message(
        round(math.degrees(HOME.latitude) * 1e7), round(math.degrees(HOME.longitude) * 1e7), round(HOME.altitude * 1e3),
        0, 0, 0, (1.0, 0, 0, 0), 0, 0, 0,
    )  # fmt: skip


def telemetry(**config) -> Telemetry:
    found = Telemetry(MavlinkConfig(**config), None)
    found.take(home(), T)
    return found


def own_of(tel: Telemetry, t: float) -> Ownship:
    own = tel.ownship(t)
    assert own is not None
    return own


def test_position_velocity_and_attitude() -> None:
    tel = telemetry()
    assert tel.ownship(T) is None
    tel.take(mavlink.MAVLink_attitude_message(10_000, 0.1, -0.2, 1.5, 0, 0, 0), T)
    tel.take(position(10.0), T)
    own = tel.ownship(T)
    assert own is not None and own.state == "ok"
    assert np.allclose(own.position, place(50.0, -20.0, 80.0), atol=0.02)
    assert np.allclose(own.velocity, [10.0, 2.0, -1.0], atol=0.01)
    assert np.allclose(own.attitude, rotation_ned_body(0.1, -0.2, 1.5))
    assert tel.frame is not None and abs(tel.frame.latitude - HOME.latitude) < 1e-9


def test_quaternion_and_angles_give_the_same_attitude() -> None:
    half = 0.5 * 0.7
    assert np.allclose(rotation_of(np.array([math.cos(half), 0, 0, math.sin(half)])), rotation_ned_body(0, 0, 0.7))
    assert np.allclose(rotation_of(np.array([math.cos(half), math.sin(half), 0, 0])), rotation_ned_body(0.7, 0, 0))
    assert np.allclose(rotation_of(np.array([math.cos(half), 0, math.sin(half), 0])), rotation_ned_body(0, 0.7, 0))
    tel = telemetry()
    tel.take(mavlink.MAVLink_attitude_quaternion_message(10_000, math.nan, 0, 0, 0, 0, 0, 0), T)
    assert tel.counts["attitude is none"] == 1


def test_altitudes_stay_apart() -> None:
    tel = telemetry()
    tel.take(position(10.0), T)
    assert tel.height_above_ground == pytest.approx(80.0, abs=0.01)  # above home
    assert -own_of(tel, T).position[2] == pytest.approx(HOME.altitude + 80.0, abs=0.01)  # AMSL
    tel.take(mavlink.MAVLink_terrain_report_message(0, 0, 100, HOME.altitude + 50.0, 30.0, 0, 4), T)
    assert tel.ground == HOME.altitude + 50.0  # the hill counts, not home
    assert tel.height_above_ground == pytest.approx(30.0, abs=0.01)
    tel.take(mavlink.MAVLink_terrain_report_message(0, 0, 100, HOME.altitude - 200.0, 280.0, 0, 4), T)
    assert tel.ground == HOME.altitude  # never lower than home


def test_home_is_guessed_from_the_relative_altitude() -> None:
    tel = Telemetry(MavlinkConfig(), None)
    assert math.isnan(tel.ground)
    tel.take(position(10.0), T)
    assert tel.ground == pytest.approx(HOME.altitude, abs=0.01)


def test_accuracy_as_told_else_as_configured() -> None:
    tel = telemetry(position_sigma_m=4.0, height_sigma_m=6.0, velocity_sigma_mps=0.5)
    tel.take(position(10.0), T)
    assert np.allclose(np.diag(own_of(tel, T).covariance), np.array([4, 4, 6, 0.5, 0.5, 0.5]) ** 2)
    gps = mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 80, 120, 0, 0, 10, 0, 1500, 2500, 200)
    tel.take(gps, T)
    assert np.allclose(np.diag(own_of(tel, T).covariance), np.array([1.5, 1.5, 2.5, 0.2, 0.2, 0.2]) ** 2)
    tel.take(mavlink.MAVLink_estimator_status_message(0, 0x3F, 0, 0, 0, 0, 0, 0, 0.9, 1.1), T)
    assert np.allclose(np.diag(own_of(tel, T).covariance)[:3], np.array([0.9, 0.9, 1.1]) ** 2)
    upper = np.zeros(45)
    upper[[0, 9, 17, 24, 30, 35]] = [4.0, 9.0, 1.0, 0.04, 0.01, 0.01]
    tel.take(mavlink.MAVLink_local_position_ned_cov_message(0, 0, *(0.0,) * 9, upper), T)
    assert np.allclose(np.diag(own_of(tel, T).covariance), [9.0, 9.0, 1.0, 0.04, 0.04, 0.04])
    assert np.allclose(np.diag(own_of(tel, T + 60).covariance)[:3], np.array([4, 4, 6]) ** 2)  # too old to count


def test_what_is_no_position_is_counted() -> None:
    tel = telemetry()
    tel.take(mavlink.MAVLink_global_position_int_message(1000, 0, 0, 0, 0, 0, 0, 0, 0), T)
    tel.take(mavlink.MAVLink_global_position_int_message(1000, 2_000_000_000, 5, 0, 0, 0, 0, 0, 0), T)
    assert tel.ownship(T) is None
    assert tel.counts["position is none"] == 2


def test_late_positions_do_not_bring_the_state_back() -> None:
    tel = telemetry()
    tel.take(position(10.0), T)
    tel.take(position(9.8, place(0, 0)), T)
    assert np.allclose(own_of(tel, T).position, place(50.0, -20.0, 80.0), atol=0.02)
    assert tel.counts["position out of order"] == 1


def test_local_positions_count_where_no_global_ones_come() -> None:
    tel = Telemetry(MavlinkConfig(), FRAME)
    local = mavlink.MAVLink_local_position_ned_message(1000, 5.0, 6.0, -7.0, 1.0, 2.0, 3.0)
    tel.take(local, T)
    assert tel.ownship(T) is None  # its origin is not known
    origin = home()
    tel.take(mavlink.MAVLink_gps_global_origin_message(origin.latitude, origin.longitude, origin.altitude), T)
    tel.take(local, T)
    assert np.allclose(own_of(tel, T).position, place(5.0, 6.0, 7.0), atol=0.02)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (mavlink.MAVLink_gps_raw_int_message(0, 1, 0, 0, 0, 0, 0, 0, 0, 0), "autopilot has no GPS fix"),
        (
            mavlink.MAVLink_estimator_status_message(0, 0x87, 0, 0, 0, 0, 0, 0, 0, 0),
            "autopilot's estimator has no absolute position",
        ),
        (
            mavlink.MAVLink_ekf_status_report_message(0xA7, 0, 0, 0, 0, 0),
            "autopilot's estimator has no absolute position",
        ),
    ],
)
def test_a_position_without_gps_says_so(message, words: str) -> None:
    tel = telemetry()
    tel.take(position(10.0), T)
    tel.take(message, T)
    assert own_of(tel, T).state == words


def test_the_offset_comes_from_the_shortest_round_trip() -> None:
    clock = BootClock()
    # Boot was at T; one way takes 0.1 s there and 0.4 s back, once 0.01 s each.
    for k in range(5):
        ours = T + 100 + k
        clock.answer(ours + 0.1 - T, ours, ours + 0.5)
    ours = T + 106
    clock.answer(ours + 0.01 - T, ours, ours + 0.02)
    assert clock.time_of(105.0, T + 106.0) == pytest.approx(T + 105.0, abs=1e-6)
    assert clock.time_of(107.0, T + 106.5) <= T + 106.5  # never later than its receipt


def test_without_answers_the_fastest_messages_tell_the_offset() -> None:
    clock = BootClock()
    delays = [0.3, 0.1, 0.5, 0.2, 0.05, 0.4]
    for k, delay in enumerate(delays):
        found = clock.time_of(10.0 + k, T + k + delay)
    assert found == pytest.approx(T + 5 + 0.05, abs=1e-6)


def test_a_jump_needs_two_answers_and_is_told() -> None:
    clock = BootClock()
    for k in range(5):
        clock.answer(10.0 + k, T + k, T + k + 0.02)
    clock.answer(15.0, T + 8.0, T + 8.02)
    assert clock.jump == 0.0
    clock.answer(16.0, T + 9.0, T + 9.02)
    assert clock.jump == pytest.approx(3.0, abs=0.1)
    assert clock.time_of(16.5, T + 9.6) == pytest.approx(T + 9.51, abs=0.05)


def test_a_reboot_is_seen_by_the_time_since_boot() -> None:
    clock = BootClock()
    assert not clock.is_late(500.0)
    assert [clock.is_late(boot) for boot in (499.9, 2.0, 2.1)] == [True, True, True]
    assert not clock.rebooted
    assert not clock.is_late(2.2)
    assert clock.rebooted
    assert not clock.is_late(2.3)
