"""The vertical planners: events, what is kept, switches, limits, and bad input."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tests.made_vertical_runs import fly
from tests.made_waypoint_runs import SMALL_WING, SPEED, Straight, tracks_of
from wideberth.avoidance.keep_out.config import PolygonKeepOut
from wideberth.avoidance.vertical.config import BangBangConfig, ContinuousConfig
from wideberth.avoidance.vertical.planner import BangBangPlanner, ContinuousPlanner
from wideberth.avoidance.vertical.way_ahead import few_points, way_ahead
from wideberth.types import Mission, Ownship, TrackStatus
from wideberth.vehicles.point_mass import parameters

BOTH = pytest.mark.parametrize("kind", [BangBangPlanner, ContinuousPlanner])
HEAD_ON = [([700.0, 20.0, -200.0], [-17.0, 0.0, 0.0])]
NEAR = [([480.0, 20.0, -200.0], [-17.0, 0.0, 0.0])]  # soon enough for the bang-bang controller too


def mission(waypoints: Any = ((0.0, 0.0, -200.0), (1400.0, 0.0, -200.0)), index: int = 1) -> Mission:
    return Mission(np.array(waypoints, float), np.full(len(waypoints), SPEED), 0.0, index)


def own(position: Any = (0.0, 0.0, -200.0), t: float = 0.0) -> Ownship:
    return Ownship(t, np.array(position, float), np.array([SPEED, 0.0, 0.0]))


def decided(kind: Any, intruders: Any = NEAR, n: int = 5, change: Any = None, **config: Any) -> Any:
    """The last of n decisions in a row, all events, and the planner."""
    part = kind(kind.Config(**config), parameters(SMALL_WING))
    maneuver, events = None, []
    for k in range(n):
        t = 0.1 * k
        tracks = tracks_of(Straight(intruders).truth(t))
        maneuver, said = part.decide(
            t, own((SPEED * t, 0, -200), t), [change(o) if change else o for o in tracks], (), mission()
        )
        events += said
    return maneuver, events, part


@BOTH
def test_start_reason_command_and_end_are_told(kind: Any) -> None:
    flown = fly(kind, HEAD_ON)
    start, end = flown.events
    assert start.startswith("avoidance begins (current trajectory): intruder I0: climb ")
    assert ", at up to " in start and start.endswith(" m/s")
    assert end.startswith("avoidance ends after ") and end.endswith("return to the mission")
    (maneuver,) = flown.maneuvers
    assert maneuver.reason in start and maneuver.threat_ids == ("i0",) and not maneuver.least_bad
    # One path: up, past, and back to the mission's altitude.
    np.testing.assert_allclose(maneuver.waypoints[-1, 2], -200.0, atol=1.0)
    assert maneuver.waypoints[:, 1] == pytest.approx(0.0)
    assert (np.diff(maneuver.times) > 0.0).all() and maneuver.valid_until > maneuver.times[-1]


@BOTH
def test_so_many_decisions_begin_a_maneuver_and_it_is_kept(kind: Any) -> None:
    assert decided(kind, n=2)[0] is None
    first, _, part = decided(kind, n=3)
    assert first is not None
    again, said = part.decide(0.25, own((3.2, 0, -200), 0.25), tracks_of(Straight(NEAR).truth(0.25)), (), mission())
    assert again is first and said == ()


@BOTH
def test_switches(kind: Any) -> None:
    assert decided(kind, disable=True)[0] is None
    far_above = [([480.0, 20.0, -330.0], [-17.0, 0.0, 0.0])]
    assert decided(kind, far_above)[0] is None
    maneuver, events, _ = decided(kind, far_above, force=True)
    assert maneuver is not None and events[0].startswith("avoidance begins (forced)")
    for direction, sign in (("climb", -1), ("descend", 1)):
        maneuver, _, _ = decided(kind, direction=direction)
        away = maneuver.waypoints[:, 2] + 200.0
        assert np.sign(away[np.argmax(np.abs(away))]) == sign


@BOTH
def test_floor_and_keep_outs_turn_it_to_the_other_side(kind: Any) -> None:
    above = PolygonKeepOut(vertices_m=((-100, -100), (2000, -100), (2000, 100), (-100, 100)), altitude_min_m=205.0)
    below = above.model_copy(update={"altitude_min_m": -1e5, "altitude_max_m": 195.0})
    higher = [([520.0, 20.0, -190.0], [-17.0, 0.0, 0.0])]  # a little below us: we would climb
    assert fly(kind, higher).highest > 220.0
    flown = fly(kind, higher, keep_out=(above,))
    assert flown.highest < 205.0 and flown.lowest < 180.0
    flown = fly(kind, [([520.0, 20.0, -210.0], [-17.0, 0.0, 0.0])], altitude_min_m=195.0)
    assert flown.highest > 220.0 and flown.lowest >= 195.0
    flown = fly(kind, higher, keep_out=(above, below))
    assert flown.counters["blocked"] > 0
    assert flown.highest < 205.0 and flown.lowest > 195.0
    assert [event for event in flown.events if "blocked" in event][:1] == [
        "avoidance is blocked: keep-out volumes above and below"
    ]


@BOTH
def test_a_mission_below_the_floor_is_never_left_downwards(kind: Any) -> None:
    flown = fly(kind, [([700.0, 20.0, -205.0], [-17.0, 0.0, 0.0])], altitude_min_m=230.0)
    assert flown.least >= 1.0 and flown.lowest > 199.0 and flown.done


@BOTH
def test_limits_are_those_given_and_at_most_the_vehicles(kind: Any) -> None:
    for limit, expected in ((1.5, 1.5), (50.0, 3.8)):
        maneuver, _, _ = decided(kind, climb_rate_max_mps=limit, direction="climb")
        points = np.vstack([own((SPEED * maneuver.t, 0, -200)).position, maneuver.waypoints])
        rates = -np.diff(points[:, 2]) / np.diff(np.concatenate([[maneuver.t], maneuver.times]))
        assert rates.max() == pytest.approx(expected, rel=0.05)


def test_the_path_follows_the_missions_corners() -> None:
    corner = mission([[0, 0, -200], [100, 0, -200], [100, 800, -240]])
    places, corners = way_ahead(np.array([0.0, 0, -200]), corner, 10.0, 0.5, 100)
    assert corners == pytest.approx([5.0, 10.0])  # where the line is joined, and the corner
    assert places[30, :4] == pytest.approx([100.0, 50.0, 0.0, 10.0])
    assert places[30, 4] == pytest.approx(-202.5) and places[30, 5] == pytest.approx(-0.5)
    down = np.where(np.arange(41) < 20, np.arange(41), 20.0)
    assert few_points(0.5 * np.arange(41, dtype=np.float64), down, np.array([3.0]), 0.1) == pytest.approx(
        [3.0, 10.0, 20.0]
    )


@BOTH
@pytest.mark.parametrize("field", ["position", "velocity", "covariance"])
def test_tracks_that_are_not_finite_are_counted_and_said_once(kind: Any, field: str) -> None:
    def broken(track: Any) -> Any:
        return dataclasses.replace(track, **{field: np.full_like(getattr(track, field), np.nan)})

    maneuver, events, part = decided(kind, change=broken)
    assert part.counters["not_finite"] == 5
    assert sum("not finite" in event for event in events) == 1
    assert part.counters["unusable"] == (5 if field == "position" else 0)
    assert (maneuver is not None) == (field == "covariance")


@BOTH
def test_what_is_stale_tentative_or_ourselves_is_not_avoided(kind: Any) -> None:
    for changes in ({"is_ownship": True}, {"status": TrackStatus.TENTATIVE}, {"t_last_update": -30.0}):
        maneuver, events, part = decided(kind, change=lambda o, c=changes: dataclasses.replace(o, **c))
        assert maneuver is None
        stale = "t_last_update" in changes
        assert part.counters["stale"] == 5 * stale
        assert sum("no longer avoided" in event for event in events) == stale


@BOTH
def test_late_tracks_are_moved_on_unless_told_otherwise(kind: Any) -> None:
    # 10 s old: the intruder is 170 m nearer than it says.
    far = [([650.0, 20.0, -200.0], [-17.0, 0.0, 0.0])]
    late = lambda o: dataclasses.replace(o, t=o.t - 10.0)  # noqa: E731
    lookahead: Any = {"lookahead_s": 12.0}
    assert decided(kind, far, change=late, **lookahead)[0] is not None
    assert decided(kind, far, change=late, delay_compensation="none", **lookahead)[0] is None
    assert decided(kind, far, delay_compensation="estimate", delay_estimate_s=10.0, **lookahead)[0] is not None


@BOTH
def test_clocks_that_go_back_and_missions_that_are_over(kind: Any) -> None:
    _, _, part = decided(kind)
    none, said = part.decide(0.1, own((1.3, 0, -200), 0.1), (), (), mission())
    assert none is None and said[0].startswith("the clock went back by 0.3 s")
    assert part.decide(2.0, own(t=2.0), tracks_of(Straight(NEAR).truth(2.0)), (), mission(index=2)) == (None, ())
    assert {part.counters[name] for name in ("clock", "no_waypoints_left")} == {1}


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"altitude_min_m": 100.0, "altitude_max_m": 90.0}, "above altitude_min_m"),
        ({"force": True, "disable": True}, "exclude each other"),
        ({"separation_m": float("nan")}, "separation_m"),
        ({"zone": "cube"}, "zone"),
        ({"threshold": {"kind": "table"}}, "table_file"),
        ({"hysteresis_m": 200.0}, "hysteresis_m"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changes: Any, match: str) -> None:
    with pytest.raises(ValidationError, match=match):
        ContinuousConfig(**changes)


def test_a_threshold_by_test_is_for_bang_bang_only() -> None:
    assert BangBangConfig(threshold={"start": "hypothesis_test"}).kernel == "bang_bang"
    with pytest.raises(ValidationError, match="corrects itself"):
        ContinuousConfig(threshold={"start": "hypothesis_test"})
