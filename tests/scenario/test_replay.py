"""Replaying a recording gives the same decisions, and a difference is found and named."""

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest
from typer.testing import CliRunner

from wideberth.assembly import build_pipeline
from wideberth.cli.main import app
from wideberth.config import build_scenario
from wideberth.evaluation.replay_check import first_difference, replay
from wideberth.recording import Recorder, read_recording
from wideberth.run import run_scenario
from wideberth.types import Ownship

# Without the compiler a plan takes a second.
DURATION = 3.0 if vars(numba.config)["DISABLE_JIT"] else 30.0
STEPS = round(DURATION / 0.1) + 1
NUDGED = 2 * STEPS // 5


def tables(duration=DURATION, **general):
    """A head-on meeting within the first half minute, and an aircraft that crosses."""
    return {
        "name": "head_on",
        "seed": 11,
        "duration_s": duration,
        "origin": {"lat_deg": 40.0, "lon_deg": -111.0},
        "mission": {
            "speed_mps": 40.0,
            "waypoints": [
                {"north_m": 0.0, "east_m": 0.0, "altitude_m": 1800.0},
                {"north_m": 9000.0, "east_m": 0.0, "altitude_m": 1800.0},
            ],
        },
        "traffic": {
            "kind": "simulated",
            "intruders": [
                {
                    "address": "a1b2c3",
                    "position": {"north_m": 4200.0, "east_m": 60.0, "altitude_m": 1810.0},
                    "course_deg": 180.0,
                    "speed_mps": 60.0,
                },
                {
                    "address": "a44e01",
                    "position": {"north_m": 2000.0, "east_m": 3000.0, "altitude_m": 1820.0},
                    "course_deg": 270.0,
                    "speed_mps": 50.0,
                },
            ],
        },
        **general,
    }


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    summary = run_scenario(build_scenario(tables()), out, report=False)
    assert summary["steps"] == STEPS and summary["maneuvers"] >= 1
    return out / "recording.mcap"


def command(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_a_replay_is_identical_to_the_last_bit(recorded):
    result = command("replay", recorded)
    assert result.exit_code == 0, result.output
    assert f"identical: {STEPS} steps" in result.output


def test_a_replay_writes_the_report_again(recorded, tmp_path):
    result = command("replay", recorded, "--out", tmp_path / "again")
    assert result.exit_code == 0, result.output
    assert {"report.html", "summary.json", "map.png"} <= {p.name for p in (tmp_path / "again").iterdir()}


def rewrite(recorded, path, change):
    recording = read_recording(recorded)
    with Recorder(path, recording.scenario, mission=recording.mission, frame=recording.frame) as recorder:
        for k, step in enumerate(recording.steps()):
            recorder.write(*change(k, step))


def test_a_decision_off_by_the_last_bit_is_found(recorded, tmp_path):
    def nudge(k, step):
        snapshot = step.snapshot
        if k == NUDGED:
            track = snapshot.tracks[1]
            position = track.position.copy()
            position[2] += 3e-13 * abs(position[2])
            tracks = (snapshot.tracks[0], dataclasses.replace(track, position=position), *snapshot.tracks[2:])
            snapshot = dataclasses.replace(snapshot, tracks=tracks)
        return snapshot, step.scans, step.truth

    rewrite(recorded, tmp_path / "nudged.mcap", nudge)
    result = command("replay", tmp_path / "nudged.mcap")
    assert result.exit_code == 1
    assert f"different at {NUDGED / 10:.3f} s (step {NUDGED + 1} of {STEPS}): tracks[1].position[2]" in result.output


def test_a_different_scenario_decides_differently(recorded):
    recording = read_recording(recorded)
    scenario = build_scenario({**recording.scenario, "avoid": False})
    result = replay(recording, build_pipeline(scenario, time.process_time))
    assert not result.identical and "maneuver" in result.field


def test_stage_times_do_not_matter(recorded, tmp_path):
    def slower(_, step):
        return dataclasses.replace(step.snapshot, stage_times={"tracking": 9.0}), step.scans, step.truth

    rewrite(recorded, tmp_path / "slower.mcap", slower)
    assert command("replay", tmp_path / "slower.mcap").exit_code == 0


def test_a_torn_recording_replays_as_far_as_it_goes(recorded, tmp_path):
    data = recorded.read_bytes()
    (tmp_path / "torn.mcap").write_bytes(data[: len(data) // 2])
    result = command("replay", tmp_path / "torn.mcap", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "the recording ends there" in result.output and "identical: " in result.output
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "scored again from an unfinished recording" in text


def test_kill_9_in_a_run_leaves_a_recording_that_replays(tmp_path):
    root = Path(__file__).resolve().parents[2]
    script = (
        "import os, signal, sys; from pathlib import Path\n"
        "from wideberth.config import build_scenario; from wideberth.run import run_scenario\n"
        "from tests.scenario.test_replay import DURATION, tables\n"
        "def progress(elapsed, planned, snapshot):\n"
        "    if elapsed >= 0.6 * DURATION - 0.05: os.kill(os.getpid(), signal.SIGKILL)\n"
        "run_scenario(build_scenario(tables()), Path(sys.argv[1]), progress)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, tmp_path / "run"], cwd=root, env=os.environ, check=False)
    assert done.returncode == -signal.SIGKILL
    recording = read_recording(tmp_path / "run" / "recording.mcap")
    assert not recording.complete and recording.t_end > 0.6 * DURATION - 1.0
    result = command("replay", tmp_path / "run" / "recording.mcap")
    assert result.exit_code == 0 and f"identical: {recording.step_count} steps" in result.output


@pytest.mark.parametrize("content", [None, b"", b"no recording at all"])
def test_what_cannot_be_replayed_is_one_line(tmp_path, content):
    path = tmp_path / "a.mcap"
    if content is not None:
        path.write_bytes(content)
    result = command("replay", path)
    assert result.exit_code == 2
    assert "Traceback" not in result.output and "a.mcap" in result.output


def test_a_recording_without_mission_or_steps_is_refused(recorded, tmp_path):
    recording = read_recording(recorded)
    with Recorder(tmp_path / "a.mcap", recording.scenario, mission=None, frame=recording.frame):
        pass
    assert "no mission" in command("replay", tmp_path / "a.mcap").output
    with Recorder(tmp_path / "b.mcap", recording.scenario, mission=recording.mission, frame=recording.frame):
        pass
    assert "no steps" in command("replay", tmp_path / "b.mcap").output


def test_first_difference_names_what_differs():
    a = Ownship(0.0, np.zeros(3), np.zeros(3))
    assert first_difference(a, a) == ("", "", "")
    assert first_difference(a, dataclasses.replace(a, t=1.0)) == ("t", "0.0", "1.0")
    # The sign of zero is a difference to the last bit.
    b = dataclasses.replace(a, velocity=np.array([0.0, -0.0, 0.0]))
    assert first_difference(a, b) == ("velocity[1]", "0.0", "-0.0")
    assert first_difference((1, 2), (1, 2, 3), "x") == ("x (how many)", "2", "3")
    assert first_difference({"a": 1}, {"b": 1}, "x")[0] == "x"
