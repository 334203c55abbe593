"""Blocks run by the workers of a dask scheduler; rows come back as Arrow data, and no folder need be shared.

Tasks are pure functions of their arguments: dask may run one again when its worker is lost, and the rows are the same.
"""

import contextlib
import itertools
import logging
import math
import queue
import signal
import threading
import time
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from typing import Any

import distributed
import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.engines import POLL_S, Finished, Job, run_block
from wideberth.evaluation.montecarlo.experiment import Experiment, build_experiment
from wideberth.evaluation.montecarlo.plan import Block

CONNECT_S = 5.0
_dask: Any = distributed  # which is typed in part only
_GO_ON = "what is done is kept: go on with --resume"
_RETRIES = 3

_ready: dict[str, Experiment] = {}  # in a worker: experiments whose kernels are compiled
_ready_lock = threading.Lock()


class DaskEngine:
    """Workers of a dask scheduler.

    Parameters
    ----------
    workers : int
        Started on this machine if there is no scheduler.
    scheduler : str or None
        Address, such as ``tcp://10.0.0.1:8786``.
    say : callable
        Told in words what is waited for.

    Raises
    ------
    InputError
        If no scheduler answers.
    """

    def __init__(self, workers: int, scheduler: str | None, say: Callable[[str], None]) -> None:
        self._say = say
        self._where = "the dask workers here" if scheduler is None else f"the dask scheduler at {scheduler}"
        # What goes wrong is told in one line; dask tells it in many.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        self._cluster = None if scheduler is not None else _own_cluster(workers)
        try:
            self._client = _dask.Client(self._cluster or scheduler, timeout=CONNECT_S, set_as_default=False)
        except Exception as error:
            if self._cluster is not None:
                raise
            # Whatever else may answer there, its words raise anything.
            reason = error if isinstance(error, OSError | ValueError) else "what answers there is no dask scheduler"
            raise InputError(f"--scheduler {scheduler}: {_first_line(reason)}") from None

    def workers(self) -> int:
        """Return the number of threads of all workers that are there now."""
        try:
            return sum(self._client.nthreads().values())
        except Exception as error:
            raise self._gone(error) from error

    def run(self, job: Job, blocks: Iterable[Block], stop: threading.Event) -> Generator[Finished, None, None]:
        """Yield blocks as they are finished (see `Engine`).

        Raises
        ------
        InputError
            If the scheduler goes away, or its workers cannot run this code.
        """
        from wideberth.evaluation.montecarlo.manifest import code_hash

        run, numbers = uuid.uuid4().hex[:8], itertools.count()
        code = (job.experiment.resolved(), job.experiment.digest(), code_hash())
        waiting = iter(blocks)
        running: dict[str, tuple[Block, Any]] = {}
        finished: queue.SimpleQueue[str] = queue.SimpleQueue()
        workers, looked = 0, -math.inf
        try:
            while True:
                if time.monotonic() - looked > 1.0:  # workers may come and go
                    workers, looked = self.workers(), time.monotonic()
                    if not workers:
                        self._say(f"{self._where} has no workers: waiting for one")
                while not stop.is_set() and len(running) < 2 * max(workers, 1):
                    block = next(waiting, None)
                    if block is None:
                        break
                    key = f"wideberth-{run}-{next(numbers)}"
                    running[key] = (
                        block,
                        self._client.submit(
                            _run_block, *code, job.seed, job.avoid, block, key=key, pure=False, retries=_RETRIES
                        ),
                    )
                    running[key][1].add_done_callback(lambda future: finished.put(future.key))
                if not running or (stop.is_set() and not workers):
                    return
                try:
                    key = finished.get(timeout=POLL_S)
                except queue.Empty:
                    continue
                yield self._result(*running.pop(key))
        finally:
            for _, future in running.values():
                with contextlib.suppress(Exception):
                    future.cancel()

    def close(self) -> None:
        """Let go of the scheduler, and end the workers that were started here."""
        with contextlib.suppress(Exception):
            self._client.close(timeout=CONNECT_S)
        if self._cluster is not None:
            with contextlib.suppress(Exception):
                self._cluster.close(timeout=CONNECT_S)

    def _result(self, block: Block, future: Any) -> Finished:
        try:
            data, cpu_s, wall_s, worker = future.result()
        except InputError:
            raise
        except _dask.KilledWorker as error:
            raise InputError(
                f"{self._where}: encounters from {block.first} with {block.intruders} intruders were given up, as one "
                f"worker after another was lost with them; {_GO_ON}"
            ) from error
        except (CancelledError, OSError) as error:
            raise self._gone(error) from error
        except (ImportError, RuntimeError) as error:
            # A scheduler unpacks what it hands on, and says so when it cannot.
            if isinstance(error, RuntimeError) and "deserialization" not in str(error):
                raise
            raise InputError(
                f"{self._where}, or a worker of it, cannot import this code: install the same wideberth[cluster] there"
            ) from error
        return Finished(block, pa.ipc.open_stream(data).read_all(), cpu_s, wall_s, worker)

    def _gone(self, error: Exception) -> InputError:
        return InputError(f"{self._where} has gone ({_first_line(error)}); {_GO_ON}")


def _own_cluster(workers: int) -> Any:
    """Start workers on this machine; Ctrl-C is for this process alone."""
    with _ignoring_interrupts():
        return _dask.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        )


@contextlib.contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Ignore SIGINT, which processes started meanwhile inherit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _run_block(
    tables: dict[str, Any], digest: str, kernels: str, seed: int, avoid: bool, block: Block
) -> tuple[bytes, float, float, str]:
    """Run a block in a worker; return its rows as an Arrow stream, CPU s, wall s and the worker's address."""
    finished = run_block(Job(_experiment(tables, digest, kernels), seed, avoid), block)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, finished.table.schema) as stream:
        stream.write_table(finished.table)
    return sink.getvalue().to_pybytes(), finished.cpu_s, finished.wall_s, str(_dask.get_worker().address)


def _experiment(tables: dict[str, Any], digest: str, code: str) -> Experiment:
    """Return the experiment that a task is of, with its kernels compiled."""
    with _ready_lock:
        if digest not in _ready:
            from wideberth.evaluation.montecarlo import tiers
            from wideberth.evaluation.montecarlo.manifest import code_hash

            experiment = build_experiment(tables)
            if code_hash() != code or experiment.digest() != digest:
                raise InputError(
                    f"the dask worker at {_dask.get_worker().address} has another wideberth: install the same there"
                )
            tiers.prepare(experiment)
            _ready[digest] = experiment
        return _ready[digest]


def _first_line(error: object) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
