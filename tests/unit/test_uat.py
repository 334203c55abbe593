import math

import numpy as np
import pytest

from wideberth.sensors.adsb.uat import messages as m
from wideberth.sensors.adsb.uat.reader import UatReader

# Of a recording (Stratux): a TIS-B track.
LINE = "1525718854,-0b2ac5a73931599418ae0816009632c01105c4e6c4e6c40ac2700300000000000000;rs=1;"
STATUS = m.ModeStatus(1, "N123AB", True, 0, 2, 3, 2, 9, 2, True, False, True, True)
MESSAGE = m.UatMessage(
    m.ICAO, 0xA12345, 40.5, -75.25, 8, 2500.0, 2625.0, m.AIRBORNE, 100.0, -50.0, 640.0, status=STATUS
)


def line(message: m.UatMessage, t: float | None = None) -> bytes:
    return f"-{m.encode(message).hex()};{'' if t is None else f't={t:.3f};'}\n".encode()


def test_a_recorded_message():
    message = m.decode(bytes.fromhex(LINE.split("-")[1].split(";")[0]))
    assert not isinstance(message, str)
    assert (message.qualifier, message.address, message.nic) == (m.TISB_TRACK, 0x2AC5A7, 6)
    assert message.latitude == pytest.approx(40.21365, abs=1e-5)
    assert message.longitude == pytest.approx(-75.86972, abs=1e-5)
    assert message.pressure_altitude == 2200.0
    assert math.isnan(message.geometric_altitude)
    assert (message.velocity_north, message.velocity_east, message.climb_rate) == (36.0, -100.0, 0.0)
    assert message.status is not None
    assert (message.status.callsign, message.status.version, message.status.nacp) == ("", 2, 7)


@pytest.mark.parametrize(
    "message",
    [
        MESSAGE,
        m.UatMessage(m.ICAO, 1),
        m.UatMessage(m.OTHER, 0xFFFFFF, -89.99, 179.99, 11, geometric_altitude=-1000.0, velocity_north=0.0),
        m.UatMessage(m.ICAO, 2, state=m.SUPERSONIC, velocity_north=1600.0, velocity_east=-4088.0, climb_rate=-32640.0),
        m.UatMessage(m.ICAO, 3, 10.0, 20.0, 5, state=m.ON_GROUND, ground_speed=12.0, ground_track=270.0),
        m.UatMessage(m.TISB_ICAO, 4, 0.0, 0.0, 1, 0.0, geometric_climb=True, climb_rate=64.0),
        m.UatMessage(m.ICAO, 5, 1.0, 1.0, 5, 0.0, status=m.ModeStatus(version=1, acas_active=True, receives=True)),
        m.UatMessage(m.ICAO, 6, 1.0, 1.0, 5, 0.0, status=m.ModeStatus(callsign="1200", is_callsign=False)),
    ],
)
def test_messages_go_round(message):
    found = m.decode(m.encode(message))
    assert not isinstance(found, str)
    for name in m.UatMessage.__dataclass_fields__:
        wanted, got = getattr(message, name), getattr(found, name)
        if name == "status" and wanted is None:
            continue
        if isinstance(wanted, float) and math.isnan(wanted):
            assert math.isnan(got), name
        elif name in ("latitude", "longitude"):
            assert got == pytest.approx(wanted, abs=1.1e-5)
        elif name == "geometric_climb" and math.isnan(message.climb_rate):
            continue
        else:
            assert got == wanted, name


def test_bits_lie_where_the_document_puts_them():
    payload = bytearray(m.SHORT_BYTES)
    payload[0] = 0b00000_010
    payload[1:4] = b"\xab\xcd\xef"
    payload[9] |= 1  # byte 10, bit 8: geometric altitude
    payload[10], payload[11] = 0x02, 0xA5  # byte 11, 1 to byte 12, 4: 0x02A; then NIC 5
    payload[12] |= 0b000_1_0000  # south
    payload[13] |= 0b000101_00  # 5: 4 kt
    message = m.decode(bytes(payload))
    assert not isinstance(message, str)
    assert (message.qualifier, message.address, message.nic) == (m.TISB_ICAO, 0xABCDEF, 5)
    assert message.geometric_altitude == 25.0
    assert message.velocity_north == -4.0
    assert (message.latitude, message.longitude) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("payload", "cause"),
    [
        (b"", "wrong length"),
        (bytes(17), "wrong length"),
        (bytes(34), "payload type and length do not agree"),
        (bytes([8]) + bytes(17), "payload type and length do not agree"),
        (bytes([88]) + bytes(33), "payload type not known"),
    ],
)
def test_payloads_that_are_none(payload, cause):
    assert m.decode(payload) == cause


def test_what_no_payload_can_hold():
    for message in (
        m.UatMessage(8, 1),
        m.UatMessage(0, 1 << 24),
        m.UatMessage(0, 1, 91.0, 0.0),
        m.UatMessage(0, 1, pressure_altitude=math.inf),
        m.UatMessage(0, 1, velocity_north=math.inf),
    ):
        with pytest.raises(ValueError):
            m.encode(message)
    held = m.decode(m.encode(m.UatMessage(0, 1, pressure_altitude=1e6, velocity_north=1e6, climb_rate=-1e6)))
    assert not isinstance(held, str)
    assert (held.pressure_altitude, held.velocity_north, held.climb_rate) == (101_350.0, 1022.0, -32_640.0)


def test_lines_become_reports_with_what_the_aircraft_says():
    reader = UatReader()
    (report,) = reader.feed(line(MESSAGE, 1000.25))
    assert (report.t, report.address) == (1000.25, "a12345")
    assert report.pressure_altitude == pytest.approx(762.0)
    assert report.geometric_altitude == pytest.approx(800.1)
    assert report.velocity_north == pytest.approx(100 * 1852 / 3600)
    info = report.info
    assert (info.callsign, info.category, info.nic, info.nacp, info.nacv) == ("N123AB", "A1", 8, 9, 2)
    assert (info.sil, info.sda, info.emergency, info.ident) == (3, 2, "none", True)
    assert (info.tcas_equipped, info.tcas_advisory, info.adsb_in) == (True, False, True)
    squawk = m.UatMessage(m.ICAO, 9, 1.0, 1.0, 5, status=m.ModeStatus(callsign="7600", is_callsign=False, emergency=4))
    (report,) = reader.feed(line(squawk, 1000.5))
    assert (report.info.callsign, report.info.squawk, report.info.emergency) == (None, "7600", "no communication")


def test_half_a_velocity_is_none():
    (report,) = UatReader().feed(line(m.UatMessage(m.ICAO, 9, 1.0, 1.0, 5, velocity_north=10.0)), 1.0)
    assert math.isnan(report.velocity_north)
    assert math.isnan(report.velocity_east)


def test_times_of_a_log_of_receipt_and_of_none():
    log = b"START,Mon Sep 7 14:17:41 +0000 UTC 2015\n\n" + LINE.encode() + b"\n"
    (report,) = UatReader().feed(log)
    assert report.t == pytest.approx(1441635461.0 + 1.525718854)
    (report,) = UatReader().feed(LINE.encode() + b"\n", 5.0)
    assert report.t == 5.0
    (report,) = UatReader().feed(line(MESSAGE))
    assert report.t == 0.02


def test_what_is_left_out_is_counted():
    reader = UatReader()
    ground = m.UatMessage(m.ICAO, 1, 1.0, 1.0, 5, state=m.ON_GROUND, ground_speed=3.0)
    lines = [
        line(ground),
        line(m.UatMessage(m.VEHICLE, 1, 1.0, 1.0, 5)),
        line(m.UatMessage(7, 1, 1.0, 1.0, 5)),
        line(m.UatMessage(m.ICAO, 1, 1.0, 1.0, 5, state=3)),
        b"-0b2;\n",
        b"rubbish\n",
        b"-0b2a;\n",
        b"+38d0c5;rs=1;\n",
        b"!fecfix=1;program=dump978;\n",
        b"START,not a time\n",
    ]
    assert reader.feed(b"".join(lines), 1.0) == []
    assert reader.rejects == {"surface": 2, "field out of range": 2, "line not understood": 3, "wrong length": 1}
    assert reader.counters["ground uplinks (not used)"] == 1
    assert reader.counters["messages"] == 6


def test_lines_cut_anywhere():
    stream = line(MESSAGE, 1.0) + LINE.encode()
    reader = UatReader()
    reports = [r for k in range(len(stream)) for r in reader.feed(stream[k : k + 1], 1.0)]
    assert len(reports) == 1
    assert len(reader.finish()) == 1
    reader.feed(b"-0b2ac5a7", 1.0)
    reader.restart()
    assert len(reader.feed(line(m.UatMessage(m.ICAO, 7, 1.0, 1.0, 5)), 1.0)) == 1


def test_random_payloads_never_raise():
    random = np.random.default_rng(11)
    reader = UatReader()
    reports = []
    for k in range(400):
        reports += reader.feed(random.bytes(2500), float(k))
        payloads = [random.bytes(34 if random.random() < 0.8 else 18).hex() for _ in range(5)]
        reports += reader.feed("".join(f"-{payload};\n" for payload in payloads).encode(), float(k))
    assert reader.counters["messages"] >= 1000
    assert sum(reader.rejects.values()) > 1000
    for report in reports:
        assert not math.isinf(report.velocity_north)
        assert math.isnan(report.latitude) or abs(report.latitude) <= math.pi / 2
