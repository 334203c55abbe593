"""Samples along a sweep: what has no answer leaves a gap with its reason, and cases change where they should."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, METHODS, minimum_detection_range, simulate_cpa
from wideberth.analysis.range_samples import QUANTITIES, Gap, sample
from wideberth.units import DEGREE, GRAVITY, KNOT

NOMINAL = dict(COLLISION_AVOIDANCE)
ALL = tuple(METHODS)


def against_speed(speeds, methods=ALL, **changes):
    x = np.asarray(speeds, np.float64)
    return sample(methods, x, {"ownship_speed": x}, {**NOMINAL, **changes})


@pytest.mark.parametrize("method", ALL)
def test_values_are_those_of_the_single_encounters(method):
    found = against_speed([5.0, 12.0, 60.0])[method]
    assert set(found.values) == set(QUANTITIES)
    assert found.gaps == ()
    for k, speed in enumerate((5.0, 12.0, 60.0)):
        answer = minimum_detection_range(method=method, ownship_speed=speed, **NOMINAL)
        exact = minimum_detection_range(method="tgvv", ownship_speed=speed, **NOMINAL)
        flown = {name: value for name, value in NOMINAL.items() if name != "safety_radius"}
        reached = simulate_cpa(answer.distance, ownship_speed=speed, **flown)
        assert found.values["distance"][k] == answer.distance
        assert found.values["maneuver_time"][k] == answer.maneuver_time
        assert found.values["cpa"][k] == reached.cpa
        assert found.values["t_cpa"][k] == reached.t_cpa
        assert found.values["error"][k] == pytest.approx(1.0 - answer.distance / exact.distance, abs=1e-15)
        assert found.case[k] == ("" if answer.case is None else str(answer.case))


def test_a_value_out_of_the_domain_is_a_gap_that_says_why():
    found = against_speed([-5.0, -1.0, 0.0, 10.0, 20.0, np.nan, 30.0])
    for method in ALL:
        samples = found[method]
        assert [(g.first, g.last, g.count) for g in samples.gaps[:1]] == [(-5.0, 0.0, 3)]
        assert len(samples.gaps) == 2
        assert math.isnan(samples.gaps[1].first)
        assert all(g.reason == "ownship_speed must be positive (at least 1e-6 m/s) and finite" for g in samples.gaps)
        assert all(g.missing == QUANTITIES for g in samples.gaps)
        for values in samples.values.values():
            np.testing.assert_array_equal(np.isfinite(values), [False, False, False, True, True, False, True])


def test_where_only_tgvv_has_no_answer_only_the_error_is_missing():
    # A half turn at 10 m/s needs less than twice its radius of 18 m; TT and GT ask for no turn.
    found = against_speed([10.0, 60.0], turn_angle=math.pi)
    for method in ("tgvv", "gvv"):
        assert [(g.first, g.missing) for g in found[method].gaps] == [(10.0, QUANTITIES)]
        assert "half turn" in found[method].gaps[0].reason
    for method in ("tt", "gt"):
        samples = found[method]
        assert [g.missing for g in samples.gaps] == [("error",)]
        assert samples.gaps[0].reason.startswith("TGVV has no answer to compare with: turn_angle")
        assert np.isnan(samples.values["error"]).tolist() == [True, False]
        assert np.isfinite(samples.values["distance"]).all()


def test_gaps_for_different_reasons_stay_apart():
    x = np.array([1.0, 2.0, 3.0])
    swept = {"ownship_speed": np.array([-1.0, 10.0, 10.0]), "max_bank": np.array([0.5, 2.0, 0.5])}
    fixed = {name: value for name, value in NOMINAL.items() if name != "max_bank"}
    gaps = sample(("tt",), x, swept, fixed)["tt"].gaps
    assert gaps == (
        Gap(1.0, 1.0, 1, "ownship_speed must be positive (at least 1e-6 m/s) and finite", QUANTITIES),
        Gap(2.0, 2.0, 1, "max_bank must be at least 1e-6 and below pi/2 (rad)", QUANTITIES),
    )


def test_what_is_beyond_all_numbers_is_no_answer():
    found = against_speed([10.0, 1e200])
    reasons = {method: [(g.first, g.count, g.missing) for g in found[method].gaps] for method in ("gt", "tt")}
    assert reasons["gt"] == [(1e200, 1, QUANTITIES)]
    assert reasons["tt"] == [(1e200, 1, ("cpa", "t_cpa")), (1e200, 1, ("error",))]
    assert "beyond all numbers" in found["gt"].gaps[0].reason


def test_with_nothing_to_avoid_the_error_is_zero():
    found = against_speed([10.0], safety_radius=0.0, computation_time=0.0)
    assert all(found[m].values["error"][0] == 0.0 for m in ALL)


def test_gvv_changes_its_case_where_the_turn_ends_abeam_of_the_closest_approach():
    # y_t of (2.24) is y_cpa of (2.30) there; for a right angle the first is the radius of the turn.
    v_i, radius, lateral = NOMINAL["intruder_speed"], NOMINAL["safety_radius"], GRAVITY * math.tan(NOMINAL["max_bank"])
    at = brentq(lambda v: v * v / lateral - radius * v_i / math.hypot(v, v_i), 1.0, 200.0)
    (change,) = against_speed(np.linspace(0.0, 200.0, 41) * KNOT)["gvv"].changes
    assert change.words == "1 to 2"
    assert change.x == pytest.approx(at, abs=2e-4)
    expected = minimum_detection_range(method="gvv", ownship_speed=change.x, **NOMINAL).distance
    assert change.y == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("points", [9, 41, 201])
def test_tgvv_changes_its_case_at_one_place_whatever_the_grid(points):
    (change,) = against_speed(np.linspace(1.0, 200.0, points) * KNOT)["tgvv"].changes
    assert change.words == "B to A"
    assert change.x / KNOT == pytest.approx(11.175, abs=2e-3)
    for part, case in ((0.999, "B"), (1.001, "A")):
        assert minimum_detection_range(method="tgvv", ownship_speed=part * change.x, **NOMINAL).case == case


def test_unknown_method():
    with pytest.raises(ValueError, match="method"):
        against_speed([1.0], methods=("tvv",))


def test_a_swept_angle():
    x = np.array([0.0, 30.0, 60.0, 90.0, 100.0]) * DEGREE
    fixed = {name: value for name, value in NOMINAL.items() if name != "max_bank"} | {"ownship_speed": 20.0}
    found = sample(("gvv",), x, {"max_bank": x}, fixed)["gvv"]
    assert [(g.first, g.last) for g in found.gaps] == [(0.0, 0.0), (x[3], x[4])]
