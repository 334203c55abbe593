"""Conflicts along waypoints: the stays of algorithms 4 and 5, degenerate paths, and refused input."""

import math

import numpy as np
import pytest

from wideberth.conflict import cylinder_kernels as kernels
from wideberth.conflict.cylinder import PathConflict, path_conflict

CASE = {
    "own_position": [0.0, 0.0, -100.0],
    "own_speed": 10.0,
    "waypoints": [[500.0, 0.0, -100.0], [500.0, 500.0, -100.0]],
    "intruder_position": [1000.0, 0.0, -100.0],
    "intruder_velocity": [-15.0, 0.0, 0.0],
    "safety_radius": 100.0,
    "safety_height": 40.0,
    "distance_threshold": 50.0,
    "height_threshold": 20.0,
    "time_threshold": 60.0,
}


def judged(**changes: object) -> PathConflict:
    return path_conflict(**{**CASE, **changes})  # type: ignore[arg-type]


# Errata, "Collision detection with waypoints": unit vectors for algorithm 5 with h_s = 20.
@pytest.mark.parametrize(
    ("h", "rate", "stay"),
    [
        (100, -10, (9.0, 11.0)),
        (-100, 10, (9.0, 11.0)),
        (-5, 10, (0.0, 1.5)),
        (-5, -10, (0.0, 0.5)),
        (5, 10, (0.0, 0.5)),
        (5, -10, (0.0, 1.5)),
        (5, 0, (0.0, math.inf)),
        (10, 5, (0.0, 0.0)),
        (10, -5, (0.0, 4.0)),
    ],
)
def test_vertical_stay(h: float, rate: float, stay: tuple[float, float]) -> None:
    assert kernels.vertical_stay(float(h), float(rate), 10.0) == pytest.approx(stay)


@pytest.mark.parametrize(("h", "rate"), [(100, 10), (-100, -10), (20, 0)])
def test_no_vertical_stay(h: float, rate: float) -> None:
    assert math.isnan(kernels.vertical_stay(float(h), float(rate), 10.0)[0])


@pytest.mark.parametrize(
    ("s", "v", "stay"),
    [
        ((-30, 0), (10, 0), (2.0, 4.0)),
        ((-30, 10), (10, 0), (3.0, 3.0)),  # a tangent touches
        ((0, 0), (0, 0), (0.0, math.inf)),
        ((10, 0), (1, 0), (0.0, 0.0)),  # leaving from the bound
        ((10, 0), (0, 5), (0.0, 0.0)),  # along the tangent of the bound
        ((10, 0), (-1, 0), (0.0, 20.0)),
        ((10, 0), (0, 0), (0.0, math.inf)),
    ],
)
def test_horizontal_stay(s: tuple[float, float], v: tuple[float, float], stay: tuple[float, float]) -> None:
    sx, sy, vx, vy = (float(x) for x in (*s, *v))
    assert kernels.horizontal_stay(sx, sy, vx, vy, 10.0) == pytest.approx(stay)


def test_head_on_enters_where_closing_speed_says() -> None:
    result = judged()
    assert result.penetration_flags.tolist() == result.alert_flags.tolist() == [True, False]
    assert result.entry_time[0] == pytest.approx(36.0)
    assert result.exit_time[0] == pytest.approx(44.0)
    assert result.first_entry_time == result.first_alert_entry_time == pytest.approx(36.0)


def test_only_a_path_that_turns_is_hit_after_its_turn() -> None:
    # The intruder crosses the second leg; straight on, they would never meet.
    result = judged(intruder_position=[500.0, 1000.0, -100.0], intruder_velocity=[0.0, -5.0, 0.0])
    assert result.penetration_flags.tolist() == [False, True]
    assert result.entry_time[1] == pytest.approx(50.0 + (750.0 - 100.0) / 15.0)


def test_thresholds_make_the_alert() -> None:
    late = judged(time_threshold=30.0)
    assert late.penetration_flags.any()
    assert not late.collision
    assert math.isnan(late.first_alert_entry_time)
    # Near now counts whatever the time; the height on either side (errata).
    assert judged(time_threshold=30.0, distance_threshold=1000.0, height_threshold=0.0).collision
    below = judged(intruder_position=[1000.0, 0.0, -85.0], time_threshold=30.0, distance_threshold=1000.0)
    above = judged(intruder_position=[1000.0, 0.0, -115.0], time_threshold=30.0, distance_threshold=1000.0)
    assert below.collision
    assert above.collision
    assert not judged(
        intruder_position=[1000.0, 0.0, -115.0], time_threshold=30.0, distance_threshold=1000.0, height_threshold=14.0
    ).collision


def test_standing_ownship_never_reaches_its_waypoints() -> None:
    result = judged(own_speed=0.0)
    assert result.penetration_flags.tolist() == [True, False]
    assert result.entry_time[0] == pytest.approx(60.0)
    assert result.exit_time[0] == pytest.approx(1100.0 / 15.0)
    assert math.isnan(result.beyond_last_entry_time)
    for_ever = judged(own_speed=0.0, intruder_position=[50.0, 0.0, -100.0], intruder_velocity=[0.0, 0.0, 0.0])
    assert (for_ever.entry_time[0], for_ever.exit_time[0]) == (0.0, math.inf)


def test_repeated_waypoint_is_an_instant() -> None:
    result = judged(waypoints=[[500.0, 0.0, -100.0]] * 2 + [[500.0, 500.0, -100.0]], intruder_velocity=[-9.0, 0.0, 0.0])
    assert result.penetration_flags.tolist() == [True, True, True]
    assert result.entry_time[1] == result.exit_time[1] == 50.0
    missed = judged(waypoints=[[0.0, 0.0, -100.0], [0.0, 0.0, -100.0]])
    assert not missed.penetration_flags.any()
    # No leg has a direction: it stays there.
    assert missed.beyond_last_entry_time == pytest.approx(60.0)


def test_beyond_the_last_waypoint_is_told_apart() -> None:
    one = {"waypoints": [[100.0, 0.0, -100.0]]}
    along, hover = judged(**one), judged(**one, beyond="hover")
    assert not along.penetration_flags.any()
    assert math.isnan(along.first_entry_time)
    assert along.beyond_last_entry_time == pytest.approx(36.0)
    assert hover.beyond_last_entry_time == pytest.approx((1000.0 - 200.0) / 15.0)


def test_speed_of_each_segment() -> None:
    same, slow = judged(own_speed=[10.0, 10.0]), judged(own_speed=[10.0, 5.0])
    assert same.exit_time == pytest.approx(judged().exit_time, nan_ok=True)
    assert slow.exit_time[1] != same.exit_time[1]
    stops = judged(own_speed=[10.0, 0.0], intruder_position=[500.0, 1000.0, -100.0], intruder_velocity=[0.0, -5.0, 0.0])
    assert stops.entry_time[1] == pytest.approx(900.0 / 5.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"own_position": [0.0, 0.0]}, "own_position must have shape"),
        ({"own_position": [0.0, math.nan, 0.0]}, "own_position must be finite"),
        ({"own_speed": -1.0}, "own_speed must be finite and not negative"),
        ({"own_speed": [1.0, 2.0, 3.0]}, "own_speed must be one number or one for each waypoint"),
        ({"waypoints": np.empty((0, 3))}, "n >= 1"),
        ({"waypoints": [0.0, 0.0, 0.0]}, "waypoints must have shape"),
        ({"waypoints": [[0.0, math.inf, 0.0]]}, "waypoints must be finite"),
        ({"intruder_velocity": "fast"}, "intruder_velocity must be numbers"),
        ({"safety_radius": 0.0}, "safety_radius must be positive"),
        ({"safety_height": -1.0}, "safety_height must be positive"),
        ({"safety_radius": [1.0, 2.0]}, "safety_radius must be one number"),
        ({"time_threshold": -1.0}, "time_threshold must be not negative"),
        ({"distance_threshold": math.nan}, "distance_threshold must be not negative"),
        ({"beyond": "land"}, "beyond must be"),
    ],
)
def test_bad_input_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        judged(**changes)
