"""One Monte Carlo run: from what is asked for to shards, summary and report."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.engines import Engine, Job, check_engine, open_engine, seconds_per_row
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.folder import RunFolder, existing_manifest, open_folder, shard_name
from wideberth.evaluation.montecarlo.manifest import Manifest
from wideberth.evaluation.montecarlo.plan import Block, Part, check_request, choose_block_rows, even_sample, pieces
from wideberth.evaluation.montecarlo.timings import TimingsFile, read_timings

CYCLE_SAMPLE = 3  # encounters for each number of intruders whose decision cycles are timed


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What a run is asked to do.

    Attributes
    ----------
    experiment : Experiment
    out : Path
        Folder of the run.
    seed : int or None
        None: the experiment's.
    encounters, intruders : int or None
        Encounters for each number of intruders, and one number of intruders; None: those of the experiment.
    avoid : bool
    resume : bool
        Go on with a run that is there.
    part : Part
        Of the blocks, to be run here.
    engine : str
        ``local`` or ``dask``.
    workers : int or None
        None: as many as there are CPUs.
    scheduler : str or None
        Address of a dask scheduler; None: dask workers here.
    sensitivity : int
        Encounters for each value of the sensitivity study; 0: none.
    report : bool
        Whether to write report.html.
    block_rows : int or None
        Size of a block (see `Plan`); None: as measured. Rows do not depend on it.
    settings : dict
        More for the summary: ``experiment_path`` and ``overrides``, for the commands that replay encounters.
    """

    experiment: Experiment
    out: Path
    seed: int | None = None
    encounters: int | None = None
    intruders: int | None = None
    avoid: bool = True
    resume: bool = False
    part: Part = field(default_factory=Part)
    engine: str = "local"
    workers: int | None = None
    scheduler: str | None = None
    sensitivity: int = 0
    report: bool = True
    block_rows: int | None = None
    settings: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run has come.

    Attributes
    ----------
    doing : str
        In words.
    encounters, rows : int
        Finished, of this process's part; rows are the better measure of the work.
    encounters_total, rows_total : int
    """

    doing: str
    encounters: int = 0
    rows: int = 0
    encounters_total: int = 0
    rows_total: int = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run has come to.

    Attributes
    ----------
    stopped : bool
        Whether it was asked to stop before its end.
    missing_blocks, missing_encounters : int
        Still to be run, of all parts.
    summary : dict or None
        None: blocks are missing.
    summary_path, report_path : Path or None
    """

    stopped: bool
    missing_blocks: int
    missing_encounters: int
    summary: dict[str, Any] | None = None
    summary_path: Path | None = None
    report_path: Path | None = None


Watch = Callable[[Progress], None]


def run_montecarlo(request: Request, watch: Watch = lambda progress: None) -> Outcome:
    """Run what is missing of a Monte Carlo run; sum up and report once nothing is.

    Rows depend on experiment, seed, number of intruders, encounter and avoidance, and on nothing else. SIGINT stops it
    between blocks, where it runs in the main thread; a second one at once.

    Parameters
    ----------
    request : Request
    watch : callable
        Told how far the run has come.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        If the request cannot be met, the folder is not fit for it, or a file cannot be written; what is there is kept.
    """
    experiment = request.experiment
    seed = experiment.seed if request.seed is None else request.seed
    if not 0 <= seed < 2**63:
        raise InputError(f"--seed {seed}: give a number from 0 to 2^63 - 1")
    if request.sensitivity < 0:
        raise InputError(f"--sensitivity {request.sensitivity}: give a number of encounters, or 0 for none")
    encounters, intruders = check_request(experiment, request.encounters, request.intruders)
    check_engine(request.engine, request.workers, request.scheduler)
    found = existing_manifest(request.out, request.resume, shared=request.part.of > 1)

    def wanted(block_rows: int) -> Manifest:
        return Manifest.of(experiment, seed, request.avoid, encounters, intruders, block_rows)

    if found is not None:
        found.check_same(wanted(found.block_rows), request.out)
    job = Job(experiment, seed, request.avoid)

    def say(text: str) -> None:
        watch(Progress(text))

    with open_engine(request.engine, request.workers, request.scheduler, say) as engine:
        block_rows = request.block_rows or (found.block_rows if found else None)
        if block_rows is None:
            say("compiling kernels")
            block_rows = _measure_block_rows(job, encounters, intruders)
        folder = open_folder(request.out, wanted(block_rows), request.part, request.resume)
        stopped = _run_blocks(engine, job, folder, request.part, watch)
        present = folder.present()
        missing = [b.count for b in folder.plan if shard_name(b) not in present]
        if missing:
            return Outcome(stopped, len(missing), sum(missing))
        summary = _sum_up(request, engine, job, folder, watch)
    summary_path = folder.write_summary(summary)
    report_path = None
    if request.report:
        from wideberth.evaluation.montecarlo.report import write_report

        say("writing the report")
        report_path = write_report(request.out, summary, experiment)
    return Outcome(False, 0, 0, summary, summary_path, report_path)


def _measure_block_rows(job: Job, encounters: int, intruders: tuple[int, ...]) -> int:
    from wideberth.evaluation.montecarlo import tiers

    tiers.prepare(job.experiment)
    return choose_block_rows(seconds_per_row(job, intruders[-1], encounters), encounters * sum(intruders))


def _run_blocks(engine: Engine, job: Job, folder: RunFolder, part: Part, watch: Watch) -> bool:
    """Run the blocks of a part that are missing, after checking those that are there; return whether stopped."""
    encounters_total = sum(b.count for b in folder.plan if b in part)
    rows_total = sum(b.rows for b in folder.plan if b in part)
    encounters = rows = 0

    def tell(doing: str) -> None:
        watch(Progress(doing, encounters, rows, encounters_total, rows_total))

    present = folder.present()
    missing = []
    for block in (b for b in folder.plan if b in part):
        if shard_name(block) not in present:
            missing.append(block)
            continue
        folder.read(block)
        encounters += block.count
        rows += block.rows
        tell("checking what is there")
    if not missing:
        return False
    tell("running")
    timings = TimingsFile(folder.path, part)
    with _stopped_by_interrupt() as stop, contextlib.closing(engine.run(job, missing, stop)) as finished:
        for done in finished:
            folder.write(done.block, done.table)
            timings.append(done.block, done.cpu_s, done.wall_s, done.worker)
            encounters += done.block.count
            rows += done.block.rows
            tell("stopping" if stop.is_set() else "running")
    return stop.is_set()


def _sum_up(request: Request, engine: Engine, job: Job, folder: RunFolder, watch: Watch) -> dict[str, Any]:
    """Return the summary of a run that is complete."""
    from wideberth.evaluation.montecarlo.summary import summarise

    manifest = folder.manifest
    settings = {
        "seed": manifest.seed,
        "avoidance": manifest.avoidance,
        "encounters": manifest.encounters,
        "intruders": list(manifest.intruders),
        "digest": manifest.digest,
        "version": manifest.version,
        "code": manifest.code,
        **(request.settings or {}),
    }
    cycles = _cycle_times(job, manifest, watch)
    watch(Progress("summing up"))
    summary = summarise(folder.tables(), job.experiment, settings, cycles)
    summary["block_times"] = [
        {"intruders": intruders, **{key: round(value, 3) for key, value in totals.items()}}
        for intruders, totals in read_timings(folder.path).items()
    ]
    if request.sensitivity:
        from wideberth.evaluation.montecarlo.sensitivity import run_sensitivity

        summary["sensitivity"] = run_sensitivity(
            job.experiment,
            job.seed,
            request.sensitivity,
            _spread(engine),
            lambda what, fraction: watch(Progress(f"sensitivity: {what} ({100 * fraction:.0f} %)")),
        )
    return summary


def _cycle_times(job: Job, manifest: Manifest, watch: Watch) -> dict[str, Any]:
    """Return the times of decision cycles, measured on encounters spread over the set of each number of intruders."""
    from wideberth.evaluation.montecarlo import tiers

    times: dict[str, Any] = {}
    sample = even_sample(manifest.encounters, CYCLE_SAMPLE)
    for intruders in manifest.intruders:
        watch(Progress(f"timing decision cycles, intruders: {intruders}"))
        measured = tiers.cycle_times(job.experiment, job.seed, intruders, sample, job.avoid)
        times[str(intruders)] = {**measured, "sampled": len(sample)}
    return times


def _spread(engine: Engine) -> Callable[[Experiment, int, int, int, int, bool], pa.Table]:
    """Return a function like `tiers.run_block` that has an engine's workers share in each call."""

    def run(experiment: Experiment, seed: int, intruders: int, first: int, count: int, avoid: bool) -> pa.Table:
        parts = pieces(count, 2 * max(1, engine.workers()))
        blocks = [Block(i, intruders, first + offset, size) for i, (offset, size) in enumerate(parts)]
        with contextlib.closing(engine.run(Job(experiment, seed, avoid), blocks, threading.Event())) as finished:
            tables = {done.block.index: done.table for done in finished}
        return pa.concat_tables([tables[i] for i in sorted(tables)])

    return run


@contextlib.contextmanager
def _stopped_by_interrupt() -> Iterator[threading.Event]:
    """Give an event that SIGINT sets; a second SIGINT interrupts at once."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def handle(number: int, frame: object) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
