import math
from collections import Counter

import numpy as np
import pytest

from wideberth.errors import InputError
from wideberth.frames import LocalFrame, rotation_ned_body
from wideberth.links.config import RadarUdpConfig
from wideberth.links.radar_udp import RadarUdpReader
from wideberth.live.sender_outputs import TcpOutput, UdpOutput, parse_host_port
from wideberth.live.sender_sources import radar_scans, reports_of_scans
from wideberth.live.senders import RadarPackets, TrafficPackets, send
from wideberth.sensors.adsb.gdl90.reader import Gdl90Reader
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Scan, SourceInfo


class Kept:
    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.counters: Counter[str] = Counter()

    def send(self, data: bytes) -> None:
        self.sent.append(data)

    def describe(self) -> str:
        return "kept"

    def close(self) -> None:
        pass


class Clock:
    def __init__(self) -> None:
        self.t = 50.0
        self.slept: list[float] = []

    def now(self) -> float:
        return self.t

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.t += seconds


def scan(sensor="radar", t=10.0, kind="radar", attitude=None, n=2) -> Scan:
    z = np.tile([100.0, 0.1, 0.2, -3.0], (n, 1))
    r = np.tile(np.diag([0.25, 1e-4, 1e-4, 0.01]), (n, 1, 1))
    pose = np.eye(3) if attitude is None else attitude
    return Scan(t, t, sensor, kind, z, r, np.full(n, t), sensor_attitude=pose)


def test_pieces_are_sent_at_their_times_with_those_of_the_clock():
    clock, output, stamps = Clock(), Kept(), []

    def encode(piece, t):
        stamps.append(t)
        return [bytes([x]) for x in piece]

    pieces = [(1000.0, [1]), (1000.5, [2, 3]), (1000.4, [4]), (1002.0, [])]
    sent = send(
        iter(pieces), encode, len, output, speed=2.0, monotonic=clock.now, wall=lambda: 7e8 + clock.t, sleep=clock.sleep
    )
    assert clock.slept == [0.25, 0.75]
    np.testing.assert_allclose(np.array(stamps) - 7e8 - 50.0, [0.0, 0.25, 0.25, 1.0], atol=1e-6)
    assert output.sent == [b"\x01", b"\x02", b"\x03", b"\x04"]
    assert (sent.packets, sent.values, sent.octets, sent.late, sent.elapsed) == (4, 4, 4, 0, 2.0)


def test_what_is_sent_too_late_is_counted():
    clock = Clock()

    def encode(piece, t):
        clock.t += 1.0
        return []

    pieces = iter([(0.0, [1]), (0.1, [1]), (0.2, [1])])
    assert send(pieces, encode, len, Kept(), monotonic=clock.now, wall=clock.now, sleep=clock.sleep).late == 2
    with pytest.raises(ValueError, match="must be positive"):
        send(iter([]), encode, len, Kept(), speed=0.0)


def test_our_packets_are_numbered_by_radar():
    packets = RadarPackets("wideberth", 7)
    units = [{"name": "a", "radar_id": 7}, {"name": "b", "radar_id": 8}]
    reader = RadarUdpReader(RadarUdpConfig(units=units))
    for k in range(3):
        for sensor, kind in (("x", "radar"), ("y", "radar_cone")):
            (found,) = reader.feed(packets.encode(scan(sensor, kind=kind), 5.0 + k), 5.0 + k)
            assert (found.sensor, found.kind) == ({"x": "a", "y": "b"}[sensor], kind)
            np.testing.assert_allclose(found.z, scan().z, rtol=1e-6)
            np.testing.assert_allclose(found.R, scan().R, rtol=1e-6)
    assert "packets lost" not in reader.counters


def test_the_thesis_s_packets_are_of_one_radar():
    packets = RadarPackets("thesis")
    (found,) = RadarUdpReader(RadarUdpConfig(packet="thesis")).feed(packets.encode(scan(kind="radar_cone"), 5.0), 5.0)
    np.testing.assert_allclose(found.z[:, :2], scan().z[:, :2], rtol=1e-6)
    with pytest.raises(InputError, match="choose one with --sensor"):
        packets.encode(scan("other"), 5.0)


def test_asterix_is_of_level_radars():
    pytest.importorskip("asterix", reason="libasterix is not installed: pip install 'wideberth[links]'")
    from wideberth.links.asterix.reader import AsterixReader
    from wideberth.links.config import AsterixConfig

    packets = RadarPackets("asterix", 258)
    turned = rotation_ned_body(0.0, 0.0, 0.5)
    config = AsterixConfig(units=[{"radar_id": 258, "boresight_azimuth_deg": math.degrees(0.5)}])
    (found,) = AsterixReader(config).feed(packets.encode(scan(attitude=turned), 5.0), 5.0)
    np.testing.assert_allclose(found.z[:, 1], 0.1, atol=1e-4)
    for wrong in (scan(attitude=rotation_ned_body(0.0, 0.1, 0.0)), scan(kind="radar_cone")):
        with pytest.raises(InputError, match="tilted or a line array"):
            packets.encode(wrong, 5.0)
    with pytest.raises(InputError, match="does not fit"):
        far = scan()
        far.z[:, 0] = 1e6
        packets.encode(far, 5.0)


def test_gdl90_has_a_heartbeat_a_second():
    packets, reader = TrafficPackets("gdl90"), Gdl90Reader()
    for k in range(21):
        for data in packets.encode([AdsbReport(0.0, "abc123", 0.5 + 1e-6 * k, 0.1, 100.0)], 1000.0 + 0.1 * k):
            reader.feed(data, 0.0)
    assert reader.counters["heartbeats"] == 3
    assert reader.counters["traffic reports"] == 21


@pytest.mark.parametrize("fmt", ["sbs", "beast", "uat", "gdl90"])
def test_every_format_of_traffic_is_sent(fmt):
    assert b"".join(TrafficPackets(fmt).encode([AdsbReport(0.0, "abc123", 0.5, 0.1, 100.0)], 1000.0))


def test_formats_that_are_not_known():
    with pytest.raises(InputError, match="use one of wideberth, thesis, asterix"):
        RadarPackets("x")
    with pytest.raises(InputError, match="use one of gdl90"):
        TrafficPackets("x")


def test_scans_of_radars_and_reports_of_the_others():
    frame = LocalFrame(0.7, -1.3)
    z = np.array([[1000.0, -500.0, -300.0, 20.0, 5.0, -1.0], [np.nan, np.nan, -310.0, np.nan, np.nan, np.nan]])
    info = SourceInfo(callsign="AB1")
    adsb = Scan(1.0, 1.0, "adsb", "adsb", z, np.zeros((2, 6, 6)), np.array([0.9, 1.0]), ("abc123",) * 2, (info,) * 2)
    steps = [(1.0, [scan(t=0.95), adsb, scan("b", t=1.0)])]
    assert [(t, s.sensor) for t, (s,) in radar_scans(iter(steps))] == [(0.95, "radar"), (1.0, "b")]
    assert [s.sensor for _, (s,) in radar_scans(iter(steps), "b")] == ["b"]
    ((t, reports),) = reports_of_scans(iter(steps), frame)
    assert t == 1.0
    np.testing.assert_allclose(frame.to_ned(reports[0].latitude, reports[0].longitude, 300.0), z[0, :3], atol=1e-6)
    assert reports[0].pressure_altitude == 300.0
    assert reports[0].climb_rate == pytest.approx(1.0)
    assert reports[0].info.callsign == "AB1"
    assert math.isnan(reports[1].latitude)
    assert reports[1].pressure_altitude == 310.0


@pytest.mark.parametrize("text", ["", "localhost", "localhost:x", "localhost:70000", "a:-1"])
def test_addresses_that_are_none(text):
    with pytest.raises(InputError, match="HOST:PORT"):
        parse_host_port(text)


def test_addresses():
    assert parse_host_port("4000") == ("127.0.0.1", 4000)
    assert parse_host_port("[::1]:5") == ("::1", 5)


def test_outputs_that_cannot_be_are_refused():
    server = TcpOutput("127.0.0.1", 0)
    with pytest.raises(InputError, match="cannot listen there"):
        TcpOutput("127.0.0.1", server.port)
    server.close()
    with pytest.raises(InputError, match=r"no\.such\.host"):
        UdpOutput("no.such.host.invalid", 1)
