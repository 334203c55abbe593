"""Sweeps of any arguments: no point without an answer or a reason."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.analysis.detection_range import METHODS
from wideberth.analysis.range_samples import sample
from wideberth.units import DEGREE

ARGUMENTS = st.fixed_dictionaries(
    {
        "intruder_speed": st.floats(-10.0, 200.0),
        "safety_radius": st.floats(0.0, 1500.0),
        "max_bank": st.floats(-5 * DEGREE, 95 * DEGREE),
        "computation_time": st.floats(0.0, 30.0),
        "turn_angle": st.floats(-5 * DEGREE, 185 * DEGREE),
        "max_bank_rate": st.floats(5 * DEGREE, 120 * DEGREE),
        "roll_time_constant": st.floats(0.0, 1.5),
    }
)
SPEEDS = st.lists(st.floats(-20.0, 250.0), min_size=1, max_size=12, unique=True)


@settings(max_examples=60)
@given(speeds=SPEEDS, fixed=ARGUMENTS)
def test_every_point_has_an_answer_or_one_reason(speeds, fixed):
    x = np.sort(np.array(speeds))
    found = sample(tuple(METHODS), x, {"ownship_speed": x}, fixed)
    for samples in found.values():
        for quantity, values in samples.values.items():
            reasons = np.zeros(len(x), int)
            for gap in samples.gaps:
                if quantity in gap.missing:
                    assert gap.reason
                    at = (x >= gap.first) & (x <= gap.last)
                    assert gap.count == at.sum()
                    reasons += at
            np.testing.assert_array_equal(reasons, np.isnan(values).astype(int))
        for change in samples.changes:
            assert x[0] <= change.x <= x[-1]


@settings(max_examples=40)
@given(speeds=st.lists(st.floats(2.0, 200.0), min_size=2, max_size=8, unique=True), fixed=ARGUMENTS)
def test_a_part_of_a_sweep_is_the_sweep_of_the_part(speeds, fixed):
    x = np.sort(np.array(speeds))
    whole = sample(("gvv", "gt"), x, {"ownship_speed": x}, fixed)
    part = sample(("gvv", "gt"), x[1:], {"ownship_speed": x[1:]}, fixed)
    for method, samples in part.items():
        for quantity, values in samples.values.items():
            np.testing.assert_array_equal(values, whole[method].values[quantity][1:])
