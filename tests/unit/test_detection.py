"""Algorithms 1 and 2 of the ADS-B paper, the spread of a predicted miss, and conflict probability."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.naive import conflict as naive
from wideberth.conflict.cpa import horizontal_cpa, spatial_cpa
from wideberth.conflict.detection import (
    PAPER_COLLISION,
    PAPER_SELF_SEPARATION,
    DetectionRules,
    algorithm_1,
    algorithm_2,
)
from wideberth.conflict.uncertainty import PAPER_NOISE, ConstantNoise, relative_position_covariance, sigma_at_cpa
from wideberth.units import FOOT, KNOT

ZERO = np.zeros(3)


def test_cpa_of_a_known_crossing() -> None:
    t, d = horizontal_cpa([[1000.0, 300.0, 50.0]], [[-10.0, 0.0, 1.0]])
    assert t[0] == pytest.approx(100.0)
    assert d[0] == pytest.approx(300.0)
    t, d = spatial_cpa([0.0, 3.0, -40.0], [0.0, 0.0, 4.0])
    assert float(t) == pytest.approx(10.0)
    assert float(d) == pytest.approx(3.0)


def test_cpa_without_motion_and_past() -> None:
    t, d = horizontal_cpa([3.0, 4.0, 9.0], ZERO)
    assert (float(t), float(d)) == (0.0, 5.0)
    assert float(horizontal_cpa([100.0, 0.0], [10.0, 0.0])[0]) == pytest.approx(-10.0)
    with pytest.raises(ValueError, match="relative_velocity"):
        horizontal_cpa([1.0, 2.0, 3.0], [math.nan, 0.0, 0.0])
    with pytest.raises(ValueError, match="must both be"):
        spatial_cpa([1.0, 2.0], [1.0, 2.0])


def test_cpa_is_the_minimum_over_time() -> None:
    rng = np.random.default_rng(5)
    s, v = rng.normal(size=(50, 3)) * 1000, rng.normal(size=(50, 3)) * 50
    for function, axes in ((horizontal_cpa, 2), (spatial_cpa, 3)):
        t, d = function(s, v)
        at = np.linalg.norm((s + v * t[:, None])[:, :axes], axis=1)
        np.testing.assert_allclose(at, d, atol=1e-6)
        for shift in (-0.5, 0.5):
            assert (np.linalg.norm((s + v * (t + shift)[:, None])[:, :axes], axis=1) >= d - 1e-9).all()


@pytest.mark.parametrize("rules", [PAPER_SELF_SEPARATION, PAPER_COLLISION])
def test_time_of_detection_agrees_with_sampling(rules: DetectionRules) -> None:
    rng = np.random.default_rng(11)
    # Line 2 always true, so that the result is line 1 alone.
    rules = replace(rules, d_c=1e9, h_c=rules.h_c)
    wide = replace(rules, m2=1e9)
    times = np.linspace(0.0, rules.lookahead, 1201)
    step = times[1]
    held = 0
    for k in range(150):
        s = rng.normal(size=3) * [1.5 * rules.d_th, 1.5 * rules.d_th, 2 * rules.h_th]
        v = rng.normal(size=3) * [70, 70, 6]
        if k % 5 == 0:
            v[2] = 0.0
        if k % 7 == 0:
            v[:2] = 0.0
        result = algorithm_2(wide, ZERO, ZERO, s, v)
        hits = np.flatnonzero(naive.line_1(s, v, rules.d_th, rules.h_th, rules.tau_th, rules.h_c, times[1:]))
        if hits.size:
            held += 1
            assert result.detected
            assert times[1 + hits[0]] - step - 1e-9 <= result.t_detected <= times[1 + hits[0]] + 1e-9
        else:
            assert np.isnan(result.t_detected) or result.t_detected > rules.lookahead - step
    assert held > 20


def test_algorithm_1_judges_the_miss() -> None:
    head_on = algorithm_1(PAPER_COLLISION, ZERO, [41, 0, 0], [3000, 100, 10], [-41, 0, 0])
    assert head_on.detected
    assert head_on.d_cpa == pytest.approx(100.0)
    assert head_on.h_cpa == pytest.approx(10.0)
    assert head_on.sigma_dcpa == 0
    # t_cpa = 36.6 s falls under 35 s after 1.6 s; the 4000 ft circle is further away.
    assert head_on.t_detected == pytest.approx(3000 / 82 - 35)
    assert not algorithm_1(PAPER_COLLISION, ZERO, [41, 0, 0], [3000, 200, 10], [-41, 0, 0]).detected
    assert not algorithm_1(PAPER_COLLISION, ZERO, [41, 0, 0], [3000, 100, 31], [-41, 0, 0]).detected


def test_printed_variant_alarms_on_an_aircraft_that_flies_away() -> None:
    away = (ZERO, ZERO, [600.0, 0.0, 0.0], [50.0, 0.0, 0.0])
    assert algorithm_1(PAPER_COLLISION, *away, variant="printed").detected
    assert not algorithm_1(PAPER_COLLISION, *away, variant="corrected").detected


def test_full_heights_are_halved() -> None:
    pair = (ZERO, [41, 0, 0], [1000, 0, 20], [-41, 0, 0])
    assert algorithm_1(PAPER_COLLISION, *pair).detected
    assert not algorithm_1(replace(PAPER_COLLISION, heights="full"), *pair).detected


def test_paper_sigmas() -> None:
    d, h = sigma_at_cpa(PAPER_NOISE, 35.0)
    assert float(d) == pytest.approx(math.hypot(124 * FOOT, 35 * 8 * KNOT))
    assert float(h) == pytest.approx(FOOT * math.hypot(75.9, 35 * 27.96 / 60))
    printed, _ = sigma_at_cpa(replace(PAPER_NOISE, noisy_aircraft=2), 35.0, printed=True)
    assert float(printed) == pytest.approx(math.sqrt(2 * (124 * FOOT) ** 2 + 2 * 35 * (8 * KNOT) ** 2))


def test_algorithm_2_takes_sigmas_off() -> None:
    pair = (ZERO, [41, 0, 0], [1640, 220, 0], [-41, 0, 0])
    plain = algorithm_1(PAPER_COLLISION, *pair)
    careful = algorithm_2(PAPER_COLLISION, *pair)
    assert not plain.detected
    assert careful.detected
    assert float(careful.sigma_dcpa) == pytest.approx(float(sigma_at_cpa(PAPER_NOISE, 20.0)[0]))
    two = algorithm_2(PAPER_COLLISION, *pair, noise=replace(PAPER_NOISE, noisy_aircraft=2))
    assert two.sigma_dcpa == pytest.approx(careful.sigma_dcpa * math.sqrt(2))
    printed = algorithm_2(PAPER_COLLISION, *pair, variant="printed")
    assert printed.sigma_dcpa == pytest.approx(float(sigma_at_cpa(PAPER_NOISE, 20.0, printed=True)[0]))


def test_track_sigma_is_the_projected_covariance() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(9, 9)), rng.normal(size=(6, 6))
    track, own = a @ a.T * 30, b @ b.T * 5
    s, v = np.array([1500.0, 250.0, 20.0]), np.array([-60.0, 10.0, -1.0])
    result = algorithm_2(PAPER_COLLISION, ZERO, ZERO, s, v, intruder_covariance=track, own_covariance=own)
    p = relative_position_covariance(track, float(result.t_cpa), own)
    normal = np.array([-v[1], v[0]]) / np.hypot(v[0], v[1])
    assert float(result.sigma_dcpa) == pytest.approx(math.sqrt(normal @ p[:2, :2] @ normal))
    assert float(result.sigma_hcpa) == pytest.approx(math.sqrt(p[2, 2]))
    # The projection itself against drawn states, 4 sigma of the sample variance (2 / n): false failure below 1e-4.
    n = 20_000
    states = rng.multivariate_normal(np.zeros(9), track, size=n)
    owns = rng.multivariate_normal(np.zeros(6), own, size=n)
    t = float(result.t_cpa)
    drawn = ((states[:, :2] + states[:, 3:5] * t) - (owns[:, :2] + owns[:, 3:5] * t)) @ normal
    assert float(np.var(drawn)) == pytest.approx(float(result.sigma_dcpa) ** 2, rel=4 * math.sqrt(2 / n))


def test_many_tracks_at_once_equal_one_by_one() -> None:
    rng = np.random.default_rng(8)
    p, v = rng.normal(size=(30, 3)) * [1500, 1500, 60], rng.normal(size=(30, 3)) * [50, 50, 2]
    c = np.array([a @ a.T for a in rng.normal(size=(30, 9, 9)) * 5])
    many = algorithm_2(PAPER_COLLISION, ZERO, [41, 0, 0], p, v, intruder_covariance=c)
    assert 0 < many.detected.sum() < 30
    for i in range(30):
        one = algorithm_2(PAPER_COLLISION, ZERO, [41, 0, 0], p[i], v[i], intruder_covariance=c[i])
        assert one.detected == many.detected[i]
        for name in ("t_detected", "t_cpa", "d_cpa", "h_cpa", "sigma_dcpa", "sigma_hcpa"):
            np.testing.assert_array_equal(getattr(one, name), getattr(many, name)[i])


@pytest.mark.parametrize("bad", [{"d_th": -1.0}, {"lookahead": math.inf}, {"m1": math.nan}, {"heights": "quarter"}])
def test_bad_rules_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="detection rules"):
        replace(PAPER_COLLISION, **bad)  # type: ignore[arg-type]


def test_bad_arguments_are_refused() -> None:
    pair = (ZERO, ZERO, np.ones((2, 3)), ZERO)
    with pytest.raises(ValueError, match="variant"):
        algorithm_1(PAPER_COLLISION, *pair, variant="other")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="intruder_covariance has 3 rows"):
        algorithm_2(PAPER_COLLISION, *pair, intruder_covariance=np.zeros((3, 9, 9)))
    with pytest.raises(ValueError, match="intruder_covariance must have shape"):
        algorithm_2(PAPER_COLLISION, *pair, intruder_covariance=np.zeros((6, 6)))
    with pytest.raises(ValueError, match="own_covariance must have shape"):
        algorithm_2(PAPER_COLLISION, *pair, intruder_covariance=np.zeros((9, 9)), own_covariance=np.zeros((9, 9)))
    with pytest.raises(ValueError, match="noisy_aircraft"):
        ConstantNoise(1.0, 1.0, 1.0, 1.0, 3)
