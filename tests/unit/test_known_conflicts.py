"""What a maneuver begins by: conflicts whose place is known well enough, or that leave no time to learn more."""

import dataclasses
import math

import numpy as np
import pytest

from tests.made_waypoint_runs import SCENARIO_1, SMALL_WING, SPEED, Straight, tracks_of
from wideberth.avoidance.waypoint_paths.config import AStarChainConfig
from wideberth.avoidance.waypoint_paths.prediction import Prediction, Predictor
from wideberth.avoidance.waypoint_paths.waypoint_manager import AStarChainPlanner
from wideberth.types import Mission, Ownship
from wideberth.vehicles.point_mass import parameters

MISSION = Mission(SCENARIO_1[0], np.full(2, SPEED), 0.0, 1)
HEAD_ON = [([430.0, 67.5, -200.0], [-17.0, 0.0, 0.0])]


def covariance(level=0.1, vertical=0.1, level_rate=0.01, vertical_rate=0.01):
    """By standard deviations, m and m/s."""
    sigmas = [level, level, vertical, level_rate, level_rate, vertical_rate, 0.0, 0.0, 0.0]
    return np.diag(np.square(sigmas))


def seen(t, p, intruders=HEAD_ON):
    return [dataclasses.replace(one, covariance=p) for one in tracks_of(Straight(intruders).truth(t))]


def first_maneuver(covariance_at, **config):
    """When the head-on aircraft is avoided, s, None if never; by the mission its cylinder is entered after 23 s."""
    part = AStarChainPlanner(AStarChainConfig(**{"known_share": 0.3, **config}), parameters(SMALL_WING))
    for k in range(200):
        t = 0.1 * k
        own = Ownship(t, np.array([-400.0 + SPEED * t, 0.0, -200.0]), np.array([SPEED, 0.0, 0.0]))
        if part.decide(t, own, seen(t, covariance_at(t)), (), MISSION)[0] is not None:
            return t
    return None


def test_who_is_known_is_avoided_at_once():
    assert first_maneuver(lambda t: covariance()) == pytest.approx(0.2)


@pytest.mark.parametrize("poor", [{"vertical_rate": 2.0}, {"vertical": 20.0}, {"level_rate": 5.0}, {"level": 80.0}])
def test_a_poor_track_waits_until_it_is_known(poor):
    assert first_maneuver(lambda t: covariance(**poor) if t < 4.95 else covariance()) == pytest.approx(5.2)


@pytest.mark.parametrize("poor", [{"vertical_rate": 2.0}, {"level_rate": 5.0}])
def test_what_stays_unknown_is_avoided_while_there_is_time(poor):
    at = first_maneuver(lambda t: covariance(**poor), decide_by_s=12.0)
    # 830 m are closed at 30 m/s, 160 m of them are the cylinder.
    assert 10.0 < at < 16.0
    assert first_maneuver(lambda t: covariance(**poor), decide_by_s=60.0) == pytest.approx(0.2)


def test_heights_are_of_no_matter_at_one_altitude():
    assert first_maneuver(lambda t: covariance(vertical_rate=5.0), constant_altitude=True) == pytest.approx(0.2)


def test_who_is_avoided_must_be_known_before_the_sense_is_changed():
    """Its height jumps by 60 m and back, in tracks that do not know it: the maneuver stays."""

    def maneuvers(p):
        part = AStarChainPlanner(AStarChainConfig(settle_s=0.5), parameters(SMALL_WING))
        chosen = []
        for k in range(60):
            t = 0.1 * k
            own = Ownship(t, np.array([-400.0 + SPEED * t, 0.0, -200.0]), np.array([SPEED, 0.0, 0.0]))
            p_now = covariance() if k < 10 else p
            tracks = seen(t, p_now, [([430.0, 67.5, -200.0 if k < 10 else -240.0], HEAD_ON[0][1])])
            chosen.append(part.decide(t, own, tracks, (), MISSION)[0])
        return {id(one) for one in chosen if one is not None}

    assert len(maneuvers(covariance(vertical_rate=3.0))) == 1
    assert len(maneuvers(covariance())) > 1


def test_the_sigmas_ahead_are_those_of_straight_flight():
    rng = np.random.default_rng(3)
    for t in (0.0, 3.0, 20.0):
        root = rng.normal(size=(9, 9))
        (track,) = seen(0.0, root @ root.T)
        level, vertical = Prediction(
            np.zeros((1, 10)), (track,), np.zeros(1, bool), lambda: np.zeros((1, 2))
        ).sigmas_at(0, t)
        ahead = np.hstack([np.eye(3), t * np.eye(3)])
        expected = ahead @ track.covariance[:6, :6] @ ahead.T
        assert level == pytest.approx(math.sqrt(0.5 * (expected[0, 0] + expected[1, 1])))
        assert vertical == pytest.approx(math.sqrt(expected[2, 2]))


def test_a_climb_that_is_only_possible_is_kept_clear_of_but_begins_no_maneuver():
    poor = covariance(vertical_rate=3.0)
    config = AStarChainConfig(climb_sigmas=1.5)
    prediction, _ = Predictor(config).predict(0.0, Ownship(0.0, np.zeros(3), np.zeros(3)), seen(0.0, poor))
    assert prediction.rows[:, 5].tolist() == [0.0, -4.5, 4.5]
    assert prediction.doubts.tolist() == [False, True, True]
    for one in (AStarChainConfig(climb_sigmas=0.0), AStarChainConfig(constant_altitude=True)):
        assert len(Predictor(one).predict(0.0, Ownship(0.0, np.zeros(3), np.zeros(3)), seen(0.0, poor))[0].rows) == 1
    # 60 m above, level: no conflict, though it would be one if it sank.
    part = AStarChainPlanner(config, parameters(SMALL_WING))
    for k in range(160):
        t = 0.1 * k
        own = Ownship(t, np.array([-400.0 + SPEED * t, 0.0, -200.0]), np.array([SPEED, 0.0, 0.0]))
        above = [([430.0, 67.5, -260.0], HEAD_ON[0][1])]
        assert part.decide(t, own, seen(t, poor, above), (), MISSION)[0] is None
