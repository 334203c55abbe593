"""`wideberth range`: the thesis's nominal case, and refusals in one line."""

import json

import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app


def run(*arguments):
    return CliRunner().invoke(app, ["range", *arguments], env={"COLUMNS": "120"})


def test_the_nominal_case_is_table_2_3():
    result = run("--ownship-speed", "25kt")
    assert result.exit_code == 0
    for number in ("5,208.5", "4,942.2", "3,643.6", "2,875.1", "500.0", "456.2", "242.7", "116.4"):
        assert number in result.output


def test_json_is_in_si():
    rows = json.loads(run("--json").output)
    assert [row["method"] for row in rows] == ["tgvv", "gvv", "tt", "gt"]
    assert rows[0]["distance_m"] == pytest.approx(1587.5648, abs=1e-4)
    assert rows[0]["case"] == "A"
    assert rows[2]["case"] is None


@pytest.mark.parametrize(
    ("option", "text", "says"),
    [
        ("--ownship-speed", "0kt", "ownship_speed"),
        ("--ownship-speed", "25", "--ownship-speed"),
        ("--max-bank", "90deg", "max_bank"),
        ("--turn-angle", "0deg", "turn_angle"),
        ("--safety-radius=-1m", None, "safety_radius"),
        ("--computation-time", "5m", "--computation-time"),
    ],
)
def test_bad_values_are_named(option, text, says):
    result = run(*([option] if text is None else [option, text]))
    assert result.exit_code == 2
    assert says in result.output
    assert len(result.output.strip().splitlines()) == 1
