"""The flight test of thesis 5.4 as real processes on loopback, in real time, several times.

`python -m experiments.live_flight_test` starts a simulated copter, the sender of the radar's plots and `wideberth fly
--command` for each run, and writes docs/results/live_flight_test.md. The intruders are in the radar's picture.
"""

import argparse
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from wideberth.config import load_scenario
from wideberth.recording import read_recording
from wideberth.simulation.config import SimulatedTrafficConfig
from wideberth.simulation.simulated import SimulatedTraffic

ROOT = Path(__file__).resolve().parents[1]
SCENARIO = ROOT / "scenarios" / "flight_test.toml"
COMMAND = [sys.executable, "-c", "from wideberth.cli.main import main; main()"]
HOST = "127.0.0.1"
LONGEST = 240.0  # s of a flight
RADIUS = 10.0  # m


def free_port() -> int:
    """Return a UDP port of loopback that nobody has."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind((HOST, 0))
        return int(one.getsockname()[1])


def fly(number: int) -> dict[str, Any]:
    """Fly once, and return what came of it."""
    autopilot, radar = free_port(), free_port()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        flight = subprocess.Popen(
            [*COMMAND, "fly", str(SCENARIO), "--command", "--json", "--out", name,
             "--set", f"autopilot.connection=udp:{HOST}:{autopilot}",
             "--set", f"inputs.0.listen={HOST}:{radar}", "--set", f"seed={number}"],
            cwd=ROOT, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        others: list[subprocess.Popen[bytes]] = []
        events: list[str] = []
        assert flight.stdout is not None
        started = time.monotonic()
        try:
            for line in flight.stdout:
                if not others:
                    others.append(
                        _started("simulate-vehicle", "--mission", SCENARIO, "--connect", f"udp:{HOST}:{autopilot}")
                    )
                status = json.loads(line)
                events += status["events"]
                mission = status["mission"]
                if mission is not None and len(others) == 1:
                    # Now every scan is recorded, and the first tells when the sender began.
                    others.append(_started("send-radar", SCENARIO, "--to", f"{HOST}:{radar}"))
                done = mission is not None and mission["index"] >= mission["waypoints"]
                if done or time.monotonic() - started > LONGEST:
                    break
            flight.terminate()
            flight.communicate(timeout=60)
        finally:
            for process in [flight.pid, *(other.pid for other in others)]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            for other in others:
                other.wait()
        return {"events": events, **_judged(folder)}


def _started(*arguments: str | Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen([*COMMAND, *map(str, arguments)], cwd=ROOT, stderr=subprocess.DEVNULL)


def _judged(folder: Path) -> dict[str, Any]:
    """Return ranges to the true intruders, maneuvers and latencies of a flight's recording."""
    summary = json.loads((folder / "summary.json").read_text())
    steps = list(read_recording(folder / "recording.mcap").steps())
    scenario = load_scenario(SCENARIO, ())
    frame = scenario.frame()
    assert isinstance(scenario.traffic, SimulatedTrafficConfig)
    traffic = SimulatedTraffic(scenario.traffic, frame, 0.0)
    epoch = min(scan.t for step in steps for scan in step.scans)
    least = np.full(len(traffic.ids), np.inf)
    for step in steps:
        own = step.ownship
        if own.t < epoch:
            continue
        truth = traffic.truth(own.t - epoch)
        least = np.minimum(least, np.hypot(*(truth.positions - own.position)[:, :2].T))
    replayed = subprocess.run(
        [*COMMAND, "replay", str(folder / "recording.mcap")], cwd=ROOT, capture_output=True, text=True
    )
    live = summary["live"]
    return {
        "least": least.tolist(),
        "completed": summary["mission_completed"],
        "maneuvers": summary["maneuvers"],
        "reversals": summary["reversals"],
        "steps": summary["steps"],
        "missed": live["missed_steps"],
        "step_ms": live["step_ms"],
        "command_ms": live["command_ms"],
        "age_ms": live["packet_age_ms"],
        "identical": replayed.returncode == 0,
    }


def page_of(rows: list[dict[str, Any]], parallel: int) -> str:
    """Return the page of results."""
    lines = [
        "# The flight test as processes on loopback",
        "",
        f"`python -m experiments.live_flight_test --runs {len(rows)} --parallel {parallel}`:"
        " `scenarios/flight_test.toml` (thesis 5.4) flown in real time by a simulated copter behind MAVLink, plots of"
        " the radar by UDP with both intruders in its picture, and `wideberth fly --command`. Ranges are horizontal,"
        f" from the vehicle's telemetry to the true intruders; the circle is {RADIUS:g} m. Latency: from the start of a"
        " step to its bytes handed to the socket. The radar's errors are the same in all runs (the sender has the"
        " scenario's seed); when vehicle, radar and program meet is not.",
        "",
        "| run | least range, m | mission finished | maneuvers, reversals | steps, missed | step p50 / p95 / p99, ms |"
        " packet age p50 / p99, ms | replay |",
        "| ---: | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for k, row in enumerate(rows):
        ms, age = row["step_ms"], row["age_ms"]
        lines.append(
            f"| {k + 1} | {', '.join(f'{x:.1f}' for x in row['least'])} | {'yes' if row['completed'] else 'no'} |"
            f" {row['maneuvers']}, {row['reversals']} | {row['steps']}, {row['missed']} |"
            f" {ms['p50']:.1f} / {ms['p95']:.1f} / {ms['p99']:.1f} | {age['p50']:.0f} / {age['p99']:.0f} |"
            f" {'identical' if row['identical'] else 'differs'} |"
        )
    kept = sum(min(row["least"]) >= RADIUS for row in rows)
    lines += ["", f"{kept} of {len(rows)} runs kept {RADIUS:g} m."]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--parallel", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("docs/results/live_flight_test.md"))
    given = parser.parse_args()
    with ThreadPoolExecutor(given.parallel) as pool:
        rows = []
        for row in pool.map(fly, range(1, given.runs + 1)):
            rows.append(row)
            print({key: value for key, value in row.items() if key != "events"}, flush=True)
    given.out.write_text(page_of(rows, given.parallel), encoding="utf-8")


if __name__ == "__main__":
    main()
