"""The head-on of `scenarios/live_head_on.toml`, simulated: well clear is kept by one maneuver, and the mission goes on.

In real time with the links and processes of a flight: experiments/live_head_on.py.
"""

import os

import numpy as np
import pytest

from experiments.live_head_on import Case, tables_of, well_clear_ratio
from wideberth.config import build_scenario
from wideberth.run import run_scenario

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="takes minutes without the compiler")


@pytest.mark.parametrize("case", [Case("copter", 0.0, 1), Case("plane", 300.0, 1)], ids=lambda case: case.vehicle)
def test_well_clear_is_kept_by_one_maneuver_and_the_mission_is_finished(case):
    states = []
    summary = run_scenario(
        build_scenario(tables_of(case)), None, lambda _t, _planned, s: states.append((s.t, s.maneuver)), report=False
    )
    assert summary["nmac_count"] == 0 and summary["loss_of_well_clear_count"] == 0
    assert summary["reversals"] == 0 and summary["least_bad_maneuvers"] == 0
    assert summary["mission_completed"]
    avoided = np.array([maneuver is not None for _, maneuver in states])
    assert (np.diff(avoided.astype(int)) == 1).sum() == 1, "the mission is left once"
    assert summary["maneuvers"] == 1


def test_without_avoidance_well_clear_is_lost():
    tables = tables_of(Case("copter", 0.0, 1)) | {"avoid": False}
    summary = run_scenario(build_scenario(tables), None, report=False)
    assert summary["nmac_count"] == 1 and summary["loss_of_well_clear_count"] == 1


def test_the_ratio_is_one_at_the_edge_of_the_volume():
    ratio = well_clear_ratio(np.array([609.6, 0.0, 2000.0]), np.array([0.0, 76.2, 5.0]))
    assert ratio == pytest.approx([1.0, 1.0, 2000.0 / 609.6])
