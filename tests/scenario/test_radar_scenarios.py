"""The radar scenarios: with avoidance nobody comes too near, without it they do; and what a dead radar leads to."""

from pathlib import Path

import numba
import pytest

from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario, load_scenario
from wideberth.evaluation.replay_check import replay
from wideberth.recording import read_recording
from wideberth.run import run_scenario
from wideberth.types import AlertLevel

FOLDER = Path(__file__).resolve().parents[2] / "scenarios"
compiled = pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="takes minutes without the compiler")


def fly(name, *overrides):
    return run_scenario(load_scenario(FOLDER / f"{name}.toml", overrides), None)


@compiled
@pytest.mark.parametrize(("name", "violations"), [("ground_radar", 2), ("onboard_radar", 3)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_avoidance_keeps_everyone_out_of_the_collision_volume(name, violations, seed):
    summary = fly(name, f"seed={seed}")
    assert summary["violation_count"] == 0 and summary["nmac_count"] == 0 and summary["mission_completed"]
    assert summary["maneuvers"] >= 1 and summary["path_length_m"] < 1.7 * summary["mission_path_length_m"]
    if seed == 1:
        without = fly(name, "avoid=false")
        assert without["violation_count"] == violations and without["maneuvers"] == 0
        assert without["worst_alert"] == "warning"


@compiled
def test_a_run_is_recorded_reported_and_replayed_the_same(tmp_path):
    scenario = load_scenario(FOLDER / "onboard_radar.toml", ["duration_s=40"])
    summary = run_scenario(scenario, tmp_path)
    assert list(summary["sensors"]) == ["radar/1", "radar/2", "radar/3"]
    assert "radar/2" in (tmp_path / "report.html").read_text()
    recording = read_recording(tmp_path / "recording.mcap")
    again = build_scenario(recording.scenario)
    assert again == scenario
    result = replay(recording, build_pipeline(again, lambda: 0.0))
    assert result.identical and result.steps == summary["steps"]


@compiled
def test_a_radar_that_dies_leaves_the_sky_unknown_and_one_that_is_jammed_is_survived(tmp_path):
    settings = ["sensor.silent_from_s=10", "sensor.silent_until_s=20", "sensor.burst_at_s=25", "sensor.burst_plots=300"]
    scenario = load_scenario(FOLDER / "ground_radar.toml", [*settings, "duration_s=40"])
    summary = run_scenario(scenario, tmp_path, report=False)
    silent = 0
    for t, _, scans, snapshot in read_recording(tmp_path / "recording.mcap"):
        if 11.05 < t < 19.95:
            assert not scans and snapshot.sensors["radar"].state.startswith("silent for")
            assert snapshot.alert_state >= AlertLevel.UNKNOWN
            silent += 1
        # What is seen in a burst is not known to be all, until a second after.
        state = snapshot.sensors["radar"].state
        assert state.startswith("flooded: 3") if 24.95 < t < 26.95 else state == "ok" or 10.5 < t < 20.05
        assert snapshot.alert_state >= AlertLevel.UNKNOWN or state == "ok"
        assert all(
            not track.is_ownship or track.id not in {x.track_id for x in snapshot.threats} for track in snapshot.tracks
        )
    assert silent == 89 and summary["sensors"]["radar"]["state"] == "ok"


@compiled
def test_the_tracker_of_the_thesis_flies_too():
    scenario = load_scenario(FOLDER / "ground_radar.toml", ["duration_s=10", "tracker.kind=er_rransac"])
    assert run_scenario(scenario, None)["steps"] == 101


@compiled
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_radar_and_adsb_make_one_track_of_each_aircraft(seed):
    """Two of the three broadcast; each is told once, and the drone keeps clear of all."""
    summary = fly("radar_and_adsb", f"seed={seed}")
    assert summary["violation_count"] == 0 and summary["nmac_count"] == 0 and summary["mission_completed"]
    assert summary["maneuvers"] >= 1


@compiled
def test_radar_and_adsb_replay_the_same_and_callsigns_stand_on_radar_tracks(tmp_path):
    scenario = load_scenario(FOLDER / "radar_and_adsb.toml", ["duration_s=15"])
    run_scenario(scenario, tmp_path)
    recording = read_recording(tmp_path / "recording.mcap")
    assert replay(recording, build_pipeline(build_scenario(recording.scenario), lambda: 0.0)).identical
    *_, (_, _, _, snapshot) = recording
    last = [track for track in snapshot.tracks if not track.is_ownship]
    both = {track.label for track in last if {"radar", "adsb"} <= set(track.sources)}
    assert both == {"HEADON", "ABOVE"}
    assert "RIGHT" not in {track.label for track in last}
