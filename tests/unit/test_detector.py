"""Threats and levels of the detector."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detector import AdsbDetector
from wideberth.conflict.well_clear import PRESETS, conflict_interval
from wideberth.types import AlertLevel, Ownship, Track, TrackStatus

OWN = Ownship(0.0, np.zeros(3), np.array([41.0, 0.0, 0.0]))


def track(position: list[float], velocity: list[float], *, t: float = 0.0, sigma: float = 10.0) -> Track:
    covariance = np.diag([sigma**2] * 3 + [0.25] * 3 + [0.01] * 3)
    return Track("a1", t, np.array(position, float), np.array(velocity, float), np.zeros(3), covariance,
                 TrackStatus.CONFIRMED, t)  # fmt: skip


def level(intruder: Track, config: DetectionConfig | None = None) -> AlertLevel:
    (threat,) = AdsbDetector(config or DetectionConfig()).assess(0.0, OWN, [intruder])
    return threat.level


def test_levels_of_a_head_on_rise_with_time() -> None:
    closing = 82.0
    levels = [level(track([closing * t, 50.0, 0.0], [-41.0, 0.0, 0.0])) for t in (250.0, 140.0, 80.0, 20.0)]
    assert levels == [AlertLevel.CLEAR, AlertLevel.PREVENTIVE, AlertLevel.CORRECTIVE, AlertLevel.WARNING]


def test_near_but_diverging_is_preventive_and_far_above_is_clear() -> None:
    assert level(track([-1500.0, 0.0, 0.0], [-41.0, 0.0, 0.0])) is AlertLevel.PREVENTIVE
    assert level(track([800.0, 0.0, -900.0], [-41.0, 0.0, 0.0])) is AlertLevel.CLEAR


def test_intruder_that_sinks_through_our_height_inside_the_circle_is_a_warning() -> None:
    # Same course and speed 100 m ahead, 150 m above, sinking with 10 m/s: no horizontal motion, collision in 12 s.
    assert level(track([100.0, 0.0, -150.0], [41.0, 0.0, 10.0])) is AlertLevel.WARNING


def test_interval_is_that_of_the_well_clear_volume() -> None:
    intruder = track([6000.0, 1000.0, 30.0], [-60.0, -4.0, 0.0])
    (threat,) = AdsbDetector(DetectionConfig()).assess(0.0, OWN, [intruder])
    t_in, t_out = conflict_interval(
        PRESETS["sarp"], OWN.position, OWN.velocity, intruder.position, intruder.velocity, 110.0, miss_filter=False
    )
    np.testing.assert_allclose(threat.interval, (t_in, t_out))
    assert threat.time_to_loss == threat.interval[0]
    assert 0 < threat.t_cpa < 110
    assert 0.5 < threat.probability <= 1.0


def test_no_loss_is_nan() -> None:
    (threat,) = AdsbDetector(DetectionConfig()).assess(0.0, OWN, [track([0.0, 20_000.0, 0.0], [41.0, 0.0, 0.0])])
    assert math.isnan(threat.time_to_loss)
    assert math.isnan(threat.interval[1])
    assert threat.probability < 1e-6


def test_older_track_is_extrapolated() -> None:
    now = track([1000.0, 0.0, 0.0], [-41.0, 0.0, 0.0])
    old = track([1000.0 + 41.0 * 5, 0.0, 0.0], [-41.0, 0.0, 0.0], t=-5.0)
    detector = AdsbDetector(DetectionConfig())
    (a,), (b,) = detector.assess(0.0, OWN, [now]), detector.assess(0.0, OWN, [old])
    assert b.t_cpa == pytest.approx(a.t_cpa)
    assert b.horizontal_miss == pytest.approx(a.horizontal_miss, abs=1e-6)


def test_uncertainty_raises_the_level() -> None:
    passing = track([1400.0, 380.0, 0.0], [-41.0, 0.0, 0.0])
    assert level(passing) < AlertLevel.WARNING
    assert level(replace(passing, covariance=passing.covariance * 400)) is AlertLevel.WARNING
    assert level(passing, DetectionConfig(sigma="paper")) is AlertLevel.WARNING


def lost(intruder: Track, age: float) -> Track:
    """Return the track as carried on `age` seconds after its last report: same state, sigmas that have grown."""
    covariance = intruder.covariance.copy()
    covariance[:3, :3] += np.eye(3) * (12.0 * age) ** 2
    return replace(intruder, covariance=covariance, status=TrackStatus.COASTING, existence=math.exp(-age / 60.0))


def test_a_lost_aircraft_is_no_warning_for_its_uncertainty_alone() -> None:
    seen = track([500.0, 0.0, -1100.0], [-41.0, 0.0, 0.0])
    assert level(seen) is AlertLevel.CLEAR
    (threat,) = AdsbDetector(DetectionConfig()).assess(0.0, OWN, [lost(seen, 40.0)])
    assert threat.probability < 0.05
    assert threat.level < AlertLevel.WARNING


@pytest.mark.parametrize("volume", ["sarp", "astm_f3442", "nmac"])
@pytest.mark.parametrize("age", [0.0, 5.0, 40.0])
def test_a_collision_course_is_a_warning_however_old_the_track(volume: str, age: float) -> None:
    config = DetectionConfig(well_clear_volume=volume)
    for east, down in ((0.0, 0.0), (140.0, 25.0), (-140.0, -25.0)):
        assert level(lost(track([1600.0, east, down], [-41.0, 0.0, 0.0]), age), config) is AlertLevel.WARNING


def test_track_without_a_state_is_unknown_and_own_echo_clear() -> None:
    bad = track([math.nan, 0.0, 0.0], [0.0, 0.0, 0.0])
    assert level(bad) is AlertLevel.UNKNOWN
    assert level(replace(track([0.0, 0.0, 0.0], [41.0, 0.0, 0.0]), is_ownship=True)) is AlertLevel.CLEAR


def test_one_threat_for_every_track_in_order() -> None:
    tracks = [replace(track([1000.0 * k, 0.0, 0.0], [0.0, 0.0, 0.0]), id=str(k)) for k in range(7)]
    threats = AdsbDetector(DetectionConfig()).assess(0.0, OWN, tracks)
    assert [threat.track_id for threat in threats] == [str(k) for k in range(7)]
    assert AdsbDetector(DetectionConfig()).assess(0.0, OWN, []) == ()


def test_configuration_refuses_disorder() -> None:
    with pytest.raises(ValidationError, match="warning_time_s <= corrective_time_s"):
        DetectionConfig(warning_time_s=90.0)
    with pytest.raises(ValidationError, match="lookahead"):
        DetectionConfig(lookahead=60.0)  # type: ignore[call-arg]
