"""Where blocks of encounters are run: in threads here, or on a dask scheduler's workers.

An engine only decides where and when; what a block comes to depends on its numbers alone.
"""

import contextlib
import os
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Protocol

import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.plan import Block

POLL_S = 0.2  # how soon a request to stop is seen


@dataclass(frozen=True, slots=True)
class Job:
    """What blocks are run of.

    Attributes
    ----------
    experiment : Experiment
    seed : int
    avoid : bool
    """

    experiment: Experiment
    seed: int
    avoid: bool


@dataclass(frozen=True, slots=True)
class Finished:
    """A block that has been run.

    Attributes
    ----------
    block : Block
    table : pyarrow.Table
        Its rows.
    cpu_s, wall_s : float
        What it took, s.
    worker : str
        Where.
    """

    block: Block
    table: pa.Table
    cpu_s: float
    wall_s: float
    worker: str


class Engine(Protocol):
    """Runs blocks. Closed after use, whatever happened."""

    def workers(self) -> int:
        """Return how many blocks run at once."""
        ...

    def run(self, job: Job, blocks: Iterable[Block], stop: threading.Event) -> Generator[Finished, None, None]:
        """Yield blocks as they are finished, in any order, only few of them being in memory at once.

        Once `stop` is set no more are begun; those that run are waited for and yielded.
        """
        ...

    def close(self) -> None:
        """Let go of the workers."""
        ...


class LocalEngine:
    """Threads of this process: the compiled code holds no interpreter lock.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers

    def workers(self) -> int:
        """Return the number of threads."""
        return self._workers

    def run(self, job: Job, blocks: Iterable[Block], stop: threading.Event) -> Generator[Finished, None, None]:
        """Yield blocks as they are finished (see `Engine`)."""
        from wideberth.evaluation.montecarlo import tiers

        tiers.prepare(job.experiment)
        waiting = iter(blocks)
        running: set[Future[Finished]] = set()
        pool = ThreadPoolExecutor(self._workers, thread_name_prefix="worker")
        try:
            while True:
                # As many again wait their turn, so that no worker waits while a shard is written.
                while not stop.is_set() and len(running) < 2 * self._workers:
                    block = next(waiting, None)
                    if block is None:
                        break
                    running.add(pool.submit(run_block, job, block))
                if stop.is_set():
                    running = {future for future in running if not future.cancel()}
                if not running:
                    return
                done, running = wait(running, timeout=POLL_S, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

    def close(self) -> None:
        """Do nothing: threads end with each run."""


def run_block(job: Job, block: Block) -> Finished:
    """Run a block here and now."""
    from wideberth.evaluation.montecarlo import tiers

    wall, cpu = time.perf_counter(), time.thread_time()
    table = tiers.run_block(job.experiment, job.seed, block.intruders, block.first, block.count, job.avoid)
    return Finished(block, table, time.thread_time() - cpu, time.perf_counter() - wall, threading.current_thread().name)


def seconds_per_row(job: Job, intruders: int, encounters: int, least_s: float = 0.2) -> float:
    """Measure what a row takes here.

    Parameters
    ----------
    job : Job
    intruders : int
    encounters : int
        How many there are to try.
    least_s : float
        CPU s after which the measurement is good enough.

    Returns
    -------
    float
        CPU s for each row.
    """
    count = 1
    while True:
        finished = run_block(job, Block(0, intruders, 0, count))
        if finished.cpu_s >= least_s or count == encounters:
            return finished.cpu_s / (count * intruders)
        # Not too far ahead: the first encounters may be short ones.
        count = min(encounters, 4 * count)


def available_cpus() -> int:
    """Return how many CPUs this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def open_engine(kind: str, workers: int | None, scheduler: str | None, say: Callable[[str], None]) -> Iterator[Engine]:
    """Give an engine, and close it afterwards.

    Parameters
    ----------
    kind : str
        ``local`` or ``dask``.
    workers : int or None
        None: as many as there are CPUs. With a scheduler its workers count.
    scheduler : str or None
        Address of a dask scheduler; None: dask workers of its own on this machine.
    say : callable
        Told in words what is waited for.

    Raises
    ------
    InputError
        If there is no such engine, dask is not installed, or no scheduler answers.
    """
    check_engine(kind, workers, scheduler)
    count = workers or available_cpus()
    engine: Engine
    if kind == "local":
        engine = LocalEngine(count)
    else:
        try:
            from wideberth.evaluation.montecarlo.dask_engine import DaskEngine
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] not in ("dask", "distributed"):
                raise
            raise InputError("--engine dask: dask is not installed: pip install wideberth[cluster]") from None
        engine = DaskEngine(count, scheduler, say)
    try:
        yield engine
    finally:
        engine.close()


def check_engine(kind: str, workers: int | None, scheduler: str | None) -> None:
    """Refuse what no engine can be made of.

    Raises
    ------
    InputError
        If the kind is unknown, there are no workers, or a scheduler is given to the local engine.
    """
    if kind not in ("local", "dask"):
        raise InputError(f"--engine {kind}: use local or dask")
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: give at least 1")
    if scheduler is not None and kind != "dask":
        raise InputError("--scheduler needs --engine dask")
