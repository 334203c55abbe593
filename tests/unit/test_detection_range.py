"""Minimum detection ranges: printed numbers, domain, messages, shapes."""

import math
from typing import Any

import numpy as np
import pytest

from wideberth.analysis.detection_range import (
    COLLISION_AVOIDANCE,
    METHODS,
    SELF_SEPARATION,
    minimum_detection_range,
    simulate_cpa,
)
from wideberth.analysis.time_line import TimeLine, sensing_range
from wideberth.units import DEGREE, FOOT, KNOT

NOMINAL: dict[str, Any] = {"ownship_speed": 25 * KNOT, **COLLISION_AVOIDANCE}
FLOWN = {name: value for name, value in NOMINAL.items() if name != "safety_radius"}


def nominal(method: Any, **changes: Any) -> Any:
    return minimum_detection_range(method=method, **{**NOMINAL, **changes})


@pytest.mark.parametrize(
    ("method", "distance_ft", "cpa_ft", "t_cpa", "case"),
    [
        ("tgvv", 5208.5, 500.0, 18.878, "A"),
        ("gvv", 4942.2, 456.2, 17.854, 1),
        ("tt", 3643.6, 242.7, 12.864, None),
        ("gt", 2875.1, 116.4, 9.910, None),
    ],
)
def test_figure_2_8(method: str, distance_ft: float, cpa_ft: float, t_cpa: float, case: Any) -> None:
    found = nominal(method)
    assert found.distance / FOOT == pytest.approx(distance_ft, abs=0.05)
    assert found.case == case
    assert isinstance(found.distance, float)
    assert type(found.case) is type(case)
    reached = simulate_cpa(found.distance, **FLOWN)
    assert reached.cpa / FOOT == pytest.approx(cpa_ft, abs=0.05)
    assert reached.t_cpa == pytest.approx(t_cpa, abs=0.0005)


@pytest.mark.parametrize("method", METHODS)
def test_arrays_broadcast_and_equal_single_numbers(method: Any) -> None:
    speeds = np.array([[10.0], [60.0], [120.0]]) * KNOT
    radii = np.array([300.0, 500.0]) * FOOT
    found = nominal(method, ownship_speed=speeds, safety_radius=radii)
    assert found.distance.shape == found.maneuver_time.shape == (3, 2)
    for i in range(3):
        for j in range(2):
            single = nominal(method, ownship_speed=speeds[i, 0], safety_radius=radii[j])
            assert found.distance[i, j] == single.distance
            assert found.maneuver_time[i, j] == single.maneuver_time
            assert single.case is None if found.case is None else found.case[i, j] == single.case
    assert nominal(method, ownship_speed=np.empty(0)).distance.shape == (0,)


BAD = [
    ("ownship_speed", 0.0),
    ("ownship_speed", -1.0),
    ("ownship_speed", math.nan),
    ("ownship_speed", math.inf),
    ("ownship_speed", "fast"),
    ("ownship_speed", [10.0, 0.0]),
    ("intruder_speed", -1.0),
    ("intruder_speed", math.nan),
    ("safety_radius", -1.0),
    ("safety_radius", [100.0, -1e-9]),
    ("max_bank", 0.0),
    ("max_bank", math.pi / 2),
    ("max_bank", [0.5, 2.0]),
    ("computation_time", -0.1),
    ("computation_time", math.nan),
    ("turn_angle", 0.0),
    ("turn_angle", 3.15),
    ("turn_angle", math.nan),
    ("max_bank_rate", 0.0),
    ("max_bank_rate", math.nan),
    ("roll_time_constant", -0.1),
    ("roll_time_constant", math.inf),
    ("slack", -0.1),
]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("name", "value"), BAD)
def test_out_of_the_domain_is_refused_by_name(method: str, name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=name):
        nominal(method, **{name: value})


@pytest.mark.parametrize(("name", "value"), [case for case in BAD if case[0] in FLOWN])
def test_simulation_refuses_the_same(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=name):
        simulate_cpa(1000.0, **{**FLOWN, name: value})


def test_other_refusals() -> None:
    with pytest.raises(ValueError, match="method"):
        nominal("tvv")
    with pytest.raises(ValueError, match="turn_angle is needed"):
        nominal("gvv", turn_angle=None)
    with pytest.raises(ValueError, match="roll_time_constant is needed"):
        nominal("tgvv", roll_time_constant=None)
    with pytest.raises(ValueError, match="ownship_speed \\(2,\\), intruder_speed \\(3,\\)"):
        nominal("tt", ownship_speed=[1.0, 2.0], intruder_speed=[1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="slack"):
        nominal("tgvv", slack=0.1)
    with pytest.raises(ValueError, match="distance"):
        simulate_cpa(-1.0, **FLOWN)
    with pytest.raises(ValueError, match="turn"):
        simulate_cpa(1.0, **FLOWN, turn="up")  # type: ignore[arg-type]


def test_tt_and_gt_need_no_turn() -> None:
    only = {name: NOMINAL[name] for name in ("ownship_speed", "intruder_speed", "safety_radius", "max_bank")}
    methods: list[Any] = ["tt", "gt"]
    for method in methods:
        found = minimum_detection_range(method=method, computation_time=5.0, **only)
        assert found.distance == nominal(method).distance


def test_slack_lengthens_the_range_of_gt() -> None:
    assert nominal("gt", slack=0.25).distance == pytest.approx(1.25 * nominal("gt").distance)


def test_half_turn_needs_to_come_abeam_by_the_radius() -> None:
    for method in ("tgvv", "gvv"):
        with pytest.raises(ValueError, match="turn_angle"):
            nominal(method, turn_angle=math.pi)  # turns within 60 m
        found = nominal(method, turn_angle=math.pi, ownship_speed=100 * KNOT)
        assert found.distance == pytest.approx(nominal(method, ownship_speed=100 * KNOT).distance)
    # Nearly a half turn is abeam by the radius after a long time.
    assert nominal("tgvv", turn_angle=179 * DEGREE).distance > 2e4


@pytest.mark.parametrize("method", METHODS)
def test_ends_of_the_domain(method: str) -> None:
    assert nominal(method, safety_radius=0.0).distance == pytest.approx(175 * KNOT * 5)
    assert 0 < nominal(method, intruder_speed=0.0).distance < nominal(method).distance
    fast = nominal(method, ownship_speed=1e5)
    assert math.isfinite(fast.distance)
    for changes in ({"ownship_speed": 1e-3}, {"turn_angle": 1e-3}, {"max_bank": 89.9 * DEGREE}, {"max_bank": 1e-4}):
        assert nominal(method, **changes).distance > 0


def test_instantaneous_bank_is_gvv() -> None:
    speed = np.linspace(5.0, 300.0, 40) * KNOT
    at_once = nominal("tgvv", ownship_speed=speed, max_bank_rate=math.inf)
    np.testing.assert_allclose(at_once.distance, nominal("gvv", ownship_speed=speed).distance, rtol=1e-9)


def test_no_lag_is_the_limit_of_small_lags() -> None:
    none = nominal("tgvv", roll_time_constant=0.0).distance
    assert nominal("tgvv", roll_time_constant=1e-7).distance == pytest.approx(none, rel=1e-6)


def test_approach_that_ends_before_the_maneuver_begins() -> None:
    reached = simulate_cpa(100.0, **FLOWN)
    assert reached.cpa == pytest.approx(0.0, abs=1e-9)
    assert reached.t_cpa == pytest.approx(100.0 / (175 * KNOT))


def test_simulation_to_the_left_is_the_mirror_image() -> None:
    right = simulate_cpa(1500.0, **FLOWN, bearing=0.3, intruder_course=-2.9)
    left = simulate_cpa(1500.0, **FLOWN, bearing=-0.3, intruder_course=2.9, turn="left")
    assert left == right


def test_time_line() -> None:
    line = TimeLine(tracking=2.0, detection=0.5, planning=0.5, review=np.array([2.0, 17.0]), maneuver=7.0)
    np.testing.assert_allclose(line.computation_time, [5.0, 20.0])
    np.testing.assert_allclose(line.total, [12.0, 27.0])
    np.testing.assert_allclose(sensing_range(100.0, line), [1200.0, 2700.0])
    # The turn-time method is this formula.
    found = nominal("tt")
    assert sensing_range(175 * KNOT, TimeLine(planning=5.0, maneuver=found.maneuver_time)) == pytest.approx(
        found.distance
    )
    with pytest.raises(ValueError, match="review"):
        TimeLine(review=-1.0)
    with pytest.raises(ValueError, match="closing_speed"):
        sensing_range(-1.0, line)


def test_pilot_delay_costs_its_time_at_the_closing_speed() -> None:
    arguments: dict[str, Any] = {**SELF_SEPARATION, "ownship_speed": 200 * KNOT, "intruder_speed": 250 * KNOT}
    del arguments["computation_time"]
    prompt, slow = (
        minimum_detection_range(
            method="tgvv", computation_time=TimeLine(20.0, review=review).computation_time, **arguments
        )
        for review in (0.0, 15.0)
    )
    assert isinstance(slow.distance, float) and isinstance(prompt.distance, float)
    assert slow.distance - prompt.distance == pytest.approx(450 * KNOT * 15.0)
