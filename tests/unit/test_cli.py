"""The command line: exit statuses, one-line errors, and the small commands."""

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from tests.unit.test_config import MISSION, PARTS
from wideberth.cli import main
from wideberth.cli.errors import guarded
from wideberth.config import load_scenario
from wideberth.errors import InputError
from wideberth.toml_text import to_toml

ROOT = Path(__file__).resolve().parents[2]
runner = CliRunner()


def raises(error: BaseException) -> Callable[[], None]:
    def command() -> None:
        raise error

    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(guarded(command))
    return lambda: app()


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        (InputError("speed: missing"), 2, "wideberth: speed: missing\n"),
        (FileNotFoundError(2, "No such file or directory", "a.gz"), 2, "wideberth: a.gz: No such file or directory\n"),
        (PermissionError(13, "Permission denied", "a.gz"), 2, "wideberth: a.gz: Permission denied\n"),
        (KeyboardInterrupt(), 130, "wideberth: interrupted\n"),
    ],
)
def test_errors_are_one_line(
    error: BaseException, status: int, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["wideberth"])
    with pytest.raises(SystemExit) as caught:
        raises(error)()
    assert caught.value.code == status
    assert capsys.readouterr().err == message


@pytest.mark.parametrize("error", [ZeroDivisionError("division by zero\nmore"), OSError("odd"), MemoryError()])
def test_faults_of_ours_leave_their_traceback_in_a_file(
    error: Exception, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "argv", ["wideberth"])
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(SystemExit) as caught:
        raises(error)()
    assert caught.value.code == 1
    text = capsys.readouterr().err
    assert text.count("\n") == 1
    assert text.startswith(f"wideberth: this is a fault in wideberth ({type(error).__name__}")
    (file,) = tmp_path.iterdir()
    assert str(file) in text
    assert "Traceback" in file.read_text()


def test_a_reader_that_goes_away_is_no_traceback(tmp_path: Path) -> None:
    code = (
        "from wideberth.cli.errors import guarded\nimport typer\n"
        "def lines():\n    for i in range(100000): print(i)\n"
        "app = typer.Typer(pretty_exceptions_enable=False); app.command()(guarded(lines)); app()"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(timeout=60) == 141
    assert process.stderr.read() == ""
    process.stderr.close()


def wideberth(*arguments: object) -> Any:
    return runner.invoke(main.app, [str(a) for a in arguments], prog_name="wideberth")


def test_version() -> None:
    result = wideberth("--version")
    assert result.exit_code == 0
    assert result.output == f"wideberth {version('wideberth')}\n"


def test_every_command_has_help() -> None:
    commands = [p.stem for p in (ROOT / "src" / "wideberth" / "cli").glob("*.py")]
    commands = [c for c in commands if c not in {"__init__", "main", "errors"}]
    assert set(commands) <= {*main.COMMANDS, *main.GROUPS}
    for command in (c.replace("_", "-") for c in commands):
        result = wideberth(command, "--help")
        assert result.exit_code == 0, result.output
        assert "Usage: wideberth " + command in result.output


def test_unknown_command_and_option() -> None:
    assert wideberth("fly").exit_code == 2
    assert wideberth("config", "--nonsense").exit_code == 2


@pytest.fixture
def scenario_file(tmp_path: Path) -> Path:
    path = tmp_path / "scenario.toml"
    path.write_text(to_toml({**PARTS, "mission": MISSION}))
    return path


def test_config_prints_what_reads_back(scenario_file: Path, tmp_path: Path) -> None:
    result = wideberth("config", scenario_file, "--set", "seed=5", "--set", "wind.north_mps=4")
    assert result.exit_code == 0, result.output
    assert tomllib.loads(result.output)["seed"] == 5
    again = tmp_path / "again.toml"
    again.write_text(result.output)
    assert load_scenario(again) == load_scenario(scenario_file, ["seed=5", "wind.north_mps=4"])


def test_config_says_what_is_wrong(scenario_file: Path, tmp_path: Path) -> None:
    result = wideberth("config", scenario_file, "--set", "sed=5", "--set", "wind.x=4")
    assert result.exit_code == 2
    assert "sed: unknown key: did you mean seed?" in result.stderr
    assert "wind.x: unknown key" in result.stderr
    assert wideberth("config", tmp_path / "missing.toml").stderr.endswith("missing.toml: no such file\n")
    assert wideberth("config", tmp_path).exit_code == 2


SUMMARY = {
    "nmac_count": 1,
    "loss_of_well_clear_count": 2,
    "loss_of_well_clear_by_volume": {"sarp": 2, "nmac": 1},
    "min_horizontal_separation_m": 12.345,
    "mission_completed": True,
    "step_time_ms": {"mean": 0.5, "p95": 0.9, "max": 2.0},
}


def test_compare(tmp_path: Path) -> None:
    first, second = tmp_path / "no-avoidance", tmp_path / "avoidance"
    for folder, summary in ((first, SUMMARY), (second, {"nmac_count": 0})):
        folder.mkdir()
        (folder / "summary.json").write_text(json.dumps(summary))
    (first / "report.html").touch()
    result = wideberth("compare", first, second)
    assert result.exit_code == 0, result.output
    rows = {line.split("│")[1].strip(): line for line in result.output.splitlines() if line.count("│") >= 4}
    cells = {title: [c.strip() for c in line.split("│")[2:4]] for title, line in rows.items()}
    assert cells["near mid-air collisions"] == ["1", "0"]
    assert cells["losses of well clear"] == ["2", "-"]
    assert cells["lost: sarp"] == ["2", "-"]
    assert cells["least horizontal separation, m"] == ["12.35", "-"]
    assert cells["mission completed"] == ["yes", "-"]
    assert cells["step time mean / p95 / max, ms"] == ["0.50 / 0.90 / 2.00", "-"]
    assert f"report: {first / 'report.html'}" in result.output
    assert f"no report in {second}" in result.output


@pytest.mark.parametrize("content", [None, "{", "[1]", "[" * 100_000, b"\xff"])
def test_compare_without_a_summary(content: str | bytes | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "summary.json").write_bytes(content.encode() if isinstance(content, str) else content)
    result = wideberth("compare", tmp_path, tmp_path)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1


def test_warmup_without_the_compiler_has_nothing_to_do() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "wideberth", "warmup"],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert "nothing to compile" in done.stdout
