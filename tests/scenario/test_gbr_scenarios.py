"""The ground-based radar scenarios of thesis 4.5 in closed loop: radar, tracks, paths, A* and chain."""

from pathlib import Path

import numpy as np
import pytest

from wideberth.assembly import build_pipeline
from wideberth.config import build_scenario, read_toml
from wideberth.evaluation.replay_check import replay
from wideberth.recording import read_recording
from wideberth.run import run_scenario

SCENARIOS = Path("scenarios")


def fly(name, seed, out=None, avoid=True, **changes):
    tables = {**read_toml(SCENARIOS / f"{name}.toml"), "seed": seed, "avoid": avoid, **changes}
    scenario = build_scenario(tables, source=name, folder=SCENARIOS)
    return scenario, run_scenario(scenario, out, report=False)


@pytest.mark.parametrize("name", ["gbr_1", "gbr_2", "gbr_random"])
def test_nobody_comes_within_the_volume(name):
    for seed in (1, 2):
        _, alone = fly(name, seed, avoid=False)
        _, avoided = fly(name, seed)
        assert alone["violation_count"] > 0
        assert avoided["violation_count"] == 0
        assert avoided["mission_completed"]
        if name != "gbr_random":
            assert avoided["reversals"] == 0
        assert avoided["path_length_m"] < 1.5 * avoided["mission_path_length_m"]


def test_the_starts_of_the_second_give_the_distances_of_the_thesis():
    scenario, _ = fly("gbr_2", 1, avoid=False, duration_s=0.1)
    own, speed = np.array([-300.0, 0.0]), np.array([13.0, 0.0])
    misses = []
    for intruder in scenario.traffic.intruders:
        apart = np.array([intruder.position.north_m, intruder.position.east_m]) - own
        relative = intruder.velocity()[:2] - speed
        misses.append(abs(apart[0] * relative[1] - apart[1] * relative[0]) / np.hypot(*relative))
    np.testing.assert_allclose(misses, [79.9, 240.3, 0.0, 40.0], atol=0.1)


def test_decisions_are_replayed_and_nobody_avoids_himself(tmp_path):
    scenario, _ = fly("gbr_1", 3, tmp_path)
    recorded = read_recording(tmp_path / "recording.mcap")
    result = replay(recorded, build_pipeline(scenario, lambda: 0.0), lambda count: None)
    assert result.identical, result
    own = set()
    for step in recorded.steps():
        own |= {track.id for track in step.snapshot.tracks if track.is_ownship}
        assert not own & {threat.track_id for threat in step.snapshot.threats}
    assert own
