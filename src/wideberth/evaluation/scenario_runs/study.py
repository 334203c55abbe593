"""The runs of a study: each in some process, its row kept as soon as it is there, so that a study can go on."""

import hashlib
import itertools
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import wideberth
from wideberth.config import ScenarioConfig, build_scenario, read_toml
from wideberth.errors import InputError
from wideberth.evaluation.scenario_runs.variation import draw, drawn_tables

ROWS = "runs.jsonl"
_STUDY = "study.json"
RUNS_MAX = 1_000_000
Row = dict[str, Any]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Study:
    """What is to be flown.

    Attributes
    ----------
    tables : mapping
        The scenario's, overrides applied.
    source : str
        What to call it.
    folder : str
        What relative paths in it are relative to.
    seed : int
    runs : int
    both : bool
        Whether each run is flown with and without avoidance (the same draw and noise; the latter without sensors, as
        only true states are compared), or only without.
    """

    tables: Mapping[str, Any]
    source: str
    folder: str
    seed: int
    runs: int
    both: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.runs <= RUNS_MAX:
            raise InputError(f"runs {self.runs}: give 1 to {RUNS_MAX:,}")

    def scenario(self) -> ScenarioConfig:
        """Return the scenario itself, checked.

        Raises
        ------
        InputError
            With one line for each thing that is wrong.
        """
        return build_scenario(self.tables, source=self.source, folder=Path(self.folder))

    def digest(self) -> str:
        """Return what tells this study from others; the number of runs is no part of it, as more may be asked for."""
        what = [wideberth.__version__, self.tables, self.folder, self.seed, self.both]
        return hashlib.sha256(json.dumps(what, sort_keys=True, default=str).encode()).hexdigest()


def is_scenario(path: Path) -> bool:
    """Return whether a TOML file is a scenario: it says who flies, where an experiment says how encounters are drawn.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    tables = read_toml(path)
    return "encounter" not in tables and ("mission" in tables or "traffic" in tables)


def fly(study: Study, run: int) -> Row:
    """Fly one run and return its row; depends on nothing but the study and the run's number.

    Raises
    ------
    InputError
        If what was drawn makes no scenario.
    """
    from wideberth.run import fly_unaware, run_scenario

    vary = study.scenario().montecarlo.vary
    drawn = draw(study.tables, vary, study.seed, run)
    row: Row = {"run": run, "seed": drawn.seed, "drawn": dict(drawn.values), "overrides": drawn.overrides()}
    for avoid in (False, True) if study.both else (False,):
        tables = drawn_tables(study.tables, drawn, avoid=avoid)
        scenario = build_scenario(tables, source=f"{study.source}, run {run}", folder=Path(study.folder))
        # Of the twin only true states are compared: it needs neither sensors nor tracker.
        summary = run_scenario(scenario, None) if avoid or not study.both else fly_unaware(scenario)
        row["with" if avoid else "without"] = _kept(summary)
    return row


def _kept(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scores that a row keeps."""
    names = (
        "intruders",
        "nmac_count",
        "violation_count",
        "loss_of_well_clear_count",
        "min_horizontal_separation_m",
        "min_vertical_separation_m",
        "alerts",
        "maneuvers",
        "least_bad_maneuvers",
        "reversals",
        "path_length_m",
        "mission_path_length_m",
        "mission_completed",
        "unknown_alert_steps",
        "steps",
        "step_time_ms",
    )
    kept = {name: summary[name] for name in names}
    closest = summary["per_intruder"][0] if summary["per_intruder"] else None
    kept["separation_ratio"] = None if closest is None else closest["separation_ratio"]
    return kept


def run_study(study: Study, out: Path, workers: int | None, *, resume: bool, progress: Progress) -> list[Row]:
    """Fly all runs that are not yet in the folder, and return all rows in order.

    Parameters
    ----------
    study : Study
    out : Path
        Folder for the rows.
    workers : int or None
        Processes; None: one for each CPU. Rows do not depend on it.
    resume : bool
        Go on with what is there; else the folder must not hold a study.
    progress : callable
        Told how many runs are done, and of how many.

    Raises
    ------
    InputError
        If the folder holds a study already or another one, it cannot be written, or a run cannot be flown.
    """
    count = os.cpu_count() or 1 if workers is None else workers
    if count < 1:
        raise InputError(f"--workers {workers}: give at least 1")
    study.scenario()
    rows = _opened(study, out, resume)
    missing = [run for run in range(study.runs) if run not in rows]
    progress(study.runs - len(missing), study.runs)
    try:
        with (out / ROWS).open("a", encoding="utf-8") as file:
            for row in _flown(study, missing, min(count, len(missing))):
                file.write(json.dumps(row, allow_nan=False) + "\n")
                file.flush()
                rows[row["run"]] = row
                progress(sum(run < study.runs for run in rows), study.runs)
    except OSError as error:
        raise InputError(f"{out / ROWS}: cannot be written: {error.strerror or error}") from error
    return [rows[run] for run in range(study.runs)]


def _flown(study: Study, missing: list[int], workers: int) -> Iterator[Row]:
    if workers <= 1:
        for run in missing:
            yield fly(study, run)
        return
    # Spawned, as a fork would copy the locks of numba's and numpy's threads.
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
    try:
        # Few are handed over at a time, so that an interruption waits for few.
        left = iter(missing)
        running: set[Future[Row]] = {pool.submit(fly, study, run) for run in itertools.islice(left, 2 * workers)}
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            running |= {pool.submit(fly, study, run) for run in itertools.islice(left, len(done))}
            for future in done:
                yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _opened(study: Study, out: Path, resume: bool) -> dict[int, Row]:
    """Make the folder ready, and return the rows that are in it."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        manifest = out / _STUDY
        if not manifest.exists():
            text = {"digest": study.digest(), "scenario": study.source, "seed": study.seed, "tables": study.tables}
            manifest.write_text(json.dumps(text, indent=2, default=str) + "\n", encoding="utf-8")
            (out / ROWS).unlink(missing_ok=True)
            return {}
        if not resume:
            raise InputError(f"{out} holds a study already: go on with --resume, or give another folder")
        if json.loads(manifest.read_text(encoding="utf-8")).get("digest") != study.digest():
            raise InputError(f"{out} holds another study (other scenario, seed or version): give another folder")
        return dict(_rows(out / ROWS))
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{out}: cannot be used: {error}") from error


def _rows(path: Path) -> Iterator[tuple[int, Row]]:
    if not path.exists():
        return
    good = 0
    data = path.read_bytes()
    for line in data.splitlines(keepends=True):
        # A killed process may have left half a line at the end.
        if not line.endswith(b"\n"):
            break
        row = json.loads(line)
        yield int(row["run"]), row
        good += len(line)
    if good < len(data):
        with path.open("r+b") as file:
            file.truncate(good)
