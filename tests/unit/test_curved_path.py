"""The turning model in closed form, states from tracks, and what curved paths can do that straight ones cannot."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from tests.naive import path_conflict as naive
from wideberth.conflict import turning_kernels
from wideberth.conflict.curved_path import curved_path_conflict, turning_state
from wideberth.tracking import motion_kernels

CASE = {
    "own_position": [0.0, 0.0, 0.0],
    "own_speed": 0.0,
    "waypoints": [[100.0, 0.0, 0.0]],
    "safety_radius": 50.0,
    "safety_height": 40.0,
    "lookahead": 100.0,
}


@pytest.mark.parametrize("n", [0, 1, 2])
@pytest.mark.parametrize("x", [0.0, 1e-9, -0.3, 0.999, 1.001, -7.0, 60.0])
def test_moments(n: int, x: float) -> None:
    expected = [quad(lambda u, f=f: u**n * f(x * u), 0.0, 1.0, limit=200)[0] for f in (math.cos, math.sin)]
    assert turning_kernels.moment(n, x) == pytest.approx(expected, abs=1e-12)


def test_closed_form_agrees_with_small_steps_of_the_tracker() -> None:
    rng = np.random.default_rng(0)
    for _ in range(10):
        x = np.array([*rng.normal(size=3), 30.0, rng.uniform(-3, 3), rng.uniform(-0.4, 0.4), *rng.normal(size=3) * 0.1])
        y = x.copy()
        for _ in range(400):
            motion_kernels.propagate(motion_kernels.TURNING, 0.05, y, y)
        assert turning_kernels.turning_position(20.0, x) == pytest.approx(y[:3], abs=1e-6)
        velocity = np.empty(3)
        motion_kernels.path_velocity(y[3], y[4], y[5], velocity)
        assert turning_kernels.turning_velocity(20.0, x) == pytest.approx(velocity, abs=1e-9)
        twin = naive.maneuver_positions("turning", x, math.inf, np.linspace(0.0, 20.0, 200))[-1]
        assert turning_kernels.turning_position(20.0, x) == pytest.approx(twin, abs=1e-9)


def test_turning_state_moves_as_the_track() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        p, v, a = rng.normal(size=3), rng.normal(size=3) * 20, rng.normal(size=3)
        out, jacobian = np.empty(9), np.empty((9, 9))
        motion_kernels.kinematics(motion_kernels.TURNING, turning_state(p, v, a), out, jacobian)
        np.testing.assert_allclose(out, [*p, *v, *a], atol=1e-9)
    assert turning_state([0, 0, 0], [0, 0, 0], [0, 0, 0]).tolist() == [0.0] * 9
    assert turning_state([0, 0, 0], [0, 0, -5], [0, 0, 0])[5] == pytest.approx(math.pi / 2)
    assert turning_state([0, 0, 0], [0, 0, 0], [0, 2, 0])[4:7] == pytest.approx([math.pi / 2, 0.0, 2.0])


def test_a_full_circle_comes_back() -> None:
    # Radius 200 m through the ownship's place, begun on the far side; once round takes 2 pi 200 / 20 s.
    rate = 20.0 / 200.0
    x = [400.0, 0.0, 0.0, 20.0, math.pi / 2, 0.0, 0.0, rate, 0.0]
    result = curved_path_conflict(**CASE, intruder_state=x)  # type: ignore[arg-type]
    # At 50 m from the place on the circle: the chord's angle is 2 asin(25 / 200) seen from the centre.
    half_turn, reach = math.pi / rate, 2 * math.asin(25.0 / 200.0) / rate
    assert result.entry_time[0] == pytest.approx(half_turn - reach, abs=1e-6)
    assert result.exit_time[0] == pytest.approx(3 * half_turn + reach, abs=1e-6)  # it comes twice until then
    straight = curved_path_conflict(**CASE, intruder_state=x, maneuver_time=10.0)  # type: ignore[arg-type]
    assert not straight.penetration_flags.any()


def test_a_brief_graze_is_found_to_the_tolerance() -> None:
    # Falls through the circle's rim: 1 m deep for 0.2 s on the top of a parabola.
    x = [49.0, -20.0, 0.0, 0.0, 200.0, 0.0, 100.0, 0.0, 0.0]
    result = curved_path_conflict(**CASE, intruder_state=x, motion="constant_acceleration", tolerance=1e-4)  # type: ignore[arg-type]
    inside = [t for t in np.arange(0.0, 1.0, 1e-5) if math.hypot(49.0 + 50.0 * t * t, -20.0 + 200.0 * t) <= 50.0]
    assert result.entry_time[0] == pytest.approx(inside[0], abs=2e-5)
    assert result.exit_time[0] == pytest.approx(inside[-1], abs=2e-5)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"intruder_state": [0.0] * 6}, r"intruder_state must have shape \(9,\)"),
        ({"intruder_state": [math.nan] * 9}, "intruder_state must be finite"),
        ({"motion": "hovering"}, "motion must be one of"),
        ({"lookahead": math.inf}, "lookahead must be between"),
        ({"tolerance": 0.0}, "tolerance must be positive"),
        ({"maneuver_time": -1.0}, "maneuver_time must be positive"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        curved_path_conflict(**{**CASE, "intruder_state": [0.0] * 9, **changes})  # type: ignore[arg-type]
