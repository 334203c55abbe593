"""The waypoint control function: when it plans, what it keeps, presets, and bad input."""

import dataclasses
import math

import numpy as np
import pytest
from pydantic import ValidationError

from tests.made_waypoint_runs import (
    SCENARIO_1,
    SMALL_WING,
    SPEED,
    Straight,
    fly,
    tracks_of,
)
from wideberth.avoidance.local_level import ground_state
from wideberth.avoidance.waypoint_paths import first_turn_kernels as ftk
from wideberth.avoidance.waypoint_paths.config import AStarChainConfig, AStarConfig
from wideberth.avoidance.waypoint_paths.prediction import Predictor
from wideberth.avoidance.waypoint_paths.waypoint_manager import AStarChainPlanner, AStarPlanner
from wideberth.types import AlertLevel, Mission, Ownship, Threat, TrackStatus
from wideberth.vehicles.point_mass import parameters


def planner(kind=AStarChainPlanner, **config):
    return kind(kind.Config(**config), parameters(SMALL_WING))


def own(position=(-400.0, 0.0, -200.0), velocity=(SPEED, 0.0, 0.0), t=0.0):
    return Ownship(t, np.array(position, float), np.array(velocity, float))


def mission(waypoints=SCENARIO_1[0], index=1):
    return Mission(np.array(waypoints, float), np.full(len(waypoints), SPEED), 0.0, index)


def tracks(t=0.0, intruders=SCENARIO_1[1]):
    return tracks_of(Straight(intruders).truth(t))


def decisions(part, seen, n=6, **changes):
    """The decisions of n steps; `seen` gives the tracks of each."""
    out = []
    for k in range(n):
        t = 0.1 * k
        place = (-400.0 + SPEED * t, 0.0, -200.0)
        out.append(part.decide(t, own(place, t=t), seen(k), (), mission(**changes)))
    return out


def test_n_consecutive_detections_begin_a_maneuver():
    part = planner(detections_needed=4)
    chosen = [maneuver for maneuver, _ in decisions(part, lambda k: tracks(0.1 * k))]
    assert [maneuver is not None for maneuver in chosen] == [False, False, False, True, True, True]
    assert chosen[3] is chosen[5]  # kept
    # One step without a detection begins the count anew.
    part = planner(detections_needed=4)
    chosen = decisions(part, lambda k: [] if k == 3 else tracks(0.1 * k), n=8)
    assert [maneuver is not None for maneuver, _ in chosen] == [False] * 7 + [True]


def test_the_sooner_a_cylinder_is_entered_the_fewer_detections_are_waited_for():
    def begins(distance):
        ahead = [([-400.0 + distance, 0.0, -200.0], [-17.0, 0.0, 0.0])]
        chosen = decisions(planner(detections_needed=10), lambda k: tracks(0.1 * k, ahead), n=12)
        return next(k for k, (maneuver, _) in enumerate(chosen, 1) if maneuver is not None)

    assert begins(600.0) == 10
    assert 3 < begins(320.0) < 10
    assert begins(180.0) == 3  # never fewer


def test_a_conflict_counts_only_near_or_soon():
    far = [([1500.0, 0.0, -200.0], [-17.0, 0.0, 0.0])]
    long_mission = {"waypoints": [[-400.0, 0.0, -200.0], [1800.0, 0.0, -200.0]]}
    for config, begins in (({}, False), ({"detection_time_s": 80.0}, True), ({"detection_distance_m": 2e3}, True)):
        chosen = decisions(planner(**config), lambda k: tracks(0.1 * k, far), **long_mission)
        assert any(maneuver is not None for maneuver, _ in chosen) == begins


def test_the_maneuver_in_words_and_times():
    part = planner()
    threat = Threat("i0", 31.0, 67.5, 0.0, 26.0, (26.0, 36.0), 1.0, AlertLevel.WARNING)
    for k in range(3):
        maneuver, events = part.decide(0.1 * k, own(t=0.1 * k), tracks(0.1 * k), (threat,), mission())
    assert maneuver is not None
    assert maneuver.reason in events
    assert maneuver.reason.startswith("intruder I0 31 s ahead, miss 68 m")
    assert "climb" in maneuver.reason
    assert set(maneuver.threat_ids) == {"i0", "i1"}
    # As flown: the climb takes a moment to begin, which makes the way longer by millimetres.
    points = np.vstack([own().position, maneuver.waypoints])
    flown, times = np.empty((len(points) + ftk.PLACES, 3)), np.empty(len(points) + ftk.PLACES)
    inertia = ftk.inertia_of(ground_state(own()), parameters(SMALL_WING), SPEED)
    n, _ = ftk.flown_times(points, len(points), 0.0, 40.0, inertia, SPEED, flown, times)
    np.testing.assert_array_equal(flown[n - len(points) + 1 : n, :2], points[1:, :2])
    lengths = np.linalg.norm(np.diff(flown[:n], axis=0), axis=1)
    at_places = (np.cumsum(lengths) / SPEED)[n - len(points) :]
    np.testing.assert_allclose(maneuver.times - maneuver.t, at_places, rtol=1e-9)
    np.testing.assert_allclose(maneuver.waypoints[-1], mission().waypoints[-1])
    assert maneuver.valid_until > maneuver.times[-1]
    assert not maneuver.least_bad


def test_visited_waypoints_stay_and_the_rest_is_planned_from_here():
    """The second intruder turns up late: the waypoints flown by then are not flown again."""
    late = [([200.0, 500.0, -235.0], [0.0, -15.0, 0.0])]

    def see(truth, noise, rng):
        seen = tracks_of(truth)
        return seen if truth.t > 12.0 else seen[:1]

    flown = fly((SCENARIO_1[0], [SCENARIO_1[1][0], *late]), see=see, levels=1)
    assert flown.done
    assert flown.violated == 0.0
    assert len(flown.maneuvers) >= 1
    for maneuver in flown.maneuvers[1:]:
        here = flown.places[round(maneuver.t / 0.1)]
        assert maneuver.waypoints[0, 0] > here[0] - 1.0


def test_the_last_resort_is_a_turn_and_a_climb_at_the_limit_at_once():
    """Well inside, the nearest bound is above; the grid turns or climbs, never both in one move."""
    beside = [([-400.0, 60.0, -188.0], [SPEED, 0.0, 0.0])]
    maneuver = decisions(planner(), lambda k: tracks(0.1 * k, beside))[-1][0]
    assert maneuver is not None and maneuver.least_bad
    first = maneuver.waypoints[0] - own(t=maneuver.t).position
    rate = -first[2] / (maneuver.times[0] - maneuver.t)
    assert rate > 0.8 * SMALL_WING.climb_rate_max_mps
    assert first[1] < 0.0


def test_least_bad_paths_are_flagged_and_said():
    """Surrounded by cylinders there is no free path."""
    ring = [([-400.0 + 300.0 * math.cos(a), 300.0 * math.sin(a), -200.0], [0.0, 0.0, 0.0]) for a in np.arange(8)]
    chosen = decisions(planner(constant_altitude=True), lambda k: tracks(0.1 * k, ring))
    maneuver = chosen[-1][0]
    assert maneuver is not None and maneuver.least_bad
    assert "least bad" in maneuver.reason


@pytest.mark.parametrize("kind", [AStarPlanner, AStarChainPlanner])
def test_an_intruder_about_the_start_is_left(kind):
    inside = [([-380.0, 30.0, -200.0], [3.0, 0.0, 0.0])]
    flown = fly((SCENARIO_1[0], inside), kind)
    assert flown.maneuvers and flown.maneuvers[0].least_bad
    assert flown.done
    assert flown.violated < 20.0


@pytest.mark.parametrize(
    "waypoints",
    [
        [[-400.0, 0, -200], [-400.0, 0, -200], [500.0, 0, -200], [500.0, 0, -200]],
        [[-400.0, 0, -200], [-380.0, 0, -200], [-360.0, 0, -200], [500.0, 0, -200]],
        [[-400.0, 0, -200], [0.0, 0, -200], [0.0, 300.0, -200], [500.0, 300.0, -220]],
    ],
)
def test_repeated_close_and_turning_waypoints(waypoints):
    flown = fly((np.array(waypoints), SCENARIO_1[1]))
    assert flown.done
    assert flown.violated == 0.0


def test_no_waypoints_left_is_counted():
    part = planner()
    maneuver, events = part.decide(0.0, own(), tracks(), (), mission(index=2))
    assert maneuver is None and events == ()
    assert part.counters["no_waypoints_left"] == 1


def test_a_mission_that_ends_here_does_not_stop_the_planner():
    here = mission([[-400.0, 0.0, -200.0], [-400.0, 0.0, -200.0]])
    part = planner()
    for k in range(5):
        part.decide(0.1 * k, own(), tracks(0.0, [([-390.0, 0.0, -200.0], [0.0, 0.0, 0.0])]), (), here)
    assert part.counters["planned"] <= 1


def broken(one, what):
    bad = np.full(9, np.nan)
    changes = {
        "position": {"position": bad[:3]},
        "velocity": {"velocity": bad[:3]},
        "covariance": {"covariance": np.full((9, 9), np.inf)},
        "all": {"position": bad[:3], "velocity": bad[:3], "covariance": np.full((9, 9), np.nan)},
    }
    return dataclasses.replace(one, **changes[what])


@pytest.mark.parametrize("what", ["position", "velocity", "covariance", "all"])
def test_a_track_that_is_not_finite_is_counted_and_avoided_where_it_was_going(what):
    part = planner()
    chosen = decisions(part, lambda k: tracks(0.1 * k) if k == 0 else [broken(o, what) for o in tracks(0.1 * k)])
    assert part.counters["not_finite"] == 10
    assert part.counters["unusable"] == 0
    assert chosen[-1][0] is not None
    said = [event for _, events in chosen for event in events if "not finite" in event]
    assert len(said) == 2  # once for each, not at every step


def test_a_track_that_never_was_finite_is_counted_and_said():
    part = planner()
    chosen = decisions(part, lambda k: [broken(o, "all") for o in tracks(0.1 * k)])
    assert part.counters["unusable"] == 12
    assert chosen[0][1] == tuple(f"track I{k} is not finite: it cannot be avoided" for k in range(2))
    assert chosen[-1][0] is None
    # Known by its place alone it is avoided there, with the widest cylinder.
    rows = Predictor(AStarConfig()).predict(0.0, own(), [broken(tracks()[0], "velocity")])[0].rows
    assert rows[0, 3:6] == pytest.approx(0.0) and rows[0, 6] == pytest.approx(1.5 * 153.0)


def test_hundreds_of_intruders_take_no_more_than_the_budget():
    rng = np.random.default_rng(1)
    crowd = [([*rng.uniform(-3e3, 3e3, 2), -200.0], [*rng.uniform(-15, 15, 2), 0.0]) for _ in range(400)]
    part = planner(intruders_max=20)
    chosen = decisions(part, lambda k: tracks(0.1 * k, crowd))
    assert part.counters["left_out"] == 6 * 380
    assert any(maneuver is not None for maneuver, _ in chosen)


def test_tentative_tracks_and_the_ownships_own():
    def as_(**changes):
        return lambda k: [dataclasses.replace(one, **changes) for one in tracks(0.1 * k)]

    for changes in ({"is_ownship": True}, {"status": TrackStatus.TENTATIVE}):
        assert decisions(planner(), as_(**changes))[-1][0] is None
    assert decisions(planner(tentative=True), as_(status=TrackStatus.TENTATIVE))[-1][0] is not None


def test_hypotheses_and_widening():
    covariance = np.diag([100.0, 100.0, 400.0, 1, 1, 1, 0.01, 0.01, 0.01])
    turning = dataclasses.replace(tracks()[0], acceleration=np.array([0.0, -1.7, 0.0]), covariance=covariance)
    config = AStarConfig(turn_hypothesis=True, climb_hypothesis_mps=2.0, sigmas=2.0, sigma_cap=0.25, climb_sigmas=0.0)
    rows = Predictor(config).predict(0.0, own(), [turning])[0].rows
    assert len(rows) == 4
    np.testing.assert_allclose(rows[:, 6], 153.0 + 20.0)
    np.testing.assert_allclose(rows[:, 7], 30.5 * 1.25)  # two sigmas are more than the cap
    assert rows[1, 8] == pytest.approx(1.7 / 17.0)  # to the east of flying south: clockwise is positive
    assert sorted(rows[:, 5]) == [-2.0, 0.0, 0.0, 2.0]


def test_one_who_climbs_may_level_off():
    climbing = tracks_of(Straight([([0.0, 0.0, -150.0], [-15.0, 0.0, -2.0])]).truth(0.0))
    level = tracks_of(Straight([([0.0, 0.0, -150.0], [-15.0, 0.0, -0.05])]).truth(0.0))
    predictor = Predictor(AStarConfig(level_hypothesis=True))
    assert predictor.predict(0.0, own(), climbing)[0].rows[:, 5].tolist() == [-2.0, 0.0]
    assert len(predictor.predict(0.0, own(), level)[0].rows) == 1
    assert len(Predictor(AStarConfig()).predict(0.0, own(), climbing)[0].rows) == 1


def test_a_maneuver_ends_early_once_the_straight_way_back_is_free():
    """The intruders turn away after 8 s: the ownship need not fly round where they would have been."""

    def gone(truth, noise, rng):
        return tracks_of(truth) if truth.t < 8.0 else []

    def once_more(truth, noise, rng):
        return tracks_of(truth) if truth.t < 8.0 or 9.0 < truth.t < 9.2 else []

    flown = fly(SCENARIO_1, see=gone, constant_altitude=True, return_after_s=2.0)
    late = fly(SCENARIO_1, see=once_more, constant_altitude=True, return_after_s=2.0)
    whole = fly(SCENARIO_1, see=gone, constant_altitude=True, return_after_s=1e6)
    assert flown.counters["returned"] == late.counters["returned"] == 1 and whole.counters["returned"] == 0
    assert flown.events.count("the straight way back to the mission is free") == 1
    back = flown.maneuvers[-1]
    assert 10.0 - 1e-6 <= back.t < 10.2 and len(back.waypoints) == 1 and not back.least_bad
    np.testing.assert_allclose(back.waypoints[-1], SCENARIO_1[0][-1])
    # It must be free for so long without a break.
    assert late.maneuvers[-1].t > back.t + 0.9
    assert flown.done and flown.ratio < whole.ratio - 0.02


def test_nobody_returns_through_those_who_are_avoided():
    flown = fly(SCENARIO_1, constant_altitude=True, return_after_s=0.0)
    assert flown.violated == 0.0 and flown.done


def test_a_path_that_is_not_free_is_kept_unless_another_is_much_better():
    beside = [([-390.0, 60.0, -200.0], [11.0, 0.0, 0.0])]
    changes = []
    for share in (1.0, 0.25):
        flown = fly((SCENARIO_1[0], beside), noise=(5.0, 0.7), constant_altitude=True, replace_share=share)
        assert any(maneuver.least_bad for maneuver in flown.maneuvers) and flown.done
        changes.append(len(flown.maneuvers))
    assert changes[1] < changes[0]


def test_presets_are_the_tables_and_any_value_can_be_given():
    table = AStarConfig()
    assert (table.costs.k_alt, table.costs.k_r, table.costs.varrho) == (559.0, 500.0, 2.3)
    assert (table.forces.k_sh, table.forces.delta_2, table.forces.f_max) == (200.0, 2.639, 20.0)
    assert (table.separation_radius_m, table.separation_height_m, table.cell_m) == (153.0, 61.0, 100.0)
    flight = AStarChainConfig(preset="table_5_2", costs={"k_r": 7.0}, cell_m=12.0)
    assert (flight.costs.k_r, flight.costs.k_max, flight.costs.varrho) == (7.0, 1e8, 4.0)
    assert flight.cell_m == 12.0 and flight.constant_altitude and flight.forces.f_max == 50.0
    assert AStarConfig(**table.model_dump()) == table  # what a recording holds reads back as the same
    for wrong in (
        {"preset": "table_9"},
        {"costs": {"k_rr": 1.0}},
        {"costs": 3},
        {"altitude_min_m": 100.0, "altitude_max_m": 50.0},
        {"trigger_margin": 0.3},
        {"expansions_max": 0},
        {"cell": 3.0},
    ):
        with pytest.raises(ValidationError):
            AStarConfig(**wrong)


def test_while_it_turns_the_corner_is_still_ahead():
    """Once a corner is passed, the straight way to the next waypoint would cut across it, inside the turn."""
    part = planner()
    path = np.array([[0.0, 0, -200], [200, 0, -200], [200, 400, -200], [600, 400, -200]])
    part._path, part._index = path, 2

    def state(north, east, course):
        return np.array([north, east, -200.0, SPEED, course, 0.0, 0.0])

    np.testing.assert_allclose(part._corner(state(170.0, 0.0, 0.0)), [[200.0, 0.0, -200.0]], atol=1e-9)
    # Half-way round the tangent meets the leg beyond the corner.
    np.testing.assert_allclose(part._corner(state(190.0, 10.0, math.pi / 4)), [[200.0, 20.0, -200.0]], atol=1e-9)
    assert len(part._corner(state(190.0, 10.0, 0.6 * math.pi))) == 0  # away from the leg
    part._index = 1
    assert len(part._corner(state(170.0, 0.0, 0.0))) == 0


def test_paths_keep_clear_of_level_flight_while_a_climb_rate_is_little_known():
    one = tracks()[0]
    for v_down, sigma, rows in ((2.0, 1.0, 2), (2.0, 0.4, 1), (0.05, 1.0, 1)):
        covariance = 0.01 * np.eye(9)
        covariance[5, 5] = sigma**2
        seen = dataclasses.replace(
            one, velocity=np.array([*one.velocity[:2], v_down]), covariance=covariance
        )  # fmt: skip
        prediction, _ = Predictor(AStarConfig(doubt_share=100.0)).predict(0.0, own(), [seen])
        assert len(prediction.rows) == rows
        assert list(prediction.doubts) == [False, True][:rows]
        assert prediction.rows[-1, 5] == (0.0 if rows == 2 else v_down)
