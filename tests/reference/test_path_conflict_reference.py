"""Conflicts along waypoints against the reference data: thesis algorithms 3 to 5, corrected."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wideberth.conflict.cylinder import path_conflict

CASES = Path(__file__).resolve().parents[2].parent / "shared" / "reference" / "data" / "collision_waypoints.jsonl"


@pytest.fixture(scope="module")
def cases() -> list[dict[str, Any]]:
    if not CASES.exists():
        pytest.skip(f"reference data absent: {CASES.name}")
    return [json.loads(line) for line in CASES.read_text().splitlines()]


def test_flags_and_times(cases: list[dict[str, Any]]) -> None:
    assert len(cases) > 100
    for case in cases:
        expected = case["expected"]
        result = path_conflict(
            own_position=[*case["p_o"], -case["h_o"]],
            own_speed=case["V_g"],
            waypoints=np.array(case["waypoints"]) * [1.0, 1.0, -1.0],
            intruder_position=[*case["p_i"], -case["h_i"]],
            intruder_velocity=[*case["v_i"], -case["v_hi"]],
            safety_radius=case["R_s"],
            safety_height=case["h_s"],
            distance_threshold=case["tau_p"],
            height_threshold=case["tau_h"],
            time_threshold=case["tau_T"],
        )
        assert result.penetration_flags.tolist() == expected["penetration_flags"]
        assert result.alert_flags.tolist() == expected["alert_flags"]
        assert result.collision == expected["collision"]
        for got, name in ((result.entry_time, "t_entry_abs"), (result.exit_time, "t_exit_abs")):
            wanted = np.array([segment[name] for segment in expected["segments"]], float)
            np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-9)
        for one, name in (
            (result.first_entry_time, "first_entry_time"),
            (result.first_alert_entry_time, "first_alert_entry_time"),
        ):
            np.testing.assert_allclose(one, np.array(expected[name], float), rtol=0, atol=1e-9)
