"""TCAS: tables, tests, senses and strengths, and what goes with them."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.avoidance.cas.complement import DOWN, FREE, UP, ComplementaryManeuver
from wideberth.conflict.tcas.advisories import (
    FIRST_RESPONSE,
    INITIAL,
    LATER_RESPONSE,
    Sense,
    VerticalAdvisory,
    height_gained,
)
from wideberth.conflict.tcas.alerts import Geometry, TcasAlert, altitude_test, geometry, range_test, tcas_alert
from wideberth.conflict.tcas.logic import TcasUnit
from wideberth.conflict.tcas.resolution import choose_sense, choose_strength, separation
from wideberth.conflict.tcas.thresholds import TCAS_I, AlertThresholds, sensitivity_level
from wideberth.units import FOOT, NAUTICAL_MILE

FPM = FOOT / 60


@pytest.mark.parametrize(
    ("feet", "level", "tau", "dmod", "alim"),
    [
        (500, 2, None, None, None),
        (1500, 3, 15, 0.20, 300),
        (2350, 4, 20, 0.35, 300),
        (9999, 5, 25, 0.55, 350),
        (15000, 6, 30, 0.80, 400),
        (30000, 7, 35, 1.1, 600),
        (45000, 7, 35, 1.1, 700),
    ],
)
def test_levels_are_those_of_the_table(
    feet: float, level: int, tau: float | None, dmod: float | None, alim: float | None
) -> None:
    row = sensitivity_level(feet * FOOT)
    assert row.level == level
    if tau is None:
        assert row.ra is None and math.isnan(row.alim)
    else:
        assert row.ra is not None
        assert (row.ra.tau, row.ra.dmod / NAUTICAL_MILE, row.alim / FOOT) == pytest.approx((tau, dmod, alim))


def test_the_height_above_ground_decides_the_lowest_levels() -> None:
    assert sensitivity_level(6000 * FOOT, 900 * FOOT).level == 2
    assert sensitivity_level(6000 * FOOT, 3000 * FOOT).level == 5
    assert sensitivity_level(500 * FOOT, bands=TCAS_I).ta.dmod == pytest.approx(NAUTICAL_MILE)
    assert sensitivity_level(31000 * FOOT, bands=TCAS_I).ta.dmod == pytest.approx(3 * NAUTICAL_MILE)
    with pytest.raises(ValueError, match="finite"):
        sensitivity_level(math.nan)


speeds = st.floats(-200, 200)
places = st.floats(-15000, 15000)


@given(st.tuples(places, places, st.floats(-2000, 2000)), st.tuples(speeds, speeds, st.floats(-20, 20)))
def test_the_geometry_is_that_of_straight_flight(p: tuple[float, ...], v: tuple[float, ...]) -> None:
    g = geometry((0, 0, 0), (0, 0, 0), p, v)
    dt = 1e-4
    later = math.dist((0, 0, 0), np.add(p, np.multiply(v, dt)))
    assert g.slant_range == pytest.approx(math.hypot(*p))
    if g.slant_range > 100.0:
        assert g.range_rate == pytest.approx((later - g.slant_range) / dt, abs=1.0)
    times = np.linspace(0, 600, 6001)
    nearest = np.hypot(p[0] + v[0] * times, p[1] + v[1] * times).min()
    assert g.miss <= nearest + 1e-6
    assert g.height == p[2] and g.height_rate == v[2]


def test_a_range_alerts_when_dmod_is_near_or_not_left_fast_enough() -> None:
    limits = AlertThresholds(25.0, 500.0, 200.0)
    closing = Geometry(5000.0, -200.0, 0.0, 0.0, 0.0)
    # Modified tau: (r^2 - DMOD^2) / (r * closing rate) = 24.75 s.
    assert range_test(closing, limits)
    assert not range_test(Geometry(5100.0, -200.0, 0.0, 0.0, 0.0), limits)
    assert not range_test(Geometry(5000.0, 0.0, 0.0, 0.0, 0.0), limits)
    assert range_test(Geometry(400.0, 10.0, 0.0, 0.0, 0.0), limits)
    assert not range_test(Geometry(400.0, 60.0, 0.0, 0.0, 0.0), limits)


@pytest.mark.parametrize(
    ("height", "rate", "alerts"),
    [
        (100, 0, True),
        (100, 40, False),  # apart at the closest point
        (100, -60, True),  # through the intruder's altitude and out on the other side
        (400, 0, False),
        (400, 30, False),
        (400, -25, True),  # there in time
        (400, -10, False),  # not in time
        (-400, 25, True),
    ],
)
def test_altitudes_alert_when_close_now_or_equal_soon(height: float, rate: float, alerts: bool) -> None:
    limits = AlertThresholds(25.0, 500.0, 200.0)
    assert altitude_test(Geometry(2000.0, -200.0, height, rate, 0.0), limits) is alerts


def test_a_wide_pass_needs_no_resolution() -> None:
    row = sensitivity_level(1500.0)
    near = geometry((0, 0, 0), (50, 0, 0), (2500, row.hmd - 1, 0), (-100, 0, 0))
    wide = geometry((0, 0, 0), (50, 0, 0), (2500, row.hmd + 1, 0), (-100, 0, 0))
    assert tcas_alert(near, row) is TcasAlert.RESOLUTION
    assert tcas_alert(wide, row) is TcasAlert.TRAFFIC
    assert tcas_alert(geometry((0, 0, 0), (50, 0, 0), (-2500, 0, 0), (-100, 0, 0)), row) is TcasAlert.NONE


def test_a_state_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match="three finite"):
        geometry((0, 0, math.nan), (0, 0, 0), (1, 0, 0), (0, 0, 0))


@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(0, 60), st.sampled_from([FIRST_RESPONSE, LATER_RESPONSE]))
def test_the_height_gained_is_the_integral_of_the_response(rate: float, wanted: float, t: float, response) -> None:
    steps = 4000
    dt = t / steps
    gained = 0.0
    for k in range(steps):
        turned = max((k + 0.5) * dt - response.delay, 0.0) * response.acceleration
        now = rate + math.copysign(min(turned, abs(wanted - rate)), wanted - rate)
        gained += now * dt
    assert height_gained(rate, wanted, t, response) == pytest.approx(gained, abs=0.01)


def test_there_are_ten_first_advisories() -> None:
    assert sum(len(advisories) for advisories in INITIAL.values()) == 10
    for advisories in INITIAL.values():
        assert [a.strength for a in advisories] == sorted(a.strength for a in advisories)
    assert VerticalAdvisory.CLIMB.rate == pytest.approx(7.62)
    assert VerticalAdvisory.LIMIT_CLIMB_500.words == "limit climb 500"
    assert VerticalAdvisory.DO_NOT_CLIMB.complied(-3.0) == -3.0
    assert VerticalAdvisory.DO_NOT_CLIMB.complied(3.0) == 0.0


geometries = st.builds(
    Geometry,
    st.floats(500, 8000),
    st.floats(-300, -20),
    st.floats(-300, 300),
    st.floats(-15, 15),
    st.floats(0, 500),
)


@given(geometries, st.floats(-15, 15))
def test_the_weakest_advisory_that_suffices_is_given(g: Geometry, rate: float) -> None:
    alim = 350 * FOOT
    sense = choose_sense(g, rate, alim)
    chosen = choose_strength(g, rate, sense, alim)
    reached = [separation(g, rate, advisory) for advisory in INITIAL[sense]]
    # A stronger one never separates less.
    assert all(b >= a - 1e-9 for a, b in pairwise(reached))
    enough = [a for a, s in zip(INITIAL[sense], reached, strict=True) if s >= alim]
    assert chosen is (enough[0] if enough else INITIAL[sense][-1])
    other = INITIAL[Sense(-sense)][-1]
    crossing = (sense is Sense.UP) == (g.height < 0.0)
    # Its altitude is crossed only where the near side does not suffice and the far side is better.
    if crossing:
        assert separation(g, rate, other) < min(alim, separation(g, rate, INITIAL[sense][-1]))


@given(
    st.floats(-200, 200),
    st.floats(-12, 12),
    st.floats(-12, 12),
    st.floats(60, 250),
    st.integers(0, 3),
    st.booleans(),
)
def test_two_units_never_end_with_the_same_sense(
    height: float, own_rate: float, other_rate: float, closing: float, lag: int, lower_first: bool
) -> None:
    a, b = TcasUnit(1 if lower_first else 2), TcasUnit(2 if lower_first else 1)
    row = sensitivity_level(2000.0)
    said: list[tuple[Sense | None, Sense | None]] = []
    distance, z = closing * 40.0, height
    for k in range(60):
        heard = said[k - 1 - lag] if k > lag else (None, None)
        g = Geometry(max(abs(distance), 1.0), -closing if distance > 0 else closing, z, own_rate - other_rate, 0.0)
        mirrored = Geometry(g.slant_range, g.range_rate, -z, other_rate - own_rate, 0.0)
        a.step(float(k), g, own_rate, row, heard[1], b.address)
        b.step(float(k), mirrored, other_rate, row, heard[0], a.address)
        said.append((a.sense, b.sense))
        both = [pair for pair in said[max(k - 1 - lag, 0) :] if None not in pair]
        # Both may begin alike in the same second; a message later one has turned.
        assert not (len(both) == 2 + lag and all(x is y for x, y in both))
        distance -= closing
        z += own_rate - other_rate


def test_an_advisory_is_strengthened_and_ends_when_the_intruder_has_passed() -> None:
    unit = TcasUnit()
    row = sensitivity_level(2000.0)
    names = []
    z, rate = 160.0, -4.0
    for k in range(60):
        distance = 100.0 * (30 - k)
        g = Geometry(max(abs(distance), 1.0), -100.0 if distance > 0 else 100.0, z, rate, 0.0)
        advisory = unit.step(float(k), g, rate, row)
        names.append(None if advisory is None else advisory.advisory)
        z += rate  # the pilot does not react
    assert names[0] is None and names[-1] is None
    given_ = [n for n in names if n is not None]
    assert len(set(given_)) > 1
    assert unit.resolution_advisories == 1 and unit.alert is TcasAlert.NONE


def test_the_complement_takes_the_side_that_the_advisory_leaves() -> None:
    maneuver = ComplementaryManeuver()
    own = np.array([0.0, 0.0, 0.0, 30.0, 0.0, 0.0])
    ahead = np.array([6000.0, 0.0, 0.0, -100.0, 0.0, 0.0])
    rate, side = maneuver.decide(own, ahead, 0.0, UP)
    assert rate < 0.0 and side == DOWN
    rate, side = maneuver.decide(own, ahead, 0.0, DOWN, held=DOWN)
    assert rate > 0.0 and side == UP
    passed = np.array([-6000.0, 0.0, 0.0, -100.0, 0.0, 0.0])
    assert maneuver.decide(own, passed, 0.5, UP) == (0.5, FREE)
    with pytest.raises(ValueError, match="six finite"):
        maneuver.decide(own, np.full(6, np.nan))


@given(st.floats(-260, 260), st.floats(-4, 4), st.floats(2000, 8000), st.sampled_from([UP, DOWN, FREE]))
def test_the_rate_keeps_the_cylinder_clear_where_the_limits_allow(
    height: float, other_rate: float, distance: float, advised: int
) -> None:
    maneuver = ComplementaryManeuver()
    own = np.array([0.0, 0.0, -height, 30.0, 0.0, 0.0])
    other = np.array([distance, 0.0, 0.0, -100.0, 0.0, -other_rate])
    rate, side = maneuver.decide(own, other, 0.0, advised)
    if side == FREE or abs(rate) >= maneuver.climb_rate_max - 1e-9:
        return
    times = np.linspace(0.0, 120.0, 24001)
    z = height + (rate - other_rate) * times
    inside = (np.abs(distance - 130.0 * times) < maneuver.radius - 1.0) & (np.abs(z) < maneuver.half_height - 1.0)
    assert not inside.any()
