"""The clutter map: a forgetting mean against its naive twin, what stays, what passes, what ages."""

import numpy as np
import pytest

from tests.naive.radar_processing import clutter_map
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.clutter_map import ClutterMap
from wideberth.sensors.radar.processing.config import ProcessingConfig

FORGETS = 20.0
RADAR = RadarConfig(
    sweep_time_ms=0.512,
    if_bandwidth_mhz=0.125,
    averages=8,
    processing=ProcessingConfig(clutter_filter="map", clutter_map_frames=FORGETS),
)
SHAPE = (RADAR.channels, RADAR.range_bins)
ALL = np.ones(RADAR.channels, np.bool_)


def frames(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).gamma(8.0, 1.0 / 8.0, (n, *SHAPE))


def learned(powers: np.ndarray, used: np.ndarray | None = None) -> ClutterMap:
    known = ClutterMap(RADAR)
    for k, frame in enumerate(powers):
        known.learn(frame, 8.0, ALL if used is None else used[k])
    return known


def test_the_map_is_that_of_its_naive_twin() -> None:
    powers = frames(50)
    powers[7, 1, 9] = 1e6  # far beyond what a frame may count for
    used = np.random.default_rng(1).random((50, RADAR.channels)) < 0.8
    found = learned(powers, used).statistics(5.0)
    assert found is not None and (found.power > 0.0).all()
    np.testing.assert_allclose(found.power, clutter_map(powers, used, FORGETS, 4.0), rtol=1e-12)


def test_before_the_first_frame_nothing_is_known_and_channels_never_seen_have_no_power() -> None:
    assert ClutterMap(RADAR).statistics(0.0) is None
    some = ALL.copy()
    some[2] = False
    found = learned(frames(3), np.tile(some, (3, 1))).statistics(0.0)
    assert found is not None and not found.power[2].any() and (found.power[some] > 0.0).all()


def test_a_scene_that_stands_still_is_the_map_and_one_that_moves_is_not() -> None:
    powers = frames(120, 2)
    powers[:, :, 20] += 50.0
    for k in range(120):
        powers[k, :, 30 + (k // 4) % 30] += 50.0  # four frames in a bin, and on
    found = learned(powers).statistics(0.0)
    assert found is not None
    assert found.power[:, 20] == pytest.approx(51.0, rel=0.03)
    # A frame counts for four times the map at most: what passes leaves little.
    assert (found.power[:, 30:60] < 4.0).all() and np.median(found.power[:, 30:60]) < 1.7


def test_what_has_gone_is_forgotten_within_the_frames_that_are_set() -> None:
    powers = frames(200, 3)
    powers[:100, :, 40] += 50.0
    after = [learned(powers[:n]).statistics(0.0) for n in (100, 120, 200)]
    levels = [float(s.power[:, 40].mean()) for s in after if s is not None]
    assert levels[0] == pytest.approx(51.0, rel=0.03)
    assert levels[1] == pytest.approx(1.0 + 50.0 * (1.0 - 1.0 / FORGETS) ** 20, rel=0.03)
    assert levels[2] < 1.5


def test_the_map_is_worth_as_many_samples_as_it_remembers() -> None:
    few, many = (learned(frames(n, 4)).statistics(0.0) for n in (4, 400))
    assert few is not None and many is not None
    assert few.samples == pytest.approx(4.0 * 8.0)
    # A mean that forgets with the share a = 1/20 is worth (2 - a) / a frames.
    assert many.samples == pytest.approx((2.0 * FORGETS - 1.0) * 8.0, rel=1e-3)
    spread = float(np.std(many.power))
    assert spread == pytest.approx(1.0 / np.sqrt(many.samples), rel=0.1)
