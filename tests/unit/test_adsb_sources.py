import gzip
import io
import json
import math
import socket
import sys
import time

import numpy as np
import pytest

from tests import adsb_frames as encoder
from wideberth.errors import InputError
from wideberth.sensors.adsb.formats import READERS, detect
from wideberth.sensors.adsb.gdl90 import of_report as gdl90
from wideberth.sensors.adsb.live import LiveSource, parse_address
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.sbs import SbsReader
from wideberth.sensors.adsb.sources import open_traffic
from wideberth.sensors.adsb.uat import of_report as uat

REPORT = AdsbReport(1441635461.0, "abcdef", 0.8, 0.1, 900.0)
FLIGHT = encoder.flight(0x393322, duration=30.0)
JSON = "".join(json.dumps({"timestamp": t, "frame": frame.hex()}) + "\n" for t, frame in FLIGHT).encode()
CONTENT = {
    "frames": JSON,
    "beast": b"".join(encoder.beast(frame, int(t * 12e6)) for t, frame in FLIGHT),
    "avr": "".join(f"@{int(t * 12e6):012x}{frame.hex()};\n" for t, frame in FLIGHT).encode(),
    "avr-untimed": "".join(f"*{frame.hex()};\n" for _, frame in FLIGHT).encode(),
    "sbs": b"MSG,3,1,1,ABCDEF,1,2015/09/02,04:23:37.000,,,,3000,,,48.5,2.1,,,0,0,0,0\r\n",
    "uat": uat.encode(REPORT),
    "gdl90": gdl90.heartbeat(REPORT.t) + gdl90.encode(REPORT),
    "trajectories": b'[{"timestamp": 1633608773000, "icao24": "abcdef", "latitude": 48.5, "longitude": 2.1}]',
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("fmt", CONTENT)
def test_formats_are_told_apart(tmp_path, fmt, packed):
    path = tmp_path / "traffic"
    path.write_bytes(gzip.compress(CONTENT[fmt]) if packed else CONTENT[fmt])
    source = open_traffic(str(path))
    assert source.format == fmt
    assert source.poll(math.inf)
    assert source.exhausted
    assert not source.live
    assert source.addresses
    source.close()


def test_standard_input(monkeypatch):
    class Stdin:
        buffer = io.BufferedReader(io.BytesIO(gzip.compress(JSON)))

    monkeypatch.setattr(sys, "stdin", Stdin)
    source = open_traffic("-")
    assert source.name == "standard input"
    assert len(source.poll(math.inf)) == 120


def test_several_gzip_members(tmp_path):
    path = tmp_path / "traffic.gz"
    path.write_bytes(gzip.compress(JSON[:5000]) + gzip.compress(JSON[5000:]) + bytes(100))
    source = open_traffic(str(path))
    assert len(source.poll(math.inf)) == 120
    assert source.health(0.0).rejects == {}


def test_truncated_and_damaged_gzip(tmp_path):
    path = tmp_path / "traffic.gz"
    packed = gzip.compress(JSON, mtime=0)
    path.write_bytes(packed[:-200])
    source = open_traffic(str(path))
    assert 20 < len(source.poll(math.inf)) < 120
    assert source.health(0.0).rejects["truncated gzip"] == 1
    path.write_bytes(packed[:-200] + bytes([packed[-200] ^ 255]) + packed[-199:])
    assert open_traffic(str(path)).health(0.0).rejects["damaged gzip"] == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (b"\x1f\x8b\x08\x00", "truncated gzip"),
        (b"hello\nworld\n", "none of the known formats"),
        (np.random.default_rng(0).bytes(1_000_000), "none of the known formats"),
        (b'{"a": 1}\n', "neither a list of trajectory rows nor lines with a frame"),
        (
            b"1,-00a66ef1a9c5;rs=1;\n597318177,+38d0c59482f6a3901e80067437703455;rs=1;\n",
            "ground uplinks .* 1, wrong length 1",
        ),
        (b"[1, 2]", "nothing in traffic .* can be used .*row not understood 2"),
        (b"*8d4840d6202cc371c32ce0576099;\n", "nothing in traffic .* can be used .*crc failed 1"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_cause(tmp_path, content, message):
    path = tmp_path / "traffic"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        open_traffic(str(path))


@pytest.mark.parametrize(
    ("spec", "fmt", "message"),
    [
        ("missing.json", "auto", "does not exist"),
        (".", "auto", "is a folder"),
        ("x", "beats", "unknown traffic format 'beats': use one of auto, trajectories"),
        ("http://localhost:80", "auto", "beast://, avr://, sbs://, uat://, gdl90://"),
        ("beast://localhost", "auto", "give host and port"),
        ("beast://localhost:port", "auto", "give host and port"),
        ("beast://:30005", "auto", "give host and port"),
        ("uat://:30978", "auto", "give host and port"),
        ("beast://localhost:30005", "sbs", "cannot be 'sbs'"),
    ],
)
def test_wrong_names_are_refused(spec, fmt, message):
    with pytest.raises(InputError, match=message):
        open_traffic(spec, fmt)


@pytest.mark.parametrize("fmt", READERS)
def test_random_bytes_forced_into_any_format(tmp_path, fmt):
    path = tmp_path / "random"
    path.write_bytes(np.random.default_rng(1).bytes(1_000_000))
    with pytest.raises(InputError, match=r"nothing in traffic .* can be used"):
        open_traffic(str(path), fmt)


def test_detection_ignores_a_byte_order_mark():
    assert detect(b"\xef\xbb\xbf" + CONTENT["trajectories"], "x") == "trajectories"


def test_poll_gives_what_was_received_until_then(tmp_path):
    path = tmp_path / "traffic"
    path.write_bytes(JSON)
    source = open_traffic(str(path))
    assert source.t_first == 1000.0
    assert source.poll(999.0) == []
    assert source.health(999.0).state == "no report yet"
    first = source.poll(1010.0)
    assert [r.t for r in first] == [t for t, _ in FLIGHT if t <= 1010.0]
    health = source.health(1010.0)
    assert (health.age, health.state) == (0.0, "ok")
    assert health.rate == pytest.approx(4.0, abs=0.5)
    assert source.health(1025.0).state == "silent for 15 s"
    assert len(source.poll(1100.0)) == len(FLIGHT) - len(first)
    assert source.exhausted
    assert source.health(1100.0).state == "recording ended"


def until(condition):
    end = time.time() + 20.0
    while time.time() < end:
        if condition():
            return
        time.sleep(0.02)
    pytest.fail("not within 20 s")


def test_live_source_through_silence_and_reconnection():
    server = socket.create_server(("127.0.0.1", 0))
    port = server.getsockname()[1]
    source = LiveSource("sbs://x", SbsReader(), "127.0.0.1", port, silent_after=0.3, first_wait=0.1, longest_wait=0.3)
    try:
        connection, _ = server.accept()
        until(lambda: "connected" in source.health(time.time()).state)
        until(lambda: source.health(time.time()).state.startswith("silent for"))
        assert math.isinf(source.health(time.time()).age)
        connection.sendall(CONTENT["sbs"] + b"MSG,3,1,1,ABC")
        until(lambda: source.health(time.time()).state == "ok")
        report = source.poll(time.time())[0]
        assert report.t == pytest.approx(time.time(), abs=20)
        assert source.health(time.time()).rate > 0
        until(lambda: source.health(time.time()).state.startswith("silent for"))
        server.close()
        connection.close()
        until(lambda: source.health(time.time()).state.startswith("reconnecting in"))
        server = socket.create_server(("127.0.0.1", port))
        connection, _ = server.accept()
        connection.sendall(CONTENT["sbs"].replace(b"48.5", b"48.501"))
        reports = []
        until(lambda: reports.extend(source.poll(time.time())) or reports)
        assert source.counters["connections"] == 2
        assert source.counters["messages"] == 2  # the line that was cut is forgotten
        assert not source.exhausted
        connection.close()
    finally:
        source.close()
        server.close()
    assert source.exhausted
    assert source.health(time.time()).state == "closed"


def test_a_receiver_that_is_not_there_is_reported():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    source = open_traffic(f"beast://127.0.0.1:{port}")
    try:
        until(lambda: "refused" in source.health(time.time()).state)
        assert source.poll(time.time()) == []
        assert source.live
    finally:
        source.close()


def test_addresses_of_receivers():
    assert parse_address("sbs://[::1]:30003") == ("sbs", "::1", 30003)
    assert parse_address("beast://radio.local:30005") == ("beast", "radio.local", 30005)


def test_datagrams_are_listened_for_and_a_port_in_use_is_said():
    assert parse_address("gdl90://:4000") == ("gdl90", "127.0.0.1", 4000)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        source = open_traffic(f"gdl90://127.0.0.1:{port}")
        try:
            end = time.monotonic() + 10.0
            while "in use" not in source.health(time.time()).state and time.monotonic() < end:
                time.sleep(0.02)
            assert "in use" in source.health(time.time()).state
        finally:
            source.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        source = LiveSource("g", READERS["gdl90"](), "127.0.0.1", port, listen=True)
        try:
            end = time.monotonic() + 10.0
            while source.health(time.time()).state != "listening, nothing heard yet" and time.monotonic() < end:
                time.sleep(0.02)
            reports: list = []
            while not reports and time.monotonic() < end:
                for data in (b"", np.random.default_rng(0).bytes(1000), gdl90.encode(REPORT)):
                    sender.sendto(data, ("127.0.0.1", port))
                time.sleep(0.02)
                reports = source.poll(math.inf)
            assert reports[0].address == "abcdef"
            assert source.health(time.time()).state == "ok"
        finally:
            source.close()
