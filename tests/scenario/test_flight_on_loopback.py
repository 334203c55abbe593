"""A whole flight as three processes on loopback: a simulated copter, a radar's sender and `wideberth fly --command`."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pymavlink", reason="MAVLink needs pymavlink (pip install 'wideberth[links]')")

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="flies in real time")

ROOT = Path(__file__).resolve().parents[2]
SCENARIO = ROOT / "scenarios" / "live_ground_radar.toml"
COMMAND = [sys.executable, "-c", "from wideberth.cli.main import main; main()"]


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def start(folder, autopilot, radar, state):
    return subprocess.Popen(
        [*COMMAND, "fly", str(SCENARIO), "--command", "--json", "--out", str(folder),
         "--set", f"autopilot.connection=udp:127.0.0.1:{autopilot}", "--set", f"inputs.0.listen=127.0.0.1:{radar}"],
        cwd=ROOT, stdout=subprocess.PIPE, text=True, env=os.environ | {"XDG_STATE_HOME": str(state)},
    )  # fmt: skip


def vehicle_and_sender(autopilot, radar):
    commands = (
        ["simulate-vehicle", "--mission", str(SCENARIO), "--connect", f"udp:127.0.0.1:{autopilot}"],
        ["send-radar", str(SCENARIO), "--to", f"127.0.0.1:{radar}"],
    )
    return [subprocess.Popen([*COMMAND, *command], cwd=ROOT, stderr=subprocess.DEVNULL) for command in commands]


def test_a_copter_avoids_what_a_radar_sees_and_control_is_given_back(tmp_path):
    autopilot, radar = free_port(), free_port()
    flight = start(tmp_path, autopilot, radar, tmp_path / "state")
    others = []
    seen = []
    try:
        for line in flight.stdout:
            if not others:
                # Once the flight is ready: its kernels are compiled.
                others = vehicle_and_sender(autopilot, radar)
            seen.append(json.loads(line))
            avoided = seen[-1]["autopilot"]["state"] == "avoiding" and seen[-1]["ownship"]["state"] == "ok"
            if avoided or len(seen) > 90:
                break
        flight.terminate()
        rest, _ = flight.communicate(timeout=60)
    finally:
        for process in (flight, *others):
            process.kill()
    assert flight.returncode == 0
    assert seen[0]["state"] == "unknown" and seen[0]["autopilot"]["state"] == "no link"
    assert seen[-1]["autopilot"]["state"] == "avoiding", [(s["state"], s["why"]) for s in seen]
    assert seen[-1]["state"] != "clear" and "intruder" in seen[-1]["maneuver"]["reason"]
    told = [event for status in (*seen, *map(json.loads, rest.splitlines())) for event in status["events"]]
    assert any(event.startswith("mission resumed") for event in told), "\n".join(told)
    live = json.loads((tmp_path / "summary.json").read_text())["live"]
    assert not list((tmp_path / "state").rglob("hand_over*"))
    assert live["released"] and live["command_ms"]["count"] > 0
    done = subprocess.run(
        [*COMMAND, "replay", str(tmp_path / "recording.mcap")], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0 and "identical" in done.stdout, done.stdout + done.stderr


def test_a_program_after_a_killed_one_gives_control_back(tmp_path):
    autopilot, radar = free_port(), free_port()
    state = tmp_path / "state"
    flight = start(tmp_path, autopilot, radar, state)
    others, seen, after, told = [], [], [], []
    try:
        for line in flight.stdout:
            if not others:
                others = vehicle_and_sender(autopilot, radar)
            seen.append(json.loads(line))
            if seen[-1]["autopilot"]["state"] == "avoiding" or len(seen) > 90:
                break
        flight.kill()
        flight.wait()
        assert seen[-1]["autopilot"]["state"] == "avoiding"
        assert len(list(state.rglob("hand_over*"))) == 1
        # Without the radar there is nothing to avoid: what the vehicle does now is what it was given back.
        others[1].kill()
        flight = start(tmp_path, autopilot, radar, state)
        for line in flight.stdout:
            after.append(json.loads(line))
            told += after[-1]["events"]
            if any(event.startswith("mission resumed") for event in told) or len(after) > 30:
                break
        flight.terminate()
        flight.communicate(timeout=60)
    finally:
        for process in (flight, *others):
            process.kill()
    assert told[0].startswith("the program before this one was ended in a maneuver"), told
    assert any(event.startswith("mission resumed") for event in told), "\n".join(told)
    assert not list(state.rglob("hand_over*"))
    first = subprocess.run(
        [*COMMAND, "replay", str(tmp_path / "recording.mcap")], cwd=ROOT, capture_output=True, text=True
    )
    assert first.returncode == 0 and "identical" in first.stdout, first.stdout + first.stderr
    assert (tmp_path / "recording-2.mcap").exists()
