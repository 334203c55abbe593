"""The vertical controllers with cylinders, sides and margins, and the flight ahead, against their naive twins."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.naive import cas as naive_cas
from tests.naive import vertical as naive
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas.config import CasConfig
from wideberth.avoidance.cas.settings import settings
from wideberth.avoidance.vertical import vertical_kernels as vk

states = st.tuples(
    *[st.floats(-60, 60)] * 2, st.floats(-12, 12), *[st.floats(-6, 6)] * 2, st.sampled_from([-1.0, 0.0, 0.3])
).map(lambda x: np.round(x, 3))
CYLINDER: dict[str, Any] = {"separation_m": 10.0, "half_height_m": 4.0, "margin_m": 0.0, "margin_growth_mps": 0.0}
HEAD_ON = np.array([60.0, 0, -100, -2, 0, 0])


def view(x: Any, **columns: float) -> Any:
    row = np.zeros(multi.N_VIEW)
    row[:6], row[multi.V_WANTED] = x, x[2]
    for name, value in columns.items():
        row[getattr(multi, name)] = value
    return row


@given(states, states)
def test_closest_pass_of_a_cylinder(own: Any, other: Any) -> None:
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    assume(np.linalg.norm(v) > 0.2)
    t, miss = pair.closest_pass(p[0], p[1], p[2], v[0], v[1], v[2], 10.0, 4.0)
    assert miss == pytest.approx(naive.cylinder_pass(p, v, 10.0, 4.0), abs=0.05)
    assert miss == pytest.approx(max(np.hypot(*(p + v * t)[:2]), 2.5 * abs((p + v * t)[2])))
    sphere = pair.closest_pass(p[0], p[1], p[2], v[0], v[1], v[2], 10.0, 0.0)
    assert sphere == pair.closest_point(p[0], p[1], p[2], v[0], v[1], v[2])


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@given(states)
def test_a_pair_passes_a_cylinder_on_the_side_asked_for(controller: Any, side: float, other: Any) -> None:
    """Fast enough and early enough, the command keeps the cylinder clear."""
    config = CasConfig(
        controller=controller, **CYLINDER, climb_rate_max_mps=50, sink_rate_max_mps=50, lag_s=0.01, altitude_min_m=-1e3
    )
    p = settings(config)
    p[pair.P_SIDE] = side
    own = np.array([0.0, 0, 0, 2, 0, 0])
    r, v = own[:3] - other[:3], own[3:] - other[3:]
    level = np.hypot(*r[:2])
    closing = -(r[:2] @ v[:2])
    assume(level > 14.0 and closing > 0.5 * level and abs(naive.cylinder_pass(r, v, 10.0, 4.0) - 10.0) > 0.1)
    reasons, commands, out = np.array([0]), np.zeros(1), np.empty((1, 2))
    pair.decide_pairs(own[None], other[None], np.zeros(1), np.ones(1), p, reasons, commands, out)
    conflict = naive.cylinder_pass(r, v, 10.0, 4.0) < 10.0
    if controller == "bang_bang":
        assert reasons[0] == pair.NO_REASON or commands[0] == 50.0 * side
        return
    if conflict:
        assert reasons[0] == pair.CURRENT
        v[2] = commands[0] - other[5]
        assert naive.cylinder_pass(r, v, 10.0, 4.0) == pytest.approx(10.0, abs=0.1)
        assert (r[2] + v[2] * naive_cas.closest(r[:2], v[:2])[0]) * side > 0.0


def test_bang_bang_returns_on_its_own_side_only() -> None:
    """A descent that passes below is no return for one that is to pass above."""
    config = CasConfig(controller="bang_bang", **CYLINDER, altitude_min_m=0.0, guidance_gain_per_s=1.0)
    own, other = np.array([0.0, 0, -101, 2, 0, -0.5]), np.array([80.0, 0, -102, -2, 0, 0])
    for side, expected in ((0.0, pair.NO_REASON), (-1.0, pair.HELD)):
        p = settings(config)
        p[pair.P_SIDE], p[pair.P_COOPERATES], p[pair.P_RETURN_DOWN] = side, 0.0, 2.0
        reasons, commands = np.array([pair.CURRENT]), np.array([p[pair.P_UP]])
        pair.decide_pairs(own[None], other[None], np.array([-50.0]), np.ones(1), p, reasons, commands, np.empty((1, 2)))
        assert reasons[0] == expected


def interval(p: Any, guidance: float = 0.0, **columns: float) -> Any:
    own = np.array([0.0, 0, -100, 2, 0, 0])
    views = view(HEAD_ON, **columns)[None]
    return multi.interval_rate(own, -1, -100.0, guidance, False, views, np.ones(1), p, np.empty((1, 3)))


def test_interval_takes_the_side_and_the_margin_of_a_view() -> None:
    p = settings(CasConfig(**CYLINDER))
    up = interval(p)[1]
    assert up < 0.0 < interval(p, V_SIDE=1.0)[1]
    assert interval(p, V_SIDE=-1.0)[1] == up
    # 4 m until the circle is entered after (60 - 10) / 4 s; with 2 m of margin 6 m in (60 - 12) / 4 s.
    assert (up, interval(p, V_MARGIN=2.0)[1]) == pytest.approx((-4 / 12.5, -6 / 12.0))


def test_interval_can_be_disabled_and_forced() -> None:
    p = settings(CasConfig(**CYLINDER, disable=True))
    assert interval(p) == (pair.NO_REASON, 0.0, -1)
    free = settings(CasConfig(**CYLINDER))
    forced = settings(CasConfig(**CYLINDER, force=True))
    assert interval(free, guidance=-0.6)[0] == pair.NO_REASON
    # Forced it goes to the tangent that it need not fly.
    assert interval(forced, guidance=-0.6) == (pair.FORCED, pytest.approx(-4 / 12.5), 0)
    assert interval(forced)[0] == pair.CURRENT


def test_nobody_climbs_above_the_ceiling() -> None:
    p = settings(CasConfig(**CYLINDER, altitude_max_m=99.0))
    assert interval(p)[1] == pytest.approx(0.0, abs=1e-6)
    for controller, expected in (("continuous", 0.0), ("bang_bang", 0.0)):
        p = settings(CasConfig(controller=controller, **CYLINDER, altitude_max_m=99.0))
        reasons, commands, own = np.array([0]), np.zeros(1), np.array([20.0, 0, -100, 2, 0, 0])
        pair.decide_pairs(
            own[None], HEAD_ON[None], np.array([-100.0]), np.ones(1), p, reasons, commands, np.empty((1, 2))
        )
        assert commands[0] == expected


@given(states, states)
def test_time_to_entry(own: Any, other: Any) -> None:
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    t = vk.time_to_entry(own, view(other), 10.0)
    miss = naive_cas.closest(p[:2], v[:2])[1]
    assume((abs(miss - 10.0) > 0.05 and np.hypot(*v[:2]) > 0.3 and t < 190) or math.isinf(t))
    assume(np.hypot(*v[:2]) > 0.3 and abs(miss - 10.0) > 0.05)
    assert t == pytest.approx(naive.entry(p, v, 10.0), abs=2e-3)


@given(states, st.floats(-4, 4))
def test_the_flight_ahead_is_flown_as_by_the_naive_twin(other: Any, height: float) -> None:
    config = CasConfig(
        controller="continuous", separation_m=8.0, margin_m=0.0, margin_growth_mps=0.0, other_cooperates=False,
        climb_rate_max_mps=2.0, sink_rate_max_mps=2.0, return_climb_rate_max_mps=2.0, return_sink_rate_max_mps=2.0,
        altitude_min_m=-1e3,
    )  # fmt: skip
    n, dt = 40, 0.25
    places = np.zeros((n, vk.N_PLACE))
    places[:, vk.NORTH], places[:, vk.V_NORTH] = 2.0 * dt * np.arange(n), 2.0
    start = np.array([0.0, 0, round(height, 2), 2, 0, 0])
    out = np.empty((n, vk.N_AHEAD))
    views = view(other)[None]
    p = settings(config)
    vk.fly_ahead(start, places, False, 0.0, -1, False, False, views, np.ones(1), p, 1e3, dt, 1e3, out)
    expected = naive.fly_ahead(start, places, other, dt, config)
    # Until a hair decides differently.
    off = np.flatnonzero(np.abs(out[:, vk.DOWN] - expected[:, 0]) > 1e-6)
    assert len(off) == 0 or (off[0] > 0 and abs(out[off[0] - 1, vk.COMMAND]) <= 2.0 and off[0] > n // 8)
    assert (views[0, :6] == other).all()
    own = np.column_stack([places[:, :2], out[:, vk.DOWN]])
    least = np.empty(1)
    inside, entry = vk.pass_by(places, np.ascontiguousarray(own[:, 2]), views, np.ones(1), 8.0, 3.0, dt, least)
    seconds, miss = naive.passed(own, other[None], 8.0, 3.0, dt)
    assert inside == pytest.approx(seconds) and least[0] == pytest.approx(miss[0])
    assert math.isinf(entry) == (seconds == 0.0)


def test_bang_bang_levels_off_where_that_passes_everybody() -> None:
    config = CasConfig(controller="bang_bang", **CYLINDER, other_cooperates=False)
    n, out = 160, np.empty((160, vk.N_AHEAD))
    places = np.zeros((n, vk.N_PLACE))
    places[:, vk.NORTH], places[:, vk.V_NORTH], places[:, vk.WANTED] = 0.5 * np.arange(n), 2.0, -100.0
    start, views = np.array([0.0, 0, -100, 2, 0, 0]), view(HEAD_ON, V_SIDE=-1.0)[None]
    highest = {}
    for level_off in (True, False):
        p = settings(config)
        vk.fly_ahead(start, places, False, 0.0, -1, True, level_off, views, np.ones(1), p, 1e3, 0.25, 10.0, out)
        inside, _ = vk.pass_by(places, out[:, vk.DOWN].copy(), views, np.ones(1), 10.0, 3.9, 0.25, np.empty(1))
        assert inside == 0.0
        highest[level_off] = -out[:, vk.DOWN].min()
    assert 104.0 <= highest[True] < 104.6 < highest[False]
