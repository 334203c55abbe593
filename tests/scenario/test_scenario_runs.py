"""One scenario many times: draws that can be flown again, rows that depend on nothing else, studies that go on."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app
from wideberth.config import build_scenario, read_toml
from wideberth.errors import InputError
from wideberth.evaluation.scenario_runs.study import ROWS, Study, fly, is_scenario, run_study
from wideberth.evaluation.scenario_runs.summary import summarise
from wideberth.evaluation.scenario_runs.variation import draw, drawn_tables
from wideberth.run import UNJUDGED, fly_unaware, run_scenario
from wideberth.simulation.config import VariationConfig

SCENARIO = Path("scenarios/adsb_crossing.toml")
VARY = [
    {"key": "traffic.intruders.0.course_deg", "distribution": "normal", "sigma": 3.0, "add": True},
    {"key": "wind.east_mps", "low": -5.0, "high": 5.0},
    {"key": "tracker.kind", "distribution": "choice", "values": ["adsb_kalman"]},
]


def tables(**changes):
    return {**read_toml(SCENARIO), "duration_s": 60.0, "montecarlo": {"runs": 3, "vary": VARY}, **changes}


def study(runs=3, both=True, **changes):
    return Study(tables(**changes), str(SCENARIO), str(SCENARIO.parent), 5, runs, both)


def untimed(rows):
    for row in rows:
        for way in ("with", "without"):
            row.get(way, {}).pop("step_time_ms", None)
    return rows


def test_draws_have_the_distributions_and_do_not_disturb_each_other():
    vary = tuple(VariationConfig(**v) for v in VARY)
    drawn = [draw(tables(), vary, 5, run) for run in range(2000)]
    course = np.array([d.values["traffic.intruders.0.course_deg"] for d in drawn])
    east = np.array([d.values["wind.east_mps"] for d in drawn])
    # Five standard deviations of mean and of standard deviation.
    assert abs(course.mean() - 180.0) < 5 * 3.0 / 2000**0.5
    assert abs(course.std() - 3.0) < 5 * 3.0 / 4000**0.5
    assert -5.0 <= east.min() < -4.9 and 4.9 < east.max() <= 5.0
    assert abs(east.mean()) < 5 * 10 / 12**0.5 / 2000**0.5
    assert len({d.seed for d in drawn}) == 2000
    alone = [draw(tables(), vary[:1], 5, run).values["traffic.intruders.0.course_deg"] for run in range(20)]
    np.testing.assert_array_equal(alone, course[:20])


def test_a_run_can_be_flown_again_by_its_overrides():
    row = fly(study(), 1)
    drawn = draw(tables(), build_scenario(tables()).montecarlo.vary, 5, 1)
    again = drawn_tables(tables(), drawn, avoid=True)
    assert row["overrides"] == drawn.overrides()
    assert again["traffic"]["intruders"][0]["course_deg"] == row["drawn"]["traffic.intruders.0.course_deg"]
    summary = run_scenario(build_scenario(again, folder=SCENARIO.parent), None)
    assert summary["path_length_m"] == row["with"]["path_length_m"]
    assert summary["seed"] == row["seed"]


def test_rows_depend_neither_on_workers_nor_on_interruptions(tmp_path):
    whole = run_study(study(), tmp_path / "a", 1, resume=False, progress=lambda *_: None)
    told = []
    run_study(study(2), tmp_path / "b", 2, resume=False, progress=lambda *args: told.append(args))
    assert told[-1] == (2, 2)
    # As a killed process leaves it.
    with (tmp_path / "b" / ROWS).open("ab") as file:
        file.write(b'{"run": 2, "se')
    more = run_study(study(), tmp_path / "b", 2, resume=True, progress=lambda *_: None)
    assert untimed(more) == untimed(whole)
    assert len((tmp_path / "b" / ROWS).read_text().splitlines()) == 3
    with pytest.raises(InputError, match="--resume"):
        run_study(study(), tmp_path / "b", 1, resume=False, progress=lambda *_: None)
    with pytest.raises(InputError, match="another study"):
        run_study(study(step_s=0.2), tmp_path / "b", 1, resume=True, progress=lambda *_: None)


def made_row(run, violated_without, violated_with):
    one = {
        "violation_count": 0,
        "nmac_count": 0,
        "loss_of_well_clear_count": 0,
        "mission_completed": True,
        "reversals": 0,
        "maneuvers": 2,
        "least_bad_maneuvers": 0,
        "unknown_alert_steps": 0,
        "path_length_m": 1100.0,
        "mission_path_length_m": 1000.0,
        "separation_ratio": 3.0,
        "step_time_ms": {"mean": 0.1, "max": 2.0},
    }
    return {
        "run": run,
        "seed": 7,
        "overrides": ["a.b=1.5"],
        "without": {**one, "violation_count": violated_without},
        "with": {**one, "violation_count": violated_with},
    }


@pytest.mark.parametrize("name", ["adsb_crossing", "gbr_random", "onboard_radars"])
def test_a_twin_without_sensors_flies_and_is_judged_alike(name):
    path = SCENARIO.with_stem(name)
    scenario = build_scenario({**read_toml(path), "duration_s": 20.0, "avoid": False}, folder=path.parent)
    aware, unaware = run_scenario(scenario, None), fly_unaware(scenario)
    assert unaware["steps"] is unaware["alerts"] is None
    of_the_pipeline = {*UNJUDGED, "step_time_ms", "sensors", "rejections", "tracker", "per_intruder"}
    for key in aware.keys() - of_the_pipeline:
        assert aware[key] == unaware[key], key
    for one, other in zip(aware["per_intruder"], unaware["per_intruder"], strict=True):
        assert {**one, "alerts": None, "callsign": None} == other


def test_only_a_flight_without_avoidance_needs_no_sensors():
    with pytest.raises(InputError, match="set avoid = false"):
        fly_unaware(build_scenario(tables()))
    with pytest.raises(InputError, match="mission: missing"):
        fly_unaware(build_scenario({**{k: v for k, v in tables().items() if k != "mission"}, "avoid": False}))


def test_events_are_counted_by_run_with_intervals():
    rows = [made_row(k, 2 if k < 40 else 0, 1 if k in (3, 90) else 0) for k in range(100)]
    summary = summarise(study(100), rows)
    violations = summary["events"]["violation"]
    assert violations["without"]["runs"] == 40
    assert violations["with"]["runs"] == 2
    assert violations["risk_ratio"] == 2 / 40
    low, high = violations["risk_ratio_interval"]
    assert 0.005 < low < 0.05 < high < 0.25
    assert [bad["run"] for bad in summary["bad_runs"]] == [3, 90]
    assert [bad["violated_without_avoidance"] for bad in summary["bad_runs"]] == [True, False]
    assert "--set a.b=1.5" in summary["bad_runs"][0]["command"]
    assert summary["with"]["path_ratio"] == {"mean": pytest.approx(1.1), "max": pytest.approx(1.1)}


def toml(path, text):
    path.write_text(SCENARIO.read_text().replace("seed = 1", "seed = 1\nduration_s = 30.0") + text)
    return path


def test_the_command(tmp_path):
    text = '[montecarlo]\nruns = 2\n[[montecarlo.vary]]\nkey = "wind.east_mps"\nlow = -1.0\nhigh = 1.0\n'
    path = toml(tmp_path / "s.toml", text)
    result = CliRunner().invoke(app, ["montecarlo", str(path), "--out", str(tmp_path / "out"), "--workers", "1"])
    assert result.exit_code == 0, result.output
    assert "violations of the collision volume" in result.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["runs"] == 2
    page = (tmp_path / "out" / "report.html").read_text()
    assert "2 runs" in page
    assert shlex.split(f"x {path}")  # the path stands in the page's commands as one word
    wrong = CliRunner().invoke(app, ["montecarlo", str(path), "--out", str(tmp_path / "o"), "--shard", "1/2"])
    assert wrong.exit_code == 2
    assert "experiments" in wrong.output


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ({"key": "a", "low": 1.0}, "low and high"),
        ({"key": "a", "distribution": "normal"}, "sigma"),
        ({"key": "a", "distribution": "choice"}, "values"),
        ({"key": "a", "low": 2.0, "high": 1.0}, "low not above high"),
    ],
)
def test_distributions_that_are_not_complete(vary, words):
    with pytest.raises(InputError, match=words):
        build_scenario(tables(montecarlo={"vary": [vary]}))


def test_what_cannot_be_drawn():
    vary = (VariationConfig(key="name", low=0.0, high=1.0, add=True),)
    with pytest.raises(InputError, match="no number"):
        draw(tables(), vary, 1, 0)
    missing = (VariationConfig(key="traffic.intruders.9.course_deg", low=0.0, high=1.0, add=True),)
    with pytest.raises(InputError, match="no value there"):
        draw(tables(), missing, 1, 0)
    beyond = [{"key": "traffic.intruders.0.course_deg", "low": 1e4, "high": 2e4}]
    with pytest.raises(InputError, match="run 0"):
        fly(study(montecarlo={"vary": beyond}), 0)
    twice = [{"key": "wind.east_mps", "low": 0.0, "high": 1.0}] * 2
    with pytest.raises(InputError, match="twice"):
        build_scenario(tables(montecarlo={"vary": twice}))
    with pytest.raises(InputError, match="runs"):
        study(0)


def test_scenarios_and_experiments_are_told_apart():
    assert is_scenario(SCENARIO)
    assert not is_scenario(Path("experiments/adsb_collision.toml"))
