"""Run a tracker, chosen by name, over a file of radar plots, and score it where the file has the truth."""

import importlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, cast

import numpy as np

from wideberth.errors import InputError
from wideberth.evaluation.tracking_metrics import RunScore, score_run, summarise
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotFile
from wideberth.tracking import PLOT_TRACKERS
from wideberth.tracking.track_table import TrackTable

# Enough to call every kernel of a tracker's run, so that compiling is not measured.
_WARMUP_SCANS = 5


class PlotTracker(Protocol):
    """A tracker that can run over a whole file."""

    def run(self, plots: Plots) -> TrackTable:
        """Return the confirmed tracks of a run."""
        ...


@dataclass(frozen=True, slots=True)
class SeedRun:
    """What a tracker made of one run of a file.

    Attributes
    ----------
    seed : int
    table : TrackTable
    cpu : float
        CPU time, s.
    score : RunScore or None
        None where the file has no truth.
    """

    seed: int
    table: TrackTable
    cpu: float
    score: RunScore | None


def load_tracker(name: str) -> Callable[[], PlotTracker]:
    """Return what makes a tracker, new and with its default settings.

    Parameters
    ----------
    name : str
        One of `tracking.PLOT_TRACKERS`, or ``package.module:Class`` of a class with a model `Config` and a method
        ``run(plots) -> TrackTable``.

    Returns
    -------
    callable

    Raises
    ------
    InputError
        If there is none of that name, or it cannot be loaded.
    """
    if name not in PLOT_TRACKERS and ":" not in name:
        known = ", ".join(PLOT_TRACKERS)
        raise InputError(f"there is no tracker '{name}' (known: {known}; package.module:Class is taken as well)")
    address = PLOT_TRACKERS.get(name, name)
    module, _, attribute = address.partition(":")
    try:
        found: Any = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise InputError(f"tracker '{name}': cannot load {address}: {error}") from None
    if not (isinstance(found, type) and hasattr(found, "Config") and callable(getattr(found, "run", None))):
        raise InputError(f"tracker '{name}': {address} is not a class with a model Config and a method run(plots)")
    made: Any = found
    return lambda: cast(PlotTracker, made(made.Config()))


def run_file(
    file: PlotFile, make: Callable[[], PlotTracker], seeds: Sequence[int], done: Callable[[int], None] = lambda _: None
) -> list[SeedRun]:
    """Return what a tracker makes of some runs of a file.

    Parameters
    ----------
    file : PlotFile
    make : callable
        As `load_tracker` returns it; each run has a new tracker.
    seeds : sequence of int
    done : callable
        Called with the number of runs that are done, after each.

    Returns
    -------
    list of SeedRun

    Raises
    ------
    InputError
        If the file has no run of a seed.
    """
    plots = [file.scans(seed) for seed in seeds]
    if plots:
        make().run(_begin(plots[0]))
    runs = []
    for k, (seed, given) in enumerate(zip(seeds, plots, strict=True)):
        tracker = make()
        began = time.process_time()
        table = tracker.run(given)
        cpu = time.process_time() - began
        score = None if file.truth is None else score_run(table, file.truth, file.t)
        runs.append(SeedRun(seed, table, cpu, score))
        done(k + 1)
    return runs


def summary_of(file: PlotFile, tracker: str, runs: Sequence[SeedRun]) -> dict[str, Any]:
    """Return the numbers of some runs as plain data; ``metrics`` is None where the file has no truth.

    Parameters
    ----------
    file : PlotFile
    tracker : str
        Its name.
    runs : sequence of SeedRun
        At least one.

    Returns
    -------
    dict
    """
    scores = [run.score for run in runs if run.score is not None]
    counters: dict[str, int] = {}
    for run in runs:
        for name, count in run.table.counters.items():
            counters[name] = counters.get(name, 0) + int(count)
    by_seed = [1e3 * run.cpu / len(file.t) for run in runs]
    return {
        "file": file.name,
        "tracker": tracker,
        "seeds": [run.seed for run in runs],
        "cpu_ms_per_scan": sum(by_seed) / len(by_seed),
        "cpu_ms_per_scan_by_seed": by_seed,
        "counters": counters,
        "metrics": summarise(scores) if scores else None,
        "metrics_by_seed": [summarise([score]) for score in scores] if scores else None,
    }


def _begin(plots: Plots) -> Plots:
    n = min(_WARMUP_SCANS, plots.n_scans)
    return replace(
        plots,
        first=plots.first[: n + 1].copy(),
        z=np.ascontiguousarray(plots.z[: plots.first[n]]),
        t=plots.t[:n].copy(),
        sensor_position=plots.sensor_position[:n].copy(),
        sensor_attitude=plots.sensor_attitude[:n].copy(),
        ownship=plots.ownship[:n].copy(),
    )
