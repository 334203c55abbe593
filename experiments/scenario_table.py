"""The conflict scenarios over fresh seeds: violations, paths and reversals.

`python -m experiments.scenario_table` writes docs/results/scenarios.md.
"""

import argparse
import multiprocessing
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from wideberth.config import build_scenario, read_toml
from wideberth.evaluation.montecarlo.intervals import wilson
from wideberth.evaluation.report_shell import write_files
from wideberth.run import fly_unaware, run_scenario

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
    write_files(RESULTS, {"scenarios.md": markdown(alone, avoided, command)})


if __name__ == "__main__":
    main()
