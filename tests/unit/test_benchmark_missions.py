"""What the benchmark gives its peer is what ours fly among."""

import numpy as np
import pytest

from benchmarks.bluesky_missions import FlownMission
from benchmarks.missions import limits_of, mission_of, summary_of
from experiments.ground_radar_runs import Job, scenario_of


def test_the_peer_gets_the_true_states_from_the_start_of_the_leg():
    mission = mission_of(scenario_of(Job("gbr_1", "gbr_1", (), 1, True)))
    assert (mission.length_m, mission.speed_mps) == pytest.approx((900.0, 13.0))
    assert mission.altitude_m == pytest.approx(200.0)
    # The scenario's table: 530 m north and 67.5 m east of the origin, which is 400 m along the leg.
    np.testing.assert_allclose(mission.intruders[0], [930.0, 67.5, 200.0, -17.0, 0.0, 0.0], atol=0.05)
    np.testing.assert_allclose(mission.intruders[1], [500.0, 475.3, 200.0, 0.0, -15.0, 0.0], atol=0.05)


def test_the_peer_has_the_limits_of_the_drone():
    limits = limits_of(scenario_of(Job("gbr_2", "gbr_2", (), 1, True)))
    assert (limits.speed_min_mps, limits.speed_max_mps, limits.bank_max_deg) == (9.0, 17.0, 35.0)
    assert (limits.radius_m, limits.half_height_m, limits.step_s) == (153.0, 30.5, 0.1)


def test_flights_are_counted_by_what_came_of_them():
    flown = [FlownMission(True, False, 1.0, 120.0), FlownMission(False, True, 3.0, 200.0)]
    told = summary_of(flown)
    assert (told["flights"], told["violating"], told["not_completed"]) == (2.0, 1.0, 1.0)
    assert told["path_ratio_mean"] == pytest.approx(2.0)
    assert told["path_ratio_max"] == pytest.approx(3.0)
    assert told["times_real_time"] == pytest.approx(160.0)
