"""`wideberth send-radar` and `send-traffic` on loopback: what is sent is what readers and receivers get."""

import math
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.adsb_frames import flight
from wideberth.cli import main
from wideberth.links.config import RadarUdpConfig
from wideberth.links.radar_udp import RadarUdpReader
from wideberth.sensors.adsb.sources import open_traffic

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "scenarios"
runner = CliRunner()


def command(*words: str) -> str:
    result = runner.invoke(main.app, list(words), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        one.setblocking(False)
        yield one


def datagrams(listener: socket.socket) -> list[bytes]:
    found = []
    while True:
        try:
            found.append(listener.recv(65536))
        except BlockingIOError:
            return found


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "flight.jsonl"
    frames = flight(0xABC123, duration=20.0)
    path.write_text("".join(f'{{"timestamp": {t}, "frame": "{frame.hex()}"}}\n' for t, frame in frames))
    return path


@pytest.mark.parametrize("fmt", ["wideberth", "thesis"])
def test_radar_of_a_scenario(listener, fmt):
    address = f"127.0.0.1:{listener.getsockname()[1]}"
    words = ["--to", address, "--format", fmt, "--speed", "50", "--duration", "5"]
    text = command("send-radar", str(SCENARIOS / "gbr_1.toml"), *words)
    packets = datagrams(listener)
    assert f"{len(packets)} packets" in text
    reader = RadarUdpReader(RadarUdpConfig(packet=fmt))
    scans = [scan for k, data in enumerate(packets) for scan in reader.feed(data, time.time() + 1e-3 * k)]
    assert len(scans) == len(packets) > 20
    assert reader.rejects == {}
    assert sum(len(scan.z) for scan in scans) > 20


def test_a_level_radar_over_asterix(listener, tmp_path):
    pytest.importorskip("asterix", reason="libasterix is not installed: pip install 'wideberth[links]'")
    from wideberth.links.asterix.reader import AsterixReader
    from wideberth.links.config import AsterixConfig

    text = (SCENARIOS / "radar_and_adsb.toml").read_text()
    assert "boresight_elevation_deg = 90.0" in text
    scenario = tmp_path / "level.toml"
    scenario.write_text(text.replace("boresight_elevation_deg = 90.0", "boresight_elevation_deg = 0.0"))
    words = ["--to", f"127.0.0.1:{listener.getsockname()[1]}", "--format", "asterix", "--speed", "20"]
    command("send-radar", str(scenario), *words, "--duration", "5")
    reader = AsterixReader(AsterixConfig())
    scans = [scan for data in datagrams(listener) for scan in reader.feed(data, time.time())]
    assert sum(len(scan.z) for scan in scans) > 20
    assert set(reader.rejects) <= {"time not after the last scan's", "height does not fit its range"}


def test_an_ownship_that_does_not_fly_is_not_in_the_picture(listener):
    address = f"127.0.0.1:{listener.getsockname()[1]}"
    plots = {}
    for ownship in ("absent", "mission"):
        words = ["--to", address, "--speed", "50", "--duration", "5", "--ownship", ownship]
        text = command("send-radar", str(SCENARIOS / "gbr_1.toml"), *words)
        plots[ownship] = int(text.split(" packets with ")[1].split()[0])
    assert plots["mission"] > plots["absent"] + 20


def test_traffic_over_gdl90_is_heard_by_open_traffic(recording):
    port = free_port(socket.SOCK_DGRAM)
    source = open_traffic(f"gdl90://127.0.0.1:{port}")
    try:
        time.sleep(0.2)
        command("send-traffic", str(recording), "--to", f"127.0.0.1:{port}", "--speed", "20")
        reports = []
        for _ in range(50):
            reports += source.poll(math.inf)
            if len(reports) >= 70:
                break
            time.sleep(0.05)
        assert {report.address for report in reports} == {"abc123"}
        assert source.counters["heartbeats"] >= 1
        located = [report for report in reports if not math.isnan(report.latitude)]
        assert len(located) > 20
        assert math.degrees(located[0].latitude) == pytest.approx(48.0, abs=0.01)
        assert source.health(time.time()).state == "ok"
    finally:
        source.close()


@pytest.mark.parametrize("fmt", ["sbs", "beast", "uat"])
def test_a_receiver_connects_to_the_sender(recording, fmt):
    port = free_port(socket.SOCK_STREAM)
    words = ["send-traffic", str(recording), "--to", f"127.0.0.1:{port}", "--format", fmt, "--speed", "4"]
    sender = subprocess.Popen(
        [sys.executable, "-m", "wideberth", *words],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"COLUMNS": "200"},
    )
    source = open_traffic(f"{fmt}://127.0.0.1:{port}")
    try:
        reports = []
        end = time.monotonic() + 40.0
        while len(reports) < 10 and time.monotonic() < end:
            reports += source.poll(math.inf)
            time.sleep(0.05)
        assert {report.address for report in reports} == {"abc123"}
        speeds = [report.velocity_north for report in reports if not math.isnan(report.velocity_north)]
        np.testing.assert_allclose(speeds, 100 * 1852 / 3600, rtol=0.01)
        sender.send_signal(signal.SIGINT)
        _, text = sender.communicate(timeout=20)
        assert sender.returncode == 0
        assert "packets with" in text
        assert "Traceback" not in text
    finally:
        source.close()
        if sender.poll() is None:
            sender.kill()
            sender.wait()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["send-radar", "missing.toml"], "missing.toml"),
        (["send-radar", str(SCENARIOS / "adsb_crossing.toml"), "--duration", "1"], "has no radar"),
        (["send-radar", str(SCENARIOS / "onboard_radar.toml")], "--ownship mission"),
        (["send-radar", str(SCENARIOS / "gbr_1.toml"), "--ownship", "x"], "use absent or mission"),
        (["send-radar", str(SCENARIOS / "gbr_1.toml"), "--speed", "0"], "give a positive number"),
        (["send-radar", str(SCENARIOS / "gbr_1.toml"), "--radar-id", "70000"], "give 0 to 65535"),
        (["send-radar", str(SCENARIOS / "gbr_1.toml"), "--to", "nowhere"], "HOST:PORT"),
        (["send-radar", str(SCENARIOS / "gbr_1.toml"), "--format", "x"], "use one of"),
        (["send-traffic", str(SCENARIOS / "gbr_1.toml"), "--duration", "1"], "has no ADS-B reports"),
        (["send-traffic", "missing.json"], "does not exist"),
        (["send-traffic", "x", "--format", "x"], "use one of"),
    ],
)
def test_what_cannot_be_sent_is_refused(words, message):
    result = runner.invoke(main.app, words)
    assert result.exit_code == 2
    assert message in result.output.replace("\n", " ")
