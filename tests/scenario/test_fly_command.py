"""`wideberth fly` as a process on loopback: signals, kill -9, a restart, replay; autopilot and radar are made up."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests.live_fakes import MISSION, SPEED, radar_datagram, tables, telemetry
from wideberth.recording import read_recording
from wideberth.toml_text import to_toml

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="flies in real time")

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-c", "from wideberth.cli.main import main; main()"]
HEAD_ON = (530.0, 10.0, -200.0, -17.0, 0.0, 0.0)


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Outside(threading.Thread):
    """The vehicle and the radar of a flight that starts now, sent ten times a second; what comes back is kept."""

    def __init__(self, autopilot_port, radar_port):
        super().__init__(daemon=True)
        self.ports = autopilot_port, radar_port
        self.received = b""
        self.releases = True
        self.ending = threading.Event()

    def run(self):
        start = time.time()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own, socket.socket(
            socket.AF_INET, socket.SOCK_DGRAM
        ) as radar:  # fmt: skip
            own.setblocking(False)
            k = 0
            while not self.ending.wait(max(start + k * 0.1 - time.time(), 0.0)):
                t = time.time()
                e = t - start
                try:
                    while True:
                        self.received += own.recv(65536)
                except OSError:
                    pass
                released = self.releases and b"release" in self.received
                position = (-400.0 + SPEED * e, 0.0, -200.0)
                line = telemetry(t, position, (SPEED, 0.0, 0.0), mission=MISSION, released=released)
                target = (HEAD_ON[0] + e * HEAD_ON[3], *HEAD_ON[1:])
                try:
                    own.sendto(line, ("127.0.0.1", self.ports[0]))
                    radar.sendto(radar_datagram(k, t, [target]), ("127.0.0.1", self.ports[1]))
                except OSError:
                    pass  # nobody listens yet, or no longer
                k += 1


class Flown:
    def __init__(self, folder, **changes):
        folder.mkdir(exist_ok=True)
        ports = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
        made = tables(ports[0], **changes)
        made["inputs"][0]["listen"] = str(ports[1])
        self.config = folder / "flight.toml"
        self.config.write_text(to_toml(made))
        self.out = folder / "out"
        self.outside = Outside(*ports)
        self.processes = []

    def start(self, *options):
        environment = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"}
        process = subprocess.Popen(
            [*COMMAND, "fly", str(self.config), "--out", str(self.out), "--json", *options],
            cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def close(self):
        self.outside.ending.set()
        for process in self.processes:
            process.kill()

    def statuses(self, process, count):
        """Read statuses until `count` of them have a step behind them."""
        found = []
        while sum(status["loop"]["step_ms"]["count"] > 0 for status in found) < count:
            line = process.stdout.readline()
            assert line, process.stderr.read()
            found.append(json.loads(line))
        return found

    def end(self, process):
        out, err = process.communicate(timeout=60)
        assert "Traceback" not in err and "fault" not in err, err
        return [json.loads(line) for line in out.splitlines()], err

    def replayed(self, name="recording.mcap"):
        done = subprocess.run([*COMMAND, "replay", str(self.out / name)], cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


@pytest.fixture
def flight(tmp_path):
    made = Flown(tmp_path)
    yield made
    made.close()


def test_a_flight_is_ended_by_sigterm_and_given_back(flight):
    process = flight.start("--command")
    first = json.loads(process.stdout.readline())
    assert first["state"] == "unknown" and first["why"] == "waiting for telemetry and the mission"
    flight.outside.start()
    seen = flight.statuses(process, 3)
    assert seen[-1]["inputs"]["radar"]["state"] == "ok"
    assert seen[-1]["autopilot"]["state"] == "monitoring" and seen[-1]["loop"]["command"] is True
    process.send_signal(signal.SIGTERM)
    rest, err = flight.end(process)
    assert process.returncode == 0
    assert "SIGTERM: control is given back" in rest[-1]["events"] and rest[-1]["autopilot"]["state"] == "restoring"
    assert b"release" in flight.outside.received and "steps" in err
    summary = json.loads((flight.out / "summary.json").read_text())
    live = summary["live"]
    assert live["released"] and live["command"] and live["recording"] == "recording.mcap"
    assert live["step_ms"]["count"] == summary["steps"] >= 20 and live["step_ms"]["p99"] is not None
    assert live["packet_age_ms"]["count"] >= 20
    assert "identical" in flight.replayed()


def test_kill_leaves_a_recording_to_the_last_second_and_a_restart_begins_a_new_one(flight):
    process = flight.start()
    flight.outside.start()
    before = flight.statuses(process, 4)
    process.kill()
    process.communicate()
    text = flight.replayed()
    assert "torn" in text and "identical" in text
    torn = read_recording(flight.out / "recording.mcap")
    assert not torn.complete and torn.step_count >= before[-1]["loop"]["step_ms"]["count"] - 10
    assert before[-1]["t"] - torn.t_end <= 1.2
    process = flight.start("--duration", "2")
    rest, _ = flight.end(process)
    assert process.returncode == 0
    assert rest[-1]["mission"]["waypoints"] == 2  # read again
    assert read_recording(flight.out / "recording-2.mcap").complete
    assert (flight.out / "recording.mcap").stat().st_size > 0
    assert b"fly" not in flight.outside.received  # only advisory


def test_an_autopilot_that_does_not_answer_does_not_hold_the_end_up(flight):
    flight.outside.releases = False
    process = flight.start("--command", "--duration", "1")
    flight.outside.start()
    rest, _ = flight.end(process)
    assert process.returncode == 0
    assert any("could not be given back within 5 s" in event for event in rest[-1]["events"])
    assert json.loads((flight.out / "summary.json").read_text())["live"]["released"] is False


def test_a_reader_that_goes_away_does_not_end_the_flight(flight):
    process = flight.start("--duration", "4")
    flight.outside.start()
    flight.statuses(process, 1)
    process.stdout.close()
    process.stdout = None
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads((flight.out / "summary.json").read_text())["steps"] > 20
