"""The ground radar system over many seeds: the thesis's two scenarios at plot and sample level, and random encounters.

`python -m experiments.ground_radar` writes docs/results/ground_radar.md and its maps. Each flight's row is kept in
--rows, so that a study that was stopped goes on where it was, and one that is asked for more flies only what is new.
"""

import argparse
import json
import multiprocessing
import os
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from experiments.ground_radar_page import CASES, maps, markdown
from experiments.ground_radar_runs import Job, digest_of, fly
from wideberth import kernel_modules
from wideberth.evaluation.report_shell import write_files

RESULTS = Path("docs/results")
MANEUVERING = "traffic.maneuvering=true"
SAMPLES = "sensor.level=samples"


def jobs(scenarios: int, samples: int, straight: int, maneuvering: int, first: int) -> Iterator[Job]:
    """Yield all flights of a study, seeds from `first`.

    The two scenarios with either vehicle, and at sample level; random encounters with and without avoidance.
    """
    for scenario in ("gbr_1", "gbr_2"):
        for seed in range(first, first + scenarios):
            yield Job(scenario, scenario, (), seed, True, seed == first)
            yield Job(f"{scenario}_fixed_wing", scenario, (), seed, True, fixed_wing=True)
        for seed in range(first, first + samples):
            yield Job(f"{scenario}_samples", scenario, (SAMPLES,), seed, True)
    for case, count, overrides in (("straight", straight, ()), ("maneuvering", maneuvering, (MANEUVERING,))):
        for seed in range(first, first + count):
            for avoid in (False, True):
                yield Job(case, "gbr_random", overrides, seed, avoid)


def run(todo: list[Job], rows: Path, workers: int, most: int | None = None) -> list[dict[str, Any]]:
    """Fly what is not yet in the file of rows, at most so many, and return the rows there are, in order."""
    wanted = {job.key: job for job in todo}
    known = {row["key"]: row for row in _kept(rows) if row["key"] in wanted}
    # Rows of another version or scenario are flown again.
    missing = [job for job in todo if job.key not in known or known[job.key].get("digest") != digest_of(job)]
    for job in missing:
        known.pop(job.key, None)
    missing = missing[:most]
    with rows.open("a") as file:
        for row in _flown(missing, workers):
            file.write(json.dumps(row) + "\n")
            file.flush()
            known[row["key"]] = row
            print(f"{row['key']}: {row['violations']} violations {row['causes']}", flush=True)
    return [known[job.key] for job in todo if job.key in known]


def _kept(rows: Path) -> list[dict[str, Any]]:
    """Return the rows of a file; half a line, of a run that was killed, is cut off."""
    if not rows.exists():
        return []
    whole = rows.read_bytes()
    end = whole.rfind(b"\n") + 1
    if end < len(whole):
        rows.write_bytes(whole[:end])
    return [json.loads(line) for line in whole[:end].splitlines()]


def _flown(todo: list[Job], workers: int) -> Iterator[dict[str, Any]]:
    if workers == 1:
        _warm_up()
        yield from map(fly, todo)
        return
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_warm_up) as pool:
        for future in as_completed([pool.submit(fly, job) for job in todo]):
            yield future.result()


def _warm_up() -> None:
    """Load the compiled kernels, so that no cycle that is measured does."""
    for scenario in ("gbr_1", "gbr_2"):
        fly(Job("warm-up", scenario, (), 0, True))
    # Those that these flights did not call, too.
    for name in kernel_modules.loaded():
        kernel_modules.warm_up(name)


def main() -> None:
    """Fly, and write the page and the maps."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenarios", type=int, default=100, help="seeds of gbr_1 and of gbr_2, plot level")
    parser.add_argument("--samples", type=int, default=5, help="seeds of each, sample level")
    parser.add_argument("--straight", type=int, default=2000, help="random encounters, intruders straight")
    parser.add_argument("--maneuvering", type=int, default=2000, help="random encounters, intruders maneuvering")
    parser.add_argument("--first-seed", type=int, default=1001, help="seeds below were used for tuning")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--flights", type=int, help="fly at most so many this time; the same command again goes on")
    parser.add_argument("--rows", type=Path, default=Path("out/ground_radar_rows.jsonl"))
    asked = parser.parse_args()
    asked.rows.parent.mkdir(parents=True, exist_ok=True)
    todo = list(jobs(asked.scenarios, asked.samples, asked.straight, asked.maneuvering, asked.first_seed))
    rows = run(todo, asked.rows, asked.workers, asked.flights)
    command = (
        f"python -m experiments.ground_radar --scenarios {asked.scenarios} --samples {asked.samples}"
        f" --straight {asked.straight} --maneuvering {asked.maneuvering} --first-seed {asked.first_seed}"
    )
    planned = Counter(job.case for job in todo)
    page = markdown({case: [row for row in rows if row["case"] == case] for case in CASES}, planned, command)
    write_files(RESULTS, {"ground_radar.md": page, **maps(rows)})


if __name__ == "__main__":
    main()
