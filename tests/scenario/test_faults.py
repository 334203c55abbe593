"""Faults: the system keeps deciding, says what it no longer knows (never "clear"), and the recording shows it."""

from pathlib import Path

import numba
import numpy as np
import pytest

from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario, load_scenario
from wideberth.errors import InputError
from wideberth.evaluation.replay_check import replay
from wideberth.recording import read_recording
from wideberth.run import run_scenario
from wideberth.simulation.mission import read_mission_file
from wideberth.types import AlertLevel

RADAR = Path(__file__).resolve().parents[2] / "scenarios" / "ground_radar.toml"
compiled = pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="takes minutes without the compiler")
BLIND = "not all around is watched by a sensor"
SEES = "all around is watched again"


@pytest.fixture
def fly(tmp_path):
    """Return a function that flies the radar scenario with other settings: summary and steps, replayed the same."""

    def fly(*settings):
        scenario = load_scenario(RADAR, settings)
        summary = run_scenario(scenario, tmp_path, report=False)
        recording = read_recording(tmp_path / "recording.mcap")
        assert recording.complete and recording.step_count == summary["steps"]
        result = replay(recording, build_pipeline(build_scenario(recording.scenario), lambda: 0.0))
        assert result.identical and result.steps == summary["steps"]
        return summary, list(recording.steps())

    return fly


def told(steps):
    """Return when each event was recorded, s."""
    return {event: round(step.t, 3) for step in steps for event in step.snapshot.events}


def between(steps, start, end):
    return [step for step in steps if start - 0.01 < step.t < end - 0.01]


def intruder(number, north, east, altitude, course, speed):
    position = f"{{ north_m = {north}, east_m = {east}, altitude_m = {altitude} }}"
    return f'{{ address = "{number:06x}", position = {position}, course_deg = {course}, speed_mps = {speed} }}'


def traffic(*intruders):
    return f"traffic.intruders=[{', '.join(intruders)}]"


def own_error(step, truth):
    """Return how far the ownship is believed to be from where it was in a run without the fault, m."""
    return float(np.linalg.norm(step.snapshot.ownship.position - truth.snapshot.ownship.position))


@compiled
def test_a_radar_silent_for_5_s(fly):
    summary, steps = fly("sensor.silent_from_s=10", "sensor.silent_until_s=15", "duration_s=20")
    (before,) = between(steps, 9.9, 10.0)
    known = {track.id for track in before.snapshot.tracks}
    assert len(known) == 4
    for step in between(steps, 11.1, 16.0):
        assert step.snapshot.alert_state >= AlertLevel.UNKNOWN
    for step in between(steps, 11.1, 15.0):
        assert not step.scans and step.snapshot.sensors["radar"].state.startswith("silent for")
        # They coast, and are still avoided.
        assert {track.id for track in step.snapshot.tracks} == known
        assert {track.t_last_update for track in step.snapshot.tracks if not track.is_ownship} <= {9.8, 9.9}
        assert step.snapshot.maneuver is not None
    # Heard again, it is relied upon a second later.
    events = told(steps)
    assert events["sensor radar: ok"] == 15.0 and events[SEES] == 16.0
    assert {track.id for track in steps[-1].snapshot.tracks} == known
    assert all(track.t_last_update >= 19.0 for track in steps[-1].snapshot.tracks)
    assert steps[-1].snapshot.alert_state is AlertLevel.CLEAR and summary["nmac_count"] == 0


FAULT_FREE = ["duration_s=20", traffic(intruder(1, 530.0, 67.5, 200.0, 180.0, 17.0))]


@compiled
def test_a_jump_of_the_ownships_position_is_refused_and_said(fly):
    _, plain = fly(*FAULT_FREE)
    jump = ["navigation.jump_at_s=8", "navigation.jump_until_s=13", "navigation.jump_east_m=200"]
    summary, steps = fly(*FAULT_FREE, *jump)
    events = told(steps)
    assert events["ownship: position jumped by 200 m"] == 8.0 and events["ownship: ok"] == 13.0
    for step, truth in zip(between(steps, 8.0, 13.0), between(plain, 8.0, 13.0), strict=True):
        assert step.snapshot.alert_state >= AlertLevel.UNKNOWN
        assert step.snapshot.ownship.state == "position jumped by 200 m" and step.snapshot.ownship.t == step.t
        # The recording has both: what came in, and what was believed.
        assert step.ownship.position[1] - truth.ownship.position[1] > 150.0 and step.ownship.state == "ok"
        assert own_error(step, truth) < 45.0
        # Its own echo does not become an intruder.
        assert len(step.snapshot.threats) == len(truth.snapshot.threats) == 1
    assert all(step.snapshot.ownship.state == "ok" for step in steps if not 7.95 < step.t < 12.95)
    assert summary["nmac_count"] == summary["violation_count"] == 0


@compiled
def test_telemetry_lost_for_5_s(fly):
    _, plain = fly(*FAULT_FREE)
    summary, steps = fly(*FAULT_FREE, "navigation.lost_from_s=8", "navigation.lost_until_s=13")
    events = told(steps)
    assert events["ownship: no telemetry for 1 s"] == 8.5 and events["ownship: ok"] == 13.0
    spread = []
    for step, truth in zip(between(steps, 8.5, 13.0), between(plain, 8.5, 13.0), strict=True):
        believed = step.snapshot.ownship
        assert step.snapshot.alert_state >= AlertLevel.UNKNOWN and believed.state.startswith("no telemetry for")
        assert round(step.ownship.t, 3) == 7.9 and believed.t == step.t
        spread.append(believed.covariance[0, 0])
        assert own_error(step, truth) < 4.0 * np.sqrt(spread[-1]) and step.snapshot.threats
        assert len(step.snapshot.threats) == 1
    assert np.all(np.diff(spread) > 0.0)
    assert summary["nmac_count"] == summary["violation_count"] == 0


@compiled
def test_a_scan_with_500_false_plots(fly):
    """One scan is no track: nothing false is confirmed, and nobody evades it; another scan would be confirmation."""
    burst = ["sensor.burst_at_s=8", "sensor.burst_s=0.1", "sensor.burst_plots=500"]
    summary, steps = fly(traffic(), *burst, "duration_s=15")
    (jammed,) = [step for step in steps if sum(len(scan.z) for scan in step.scans) > 400]
    assert round(jammed.t, 3) == 8.0
    assert [event for event in told(steps) if "confirmed" in event] == ["track 1 confirmed"]
    assert summary["maneuvers"] == 0 and all(step.snapshot.maneuver is None for step in steps)
    after = between(steps, 8.0, 15.1)
    assert all([track.is_ownship for track in step.snapshot.tracks] == [True] for step in after)


@compiled
def test_500_false_plots_a_scan_for_a_second_are_survived_and_never_clear(fly):
    """Then there are false tracks; what they leave is unknown, not clear, and the tracks stay bounded."""
    burst = ["sensor.burst_at_s=8", "sensor.burst_s=1", "sensor.burst_plots=500"]
    _, steps = fly(traffic(), *burst, "duration_s=12")
    jammed = [step for step in steps if sum(len(scan.z) for scan in step.scans) > 400]
    assert len(jammed) == 10 and all(len(step.snapshot.tracks) < 100 for step in steps)
    assert all(step.snapshot.alert_state >= AlertLevel.UNKNOWN for step in between(steps, 8.0, 12.0))
    assert any(event.startswith("sensor radar: flooded: 5") for event in told(steps))


@compiled
def test_an_intruder_that_is_first_seen_inside_the_volume(fly):
    hidden = ["sensor.silent_from_s=0", "sensor.silent_until_s=12"]
    summary, steps = fly(traffic(intruder(1, -150.0, 0.0, 200.0, 180.0, 3.0)), *hidden, "duration_s=20")
    assert all(step.snapshot.alert_state is AlertLevel.UNKNOWN for step in between(steps, 0.0, 12.2))
    # Its first scan is at 12.0 s; the planner decides once a second.
    (seen,) = between(steps, 12.2, 12.3)
    assert seen.snapshot.alert_state is AlertLevel.WARNING
    assert all(step.snapshot.alert_state is AlertLevel.WARNING for step in between(steps, 12.2, 14.0))
    (first,) = {step.snapshot.maneuver.t for step in steps if step.snapshot.maneuver is not None}
    (chosen,) = between(steps, first, first + 0.1)
    assert first <= 13.0 and chosen.snapshot.maneuver.least_bad and len(chosen.snapshot.maneuver.threat_ids) == 1
    assert "every path is blocked, this is the least bad" in chosen.snapshot.maneuver.reason
    assert any("least bad" in event for event in chosen.snapshot.events)
    assert summary["nmac_count"] == 1 and summary["worst_alert"] == "warning" and summary["least_bad_maneuvers"] == 1


@compiled
@pytest.mark.parametrize("kind", ["local_level", "astar", "astar_chain"])
def test_a_wall_of_aircraft_without_a_feasible_path(fly, kind):
    places = [(150.0 * column, 60.0 * row) for column in range(-3, 4) for row in (-1, 0, 1)]
    # Twice as fast as the ownship: it can neither be flown round nor fled from.
    wall = [intruder(n + 1, 50.0, east, 200.0 + up, 180.0, 25.0) for n, (east, up) in enumerate(places)]
    settings = ['avoidance={kind="' + kind + '", altitude_min_m=180, altitude_max_m=220}']
    # To the conventional beamformer aircraft at one range are one plot, and the wall has gaps.
    settings.append('sensor.processing.beamformer="mvdr"')
    summary, steps = fly(traffic(*wall), *settings, "duration_s=12")
    flagged = [step for step in steps if step.snapshot.maneuver is not None and step.snapshot.maneuver.least_bad]
    assert flagged and summary["least_bad_maneuvers"] >= 1
    assert all(step.snapshot.maneuver.threat_ids for step in flagged)
    assert all("least bad" in step.snapshot.maneuver.reason for step in flagged)
    assert any("least bad" in event for event in told(steps))
    assert all(step.snapshot.alert_state >= AlertLevel.UNKNOWN for step in steps)


def mission(*points):
    listed = (f"{{ north_m = {north}, east_m = {east}, altitude_m = 200.0 }}" for north, east in points)
    return f"mission.waypoints=[{', '.join(listed)}]"


A, B, C = (-400.0, 0.0), (-200.0, 0.0), (-200.0, 200.0)


@compiled
def test_repeated_waypoints_are_passed_with_the_first(fly):
    plain, steps = fly(traffic(), mission(A, B, C))
    repeated, again = fly(traffic(), mission(A, A, B, B, B, C, C))
    assert plain["mission_completed"] and repeated["mission_completed"]
    assert repeated["path_length_m"] == plain["path_length_m"] and len(again) == len(steps)
    assert steps[-1].snapshot.mission_index == 3 and again[-1].snapshot.mission_index == 7


@pytest.mark.parametrize(
    ("points", "words"), [((), "at least 2"), ((A,), "at least 2"), ((A, A), "one place"), ((A, A, A), "one place")]
)
def test_a_mission_of_one_place_is_refused(points, words):
    with pytest.raises(InputError, match=words):
        load_scenario(RADAR, [mission(*points)])


ROW = "40.25,-111.65,{},13,0\n"


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("", "two different waypoints, this file has 0"),
        (ROW.format(200), "two different waypoints, this file has 1"),
        (ROW.format(200) * 3, "two different waypoints, this file has 1"),
        (ROW.format(200) + ROW.format(250), "one place"),
    ],
)
def test_a_mission_file_of_one_place_is_refused(tmp_path, rows, words):
    path = tmp_path / "mission.csv"
    path.write_text("lat_deg,lon_deg,altitude_m,speed_mps,start_time_s\n" + rows)
    with pytest.raises(InputError, match=words) as caught:
        read_mission_file(path)
    assert str(path) in str(caught.value)


def test_a_mission_file_with_repeated_rows_says_that_they_are_merged(tmp_path):
    path = tmp_path / "mission.csv"
    end = "40.26,-111.65,200,13,\n"
    path.write_text("lat_deg,lon_deg,altitude_m,speed_mps,start_time_s\n" + ROW.format(200) * 2 + end + end)
    made, messages = read_mission_file(path)
    assert len(made.waypoints) == 2
    assert messages == ("line 3: repeats the waypoint before, merged", "line 5: repeats the waypoint before, merged")
