"""Faults on the sockets of a flight on loopback, and how long it takes to recover from them.

`python -m experiments.live_faults` flies a simulated copter with `wideberth fly` as processes of their own; radars,
receivers and the link to the vehicle go over wires that fail one after another. Writes docs/results/live_faults.md.
"""

import argparse
import json
import math
import os
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.faulty_wires import (
    TRAFFIC,
    DatagramEnd,
    Fault,
    FaultyWire,
    RadarSource,
    Relay,
    ServerEnd,
    TrafficSource,
)
from experiments.loopback import HOST, ROOT, Process, fly, free_port, started, stopped_after
from wideberth.frames import LocalFrame
from wideberth.recording import read_recording
from wideberth.toml_text import to_toml
from wideberth.types import AlertLevel

RESULT = ROOT / "docs" / "results" / "live_faults.md"
ORIGIN = (40.25, -111.65)
NAMES = ("autopilot", "radar", "asterix", *TRAFFIC)
STEP = 0.1
SILENT_AFTER = 4.0
BYTES = 1_000_000
REST = 12.0  # s between faults
SETTLE = 10.0  # s of being well before the first
LONGEST = 900.0
# Programs of the package with a hand on what no wire can do: the host's clock, and GPS.
CLOCK = """
import signal, time
real, shift = time.time, [0.0]
time.time = lambda: real() + shift[0]
def turn(number, _):
    shift[0] += 3.0 if number == signal.SIGUSR1 else -3.0
signal.signal(signal.SIGUSR1, turn)
signal.signal(signal.SIGUSR2, turn)
from wideberth.cli.main import main
main()
"""
GPS = """
import signal
from wideberth.live import simulated_vehicle
def turn(number, _):
    flown[0].autopilot.telemetry.has_gps = number == signal.SIGUSR2
flown, serve = [], simulated_vehicle.serve
def caught(vehicle, *args, **kw):
    flown.append(vehicle)
    signal.signal(signal.SIGUSR1, turn)
    signal.signal(signal.SIGUSR2, turn)
    serve(vehicle, *args, **kw)
simulated_vehicle.serve = caught
from wideberth.cli.main import main
main()
"""


class Trial(NamedTuple):
    """A fault: its name, how long it lasts (s), what begins and ends it, and within what time it must be shown (s).

    The last is None where what is heard is enough to go on with.
    """

    name: str
    seconds: float
    begin: Callable[[], None]
    end: Callable[[], None]
    shown_within: float | None


class Outside:
    """All that a flight hears, in a thread: made, and sent over wires that fail."""

    def __init__(self, ports: dict[str, int], relay: int) -> None:
        rng = np.random.default_rng(12)
        frame = LocalFrame(math.radians(ORIGIN[0]), math.radians(ORIGIN[1]))
        self.wires = {name: FaultyWire(rng) for name in NAMES}
        self.relay = Relay(relay, ports["autopilot"], self.wires["autopilot"])
        self.radars = {name: RadarSource(name) for name in ("radar", "asterix")}
        self._receivers = {name: TrafficSource(name, k, frame) for k, name in enumerate(TRAFFIC)}
        self.ends = {
            name: ServerEnd(ports[name]) if TRAFFIC.get(name) == "tcp" else DatagramEnd(ports[name])
            for name in NAMES[1:]
        }
        self.flight = self.vehicle = 0
        self.times: list[tuple[float, float]] = []
        self.rejects: dict[str, int] = {}
        self.well = threading.Event()
        self.done = False
        self._ending = False

    def run(self) -> None:
        """Send until `stop`."""
        start, step = time.monotonic(), 0
        while not self._ending:
            due = start + STEP * step
            while (left := due - time.monotonic()) > 0.0:
                self.relay.serve(left)
            self._send(step, time.time())
            step += 1

    def stop(self) -> None:
        """End the thread."""
        self._ending = True

    def _send(self, step: int, t: float) -> None:
        for k, (name, end) in enumerate(self.ends.items()):
            # Each has an aircraft of its own, that circles far away.
            angle = 2.0 * math.pi * k / len(self.ends) + 0.005 * STEP * step
            position = np.array([2500.0 * math.cos(angle), 2500.0 * math.sin(angle), -1200.0 - 50.0 * k])
            velocity = 12.5 * np.array([-math.sin(angle), math.cos(angle), 0.0])
            wire = self.wires[name]
            if name in self.radars:
                wire.carry(self.radars[name].packet(t, position, velocity), end.send)
            elif step % 10 == k:
                for packet in self._receivers[name].packets(t, position, velocity):
                    wire.carry(packet, end.send)
            wire.tick(end.send)
        self.wires["autopilot"].tick(self.relay.to_program)

    def trials(self) -> list[Trial]:
        """Return the faults in their order."""

        def on(names: tuple[str, ...], **what: Any) -> Callable[[], None]:
            def change() -> None:
                for name in names:
                    self.wires[name].fault = Fault(**what)

            return change

        def connection(name: str, *, whether: bool) -> Callable[[], None]:
            return lambda: self.ends[name].open(whether=whether)

        def kill(who: str, number: signal.Signals) -> Callable[[], None]:
            return lambda: os.kill(getattr(self, who), number)

        def clock(error: float) -> Callable[[], None]:
            return lambda: setattr(self.radars["radar"], "clock_error", error)

        # What says that something is missing: half a second for telemetry, a second and a bit for radars.
        within = {"autopilot": 0.7, "radar": 1.3, "asterix": 1.3}
        trials = [
            Trial(f"link cut: {name}", 10.0, on((name,), cut=True), on((name,)), within.get(name, SILENT_AFTER + 1.2))
            for name in NAMES
        ]
        trials += [
            Trial(
                f"connection broken and refused: {name}", 10.0,
                connection(name, whether=False), connection(name, whether=True), 1.0,
            )
            for name in ("beast", "sbs")
        ]  # fmt: skip
        trials += [
            Trial("30 % lost, all links", 20.0, on(NAMES, loss=0.3), on(NAMES), None),
            Trial("30 % twice, all links", 20.0, on(NAMES, repeat=0.3), on(NAMES), None),
            Trial("30 % late by 0.1 to 0.5 s, all links", 20.0, on(NAMES, late=0.3), on(NAMES), None),
            Trial(f"{BYTES:.0e} random bytes, each link", 20.0, on(NAMES, noise=BYTES // 200), on(NAMES), None),
            Trial("host's clock 3 s ahead", 10.0, kill("flight", signal.SIGUSR1), lambda: None, None),
            Trial("host's clock 3 s back", 10.0, kill("flight", signal.SIGUSR2), lambda: None, None),
            Trial("radar's clock 3 s ahead", 10.0, clock(3.0), clock(0.0), 1.3),
            Trial("radar's clock 3 s behind", 10.0, clock(-3.0), clock(0.0), 1.3),
            Trial("no GPS", 10.0, kill("vehicle", signal.SIGUSR1), kill("vehicle", signal.SIGUSR2), 1.3),
        ]
        return trials

    def schedule(self) -> None:
        """Let one thing after another fail, once all is well."""
        self.well.wait()
        time.sleep(SETTLE)
        for trial in self.trials():
            begun = time.time()
            trial.begin()
            time.sleep(trial.seconds)
            trial.end()
            self.times.append((begun, time.time()))
            time.sleep(REST)
        self.done = True


def scenario(ports: dict[str, int]) -> dict[str, Any]:
    """Return the tables of the flight: to and fro over the radar."""
    ends = [{"north_m": 400.0 * (-1) ** k, "east_m": 0.0, "altitude_m": 150.0} for k in range(1, 20)]
    unit = {"range_max_m": 5000.0, "range_sigma_m": 8.0, "detection_ranges_m": [0.0, 5000.0],
            "detection_probabilities": [0.9, 0.9]}  # fmt: skip
    listening = ("radar", "asterix", "gdl90")
    inputs: list[dict[str, Any]] = [
        {"kind": "radar_udp", "name": "radar", "units": [unit]},
        {"kind": "asterix", "name": "asterix", "units": [unit], "scan": "packet"},
        *({"kind": name, "name": name} for name in TRAFFIC),
    ]
    for one in inputs:
        name = one["name"]
        one["listen" if name in listening else "connect"] = f"{HOST}:{ports[name]}"
        one["silent_after_s"] = SILENT_AFTER
    return {
        "name": "live_faults",
        "step_s": STEP,
        "origin": {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]},
        "mission": {"speed_mps": 8.0, "waypoints": ends},
        "ownship": {"kind": "multirotor", "waypoint_capture_m": 30.0},
        "tracker": {"kind": "wideberth"},
        "detection": {"well_clear_volume": "nmac", "lookahead_s": 60.0},
        "avoidance": {"kind": "local_level", "altitude_min_m": 60.0, "altitude_max_m": 400.0},
        "autopilot": {"kind": "mavlink", "connection": f"udp:{HOST}:{ports['autopilot']}"},
        "inputs": [*inputs, {"kind": "autopilot"}],
    }


def judged(trial: Trial, begun: float, ended: float, next_begun: float, t: Any, alerts: Any) -> dict[str, Any]:
    """Return what the steps (times, alert states) show of one fault."""
    unknown = alerts == AlertLevel.UNKNOWN
    during = (t >= begun) & (t < ended)
    after = (t >= ended) & (t < next_begun)
    shown = t[during & unknown]
    silent = 0
    if trial.shown_within is not None:
        silent = int((during & (t > begun + trial.shown_within) & (alerts == AlertLevel.CLEAR)).sum())
    late = t[after & unknown]
    return {
        "name": trial.name,
        "seconds": trial.seconds,
        "shown": float(shown[0] - begun) if len(shown) else None,
        "unknown_s": float(unknown[during].sum() * STEP),
        "silent": silent if trial.shown_within is not None else None,
        "recovered": float(late[-1] - ended + STEP) if len(late) else 0.0,
        "well_again": bool(len(t[after]) and not unknown[after][-1]),
    }


def run(folder: Path) -> tuple[list[dict[str, Any]], dict[str, Any], dict[str, int], dict[str, int]]:
    """Fly, and return what came of each fault, the summary, the random bytes on each link, and rejects counted."""
    kinds = {"udp": socket.SOCK_DGRAM, "tcp": socket.SOCK_STREAM}
    ports = {name: free_port(kinds[TRAFFIC.get(name, "udp")]) for name in NAMES}
    relay = free_port()
    config = folder / "live_faults.toml"
    config.write_text(to_toml(scenario(ports)))
    outside = Outside(ports, relay)
    threads = [
        threading.Thread(target=outside.run, daemon=True),
        threading.Thread(target=outside.schedule, daemon=True),
    ]
    others: list[Process] = []

    def watch(status: dict[str, Any]) -> bool:
        if not others:
            outside.flight = int(status["pid"])
            others.append(
                started("simulate-vehicle", "--mission", config, "--connect", f"udp:{HOST}:{relay}", program=GPS)
            )
            outside.vehicle = others[0].pid
            for thread in threads:
                thread.start()
        if status["state"] == "clear":
            outside.well.set()
        outside.rejects = {
            name: sum(one["rejects"].values())
            for name, one in (*status["inputs"].items(), ("the autopilot's link", status["autopilot"]))
        }
        return outside.done

    with stopped_after(others):
        fly([str(config)], folder, watch, LONGEST, program=CLOCK)
        outside.stop()
    rows = [(s.t, s.snapshot.alert_state) for s in read_recording(folder / "recording.mcap").steps()]
    t, alerts = np.array([row[0] for row in rows]), np.array([int(row[1]) for row in rows])
    begins = [begun for begun, _ in outside.times[1:]] + [float(t[-1])]
    found = [
        judged(trial, *times, following, t, alerts)
        for trial, times, following in zip(outside.trials(), outside.times, begins, strict=True)
    ]
    summary = json.loads((folder / "summary.json").read_text())
    return found, summary, {name: wire.noise_bytes for name, wire in outside.wires.items()}, outside.rejects


def page_of(rows: list[dict[str, Any]], summary: dict[str, Any], noise: dict[str, int], rejects: dict[str, int]) -> str:
    """Return the page of results."""
    live = summary["live"]
    steps, missed = live["step_ms"]["count"], live["missed_steps"]
    lines = [
        "# Faults on the sockets of a flight on loopback",
        "",
        "`python -m experiments.live_faults`: `wideberth fly` and a simulated copter behind MAVLink as processes, two"
        " radars (our packets and ASTERIX 048, ten scans a second) and five receivers (GDL90, Beast, AVR, SBS, UAT, a"
        f" report a second each, called silent after {SILENT_AFTER:g} s), each with an aircraft far away, so that the"
        " sky is clear. Links fail one after another. *Shown*: from the fault to the first step that says unknown."
        " *Clear, not known*: steps that say clear although what failed should have been missed (the link half a second"
        " of telemetry, radars a second and three intervals, receivers the time above). *Recovered*: from the end of"
        " the fault to the last step that says unknown. A dash: what is heard is enough to go on with, clear is right."
        " Noise runs into the one line a second of the UAT receiver: it is not understood, which is told.",
        "",
        "| fault | lasts, s | shown after, s | unknown, s | clear, not known, steps | recovered after, s |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        shown = "-" if row["shown"] is None else f"{row['shown']:.1f}"
        silent = "-" if row["silent"] is None else row["silent"]
        recovered = f"{row['recovered']:.1f}" if row["well_again"] else "not"
        lines.append(
            f"| {row['name']} | {row['seconds']:g} | {shown} | {row['unknown_s']:.1f} | {silent} | {recovered} |"
        )
    lines += [
        "",
        f"{steps} steps, {missed} missed and counted; latency p50 {live['step_ms']['p50']:.1f} ms, p99"
        f" {live['step_ms']['p99']:.1f} ms. Told to end, it did with status 0, without an exception; the host's"
        f" clock was seen to jump {live['host_clock_jumps']} times. Random bytes sent: {min(noise.values())} to"
        f" {max(noise.values())} a link. Rejects counted: {', '.join(f'{name} {n}' for name, n in rejects.items())}.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULT)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        results = run(Path(folder))
    given.out.write_text(page_of(*results), encoding="utf-8")
    sys.stdout.write(given.out.read_text())


if __name__ == "__main__":
    main()
