"""Figures 2.7 to 2.12 as sweeps: what is swept, what stays fixed, and where each number comes from."""

import math
import os

import numpy as np
import pytest

from tests.naive import detection_range as naive
from wideberth.analysis.cpa_simulation import relative_range, simulate_cpa
from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, minimum_detection_range
from wideberth.analysis.range_sweep import words
from wideberth.analysis.thesis_claims import claims
from wideberth.analysis.thesis_figures import FIGURES, sweep
from wideberth.units import DEGREE, FOOT, KNOT, NAUTICAL_MILE

# The kernels are compared with their twins elsewhere; here they only draw.
pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="ten figures take minutes without the compiler"
)

FLOWN = {name: value for name, value in COLLISION_AVOIDANCE.items() if name != "safety_radius"}
POINTS = 21
AGAINST_SPEED = ["2.7", "2.9", "2.10", "2.11"]


def panel(numbers, letter):
    return next(p for p in numbers.panels if p.letter == letter)


def curve(numbers, letter, method, level=None):
    found = [
        c
        for c in panel(numbers, letter).curves
        if c.method == method and (c.nominal if level is None else c.level == level)
    ]
    assert len(found) == 1
    return found[0]


def test_there_is_a_sweep_for_each_figure():
    assert list(FIGURES) == ["2.7", "2.8", "2.9", "2.10", "2.11", "2.12", "pilot-delay"]


@pytest.mark.parametrize("name", list(FIGURES))
def test_every_point_has_an_answer_or_a_reason(name):
    numbers = sweep(name, points=POINTS)
    for p in numbers.panels:
        for c in p.curves:
            shown = c.values[p.y]
            assert len(c.x) == len(shown) == POINTS
            missing = np.zeros(POINTS, bool)
            for gap in c.gaps:
                if p.y in gap.missing:
                    missing |= (c.x >= gap.first) & (c.x <= gap.last)
            np.testing.assert_array_equal(np.isnan(shown), missing)


@pytest.mark.parametrize("name", list(FIGURES))
def test_every_input_has_words_si_and_a_source(name):
    inputs = sweep(name, points=POINTS).inputs
    assert len({(i.panels, i.name) for i in inputs}) == len(inputs)
    for item in inputs:
        assert item.words and item.si and item.si_unit and item.source
    names = {item.name for item in inputs}
    assert {"safety radius", "max bank", "computation time", "turn angle", "max bank rate"} <= names
    assert any(name.startswith("swept: ") for name in names)


@pytest.mark.parametrize("name", AGAINST_SPEED)
def test_one_level_of_each_panel_is_that_of_table_2_3(name):
    numbers = sweep(name, points=POINTS)
    assert [p.letter for p in numbers.panels] == list("abcdef")
    exact = minimum_detection_range(method="gvv", ownship_speed=100 * KNOT, **COLLISION_AVOIDANCE)
    for p in numbers.panels[1:]:
        assert p.x == "ownship_speed"
        common = curve(numbers, p.letter, "gvv")
        at = int(np.argmin(np.abs(common.x - 100 * KNOT)))
        assert common.values["distance"][at] == pytest.approx(exact.distance, rel=1e-12)
        assert len({c.level for c in p.curves}) == 3


def test_levels_are_multiples_of_what_is_given():
    numbers = sweep("2.7", {"safety_radius": 300 * FOOT, "intruder_speed": 100 * KNOT}, points=POINTS)
    assert numbers.changed
    assert [c.level for c in panel(numbers, "c").curves if c.method == "gt"] == ["150 ft", "300 ft", "600 ft"]
    assert [c.level for c in panel(numbers, "b").curves if c.method == "gt"] == ["0 kt", "100 kt", "200 kt"]
    assert curve(numbers, "f", "tt").arguments["safety_radius"] == 300 * FOOT
    sources = {item.name: item.source for item in numbers.inputs}
    assert sources["safety radius"] == sources["intruder speed"] == "given"
    assert sources["max bank"] == "table 2.3"
    assert claims(numbers) == []


def test_a_level_out_of_its_range_is_a_gap_of_its_own():
    numbers = sweep("2.7", {"max_bank": 60 * DEGREE}, start=10 * KNOT, points=POINTS)
    assert {(p.letter, c.level) for p, c, _ in numbers.gaps} == {("d", "90 deg")}
    assert {gap.count for _, _, gap in numbers.gaps} == {POINTS}


def test_equal_levels_are_drawn_once():
    numbers = sweep("2.7", {"intruder_speed": 0.0}, points=POINTS)
    assert len(panel(numbers, "b").curves) == 4


def test_2_8_is_the_flown_encounter():
    numbers = sweep("2.8", points=2501)
    for c in numbers.panels[0].curves:
        values, (mark,) = c.values["range"], c.marks
        distance = minimum_detection_range(method=c.method, ownship_speed=25 * KNOT, **COLLISION_AVOIDANCE).distance
        assert values[0] == pytest.approx(distance, rel=1e-12)
        assert values.min() == pytest.approx(mark.y, abs=0.02)
        assert c.x[values.argmin()] == pytest.approx(mark.x, abs=0.011)
        reached = simulate_cpa(distance, ownship_speed=25 * KNOT, **FLOWN)
        assert (mark.x, mark.y) == (reached.t_cpa, reached.cpa)
    assert c.x[-1] == 25.0


def test_2_8_where_two_methods_have_no_answer():
    numbers = sweep("2.8", {"turn_angle": math.pi}, points=POINTS)
    assert {c.method for _, c, _ in numbers.gaps} == {"tgvv", "gvv"}
    assert all(np.isfinite(c.values["range"]).all() for c in numbers.panels[0].curves if c.method in ("tt", "gt"))


@pytest.mark.parametrize("turn_angle", [90 * DEGREE, 20 * DEGREE])
def test_relative_range_against_integration_in_small_steps(turn_angle):
    v_o, v_i, wait, distance = 15.0, 70.0, 4.0, 1400.0
    bank, rate, tau = 25 * DEGREE, 30 * DEGREE, 0.4
    times, positions = naive.turn(v_o, turn_angle, bank, rate, tau, 20.0)
    times, positions = naive.after_waiting(times, positions, v_o, wait)
    picked = slice(None, None, 97)
    found = relative_range(
        times[picked], distance, ownship_speed=v_o, intruder_speed=v_i, max_bank=bank, computation_time=wait,
        turn_angle=turn_angle, max_bank_rate=rate, roll_time_constant=tau,
    )  # fmt: skip
    expected = np.hypot(distance - v_i * times - positions[:, 0], positions[:, 1])[picked]
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_relative_range_refuses_by_name():
    with pytest.raises(ValueError, match="times"):
        relative_range([-1.0], 100.0, ownship_speed=10.0, **FLOWN)
    with pytest.raises(ValueError, match="ownship_speed"):
        relative_range([1.0], 100.0, ownship_speed=0.0, **FLOWN)


def test_2_10_a_is_against_the_inverse_of_the_bank_rate_at_150_kt():
    first = panel(sweep("2.10", points=POINTS), "a")
    assert first.x == "inverse_bank_rate"
    assert {c.level for c in first.curves} == {"0 s", "0.25 s", "0.5 s", "0.75 s", "1 s"}
    for c in first.curves:
        assert c.arguments["ownship_speed"] == 150 * KNOT
        assert math.isinf(c.swept["max_bank_rate"][0])
        assert c.swept["max_bank_rate"][-1] == pytest.approx(30 * DEGREE)
    other = panel(sweep("2.10", {"ownship_speed": 60 * KNOT}, points=POINTS), "a")
    assert other.title == "roll dynamics at 60 kt, levels of τ"
    assert other.curves[0].arguments["ownship_speed"] == 60 * KNOT


def test_2_12_is_self_separation():
    numbers = sweep("2.12", points=POINTS)
    for p in numbers.panels:
        assert p.length_unit == "nmi"
        assert [c.level for c in p.curves if c.method == "gt"] == ["250 kt", "500 kt", "750 kt", "1000 kt", "1250 kt"]
    assert numbers.panels[0].curves[0].x[-1] == pytest.approx(1250 * KNOT)
    sources = {item.name: (item.words, item.source) for item in numbers.inputs}
    assert sources["safety radius"] == ("R_s = 0.75 nmi", "section 2.2, on figure 2.12")
    assert {c.level for c in sweep("2.12", {"intruder_speed": 90 * KNOT}, points=POINTS).panels[0].curves} == {"90 kt"}


def test_each_second_of_a_pilots_delay_costs_the_closing_speed():
    numbers = sweep("pilot-delay", points=31)
    for p in numbers.panels:
        for c in p.curves:
            closing = c.arguments["ownship_speed"] + c.arguments["intruder_speed"]
            np.testing.assert_allclose(np.diff(c.values["distance"]), closing * np.diff(c.x), rtol=1e-9)
    # 15 s of delay after 5 s are the 20 s of figure 2.12.
    own = sweep("2.12", start=0.0, stop=250 * KNOT, points=2)
    at_20 = curve(own, "a", "tgvv", "750 kt").values["distance"][-1]
    assert curve(numbers, "b", "tgvv").values["distance"][15] == pytest.approx(at_20, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "given", "interval", "says"),
    [
        ("2.13", {}, {}, "there is no sweep '2.13'"),
        ("2.7", {"ownship_speed": 10.0}, {}, "ownship_speed is what 2.7 sweeps"),
        ("2.7", {"max_bank": 2.0}, {}, "max_bank must be"),
        ("2.7", {"slack": 0.1}, {}, "slack is no argument"),
        ("2.7", {}, {"start": 60.0, "stop": 10.0}, "is empty"),
        ("2.7", {}, {"start": math.nan}, "is empty"),
        ("2.7", {}, {"start": -10.0, "stop": 0.0}, "no method has an answer anywhere: ownship_speed"),
        ("2.8", {}, {"start": -1.0}, "time must be"),
        ("2.7", {}, {"points": 1}, "points"),
    ],
)
def test_refusals(name, given, interval, says):
    with pytest.raises(ValueError, match=says):
        sweep(name, given, **{"points": POINTS, **interval})


def test_words():
    assert words("max_bank_rate", 30 * DEGREE) == "30 deg/s"
    assert words("max_bank_rate", math.inf) == "∞ deg/s"
    assert words("safety_radius", 0.75 * NAUTICAL_MILE, "nmi") == "0.75 nmi"
    assert words("intruder_speed", 150 * KNOT, "nmi") == "150 kt"
