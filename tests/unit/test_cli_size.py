"""`wideberth size`: what it prints and writes, and refusals in one line."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app

REPOSITORY = Path(__file__).resolve().parents[2]
FEW = ("--speed", "10m/s", "--speed", "Cessna:126kt")


def run(*arguments):
    return CliRunner().invoke(app, ["size", *arguments], env={"COLUMNS": "120"})


def test_the_default_says_that_the_radar_ends_early():
    result = run()
    assert result.exit_code == 0
    for text in ("Reach of radar_table_5_1", "turn 90°, bank 30°", "−60° to 60°", "What would protect from the others"):
        assert text in result.output
    assert "Protected head-on against intruders up to 16." in result.output
    assert "from all directions against none." in result.output


def test_json_and_report(tmp_path, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    result = run("radar_table_5_1", "small_fixed_wing", *FEW, "--rcs-m2", "0.1", "--json", "--out", str(tmp_path))
    assert result.exit_code == 0
    printed = json.loads(result.stdout)
    assert set(printed) == {"sensor", "aircraft", "rcs_m2", "reach", "escapes", "answer", "intruders"}
    assert set(printed["answer"]) == {"words", "head_on", "field_of_view", "all_directions"}
    assert [one["name"] for one in printed["intruders"]] == ["10m/s", "Cessna"]
    assert printed["intruders"][1]["speed_mps"] == pytest.approx(64.82)
    assert set(printed["intruders"][0]) == {
        *("name", "speed_mps", "protected_bearings_deg", "unprotected_bearings_deg", "no_threat_bearings_deg"),
        *("required_head_on_m", "available_head_on_m", "worst", "cure"),
    }
    assert printed["sensor"]["kind"] == "radar" and printed["rcs_m2"] == 0.1
    assert [row["rcs_m2"] for row in printed["reach"]["by_rcs"]] == [0.01, 0.1, 1.0, 10.0]
    assert printed["escapes"]["slow_down"][0]["required_head_on_m"] is None
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {"report.html", "size.json", "protection.png", "ranges.png", "snr.png"}
    written = json.loads((tmp_path / "size.json").read_text())
    by_bearing = written.pop("by_bearing")
    assert written == printed
    assert len(by_bearing["bearing_deg"]) == len(by_bearing["required_m"][1]) == len(by_bearing["available_m"][0])
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg role") == 3 and printed["answer"]["words"].split(";")[0] in page


def test_adsb(tmp_path, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    result = run("adsb_a1", "multirotor", *FEW, "--ownship-speed", "5m/s", "--out", str(tmp_path))
    assert result.exit_code == 0 and "A1 (this)" in result.output
    assert "Protected from all directions against every intruder" in result.output
    assert "What would protect" not in result.output
    assert {path.name for path in tmp_path.iterdir()} == {"report.html", "size.json", "protection.png", "ranges.png"}


def test_ground_radar(tmp_path, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    result = run("ground_radar.toml", *FEW, "--rcs-m2", "0.1", "--json", "--out", str(tmp_path))
    assert result.exit_code == 0
    printed = json.loads(result.stdout)
    slow, fast = printed["intruders"]
    assert slow["operation"]["radius_m"] < slow["surveillance"]["radius_m"] - slow["required_m"]
    assert fast["operation"] is None
    assert printed["answer"]["words"].startswith("Protected against intruders up to 10.0 m/s (19 kt) (of those asked")
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"report.html", "size.json", "volumes.png", "required.png", "snr.png"}
    assert "operation: radius" in (tmp_path / "report.html").read_text()
    assert "protected nowhere" in run("ground_radar", "--speed", "70kt").output.lower()


def test_list(tmp_path, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    lines = run("--list").output.splitlines()
    assert [line.split()[0] for line in lines] == sorted(path.stem for path in (REPOSITORY / "sizing").glob("*.toml"))
    monkeypatch.chdir(tmp_path)
    result = run("--list")
    assert result.exit_code == 2 and "there is no sizing folder" in result.output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.toml"], "none.toml: no such sensor or aircraft"),
        (["sizing/none.toml"], "no such file"),
        (["sizing"], "no such sensor or aircraft"),
        (["radar_table_5_1", "nobody"], "nobody: no such sensor or aircraft; give the path of a TOML file, or a name"),
        (["small_fixed_wing"], "kind: missing (known: radar, ground_radar, adsb)"),
        (["radar_table_5_1", "radar_table_5_1"], "unknown key"),
        (["--speed", "-5kt"], "--speed -5kt: must be positive"),
        (["--speed", "50"], "--speed: '50' is not a speed"),
        (["--speed", ":50kt"], "the name is missing"),
        (["--rcs-m2", "0"], "--rcs-m2 0: must be positive"),
        (["--rcs-m2", "nan"], "--rcs-m2 nan: must be positive"),
        (["--ownship-speed", "100kt"], "--ownship-speed 100kt: small fixed wing flies 10 to 20 m/s"),
        (["--out", "README.md"], "--out README.md is a file"),
    ],
)
def test_bad_input_is_named(arguments, says, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    result = run(*arguments)
    assert result.exit_code == 2
    assert says in result.output


def test_a_wrong_key_is_named(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('escapes = ["turn", "hide"]\nturn_fraction = [1.0]\n', encoding="utf-8")
    result = CliRunner().invoke(app, ["size", str(REPOSITORY / "sizing" / "adsb_a1.toml"), str(path)])
    assert result.exit_code == 2
    assert "turn_fraction: unknown key: did you mean turn_fractions?" in result.output
    assert "escapes" in result.output
