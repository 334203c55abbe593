"""A long flight on loopback: 50 aircraft with ADS-B and 20 plots a scan, at ten steps a second.

    python -m experiments.live_soak --minutes 60

A simulated copter flies up and down over a ground radar, with `wideberth fly` as a process of its own. Memory, missed
steps and latencies go into docs/results/live_soak.md.
"""

import argparse
import json
import math
import multiprocessing
import os
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from experiments.loopback import COMMAND, ROOT, free_port, started
from experiments.made_reports import made_report
from wideberth.frames import LocalFrame
from wideberth.links.radar_udp import encode_radar
from wideberth.live.senders import TrafficPackets
from wideberth.toml_text import to_toml
from wideberth.types import FloatArray

AIRCRAFT, PLOTS, MOVING = 50, 20, 12
RANGE = 3000.0
SPEED = 10.0
ORIGIN = (40.25, -111.65)
RESULT = ROOT / "docs" / "results" / "live_soak.md"


def scenario(ports: dict[str, int], minutes: float) -> dict[str, Any]:
    """Return the tables of the flight: legs of 2 km over the radar for as long as it lasts."""
    legs = math.ceil((60.0 * minutes + 120.0) * SPEED / 2000.0)
    ends = [{"north_m": 1000.0 * (-1) ** k, "east_m": 0.0, "altitude_m": 300.0} for k in range(1, legs + 2)]
    return {
        "name": "live_soak",
        "step_s": 0.1,
        "origin": {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]},
        "mission": {"speed_mps": SPEED, "waypoints": ends},
        "ownship": {"kind": "point_mass", "speed_min_mps": 5.0, "speed_max_mps": 15.0, "climb_rate_max_mps": 4.0,
                    "sink_rate_max_mps": 4.0, "waypoint_capture_m": 60.0},
        "tracker": {"kind": "wideberth"},
        "detection": {"well_clear_volume": "nmac", "lookahead_s": 60.0},
        "avoidance": {"kind": "local_level", "altitude_min_m": 100.0, "altitude_max_m": 1500.0, "ghost_s": 15.0},
        "autopilot": {"kind": "mavlink", "connection": f"udp:127.0.0.1:{ports['autopilot']}"},
        "inputs": [
            {"kind": "radar_udp", "name": "radar", "listen": str(ports["radar"]),
             "units": [{"range_max_m": RANGE, "range_sigma_m": 3.0, "detection_ranges_m": [0.0, RANGE],
                        "detection_probabilities": [0.9, 0.9]}]},
            {"kind": "gdl90", "name": "adsb", "listen": str(ports["gdl90"])},
            {"kind": "autopilot"},
        ],
    }  # fmt: skip


def circles(rng: np.random.Generator, count: int, radius_max: float) -> FloatArray:
    """Return radius, phase, speed, altitude, north and east (count, 6) of aircraft that fly in circles."""
    radius = rng.uniform(200.0, 0.4 * radius_max, count)
    angle, place = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    middle = radius_max * np.sqrt(rng.uniform(0.01, 0.3, count))
    speed = rng.uniform(15.0, 40.0, count) * rng.choice([-1.0, 1.0], count)
    altitude = rng.uniform(150.0, 900.0, count)
    return np.column_stack([radius, angle, speed, altitude, middle * np.cos(place), middle * np.sin(place)])


def at(flown: FloatArray, t: float) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities (n, 3), NED, of circling aircraft at time `t`, s."""
    radius, phase, speed, altitude, north, east = flown.T
    angle = phase + speed / radius * t
    positions = np.column_stack([north + radius * np.cos(angle), east + radius * np.sin(angle), -altitude])
    velocities = np.column_stack([-speed * np.sin(angle), speed * np.cos(angle), np.zeros(len(flown))])
    return positions, velocities


def send(ports: dict[str, int]) -> None:
    """Send the radar's scans ten times a second, and each aircraft's report once a second, for ever."""
    rng = np.random.default_rng(9)
    seen, heard = circles(rng, MOVING, RANGE), circles(rng, AIRCRAFT, 15_000.0)
    frame = LocalFrame(math.radians(ORIGIN[0]), math.radians(ORIGIN[1]))
    packets = TrafficPackets("gdl90")
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    start = time.monotonic()
    step = 0
    while True:
        time.sleep(max(start + 0.1 * step - time.monotonic(), 0.0))
        t = time.time()
        p, v = at(seen, 0.1 * step)
        false = rng.normal(size=(PLOTS - MOVING, 3))
        false *= (RANGE * rng.uniform(0.1, 1.0, len(false)) / np.linalg.norm(false, axis=1))[:, None]
        false[:, 2] = -np.abs(false[:, 2])
        p, v = np.vstack([p, false]), np.vstack([v, rng.normal(0.0, 15.0, false.shape)])
        r = np.linalg.norm(p, axis=1)
        z = np.column_stack([r, np.arctan2(p[:, 1], p[:, 0]), np.arcsin(-p[:, 2] / r), (p * v).sum(axis=1) / r])
        sigma = np.tile([3.0, 0.01, 0.01, 0.5], (len(z), 1))
        z += sigma * rng.normal(size=z.shape)
        out.sendto(encode_radar(1, step, t, z, sigma), ("127.0.0.1", ports["radar"]))
        p, v = at(heard, 0.1 * step)
        # A tenth of them in each step.
        tenth = range(step % 10, AIRCRAFT, 10)
        reports = [made_report(t, 0xA00000 + k, f"SOAK{k:02d}", frame, p[k], v[k]) for k in tenth]
        for data in packets.encode(reports, t):
            out.sendto(data, ("127.0.0.1", ports["gdl90"]))
        step += 1


def resident(process: int) -> float:
    """Return the memory that a process holds, MiB."""
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    return math.nan


def soak(minutes: float, folder: Path) -> tuple[dict[str, Any], FloatArray]:
    """Fly, and return the summary and (time, s; memory, MiB; aircraft tracked) of each second."""
    ports = {name: free_port() for name in ("autopilot", "radar", "gdl90")}
    config = folder / "live_soak.toml"
    config.write_text(to_toml(scenario(ports, minutes)))
    flight = subprocess.Popen(
        [*COMMAND, "fly", str(config), "--json", "--duration", str(60.0 * minutes), "--out", str(folder / "out")],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert flight.stdout is not None
    rows: list[tuple[float, float, float]] = []
    others: list[Any] = []
    try:
        for line in flight.stdout:
            if not others:
                peer = f"udp:127.0.0.1:{ports['autopilot']}"
                others.append(started("simulate-vehicle", "--mission", config, "--connect", peer))
                sender = multiprocessing.get_context("spawn").Process(target=send, args=(ports,), daemon=True)
                sender.start()
                others.append(sender)
            status = json.loads(line)
            if status["loop"]["step_ms"]["count"]:
                rows.append((status["t"], resident(flight.pid), status["tracks"]))
        if flight.wait() != 0:
            raise SystemExit(f"the flight ended with status {flight.returncode}")
    finally:
        for other in others:
            other.terminate()
        flight.kill()
    return json.loads((folder / "out" / "summary.json").read_text()), np.array(rows)


def write(summary: dict[str, Any], rows: FloatArray) -> str:
    """Return the page of results."""
    live, t = summary["live"], rows[:, 0] - rows[0, 0]
    # The first fifth fills caches and buffers.
    late = t >= 0.2 * t[-1]
    slope = float(np.polyfit(t[late], rows[late, 1], 1)[0]) * 3600.0
    steps, missed = live["step_ms"]["count"], live["missed_steps"]

    def row(name: str, values: dict[str, Any]) -> str:
        cells = ["-" if values[key] is None else f"{values[key]:.1f}" for key in ("mean", "p50", "p95", "p99", "max")]
        return f"| {name} | {' | '.join(cells)} |"

    return "\n".join(
        [
            "# A long flight on loopback",
            "",
            f"`python -m experiments.live_soak`: {AIRCRAFT} aircraft with ADS-B (GDL90), {PLOTS} radar plots a scan of"
            f" which {PLOTS - MOVING} are false, a simulated copter over MAVLink; {summary['duration_s'] / 60.0:.0f}"
            f" minutes on {os.cpu_count()} shared cores, load {os.getloadavg()[1]:.1f} at the end.",
            "",
            "| | |",
            "|---|---|",
            f"| steps taken, missed | {steps}, {missed} ({missed / (steps + missed):.2%}) |",
            f"| aircraft tracked, mean | {rows[:, 2].mean():.0f} |",
            f"| memory at the start, at the end | {rows[0, 1]:.0f} MiB, {rows[-1, 1]:.0f} MiB |",
            f"| growth over the last four fifths | {slope:+.1f} MiB an hour |",
            f"| alert states, steps | {', '.join(f'{k} {v}' for k, v in live['alert_steps'].items())} |",
            "",
            "| ms | mean | p50 | p95 | p99 | max |",
            "|---|---|---|---|---|---|",
            row("step, from its start to the bytes handed to the socket", live["step_ms"]),
            row("age of a packet when the step that uses it starts", live["packet_age_ms"]),
            "",
            "Some 2 MiB an hour of the growth is the recording's index, an entry for each second.",
            "",
        ]
    )


def main() -> None:
    """Run the soak."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--out", type=Path, default=RESULT)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        summary, rows = soak(arguments.minutes, Path(folder))
    arguments.out.write_text(write(summary, rows))
    print(arguments.out.read_text())


if __name__ == "__main__":
    main()
