"""The flight test of thesis 5.4 as real processes on loopback, in real time, several times.

`python -m experiments.live_flight_test` starts a simulated copter, the sender of the radar's plots and `wideberth fly
--command` for each run, and writes docs/results/live_flight_test.md. The intruders are in the radar's picture.
"""

import argparse
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from experiments.loopback import COMMAND, HOST, ROOT, fly_mission, free_port, outcome
from wideberth.config import load_scenario
from wideberth.recording import read_recording
from wideberth.simulation.config import SimulatedTrafficConfig
from wideberth.simulation.simulated import SimulatedTraffic

SCENARIO = ROOT / "scenarios" / "flight_test.toml"
RESULT = ROOT / "docs" / "results" / "live_flight_test.md"
LONGEST = 240.0  # s of a flight
RADIUS = 10.0  # m


def flown(number: int) -> dict[str, Any]:
    """Fly once, and return what came of it."""
    autopilot, radar = f"udp:{HOST}:{free_port()}", f"{HOST}:{free_port()}"
    arguments = [
        *(str(SCENARIO), "--command", "--set", f"autopilot.connection={autopilot}"),
        *("--set", f"inputs.0.listen={radar}", "--set", f"seed={number}"),
    ]
    vehicle = ("simulate-vehicle", "--mission", SCENARIO, "--connect", autopilot)
    sender = ("send-radar", SCENARIO, "--to", radar, "--seed", str(number))
    with tempfile.TemporaryDirectory() as name:
        events = fly_mission(arguments, Path(name), LONGEST, vehicle, sender)
        return {"events": events, **_judged(Path(name))}


def _judged(folder: Path) -> dict[str, Any]:
    """Return ranges to the true intruders, maneuvers and latencies of a flight's recording."""
    steps = list(read_recording(folder / "recording.mcap").steps())
    scenario = load_scenario(SCENARIO)
    assert isinstance(scenario.traffic, SimulatedTrafficConfig)
    traffic = SimulatedTraffic(scenario.traffic, scenario.frame(), 0.0)
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
    return {"least": least.tolist(), **outcome(folder), "identical": replayed.returncode == 0}


def page_of(rows: list[dict[str, Any]], parallel: int) -> str:
    """Return the page of results."""
    lines = [
        "# The flight test as processes on loopback",
        "",
        f"`python -m experiments.live_flight_test --runs {len(rows)} --parallel {parallel}`:"
        " `scenarios/flight_test.toml` (thesis 5.4) flown in real time by a simulated copter behind MAVLink, plots of"
        " the radar by UDP with both intruders in its picture, and `wideberth fly --command`. Ranges are horizontal,"
        f" from the vehicle's telemetry to the true intruders; the circle is {RADIUS:g} m. Latency: from the start of a"
        " step to its bytes handed to the socket. The run's number is the seed of the radar's errors.",
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
    parser.add_argument("--out", type=Path, default=RESULT)
    given = parser.parse_args()
    with ThreadPoolExecutor(given.parallel) as pool:
        rows = []
        for row in pool.map(flown, range(1, given.runs + 1)):
            rows.append(row)
            print({key: value for key, value in row.items() if key != "events"}, flush=True)
    given.out.write_text(page_of(rows, given.parallel), encoding="utf-8")


if __name__ == "__main__":
    main()
