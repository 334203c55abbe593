"""`wideberth montecarlo` from the command line: what it writes and says, and what it refuses in one line."""

import errno
import json
import os
import socket
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.scenario.test_montecarlo_engines import made_cycle_times
from tests.unit.test_montecarlo_folder import made_rows, same
from wideberth.cli.main import app
from wideberth.evaluation.montecarlo import tiers
from wideberth.evaluation.montecarlo.folder import read_rows
from wideberth.evaluation.montecarlo.manifest import code_hash

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("--encounters", 13, "--workers", 1, "--no-report")


@pytest.fixture(autouse=True)
def _made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Encounters are made up, and the experiments are found by name."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(tiers, "run_block", made_rows)
    monkeypatch.setattr(tiers, "prepare", lambda experiment: None)
    monkeypatch.setattr(tiers, "cycle_times", made_cycle_times)


def montecarlo(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["montecarlo", *map(str, arguments)], prog_name="wideberth")


def files(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def refused(out: Path, *arguments: object, experiment: str = "adsb_collision") -> str:
    """The one line that a command is refused with; nothing that is there changes."""
    before = files(out.parent)
    result = montecarlo(experiment, "--out", out, *arguments)
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("wideberth: ") and result.stderr.count("\n") == 1, result.stderr
    assert result.stdout == ""
    assert files(out.parent) == before
    return str(result.stderr)


def test_what_it_writes_and_says(tmp_path: Path) -> None:
    out = tmp_path / "made" / "by it"
    result = montecarlo("adsb_collision", "--out", out, "--encounters", 13)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    rows = read_rows(out)
    assert rows.num_rows == 13 * 15
    manifest = json.loads((out / "montecarlo.json").read_text())
    assert manifest["seed"] == 1 and manifest["avoidance"] is True and manifest["encounters"] == 13
    assert manifest["intruders"] == [1, 2, 3, 4, 5] and manifest["version"] == version("wideberth")
    assert manifest["code"] == code_hash()
    summary = json.loads((out / "summary.json").read_text())
    assert [(s["intruders"], s["encounters"]) for s in summary["by_intruders"]] == [(k, 13) for k in range(1, 6)]
    assert [(s["intruders"], s["encounters"]) for s in summary["block_times"]] == [(k, 13) for k in range(1, 6)]
    assert summary["settings"]["experiment_path"] == "experiments/adsb_collision.toml"
    assert "sensitivity" not in summary or not summary["sensitivity"]
    assert (out / "report.html").stat().st_size > 1000
    for words in ("with avoidance", "encounters", "true events", "P_cd", "P_fa", "violations", "NMAC risk ratio"):
        assert words in result.stdout
    assert "2.00" in result.stdout  # ms, the mean of the made-up decision cycles
    assert f"summary: {out / 'summary.json'}\nreport:  {out / 'report.html'}\n" in result.stdout


def test_options_reach_the_encounters(tmp_path: Path) -> None:
    experiment = ROOT / "experiments" / "adsb_collision.toml"
    options = ("--intruders", 2, "--seed", 9, "--no-avoidance", "--set", "errors.start=zero")
    result = montecarlo(experiment, "--out", tmp_path, *SMALL, *options)
    assert result.exit_code == 0, result.output
    assert "without avoidance" in result.stdout and "report:" not in result.stdout
    assert same(read_rows(tmp_path), made_rows(None, 9, 2, 0, 13, False))
    manifest = json.loads((tmp_path / "montecarlo.json").read_text())
    assert manifest["seed"] == 9 and manifest["experiment"]["errors"]["start"] == "zero"
    assert json.loads((tmp_path / "summary.json").read_text())["settings"]["overrides"] == ["errors.start=zero"]


def test_parts_say_what_is_missing_and_how_to_complete(tmp_path: Path) -> None:
    result = montecarlo("adsb_collision", "--out", tmp_path, *SMALL, "--shard", "2/3", "--seed", 4)
    assert result.exit_code == 0, result.output
    assert "still missing" in result.stdout and "encounters in" in result.stdout
    last = result.stdout.splitlines()[-1].strip()
    command = f"wideberth montecarlo adsb_collision --out {tmp_path} --encounters 13 --workers 1 --seed 4"
    assert last == f"{command} --no-report --resume"
    assert not (tmp_path / "summary.json").exists()
    result = montecarlo(*last.split()[2:])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "summary.json").exists()
    assert read_rows(tmp_path).num_rows == 13 * 15


def test_resume_in_a_new_folder_starts(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for out in (tmp_path / "empty", tmp_path / "new"):
        assert montecarlo("adsb_collision", "--out", out, *SMALL, "--resume").exit_code == 0
        assert (out / "summary.json").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--encounters", "0"], "--encounters 0: give at least 1"),
        (["--encounters", "-3"], "--encounters -3: give at least 1"),
        (["--intruders", "0"], "--intruders 0: give at least 1"),
        (["--intruders", "-1"], "--intruders -1: give at least 1"),
        (["--intruders", "21"], "more than the 20 points"),
        (["--set", "encounter.points=3"], "intruders cannot start at 3 different points"),
        (["--workers", "0"], "--workers 0: give at least 1"),
        (["--workers", "-2"], "--workers -2"),
        (["--seed", "-1"], "--seed -1"),
        (["--sensitivity", "-1"], "--sensitivity -1"),
        (["--shard", "x"], "--shard x: write i/N"),
        (["--shard", "0/4"], "--shard 0/4: the first number goes from 1 to 4"),
        (["--shard", "5/4"], "--shard 5/4"),
        (["--engine", "spark"], "--engine spark: use local or dask"),
        (["--scheduler", "tcp://127.0.0.1:8786"], "--scheduler needs --engine dask"),
        (["--engine", "dask", "--scheduler", "nowhere"], "--scheduler nowhere: missing port number"),
        (["--engine", "dask", "--scheduler", "smoke://signals:1"], "unknown address scheme 'smoke'"),
        (["--set", "encounter.circle_m=5"], "encounter.circle_m"),
        (["--set", "nonsense"], "write table.key=value"),
    ],
)
def test_bad_options_are_refused(arguments: list[str], said: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert said in refused(out, *arguments)
    assert not out.exists()


def test_an_unreachable_scheduler_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from wideberth.evaluation.montecarlo import dask_engine

    monkeypatch.setattr(dask_engine, "CONNECT_S", 0.5)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"  # nobody listens
        assert f"--scheduler {address}: Timed out" in refused(
            tmp_path / "out", "--engine", "dask", "--scheduler", address
        )
    assert not (tmp_path / "out").exists()


def test_without_dask_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "wideberth.evaluation.montecarlo.dask_engine", raising=False)
    assert "pip install wideberth[cluster]" in refused(tmp_path / "out", "--engine", "dask")


def test_unknown_experiments_are_refused(tmp_path: Path) -> None:
    assert "(adsb_collision, adsb_self_separation)" in refused(tmp_path / "out", experiment="adsb_colision")
    assert "no such file" in refused(tmp_path / "out", experiment="experiments/adsb_colision.toml")
    file = tmp_path / "mine.toml"
    file.write_text("[encounter")
    assert "not valid TOML" in refused(tmp_path / "out", experiment=str(file))


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    for options in ([], ["--resume"], ["--shard", "1/2"]):
        assert f"{file} is a file" in refused(file, *SMALL, *options)


def test_folders_with_something_else_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("mine")
    for options in ([], ["--resume"], ["--shard", "1/2"]):
        assert "is not empty and holds no montecarlo.json" in refused(out, *SMALL, *options)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    assert montecarlo("adsb_collision", "--out", folder, *SMALL).exit_code == 0
    return folder


def test_a_run_is_not_begun_over_another(out: Path) -> None:
    assert "go on with it by --resume" in refused(out, *SMALL)
    assert "go on with it by --resume" in refused(out, "--encounters", 99)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--encounters", 14], "encounters 13 there, 14 here"),
        (["--seed", 2], "seed 1 there, 2 here"),
        (["--no-avoidance"], "avoidance true there, false here"),
        (["--intruders", 3], "intruders [1, 2, 3, 4, 5] there, [3] here"),
        (["--set", "scoring.tau_s=30.0"], "scoring.tau_s 35.0 there, 30.0 here"),
        (["--set", "encounter.redraw=heading"], 'encounter.redraw "speed_and_heading" there, "heading" here'),
    ],
)
def test_a_changed_run_does_not_go_on(out: Path, options: list[object], said: str) -> None:
    assert said in refused(out, *SMALL, "--resume", *options)
    assert said in refused(out, *SMALL, "--shard", "1/2", *options)


def test_other_code_does_not_go_on(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wideberth.evaluation.montecarlo.manifest.code_hash", lambda: "0123456789abcdef")
    text = refused(out, *SMALL, "--resume")
    assert "made by other code" in text and "start anew in another folder" in text


def test_a_changed_manifest_does_not_go_on(out: Path) -> None:
    (out / "montecarlo.json").write_text("{")
    assert f"{out / 'montecarlo.json'}: damaged" in refused(out, *SMALL, "--resume")


def test_damaged_shards_are_refused_by_name(out: Path) -> None:
    path = sorted(out.glob("rows_*.parquet"))[7]
    data = path.read_bytes()
    (out / "summary.json").unlink()
    for content in (b"", data[:-7], data[: len(data) // 2], data[:200] + b"\xff" * 50 + data[250:]):
        path.write_bytes(content)
        assert f"{path}: damaged" in refused(out, *SMALL, "--resume")


def test_shards_of_other_runs_are_refused_by_name(out: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    assert montecarlo("adsb_collision", "--out", other, *SMALL, "--seed", 2).exit_code == 0
    path = sorted(out.glob("rows_*.parquet"))[3]
    path.write_bytes((other / path.name).read_bytes())
    assert f"{path}: a shard of another run (its seed differ)" in refused(out, *SMALL, "--resume")
    path.unlink()
    assert montecarlo("adsb_collision", "--out", out, *SMALL, "--resume").exit_code == 0
    extra = out / "rows_09_000000000.parquet"
    extra.write_bytes((other / path.name).read_bytes())
    assert f"{extra}: not a shard of this run" in refused(out, *SMALL, "--resume")


def test_a_damaged_shard_of_another_part_is_not_counted(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert montecarlo("adsb_collision", "--out", out, *SMALL, "--shard", "1/2").exit_code == 0
    path = min(out.glob("rows_*.parquet"))
    path.write_bytes(path.read_bytes()[:-9])
    result = montecarlo("adsb_collision", "--out", out, *SMALL, "--shard", "2/2")
    assert result.exit_code == 2 and f"{path}: damaged" in result.stderr and result.stderr.count("\n") == 1
    assert not (out / "summary.json").exists()


def test_a_full_disk_is_one_line_and_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    synced = 0
    real = os.fsync

    def fsync(descriptor: int) -> None:
        nonlocal synced
        synced += 1
        if synced > 9:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(descriptor)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fsync)
        result = montecarlo("adsb_collision", "--out", out, *SMALL)
    assert result.exit_code == 2, result.output
    assert result.stderr.count("\n") == 1
    assert "cannot be written: No space left on device; what is done is kept: go on with --resume" in result.stderr
    assert not list(out.glob(".*"))
    assert len(list(out.glob("rows_*.parquet"))) > 0
    assert montecarlo("adsb_collision", "--out", out, *SMALL, "--resume").exit_code == 0
    assert read_rows(out).num_rows == 13 * 15


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    assert "cannot be written: Not a directory" in refused(tmp_path / "file" / "out", *SMALL)
