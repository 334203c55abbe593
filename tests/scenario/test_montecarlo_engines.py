"""Rows of a Monte Carlo run do not depend on workers, blocks, parts, engine, or how often it was stopped or killed."""

import contextlib
import errno
import json
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from tests.unit.test_montecarlo_folder import made_rows, same
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import tiers
from wideberth.evaluation.montecarlo.driver import Outcome, Progress, Request, run_montecarlo
from wideberth.evaluation.montecarlo.experiment import load_experiment
from wideberth.evaluation.montecarlo.folder import read_rows
from wideberth.evaluation.montecarlo.plan import Part
from wideberth.evaluation.montecarlo.timings import read_timings

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENT = load_experiment(ROOT / "experiments" / "adsb_collision.toml", ["encounter.intruders=[1, 3]"])
ENCOUNTERS = 50  # no multiple of any block size below
EXPECTED = pa.concat_tables([made_rows(EXPERIMENT, EXPERIMENT.seed, k, 0, ENCOUNTERS, True) for k in (1, 3)])
REAL = 60  # encounters of one intruder flown for real
WAIT_S = 300.0


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Encounters that are made up in no time."""
    monkeypatch.setattr(tiers, "run_block", made_rows)
    monkeypatch.setattr(tiers, "prepare", lambda experiment: None)
    monkeypatch.setattr(tiers, "cycle_times", made_cycle_times)


def made_cycle_times(
    experiment: object, seed: int, intruders: int, encounters: list[int], avoid: bool
) -> dict[str, Any]:
    return {"times_s": [0.001, 0.003], "agreed": len(encounters)}


def run(out: Path, watch: Any = lambda progress: None, **options: Any) -> Outcome:
    options = {"encounters": ENCOUNTERS, "workers": 2, "block_rows": 6, "report": False, **options}
    return run_montecarlo(Request(experiment=EXPERIMENT, out=out, **options), watch)


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize(("workers", "block_rows"), [(1, 6), (2, 6), (2, 7), (5, 1), (1, 10_000), (2, None)])
def test_rows_depend_neither_on_workers_nor_on_blocks(workers: int, block_rows: int | None, tmp_path: Path) -> None:
    outcome = run(tmp_path, workers=workers, block_rows=block_rows)
    assert outcome.summary is not None and outcome.missing_blocks == 0
    assert same(read_rows(tmp_path), EXPECTED)
    assert {k: t["encounters"] for k, t in read_timings(tmp_path).items()} == {1: ENCOUNTERS, 3: ENCOUNTERS}


@pytest.mark.usefixtures("made")
def test_rows_are_those_of_what_was_asked_for(tmp_path: Path) -> None:
    run(tmp_path, seed=7, intruders=4, encounters=9, avoid=False)
    assert same(read_rows(tmp_path), made_rows(EXPERIMENT, 7, 4, 0, 9, False))


@pytest.mark.usefixtures("made")
def test_parts_come_together(tmp_path: Path) -> None:
    others = [run(tmp_path, part=Part(i, 3), workers=1) for i in (3, 1)]
    assert all(o.summary is None and not o.stopped for o in others)
    assert others[0].missing_encounters > others[1].missing_encounters > 0
    assert not (tmp_path / "summary.json").exists()
    last = run(tmp_path, part=Part(2, 3))
    assert last.summary is not None and last.missing_blocks == 0
    assert same(read_rows(tmp_path), EXPECTED)
    assert sorted(p.name for p in tmp_path.glob("timings*")) == [f"timings_{i}_of_3.jsonl" for i in (1, 2, 3)]


@pytest.mark.usefixtures("made")
def test_parts_at_the_same_time(tmp_path: Path) -> None:
    outcomes: list[Outcome] = []
    threads = [
        threading.Thread(target=lambda i=i: outcomes.append(run(tmp_path, part=Part(i, 4), workers=1)))
        for i in (1, 2, 3, 4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(outcomes) == 4 and any(o.summary is not None for o in outcomes)
    assert same(read_rows(tmp_path), EXPECTED)


@pytest.mark.usefixtures("made")
def test_the_rest_of_a_part_that_never_ran(tmp_path: Path) -> None:
    run(tmp_path, part=Part(1, 3))
    assert run(tmp_path, resume=True).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)


@pytest.mark.usefixtures("made")
def test_going_on_with_what_is_complete_only_sums_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(tmp_path)
    before = {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("*.parquet")}
    monkeypatch.setattr(tiers, "run_block", None)
    assert run(tmp_path, resume=True).summary is not None
    assert {p.name: p.stat().st_mtime_ns for p in tmp_path.glob("*.parquet")} == before


@pytest.mark.usefixtures("made")
def test_few_blocks_are_in_memory_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock = threading.Lock()
    made = written = most = 0

    def counted(*arguments: Any) -> pa.Table:
        nonlocal made, most
        with lock:
            made += 1
            most = max(most, made - written)
        return made_rows(*arguments)

    def watch(progress: Progress) -> None:
        nonlocal written
        written = len(list(tmp_path.glob("*.parquet")))
        time.sleep(0.002)  # a slow disk

    monkeypatch.setattr(tiers, "run_block", counted)
    run(tmp_path, watch, workers=2, block_rows=1)
    assert made == 2 * ENCOUNTERS
    assert most <= 2 * 2 + 2 * 2 + 1  # in flight, and finished at once


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize("engine", ["local", "dask"])
def test_an_interrupt_ends_between_blocks(engine: str, tmp_path: Path) -> None:
    def interrupt(progress: Progress) -> None:
        if progress.rows > 20 and progress.doing == "running":
            os.kill(os.getpid(), signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    with cluster_here() if engine == "dask" else contextlib.nullcontext() as scheduler:
        outcome = run(tmp_path, interrupt, engine=engine, scheduler=scheduler)
        assert outcome.stopped and outcome.summary is None and outcome.missing_blocks > 0
        done = read_rows(tmp_path).num_rows
        assert 20 < done < len(EXPECTED)
        assert signal.getsignal(signal.SIGINT) is handler
        assert run(tmp_path, resume=True, engine=engine, scheduler=scheduler).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)
    assert {k: t["encounters"] for k, t in read_timings(tmp_path).items()} == {1: ENCOUNTERS, 3: ENCOUNTERS}


@pytest.mark.usefixtures("made")
def test_a_second_interrupt_ends_at_once(tmp_path: Path) -> None:
    def insist(progress: Progress) -> None:
        if progress.rows > 20:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, insist)
    assert run(tmp_path, resume=True).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize("engine", ["local", "dask"])
def test_a_fault_in_a_block_comes_through(engine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*arguments: Any) -> pa.Table:
        if arguments[2:4] == (3, 20):
            raise ZeroDivisionError("there")
        return made_rows(*arguments)

    with cluster_here() if engine == "dask" else contextlib.nullcontext() as scheduler:
        with monkeypatch.context() as patch:
            patch.setattr(tiers, "run_block", fails)
            with pytest.raises(ZeroDivisionError, match="there"):
                run(tmp_path, engine=engine, scheduler=scheduler)
        assert 0 < read_rows(tmp_path).num_rows < len(EXPECTED)
        assert run(tmp_path, resume=True).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)


@pytest.mark.usefixtures("made")
def test_a_full_disk_ends_it_and_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.replace
    count = 0

    def full(source: Any, target: Any) -> None:
        nonlocal count
        count += 1
        if count > 5:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(InputError, match="No space left on device; what is done is kept") as caught:
            run(tmp_path)
    assert "\n" not in str(caught.value)
    assert len(list(tmp_path.glob("*.parquet"))) == 5
    assert not list(tmp_path.glob(".*"))
    assert run(tmp_path, resume=True).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)


@pytest.mark.usefixtures("made")
def test_a_sensitivity_study_uses_the_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from wideberth.evaluation.montecarlo import sensitivity

    seen = {}

    def study(experiment: Any, seed: int, encounters: int, run: Any, progress: Any) -> list[dict[str, Any]]:
        seen["table"] = run(experiment, seed, 3, 5, encounters, True)
        progress("NACp 8", 0.5)
        return [{"nacp": 8}]

    monkeypatch.setattr(sensitivity, "run_sensitivity", study)
    outcome = run(tmp_path, sensitivity=11)
    assert seen["table"].equals(made_rows(EXPERIMENT, EXPERIMENT.seed, 3, 5, 11, True))
    assert json.loads((tmp_path / "summary.json").read_text())["sensitivity"] == [{"nacp": 8}]
    assert outcome.summary is not None


@pytest.mark.usefixtures("made")
def test_dask_gives_the_same_rows(tmp_path: Path) -> None:
    with cluster_here() as scheduler:
        assert run(tmp_path, engine="dask", scheduler=scheduler).summary is not None
    assert same(read_rows(tmp_path), EXPECTED)
    assert {k: t["encounters"] for k, t in read_timings(tmp_path).items()} == {1: ENCOUNTERS, 3: ENCOUNTERS}


@pytest.mark.usefixtures("made")
def test_dask_workers_with_other_code_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from wideberth.evaluation.montecarlo import dask_engine

    main = threading.get_ident()
    monkeypatch.setattr(
        "wideberth.evaluation.montecarlo.manifest.code_hash",
        lambda: "here" if threading.get_ident() == main else "there",
    )
    monkeypatch.setattr(dask_engine, "_ready", {})
    with cluster_here() as scheduler, pytest.raises(InputError, match="has another wideberth"):
        run(tmp_path, engine="dask", scheduler=scheduler)


@contextlib.contextmanager
def cluster_here() -> Iterator[str]:
    """A scheduler and two workers in threads of this process, which have its made-up encounters too."""
    import distributed

    dask: Any = distributed
    with dask.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster.scheduler_address


# What follows flies real encounters in processes of its own.


@pytest.fixture(scope="module")
def flown() -> pa.Table:
    tiers.prepare(EXPERIMENT)
    return tiers.run_block(EXPERIMENT, EXPERIMENT.seed, 1, 0, REAL, True)


@contextlib.contextmanager
def dask_processes(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]], subprocess.Popen[bytes]]]:
    """A scheduler on loopback and two workers, as processes."""
    file = folder / "scheduler.json"
    processes = []

    def start(*arguments: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", *arguments, "--no-dashboard"], cwd=folder, stderr=subprocess.DEVNULL
        )
        processes.append(process)
        return process

    try:
        scheduler = start(
            "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)
        )
        until(lambda: file.exists() and file.read_text().endswith("}"))
        address = json.loads(file.read_text())["address"]
        workers = [
            start("distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
            for _ in range(2)
        ]
        yield address, workers, scheduler
    finally:
        for process in processes:
            process.kill()
            process.wait()


def until(true: Any) -> None:
    end = time.monotonic() + WAIT_S
    while not true():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.005)


def make_ready(address: str) -> None:
    """Let every worker load the kernels, so that none is still at it when the others have done all there is."""
    import distributed

    dask: Any = distributed
    with dask.Client(address, set_as_default=False) as client:
        client.run(tiers.prepare, EXPERIMENT)


def names_of_workers(folder: Path) -> set[str]:
    file = folder / "timings.jsonl"
    return {json.loads(line)["worker"] for line in file.read_text().splitlines()} if file.exists() else set()


def shards(folder: Path) -> int:
    return len(list(folder.glob("rows_*.parquet")))


def test_a_lost_dask_worker_costs_nothing(tmp_path: Path, flown: pa.Table) -> None:
    from wideberth.evaluation.montecarlo.engines import open_engine

    out = tmp_path / "out"
    with dask_processes(tmp_path) as (address, workers, _):
        with open_engine("dask", None, address, lambda text: None) as engine:
            until(lambda: engine.workers() == 2)
        make_ready(address)

        def kill_one(progress: Progress) -> None:
            # Both must have given rows: what the lost one gave before is to be kept.
            if len(names_of_workers(out)) == 2 and workers[0].poll() is None:
                workers[0].kill()
                workers[0].wait()

        outcome = run(out, kill_one, encounters=REAL, intruders=1, block_rows=2, engine="dask", scheduler=address)
        assert workers[0].returncode == -signal.SIGKILL and workers[1].poll() is None
    assert outcome.summary is not None
    assert same(read_rows(out), flown)
    assert len(names_of_workers(out)) == 2
    assert read_timings(out)[1]["encounters"] == REAL


def test_a_lost_dask_scheduler_is_one_line_and_it_goes_on(tmp_path: Path, flown: pa.Table) -> None:
    out = tmp_path / "out"
    with dask_processes(tmp_path) as (address, _, scheduler):

        def kill_it(progress: Progress) -> None:
            if progress.encounters > REAL / 3:
                scheduler.kill()

        with pytest.raises(InputError, match=r"has gone.*--resume") as caught:
            run(out, kill_it, encounters=REAL, intruders=1, block_rows=2, engine="dask", scheduler=address)
    assert "\n" not in str(caught.value)
    assert run(out, encounters=REAL, intruders=1, resume=True).summary is not None
    assert same(read_rows(out), flown)


def command(out: Path, *options: str) -> list[str]:
    arguments = ["montecarlo", str(ROOT / "experiments" / "adsb_collision.toml"), "--out", str(out)]
    return [sys.executable, "-m", "wideberth", *arguments, "--encounters", str(REAL), "--intruders", "1", *options]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_killed_run_goes_on(workers: str, tmp_path: Path, flown: pa.Table) -> None:
    out = tmp_path / "out"
    with subprocess.Popen(command(out, "--workers", workers), stderr=subprocess.DEVNULL) as process:
        until(lambda: shards(out) >= 3 or process.poll() is not None)
        process.kill()
    done = read_rows(out)
    assert 0 < len(done) < REAL
    finished = subprocess.run(
        command(out, "--workers", workers, "--resume"), capture_output=True, text=True, timeout=WAIT_S
    )
    assert finished.returncode == 0, finished.stderr
    assert same(read_rows(out), flown)
    assert not list(out.glob(".*"))
    summary = json.loads((out / "summary.json").read_text())
    assert [(s["intruders"], s["encounters"]) for s in summary["by_intruders"]] == [(1, REAL)]


@pytest.mark.parametrize("options", [[], ["--engine", "dask"]])
def test_an_interrupted_run_says_how_it_goes_on(options: list[str], tmp_path: Path, flown: pa.Table) -> None:
    out = tmp_path / "out of the way"
    with subprocess.Popen(
        command(out, "--workers", "2", *options), stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        until(lambda: shards(out) >= 3 or process.poll() is not None)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to dask's workers too
        _, said = process.communicate(timeout=WAIT_S)
    assert process.returncode == 130
    assert said.startswith("wideberth: interrupted; what is done is kept, go on with: wideberth montecarlo ")
    assert said.count("\n") == 1
    assert 0 < len(read_rows(out)) < REAL
    again = shlex.split(said.partition("go on with: ")[2])
    finished = subprocess.run([sys.executable, "-m", *again], capture_output=True, text=True, timeout=WAIT_S)
    assert finished.returncode == 0, finished.stderr
    assert same(read_rows(out), flown)
