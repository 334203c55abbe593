"""Traffic in and out over MAVLink, texts, modes, and the path of set-points."""

import math
from collections import Counter

import numpy as np
import pytest

from tests.mavlink_loop import COPTER, FRAME, HOME, KINDS, PX4_COPTER, place
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.guided_path import GuidedPath, with_floor
from wideberth.links.mavlink.modes import kind_of, px4_mode
from wideberth.links.mavlink.traffic_messages import TrafficMessages
from wideberth.links.mavlink.traffic_reports import TrafficReports
from wideberth.types import (
    AlertLevel,
    Maneuver,
    Ownship,
    Snapshot,
    SourceInfo,
    Threat,
    Track,
    TrackStatus,
)

T = 1_700_000_000.0
OWN = Ownship(T, place(0, 0), np.array([20.0, 0, 0]))


def track(name: str, callsign: str | None = None, sources=("receiver",), **options) -> Track:
    return Track(
        name, T, place(500, 100), np.array([-30.0, 5.0, -2.0]), np.zeros(3), np.eye(9), TrackStatus.CONFIRMED, T,
        sources=sources, info=SourceInfo(callsign=callsign), **options,
    )  # fmt: skip


def threat(name: str, level: AlertLevel) -> Threat:
    return Threat(name, 12.0, 80.0, -15.0, 5.0, (5.0, 20.0), 0.9, level)


def snapshot(tracks, threats, maneuver=None, alert=None) -> Snapshot:
    worst = max((x.level for x in threats), default=AlertLevel.CLEAR) if alert is None else alert
    return Snapshot(T, OWN, tuple(tracks), tuple(threats), maneuver, worst, 1, {}, {})


def messages(out: TrafficMessages, t: float, shot: Snapshot, kind: str):
    return [m for _, m in out.of_snapshot(t, shot, FRAME, traffic=True) if m.get_type() == kind]


def report(**changes):
    latitude, longitude, altitude = FRAME.to_geodetic(place(500, 100))
    values = {
        "ICAO_address": 0xABC123,
        "lat": round(math.degrees(latitude) * 1e7),
        "lon": round(math.degrees(longitude) * 1e7),
        "altitude_type": 1,
        "altitude": round(float(altitude) * 1e3),
        "heading": 9000,
        "hor_velocity": 5000,
        "ver_velocity": -200,
        "callsign": b"N123AB  ",
        "emitter_type": 1,
        "tslc": 1,
        "flags": 1 | 2 | 4 | 8 | 16 | 128,
        "squawk": 1200,
    }
    return mavlink.MAVLink_adsb_vehicle_message(**(values | changes))


def test_a_report_of_the_autopilots_receiver() -> None:
    counts: Counter[str] = Counter()
    reports = TrafficReports(counts)
    reports.take(report(), T)
    (got,) = reports.drain()
    assert (got.t, got.address, got.info.callsign, got.info.category) == (T - 1, "abc123", "N123AB", "A1")
    assert np.allclose(FRAME.to_ned(got.latitude, got.longitude, got.geometric_altitude), place(500, 100), atol=0.02)
    assert math.isnan(got.pressure_altitude)
    assert (got.velocity_north, got.velocity_east, got.climb_rate) == pytest.approx((0.0, 50.0, -2.0))
    reports.take(report(altitude_type=0, flags=1 | 2), T)
    (got,) = reports.drain()
    assert math.isnan(got.geometric_altitude) and got.pressure_altitude > 1000.0
    assert math.isnan(got.velocity_north) and got.info.callsign is None
    for wrong in (report(flags=2), report(tslc=200), report(lat=2_000_000_000)):
        reports.take(wrong, T)
    assert reports.drain() == []
    assert counts["traffic without a position"] == 2 and counts["traffic too old"] == 1


def test_what_we_told_does_not_come_back_as_traffic() -> None:
    counts: Counter[str] = Counter()
    reports = TrafficReports(counts)
    reports.tell(0xABC123, T)
    reports.take(report(), T + 1)
    assert reports.drain() == [] and counts["our own traffic came back"] == 1
    reports.take(report(), T + 60)
    assert len(reports.drain()) == 1


def test_remote_id_of_others_but_not_our_own() -> None:
    counts: Counter[str] = Counter()
    reports = TrafficReports(counts)
    sender, nobody = bytes(range(1, 21)), bytes(20)
    at = report()
    location = [2, 18000, 1500, -100, at.lat, at.lon, -1000.0, 1490.0, 0, 90.0, 3, 3, 3, 3, 0.0, 0]
    reports.take(mavlink.MAVLink_open_drone_id_basic_id_message(0, 0, sender, 1, 2, b"FA3ABC" + bytes(14)), T)
    reports.take(mavlink.MAVLink_open_drone_id_location_message(0, 0, sender, *location), T)
    reports.take(mavlink.MAVLink_open_drone_id_location_message(0, 0, nobody, *location), T)
    (got,) = reports.drain()
    assert got.address.startswith("~") and len(got.address) == 7
    assert got.info.callsign == "FA3ABC"
    assert (got.velocity_north, got.climb_rate, got.geometric_altitude) == pytest.approx((-15.0, -1.0, 1490.0))
    assert math.isnan(got.pressure_altitude)
    assert counts["own Remote ID"] == 1


def test_tracks_go_out_once_a_second_and_come_back_the_same() -> None:
    out = TrafficMessages()
    mine = [
        track("a1b2c3", "N1"),
        track("T7"),
        track("d0d0d0", sources=("autopilot",)),
        track("e0e0e0", is_ownship=True),
    ]
    told = messages(out, T, snapshot(mine, []), "ADSB_VEHICLE")
    assert [m.ICAO_address for m in told] == [0xA1B2C3, 0xFF000000]
    assert messages(out, T + 0.5, snapshot(mine, []), "ADSB_VEHICLE") == []
    assert len(messages(out, T + 1.0, snapshot(mine, []), "ADSB_VEHICLE")) == 2
    codec = mavlink.MAVLink(None, 1, 1)
    decoded = mavlink.MAVLink(None, 2, 1).parse_buffer(told[0].pack(codec))[0]
    reports = TrafficReports(Counter())
    reports.take(decoded, T)
    (got,) = reports.drain()
    assert np.allclose(FRAME.to_ned(got.latitude, got.longitude, got.geometric_altitude), place(500, 100), atol=0.05)
    assert (got.velocity_north, got.velocity_east, got.climb_rate) == pytest.approx((-30.0, 5.0, 2.0), abs=0.02)


def test_threat_levels_are_the_true_ones() -> None:
    levels = {
        AlertLevel.PREVENTIVE: mavlink.MAV_COLLISION_THREAT_LEVEL_LOW,
        AlertLevel.CORRECTIVE: mavlink.MAV_COLLISION_THREAT_LEVEL_HIGH,
        AlertLevel.WARNING: mavlink.MAV_COLLISION_THREAT_LEVEL_HIGH,
    }
    for level, wanted in levels.items():
        (told,) = messages(TrafficMessages(), T, snapshot([track("a1b2c3")], [threat("a1b2c3", level)]), "COLLISION")
        assert (told.id, told.threat_level, told.action) == (0xA1B2C3, wanted, mavlink.MAV_COLLISION_ACTION_REPORT)
        assert (told.time_to_minimum_delta, told.altitude_minimum_delta, told.horizontal_minimum_delta) == (12, 15, 80)
    clear = snapshot([track("a1b2c3")], [threat("a1b2c3", AlertLevel.CLEAR)])
    out = TrafficMessages()
    assert messages(out, T, clear, "COLLISION") == []
    messages(out, T, snapshot([track("a1b2c3")], [threat("a1b2c3", AlertLevel.WARNING)]), "COLLISION")
    (told,) = messages(out, T + 0.1, clear, "COLLISION")  # the end is told at once
    assert told.threat_level == mavlink.MAV_COLLISION_THREAT_LEVEL_NONE


def test_the_action_is_the_maneuvers() -> None:
    for up, action in ((0.0, mavlink.MAV_COLLISION_ACTION_MOVE_HORIZONTALLY), (60.0, 2)):
        flown = Maneuver(T, np.array([place(100, 50, 100 + up)]), np.array([T + 5]), "why", T + 9, ("a1b2c3",))
        shot = snapshot([track("a1b2c3")], [threat("a1b2c3", AlertLevel.WARNING)], flown)
        assert messages(TrafficMessages(), T, shot, "COLLISION")[0].action == action


def test_texts_have_callsigns_and_are_cut_into_pieces() -> None:
    out = TrafficMessages()
    messages(out, T, snapshot([track("a1b2c3", "N123AB")], [threat("a1b2c3", AlertLevel.WARNING)]), "COLLISION")
    (text,) = out.texts(T)
    assert (text.text, text.severity) == ("N123AB warning in 12 s, miss 80 m", 4)
    out.say("x" * 120)
    assert list(out.texts(T + 0.1)) == []  # not so fast
    pieces = list(out.texts(T + 0.3))
    assert [len(p.text) for p in pieces] == [50, 50, 20]
    assert [p.chunk_seq for p in pieces] == [0, 1, 2] and len({p.id for p in pieces}) == 1
    for k in range(100):
        out.say(str(k))
    told = [p.text for s in range(100) for p in out.texts(T + 1 + s)]
    assert told == [str(k) for k in range(88, 100)]  # the oldest are dropped


def test_unknown_traffic_is_said() -> None:
    out = TrafficMessages()
    messages(out, T, snapshot([], [], alert=AlertLevel.UNKNOWN), "COLLISION")
    assert "unknown" in next(iter(out.texts(T))).text
    messages(out, T, snapshot([], []), "COLLISION")
    assert "known again" in next(iter(out.texts(T + 1))).text


def test_modes_have_their_names() -> None:
    assert [k.mode_name(k.mission_mode) for k in KINDS] == ["AUTO", "AUTO", "MISSION", "MISSION"]
    assert [k.mode_name(k.guided_mode) for k in KINDS] == ["GUIDED", "GUIDED", "OFFBOARD", "OFFBOARD"]
    assert [k.mode_name(k.loiter_mode) for k in KINDS] == ["LOITER", "LOITER", "HOLD", "HOLD"]
    assert PX4_COPTER.mission_mode == px4_mode(4, 4) == 0x04040000
    assert COPTER.mode_name(77) == "mode 77"
    assert kind_of(3, 2) == COPTER and kind_of(12, 13) == PX4_COPTER
    assert kind_of(3, 1).airframe == kind_of(3, 21).airframe == "plane"
    assert kind_of(0, 2).family == "other"


def test_set_points_run_ahead_on_the_leg_and_turn_at_the_waypoint() -> None:
    path = GuidedPath(place(0, 0), np.array([place(200, 0), place(200, 200)]), np.array([20.0, 40.0]), 0.0, 20.0)
    target, velocity = path.set_point(5.0, place(50, 10), 30.0)
    assert np.allclose(target, place(80, 0)) and np.allclose(velocity, [10, 0, 0], atol=0.2)
    target, _ = path.set_point(17.5, place(175, 0), 60.0)
    assert np.allclose(target, place(235, 0))  # beyond the waypoint, not round the corner
    target, velocity = path.set_point(18.5, place(185, 0), 30.0)  # the turn begins a radius before
    assert np.allclose(target, place(200, 30)) and velocity[1] > 9.0
    target, _ = path.set_point(60.0, place(200, 260), 30.0)
    assert np.allclose(target, place(200, 290))  # past the end: straight on
    late = GuidedPath(place(0, 0), np.array([place(200, 0)]), np.array([20.0]), 0.0, 5.0)
    _, velocity = late.set_point(15.0, place(20, 0), 5.0)
    assert velocity[0] == pytest.approx(13.0)  # faster to be in time, within limits


def test_heights_stay_between_those_of_the_ends() -> None:
    path = GuidedPath(place(0, 0, 100), np.array([place(100, 0, 60)]), np.array([10.0]), 0.0, 5.0)
    target, velocity = path.set_point(0.0, place(0, 0, 100), 50.0)
    assert np.allclose(target, place(50, 0, 80)) and velocity[2] > 0
    target, _ = path.set_point(9.0, place(90, 0, 64), 200.0)
    assert np.allclose(target, place(290, 0, 60))
    upright = GuidedPath(place(0, 0, 100), np.array([place(0, 0, 150)]), np.array([10.0]), 0.0, 5.0)
    target, velocity = upright.set_point(0.0, place(0, 0, 100), 5.0)
    assert np.allclose(target, place(0, 0, 150)) and velocity[2] < 0


def test_the_floor() -> None:
    low = np.array([place(10, 0, 5), place(20, 0, 90)])
    assert np.allclose(with_floor(low, HOME.altitude, 30.0)[:, 2], [-(HOME.altitude + 30), -(HOME.altitude + 90)])
    assert np.allclose(with_floor(low, math.nan, 30.0), low)


def test_a_connection_is_checked_when_it_is_read() -> None:
    assert MavlinkConfig(connection="serial:/dev/ttyUSB0:57600").connection
    for wrong in ("14550", "udp:14550", "foo:host:1", "udp:host:port"):
        with pytest.raises(ValueError, match="connection"):
            MavlinkConfig(connection=wrong)
