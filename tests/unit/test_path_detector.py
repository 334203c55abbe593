"""The detector that judges the path to be flown: threats, levels, and which path it takes."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.conflict.config import PathCylinderConfig
from wideberth.conflict.cylinder import path_conflict
from wideberth.conflict.path_detector import PathCylinderDetector
from wideberth.types import AlertLevel, Maneuver, Mission, Ownship, Threat, Track, TrackStatus

OWN = Ownship(0.0, np.array([0.0, 0.0, -200.0]), np.array([15.0, 0.0, 0.0]))
# East after 600 m north.
MISSION = Mission(
    np.array([[-500.0, 0.0, -200.0], [600.0, 0.0, -200.0], [600.0, 900.0, -200.0]]), np.array([15.0, 15.0, 20.0]), 0.0
)


def track(position: list[float], velocity: list[float], acceleration: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Track:
    covariance = np.diag([10.0**2] * 3 + [0.25] * 3 + [0.01] * 3)
    return Track("a1", 0.0, np.array(position), np.array(velocity), np.array(acceleration), covariance,
                 TrackStatus.CONFIRMED, 0.0)  # fmt: skip


def assess(intruder: Track, path: Mission | Maneuver | None = MISSION, t: float = 0.0, **config: Any) -> Threat:
    detector = PathCylinderDetector(PathCylinderConfig(**config))
    (threat,) = detector.assess(t, replace(OWN, t=t), [intruder], path)
    return threat


def test_an_intruder_on_the_second_leg_is_found_only_with_the_mission() -> None:
    intruder = track([600.0, 1300.0, -200.0], [0.0, -5.0, 0.0])
    threat = assess(intruder)
    expected = path_conflict(
        own_position=OWN.position,
        own_speed=[15.0, 20.0],
        waypoints=MISSION.waypoints[1:],
        intruder_position=intruder.position,
        intruder_velocity=intruder.velocity,
        safety_radius=152.4,
        safety_height=60.96,
    )
    assert threat.time_to_loss == pytest.approx(expected.first_entry_time)
    assert threat.interval == pytest.approx((expected.first_entry_time, expected.exit_time[1]))
    assert threat.level is AlertLevel.PREVENTIVE
    assert 0.4 < threat.probability < 0.6  # of the height, mostly
    assert threat.horizontal_miss == pytest.approx(0.0, abs=1e-9)
    assert assess(intruder, None).level is AlertLevel.CLEAR
    assert assess(intruder, replace(MISSION, index=3)).level is AlertLevel.CLEAR


def test_levels_rise_with_time() -> None:
    levels = [assess(track([d, 0.0, -200.0], [-15.0, 0.0, 0.0]), time_threshold_s=25.0).level for d in (1050, 850, 500)]
    assert levels == [AlertLevel.PREVENTIVE, AlertLevel.CORRECTIVE, AlertLevel.WARNING]
    # Near now counts whenever it enters.
    chasing = track([-400.0, 0.0, -200.0], [20.0, 0.0, 0.0])
    assert assess(chasing).level is AlertLevel.CORRECTIVE
    assert assess(chasing, distance_threshold_m=300.0).level is AlertLevel.PREVENTIVE


def test_after_the_last_waypoint_is_preventive_without_a_time() -> None:
    threat = assess(track([600.0, 1300.0, -200.0], [0.0, 0.0, 0.0]))
    assert threat.level is AlertLevel.PREVENTIVE
    assert math.isnan(threat.time_to_loss)
    assert assess(track([600.0, 1300.0, -200.0], [0.0, 0.0, 0.0]), beyond="hover").level is AlertLevel.CLEAR


def test_a_stay_over_a_waypoint_is_one() -> None:
    threat = assess(track([500.0, 100.0, -200.0], [0.0, 0.0, 0.0]))
    assert threat.interval[0] < 40.0 < threat.interval[1]


def test_the_path_of_a_maneuver_is_timed() -> None:
    maneuver = Maneuver(0.0, MISSION.waypoints[1:], np.array([60.0, 105.0]), "test", 200.0)
    slow, on_time = (
        assess(track([600.0, 0.0, -200.0], [0.0, 0.0, 0.0]), maneuver),
        assess(track([600.0, 0.0, -200.0], [0.0, 0.0, 0.0])),
    )
    assert slow.time_to_loss == pytest.approx((600.0 - 152.4) / 10.0)
    assert on_time.time_to_loss == pytest.approx((600.0 - 152.4) / 15.0)
    later = assess(track([600.0, 900.0, -200.0], [0.0, 0.0, 0.0]), maneuver, t=70.0)
    assert later.time_to_loss < 35.0


def test_turning_intruders() -> None:
    # Straight on it passes far behind; turning left by 3 deg/s it comes round.
    turn = track([300.0, -600.0, -200.0], [20.0, 0.0, 0.0], (0.0, 20.0 * math.radians(3.0), 0.0))
    assert assess(turn).level is AlertLevel.CLEAR
    curved = assess(turn, motion="turning", maneuver_time_s=60.0, lookahead_s=120.0)
    assert curved.level > AlertLevel.CLEAR
    braking = track([400.0, 0.0, -200.0], [30.0, 0.0, 0.0], (-1.0, 0.0, 0.0))
    assert assess(braking, None).level is AlertLevel.CLEAR
    assert assess(braking, None, motion="constant_acceleration", maneuver_time_s=20.0).level > AlertLevel.CLEAR


def test_states_that_say_nothing() -> None:
    good = track([600.0, 0.0, -200.0], [0.0, 0.0, 0.0])
    assert assess(replace(good, position=np.array([math.nan, 0.0, 0.0]))).level is AlertLevel.UNKNOWN
    assert assess(replace(good, is_ownship=True)).level is AlertLevel.CLEAR
    detector = PathCylinderDetector(PathCylinderConfig())
    assert detector.assess(0.0, OWN, [], MISSION) == ()
    standing = replace(OWN, velocity=np.zeros(3))
    (threat,) = detector.assess(0.0, standing, [track([600.0, 0.0, -200.0], [-10.0, 0.0, 0.0])])
    assert threat.time_to_loss == pytest.approx(44.76)


def test_older_track_is_extrapolated() -> None:
    now = track([900.0, 0.0, -200.0], [-15.0, 0.0, 0.0])
    old = replace(now, t=-4.0, position=np.array([960.0, 0.0, -200.0]))
    for motion in ("constant_velocity", "turning"):
        assert assess(old, motion=motion).interval == pytest.approx(assess(now, motion=motion).interval)


def test_flags_by_segment() -> None:
    (conflict,) = PathCylinderDetector(PathCylinderConfig()).conflicts(
        0.0, OWN, [track([600.0, 1300.0, -200.0], [0.0, -5.0, 0.0])], MISSION
    )
    assert conflict.penetration_flags.tolist() == [False, True]


def test_config_is_checked() -> None:
    with pytest.raises(ValidationError, match="warning_time_s <="):
        PathCylinderConfig(warning_time_s=50.0)


def test_several_tracks_are_judged_like_each_alone() -> None:
    tracks = [
        track([600.0, 40.0, -200.0], [0.0, 0.0, 0.0]),
        replace(track([100.0, 0.0, -200.0], [0.0, 0.0, 0.0]), is_ownship=True),
        replace(track([960.0, -30.0, -190.0], [-15.0, 0.0, 0.0]), t=-4.0),
        replace(track([600.0, 0.0, -200.0], [0.0, 0.0, 0.0]), covariance=np.full((9, 9), math.nan)),
        track([600.0, 1300.0, -200.0], [0.0, -5.0, 0.0]),
    ]
    for motion in ("constant_velocity", "turning"):
        detector = PathCylinderDetector(PathCylinderConfig(motion=motion))
        together = detector.assess(0.0, OWN, tracks, MISSION)
        alone = [detector.assess(0.0, OWN, [one], MISSION)[0] for one in tracks]
        assert [repr(threat) for threat in together] == [repr(threat) for threat in alone]
        flags = detector.conflicts(0.0, OWN, tracks, MISSION)
        assert [repr(one) for one in flags] == [repr(detector.conflicts(0.0, OWN, [one], MISSION)[0]) for one in tracks]
