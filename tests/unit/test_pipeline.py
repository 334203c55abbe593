"""The corridor as one step: levels, health, lost aircraft, times, determinism, and input that is not finite."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner
from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detector import AdsbDetector
from wideberth.evaluation.replay_check import first_difference
from wideberth.pipeline import LEVEL_HOLD, AlertFilter, Pipeline
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.adsb.simulated import SimulatedAdsb
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import (
    AlertLevel,
    Maneuver,
    Mission,
    Ownship,
    Scan,
    SensorHealth,
    Threat,
    Track,
    TrackStatus,
)
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import parameters

MISSION = Mission(np.array([[0.0, 0, -900], [20e3, 0, -900]]), np.full(2, 40.0), 0.0)
CLEAR, UNKNOWN, PREVENTIVE, CORRECTIVE, WARNING = AlertLevel


def threat(level, name="a1"):
    return Threat(name, 30.0, 100.0, 5.0, 20.0, (20.0, 40.0), 0.5, level)


def ownship(t):
    return Ownship(t, np.array([40.0 * t, 0, -900]), np.array([40.0, 0, 0]))


def track(t, name="a1", **changes):
    made = Track(
        name, t, np.array([3000.0, 0, -900]), np.zeros(3), np.zeros(3), np.eye(9), TrackStatus.CONFIRMED, t
    )  # fmt: skip
    return dataclasses.replace(made, **changes)


def scan(t, state="ok", sensor="adsb", rows=None, **changes):
    z = np.empty((0, 6)) if rows is None else np.asarray(rows, float)
    k = len(z)
    made = Scan(
        t, t, sensor, "adsb", z, np.tile(np.diag([25.0, 25, 9, 4, 4, 1]), (k, 1, 1)), np.full(k, t - 0.2),
        tuple(f"{0xA00001 + i:06x}" for i in range(k)), health=SensorHealth(0.1, 1.0, {}, state),
    )  # fmt: skip
    return dataclasses.replace(made, **changes)


class FakeTracker:
    def __init__(self, *steps):
        self.counters = {"position accepted": 3}
        self.steps = iter(steps)

    def step(self, t, scans, ownship=None):
        return tuple(next(self.steps, ())), ("from the tracker",)


class FakeDetector:
    def __init__(self, level=CLEAR):
        self.level = level
        self.seen = []

    def assess(self, t, ownship, tracks):
        self.seen.append(tuple(one.id for one in tracks))
        return tuple(threat(self.level, one.id) for one in tracks)


class FakePlanner:
    def __init__(self):
        self.given = None

    def decide(self, t, ownship, tracks, threats, mission):
        self.given = (tracks, threats, mission)
        return Maneuver(t, np.ones((1, 3)), np.array([t + 5]), "why", t + 5), ("decided",)


def pipeline(tracker=None, detector=None, planner=None, memory=60.0, counter=lambda: 0.0):
    return Pipeline(tracker or FakeTracker(), detector or FakeDetector(), planner, memory, counter)


def real(planner=True):
    vehicle = parameters(PointMassConfig())
    return Pipeline(
        AdsbKalmanTracker(AdsbKalmanConfig()),
        AdsbDetector(DetectionConfig()),
        LocalLevelPlanner(LocalLevelConfig(), vehicle) if planner else None,
        60.0,
        lambda: 0.0,
    )


def levels(*steps):
    """Levels that the filter gives to one aircraft at given times."""
    held = AlertFilter(LEVEL_HOLD)
    return [held.step(t, [threat(level)])[0].level for t, level in steps]


def test_levels_rise_at_once():
    assert levels((0.0, CLEAR), (0.1, PREVENTIVE), (0.2, WARNING)) == [CLEAR, PREVENTIVE, WARNING]


def test_levels_fall_after_the_hold_only():
    steps = [(0.0, WARNING), (1.0, CLEAR), (2.9, CLEAR), (3.0, CLEAR), (3.1, CLEAR)]
    assert levels(*steps) == [WARNING, WARNING, WARNING, CLEAR, CLEAR]


def test_the_hold_begins_with_the_last_time_the_threat_looked_as_bad():
    steps = [(0.0, WARNING), (2.0, CLEAR), (2.5, WARNING), (4.0, CORRECTIVE), (5.4, CORRECTIVE), (5.5, CORRECTIVE)]
    assert levels(*steps) == [WARNING, WARNING, WARNING, WARNING, WARNING, CORRECTIVE]


def test_each_aircraft_has_its_own_hold_and_loses_it_when_it_is_gone():
    held = AlertFilter(LEVEL_HOLD)
    held.step(0.0, [threat(WARNING, "a"), threat(CLEAR, "b")])
    a, b = held.step(1.0, [threat(CLEAR, "a"), threat(PREVENTIVE, "b")])
    assert (a.level, b.level) == (WARNING, PREVENTIVE)
    held.step(1.5, [threat(CLEAR, "b")])
    assert held.step(2.0, [threat(CLEAR, "a")])[0].level is CLEAR


def test_only_the_level_is_held():
    held = AlertFilter(LEVEL_HOLD)
    held.step(0.0, [threat(WARNING)])
    later = dataclasses.replace(threat(CLEAR), t_cpa=-1.0, probability=0.01)
    (given,) = held.step(1.0, [later])
    assert given == dataclasses.replace(later, level=WARNING)


def test_an_empty_scan_is_fine_and_an_empty_sky_is_clear():
    for made in (pipeline(), real()):
        for t in range(3):
            snapshot = made.step(t, ownship(t), [scan(t)], MISSION)
            assert snapshot.alert_state is CLEAR and snapshot.maneuver is None and snapshot.tracks == ()
            assert snapshot.sensors["adsb"].state == "ok"


def test_a_silent_sensor_is_unknown_and_not_clear():
    made = pipeline()
    assert made.step(0.0, ownship(0), [scan(0.0)], MISSION).alert_state is CLEAR
    snapshot = made.step(1.0, ownship(1), [scan(1.0, "silent for 12 s")], MISSION)
    assert snapshot.alert_state is UNKNOWN and "sensor adsb: silent for 12 s" in snapshot.events
    again = made.step(2.0, ownship(2), [scan(2.0, "silent for 13 s")], MISSION)
    assert again.alert_state is UNKNOWN and not any("sensor" in event for event in again.events)
    back = made.step(3.0, ownship(3), [scan(3.0)], MISSION)
    assert back.alert_state is CLEAR and "sensor adsb: ok" in back.events


def test_one_bad_sensor_of_two_is_enough_and_worse_levels_stay():
    scans = [scan(0.0), scan(0.0, "reconnecting", sensor="radar")]
    assert pipeline().step(0.0, ownship(0), scans, MISSION).alert_state is UNKNOWN
    made = pipeline(FakeTracker([track(0.0)]), FakeDetector(WARNING))
    assert made.step(0.0, ownship(0), scans, MISSION).alert_state is WARNING


def test_what_the_tracker_found_to_be_one_with_another_leaves_nothing_unknown():
    for absorbed, state in (({"a1": "b2"}, CLEAR), ({}, UNKNOWN)):
        tracker = FakeTracker([track(0.0), track(0.0, "b2")], [track(1.0, "b2")])
        tracker.absorbed = absorbed
        pipeline = Pipeline(tracker, FakeDetector(), None, 60.0, lambda: 0.0)
        pipeline.step(0.0, ownship(0.0), [scan(0.0)], MISSION)
        assert pipeline.step(1.0, ownship(1.0), [scan(1.0)], MISSION).alert_state is state


def test_a_near_aircraft_that_was_lost_is_still_there_and_unknown():
    planner = FakePlanner()
    detector = FakeDetector(PREVENTIVE)
    made = pipeline(FakeTracker([track(0.0)], []), detector, planner)
    made.step(0.0, ownship(0), [scan(0.0)], MISSION)
    snapshot = made.step(10.0, ownship(10), [scan(10.0)], MISSION)
    (ghost,) = snapshot.tracks
    assert ghost.id == "a1" and ghost.status is TrackStatus.COASTING and detector.seen[-1] == ("a1",)
    assert planner.given[0] == snapshot.tracks and planner.given[1] == snapshot.threats
    assert snapshot.alert_state >= UNKNOWN
    gone = pipeline(FakeTracker([track(0.0)], []), FakeDetector(CLEAR))
    gone.step(0.0, ownship(0), [], MISSION)
    assert gone.step(61.0, ownship(61), [], MISSION).tracks == ()


@pytest.mark.parametrize(
    ("position", "state"),
    [((3000.0, 0.0, -900.0), UNKNOWN), ((30000.0, 0.0, -900.0), CLEAR), ((3000.0, 0.0, -9000.0), CLEAR)],
)
def test_only_a_lost_aircraft_that_is_near_leaves_the_alert_unknown(position, state):
    made = pipeline(FakeTracker([track(0.0, position=np.array(position))], []), FakeDetector(CLEAR))
    made.step(0.0, ownship(0), [], MISSION)
    assert made.step(10.0, ownship(10), [], MISSION).alert_state is state


def test_stage_times_come_from_the_given_counter():
    ticks = itertools.accumulate(itertools.count(1))
    snapshot = pipeline(planner=FakePlanner(), counter=lambda: float(next(ticks))).step(0.0, ownship(0), [], MISSION)
    assert dict(snapshot.stage_times) == {"tracking": 2.0, "conflict": 3.0, "avoidance": 4.0}


def test_a_snapshot_tells_everything():
    made = pipeline(FakeTracker([track(0.0)]), FakeDetector(CORRECTIVE), FakePlanner())
    mission = dataclasses.replace(MISSION, index=1)
    snapshot = made.step(0.0, ownship(0), [scan(0.0)], mission)
    assert snapshot.events == ("from the tracker", "decided") and snapshot.mission_index == 1
    assert snapshot.maneuver.reason == "why" and snapshot.alert_state is CORRECTIVE
    assert made.counters == {"position accepted": 3}


def test_without_a_planner_everything_else_happens():
    snapshot = pipeline(FakeTracker([track(0.0)]), FakeDetector(WARNING)).step(0.0, ownship(0), [], MISSION)
    assert snapshot.maneuver is None and snapshot.alert_state is WARNING and len(snapshot.threats) == 1


def seen(seconds, seed=3):
    """Scans of two aircraft on collision courses, through the error model."""
    sensor = SimulatedAdsb(AdsbErrorConfig(), seed, ["a00001", "a00002"])
    start = np.array([[7000.0, 50, -910], [2500, 4000, -890]])
    velocity = np.array([[-60.0, 0, 0], [0, -60, 0]])
    for t in range(seconds):
        yield float(t), sensor.sense(float(t), start + t * velocity, velocity, np.array([40.0 * t, 0, -900]))


def test_two_pipelines_on_the_same_inputs_give_equal_snapshots():
    made = [real(), real()]
    chosen = set()
    for t, given in seen(50):
        first, second = (one.step(t, ownship(t), [given], MISSION) for one in made)
        assert first_difference(first, second) == ("", "", "")
        chosen.add(first.maneuver.t if first.maneuver else None)
    assert chosen - {None}


@pytest.mark.parametrize(
    ("column", "value"),
    [(c, v) for c in (0, 2, 3) for v in (math.nan, math.inf, -math.inf)] + [(slice(None), math.nan)],
)
def test_rows_that_are_not_finite_do_no_harm_end_to_end(column, value):
    """They are refused or used without the missing element; the other aircraft is tracked and avoided as before."""
    made = real()
    for t, given in seen(40):
        z = given.z.copy()
        wrong = [i for i, name in enumerate(given.source_ids) if name == "a00002"] if t > 5 else []
        for i in wrong:
            z[i, column] = value
        snapshot = made.step(t, ownship(t), [dataclasses.replace(given, z=z)], MISSION)
        for one in snapshot.tracks:
            assert np.isfinite(one.position).all() and np.isfinite(one.velocity).all()
            assert np.isfinite(one.covariance).all()
        assert {one.track_id for one in snapshot.threats} == {one.id for one in snapshot.tracks}
    assert snapshot.maneuver is not None and "a00001" in [one.id for one in snapshot.tracks]
    if not math.isnan(value):
        assert made.counters["value out of range"] > 20
    if column == slice(None):
        # Nothing said for half a minute: remembered where it would be, and known to be uncertain.
        (ghost,) = [one for one in snapshot.tracks if one.id == "a00002"]
        assert ghost.status is TrackStatus.COASTING
        assert snapshot.alert_state > CLEAR


def test_times_that_are_not_finite_are_counted():
    made = real()
    for t, given in seen(10):
        wrong = dataclasses.replace(given, t_valid=np.full_like(given.t_valid, math.nan))
        assert made.step(t, ownship(t), [wrong], MISSION).tracks == ()
    assert made.counters["time not finite"] > 10


def test_a_track_of_unknown_extent_is_unknown_and_not_clear():
    """No tracker of ours makes one; one that did would be seen in the alert."""
    wrong = track(0.0, covariance=np.full((9, 9), math.nan))
    planner = LocalLevelPlanner(LocalLevelConfig(), parameters(PointMassConfig()))
    made = pipeline(FakeTracker([wrong]), AdsbDetector(DetectionConfig()), planner)
    snapshot = made.step(0.0, ownship(0), [scan(0.0)], MISSION)
    assert snapshot.alert_state >= UNKNOWN and len(snapshot.tracks) == 1


def test_the_detector_is_told_what_is_flown():
    told = []

    class NoTracks:
        def step(self, t, scans, ownship=None):
            return (), ()

    class Watching:
        judges_path = True

        def assess(self, t, ownship, tracks, path=None):
            told.append(path)
            return ()

    class Turning:
        def decide(self, t, ownship, tracks, threats, mission):
            if t < 0.2:
                return None, ()
            return Maneuver(t, np.zeros((1, 3)), np.array([t + 1.0]), "turn", t + 9.0), ()

    pipeline = Pipeline(NoTracks(), Watching(), Turning(), 60.0, lambda: 0.0)
    mission = Mission(np.array([[0.0, 0.0, -100.0], [900.0, 0.0, -100.0]]), np.array([20.0, 20.0]), 0.0)
    for t in (0.0, 0.1, 0.2, 0.3):
        pipeline.step(t, Ownship(t, np.array([20.0 * t, 0.0, -100.0]), np.array([20.0, 0.0, 0.0])), (), mission)
    assert [type(path).__name__ for path in told] == ["Mission", "Mission", "Mission", "Maneuver"]
