"""A head-on with an ADS-B aircraft at 45 m/s, as processes on loopback in real time, as a plane and as a copter.

`python -m experiments.live_head_on` starts a simulated vehicle behind MAVLink, the sender of the aircraft's reports and
`wideberth fly --command` for each run of `scenarios/live_head_on.toml`, and writes docs/results/live_head_on.md.
"""

import argparse
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.loopback import HOST, ROOT, fly_mission, free_port, outcome
from wideberth.config import load_scenario
from wideberth.conflict.well_clear import PRESETS
from wideberth.live.sender_sources import reports_of_scans, scans_of
from wideberth.recording import RecordedStep, read_recording
from wideberth.simulation.config import SimulatedTrafficConfig
from wideberth.simulation.simulated import SimulatedTraffic
from wideberth.toml_text import to_toml
from wideberth.types import FloatArray

SCENARIO = ROOT / "scenarios" / "live_head_on.toml"
RESULT = ROOT / "docs" / "results" / "live_head_on.md"
WELL_CLEAR = PRESETS["astm_f3442"]
OFFSETS = (0.0, 150.0, 300.0)
LONGEST = 480.0  # s of a flight, the start of the other programs included
PLANE = {
    "mission": {"speed_mps": 22.0},
    "ownship": {"kind": "point_mass", "speed_min_mps": 15.0, "speed_max_mps": 30.0, "climb_rate_max_mps": 4.0,
                "sink_rate_max_mps": 4.0, "waypoint_capture_m": 60.0},
}  # fmt: skip


class Case(NamedTuple):
    """One run: the vehicle, how far the aircraft passes to the east of its mission (m), and the seed."""

    vehicle: str
    offset: float
    seed: int


def tables_of(case: Case) -> dict[str, Any]:
    """Return the scenario of a case."""
    tables = tomllib.loads(SCENARIO.read_text())
    tables["seed"] = case.seed
    place = tables["traffic"]["intruders"][0]["position"]
    place["east_m"] = case.offset
    if case.vehicle == "plane":
        tables["mission"] |= PLANE["mission"]
        tables["ownship"] = PLANE["ownship"]
        place["north_m"] = 6500.0
        for waypoint, north in zip(tables["mission"]["waypoints"], (0.0, 1800.0, 3600.0), strict=True):
            waypoint["north_m"] = north
    return tables


def run(case: Case) -> dict[str, Any]:
    """Fly once, and return what came of it."""
    autopilot, adsb = f"udp:{HOST}:{free_port()}", f"{HOST}:{free_port()}"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = folder / "live_head_on.toml"
        tables = tables_of(case)
        tables["autopilot"]["connection"] = autopilot
        tables["inputs"][0]["listen"] = adsb
        config.write_text(to_toml(tables))
        vehicle = ("simulate-vehicle", "--mission", config, "--vehicle", case.vehicle, "--connect", autopilot)
        sender = ("send-traffic", config, "--to", adsb)
        events = fly_mission([str(config), "--command"], folder, LONGEST, vehicle, sender)
        return {"case": case._asdict(), "events": events, **judged(folder, config)}


def judged(folder: Path, config: Path) -> dict[str, Any]:
    """Return separation from the true aircraft, maneuvers and latencies of a flight's recording."""
    steps = list(read_recording(folder / "recording.mcap").steps())
    scenario = load_scenario(config)
    assert isinstance(scenario.traffic, SimulatedTrafficConfig)
    traffic = SimulatedTraffic(scenario.traffic, scenario.frame(), 0.0)
    epoch = epoch_of(steps, config)
    rows = []
    for step in steps:
        t = step.ownship.t - epoch
        if t >= 0.0:
            away = traffic.truth(t).positions[0] - step.ownship.position
            avoided = step.snapshot.maneuver is not None
            rows.append([t, *step.ownship.position, np.hypot(away[0], away[1]), abs(away[2]), avoided])
    path = np.array(rows)
    return {
        **outcome(folder),
        "path": path,
        "least": float(well_clear_ratio(path[:, 4], path[:, 5]).min()),
        "horizontal": float(path[:, 4].min()),
        "episodes": int((np.diff(path[:, 6], prepend=0.0) > 0).sum()),
    }


def epoch_of(steps: list[RecordedStep], config: Path) -> float:
    """Return the live time at which the sender's scenario began, s: no report comes before it was sent."""
    sent = reports_of_scans(*scans_of(config, duration=10.0))
    first = next(t for t, _ in sent)
    received = min(t for step in steps for scan in step.scans if scan.kind == "adsb" for t in scan.t_valid)
    return float(received) - first


def well_clear_ratio(horizontal: FloatArray, vertical: FloatArray) -> FloatArray:
    """Return how far apart two aircraft are, in well-clear volumes: below 1 it is lost."""
    return np.maximum(horizontal / WELL_CLEAR.dthr, vertical / WELL_CLEAR.zthr)


def page_of(rows: list[dict[str, Any]], parallel: int) -> str:
    """Return the page of results."""
    lines = [
        "# Head-on as processes on loopback",
        "",
        f"`python -m experiments.live_head_on --runs {max(row['case']['seed'] for row in rows)} --parallel {parallel}`:"
        " `scenarios/live_head_on.toml` flown in real time by a simulated vehicle behind MAVLink (copter 10 m/s, plane"
        " 22 m/s), an aircraft that comes head-on at 45 m/s and the same altitude, its ADS-B reports by GDL90 over UDP"
        " (errors and losses of the error model), and `wideberth fly --command`. Well clear is that of ASTM F3442, 2000"
        " ft and 250 ft: the ratio is the larger of the horizontal separation by the one and the vertical by the other,"
        " from the vehicle's telemetry to the true aircraft, and at least 1 where it was kept. A maneuver is one path"
        " commanded; left: how often the mission was left. Latency: from the start of a step to its bytes handed to the"
        " socket.",
        "",
        "![Paths and separation](live_head_on.png)",
        "",
        "| vehicle | aircraft passes, m east | run | least ratio | least range, m | maneuvers, reversals, left |"
        " mission finished | steps missed | step p50 / p95 / p99, ms |",
        "| --- | ---: | ---: | ---: | ---: | --- | --- | ---: | --- |",
    ]
    for row in rows:
        case, ms = row["case"], row["step_ms"]
        cells = [
            *(
                case["vehicle"],
                f"{case['offset']:.0f}",
                case["seed"],
                f"{row['least']:.2f}",
                f"{row['horizontal']:.0f}",
            ),
            f"{row['maneuvers']}, {row['reversals']}, {row['episodes']}",
            "yes" if row["completed"] else "no",
            row["missed"],
            f"{ms['p50']:.1f} / {ms['p95']:.1f} / {ms['p99']:.1f}",
        ]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    kept = sum(row["least"] >= 1.0 for row in rows)
    single = sum(row["maneuvers"] == 1 and row["reversals"] == 0 and row["episodes"] == 1 for row in rows)
    calm = sum(row["maneuvers"] != 1 and row["reversals"] == 0 for row in rows)
    done = sum(row["completed"] for row in rows)
    lines += [
        "",
        f"Of {len(rows)} runs {kept} kept well clear, {single} had one maneuver and no reversal, {done} finished the"
        f" mission. In the others the path was changed in flight, without a reversal in {calm} of"
        f" {len(rows) - single}; the mission was left {max(row['episodes'] for row in rows)} time at most.",
    ]
    return "\n".join(lines) + "\n"


def draw(rows: list[dict[str, Any]], file: Path) -> None:
    """Draw the paths from above, altitudes, and separation."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.5), layout="constrained")
    grid = figure.subplots(2, 3)
    for axes, vehicle in zip(grid, ("copter", "plane"), strict=True):
        for row in rows:
            if row["case"]["vehicle"] != vehicle:
                continue
            path, colour = row["path"], f"C{OFFSETS.index(row['case']['offset'])}"
            label = f"{row['case']['offset']:.0f} m" if row["case"]["seed"] == 1 else None
            axes[0].plot(path[:, 2], path[:, 1] / 1e3, colour, lw=1, label=label)
            axes[1].plot(path[:, 0], -path[:, 3], colour, lw=1)
            axes[2].plot(path[:, 0], well_clear_ratio(path[:, 4], path[:, 5]), colour, lw=1)
        axes[0].set(title=f"{vehicle}: from above", xlabel="east, m", ylabel="north, km")
        axes[0].axvline(0.0, color="0.7", lw=0.8, zorder=0)
        axes[0].legend(title="aircraft passes", fontsize=8)
        axes[1].set(title="altitude", xlabel="time, s", ylabel="m")
        axes[2].set(title="separation in well-clear volumes", xlabel="time, s", ylim=(0.0, 6.0))
        axes[2].axhline(1.0, color="0.3", lw=0.8, ls="--")
    figure.savefig(file, dpi=110)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="of each vehicle and offset")
    parser.add_argument("--parallel", type=int, default=3)
    parser.add_argument("--out", type=Path, default=RESULT)
    given = parser.parse_args()
    cases = [
        Case(v, offset, seed) for v in ("copter", "plane") for offset in OFFSETS for seed in range(1, given.runs + 1)
    ]
    rows = []
    with ThreadPoolExecutor(given.parallel) as pool:
        for row in pool.map(run, cases):
            rows.append(row)
            print({key: value for key, value in row.items() if key not in ("events", "path")}, flush=True)
    draw(rows, given.out.with_suffix(".png"))
    given.out.write_text(page_of(rows, given.parallel), encoding="utf-8")


if __name__ == "__main__":
    main()
