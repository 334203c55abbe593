"""The conflict scenarios over fresh seeds: violations, paths and reversals, and a picture of one flight of each.

`python -m experiments.scenario_table` writes docs/results/scenarios.md and scenarios.png.
"""

import argparse
import math
import multiprocessing
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context

from experiments.flight_pictures import FlightTrace, draw_flight
from wideberth.assembly import build_traffic
from wideberth.config import build_scenario, read_toml
from wideberth.evaluation.montecarlo.intervals import wilson
from wideberth.evaluation.report_shell import write_files
from wideberth.evaluation.report_style import RC, new_figure, png
from wideberth.run import fly_unaware, run_scenario
from wideberth.simulation.config import CylinderConfig
from wideberth.types import Snapshot

SCENARIOS = Path("scenarios")
RESULTS = Path("docs/results")
NAMES = (
    "climbing_from_below",
    "overtaking",
    "two_sided_squeeze",
    "intruder_turns_late",
    "radar_dropout",
    "onboard_radars",
    "flight_test",
)
Row = Mapping[str, Any]


def fly(name: str, seed: int, avoid: bool) -> Row:
    """Fly a scenario once; JSON types only. Without avoidance only violations are told."""
    path = SCENARIOS / f"{name}.toml"
    scenario = build_scenario({**read_toml(path), "seed": seed, "avoid": avoid}, source=str(path), folder=SCENARIOS)
    if not avoid:
        # Of the twin only the true states are compared: no sensor looks.
        return {"scenario": name, "seed": seed, "violations": fly_unaware(scenario)["violation_count"]}
    summary = run_scenario(scenario, None)
    return {
        "scenario": name,
        "seed": seed,
        "violations": summary["violation_count"],
        "closest": min(one["separation_ratio"] for one in summary["per_intruder"]),
        "path_ratio": summary["path_length_m"] / summary["mission_path_length_m"],
        "reversals": summary["reversals"],
        "maneuvers": summary["maneuvers"],
        "least_bad": summary["least_bad_maneuvers"] > 0,
        "completed": summary["mission_completed"],
    }


def picture(names: Sequence[str], seed: int) -> bytes:
    """Return one flight of each scenario and of the thesis's two, from above and from the side, as PNG."""
    names = ("gbr_1", "gbr_2", *names)
    with rc_context(RC):
        figure = new_figure(11.0, 2.7 * math.ceil(len(names) / 2))
        grid = figure.add_gridspec(math.ceil(len(names) / 2), 4)
        for k, name in enumerate(names):
            places = grid[k // 2, 2 * (k % 2)], grid[k // 2, 2 * (k % 2) + 1]
            draw_flight(figure, places, _trace(name, seed), name)
        return png(figure)


def _trace(name: str, seed: int) -> FlightTrace:
    path = SCENARIOS / f"{name}.toml"
    scenario = build_scenario({**read_toml(path), "seed": seed}, source=str(path), folder=SCENARIOS)
    assert scenario.mission is not None
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    truth = build_traffic(scenario, mission, frame, 3600.0).truth
    volume = scenario.evaluation.collision_volume
    assert isinstance(volume, CylinderConfig)
    times, own, intruders = [], [], []

    def note(elapsed: float, _planned: float, snapshot: Snapshot) -> None:
        times.append(elapsed)
        own.append(np.array(snapshot.ownship.position))
        intruders.append(truth.truth(snapshot.t).positions)

    run_scenario(scenario, None, progress=note)
    return FlightTrace(
        np.array(times), np.array(own), np.array(intruders), mission.waypoints, volume.radius_m, volume.half_height_m
    )


def markdown(alone: Sequence[Row], avoided: Sequence[Row], command: str) -> str:
    """Return the page.

    Parameters
    ----------
    alone, avoided : sequence of dict
        Rows of `fly` without and with avoidance.
    command : str
        What made them.
    """
    lines = [
        "# The conflict scenarios",
        "",
        f"`{command}`: plot-level radar and tracker; the volumes are those of the scenarios. A run violates if anybody"
        " comes within the volume; 95 % interval of Wilson. The closest approach is in volumes of 153 m"
        " and 30.5 m: 1 is a touch (the flight test keeps 10 m).",
        "",
        "One flight of each and of the thesis's two, from above (the mission dashed, circles of the volume's radius at"
        " the closest points) and over time (its height while anybody is within the radius):",
        "",
        "![One flight of each](scenarios.png)",
        "",
        "| scenario | without: runs with a violation | with | 95 % | seeds | closest, median, least |"
        " path / mission, mean, max | maneuvers a run | reversals | runs with a least bad path | not completed |",
        "| --- | ---: | ---: | --- | --- | --- | --- | ---: | ---: | ---: | ---: |",
    ]
    for name in dict.fromkeys(row["scenario"] for row in avoided):
        rows = [row for row in avoided if row["scenario"] == name]
        without = [row for row in alone if row["scenario"] == name]
        hit = [row["seed"] for row in rows if row["violations"]]
        low, high = wilson(len(hit), len(rows)) or (0.0, 1.0)
        closest, ratios = sorted(row["closest"] for row in rows), [row["path_ratio"] for row in rows]
        lines.append(
            f"| {name} | {sum(row['violations'] > 0 for row in without)} of {len(without)} | {len(hit)} of {len(rows)}"
            f" | {100 * low:.1f} to {100 * high:.1f} % | {', '.join(map(str, hit)) or '-'}"
            f" | {closest[len(rows) // 2]:.2f}, {closest[0]:.2f} | {sum(ratios) / len(rows):.3f}, {max(ratios):.3f}"
            f" | {sum(row['maneuvers'] for row in rows) / len(rows):.1f} | {sum(row['reversals'] for row in rows)}"
            f" | {sum(row['least_bad'] for row in rows)} | {sum(not row['completed'] for row in rows)} |"
        )
    return "\n".join(lines) + "\n"


def _flown(jobs: Sequence[tuple[str, int, bool]], workers: int) -> Iterator[Row]:
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(fly, *zip(*jobs, strict=True))


def main() -> None:
    """Fly, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="of each scenario; without avoidance one is flown")
    parser.add_argument("--first-seed", type=int, default=1001, help="seeds below were used for tuning")
    parser.add_argument("--scenarios", nargs="+", default=NAMES)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
    alone = list(_flown([(name, asked.first_seed, False) for name in asked.scenarios], asked.workers))
    avoided = list(_flown([(name, seed, True) for name in asked.scenarios for seed in seeds], asked.workers))
    command = f"python -m experiments.scenario_table --seeds {asked.seeds} --first-seed {asked.first_seed}"
    page, drawn = markdown(alone, avoided, command), picture(asked.scenarios, asked.first_seed)
    write_files(RESULTS, {"scenarios.md": page, "scenarios.png": drawn})


if __name__ == "__main__":
    main()
