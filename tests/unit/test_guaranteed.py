"""The guaranteed miss distance: never above what some motion within the bounds does, and tight where that is known."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from tests.naive import path_conflict as naive
from wideberth.conflict import guaranteed_kernels as kernels
from wideberth.conflict.guaranteed import guaranteed_miss_distance, guaranteed_turning_miss_distance

FloatArray = NDArray[np.float64]
LOOKAHEAD = 40.0


def box_distance(p: FloatArray, v: FloatArray, a: FloatArray, bounds: list[FloatArray]) -> float:
    """Return the least distance from an axis-parallel box, at many times."""
    t = np.linspace(0.0, LOOKAHEAD, 40_001)[:, None]
    reach = bounds[0] + t * bounds[1] + 0.5 * t**2 * bounds[2]
    return float(np.linalg.norm(np.maximum(np.abs(p + t * v + 0.5 * t**2 * a) - reach, 0.0), axis=1).min())


@pytest.mark.parametrize("accelerating", [False, True])
def test_box_bounds_are_met_exactly(accelerating: bool) -> None:
    rng = np.random.default_rng(int(accelerating))
    positive = 0
    for _ in range(60):
        p = rng.normal(size=3) * [600, 600, 80]
        v = -p / rng.uniform(10, 30) + rng.normal(size=3) * [8, 8, 2]
        a = rng.normal(size=3) * [0.5, 0.5, 0.1] * accelerating
        bounds = [rng.uniform(0, 40, 3), rng.uniform(0, 2, 3), rng.uniform(0, 0.1, 3) * accelerating]
        bound = guaranteed_miss_distance(
            p,
            v,
            LOOKAHEAD,
            position_bound=bounds[0],
            velocity_bound=bounds[1],
            relative_acceleration=a,
            acceleration_bound=bounds[2],
        )
        least = box_distance(p, v, a, bounds)
        assert least - 0.01 <= bound <= least + 1e-6
        positive += bound > 0
    assert positive > 20


def test_is_the_maximum_over_tau_of_the_errata() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        c, g = rng.normal(size=3) * 100, rng.normal(size=(3, 5)) * 15
        a, b = g.T @ g, g.T @ c

        def dual(root: FloatArray, a: FloatArray = a, b: FloatArray = b, c: FloatArray = c) -> float:
            tau = root**2 + 1e-9
            return float(-(c @ c - tau.sum() - b @ np.linalg.solve(a + np.diag(tau), b)))

        best = max(-minimize(dual, np.full(5, s), method="L-BFGS-B").fun for s in (1.0, 10.0, 40.0))
        bound = kernels.nearest(c, g, np.zeros(5), np.zeros(3), 1e-9)
        assert bound == pytest.approx(math.sqrt(max(best, 0.0)), rel=1e-3, abs=1e-2)


def test_zonotopes_of_any_columns_hold_all_draws() -> None:
    rng = np.random.default_rng(5)
    for _ in range(30):
        p, v = rng.normal(size=3) * [500, 500, 50], rng.normal(size=3) * [20, 20, 2]
        columns = [rng.normal(size=(3, 4)) * 15, rng.normal(size=(3, 2)), rng.normal(size=(3, 1)) * 0.05]
        bound = guaranteed_miss_distance(
            p,
            v,
            LOOKAHEAD,
            position_bound=columns[0],
            velocity_bound=columns[1],
            acceleration_bound=columns[2],
        )
        d = np.vstack([rng.choice([-1.0, 1.0], (128, 7)), rng.uniform(-1, 1, (64, 7))])
        t = np.linspace(0.0, LOOKAHEAD, 200)[:, None, None]
        drawn = (
            p + d[:, :4] @ columns[0].T + t * (v + d[:, 4:6] @ columns[1].T) + 0.5 * t**2 * (d[:, 6:] @ columns[2].T)
        )
        assert bound <= np.linalg.norm(drawn, axis=-1).min()


def test_turning_motion_is_never_nearer_than_the_bound() -> None:
    rng = np.random.default_rng(6)
    gaps = []
    for _ in range(25):
        x = np.array([*(rng.normal(size=3) * [600, 600, 60]), rng.uniform(15, 40), rng.uniform(-3, 3),
                      rng.uniform(-0.1, 0.1), rng.normal() * 0.3, rng.normal() * 0.1, rng.normal() * 0.01])  # fmt: skip
        bound = np.array([20, 20, 10, 1.0, 0.05, 0.02, 0.05, 0.005, 0.002]) * rng.uniform(0, 1)
        own, own_velocity = np.zeros(3), np.array([15.0, 0.0, 0.0])
        distance = guaranteed_turning_miss_distance(own, own_velocity, x, bound, 30.0)
        level = guaranteed_turning_miss_distance(own, own_velocity, x, bound, 30.0, horizontal=True)
        times = np.linspace(0.0, 30.0, 121)
        least = level_least = math.inf
        for d in np.vstack([np.zeros(9), rng.choice([-1.0, 1.0], (60, 9)), rng.uniform(-1, 1, (20, 9))]):
            relative = (
                naive.maneuver_positions("turning", x + bound * d, math.inf, times) - times[:, None] * own_velocity
            )
            least = min(least, float(np.linalg.norm(relative, axis=1).min()))
            level_least = min(level_least, float(np.hypot(relative[:, 0], relative[:, 1]).min()))
        assert distance <= least + 1e-6
        assert level <= level_least + 1e-6
        assert level <= distance + 0.01
        gaps.append(least - distance)
    assert np.median(gaps) < 15.0


def test_known_turn_is_exact() -> None:
    # Round a circle of 200 m about (300, 0), seen from a standing ownship: 100 m at its nearest.
    x = [300.0, -200.0, 0.0, 20.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    assert guaranteed_turning_miss_distance([0, 0, 0], [0, 0, 0], x, np.zeros(9), 70.0) == pytest.approx(
        100.0, abs=0.02
    )
    # Position errors alone are exact, too.
    bound = [10.0, 0, 0, 0, 0, 0, 0, 0, 0]
    assert guaranteed_turning_miss_distance([0, 0, 0], [0, 0, 0], x, bound, 70.0) == pytest.approx(90.0, abs=0.02)


def test_collision_that_cannot_be_excluded_is_zero() -> None:
    assert guaranteed_miss_distance([100, 0, 0], [-10, 0, 0], 20.0, position_bound=[0, 0, 0]) == 0.0
    assert guaranteed_miss_distance([100, 30, 0], [-10, 0, 0], 20.0, position_bound=[0, 40, 0]) == 0.0
    assert guaranteed_miss_distance([100, 0, 0], [-10, 0, 0], 0.0, position_bound=[5, 0, 0]) == pytest.approx(
        95.0, abs=0.01
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"position_bound": [-1.0, 0.0, 0.0]}, "position_bound must be finite and not negative"),
        ({"velocity_bound": [1.0, 0.0]}, "velocity_bound must have shape"),
        ({"lookahead": math.inf}, "lookahead must be between"),
        ({"tolerance": 0.0}, "tolerance must be positive"),
        ({"relative_position": [math.nan, 0, 0]}, "relative_position must be finite"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, object], words: str) -> None:
    case = {
        "relative_position": [1, 2, 3],
        "relative_velocity": [0, 0, 0],
        "lookahead": 1.0,
        "position_bound": [0, 0, 0],
    }
    with pytest.raises(ValueError, match=words):
        guaranteed_miss_distance(**{**case, **changes})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="state_bound must have shape"):
        guaranteed_turning_miss_distance([0] * 3, [0] * 3, [0] * 9, [0] * 8, 1.0)
