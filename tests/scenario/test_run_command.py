"""`wideberth run` from the command line: what it writes, what it repeats, and what it says to bad input."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from typer.testing import CliRunner

from tests.scenario.test_replay import tables
from wideberth.cli.main import app, main
from wideberth.recording import read_recording
from wideberth.toml_text import to_toml

# Without the compiler a plan takes a second.
DURATION = 3.0 if vars(numba.config)["DISABLE_JIT"] else 25.0
KEYS = {
    *("intruders", "nmac_count", "loss_of_well_clear_count", "loss_of_well_clear_by_volume", "violation_count"),
    *("min_horizontal_separation_m", "min_vertical_separation_m", "alerts", "maneuvers", "reversals"),
    *("path_length_m", "mission_path_length_m", "mission_completed", "step_time_ms", "seed"),
}
T0 = 1633610000
LAT, LON = 48.8, 2.0
METRE = 1 / 111_200.0  # deg of latitude


def scenario_file(folder, **general):
    path = folder / "scenario.toml"
    path.write_text(to_toml(tables(DURATION, step_s=0.5, **general)))
    return path


def run(*arguments):
    return CliRunner().invoke(app, ["run", *map(str, arguments)])


def summary_of(out):
    return json.loads((out / "summary.json").read_text())


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    result = run(scenario_file(folder), "--out", folder / "out")
    assert result.exit_code == 0, result.output
    return folder / "out", result.output


def test_the_summary_has_the_promised_keys(first):
    summary = summary_of(first[0])
    assert summary.keys() >= KEYS
    assert summary["step_time_ms"].keys() == {"mean", "p95", "max"}
    assert set(summary["loss_of_well_clear_by_volume"]) == {
        *("sarp", "do365_phase1", "do365_buffered", "do365_noncooperative", "astm_f3442", "nmac")
    }
    assert summary["intruders"] == 2 and summary["seed"] == 11 and summary["maneuvers"] >= 1
    assert summary["mission_completed"] is False and any("not completed" in note for note in summary["notes"])


def test_everything_is_written_and_said(first):
    out, output = first
    names = {path.name for path in out.iterdir()}
    assert names >= {"summary.json", "recording.mcap", "report.html", "map.png", "altitude.png", "separation.png"}
    assert all(path.stat().st_size > 500 for path in out.iterdir())
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in out.glob("*.png"))
    recording = read_recording(out / "recording.mcap")
    assert recording.complete and recording.step_count == summary_of(out)["steps"] == round(DURATION / 0.5) + 1
    for words in ("near mid-air collisions", "time of a step", "summary:", "recording:", "report:"):
        assert words in output


def without_times(summary):
    return {key: value for key, value in summary.items() if key != "step_time_ms"}


def scans_of(out):
    return [scan.z.tolist() for step in read_recording(out / "recording.mcap").steps() for scan in step.scans]


def test_the_same_seed_gives_the_same_run_and_another_seed_other_measurements(first, tmp_path):
    path = scenario_file(tmp_path)
    for name, seed in (("same", 11), ("other", 12)):
        result = run(path, "--out", tmp_path / name, "--seed", seed, "--no-report")
        assert result.exit_code == 0, result.output
        assert not (tmp_path / name / "report.html").exists()
    same, other = summary_of(tmp_path / "same"), summary_of(tmp_path / "other")
    assert without_times(same) == without_times(summary_of(first[0]))
    assert other["seed"] == 12 and str(scans_of(tmp_path / "same")) == str(scans_of(first[0]))
    assert str(scans_of(tmp_path / "other")) != str(scans_of(first[0]))


def test_without_avoidance_the_mission_is_flown_as_it_is(tmp_path):
    result = run(scenario_file(tmp_path), "--out", tmp_path / "out", "--no-avoidance", "--no-report")
    assert result.exit_code == 0, result.output
    summary = summary_of(tmp_path / "out")
    assert summary["maneuvers"] == 0 and summary["avoidance"] is False
    assert summary["path_length_m"] == pytest.approx(40.0 * DURATION, rel=1e-3)


def test_single_keys_can_be_set(tmp_path):
    overrides = ["duration_s=2", "step_s=0.25", "avoidance.buffer=1.3", "traffic.intruders.0.speed_mps=5"]
    arguments = [part for override in overrides for part in ("--set", override)]
    result = run(scenario_file(tmp_path), "--out", tmp_path / "out", *arguments, "--no-report")
    assert result.exit_code == 0, result.output
    recording = read_recording(tmp_path / "out" / "recording.mcap")
    assert recording.step_count == 9 and recording.scenario["avoidance"]["buffer"] == 1.3
    assert recording.scenario["traffic"]["intruders"][0]["speed_mps"] == 5


def mission_file(path, *rows, start=T0):
    lines = ["lat_deg,lon_deg,altitude_m,speed_mps,start_time_s"]
    lines += [f"{lat},{lon},{altitude},40,{start}" for lat, lon, altitude in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def trajectories(path, seconds=60, first=T0 - 10):
    """One aircraft that flies south towards the mission's start, in the format of decoded trajectories."""
    rows = []
    for k in range(seconds):
        latitude = LAT + (6000.0 - 60.0 * (k - (T0 - first))) * METRE
        rows.append(
            {
                "timestamp": 1000 * (first + k),
                "icao24": "39ac45",
                "callsign": "TEST1",
                "latitude": latitude,
                "longitude": LON,
                "altitude": 2000.0,
                "groundspeed": 60 / 1852 * 3600,
                "track": 180.0,
                "vertical_rate": 0.0,
                "onground": False,
            }
        )
    path.write_text(json.dumps(rows))
    return path


def recorded_scenario(folder):
    path = folder / "recorded.toml"
    path.write_text('name = "recorded"\nseed = 4\nstep_s = 0.5\n[traffic]\nkind = "recorded"\n')
    return path


def towards(north):
    return (LAT, LON, 609.6), (LAT + north * METRE, LON, 609.6)


def test_recorded_traffic_and_a_mission_from_files(tmp_path):
    mission = mission_file(tmp_path / "m.csv", *towards(1200.0))
    traffic = trajectories(tmp_path / "traffic.json")
    result = run(
        recorded_scenario(tmp_path), "--out", tmp_path / "out", "--traffic", traffic, "--mission", mission,
        "--no-avoidance", "--no-report",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "pressure altitude" in result.output
    summary = summary_of(tmp_path / "out")
    assert summary.keys() >= KEYS and summary["intruders"] == 1 and summary["mission_completed"]
    assert summary["start_time_s"] == T0 and summary["closest_intruder"] == "39ac45"
    assert summary["mission_path_length_m"] == pytest.approx(1200.0, rel=2e-3)
    # Both fly towards each other at 100 m/s from 6000 m until the mission ends after about 30 s.
    expected = 6000 - 100 * summary["duration_s"]
    assert summary["min_horizontal_separation_m"] == pytest.approx(expected, abs=60)
    assert summary["min_vertical_separation_m"] == pytest.approx(0.0, abs=2.0)


def bad_inputs(folder):
    good = scenario_file(folder)
    recorded = recorded_scenario(folder)
    traffic = trajectories(folder / "traffic.json")
    mission = mission_file(folder / "good.csv", *towards(2000.0))
    (folder / "wrong.toml").write_text('name = "x"\nsede = 1\n')
    (folder / "broken.toml").write_text("name = [")
    (folder / "empty.csv").write_text("")
    (folder / "garbage.json").write_bytes(bytes(range(256)) * 40)
    (folder / "taken").write_text("a file")
    north_pole = mission_file(folder / "pole.csv", (91.0, LON, 600), (LAT, LON, 600))
    nan = mission_file(folder / "nan.csv", (math.nan, LON, 600), (LAT, LON, 600))
    late = mission_file(folder / "late.csv", *towards(2000.0), start=T0 + 90_000)
    with_traffic = ("--traffic", traffic)
    return {
        "no scenario": ((folder / "none.toml",), "none.toml"),
        "wrong key": ((folder / "wrong.toml",), "sede"),
        "no TOML": ((folder / "broken.toml",), "broken.toml"),
        "wrong set": ((good, "--set", "avoidance.bufer=1"), "bufer"),
        "wrong unit": ((good, "--set", "avoidance.hard_radius_ft=900"), "hard_radius"),
        "wrong value": ((good, "--set", "step_s=-1"), "step_s"),
        "set without value": ((good, "--set", "seed"), "seed"),
        "no traffic": ((recorded, "--mission", mission), "--traffic"),
        "no traffic file": ((recorded, "--mission", mission, "--traffic", folder / "none.json.gz"), "none.json.gz"),
        "garbage": ((recorded, "--mission", mission, "--traffic", folder / "garbage.json"), "garbage.json"),
        "no mission": ((recorded, *with_traffic), "mission"),
        "no mission file": ((recorded, *with_traffic, "--mission", folder / "none.csv"), "none.csv"),
        "empty mission": ((recorded, *with_traffic, "--mission", folder / "empty.csv"), "empty"),
        "latitude 91": ((recorded, *with_traffic, "--mission", north_pole), "lat_deg"),
        "latitude NaN": ((recorded, *with_traffic, "--mission", nan), "lat_deg"),
        "another day": ((recorded, *with_traffic, "--mission", late), "start_time_s"),
        "out is a file": ((good, "--out", folder / "taken"), "taken"),
    }


NAMES = [
    *("no scenario", "wrong key", "no TOML", "wrong set", "wrong unit", "wrong value", "set without value"),
    *("no traffic", "no traffic file", "garbage", "no mission", "no mission file", "empty mission"),
    *("latitude 91", "latitude NaN", "another day", "out is a file"),
]


@pytest.mark.parametrize("name", NAMES)
def test_bad_input_is_one_clear_line(name, tmp_path, monkeypatch, capfd):
    arguments, word = bad_inputs(tmp_path)[name]
    out = () if "--out" in arguments else ("--out", tmp_path / "out")
    monkeypatch.setattr(sys, "argv", ["wideberth", "run", *map(str, (*arguments, *out))])
    with pytest.raises(SystemExit) as caught:
        main()
    said = capfd.readouterr().err
    assert caught.value.code == 2, said
    lines = [line for line in said.splitlines() if line.startswith("wideberth: ")]
    assert len(lines) == 1 and word in said and "Traceback" not in said
    assert not (tmp_path / "out" / "summary.json").exists()


def test_the_installed_command_says_so_too(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "wideberth", "run", str(tmp_path / "none.toml"), "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).resolve().parents[2],
    )
    assert done.returncode == 2 and "none.toml" in done.stderr and "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
