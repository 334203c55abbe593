"""Conflicts along waypoints against positions at many times: every instant must agree with what is predicted."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.naive import path_conflict as naive
from wideberth.conflict.cylinder import PathConflict, path_conflict

FloatArray = NDArray[np.float64]
STANDING = 200.0  # s of an ownship that stands still, as far as the twin looks
NEAR = 1e-6  # m; nearer to the bound, both may be right


def check(case: dict[str, object], result: PathConflict) -> None:
    """Compare every segment with dense samples."""
    own, waypoints = np.array(case["own_position"], float), np.array(case["waypoints"], float)
    p, v = np.array(case["intruder_position"], float), np.array(case["intruder_velocity"], float)
    radius, half = float(case["safety_radius"]), 0.5 * float(case["safety_height"])  # type: ignore[arg-type]
    corners, reached = naive.own_track(own, float(case["own_speed"]), waypoints)  # type: ignore[arg-type]
    near = bool(
        np.hypot(*(p - own)[:2]) <= float(case["distance_threshold"])  # type: ignore[arg-type]
        and abs((p - own)[2]) <= float(case["height_threshold"])  # type: ignore[arg-type]
    )
    for i in range(len(waypoints)):
        start, end = reached[i], reached[i + 1]
        entry, exit_ = result.entry_time[i], result.exit_time[i]
        if np.isinf(start):
            assert not result.penetration_flags[i]
            continue
        times = np.linspace(start, min(end, start + STANDING), 401)
        if result.penetration_flags[i]:
            assert start <= entry <= exit_ <= end
            times = np.unique(np.append(times, [t for t in (entry, exit_) if t <= start + STANDING]))
            expected = near or entry <= float(case["time_threshold"])  # type: ignore[arg-type]
            assert result.alert_flags[i] == expected
        else:
            assert np.isnan(entry)
            assert np.isnan(exit_)
            assert not result.alert_flags[i]
        far = naive.sampled_segment(corners[i], corners[i + 1], start, end, p + v * times[:, None], radius, half, times)
        within = (times >= entry) & (times <= exit_)
        assert (far[within] <= NEAR).all()
        assert (far[~within] >= -NEAR).all()


def drawn_case(rng: np.random.Generator) -> dict[str, object]:
    """Return a case on a coarse grid, so that touches, parallel flight, and repeated points are frequent."""
    coarse = rng.random() < 0.5

    def draw(scale: float, size: int | tuple[int, int]) -> FloatArray:
        if coarse:
            return np.asarray(scale * rng.integers(-3, 4, size) / 3.0, float)
        return rng.uniform(-scale, scale, size)

    n = int(rng.integers(1, 6))
    waypoints = draw(600.0, (n, 3)) * [1.0, 1.0, 0.2]
    for i in range(1, n):
        if rng.random() < 0.15:
            waypoints[i] = waypoints[i - 1]
    own = waypoints[0].copy() if rng.random() < 0.1 else draw(600.0, 3) * [1.0, 1.0, 0.2]
    speed = 0.0 if rng.random() < 0.1 else float(rng.integers(1, 5) * 10 if coarse else rng.uniform(0.5, 40.0))
    velocity = draw(60.0, 3) * [1.0, 1.0, 0.2]
    kind = rng.random()
    leg = waypoints[0] - own
    if kind < 0.15:
        velocity = np.zeros(3)
    elif kind < 0.3 and np.linalg.norm(leg) > 0:  # parallel flight
        velocity = speed * leg / np.linalg.norm(leg)
    elif kind < 0.45:  # vertical relative motion only
        velocity[:2] = 0.0
        speed = 0.0 if rng.random() < 0.5 else speed
    intruder = draw(600.0, 3) * [1.0, 1.0, 0.2]
    if rng.random() < 0.4:  # meets the ownship near a waypoint
        k = int(rng.integers(0, n))
        reached = naive.own_track(own, speed or 10.0, waypoints)[1]
        intruder = waypoints[k] + draw(150.0, 3) * [1.0, 1.0, 0.2] - velocity * reached[k + 1]
    elif rng.random() < 0.3:  # begins inside, or on the bound
        intruder = own + draw(100.0, 3) * [1.0, 1.0, 0.4]
    return {
        "own_position": own,
        "own_speed": speed,
        "waypoints": waypoints,
        "intruder_position": intruder,
        "intruder_velocity": velocity,
        "safety_radius": float(rng.choice([100.0, 200.0, rng.uniform(5.0, 300.0)])),
        "safety_height": float(rng.choice([80.0, 40.0, rng.uniform(5.0, 200.0)])),
        "distance_threshold": float(rng.uniform(0.0, 600.0)),
        "height_threshold": float(rng.uniform(0.0, 200.0)),
        "time_threshold": float(rng.uniform(0.0, 60.0)),
    }


@pytest.mark.parametrize("seed", range(8))
def test_flags_and_times_agree_with_dense_samples(seed: int) -> None:
    rng = np.random.default_rng([20, seed])
    entered = 0
    for _ in range(400):
        case = drawn_case(rng)
        result = path_conflict(**case)  # type: ignore[arg-type]
        check(case, result)
        entered += int(result.penetration_flags.any())
        entries = result.entry_time[~np.isnan(result.entry_time)]
        assert np.isnan(result.first_entry_time) if not entries.size else result.first_entry_time == entries[0]
        counting = result.entry_time[result.alert_flags]
        assert result.collision == bool(counting.size)
        assert (
            result.first_alert_entry_time == counting[0] if counting.size else np.isnan(result.first_alert_entry_time)
        )
    assert entered > 100


@pytest.mark.parametrize("beyond", ["along_last_leg", "hover"])
def test_beyond_the_last_waypoint_is_the_path_with_one_more_leg(beyond: str) -> None:
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(300):
        case = drawn_case(rng)
        result = path_conflict(**case, beyond=beyond)  # type: ignore[arg-type]
        own, waypoints = np.array(case["own_position"]), np.array(case["waypoints"])
        corners = np.vstack([own, waypoints])
        legs = np.diff(corners, axis=0)
        moving = legs[np.linalg.norm(legs, axis=1) > 0]
        speed = float(case["own_speed"])  # type: ignore[arg-type]
        if speed == 0.0 and moving.size:
            assert np.isnan(result.beyond_last_entry_time)
            continue
        direction = moving[-1] / np.linalg.norm(moving[-1]) if moving.size else np.zeros(3)
        time = 300.0
        _, reached = naive.own_track(own, speed or 1.0, waypoints)
        speeds = np.full(len(waypoints) + 1, speed)
        more = waypoints[-1] + direction * speed * time
        if beyond == "hover" or not direction.any():
            more, speeds[-1] = waypoints[-1] + [1.0, 0.0, 0.0], 0.0  # it stands at the end for ever
        longer = path_conflict(**{**case, "waypoints": np.vstack([waypoints, more]), "own_speed": speeds})  # type: ignore[arg-type]
        got, expected = result.beyond_last_entry_time, longer.entry_time[-1]
        if got > reached[-1] + time:
            continue
        np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6)
        found += not np.isnan(got)
    assert found > 15
