"""Conflicts with maneuvering intruders against positions summed in small steps."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.naive import path_conflict as naive
from wideberth.conflict.curved_path import curved_path_conflict
from wideberth.conflict.cylinder import path_conflict

FloatArray = NDArray[np.float64]
LOOKAHEAD = 60.0
MOTIONS = ("turning", "constant_acceleration", "constant_velocity")


def drawn_state(rng: np.random.Generator, motion: str) -> FloatArray:
    p = rng.uniform(-400, 400, 3) * [1.0, 1.0, 0.15]
    if motion == "turning":
        rates = [rng.uniform(-0.5, 0.5), rng.uniform(-0.3, 0.3), rng.uniform(-0.03, 0.03)]
        if rng.random() < 0.3:
            rates[1] = rates[2] = 0.0
        return np.array([*p, rng.uniform(5, 40), rng.uniform(-3, 3), rng.uniform(-0.2, 0.2), *rates])
    v = rng.uniform(-25, 25, 3) * [1.0, 1.0, 0.1]
    if motion == "constant_velocity":
        return np.concatenate([p, v])
    return np.concatenate([p, v, rng.uniform(-1, 1, 3) * [1.0, 1.0, 0.05]])


@pytest.mark.parametrize("motion", MOTIONS)
def test_entries_and_exits_agree_with_dense_samples(motion: str) -> None:
    rng = np.random.default_rng([21, MOTIONS.index(motion)])
    tolerance, entered = 0.01, 0
    for _ in range(150):
        n = int(rng.integers(1, 4))
        waypoints = rng.uniform(-400, 400, (n, 3)) * [1.0, 1.0, 0.1]
        own, speed = rng.uniform(-400, 400, 3) * [1.0, 1.0, 0.1], float(rng.choice([0.0, 12.0, 25.0]))
        x = drawn_state(rng, motion)
        maneuver_time = float(rng.choice([np.inf, 15.0]))
        radius, half = float(rng.uniform(80, 250)), float(rng.uniform(30, 120))
        result = curved_path_conflict(
            own_position=own,
            own_speed=speed,
            waypoints=waypoints,
            intruder_state=x,
            motion=motion,  # type: ignore[arg-type]
            maneuver_time=maneuver_time,
            lookahead=LOOKAHEAD,
            tolerance=tolerance,
            safety_radius=radius,
            safety_height=2 * half,
        )
        corners, reached = naive.own_track(own, speed, waypoints)
        grid = np.linspace(0.0, LOOKAHEAD, 601)
        marks = np.concatenate([grid, result.entry_time, result.exit_time, [maneuver_time]])
        grid = np.unique(marks[np.isfinite(marks)])
        positions = naive.maneuver_positions(motion, x, maneuver_time, grid)
        for i in range(n):
            at = (grid >= reached[i]) & (grid <= reached[i + 1])
            times, places = grid[at], positions[at]
            far = naive.sampled_segment(
                corners[i], corners[i + 1], reached[i], reached[i + 1], places, radius, half, times
            )
            entry, exit_ = result.entry_time[i], result.exit_time[i]
            if result.penetration_flags[i]:
                assert reached[i] <= entry <= exit_ <= min(reached[i + 1], LOOKAHEAD)
                assert (far[(times == entry) | (times == exit_)] <= 1e-5).all()
            without = ~((times >= entry) & (times <= exit_))
            # A stay shorter than the tolerance may be missed, which is not deeper than half its way at 70 m/s.
            assert (far[without] >= -0.5 * 70.0 * tolerance).all()
            entered += int(result.penetration_flags[i])
        assert not np.isnan(result.first_entry_time) or not result.penetration_flags.any()
    assert entered > 30


def test_straight_intruders_are_judged_as_in_closed_form() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        waypoints, own = rng.uniform(-400, 400, (3, 3)) * [1.0, 1.0, 0.1], np.zeros(3)
        x = drawn_state(rng, "constant_velocity")
        common = {
            "own_position": own, "own_speed": 15.0, "waypoints": waypoints,
            "safety_radius": 120.0, "safety_height": 80.0,
            "distance_threshold": 300.0, "height_threshold": 30.0, "time_threshold": 20.0,
        }  # fmt: skip
        straight = path_conflict(**common, intruder_position=x[:3], intruder_velocity=x[3:])  # type: ignore[arg-type]
        turning = np.array([*x[:3], np.linalg.norm(x[3:]), np.arctan2(x[4], x[3]),
                            np.arctan2(-x[5], np.hypot(x[3], x[4])), 0.0, 0.0, 0.0])  # fmt: skip
        for motion, state in (("constant_velocity", x), ("turning", turning)):
            curved = curved_path_conflict(**common, intruder_state=state, motion=motion, lookahead=500.0)  # type: ignore[arg-type]
            assert curved.alert_flags.tolist() == straight.alert_flags.tolist()
            np.testing.assert_allclose(curved.entry_time, straight.entry_time, atol=1e-6)
            np.testing.assert_allclose(curved.exit_time, straight.exit_time, atol=1e-6)
            if not straight.beyond_last_entry_time > 500.0:
                np.testing.assert_allclose(curved.beyond_last_entry_time, straight.beyond_last_entry_time, atol=1e-6)
