"""Whole runs with the vertical controllers: radar, tracks, the maneuver, the recording."""

from pathlib import Path

import pytest

from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario, read_toml
from wideberth.errors import InputError
from wideberth.evaluation.replay_check import replay
from wideberth.recording import read_recording
from wideberth.run import run_scenario

SCENARIOS = Path("scenarios")


def scenario(name, seed=1, **avoidance):
    tables = read_toml(SCENARIOS / f"{name}.toml")
    # Of a scenario made for another planner only what both know is kept.
    known = {k: v for k, v in tables["avoidance"].items() if k.startswith("altitude_")}
    tables |= {"seed": seed, "avoidance": {**known, **avoidance}}
    return build_scenario(tables, source=name, folder=SCENARIOS)


@pytest.mark.parametrize("kind", ["cas_bang_bang", "cas_continuous"])
def test_a_run_keeps_clear_completes_the_mission_and_replays(kind, tmp_path):
    flown = scenario("vertical_avoidance", kind=kind)
    summary = run_scenario(flown, tmp_path, report=False)
    assert summary["violation_count"] == 0
    assert summary["mission_completed"]
    assert 1 <= summary["maneuvers"] <= 8 and summary["reversals"] == 0
    recorded = read_recording(tmp_path / "recording.mcap")
    result = replay(recorded, build_pipeline(flown, lambda: 0.0), lambda count: None)
    assert result.identical, result
    said = [event for step in recorded.steps() for event in step.snapshot.events if event.startswith("avoidance")]
    assert said[0].startswith("avoidance begins (current trajectory): intruder ") and "m/s" in said[0]
    assert any(event.startswith("avoidance ends after ") for event in said)


@pytest.mark.parametrize("kind", ["cas_bang_bang", "cas_continuous"])
@pytest.mark.parametrize("name", ["gbr_1", "overtaking"])
def test_the_scenarios_of_other_planners_are_flown_too(name, kind):
    summary = run_scenario(scenario(name, kind=kind), None)
    assert summary["violation_count"] == 0
    assert summary["mission_completed"] and summary["maneuvers"] <= 8


def test_without_avoidance_and_disabled_the_zone_is_entered():
    summary = run_scenario(scenario("vertical_avoidance", kind="cas_continuous", disable=True), None)
    assert summary["violation_count"] > 0 and summary["maneuvers"] == 0


def test_wrong_keys_are_refused_by_name():
    with pytest.raises(InputError, match=r"avoidance\.separation"):
        scenario("vertical_avoidance", kind="cas_continuous", separation=3.0)
    with pytest.raises(InputError, match=r"avoidance\.hysteresis_m"):
        scenario("vertical_avoidance", kind="cas_bang_bang", hysteresis_m=3.0)
