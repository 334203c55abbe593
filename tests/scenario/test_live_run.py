"""`wideberth run` on live receivers: one that is down, one that goes away, and a run that is interrupted."""

import json
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

from tests import adsb_frames as encoder
from wideberth.recording import read_recording
from wideberth.types import AlertLevel

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "real_traffic.toml"
MISSION = "lat_deg,lon_deg,altitude_m,speed_mps,start_time_s\n48.0,2.0,900,40,0\n48.3,2.0,900,40,0\n"


class Avr:
    """A receiver on loopback that sends one aircraft near the mission as AVR text, for `lasting` seconds a client."""

    def __init__(self, lasting):
        self.lasting = lasting
        self.heard = threading.Event()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        client, _ = self.listener.accept()
        self.listener.close()  # nobody can come back
        end = time.monotonic() + self.lasting
        with client:
            k = 0
            while time.monotonic() < end:
                for me in (
                    encoder.airborne_position(48.01, 2.05, 3000, k % 2),
                    encoder.ground_velocity(100, 0),
                ):
                    try:
                        client.sendall(f"*{encoder.squitter(0x393322, me).hex()};\n".encode())
                    except OSError:
                        return
                k += 1
                if k == 10:
                    self.heard.set()
                time.sleep(0.2)


def start(tmp_path, traffic, duration):
    mission = tmp_path / "mission.csv"
    mission.write_text(MISSION)
    arguments = ["run", SCENARIO, "--traffic", traffic, "--mission", mission, "--out", tmp_path / "out", "--no-report",
                 "--set", f"duration_s={duration}"]  # fmt: skip
    code = "from wideberth.cli.main import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Tests that a shell runs in the background begin with this signal ignored, and so would what they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def finished(process):
    out, err = process.communicate(timeout=120)
    assert "Traceback" not in out + err
    return out, err


def snapshots(tmp_path):
    return [step.snapshot for step in read_recording(tmp_path / "out" / "recording.mcap").steps()]


def test_a_receiver_that_is_down_is_unknown_sky_not_empty_sky(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    process = start(tmp_path, f"beast://127.0.0.1:{port}", 1.5)
    finished(process)
    assert process.returncode == 0
    steps = snapshots(tmp_path)
    assert len(steps) == 4
    assert {s.alert_state for s in steps} == {AlertLevel.UNKNOWN}
    assert any("reconnecting" in event for s in steps for event in s.events)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["intruders"] is None and summary["nmac_count"] is None  # not known, rather than none
    assert summary["sensors"]["adsb"]["state"].startswith("reconnecting")


def test_a_receiver_that_goes_away_is_reported_and_the_run_goes_on(tmp_path):
    receiver = Avr(lasting=3.0)
    process = start(tmp_path, f"avr://127.0.0.1:{receiver.port}", 6.0)
    finished(process)
    assert process.returncode == 0
    steps = snapshots(tmp_path)
    assert len(steps) == 13
    assert any(s.sensors["adsb"].state == "ok" and s.tracks for s in steps)
    assert "reconnecting" in steps[-1].sensors["adsb"].state
    assert steps[-1].alert_state is not AlertLevel.CLEAR
    assert any("reconnecting" in event for s in steps for event in s.events)


def test_an_interrupted_run_ends_with_one_line_and_keeps_its_recording(tmp_path):
    receiver = Avr(lasting=60.0)
    process = start(tmp_path, f"avr://127.0.0.1:{receiver.port}", 50.0)
    assert receiver.heard.wait(60)
    process.send_signal(signal.SIGINT)
    _, err = finished(process)
    assert process.returncode == 130
    assert err.strip().splitlines()[-1].startswith("wideberth: interrupted")
    assert snapshots(tmp_path)
