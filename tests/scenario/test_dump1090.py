"""Live sources against a real receiver program, killed and restarted while they read."""

import gzip
import json
import math
import shutil
import socket
import subprocess
import threading
import time
from pathlib import Path

import pytest

from tests import adsb_frames as encoder
from wideberth.sensors.adsb.formats import READERS
from wideberth.sensors.adsb.live import LiveSource

PROGRAM = shutil.which("dump1090-mutability") or shutil.which("dump1090-mutability", path="/usr/bin:/usr/local/bin")
pytestmark = pytest.mark.skipif(
    PROGRAM is None, reason="dump1090-mutability is not installed (apt-get install dump1090-mutability)"
)

RECORDING = Path(__file__).resolve().parents[2].parent / "shared/data/adsb/mode_s_one_flight.jsonl.gz"
ADDRESSES = (0x393322, 0x4840D6)
DEADLINE = 30.0


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    try:
        for s in sockets:
            s.bind(("127.0.0.1", 0))
        return [s.getsockname()[1] for s in sockets]
    finally:
        for s in sockets:
            s.close()


def made_frames(k, t):
    """Return the frames of turn k (each 0.05 s) of two aircraft that fly north."""
    for n, address in enumerate(ADDRESSES):
        position = encoder.airborne_position(48.0 + t * 0.0005, 2.0 + n, 3000 + 1000 * n, k % 2)
        for me in (position, encoder.ground_velocity(108, 0), encoder.identification(f"TEST{n}")):
            yield encoder.squitter(address, me)


class Receiver:
    """dump1090 on loopback with a feeder; `frames(k, t)` gives the frames of turn k, 0.05 s each, at time t."""

    def __init__(self, frames):
        self.frames = frames
        self.raw, self.beast, self.sbs, self.other = free_ports(4)
        self.process = None
        self._feeding = threading.Event()
        self._thread = None

    def start(self):
        ports = {"ri": self.raw, "bo": self.beast, "sbs": self.sbs, "ro": 0, "bi": 0}
        options = [x for name, port in ports.items() for x in (f"--net-{name}-port", str(port))]
        self.process = subprocess.Popen(
            [PROGRAM, "--net-only", "--net-bind-address", "127.0.0.1", "--quiet", *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for _ in range(100):
            assert self.process.poll() is None, "the receiver program ended at once"
            try:
                feed = socket.create_connection(("127.0.0.1", self.raw), timeout=1)
                break
            except OSError:
                time.sleep(0.1)
        self._feeding.set()
        self._thread = threading.Thread(target=self._feed, args=(feed,), daemon=True)
        self._thread.start()

    def _feed(self, feed):
        start = time.time()
        sent = 0
        with feed:
            while self._feeding.is_set():
                t = time.time() - start
                try:
                    while sent * 0.05 <= t:
                        for frame in self.frames(sent, t):
                            feed.sendall(f"*{frame.hex()};\n".encode())
                        sent += 1
                except OSError:
                    return
                time.sleep(0.02)

    def silence(self):
        self._feeding.clear()
        if self._thread is not None:
            self._thread.join(5)

    def kill(self):
        self._feeding.clear()
        self.process.kill()
        self.process.wait()
        self._thread.join(5)


@pytest.fixture
def start():
    running = []

    def starter(frames):
        running.append(Receiver(frames))
        running[-1].start()
        return running[-1]

    yield starter
    for receiver in running:
        receiver.kill()


def until(condition, what):
    end = time.time() + DEADLINE
    while time.time() < end:
        if condition():
            return
        time.sleep(0.05)
    pytest.fail(f"after {DEADLINE:.0f} s: {what}")


def collect(source, wanted):
    """Poll until a position of each aircraft has come; return all reports."""
    reports = []

    def done():
        reports.extend(source.poll(time.time()))
        return {r.address for r in reports if not math.isnan(r.latitude)} >= wanted

    until(done, f"no position of each aircraft: {source.health(time.time())}, {source.counters}")
    return reports


@pytest.mark.parametrize("fmt", ["beast", "sbs"])
def test_positions_keep_coming_through_a_restart(start, fmt):
    receiver = start(made_frames)
    port = receiver.beast if fmt == "beast" else receiver.sbs
    wanted = {f"{address:06x}" for address in ADDRESSES}
    options = {"silent_after": 0.5, "first_wait": 0.2, "longest_wait": 1.0}
    source = LiveSource(f"{fmt}://127.0.0.1:{port}", READERS[fmt](), "127.0.0.1", port, **options)
    try:
        for report in collect(source, wanted):
            if not math.isnan(report.latitude):
                assert math.degrees(report.latitude) == pytest.approx(48.0, abs=0.05)
                assert math.degrees(report.longitude) == pytest.approx(2.0 + (report.address == "4840d6"), abs=0.01)
                assert report.pressure_altitude == pytest.approx(
                    (3000 if report.address == "393322" else 4000) * 0.3048
                )
            assert abs(report.t - time.time()) < DEADLINE
        health = source.health(time.time())
        assert health.state == "ok"
        assert health.rate > 0

        receiver.silence()
        until(lambda: source.health(time.time()).state.startswith("silent for"), "silence was not reported")

        receiver.kill()
        until(lambda: "reconnecting in" in source.health(time.time()).state, "the loss was not reported")
        source.poll(math.inf)
        until(lambda: source.health(time.time()).age > 1.0, "the age did not grow")
        assert source.poll(math.inf) == []
        assert not source.exhausted

        receiver.start()
        collect(source, wanted)
        until(lambda: source.health(time.time()).state == "ok", "it did not recover")
        assert source.counters["connections"] == 2
    finally:
        source.close()
    assert source.health(time.time()).state == "closed"


@pytest.mark.skipif(not RECORDING.exists(), reason=f"no recording at {RECORDING}")
@pytest.mark.parametrize("fmt", ["beast", "sbs"])
def test_recorded_frames_through_a_restart(start, fmt):
    with gzip.open(RECORDING, "rt") as lines:
        rows = [json.loads(line) for line in lines]
    frames = [bytes.fromhex(row["frame"]) for row in rows if row["timestamp"] > 1720249200.0 and row["df"] == "17"]
    receiver = start(lambda k, t: frames[2 * k : 2 * k + 2])
    port = receiver.beast if fmt == "beast" else receiver.sbs
    source = LiveSource(f"{fmt}://127.0.0.1:{port}", READERS[fmt](), "127.0.0.1", port, first_wait=0.2)
    try:
        before = collect(source, {"393322"})
        receiver.kill()
        until(lambda: "reconnecting in" in source.health(time.time()).state, "the loss was not reported")
        source.poll(math.inf)
        receiver.start()
        after = collect(source, {"393322"})
    finally:
        source.close()
    for reports in (before, after):
        position = next(r for r in reports if not math.isnan(r.latitude))
        assert math.degrees(position.latitude) == pytest.approx(49.0, abs=0.3)
        assert math.degrees(position.longitude) == pytest.approx(2.5, abs=0.5)
