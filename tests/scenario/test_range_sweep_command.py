"""`wideberth range --sweep`: each figure from one command, and refusals in one line."""

import csv

import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app
from wideberth.units import FOOT, KNOT


def run(*arguments):
    return CliRunner().invoke(app, ["range", *map(str, arguments)], env={"COLUMNS": "120"})


def numbers(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_all_figures_from_one_command(tmp_path):
    result = run("--sweep", "all", "--out", tmp_path, "--ownship-speed", "25kt", "--safety-radius", "400ft")
    assert result.exit_code == 0, result.output
    pages = {path.name for path in tmp_path.glob("*.html")}
    assert pages == {*(f"figure_2_{k}.html" for k in range(7, 13)), "pilot_delay.html"}
    for end in ("csv", "json", "png"):
        assert len(list(tmp_path.glob(f"*.{end}"))) == 7
    for name in pages:
        assert str(tmp_path / name) in result.output
    assert "No answer at 0 kt (all curves): ownship_speed must be positive" in result.output
    # What is given is used where it is not swept.
    for figure, column, value in (
        ("figure_2_8", "ownship_speed_mps", 25 * KNOT),
        ("figure_2_12", "safety_radius_m", 400 * FOOT),
    ):
        assert {row[column] for row in numbers(tmp_path / f"{figure}.csv")} == {f"{value:.10g}"}


def test_one_figure_over_an_interval(tmp_path):
    result = run(
        "--sweep", "2.7", "--out", tmp_path, "--from", "10kt", "--to", "60kt", "--points", 11, "--turn-angle", "60deg"
    )
    assert result.exit_code == 0, result.output
    assert result.output == f"2.7: {tmp_path / 'figure_2_7.html'}\n"
    rows = [r for r in numbers(tmp_path / "figure_2_7.csv") if r["panel"] == "b"]
    speeds = sorted({round(float(r["ownship_speed_mps"]) / KNOT, 6) for r in rows})
    assert speeds == [10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60]


def test_the_thesis_itself(tmp_path):
    result = run("--sweep", "2.8", "--out", tmp_path)
    assert result.output == f"2.8: {tmp_path / 'figure_2_8.html'}, 6 of 6 statements of the thesis hold\n"
    assert "5,208.5" in (tmp_path / "figure_2_8.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--sweep", "2.13", "--out", "x"], "--sweep 2.13: there is no such figure; give 2.7, 2.8,"),
        (["--sweep", "2.7"], "--sweep needs --out"),
        (["--out", "x"], "--out belongs to --sweep"),
        (["--from", "1kt"], "--from belongs to --sweep"),
        (["--points", "10"], "--points belongs to --sweep"),
        (["--sweep", "2.7", "--out", "x", "--json"], "--json"),
        (["--sweep", "2.7", "--out", "x", "--ownship-speed", "10kt"], "--ownship-speed: figure 2.7 sweeps it"),
        (["--sweep", "all", "--out", "x", "--from", "1kt"], "--from and --to: give one figure"),
        (["--sweep", "2.7", "--out", "x", "--from", "10s"], "--from: '10s' is not a speed"),
        (["--sweep", "2.8", "--out", "x", "--to", "10kt"], "--to: '10kt' is not a time"),
        (["--sweep", "2.7", "--out", "x", "--from", "60kt", "--to", "10kt"], "--from 60kt: must be below --to 10kt"),
        (
            ["--sweep", "2.7", "--out", "x", "--from=-9kt", "--to=0kt"],
            "no method has an answer anywhere: ownship_speed",
        ),
        (["--sweep", "2.7", "--out", "x", "--max-bank", "95deg"], "max_bank must be"),
    ],
)
def test_refusals_are_one_line_and_write_nothing(arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert says in result.output
    assert len(result.output.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_sweep_is_named_in_the_help_as_it_is_in_the_package():
    from wideberth.analysis.thesis_figures import FIGURES
    from wideberth.cli.range import SWEEPS

    assert SWEEPS.split(", ") == list(FIGURES)
