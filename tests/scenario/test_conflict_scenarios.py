"""Each conflict scenario in closed loop: what it is made to show happens, and nobody comes too near if he need not."""

from pathlib import Path

import numba
import numpy as np
import pytest

from wideberth.config import apply_override, build_scenario, read_toml
from wideberth.recording import read_recording
from wideberth.run import run_scenario
from wideberth.types import AlertLevel

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
pytestmark = pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="takes minutes without the compiler")


def fly(name, *settings, seed=1, avoid=True, out=None):
    tables = read_toml(SCENARIOS / f"{name}.toml")
    for setting in settings:
        apply_override(tables, setting)
    tables["seed"], tables["avoid"] = seed, avoid
    return run_scenario(build_scenario(tables, source=name, folder=SCENARIOS), out, report=False)


def recorded(tmp_path, name, *settings, **how):
    """Fly with a recording; the summary and the steps."""
    summary = fly(name, *settings, out=tmp_path, **how)
    return summary, list(read_recording(tmp_path / "recording.mcap").steps())


def between(steps, start, end):
    return [step for step in steps if start - 0.01 < step.t < end - 0.01]


@pytest.mark.parametrize(
    ("name", "longest"),
    [
        ("climbing_from_below", 1.1),
        ("overtaking", 1.25),
        ("intruder_turns_late", 1.4),
        ("radar_dropout", 1.3),
        ("onboard_radars", 1.4),
        ("flight_test", 1.2),
    ],
)
def test_who_would_come_too_near_is_avoided(name, longest):
    assert fly(name, avoid=False)["violation_count"] > 0
    for seed in (1, 2):
        avoided = fly(name, seed=seed)
        assert avoided["violation_count"] == 0 and avoided["maneuvers"] >= 1
        assert avoided["mission_completed"]
        assert avoided["path_length_m"] < longest * avoided["mission_path_length_m"]


def test_an_aircraft_that_climbs_is_avoided_before_it_is_at_our_altitude(tmp_path):
    _, steps = recorded(tmp_path, "climbing_from_below", "duration_s=20")
    (first,) = {min(step.t for step in steps if step.snapshot.maneuver is not None)}
    (chosen,) = between(steps, first, first + 0.1)
    assert chosen.truth is not None
    below = chosen.truth.positions[0, 2] - chosen.snapshot.ownship.position[2]
    assert below > 30.5 + 10.0


def test_the_squeeze_leaves_a_least_bad_path_which_is_said_and_better_than_none(tmp_path):
    alone = fly("two_sided_squeeze", avoid=False)
    avoided, steps = recorded(tmp_path, "two_sided_squeeze")
    assert alone["violation_count"] == 4 and avoided["violation_count"] <= 1 and avoided["mission_completed"]
    closest = [summary["per_intruder"][0]["separation_ratio"] for summary in (alone, avoided)]
    assert closest[0] < 0.05 and closest[1] > 0.5
    flagged = [step for step in steps if step.snapshot.maneuver is not None and step.snapshot.maneuver.least_bad]
    assert flagged and avoided["least_bad_maneuvers"] >= 1
    assert all("least bad" in step.snapshot.maneuver.reason for step in flagged)
    altitudes = -np.array([step.snapshot.ownship.position[2] for step in steps])
    # A metre of overshoot where the climb ends.
    assert altitudes.min() > 179.0 and altitudes.max() < 221.0


def test_nobody_knows_of_a_late_turn_before_it_is_flown(tmp_path):
    _, steps = recorded(tmp_path, "intruder_turns_late", "duration_s=30")
    # Its first, poor velocities aside, it passes clear of the path until it turns.
    assert all(step.snapshot.maneuver is None for step in between(steps, 0.0, 16.0))
    assert all(step.snapshot.alert_state is AlertLevel.CLEAR for step in between(steps, 8.0, 16.0))
    (first,) = {min(step.t for step in steps if step.snapshot.maneuver is not None)}
    assert 16.0 < first < 24.0


def test_a_radar_dropout_in_a_conflict_is_unknown_and_the_maneuver_goes_on(tmp_path):
    summary, steps = recorded(tmp_path, "radar_dropout")
    (before,) = between(steps, 13.9, 14.0)
    assert before.snapshot.maneuver is not None
    intruders = {track.id for track in before.snapshot.tracks if not track.is_ownship}
    assert len(intruders) == 2
    for step in between(steps, 15.1, 20.0):
        assert not step.scans and step.snapshot.sensors["radar"].state.startswith("silent for")
        assert step.snapshot.alert_state >= AlertLevel.UNKNOWN
        # They are carried on, and avoided.
        assert intruders <= {track.id for track in step.snapshot.tracks}
        assert step.snapshot.maneuver is not None
    assert summary["violation_count"] == 0


def test_three_units_look_around_and_none_sees_the_ownship(tmp_path):
    _, steps = recorded(tmp_path, "onboard_radars", "duration_s=40")
    assert {scan.sensor for step in steps for scan in step.scans} == {"radar/1", "radar/2", "radar/3"}
    assert not any(track.is_ownship for step in steps for track in step.snapshot.tracks)
    # The units turn with the aircraft, and the tracks stay where the aircraft are.
    errors = []
    for step in between(steps, 10.0, 40.0):
        for place in step.truth.positions:
            errors.append(min(float(np.linalg.norm(track.position - place)) for track in step.snapshot.tracks))
    assert np.median(errors) < 10.0


@pytest.mark.parametrize("tracker", ['{kind="wideberth", known_altitude_m=4.5}', None])
def test_the_flight_test_with_a_radar_that_measures_no_elevation(tmp_path, tracker):
    table_5_3 = 'tracker={kind="rransac", preset="flight_test", known_altitude_m=4.5}'
    summary, steps = recorded(tmp_path, "flight_test", table_5_3 if tracker is None else f"tracker={tracker}")
    scans = [scan for step in steps for scan in step.scans]
    assert {scan.kind for scan in scans} == {"radar_cone"}
    assert all(np.isnan(scan.z[:, 2]).all() for scan in scans)
    assert summary["violation_count"] == 0 and summary["mission_completed"]
    # No maneuver leaves the altitude.
    for step in steps:
        assert abs(step.snapshot.ownship.position[2] + 4.5) < 0.5
    # Ranges have the scale that was set: the intruder ahead, by the plots that are nearest to it.
    shares = []
    for step in between(steps, 2.0, 12.0):
        for scan in step.scans:
            true = float(np.linalg.norm(step.truth.positions[0] - scan.sensor_position))
            near = scan.z[np.abs(scan.z[:, 0] / true - 1.0) < 0.05, 0] / true
            shares += list(near)
    assert 1.0 < np.median(shares) < 1.03
