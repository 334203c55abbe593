"""Scores of a run against hand-made flights."""

import json

import numpy as np
import pytest

from tests.made_runs import MISSION, made_steps
from wideberth.conflict.well_clear import PRESETS, WellClearVolume, violation
from wideberth.evaluation.metrics import COLLISION, RunMetrics
from wideberth.evaluation.reversals import ReversalCounter, commanded_signs
from wideberth.simulation.truth import Truth
from wideberth.types import AlertLevel, Maneuver, Ownship, SensorHealth, Snapshot, Threat
from wideberth.units import FOOT

KEYS = {
    "intruders",
    "nmac_count",
    "loss_of_well_clear_count",
    "loss_of_well_clear_by_volume",
    "violation_count",
    "min_horizontal_separation_m",
    "min_vertical_separation_m",
    "alerts",
    "maneuvers",
    "reversals",
    "path_length_m",
    "mission_path_length_m",
    "mission_completed",
    "step_time_ms",
    "seed",
}
COLLISION_VOLUME = WellClearVolume(500 * FOOT, 100 * FOOT)


def fly(offsets, velocities, duration=120.0, dt=0.1, **options):
    """Fly the ownship north at 40 m/s among intruders that start at `offsets`; return the metrics."""
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442", **options)
    ids = tuple(f"{k:06x}" for k in range(len(offsets)))
    for t in np.arange(0, duration, dt):
        metrics.update(
            t,
            np.array([40.0 * t, 0, -500]),
            np.array([40.0, 0, 0]),
            Truth(t, ids, np.array(offsets) + np.array(velocities) * t, np.array(velocities)),
        )
    return metrics


def scores(metrics):
    return metrics.summary(seed=1, mission=MISSION, mission_completed=True)


def test_head_on_through_the_ownship_is_one_nmac_and_one_loss_of_everything():
    s = scores(fly([[9000.0, 50, -510]], [[-60.0, 0, 0]]))
    assert s["nmac_count"] == s["loss_of_well_clear_count"] == s["violation_count"] == s["intruders"] == 1
    assert set(s["loss_of_well_clear_by_volume"]) == set(PRESETS)
    assert all(count == 1 for count in s["loss_of_well_clear_by_volume"].values())
    # The least of the larger ratio: |dv| = 10 m is .33 of 100 ft; d_h reaches 50 m, .33 of 500 ft.
    assert s["min_horizontal_separation_m"] == pytest.approx(50.0, abs=0.6)
    assert s["min_vertical_separation_m"] == pytest.approx(10.0)
    assert s["closest_time_s"] == pytest.approx(90.0, abs=0.11)
    assert s["path_length_m"] == pytest.approx(40 * 119.9)


def test_separations_belong_to_the_worst_instant_not_to_the_least_of_each():
    # Passes overhead at 400 m, then later level beside at 600 m.
    s = scores(fly([[4000.0, 0, -900], [4000.0, 600, -500]], [[0.0, 0, 0], [0.0, 0, 0]]))
    assert s["min_horizontal_separation_m"] == pytest.approx(600.0, abs=1)
    assert s["min_vertical_separation_m"] == pytest.approx(0.0, abs=1e-9)
    assert s["nmac_count"] == 0 and s["intruders"] == 2


def test_of_equally_close_instants_the_nearest_counts():
    # Passing level 20 m above: the vertical ratio is the larger one for several seconds about the CPA.
    s = scores(fly([[6000.0, 10, -520]], [[-40.0, 0, 0]]))
    assert s["min_horizontal_separation_m"] == pytest.approx(10.0, abs=0.7)
    assert s["min_vertical_separation_m"] == pytest.approx(20.0)


def test_a_long_or_repeated_loss_counts_once():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    for t in np.arange(0, 60, 0.1):
        east = 100.0 if int(t) % 2 else 5000.0
        metrics.update(t, np.zeros(3), np.zeros(3), Truth(t, ("a",), np.array([[0, east, 0.0]]), np.zeros((1, 3))))
    s = scores(metrics)
    assert s["nmac_count"] == 1 and s["loss_of_well_clear_count"] == 1
    assert metrics.losses(COLLISION) == {"a": pytest.approx(1.0)}


def test_the_miss_filter_spares_a_pair_that_will_pass_wide():
    # Closing with tau below 35 s at 2 km, but passing 1.9 km abeam: SARP's DTHR is 1219 m.
    offsets, velocities = [[7000.0, 1900, -500]], [[-60.0, 0, 0]]
    plain, filtered = fly(offsets, velocities), fly(offsets, velocities, horizontal_miss_filter=True)
    assert scores(plain)["loss_of_well_clear_by_volume"]["sarp"] == 1
    assert scores(filtered)["loss_of_well_clear_by_volume"]["sarp"] == 0
    assert scores(filtered)["horizontal_miss_filter"] is True


@pytest.mark.parametrize("miss_filter", [False, True])
def test_the_prefilter_loses_no_loss(miss_filter):
    rng = np.random.default_rng(3)
    k = 60
    metrics = RunMetrics(COLLISION_VOLUME, "sarp", horizontal_miss_filter=miss_filter)
    ids = tuple(str(i) for i in range(k))
    expected = {name: set() for name in PRESETS}
    for step in range(300):
        p, v = rng.normal(0, [3000, 3000, 400], (k, 3)), rng.normal(0, [120, 120, 15], (k, 3))
        own_p, own_v = rng.normal(0, 500, 3), rng.normal(0, 50, 3)
        metrics.update(step * 0.1, own_p, own_v, Truth(step * 0.1, ids, p, v))
        for name, volume in PRESETS.items():
            inside = violation(volume, own_p, own_v, p, v, miss_filter=miss_filter)
            expected[name] |= {ids[i] for i in np.flatnonzero(inside)}
    assert {name: set(metrics.losses(name)) for name in PRESETS} == expected
    assert 0 < len(expected["nmac"]) < k


def test_a_summary_is_strict_json_with_every_key():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    for snapshot, _, truth in made_steps(20, 3):
        metrics.update(snapshot.t, snapshot.ownship.position, snapshot.ownship.velocity, truth)
        metrics.observe(snapshot)
    s = scores(metrics)
    assert set(s) >= KEYS
    json.dumps(s, allow_nan=False)
    assert set(s["step_time_ms"]) == {"mean", "p95", "max"}
    assert 0.3 <= s["step_time_ms"]["mean"] <= s["step_time_ms"]["p95"] <= s["step_time_ms"]["max"] <= 0.41
    assert s["rejections"] == {"adsb": {"out of range": 2, "frozen position": 0}}


def test_without_steps_or_truth_nothing_is_claimed():
    empty = scores(RunMetrics(COLLISION_VOLUME, "astm_f3442"))
    json.dumps(empty, allow_nan=False)
    assert empty["nmac_count"] is None and empty["min_horizontal_separation_m"] is None
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    metrics.update(0.0, np.zeros(3), np.zeros(3), None)
    assert scores(metrics)["loss_of_well_clear_count"] is None
    assert "not known" in scores(metrics)["notes"][0]


def test_an_endless_sensor_age_becomes_null():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    metrics.observe(snapshot_at(0.0, {}, sensors={"adsb": SensorHealth(float("inf"), 0.0, {}, "silent")}))
    assert scores(metrics)["sensors"]["adsb"]["age_s"] is None


def test_true_states_that_are_not_finite_are_counted_not_scored():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    positions = np.array([[np.nan, 0, 0], [50.0, 0, 0]])
    metrics.update(0.0, np.zeros(3), np.zeros(3), Truth(0.0, ("a", "b"), positions, np.zeros((2, 3))))
    s = scores(metrics)
    assert s["nmac_count"] == 1 and s["intruders"] == 1 and "1 true states" in s["notes"][0]


def snapshot_at(t, levels, maneuver=None, velocity=(40.0, 0, 0), sensors=None):
    nan = float("nan")
    threats = tuple(Threat(name, 1.0, 1.0, 1.0, nan, (nan, nan), nan, level) for name, level in levels.items())
    worst = max(levels.values(), default=AlertLevel.CLEAR)
    ownship = Ownship(t, np.zeros(3), np.array(velocity))
    return Snapshot(t, ownship, (), threats, maneuver, worst, 1, sensors or {}, {})


def maneuver_at(t, course_deg, rate=0.0, threats=("a",)):
    a = np.radians(course_deg)
    waypoints = np.array([[200 * np.cos(a), 200 * np.sin(a), -rate * 5]])
    return Maneuver(t, waypoints, np.array([t + 5]), "test", t + 30, threats)


def test_alerts_are_rises_to_corrective():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    clear, unknown, corrective, warning = (
        AlertLevel.CLEAR,
        AlertLevel.UNKNOWN,
        AlertLevel.CORRECTIVE,
        AlertLevel.WARNING,
    )
    for t, levels in enumerate(
        [
            {"a": clear},
            {"a": corrective},
            {"a": warning},
            {"a": unknown},
            {"a": warning, "b": warning},
            {},
            {"a": warning},
        ]
    ):
        metrics.observe(snapshot_at(float(t), levels))
    # a at 1, 4 and 6; b at 4.
    assert scores(metrics)["alerts"] == 4


def test_a_kept_maneuver_counts_once():
    metrics = RunMetrics(COLLISION_VOLUME, "astm_f3442")
    first, second = maneuver_at(0.0, 30), maneuver_at(3.0, 40)
    for t, maneuver in enumerate([first, first, None, second, second, None]):
        metrics.observe(snapshot_at(float(t), {"a": AlertLevel.WARNING}, maneuver))
    assert scores(metrics)["maneuvers"] == 2


@pytest.mark.parametrize(
    ("course", "velocity", "turn"),
    [
        (30, (40.0, 0, 0), 1),
        (-30, (40.0, 0, 0), -1),
        (4, (40.0, 0, 0), 0),
        (350, (40 * np.cos(0.35), 40 * np.sin(0.35), 0), -1),
        (-170, (-40.0, 1.0, 0), 1),
        (90, (40.0, 0, 0), 1),
    ],
)
def test_sign_of_a_commanded_turn(course, velocity, turn):
    assert commanded_signs(Ownship(0.0, np.zeros(3), np.array(velocity)), maneuver_at(0.0, course)) == (turn, 0)


@pytest.mark.parametrize(("rate", "climb"), [(3.0, 1), (-3.0, -1), (0.3, 0)])
def test_sign_of_a_commanded_climb(rate, climb):
    assert commanded_signs(Ownship(0.0, np.zeros(3), np.array([40.0, 0, 0])), maneuver_at(0.0, 0, rate)) == (0, climb)


def count_reversals(*steps):
    counter = ReversalCounter()
    for t, (level, maneuver) in enumerate(steps):
        counter.update(snapshot_at(float(t), {} if level is None else {"a": level}, maneuver))
    return counter.count


def test_reversals():
    warning, clear, unknown = AlertLevel.WARNING, AlertLevel.CLEAR, AlertLevel.UNKNOWN
    right, left, straight = (
        (lambda t: maneuver_at(t, 40)),
        (lambda t: maneuver_at(t, -40)),
        (lambda t: maneuver_at(t, 1)),
    )
    assert count_reversals((warning, right(0)), (warning, left(1))) == 1
    assert count_reversals((warning, right(0)), (warning, right(0)), (warning, right(2))) == 0
    # Straight on in between does not forget the turn before; nor does a short return to the mission, nor doubt.
    assert count_reversals((warning, right(0)), (warning, straight(1)), (warning, left(2))) == 1
    assert count_reversals((warning, right(0)), (unknown, None), (warning, left(2))) == 1
    # Once clear, or gone, a new turn is a new story.
    assert count_reversals((warning, right(0)), (clear, None), (warning, left(2))) == 0
    assert count_reversals((warning, right(0)), (None, None), (warning, left(2))) == 0
    # A turn answered for another threat is none.
    assert count_reversals((warning, right(0)), (warning, maneuver_at(1, -40, threats=("b",)))) == 0
    # Each back and forth counts, and turn and climb each.
    assert count_reversals((warning, right(0)), (warning, left(1)), (warning, right(2))) == 2
    up, down = maneuver_at(0, 40, 3.0), maneuver_at(1, -40, -3.0)
    assert count_reversals((warning, up), (warning, down)) == 2
