"""What a sensor protects from: joined ranges against encounters that are flown, and the cures against asking again."""

import math

import numpy as np
import pytest

from wideberth.analysis.cpa_simulation import simulate_cpa
from wideberth.analysis.encounter_angle import required_range
from wideberth.analysis.escapes import escape_range, range_by_escapes
from wideberth.analysis.sensor_reach import adsb_reach, needed_snr_db, radar_reach
from wideberth.analysis.sensor_sizing import protected
from wideberth.analysis.sizing_answer import INTRUDERS, Intruder, intervals, size_sensor
from wideberth.analysis.sizing_config import AdsbSizingConfig, AircraftConfig, GroundRadarConfig
from wideberth.evaluation.sizing_words import answer_text, bearings_text, intruder_text
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import detection_range, scan_detection_probability
from wideberth.units import DEGREE

WING = AircraftConfig()
RADAR = RadarConfig()
FAR_RADAR = RadarConfig(
    boresight_azimuths_deg=(0.0, 120.0, 240.0),
    sweep_time_ms=0.5,
    if_bandwidth_mhz=20.0,
    transmit_power_w=50.0,
    confirm_time_s=0.5,
)


def sized(sensor, aircraft=WING, intruders=INTRUDERS, rcs=1.0):
    return size_sensor(sensor, aircraft, intruders, required_range=range_by_escapes, rcs=rcs)


@pytest.fixture(scope="module")
def default():
    return sized(RADAR)


@pytest.fixture(scope="module")
def far():
    return sized(FAR_RADAR)


def best_cpa(distances, bearing, speed, courses):
    """Closest approach of the better turn, where flying straight would enter, for each distance and course."""
    flown = WING.turn_arguments()
    radius, angle = flown.pop("safety_radius"), flown.pop("turn_angle")
    meet = {"bearing": bearing, "intruder_course": courses, "intruder_speed": speed, **flown}
    d = np.asarray(distances)[:, None]
    straight = np.asarray(simulate_cpa(d, turn_angle=1e-9, **meet).cpa)
    turned = [simulate_cpa(d, turn_angle=angle, turn=turn, **meet).cpa for turn in ("left", "right")]
    return np.where(straight < radius, np.max(turned, axis=0), np.inf)


def cells(answer, which):
    """Bearing, speed, available and required range of some cells, in a fixed random order."""
    found = answer.protection
    rows, columns = np.nonzero(which)
    order = np.random.default_rng(7).permutation(len(rows))[:25]
    for i, k in zip(rows[order], columns[order], strict=True):
        yield found.bearings[i], found.intruder_speeds[k], found.available_range[i, k], found.required_range[i, k]


@pytest.mark.parametrize("name", ["default", "far"])
def test_protected_cells_keep_the_safety_radius(name, request):
    answer = request.getfixturevalue(name)
    found = answer.protection
    seen = 0
    for bearing, speed, available, _ in cells(answer, found.protected & (found.required_range > 0)):
        cpa = best_cpa([available, 1.3 * available], bearing, speed, np.linspace(-math.pi, math.pi, 721))
        assert cpa.min() >= WING.safety_radius_m * (1 - 1e-4)
        seen += 1
    assert seen == 25


@pytest.mark.parametrize("name", ["default", "far"])
def test_just_unprotected_cells_do_not(name, request):
    answer = request.getfixturevalue(name)
    found = answer.protection
    just = ~found.protected & (found.available_range > 0.8 * found.required_range)
    seen = 0
    for bearing, speed, available, required in cells(answer, just):
        # Somewhere between where the track comes and where it would have to, the worst course gets inside.
        worst = required_range(bearing, intruder_speed=speed, **WING.turn_arguments()).intruder_course
        nearest = max(available, WING.safety_radius_m * 1.001)
        cpa = best_cpa(np.linspace(nearest, 0.999 * required, 40), bearing, speed, np.atleast_1d(worst))
        assert cpa.min() < WING.safety_radius_m
        seen += 1
    assert seen >= 3


def test_several_turns_and_a_climb_are_chosen_from():
    bearings, speeds = np.radians([0.0, 75.0, 130.0]), np.array([20.0, 77.2, 150.0])[:, None]
    single = escape_range("turn", bearings, speeds, WING)
    several = escape_range("turn", bearings, speeds, WING.model_copy(update={"turn_fractions": (1 / 3, 2 / 3, 1.0)}))
    assert np.all(several <= single * (1 + 2e-3)) and np.any(several < 0.95 * single)
    both = WING.model_copy(update={"escapes": ("turn", "climb")})
    found = range_by_escapes(bearings, speeds, both)
    np.testing.assert_array_equal(found, np.minimum(single, escape_range("climb", bearings, speeds, WING)))
    assert np.all(np.isinf(escape_range("slow_down", 0.0, [20.0, 60.0], WING)))
    with pytest.raises(ValueError, match="escape must be one of"):
        escape_range("pray", 0.0, 20.0, WING)


def test_one_full_turn_needs_most_abeam():
    ranges = escape_range("turn", np.radians([0.0, 75.0]), 30.0, WING)
    assert ranges[1] > 1.3 * ranges[0]


def test_the_default_radar_ends_early(default):
    assert 15.0 < default.head_on.speed < 18.0 and not default.head_on.at_least
    assert default.field_of_view.speed < default.head_on.speed
    assert default.all_round.speed is None
    slow = default.intruders[0]
    assert np.degrees(slow.protected) == pytest.approx(np.array([[-60.0, 60.0]]))
    assert slow.shortfall_in_view == 0.0 < slow.shortfall == slow.worst_required - slow.worst_available
    assert slow.needed_field_of_view == pytest.approx(280 * DEGREE, abs=4 * DEGREE)
    assert slow.no_threat[0][0] > slow.no_threat[0][1]  # through the tail
    assert default.intruders[-1].protected == ()
    text = answer_text(default)
    assert text.startswith("Protected head-on against intruders up to 16.") and text.endswith("against none.")


def test_the_limits_are_those_of_asking_at_that_speed(default, far):
    for answer, sensor in ((default, RADAR), (far, FAR_RADAR)):
        for limit, bearings in ((answer.head_on, [0.0]), (answer.all_round, answer.map.bearings)):
            if limit.speed is None:
                continue
            speeds = [0.5 * limit.speed, limit.speed, limit.speed + 0.3]
            found = protected(sensor, WING, bearings, speeds, required_range=range_by_escapes)
            np.testing.assert_array_equal(found.protected.all(axis=0), [True, True, False])


def test_cures_cure():
    aircraft = WING.model_copy(update={"turn_fractions": (0.5, 1.0)})
    answer = sized(RADAR, aircraft, (Intruder("a", 10.0), Intruder("b", 10.5), Intruder("c", 100.0)), rcs=0.05)
    in_view = np.abs(answer.protection.bearings) <= 60.1 * DEGREE
    np.testing.assert_array_equal(answer.visible, in_view)
    bearings = answer.protection.bearings[in_view]
    for one in answer.intruders[:2]:
        assert one.shortfall_in_view > 0.0 and one.needed_rcs is not None and one.needed_decision_time is not None
        speed = [one.intruder.speed]

        def safe(rcs=0.05, time=None, speed=speed):
            change = {} if time is None else {"decision_time_s": time}
            flown = aircraft.model_copy(update=change)
            return protected(RADAR, flown, bearings, speed, required_range=range_by_escapes, rcs=rcs).protected.all()

        assert not safe()
        assert safe(rcs=one.needed_rcs) and not safe(rcs=0.97 * one.needed_rcs)
        assert safe(time=one.needed_decision_time) and not safe(time=one.needed_decision_time + 0.01)
    fast = answer.intruders[2]
    assert fast.needed_rcs is None and fast.needed_decision_time is None
    assert fast.needed_range == answer.protection.required_range[in_view, 2].max() <= fast.needed_range_all_round


def test_adsb_sees_them_all():
    answer = sized(AdsbSizingConfig(power_class="A1"), intruders=(Intruder("slow", 15.0), Intruder("jet", 250.0)))
    assert answer.all_round.at_least and answer.all_round.speed == 250.0
    assert answer_text(answer).startswith("Protected from all directions against every intruder up to 250 m/s")
    assert [one.protected for one in answer.intruders] == [((-math.pi, math.pi),)] * 2
    assert answer.intruders[0].needed_rcs is None and answer.intruders[0].needed_decision_time == 5.0
    blind = sized(AdsbSizingConfig(loss_1090=1.0), intruders=(Intruder("slow", 15.0),))
    assert blind.head_on.speed is None and answer_text(blind).startswith("Not protected")


def test_no_range_is_enough():
    rotor = AircraftConfig(speed_min_mps=0.0, escapes=("slow_down",))
    answer = sized(AdsbSizingConfig(), rotor, (Intruder("a", 20.0),))
    one = answer.intruders[0]
    assert math.isinf(one.needed_range) and math.isinf(one.shortfall)
    assert one.worst_bearing == 0.0 and one.needed_decision_time is None


def test_intervals():
    bearings = np.radians(np.arange(-180, 180, 30))
    assert intervals(bearings, np.zeros(12)) == ()
    assert intervals(bearings, np.ones(12)) == ((-math.pi, math.pi),)
    found = intervals(bearings, np.abs(bearings) > 130 * DEGREE)
    assert np.degrees(found) == pytest.approx(np.array([[150.0, -150.0]]))
    mask = np.isin(np.round(np.degrees(bearings)), [-180, -60, -30, 0, 90])
    assert np.degrees(intervals(bearings, mask)) == pytest.approx(np.array([[-180, -180], [-60, 0], [90, 90]]))
    assert bearings_text(intervals(bearings, mask)) == "−180° to −180°, −60° to 0°, 90° to 90°"
    assert bearings_text(()) == "none" and bearings_text(((-math.pi, math.pi),)) == "all"


def test_reach():
    found = radar_reach(RADAR, sections=[0.01, 1.0], closing_speeds=[25.0, 100.0])
    assert found.ranges[-1] == RADAR.range_limit and np.all(np.diff(found.snr, axis=1) < 0)
    np.testing.assert_allclose(found.snr[1] - found.snr[0], 20.0)
    np.testing.assert_allclose(found.detection, detection_range([0.01, 1.0], 0.9, RADAR))
    assert np.all(found.lost > 0) and found.confirmed[0, 1] == 0.0
    # At the ratio that is said to be needed, a scan does detect with that probability.
    at = RADAR.range_limit
    snr = needed_snr_db(RADAR, 0.9)
    rcs = 10 ** ((snr - radar_reach(RADAR, sections=[1.0]).snr[0, -1]) / 10)
    assert scan_detection_probability(at, rcs, 0.0, RADAR) == pytest.approx(0.9, abs=1e-6)
    assert needed_snr_db(RadarConfig(snr_threshold_db=12.0, averages=1, channels=1), 0.9) == 12.0
    classes = adsb_reach(AdsbSizingConfig(), closing_speeds=[50.0])
    assert list(classes) == ["A0", "A1", "A2", "A3"] and classes["A0"][0] == 18_520.0
    assert classes["A3"][1][0] < classes["A3"][0]


def test_names():
    assert intruder_text(Intruder("jet", 150.0)) == "150 m/s: jet"
    assert intruder_text(Intruder("60 kt", 30.8667)) == "30.9 m/s: 60 kt"
    assert intruder_text(Intruder("15m/s", 15.0)) == "15 m/s"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sensor": GroundRadarConfig()}, "use ground_sizing"),
        ({"intruders": ()}, "intruders: give at least one"),
        ({"intruders": (Intruder("back", -1.0),)}, "intruder speeds must be positive"),
        ({"rcs": 0.0}, "rcs must be positive"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(ValueError, match=message):
        sized(**({"sensor": RADAR} | arguments))
    if "sensor" in arguments:
        with pytest.raises(ValueError, match=message):
            protected(arguments["sensor"], WING, [0.0], [20.0], required_range=range_by_escapes)
