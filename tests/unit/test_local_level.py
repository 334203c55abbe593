"""The local-level planner: maps, limits, least-bad paths, commitment, words."""

import dataclasses
import itertools
import math
import re
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner
from wideberth.avoidance.maps import MAPS
from wideberth.evaluation.reversals import commanded_signs
from wideberth.frames import rotation_ned_body
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import SimWorld
from wideberth.types import AlertLevel, Mission, Ownship, SourceInfo, Threat, Track, TrackStatus
from wideberth.units import FOOT
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass, parameters

SPEED, ALTITUDE = 40.0, 900.0
COVARIANCE = np.diag([100.0, 100, 25, 1, 1, 0.25, 0.01, 0.01, 0.01])
# Time to the meeting that each map is made for.
MEETING = {"flyable": 40.0, "self_separation_150": 40.0, "collision_38": 13.0, "flyable_38": 30.0, "flyable_150": 80.0}


def planner(vehicle=None, **config):
    return LocalLevelPlanner(LocalLevelConfig(**config), parameters(vehicle or PointMassConfig()))


def track(position, velocity, t=0.0, name="a1b2c3", **changes):
    made = Track(
        name, t, np.array(position, float), np.array(velocity, float), np.zeros(3), COVARIANCE, TrackStatus.CONFIRMED, t
    )
    return dataclasses.replace(made, **changes)


def threat(name="a1b2c3", t_cpa=35.0, miss=120.0, height=-10.0):
    return Threat(name, t_cpa, miss, height, t_cpa - 5, (t_cpa - 5, t_cpa + 5), 0.9, AlertLevel.WARNING)


def north(t=0.0, altitude=ALTITUDE, ahead=0.0):
    return Ownship(t, np.array([ahead, 0.0, -altitude]), np.array([SPEED, 0.0, 0.0]), rotation_ned_body(0.0, 0.0, 0.0))


def mission(altitude=ALTITUDE, length=20e3):
    return Mission(np.array([[0.0, 0.0, -altitude], [length, 0.0, -altitude]]), np.full(2, SPEED), 0.0)


def head_on(seconds, speed=60.0, aside=20.0):
    return track([(SPEED + speed) * seconds, aside, -ALTITUDE], [-speed, 0.0, 0.0])


@dataclass
class Step:
    t: float
    ownship: Ownship
    maneuver: object
    events: tuple


class Nobody:
    def truth(self, t):
        return Truth.empty(t)


def fly(plan, tracks, seconds, dt=1.0, length=20e3, vehicle=None, own_mission=None):
    """Fly the planner's decisions among aircraft in straight flight that are known exactly."""
    world = SimWorld(own_mission or mission(length=length), PointMass(vehicle or PointMassConfig()), Nobody(), [])
    steps = []
    for k in range(round(seconds / dt) + 1):
        t = k * dt
        ownship, _ = world.sense(t)
        seen = [dataclasses.replace(one, t=t, position=one.position + t * one.velocity) for one in tracks]
        maneuver, events = plan.decide(t, ownship, seen, [], world.mission)
        world.actuate(t, maneuver)
        steps.append(Step(t, ownship, maneuver, events))
    return steps, world


def separation(steps, one):
    """Least max(d_h / 500 ft, |d_v| / 100 ft)."""
    values = []
    for step in steps:
        away = one.position + step.t * one.velocity - step.ownship.position
        values.append(max(np.hypot(away[0], away[1]) / (500 * FOOT), abs(away[2]) / (100 * FOOT)))
    return min(values)


def maneuvers(steps):
    found = []
    for step in steps:
        if step.maneuver is not None and (not found or found[-1][1] is not step.maneuver):
            found.append((step, step.maneuver))
    return found


def test_printed_maps_have_the_papers_numbers_of_nodes():
    assert MAPS["collision_38"]().node_count == 38
    assert [len(ring.nodes) for ring in MAPS["collision_38"]().rings] == [7, 15, 15]
    assert MAPS["self_separation_150"]().node_count == 150
    assert [len(ring.nodes) for ring in MAPS["self_separation_150"]().rings] == [9, 15, 35, 45, 45]
    assert MAPS["flyable_150"]().node_count == 150


@pytest.mark.parametrize("name", MAPS)
def test_maps_hold_each_node_once_in_whole_grid_steps_and_as_far_left_as_right(name):
    made = MAPS[name]()
    first, steps, headings, heights = made.arrays(1.0)
    assert first[-1] == made.node_count - 1 == len(headings) and steps.sum() == made.duration
    for ring in made.rings:
        assert len(set(ring.nodes)) == len(ring.nodes)
        assert {(-course, height) for course, height in ring.nodes} == set(ring.nodes)
        assert {(course, -height) for course, height in ring.nodes} == set(ring.nodes)
    assert np.isfinite(heights).all()


@pytest.mark.parametrize("name", MAPS)
def test_a_head_on_aircraft_is_avoided_with_every_map(name):
    intruder = head_on(MEETING[name])
    steps, _ = fly(planner(map=name), [intruder], MEETING[name] + 25)
    (chosen, maneuver), *_ = maneuvers(steps)
    assert maneuver.threat_ids == ("a1b2c3",)
    # Its path as predicted, at the times of its waypoints.
    times = np.concatenate([[chosen.t], maneuver.times])
    points = np.vstack([chosen.ownship.position, maneuver.waypoints])
    for t in np.arange(chosen.t, times[-1], 0.25):
        own = np.array([np.interp(t, times, points[:, i]) for i in range(3)])
        away = intruder.position + t * intruder.velocity - own
        assert np.hypot(away[0], away[1]) > 500 * FOOT or abs(away[2]) > 100 * FOOT, t
    assert separation(steps, intruder) > 1.0


@pytest.mark.parametrize("name", MAPS)
def test_where_every_path_is_blocked_the_least_bad_is_flown_and_says_so(name):
    plan = planner(
        map=name, hard_radius_m=20e3, outer_radius_m=20e3, hard_half_height_m=2e3, outer_half_height_m=2e3,
        altitude_max_m=9e3,
    )  # fmt: skip
    maneuver, events = plan.decide(0.0, north(), [track([600, 30, -ALTITUDE], [0, 0, 0])], [], mission())
    assert maneuver is not None and maneuver.least_bad
    assert events == (maneuver.reason,) and "every path is blocked" in maneuver.reason
    assert np.isfinite(maneuver.waypoints).all() and np.all(np.diff(maneuver.times) > 0)


def test_an_open_path_is_not_called_blocked():
    steps, _ = fly(planner(), [head_on(50.0)], 60)
    assert maneuvers(steps)
    for _, maneuver in maneuvers(steps):
        assert not maneuver.least_bad and "blocked" not in maneuver.reason


def decided(vehicle=None, ahead=900.0, **config):
    """The maneuver against an aircraft that stands in the way."""
    plan = planner(vehicle, **config)
    return plan.decide(0.0, north(), [track([ahead, 0.0, -ALTITUDE], [0.0, 0, 0])], [threat()], mission())[0]


def test_an_aircraft_that_cannot_climb_gets_no_climbing_path():
    level = decided(PointMassConfig(climb_rate_max_mps=0.01, sink_rate_max_mps=0.01))
    assert np.abs(level.waypoints[:, 2] + ALTITUDE).max() < 0.01 * (level.times[-1] + 1)
    assert "climb" not in level.reason and "descend" not in level.reason


@pytest.mark.parametrize("name", ["self_separation_150", "collision_38"])
def test_on_the_printed_maps_an_aircraft_that_cannot_climb_gets_no_climbing_path(name):
    level = decided(PointMassConfig(climb_rate_max_mps=0.01, sink_rate_max_mps=0.01), map=name)
    assert np.all(level.waypoints[:, 2] == -ALTITUDE)


def test_a_path_climbs_no_faster_than_the_aircraft():
    for climb in (1.0, 5.0):
        vehicle = PointMassConfig(climb_rate_max_mps=climb, sink_rate_max_mps=climb)
        for made in (decided(vehicle), decided(vehicle, map="collision_38", ahead=400.0)):
            heights = np.concatenate([[-ALTITUDE], made.waypoints[:, 2]])
            assert np.all(np.abs(np.diff(heights)) <= climb * np.diff(made.times, prepend=0.0) + 1e-9)


def test_a_small_bank_makes_small_turns():
    turns = []
    for bank in (4.0, 10.0, 35.0):
        flat = {"climb_rate_max_mps": 0.01, "sink_rate_max_mps": 0.01}
        maneuver = decided(PointMassConfig(bank_max_deg=bank, **flat))
        points = np.vstack([[0.0, 0.0, -ALTITUDE], maneuver.waypoints])
        courses = np.unwrap(np.arctan2(*np.diff(points[:, :2], axis=0).T[::-1]))
        rate = 9.81 * math.tan(math.radians(bank)) / 30.0
        assert abs(courses[0]) <= rate * maneuver.times[0]
        turns.append(abs(courses[0]))
    assert turns[0] < turns[1] < turns[2]


@settings(max_examples=30)
@given(
    st.floats(150.0, 320.0), st.floats(-180, 180), st.floats(20, 120), st.floats(-150, 150), st.floats(4, 60),
    st.floats(-4, 4),
)  # fmt: skip
def test_no_maneuver_goes_below_the_least_altitude(altitude, course, speed, aside, seconds, climb):
    a = math.radians(course)
    velocity = np.array([speed * math.cos(a), speed * math.sin(a), -climb])
    start = np.array([SPEED * seconds, aside, -altitude]) - seconds * velocity
    floor = 120.0
    plan = planner(altitude_min_m=floor)
    maneuver, _ = plan.decide(0.0, north(altitude=altitude), [track(start, velocity)], [], mission(altitude))
    if maneuver is not None:
        assert np.all(-maneuver.waypoints[:, 2] >= floor - 1e-6)


def test_the_reason_names_who_when_how_near_and_what_is_done():
    plan = planner()
    intruder = track([1500.0, 20.0, -ALTITUDE], [-60.0, 0, 0], info=SourceInfo(callsign="NORTH1"))
    maneuver, events = plan.decide(0.0, north(), [intruder], [threat(t_cpa=15.2, miss=20.4, height=-0.4)], mission())
    assert events == (maneuver.reason,)
    start = r"intruder NORTH1 15 s ahead, miss 20 m and 0 m in height: "
    assert re.match(start + r"(turn (left|right) \d+ deg|climb \d+ m|descend \d+ m)", maneuver.reason)


def test_the_reason_says_what_the_path_does():
    for aside in (60.0, -60.0):
        intruder = track([1500.0, aside, -ALTITUDE], [-60.0, 0, 0])
        maneuver, _ = planner(weight_climb=1e3).decide(0.0, north(), [intruder], [threat()], mission())
        turn, _ = commanded_signs(north(), maneuver)
        assert turn != 0
        assert f"turn {'right' if turn > 0 else 'left'}" in maneuver.reason
        assert "intruder A1B2C3" in maneuver.reason


def test_the_reason_counts_further_aircraft():
    others = [head_on(20.0), track([2000.0, 300.0, -ALTITUDE], [-50.0, 0, 0], name="c0ffee")]
    maneuver, _ = planner().decide(0.0, north(), others, [threat()], mission())
    assert "(and 1 more)" in maneuver.reason
    assert set(maneuver.threat_ids) == {"a1b2c3", "c0ffee"}


def test_nothing_is_decided_without_traffic_or_with_traffic_that_passes_far_off():
    assert planner().decide(0.0, north(), [], [], mission()) == (None, ())
    assert planner().decide(0.0, north(), [track([3000, 60e3, -900], [50, 0, 0])], [], mission()) == (None, ())
    assert planner().decide(0.0, north(), [track([3000, 0, -5000], [-50, 0, 0])], [], mission()) == (None, ())
    diverging = track([-3000.0, 4000.0, -900.0], [-60.0, 30.0, 0.0])
    assert planner().decide(0.0, north(), [diverging], [], mission()) == (None, ())


def test_the_ownships_own_echo_is_not_avoided():
    echo = track([200.0, 0, -ALTITUDE], [SPEED - 30, 0, 0], is_ownship=True)
    assert planner().decide(0.0, north(), [echo], [], mission()) == (None, ())


def test_decisions_are_made_once_a_period():
    for period in (1.0, 2.0):
        plan = planner(decision_period_s=period)
        steps, _ = fly(plan, [head_on(60.0)], 90, dt=0.1)
        assert maneuvers(steps)
        changed = [b.t for a, b in itertools.pairwise(steps) if b.events or a.maneuver is not b.maneuver]
        assert changed
        for t in changed:
            assert t / period == pytest.approx(round(t / period), abs=1e-6)


def test_a_maneuver_is_kept_until_the_sky_is_clear_and_then_the_mission_is_completed():
    intruder = head_on(55.0)
    steps, world = fly(planner(), [intruder], 370, length=11e3)
    flown = [step for step in steps if step.maneuver is not None]
    assert flown and len(maneuvers(steps)) <= 4
    # One piece, so without dropping and choosing anew.
    assert flown[-1].t - flown[0].t == len(flown) - 1
    (returned,) = [step for step in steps if any("clear of traffic" in event for event in step.events)]
    assert returned.t == flown[-1].t + 1 and returned.maneuver is None
    away = [intruder.position + returned.t * intruder.velocity - returned.ownship.position]
    assert away[0] @ (intruder.velocity - returned.ownship.velocity) > 0  # opening
    signs = [commanded_signs(step.ownship, maneuver) for step, maneuver in maneuvers(steps)]
    for axis in (0, 1):
        assert len({sign[axis] for sign in signs} - {0}) <= 1
    assert world.done
    assert abs(steps[-1].ownship.position[1]) < 10 and separation(steps, intruder) > 3


def test_a_maneuver_goes_straight_on_where_the_traffic_is_still_passing():
    """A slow aircraft flies along: longer than the map's 104 s there is no way back, and no other path is needed."""
    slow = track([400.0, 0.0, -ALTITUDE], [SPEED - 2.0, 0.0, 0.0])
    steps, _ = fly(planner(), [slow], 140)
    (first, maneuver), *others = maneuvers(steps)
    legs = np.diff(maneuver.waypoints[-3:], axis=0)
    assert maneuver.times[-1] - maneuver.times[-2] == pytest.approx(60.0)
    assert maneuver.valid_until == maneuver.times[-1] == pytest.approx(first.t + 164.0)
    assert legs[1][2] == 0.0 and np.hypot(*legs[1][:2]) == pytest.approx(60.0 * SPEED)
    assert all(second.t - first.t < 90.0 for second, _ in others)


def test_what_is_lost_soon_is_escaped_at_once():
    plan = planner()
    first, _ = plan.decide(0.0, north(), [head_on(60.0)], [], mission())
    assert first is not None
    # A second aircraft comes up close on the path being flown: before the maneuver has settled.
    ahead = first.waypoints[0] - north().position
    unit = ahead / np.linalg.norm(ahead)
    other = track(unit * 100.0 * 25.0 + [0.0, 0.0, -ALTITUDE], -60.0 * unit, t=1.0, name="b00001")
    second, _ = plan.decide(1.0, north(1.0, ahead=SPEED), [head_on(59.0), other], [], mission())
    assert second is not None and second.t == 1.0


def test_the_same_situation_keeps_the_same_maneuver():
    """Nothing changes but the time: the maneuver stays the same object."""
    steps, _ = fly(planner(), [head_on(45.0)], 45)
    kept = maneuvers(steps)
    assert 1 <= len(kept) <= 3
    for (first, _), (second, _) in itertools.pairwise(kept):
        assert second.t - first.t >= LocalLevelConfig().settle_s


def test_a_completed_mission_ends_maneuvers():
    plan = planner()
    assert plan.decide(0.0, north(), [head_on(15.0)], [], mission())[0] is not None
    done = dataclasses.replace(mission(), index=2)
    assert plan.decide(1.0, north(1.0), [head_on(15.0)], [], done) == (None, ())


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("what", ["position", "velocity", "covariance"])
def test_a_track_that_is_not_finite_is_said_and_neither_hides_the_others_nor_breaks_anything(what, bad):
    good = head_on(15.0)
    values = getattr(good, what).copy()
    values[1] = bad
    wrong = dataclasses.replace(good, id="bad000", **{what: values})
    alone, reason = planner().decide(0.0, north(), [good], [], mission())
    both, same = planner().decide(0.0, north(), [wrong, good], [], mission())
    said = ("track BAD000 is not finite: it cannot be avoided",)
    assert same == (*said, *reason) and np.array_equal(alone.waypoints, both.waypoints)
    assert both.threat_ids == ("a1b2c3",)
    assert planner().decide(0.0, north(), [wrong], [], mission()) == (None, said)


def test_the_same_inputs_give_the_same_decisions():
    flights = [fly(planner(), [head_on(50.0), track([3000, 2500, -880], [0, -45, 0], name="b")], 70)[0] for _ in "ab"]
    for a, b in zip(*flights, strict=True):
        assert a.events == b.events and np.array_equal(a.ownship.position, b.ownship.position)


def test_more_buffer_to_keep_than_to_choose_is_refused():
    with pytest.raises(ValueError, match="keep_buffer must not exceed buffer"):
        LocalLevelConfig(buffer=1.0, keep_buffer=1.2)


def test_limits_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="altitude_max_m"):
        LocalLevelConfig(altitude_min_m=500.0, altitude_max_m=400.0)
    with pytest.raises(ValueError, match="hard_radius_m"):
        LocalLevelConfig(hard_radius_m=2000.0)
