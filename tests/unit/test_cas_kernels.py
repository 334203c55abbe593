"""The cooperative vertical controllers against their naive twins, and what the source says of them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.naive import cas as naive
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas.config import PRESETS, CasConfig, cas_preset
from wideberth.avoidance.cas.settings import REASONS, PairController, settings
from wideberth.units import FOOT

D = 12 * FOOT
rates = st.sampled_from([-0.6, -0.3, 0.0, 0.2, 0.3])
states = st.tuples(
    st.floats(-40, 40), st.floats(-40, 40), st.sampled_from([-16.0, -15.0, -13.0, -12.0, -1.0]),
    st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), rates,
).map(lambda x: np.round(x, 4))  # fmt: skip
configs = st.fixed_dictionaries(
    {
        "law": st.sampled_from(["full", "shared", "shared_corrected"]),
        "hysteresis_m": st.sampled_from([0.0, 1.2]),
        "t_star_min_s": st.sampled_from([None, 6.0]),
        "tie_break": st.booleans(),
        "other_cooperates": st.booleans(),
        "force": st.booleans(),
        "disable": st.sampled_from([False, False, False, True]),
        "direction_at": st.sampled_from(["closest_point", "rise_time"]),
        "leave_inside": st.booleans(),
        "return_time_max_s": st.sampled_from([None, 7.0]),
    }
)


def decided(config: CasConfig, own: Any, other: Any, wanted: float, before: int, rate: float, first: bool) -> Any:
    reasons, commands, out = np.array([before]), np.array([rate]), np.empty((1, 2))
    pair.decide_pairs(
        own[None], other[None], np.array([wanted]), np.array([float(first)]), settings(config), reasons, commands, out
    )
    return REASONS[reasons[0]], commands[0], out[0]


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@given(states, states, st.sampled_from([-16.0, -14.0]), st.booleans(), st.booleans(), configs)
def test_decides_as_the_naive_twin(
    controller: str, own: Any, other: Any, wanted: float, avoiding: bool, first: bool, changes: dict[str, Any]
) -> None:
    config = cas_preset("default", controller=controller, **changes)
    d, p, v = config.separation_m + config.margin_m, own[:3] - other[:3], own[3:] - other[3:]
    assume(abs(p @ p - d * d) > 1e-6)
    for edge in (d, d - config.hysteresis_m, d + config.hysteresis_m):
        assume(abs(naive.closest(p, v)[1] - edge) > 1e-6)
    held = config.climb_rate_max_mps if not avoiding else -config.climb_rate_max_mps
    got = decided(config, own, other, wanted, int(avoiding), held, first)
    if controller == "continuous":
        reason, rate = naive.continuous(own, other, wanted, avoiding, first, config)
    else:
        reason, rate = naive.bang_bang(own, other, wanted, avoiding, held, first, config)
    assert got[0] == reason
    assert got[1] == pytest.approx(rate, abs=1e-6)
    assert tuple(got[2]) == pytest.approx(naive.closest(p, v), abs=1e-6)


@given(states, states)
def test_tangent_rates_pass_at_the_separation_on_their_sides(own: Any, other: Any) -> None:
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    v[:2] = -0.05 * p[:2] + 0.1 * v[:2]  # most of them meet
    possible, above, below = pair.tangent_rates(p[0], p[1], p[2], v[0], v[1], D)
    assume(possible and abs(math.hypot(p[0], p[1]) - D) > 1e-3)
    for rate, sign in ((above, -1), (below, 1)):
        w = np.array([v[0], v[1], rate])
        t = -(p @ w) / (w @ w) if w.any() else 0.0
        if t > 1e-3 and np.linalg.norm(p) < 1e3:
            assert np.linalg.norm(p + t * w) == pytest.approx(D, rel=1e-4)
            assert sign * (p + t * w)[2] >= -1e-3 * D


@pytest.mark.parametrize("half", [0.0, 2.0])
@given(states, states, st.sampled_from([-3.0, -1.0, -0.4, -0.1, 0.0, 0.1, 0.4, 1.0, 3.0]))
def test_forbidden_rates_are_those_that_enter_the_zone(half: float, own: Any, other: Any, w: float) -> None:
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    level, now = math.hypot(p[0], p[1]), np.linalg.norm(p)
    assume(abs(now - D) > 0.01 and abs(level - D) > 0.01 and abs(abs(p[2]) - half) > 0.01)
    assume(math.hypot(v[0], v[1]) > 0.3)
    low, high, _ = pair.forbidden_rates(p[0], p[1], p[2], v[0], v[1], D, half)
    for shift in (-0.02, 0.02):  # not where a hair decides
        assume((low < w < high) == (low < w + shift < high))
    thinner, thicker = (
        naive.meets(p, np.array([v[0], v[1], w]), D + e, half + e if half else 0.0) for e in (-0.02, 0.02)
    )
    assume(thinner == thicker)
    assert (low < w < high) == thinner


def test_head_on_at_one_level_is_avoided_and_without_the_tie_break_it_is_not() -> None:
    own, other = np.array([-30.0, 0, -15, 1.5, 0, 0]), np.array([30.0, 0, -15, -1.5, 0, 0])
    for tie_break, expected in ((True, -1.0), (False, 0.0)):
        config = cas_preset("thesis", tie_break=tie_break)
        assert np.sign(decided(config, own, other, -15.0, 0, 0.0, True)[1]) == expected
        assert np.sign(decided(config, other, own, -15.0, 0, 0.0, False)[1]) == -expected


def test_a_hovering_pair_inside_the_sphere_parts_only_with_the_mend() -> None:
    own, other = np.array([1.0, 0, -15, 0, 0, 0]), np.array([0.0, 0, -14, 0, 0, 0])
    assert decided(cas_preset("thesis"), own, other, -15.0, 0, 0.0, True)[0] == "none"
    reason, rate, _ = decided(cas_preset("default", controller="continuous"), own, other, -15.0, 0, 0.0, True)
    assert (reason, rate) == ("inside", -2 * FOOT)


def test_nobody_descends_below_the_lowest_altitude() -> None:
    config = cas_preset("thesis", altitude_min_m=16.0)
    own, other = np.array([-30.0, 0, -15, 1.5, 0, 0]), np.array([30.0, 0, -15.5, -1.5, 0, 0])
    assert decided(config, own, other, -15.0, 0, 0.0, True)[1] == 0.0


@pytest.mark.parametrize(
    ("height", "other_height", "expected"), [(0.0, 0.3, -1), (0.3, 0.0, 1), (0.0, 0.0, -1)], ids=str
)
def test_interval_passes_on_the_side_of_the_altitude_wanted(height: float, other_height: float, expected: int) -> None:
    p = settings(CasConfig())
    views = np.zeros((2, multi.N_VIEW))
    views[1, :8] = [60.0, 0, -15 + other_height, -1.5, 0, 0, -15 + other_height, 0]
    own = np.array([0.0, 0, -15 + height, 1.5, 0, 0])
    reason, rate, by = multi.interval_rate(own, 0, own[2], 0.0, False, views, np.array([0.0, 1.0]), p, np.empty((2, 3)))
    assert (np.sign(rate), by) == (expected, 1)
    assert reason == pair.CURRENT


@given(states, st.lists(states, min_size=1, max_size=4), st.sampled_from([-0.3, 0.0, 0.2]), st.floats(0, 20))
def test_interval_decides_as_the_naive_twin(own: Any, others: Any, guidance: float, lowest: float) -> None:
    config = CasConfig(margin_growth_mps=0.0, altitude_min_m=round(lowest, 1))
    d, n = config.separation_m + config.margin_m, len(others)
    views, use = np.zeros((n + 1, multi.N_VIEW)), np.ones(n + 1)
    number = n // 2
    use[number] = 0.0
    rows = [j for j in range(n + 1) if j != number]
    for j, other in zip(rows, others, strict=True):
        p, v = own[:3] - other[:3], own[3:] - other[3:]
        t, level = naive.closest(p[:2], v[:2])
        assume(abs(p @ p - d * d) > 1e-2 and abs(math.hypot(p[0], p[1]) - d) > 1e-2 and abs(level - d) > 1e-3)
        for z in (4 * p[2], p[2] + v[2] * t):
            assume(abs(abs(z) - 0.75 * d) > 1e-6)
        views[j, :7] = [*other, other[2] + 0.1 * j]
    scratch = np.empty((n + 1, 3))
    _, rate, _ = multi.interval_rate(own, number, own[2], guidance, False, views, use, settings(config), scratch)
    expected = naive.interval(own, number, own[2], guidance, {j: views[j] for j in rows}, config)
    assert rate == pytest.approx(expected, abs=2e-3)


def test_interval_between_two_takes_the_velocity_that_falls_least_short() -> None:
    p = settings(CasConfig(margin_m=0.0))
    views = np.zeros((3, multi.N_VIEW))
    for k, z in ((0, -17.0), (2, -13.0)):
        views[k, :8] = [20.0, 0, z, -1.5, 0, 0, z, 0]
    own, use = np.array([0.0, 0, -15, 1.5, 0, 0]), np.array([1.0, 0.0, 1.0])
    _, rate, _ = multi.interval_rate(own, 1, -15.0, 0.0, False, views, use, p, np.empty((3, 3)))
    assert rate == pytest.approx(0.0, abs=1e-6)  # midway between the one above and the one below


def test_most_critical_is_the_first_to_come_too_close() -> None:
    p = settings(CasConfig())
    views = np.zeros((3, multi.N_VIEW))
    views[:, 0], views[:, 3] = [90.0, 60.0, 20.0], [-1.5, -1.5, 0.5]
    own = np.array([0.0, 0, 0, 1.0, 0, 0])
    assert multi.most_critical(own, views, np.array([1.0, 1, 0]), p) == 1
    assert multi.most_critical(own, views, np.array([1.0, 1, 1]), p) == 1  # 24 s, the others 36 and 40 s
    assert multi.most_critical(own, views, np.array([1.0, 0, 1]), p) == 0
    assert multi.most_critical(own, views, np.array([1.0, 0, 0]), p) == 0
    assert multi.most_critical(own, views, np.zeros(3), p) == -1


def test_a_pair_controller_remembers_and_refuses_what_it_cannot_use() -> None:
    control = PairController(cas_preset("thesis"), first=True)
    decision = control.decide([-30, 0, -15.3, 1.5, 0, 0], [30, 0, -15, -1.5, 0, 0], -15.3)
    assert decision.avoid
    assert decision.reason == "current trajectory"
    assert decision.t_star == pytest.approx(20.0)
    with pytest.raises(ValueError, match=r"own must be \(6,\)"):
        control.decide([0, 0, 0], [0, 0, 0, 0, 0, 0], 0.0)
    with pytest.raises(ValueError, match="finite"):
        control.decide([math.nan, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0], 0.0)
    with pytest.raises(ValueError, match="for fleets"):
        PairController(CasConfig(), first=True)


def test_presets_and_what_does_not_fit() -> None:
    assert {CasConfig(**changes).controller for changes in PRESETS.values()} == {"interval", "continuous"}
    assert cas_preset("thesis").separation_m == pytest.approx(3.6576)
    with pytest.raises(ValueError, match="no preset 'best'"):
        cas_preset("best")
    with pytest.raises(ValueError, match="knows only the sphere"):
        CasConfig(controller="altitudes", half_height_m=3.0)
    with pytest.raises(ValueError, match="above altitude_min_m"):
        CasConfig(altitude_min_m=5.0, altitude_max_m=4.0)
    with pytest.raises(ValueError, match="hysteresis_m"):
        cas_preset("thesis", hysteresis_m=4.0)
