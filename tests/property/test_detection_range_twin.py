"""The true range and the flown closest approach against the turn flown in small steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.naive import detection_range as naive
from wideberth.analysis.detection_range import minimum_detection_range, simulate_cpa
from wideberth.units import DEGREE

cases = st.fixed_dictionaries(
    {
        "ownship_speed": st.floats(8.0, 60.0),
        "intruder_speed": st.floats(0.0, 100.0),
        "max_bank": st.floats(15.0, 45.0).map(lambda x: x * DEGREE),
        "computation_time": st.floats(0.0, 10.0),
        "turn_angle": st.floats(20.0, 90.0).map(lambda x: x * DEGREE),
        "max_bank_rate": st.floats(10.0, 60.0).map(lambda x: x * DEGREE),
        "roll_time_constant": st.floats(0.2, 1.5),
    }
)


def flown(case: dict[str, float], distance: float, bearing: float, course: float) -> float:
    """Return the closest approach of the turn flown in small steps."""
    v, wait = case["ownship_speed"], case["computation_time"]
    until = 3.0 * (distance + 500.0) / v
    path = naive.turn(v, case["turn_angle"], case["max_bank"], case["max_bank_rate"], case["roll_time_constant"], until)
    times, positions = naive.after_waiting(*path, v, wait)
    start = distance * np.array([np.cos(bearing), np.sin(bearing)])
    velocity = case["intruder_speed"] * np.array([np.cos(course), np.sin(course)])
    return float(naive.nearest(times, positions, start, velocity)[0])


@settings(max_examples=4)
@given(cases, st.floats(100.0, 400.0))
def test_detection_at_the_true_range_keeps_the_safety_radius(case, radius):
    answer = minimum_detection_range(method="tgvv", safety_radius=radius, **case)
    assert flown(case, float(answer.distance), 0.0, np.pi) == pytest.approx(radius, abs=0.3)


@settings(max_examples=4)
@given(cases, st.floats(300.0, 3000.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_closest_approach_is_that_of_small_steps(case, distance, bearing, course):
    approach = simulate_cpa(distance, bearing=bearing, intruder_course=course, **case)
    assert flown(case, distance, bearing, course) == pytest.approx(float(approach.cpa), abs=0.3)
