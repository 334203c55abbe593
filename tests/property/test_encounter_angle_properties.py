"""Required ranges at any bearing, for any speeds: against head-on, symmetries, and encounters flown on every course."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, minimum_detection_range, simulate_cpa
from wideberth.analysis.encounter_angle import collision_closing_speed, required_range
from wideberth.analysis.maneuvering_intruder import maneuvering_intruder_range
from wideberth.analysis.speed_change import speed_change_range
from wideberth.analysis.vertical_escape import vertical_escape_range
from wideberth.units import DEGREE, FOOT, KNOT

NOMINAL: dict[str, Any] = {"ownship_speed": 25 * KNOT, **COLLISION_AVOIDANCE}

OWN = {
    "ownship_speed": st.floats(5.0, 80.0),
    "safety_radius": st.floats(50.0, 800.0),
    "max_bank": st.floats(10 * DEGREE, 60 * DEGREE),
    "computation_time": st.floats(0.0, 15.0),
    "turn_angle": st.floats(20 * DEGREE, 120 * DEGREE),
    "max_bank_rate": st.floats(10 * DEGREE, 90 * DEGREE),
    "roll_time_constant": st.floats(0.0, 1.0),
}
ENCOUNTERS = st.fixed_dictionaries({**OWN, "intruder_speed": st.floats(0.0, 120.0)})
BEARINGS = st.floats(-math.pi, math.pi)


@given(ENCOUNTERS)
def test_head_on_collisions_need_the_minimum_detection_range(a: dict[str, Any]) -> None:
    found = required_range(0.0, courses="collision", **a)
    head_on: Any = minimum_detection_range(method="tgvv", **{**a, "turn_angle": a["turn_angle"]}).distance
    # A faster ownship can also overtake; then the slower approach may need more.
    if a["intruder_speed"] > a["ownship_speed"]:
        assert float(found.distance) == pytest.approx(head_on, rel=1e-6)
    else:
        assert float(found.distance) >= head_on * (1 - 1e-6)


def test_nominal_values() -> None:
    for courses in ("entry", "collision"):
        found = required_range(0.0, courses=courses, **NOMINAL)
        assert found.distance / FOOT == pytest.approx(5208.546, abs=0.01)
        assert found.intruder_course == pytest.approx(math.pi)
        assert found.closing_speed == pytest.approx(175 * KNOT)
    assert found.distance.shape == ()


@given(ENCOUNTERS, BEARINGS)
def test_left_mirrors_right_and_the_best_is_no_worse_than_either(a: dict[str, Any], bearing: float) -> None:
    best, right, left = (required_range(bearing, turn=side, **a).distance for side in ("best", "right", "left"))
    assert float(left) == pytest.approx(float(required_range(-bearing, turn="right", **a).distance), rel=2e-3)
    assert best <= min(right, left) * (1 + 2e-3)
    assert float(best) == pytest.approx(float(required_range(-bearing, **a).distance), rel=2e-3)
    # More to choose from cannot need more.
    assert required_range(bearing, turn_fractions=(0.3, 0.6, 1.0), **a).distance <= best * (1 + 2e-3)


@given(ENCOUNTERS, BEARINGS)
def test_collision_courses_are_among_those_that_enter(a: dict[str, Any], bearing: float) -> None:
    through_centre = required_range(bearing, courses="collision", **a)
    assert through_centre.distance <= required_range(bearing, **a).distance * (1 + 1e-9)
    closing = collision_closing_speed(bearing, a["ownship_speed"], a["intruder_speed"])
    if closing > 1e-6:
        assert through_centre.closing_speed <= closing * (1 + 1e-9)
        if a["intruder_speed"] > a["ownship_speed"]:
            assert float(through_centre.closing_speed) == pytest.approx(float(closing))
    elif closing == 0:
        assert through_centre.distance == 0 or through_centre.closing_speed < 1e-3


@settings(max_examples=150)
@given(ENCOUNTERS, BEARINGS, st.floats(1.002, 3.0))
def test_every_course_is_safe_from_the_required_range_on(a: dict[str, Any], bearing: float, farther: float) -> None:
    found = required_range(bearing, **a)
    needed = float(found.distance)
    if not math.isfinite(needed):
        return
    radius, flown = a["safety_radius"], {k: v for k, v in a.items() if k != "safety_radius"}
    courses = np.linspace(-math.pi, math.pi, 721)
    start = max(needed * farther, radius * 1.001)
    straight = {**flown, "turn_angle": 1e-9}  # as good as none
    enters = simulate_cpa(start, bearing=bearing, intruder_course=courses, **straight).cpa < radius
    left, right = (
        simulate_cpa(start, bearing=bearing, intruder_course=courses[enters], turn=turn, **flown).cpa
        for turn in ("left", "right")
    )
    assert (np.maximum(left, right) >= radius * (1 - 1e-4)).all()
    # From a little nearer than a turn to one side needs, the worst course enters if it is that turn.
    for turn in ("left", "right"):
        found = required_range(bearing, turn=turn, **a)
        near = float(found.distance) * 0.995
        if found.escape >= 0 and math.isfinite(near) and near > radius:
            entered = simulate_cpa(near, bearing=bearing, intruder_course=found.intruder_course, turn=turn, **flown)
            assert entered.cpa < radius * (1 + 1e-6) or _gap(a, found, bearing, near, turn)


def _gap(a: dict[str, Any], found: Any, bearing: float, near: float, turn: Any) -> bool:
    """Whether the ownship slips past in front at `near` but not at distances between that and the required range."""
    flown = {k: v for k, v in a.items() if k != "safety_radius"}
    needed = float(found.distance)
    between = np.concatenate([np.linspace(near, needed, 50)[:-1], needed * (1.0 - np.logspace(-7, -3, 9))])
    cpa: Any = simulate_cpa(between, bearing=bearing, intruder_course=found.intruder_course, turn=turn, **flown).cpa
    return bool((cpa < a["safety_radius"]).any())


def test_slow_intruders_reach_from_ahead_only() -> None:
    bearings = np.radians(np.arange(0, 181, 5))
    found = required_range(bearings, **{**NOMINAL, "intruder_speed": 10 * KNOT})
    cone = math.asin(10 / 25)
    assert (found.distance[bearings < cone] > 0).all()
    assert (found.distance[bearings > math.pi / 2 + cone] == 0).all()
    assert np.isnan(found.intruder_course[found.distance == 0]).all()
    assert (found.escape[found.distance == 0] == -1).all()
    still = required_range([0.0, 0.5], courses="collision", **{**NOMINAL, "intruder_speed": 0.0})
    assert still.distance[0] > 0 and still.distance[1] == 0


def test_overtaking() -> None:
    found = required_range(math.pi, courses="collision", **NOMINAL)
    assert found.closing_speed == pytest.approx(125 * KNOT)
    assert abs(float(found.intruder_course)) < 1e-9
    head_on = required_range(0.0, **NOMINAL)
    assert 0 < found.distance < head_on.distance


def test_a_turn_onto_the_same_bearing_line_does_not_help() -> None:
    # After 90 degrees to the right an intruder from 45 degrees to the left is on a collision course as before.
    found = required_range(-math.pi / 4, turn="right", courses="collision", **NOMINAL)
    assert math.isinf(found.distance)
    assert math.isfinite(required_range(-math.pi / 4, **NOMINAL).distance)


@given(ENCOUNTERS, BEARINGS, st.floats(-10, 10), st.floats(-10, 10))
def test_wind_moves_both_alike(a: dict[str, Any], bearing: float, tailwind: float, crosswind: float) -> None:
    """An intruder of a speed over ground is, through the air, one of the speed of its worst course."""
    a = {**a, "intruder_speed": a["intruder_speed"] + 40.0, "ownship_speed": min(a["ownship_speed"], 25.0)}
    found = required_range(bearing, courses="collision", tailwind=tailwind, crosswind=crosswind, **a)
    over_ground = a["intruder_speed"] * np.exp(1j * found.intruder_course)
    through_air = over_ground - complex(tailwind, crosswind)
    calm = required_range(bearing, courses="collision", **{**a, "intruder_speed": abs(through_air)})
    if abs(through_air) > a["ownship_speed"]:
        assert float(calm.distance) == pytest.approx(float(found.distance), rel=1e-9)
        assert np.exp(1j * calm.intruder_course) == pytest.approx(through_air / abs(through_air), abs=1e-9)


MULTIROTOR: dict[str, Any] = {
    "ownship_speed": 10.0,
    "intruder_speed": 20.0,
    "safety_radius": 100.0,
    "computation_time": 3.0,
}


@given(st.floats(0.5, 3.0), st.floats(0.0, 1.0))
def test_stopping(acceleration: float, lag: float) -> None:
    bearings = np.radians([0.0, 30.0, 60.0, 90.0, 120.0, 180.0])
    stop = {**MULTIROTOR, "new_speed": 0.0, "acceleration": acceleration, "time_constant": lag}
    found = speed_change_range(bearings, **stop).distance
    assert np.isinf(found[[0, -1]]).all()
    assert np.isfinite(found[1:-1]).all()
    # Stopping sooner asks for less range, abeam.
    assert speed_change_range(bearings[3], **{**stop, "acceleration": 2 * acceleration}).distance <= found[3] * (
        1 + 1e-4
    )
    nothing = speed_change_range(bearings, **{**stop, "new_speed": 10.0})
    assert np.isinf(nothing.distance).all()


def test_stepping_aside_head_on() -> None:
    """Infinitely quick it is a turn on the spot: (2.30) with an instant turn."""
    found = speed_change_range(
        0.0, courses="collision", **MULTIROTOR, new_speed=10.0, acceleration=math.inf, new_course=math.pi / 2
    )
    relative = math.hypot(10.0, 20.0)
    abeam = 100.0 * 20.0 / relative
    expected = 30.0 * 3.0 + 20.0 * abeam / 10.0 + 100.0 * 10.0 / relative
    assert float(found.distance) == pytest.approx(expected, rel=1e-9)


def test_climbing_head_on() -> None:
    """Without lag: the time to gain half of the height, at the closing speed, and the radius."""
    climb: dict[str, Any] = {
        "half_height": 30.0,
        "climb_rate": 3.0,
        "descent_rate": 2.0,
        "vertical_acceleration": math.inf,
    }
    found = vertical_escape_range(0.0, **MULTIROTOR, **climb)
    assert float(found.distance) == pytest.approx(30.0 * (3.0 + 10.0) + 100.0)
    assert found.escape == 0
    down = vertical_escape_range(0.0, **MULTIROTOR, **{**climb, "climb_rate": 0.0})
    assert float(down.distance) == pytest.approx(30.0 * (3.0 + 15.0) + 100.0)
    assert down.escape == 1
    ramp = vertical_escape_range(0.0, **MULTIROTOR, **{**climb, "vertical_acceleration": 1.5})
    assert float(ramp.distance) == pytest.approx(30.0 * (3.0 + 10.0 + 1.0) + 100.0)
    # An intruder that climbs through is below at first: going with it leaves the time until it is above.
    through = vertical_escape_range(0.0, **MULTIROTOR, **climb, intruder_climb_rate=5.0)
    assert float(through.distance) == pytest.approx(30.0 * (3.0 + (30.0 + 5.0 * 100.0 / 30.0) / 3.0) - 100.0)
    assert through.escape == 0
    alike = {**climb, "descent_rate": 3.0}
    assert vertical_escape_range(0.0, **MULTIROTOR, **alike, intruder_climb_rate=-5.0).escape == 1
    neither = vertical_escape_range(0.0, **MULTIROTOR, **{**climb, "climb_rate": 0.0, "descent_rate": 0.0})
    assert math.isinf(neither.distance)
    # A flat volume is cleared sooner by height than by a turn (thesis, 2.1: R_s is generally much larger than h_s).
    assert vertical_escape_range(0.0, **MULTIROTOR, **{**climb, "half_height": 1.0}).distance < 250


LIMITS: dict[str, Any] = {"intruder_turn_angle": 5 * DEGREE, "intruder_turn_rate": 3 * DEGREE}


def test_maneuvering_intruders() -> None:
    bearings = np.radians([0.0, 20.0, 60.0, 120.0, 180.0])
    straight = required_range(bearings, courses="collision", **NOMINAL).distance
    still = maneuvering_intruder_range(bearings, **NOMINAL, **{**LIMITS, "intruder_turn_angle": 0.0})
    np.testing.assert_allclose(still.distance, straight, rtol=1e-6)
    turning = maneuvering_intruder_range(bearings, **NOMINAL, **LIMITS)
    assert (turning.distance > straight).all()
    quicker = maneuvering_intruder_range(
        bearings, **NOMINAL, **LIMITS, intruder_acceleration=1.0, intruder_fastest=200 * KNOT
    )
    assert (quicker.distance > straight).all()
    # 9.6 degrees lead a 150 kt intruder back onto an ownship that flies abeam at 25 kt.
    wide = {**LIMITS, "intruder_turn_angle": 10 * DEGREE}
    assert np.isinf(maneuvering_intruder_range(0.0, **NOMINAL, **wide).distance)
    soon = maneuvering_intruder_range(0.0, **NOMINAL, **wide, horizon=40.0)
    assert straight[0] < soon.distance < math.inf


@pytest.mark.parametrize(
    ("function", "changes", "name"),
    [
        (required_range, {"ownship_speed": 0.0}, "ownship_speed"),
        (required_range, {"turn": "up"}, "turn"),
        (required_range, {"turn_fractions": ()}, "turn_fractions"),
        (required_range, {"turn_fractions": (1.1,)}, "turn_fractions"),
        (required_range, {"courses": "all"}, "courses"),
        (required_range, {"tailwind": math.nan}, "tailwind"),
        (required_range, {"bearing": math.inf}, "bearing"),
        (speed_change_range, {"acceleration": 0.0}, "acceleration"),
        (speed_change_range, {"new_course": 4.0}, "new_course"),
        (speed_change_range, {"turn": "up"}, "turn"),
        (vertical_escape_range, {"half_height": 0.0}, "half_height"),
        (vertical_escape_range, {"climb_rate": -1.0}, "climb_rate"),
        (maneuvering_intruder_range, {"intruder_turn_angle": -0.1}, "intruder_turn_angle"),
        (maneuvering_intruder_range, {"intruder_slowest": 1e3}, "intruder_slowest"),
        (maneuvering_intruder_range, {"intruder_fastest": 1.0}, "intruder_fastest"),
        (maneuvering_intruder_range, {"turn": "up"}, "turn"),
        (maneuvering_intruder_range, {"horizon": 0.0}, "horizon"),
    ],
)
def test_refusals_name_the_argument(function: Any, changes: dict[str, Any], name: str) -> None:
    arguments: dict[Any, dict[str, Any]] = {
        required_range: NOMINAL,
        speed_change_range: {**MULTIROTOR, "new_speed": 0.0, "acceleration": 1.0},
        vertical_escape_range: {
            **MULTIROTOR,
            **{"half_height": 30.0, "climb_rate": 3.0, "descent_rate": 3.0, "vertical_acceleration": 1.0},
        },
        maneuvering_intruder_range: {**NOMINAL, **LIMITS},
    }
    with pytest.raises(ValueError, match=name):
        function(**{"bearing": 0.0, **arguments[function], **changes})
