import csv
import io
import json

import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app


def run(*arguments):
    result = CliRunner().invoke(app, ["tlos", *arguments], env={"COLUMNS": "120"})
    assert "Traceback" not in result.output
    return result


def cells(output, scenario):
    """The cells of each row of the table that holds a scenario."""
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in output.splitlines() if line.startswith("│")]
    return [row[2:] for row in rows if row[1] == scenario]


def test_the_figure():
    result = run()
    assert result.exit_code == 0
    assert cells(result.output, "head-on") == [
        ["31.0/32.3", "30.0/31.2", "31.7/33.0"],
        ["58.4/60.9", "54.9/57.2", "60.9/63.5"],
        ["119.3/124.3", "105.5/109.9", "130.1/135.5"],
        ["198.9/207.1", "163.2/170.0", "230.7/240.3"],
        ["274.6/286.0", "211.0/219.8", "339.2/353.3"],
        ["393.2/409.5", "274.6/286.0", "540.7/563.1"],
    ]
    assert cells(result.output, "overtaking")[-1] == ["2471.5/2574.3", "-", "1330.8/1386.2"]
    words = " ".join(result.output.split())
    for note in ("loss of separation (4000ft) / to collision (500m)", "rounded to whole m/s", "a misprint for 31.2"):
        assert note in words


def test_any_aircraft_range_and_volume():
    result = run(
        *("--ownship", "Mine [1]:36km/h", "--intruder", "Theirs:90m/s", "--intruder", "Slow:10 m/s"),
        *("--range", "10km", "--separation", "1000m", "--collision", "500m"),
    )
    assert result.exit_code == 0
    assert "Mine [1]" in result.output
    assert cells(result.output, "head-on") == [["90.0/95.0"], ["450.0/475.0"]]
    assert cells(result.output, "overtaking") == [["112.5/118.8"], ["-"]]
    assert "misprint" not in result.output


def test_speeds_are_rounded_unless_they_are_to_be_exact():
    arguments = ("--ownship", "A:43kt:15m/s", "--intruder", "B:240kt", "--json")
    rounded, exact = (json.loads(run(*arguments, *more).output) for more in ((), ("--exact",)))
    assert [row["closing_speed_mps"] for row in rounded] == [145.0, 108.0]
    assert [row["closing_speed_mps"] for row in exact] == pytest.approx([283 * 1852 / 3600, 240 * 1852 / 3600 - 15])
    assert exact[0]["time_to_loss_of_separation_s"] == pytest.approx(17_300.8 / (283 * 1852 / 3600))


def test_collision_at_500_ft():
    row = json.loads(run("--ownship", "A:80kt", "--intruder", "B:1042kt", "--collision", "500ft", "--json").output)[0]
    assert row["time_to_collision_s"] == pytest.approx((18_520 - 152.4) / 577)


def test_csv_and_json_hold_the_same_rows():
    as_csv, as_json = run("--csv"), run("--json")
    assert as_csv.exit_code == as_json.exit_code == 0
    read = list(csv.DictReader(io.StringIO(as_csv.output)))
    rows = json.loads(as_json.output)
    assert len(read) == len(rows) == 36
    for line, row in zip(read, rows, strict=True):
        assert {key: "" if value is None else str(value) for key, value in row.items()} == line
    never = [row for row in rows if row["time_to_loss_of_separation_s"] is None]
    assert [(row["ownship"], row["intruder"], row["scenario"]) for row in never] == [
        ("ScanEagle", "RQ-11B Raven", "overtaking")
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--ownship", "Raven"], "--ownship 'Raven': give NAME:MAX or NAME:MAX:CRUISE"),
        (["--ownship", ":43kt"], "--ownship ':43kt': give NAME"),
        (["--ownship", "Raven:43"], "--ownship 'Raven:43': '43' is not a speed"),
        (["--ownship", "Raven:43ft"], "'43ft' is not a speed"),
        (["--ownship", "Raven:43kt:50kt"], "the cruise speed is above the maximum"),
        (["--ownship", "Raven:-43kt"], "the speed -43kt must be positive"),
        (["--intruder", "F-35:0kt"], "--intruder 'F-35:0kt': the speed 0kt must be positive"),
        (["--intruder", "F-35:1e999kt"], "must be positive"),
        (["--intruder", "F-35:1kt:1kt"], "give NAME:MAX, such as"),
        (["--range", "10"], "--range: '10' is not a length"),
        (["--range", "-10nmi"], "--range -10nmi: must be positive"),
        (["--separation", "35s"], "--separation: '35s' is not a length"),
        (["--collision", "0m"], "--collision 0m: must be positive"),
        (["--separation", "10nmi"], "--separation 10nmi must be below --range 10nmi"),
        (["--csv", "--json"], "give one of them"),
    ],
)
def test_bad_input_is_named_in_one_line(arguments, message):
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert len(result.output.strip().splitlines()) == 1
