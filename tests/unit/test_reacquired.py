"""Lost aircraft that are seen again under another number are one aircraft to the planners."""

import dataclasses

import numpy as np
import pytest

from tests.made_waypoint_runs import Straight, tracks_of
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.prediction import Predictor
from wideberth.avoidance.waypoint_paths.reacquired import without_repeats
from wideberth.types import Ownship, TrackStatus

OLD_SIGMAS = [3.0] * 3 + [0.2] * 3 + [0.1] * 3
YOUNG_SIGMAS = [5.0] * 3 + [2.5] * 3 + [0.1] * 3


def track(name, position=(0.0, 0.0, -200.0), velocity=(-15.0, 0.0, 0.0), sigmas=OLD_SIGMAS, **changes):
    made = tracks_of(Straight([(list(position), list(velocity))]).truth(0.0))[0]
    return dataclasses.replace(made, id=name, covariance=np.diag(np.square(sigmas)), **changes)


LOST = track("1", status=TrackStatus.COASTING)
AGAIN = track("2", (4.0, -3.0, -195.0), (-13.0, 2.0, 1.5), YOUNG_SIGMAS)


def test_of_a_lost_aircraft_and_its_young_track_the_one_that_knows_its_velocity_stays():
    assert without_repeats([LOST, AGAIN]) == [LOST]
    grown = dataclasses.replace(AGAIN, velocity=LOST.velocity, covariance=0.25 * LOST.covariance)
    assert without_repeats([grown, LOST]) == [grown]


@pytest.mark.parametrize(
    "young",
    [
        track("2", (60.0, 0.0, -200.0), sigmas=YOUNG_SIGMAS),
        track("2", velocity=(0.0, 15.0, 0.0), sigmas=YOUNG_SIGMAS),
        dataclasses.replace(AGAIN, status=TrackStatus.TENTATIVE),
    ],
)
def test_one_who_is_elsewhere_or_flies_elsewhere_or_is_not_believed_is_another(young):
    assert without_repeats([LOST, young]) == [LOST, young]


def test_confirmed_aircraft_side_by_side_both_stay_and_one_is_no_two():
    both = [track("1"), track("2", (4.0, 0.0, -200.0))]
    assert without_repeats(both) == both
    # Two were lost, one is seen again: the other is still somewhere.
    other = track("3", (15.0, 0.0, -200.0), status=TrackStatus.COASTING)
    assert without_repeats([LOST, other, AGAIN]) == [LOST, other]
    second = dataclasses.replace(AGAIN, id="4", position=np.array([12.0, 2.0, -200.0]))
    assert without_repeats([LOST, other, AGAIN, second]) == [LOST, other]


def test_exact_tracks_are_compared_too():
    exact = dataclasses.replace(LOST, covariance=np.zeros((9, 9)))
    young = dataclasses.replace(exact, id="2", status=TrackStatus.CONFIRMED)
    assert without_repeats([exact, young]) == [exact, young]


def test_predictions_have_one_row_for_it():
    own = Ownship(0.0, np.array([-400.0, 0.0, -200.0]), np.array([13.0, 0.0, 0.0]))
    predictor = Predictor(AStarConfig(climb_sigmas=0.0))
    prediction, _ = predictor.predict(0.0, own, [LOST, AGAIN])
    assert [owner.id for owner in prediction.owners] == ["1"]
    apart = dataclasses.replace(AGAIN, position=np.array([300.0, 0.0, -200.0]))
    assert len(predictor.predict(0.0, own, [LOST, apart])[0].rows) == 2


def test_plans_keep_more_distance_the_less_is_known_of_where_an_intruder_passes():
    own = Ownship(0.0, np.array([-400.0, 0.0, -200.0]), np.array([13.0, 0.0, 0.0]))
    config = AStarConfig(climb_sigmas=0.0, plan_sigmas=2.0, plan_sigma_cap=0.5)
    # 400 m apart, closing at 28 m/s: it passes in 14.3 s.
    prediction, _ = Predictor(config).predict(0.0, own, [LOST])
    sigma = np.hypot(3.0, 0.2 * 400.0 / 28.0)
    np.testing.assert_allclose(prediction.spreads, [[2.0 * sigma, 2.0 * sigma]])
    np.testing.assert_allclose(prediction.widened(0.1)[0, 6:8], [1.1 * 153.0 + 2.0 * sigma, 1.1 * 30.5 + 2.0 * sigma])
    np.testing.assert_allclose(prediction.widened(0.1, 0.0)[0, 6:8], [1.1 * 153.0, 1.1 * 30.5])
    poor = track("3", sigmas=[50.0] * 6 + [0.1] * 3)
    np.testing.assert_allclose(Predictor(config).predict(0.0, own, [poor])[0].spreads, [[0.5 * 153.0, 30.5]])
    flat = config.model_copy(update={"constant_altitude": True})
    assert Predictor(flat).predict(0.0, own, [LOST])[0].spreads[0, 1] == 0.0
    assert Predictor(config).predict(0.0, own, [])[0].spreads.shape == (0, 2)


def test_who_goes_away_is_met_later_by_a_path_that_turns_to_it():
    own = Ownship(0.0, np.array([-400.0, 0.0, -200.0]), np.array([13.0, 0.0, 0.0]))
    config = AStarConfig(climb_sigmas=0.0, plan_sigmas=2.0, plan_sigma_cap=0.5)
    away = dataclasses.replace(LOST, velocity=np.array([15.0, 0.0, 0.0]))
    sigma = np.hypot(3.0, 0.2 * config.decide_by_s)
    np.testing.assert_allclose(Predictor(config).predict(0.0, own, [away])[0].spreads, [[2.0 * sigma, 2.0 * sigma]])
