import math
from collections import Counter

import numpy as np
import pytest

from wideberth.sensors.adsb.gdl90 import messages as m
from wideberth.sensors.adsb.gdl90.framing import Deframer, crc, frame
from wideberth.sensors.adsb.gdl90.reader import Gdl90Reader

# Garmin 560-1058-00: the heartbeat of 2.2.4 and the traffic report of 3.5.2.
HEARTBEAT = bytes.fromhex("7E008141DBD00802B38B7E")
TRAFFIC = bytes.fromhex("1400AB4549 1FEF15 A88978 0F09A9 07B001 20 01 4E38323556202020 00".replace(" ", ""))
TARGET = m.TargetReport(0, 0xABCDEF, 45.0, -122.0, 5000.0, 123.0, 64.0, 45.0, nic=10, nacp=9, category=1)


def fed(*messages: bytes) -> tuple[Gdl90Reader, list]:
    reader = Gdl90Reader()
    return reader, reader.feed(b"".join(frame(message) for message in messages), 1000.0)


def test_the_document_s_heartbeat():
    assert frame(HEARTBEAT[1:-3]) == HEARTBEAT
    assert crc(HEARTBEAT[1:-3]) == 0x8BB3
    beat = m.decode_heartbeat(HEARTBEAT[1:-3])
    assert beat is not None
    assert (beat.position_valid, beat.utc_valid, beat.second_of_day) == (True, True, 53467)
    assert (beat.uplinks, beat.messages) == (1, 2)


def test_the_document_s_traffic_report():
    target = m.decode_target(TRAFFIC)
    assert target is not None
    assert target.address == 0xAB4549
    assert target.latitude == pytest.approx(44.90708, abs=2.2e-5)
    assert target.longitude == pytest.approx(-122.99488, abs=2.2e-5)
    assert (target.pressure_altitude, target.track_type, target.airborne) == (5000.0, m.TRUE_TRACK, True)
    assert (target.nic, target.nacp, target.speed, target.climb_rate) == (10, 9, 123.0, 64.0)
    assert (target.track, target.category, target.callsign, target.emergency) == (45.0, 1, "N825V", 0)
    assert m.encode_target(target) == TRAFFIC


def test_traffic_becomes_reports_and_the_ownship_is_kept_apart():
    own = m.TargetReport(0, 0x123456, 45.1, -122.1, 1000.0, 60.0, 0.0, 90.0, nic=8, nacp=8, callsign="OWN")
    reader, reports = fed(
        m.encode_target(own, m.OWNSHIP_REPORT),
        m.encode_altitude(m.OwnshipAltitude(1155.0, 4.0)),
        TRAFFIC,
    )
    (report,) = reports
    assert (report.t, report.address, report.info.callsign, report.info.category) == (1000.0, "ab4549", "N825V", "A1")
    assert report.pressure_altitude == pytest.approx(1524.0)
    assert report.velocity_north == pytest.approx(report.velocity_east)
    assert math.hypot(report.velocity_north, report.velocity_east) == pytest.approx(123.0 * 1852 / 3600)
    assert report.climb_rate == pytest.approx(64 * 0.3048 / 60)
    assert reader.ownship is not None
    assert reader.ownship.address == "123456"
    assert reader.ownship.geometric_altitude == pytest.approx(1155 * 0.3048)
    assert reader.ownship.info.callsign == "OWN"
    assert reader.addresses == ("ab4549",)
    assert reader.counters == {
        "messages": 3,
        "ownship reports": 1,
        "ownship altitudes": 1,
        "traffic reports": 1,
        "positions": 1,
    }


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"extrapolated": True}, "extrapolated by the receiver"),
        ({"airborne": False}, "surface"),
        ({"address_type": 4}, "surface"),
        ({"address_type": 5}, "surface"),
        ({"address_type": 9}, "address type not known"),
    ],
)
def test_traffic_that_is_left_out(change, cause):
    reader, reports = fed(m.encode_target(m.TargetReport(**{**{"address_type": 0, "address": 1}, **change})))
    assert reports == []
    assert reader.rejects == {cause: 1}


@pytest.mark.parametrize("kind", [m.TRUE_HEADING, m.MAGNETIC_HEADING])
def test_a_heading_is_no_track(kind):
    target = m.TargetReport(0, 1, 45.0, 9.0, 1000.0, 100.0, 64.0, 90.0, kind, nic=5)
    _, (report,) = fed(m.encode_target(target))
    assert math.isnan(report.velocity_north)
    assert report.climb_rate > 0.0


def test_addresses_that_are_no_icao_ones_are_marked():
    for kind, mark in ((0, ""), (1, "~"), (2, ""), (3, "~")):
        _, (report,) = fed(m.encode_target(m.TargetReport(kind, 0xABC, 45.0, 9.0, nic=5)))
        assert report.address == mark + "000abc"


def test_no_data_is_nan():
    target = m.decode_target(m.encode_target(m.TargetReport(0, 1)))
    assert target is not None
    for name in ("latitude", "longitude", "pressure_altitude", "speed", "climb_rate", "track"):
        assert math.isnan(getattr(target, name))
    # On the equator, with a NIC, zero is a place.
    target = m.decode_target(m.encode_target(m.TargetReport(0, 1, 0.0, 0.0, nic=1)))
    assert target is not None
    assert (target.latitude, target.longitude) == (0.0, 0.0)
    altitude = m.decode_altitude(m.encode_altitude(m.OwnshipAltitude(-100.0, warning=True)))
    assert altitude is not None
    assert (altitude.altitude, altitude.warning) == (-100.0, True)
    assert math.isnan(altitude.figure_of_merit)


def test_streams_cut_anywhere_give_the_same():
    stream = frame(TRAFFIC) + HEARTBEAT + frame(m.encode_target(TARGET)) * 2
    whole = Gdl90Reader()
    expected = whole.feed(stream, 1.0)
    for size in (1, 2, 7, 33):
        reader = Gdl90Reader()
        reports = [r for k in range(0, len(stream), size) for r in reader.feed(stream[k : k + size], 1.0)]
        assert reports == expected
        assert reader.counters == whole.counters


def test_damage_is_counted():
    rejects: Counter[str] = Counter()
    frames = Deframer(rejects)
    damaged = bytearray(HEARTBEAT)
    damaged[4] ^= 1
    assert frames.feed(b"rubbish" + bytes(damaged) + HEARTBEAT) == [HEARTBEAT[1:-3]]
    assert rejects == {"bytes outside of a message": 1, "crc failed": 1}
    assert frames.feed(b"\x01\x7d\x7e\x01\x02\x7e") == []
    assert rejects["escape without a byte"] == 1
    assert rejects["message too short"] == 1
    frames.feed(b"\x7e" + bytes(5000))
    assert rejects["message too long"] == 1
    frames.feed(b"\x7e\x00\x01")
    frames.restart()
    assert rejects["message cut by the end"] == 1
    assert frames.feed(HEARTBEAT) == [HEARTBEAT[1:-3]]


@pytest.mark.parametrize("number", [m.HEARTBEAT, m.OWNSHIP_REPORT, m.OWNSHIP_ALTITUDE, m.TRAFFIC_REPORT])
def test_messages_of_another_length_are_refused(number):
    for size in (0, 3, 60):
        reader, reports = fed(bytes([number]) + bytes(size))
        assert reports == []
        assert reader.rejects == {"wrong length": 1}


def test_without_times_of_receipt_the_heartbeat_s_count_over_midnight():
    reader = Gdl90Reader()
    stream = []
    for k, second in enumerate((86399, 0)):
        stream.append(m.encode_heartbeat(m.Heartbeat(True, True, second)))
        stream.append(m.encode_target(m.TargetReport(0, 1, 45.0 + 1e-3 * k, 9.0, nic=5)))
    reports = reader.feed(b"".join(map(frame, stream)))
    assert [report.t for report in reports] == [86399.0, 86400.0]
    assert reader.feed(frame(m.encode_heartbeat(m.Heartbeat(True, True, 0))[:2] + b"\x81\xff\xff\0\0")) == []
    assert reader.rejects == {"time not of a day": 1}


def test_what_no_message_can_hold():
    for target in (
        m.TargetReport(0, 1 << 24),
        m.TargetReport(16, 1),
        m.TargetReport(0, 1, 91.0, 0.0),
        m.TargetReport(0, 1, 0.0, 181.0),
        m.TargetReport(0, 1, speed=math.inf),
    ):
        with pytest.raises(ValueError):
            m.encode_target(target)
    with pytest.raises(ValueError, match="not finite"):
        m.encode_altitude(m.OwnshipAltitude(math.nan))
    held = m.decode_target(m.encode_target(m.TargetReport(0, 1, pressure_altitude=1e6, speed=1e6, climb_rate=-1e6)))
    assert held is not None
    assert (held.pressure_altitude, held.speed, held.climb_rate) == (101_350.0, 4094.0, -32_640.0)


def test_a_million_random_bytes():
    random = np.random.default_rng(7)
    reader = Gdl90Reader()
    for k in range(1000):
        for report in reader.feed(random.bytes(1024), float(k)):
            assert not math.isinf(report.velocity_north)
    assert reader.counters["crc failed"] > 100
    assert reader.counters["messages"] < 10
    assert sum(reader.rejects.values()) > 1000
