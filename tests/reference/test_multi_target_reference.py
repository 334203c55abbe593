"""The default tracker on the tracking benchmark's files: the demands of each set, on all its seeds."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wideberth.evaluation.tracking_metrics import RunScore, score_run, summarise
from wideberth.sensors.radar.plot_file import read_plot_file
from wideberth.tracking.multi_target.tracker import MultiTargetTracker

FOLDER = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "tracking"
pytestmark = [
    pytest.mark.skipif(not FOLDER.is_dir(), reason=f"the tracking benchmark is not at {FOLDER}"),
    pytest.mark.skipif(
        os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of scans: minutes without the compiler"
    ),
]


def scores(name: str) -> tuple[dict[str, Any], list[RunScore]]:
    file = read_plot_file(FOLDER / f"{name}.npz")
    assert file.truth is not None
    tracker, runs = MultiTargetTracker(MultiTargetTracker.Config()), []
    for seed in file.seeds():
        runs.append(score_run(tracker.run(file.scans(seed)), file.truth, file.t))
    return summarise(runs), runs


@pytest.mark.parametrize(("name", "ospa"), [("bench_3", 0.75), ("bench_5", 1.10), ("bench_5_c20", 1.10)])
def test_straight_sets(name: str, ospa: float) -> None:
    s, _ = scores(name)
    assert s["ospa_m"] <= ospa and s["first_confirmed_s"] <= 0.55
    assert s["false_tracks"] == 0 and s["identity_switches"] == 0 and s["track_purity"] >= 0.995
    assert 0.7 <= s["nees_per_dof"] <= 1.3 and 0.90 <= s["coverage_95_position"] <= 0.99


def test_maneuvering_set() -> None:
    s, _ = scores("bench_man")
    assert s["rmse_position_m"] <= 3.0 and s["rmse_velocity_mps"] <= 1.5
    assert s["false_tracks"] == 0 and s["identity_switches"] == 0
    assert 0.5 <= s["nees_per_dof"] <= 2.0 and 0.90 <= s["coverage_95_position"] <= 0.99


def test_onboard_set() -> None:
    s, runs = scores("bench_onboard")
    assert all(np.max(run.first_confirmed - run.first_visible) <= 1.0 for run in runs)
    assert s["never_confirmed"] == 0 and s["false_tracks"] == 0
    # The same tracker given each aircraft's own plots alone: 2.73 m.
    assert s["rmse_position_m"] <= 1.1 * 2.73
