"""Conflict probability in straight flight: the closed form, its limits, and shapes; and along waypoints."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import ncx2, norm

from tests.naive import conflict as naive
from tests.naive import path_conflict as naive_path
from wideberth.conflict import probability_kernels as kernels
from wideberth.conflict.probability import conflict_probability, path_conflict_probability

S, V = [1000.0, 0.0, 0.0], [-10.0, 0.0, 0.0]


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_drawing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(2, 2)) * 200
    covariance = np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = a @ a.T + 50**2 * np.eye(2), 40.0**2
    s, v = np.array([4000.0, rng.uniform(-150, 150), 40.0]), np.array([-70.0, rng.uniform(-2, 2), -0.5])
    p = float(conflict_probability(s, v, covariance, 300.0, 60.0))
    n = 40_000
    drawn = naive.drawn_conflict_probability(s, v, covariance, 300.0, 60.0, n, rng)
    assert 0.02 < p < 0.98
    # 4.5 standard errors: one false alarm in 150,000 draws of this test.
    assert drawn == pytest.approx(p, abs=4.5 * math.sqrt(p * (1 - p) / n))


def test_is_the_formula_in_two_and_three_dimensions() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        a = rng.normal(size=(2, 2)) * 100
        c, v = a @ a.T, rng.normal(size=2) * 20
        s = rng.normal(size=2) * 300
        s -= v * (s @ v + 1.0) / (v @ v)  # ahead
        e = np.array([-v[1], v[0]]) / np.hypot(*v)
        sigma, m = math.sqrt(e @ c @ e), e @ s
        expected = norm.cdf((150 - m) / sigma) - norm.cdf((-150 - m) / sigma)
        assert conflict_probability(s, v, c, 150.0) == pytest.approx(expected, abs=1e-12)
        level = np.zeros((3, 3))
        level[:2, :2], level[2, 2] = c, 30.0**2
        height = norm.cdf((20 - 25) / 30) - norm.cdf((-20 - 25) / 30)
        assert conflict_probability([*s, 25.0], [*v, 0.0], level, 150.0, 20.0) == pytest.approx(
            expected * height, abs=1e-12
        )


def test_limits() -> None:
    assert conflict_probability(S, V, np.zeros((3, 3)), 10.0) == 1.0
    assert conflict_probability([1000.0, 20.0, 0.0], V, np.zeros((3, 3)), 10.0) == 0.0
    # Flying away: the separation now counts, not the one that was.
    assert conflict_probability(S, [10.0, 0.0, 0.0], np.eye(3), 100.0) < 1e-12
    # A band 30 sigmas away keeps its digits.
    assert 0 < conflict_probability([1000.0, 40.0, 0.0], V, np.eye(3), 10.0) < 1e-190


@pytest.mark.parametrize(
    ("s", "v", "covariance", "spare"),
    [
        ([1000.0, 50.0, 0.0], [-10.0, 0.0, 0.0], np.diag([1e4, 0.0, 0.0]), 0.0),
        ([1000.0, 80.0, 0.0], [-10.0, 0.0, 0.0], np.diag([900.0, 3600.0, 0.0]), 0.0),
        ([1000.0, 80.0, 10.0], [-10.0, 0.0, 0.0], np.outer([30.0, 60.0, 0.0], [30.0, 60.0, 0.0]), 0.0),
        ([50.0, 20.0, 10.0], [-1.0, 0.0, 0.1], np.eye(3) * 900.0, 0.0),
        ([50.0, 20.0, 10.0], [1.0, 0.0, 0.0], np.eye(3) * 900.0, 0.05),
        ([300.0, 0.0, 0.0], [10.0, 0.0, 0.0], np.eye(3) * 1e4, 0.02),
    ],
    ids=["certain across", "certain height", "one direction", "inside", "inside and leaving", "leaving"],
)
def test_odd_cases_agree_with_drawing(s: list[float], v: list[float], covariance: Any, spare: float) -> None:
    rng, n = np.random.default_rng(3), 40_000
    p = float(conflict_probability(s, v, covariance, 100.0, 40.0))
    e = rng.multivariate_normal(np.zeros(3), covariance, n) + s
    t = np.maximum(-(e[:, :2] @ v[:2]) / (v[0] ** 2), 0.0)
    drawn = ((np.hypot(e[:, 0] + v[0] * t, e[:, 1]) < 100.0) & (np.abs(e[:, 2] + v[2] * t) < 40.0)).mean()
    # Past the closest point it may be more, by what lies beside the disc.
    assert drawn - 4.5 * math.sqrt(0.25 / n) <= p <= drawn + 4.5 * math.sqrt(0.25 / n) + spare


def test_an_endless_height_is_none() -> None:
    assert conflict_probability(S, V, np.eye(3), 10.0, math.inf) == conflict_probability(S, V, np.eye(3), 10.0)
    with pytest.raises(ValueError, match="half_height must be positive"):
        conflict_probability(S, V, np.eye(3), 10.0, 0.0)


@pytest.mark.parametrize("sigma", [0.01, 3.0, 60.0, 5000.0])
def test_without_relative_motion_it_is_the_disc(sigma: float) -> None:
    for distance in (0.0, 80.0, 99.99, 130.0):
        expected = ncx2.cdf((100.0 / sigma) ** 2, 2, (distance / sigma) ** 2)
        p = conflict_probability([0.6 * distance, 0.8 * distance], [0.0, 0.0], np.eye(2) * sigma**2, 100.0)
        assert p == pytest.approx(expected, abs=1e-9)
    assert conflict_probability([60.0, 0.0, 5.0], [0.0] * 3, np.zeros((3, 3)), 100.0, 4.0) == 0.0
    assert conflict_probability([60.0, 0.0, 5.0], [0.0, 0.0, -1.0], np.zeros((3, 3)), 100.0, 4.0) == 1.0


def test_disc_of_an_oblong_covariance_agrees_with_drawing() -> None:
    rng = np.random.default_rng(8)
    for _ in range(6):
        a = rng.normal(size=(2, 2)) * [[100.0], [10.0]]
        mean = rng.normal(size=2) * 80
        p = float(conflict_probability(mean, [0.0, 0.0], a @ a.T, 100.0))
        drawn = (np.hypot(*rng.multivariate_normal(mean, a @ a.T, 40_000).T) <= 100.0).mean()
        assert drawn == pytest.approx(p, abs=4.5 * math.sqrt(0.25 / 40_000))


def test_a_long_stadium_is_the_band() -> None:
    p = kernels.stadium_probability(30.0, 0.0, 50.0**2, 80.0**2, 900.0, 100.0, 1e5, 1e5)
    assert p == pytest.approx(norm.cdf(70 / 50) - norm.cdf(-130 / 50), abs=1e-12)
    assert kernels.interval_probability(-1.0, 2.0, 0.5, 1.5) == pytest.approx(norm.cdf(1.0) - norm.cdf(-1.0))


def test_shapes() -> None:
    s = np.array([S, [1000.0, 20.0, 0.0], [1000.0, 300.0, 0.0]])
    p = conflict_probability(s, V, np.eye(3) * 400.0, 50.0, 10.0)
    assert isinstance(p, np.ndarray)
    assert p.shape == (3,)
    for one, row in zip(p, s, strict=True):
        assert one == conflict_probability(row, V, np.eye(3) * 400.0, 50.0, 10.0)
    assert np.shape(conflict_probability(s[:, None], V, np.broadcast_to(np.eye(3), (2, 3, 3)), 50.0)) == (3, 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((S, V, np.eye(3), -1.0), "radius must be positive"),
        ((S, V, np.eye(3), 0.0), "radius must be positive"),
        ((S, V, np.eye(3), 1.0, 0.0), "half_height must be positive"),
        ((S, V, np.eye(2), 1.0), "shapes must be"),
        ((S[:2], V[:2], np.eye(2), 1.0, 1.0), "three dimensions"),
        ((S, V, np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]]), 1.0), "symmetric"),
        ((S, V, np.diag([1.0, -1.0, 1.0]), 1.0), "semi-definite"),
        ((S, V, np.full((3, 3), math.nan), 1.0), "not finite"),
        ((np.zeros((2, 3)), np.zeros((3, 3)), np.eye(3), 1.0), "fit together"),
    ],
)
def test_bad_input_is_refused(arguments: tuple[object, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        conflict_probability(*arguments)  # type: ignore[arg-type]


def test_probability_of_each_segment_agrees_with_drawing() -> None:
    rng = np.random.default_rng(12)
    errors = []
    for _ in range(12):
        waypoints = np.cumsum(rng.normal(size=(3, 3)) * [400, 400, 10], axis=0)
        speed, v = float(rng.uniform(10, 30)), rng.normal(size=3) * [20.0, 20.0, 0.5]
        reached = naive_path.own_track(np.zeros(3), speed, waypoints)[1]
        p = waypoints[1] - v * reached[2] + rng.normal(size=3) * [120, 120, 15]
        mix = np.eye(6) + 0.3 * np.kron(rng.normal(size=(2, 2)), np.eye(3))
        root = np.array([50.0, 40.0, 10.0, 1.5, 1.0, 0.3])[:, None] * mix
        covariance = root @ root.T
        got = path_conflict_probability(
            own_position=np.zeros(3),
            own_speed=speed,
            waypoints=waypoints,
            intruder_position=p,
            intruder_velocity=v,
            covariance=covariance,
            safety_radius=150.0,
            safety_height=60.0,
        )
        states = rng.multivariate_normal([*p, *v], covariance, 2000)
        errors += list(got - naive_path.drawn_path_conflicts(np.zeros(3), speed, waypoints, states, 150.0, 30.0, 0.25))
    # 36 segments; 2000 draws leave 0.011 at most (one sigma); the spread along a segment is an approximation.
    assert np.abs(errors).max() < 0.08
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def test_path_probability_of_certain_states_is_the_flag() -> None:
    case: dict[str, Any] = {
        "own_position": [0.0] * 3,
        "own_speed": 10.0,
        "waypoints": [[500.0, 0.0, 0.0], [500.0, 500.0, 0.0]],
        "intruder_velocity": [0.0, -5.0, 0.0],
        "covariance": np.zeros((6, 6)),
        "safety_radius": 50.0,
        "safety_height": 20.0,
    }
    assert path_conflict_probability(**case, intruder_position=[500.0, 900.0, 0.0]).tolist() == [0.0, 1.0]
    assert path_conflict_probability(**case, intruder_position=[500.0, 900.0, 11.0]).tolist() == [0.0, 0.0]
    assert path_conflict_probability(**case, intruder_position=[500.0, 900.0, 0.0], lookahead=49.0).tolist() == [
        0.0,
        0.0,
    ]
    standing = {**case, "own_speed": 0.0, "intruder_position": [0.0, 300.0, 0.0]}
    assert path_conflict_probability(**standing, lookahead=100.0).tolist() == [1.0, 0.0]
    with pytest.raises(ValueError, match="finite lookahead"):
        path_conflict_probability(**standing)
    with pytest.raises(ValueError, match=r"covariance must have shape \(6, 6\)"):
        path_conflict_probability(**{**standing, "covariance": np.eye(3)})


def test_certain_stays_need_no_integral() -> None:
    # Just beyond where the whole of it is certain along the motion the integral still says the same.
    for mean_u, sign in ((-150.0, 1.0), (120.0, -1.0)):
        integrated, certain = (
            kernels.stadium_probability(20.0, mean_u, 4.0, 16.0, 0.0, 100.0, 80.0, 80.0),
            kernels.stadium_probability(20.0, mean_u + sign * 40.0, 4.0, 16.0, 0.0, 100.0, 80.0, 80.0),
        )
        assert integrated <= certain == pytest.approx(1.0, abs=1e-12)
    assert kernels.stadium_probability(20.0, 215.0, 4.0, 16.0, 0.0, 100.0, 80.0, 80.0) == 0.0
    assert 0.0 < kernels.stadium_probability(20.0, 205.0, 4.0, 16.0, 0.0, 100.0, 80.0, 80.0) < 1e-8
