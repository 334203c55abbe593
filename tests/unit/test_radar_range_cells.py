"""What range bins make of an echo, and groups of bins of noise: against sums, trials and simulated samples."""

import itertools
import os

import numpy as np
import pytest

from tests.naive import radar_range_cells as naive
from wideberth.sensors.radar import range_cells_kernels as kernels
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power, snr_db
from wideberth.sensors.radar.processing.averaging import detection_power
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.processing.detection_level import detection_threshold, searched_bins
from wideberth.sensors.radar.processing.frame import process_frame
from wideberth.sensors.radar.processing.frame_powers import frame_image, frame_powers
from wideberth.sensors.radar.processing.noise_statistics import theoretical_noise
from wideberth.sensors.radar.range_cells import (
    beat_bins,
    bin_shares,
    cells_searched,
    false_plot_probability,
    group_probability,
    migration_paths,
    window_noise_gain,
)
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

SMALL = RadarConfig(if_bandwidth_mhz=0.125, averages=24, channels=4, false_alarm_probability=0.01)
FOLLOWS = SMALL.model_copy(update={"migration_corrected": True})


@pytest.mark.parametrize("window", ["hann", "rectangular"])
@pytest.mark.parametrize("rate", [0.0, 11.0, -29.0])
def test_shares_are_the_powers_of_a_strong_echo(window: str, rate: float) -> None:
    radar = SMALL.model_copy(update={"processing": ProcessingConfig(window=window)})
    distance = 40.07
    image = frame_image(radar, simulate_sweeps(radar, [RadarTarget(distance, range_rate=rate, rcs=100.0)], 24, 1))
    powers, _ = frame_powers(radar, image)
    total = 10.0 ** (float(snr_db(distance, 100.0, radar)) / 10.0) * noise_power(radar)
    beat = beat_bins(radar, distance, rate)
    shares = bin_shares(radar, beat, rate) * window_noise_gain(window)
    half = len(shares) // 2
    around = powers.mean(axis=0)[int(np.round(beat)) - half : int(np.round(beat)) + half + 1]
    # The chirp of a target that moves within a sweep, and range on the way, are left out.
    np.testing.assert_allclose(around / total, shares, atol=0.02)


@pytest.mark.parametrize("group", [1, 2, 3])
def test_groups_are_counted_over_all_outcomes(group: int) -> None:
    p = np.random.default_rng(group).random((3, 6))
    for row, found in zip(p, group_probability(p, group), strict=True):
        exact = 0.0
        for over in itertools.product([0, 1], repeat=6):
            runs = [len(list(g)) for value, g in itertools.groupby(over) if value]
            exact += float(np.prod(np.where(over, row, 1.0 - row))) * (max(runs, default=0) >= group)
        assert found == pytest.approx(exact)


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="whole frames: minutes without the compiler")
@pytest.mark.parametrize("p_fa", [0.01, 0.1])
def test_noise_has_as_many_groups_as_said(p_fa: float) -> None:
    radar = SMALL.model_copy(update={"false_alarm_probability": p_fa})
    bins = searched_bins(radar).stop - searched_bins(radar).start
    found = 0
    for k in range(120):
        done = process_frame(radar, simulate_noise(radar, 24, [5, k]))
        found += len(done.groups.first)
    expected = 120 * bins * false_plot_probability(radar)
    assert abs(found - expected) < 4.0 * np.sqrt(expected) + 0.1 * expected
    alone = radar.model_copy(update={"processing": ProcessingConfig(window="rectangular", group_bins=3)})
    assert false_plot_probability(alone) == pytest.approx(p_fa**3 * (1.0 - p_fa), rel=1e-3)


def test_paths_are_those_of_range_rates() -> None:
    assert migration_paths(SMALL, 24).shape == (1, 24) and not migration_paths(SMALL, 24).any()
    paths = migration_paths(FOLLOWS, 24)
    # 50 m/s over 49 ms is 2.5 m, 8.2 bins.
    assert len(paths) == 2 * 9 + 1 and cells_searched(FOLLOWS, 24) == 19
    assert (np.abs(paths[:, -1] - paths[:, 0]) <= 9).all() and not paths[9].any()
    np.testing.assert_array_equal(paths, -paths[::-1])


def share_seen(radar: RadarConfig, rate: float, n: int = 60) -> float:
    rcs = 10.0 ** ((0.5 - float(snr_db(40.0, 1.0, radar))) / 10.0)
    rng, seen = np.random.default_rng(3), 0
    for k in range(n):
        target = RadarTarget(40.0 + 0.3 * rng.random(), range_rate=rate, rcs=rcs)
        done = process_frame(radar, simulate_sweeps(radar, [target], 24, [6, k]))
        z = done.estimates.z[done.kept]
        seen += bool(len(z) and np.abs(z[:, 0] - target.range).min() < 1.0)
    return seen / n


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="whole frames: minutes without the compiler")
def test_a_fast_target_is_seen_where_migration_is_followed_and_lost_where_not() -> None:
    assert share_seen(SMALL, 45.0) < 0.6
    assert share_seen(FOLLOWS, 45.0) > share_seen(SMALL, 45.0) + 0.25
    assert share_seen(FOLLOWS, -45.0) > 0.7


@pytest.mark.parametrize("more", [{}, {"averaging": "coherent"}, {"detect_on": "beam"}])
def test_following_migration_has_no_more_false_alarms_than_set(more: dict[str, str]) -> None:
    radar = FOLLOWS.model_copy(update=more)
    noise, over, cells, every = theoretical_noise(radar), 0, 0, np.ones(4, np.bool_)
    for k in range(40):
        image = frame_image(radar, simulate_noise(radar, 24, [7, k]))
        powers, looks = frame_powers(radar, image)
        found = detection_power(radar, image, powers, every)
        assert found.cells == cells_searched(radar, 24)
        over += int(np.count_nonzero(found.power > detection_threshold(radar, found, powers, looks, noise, every)))
        cells += searched_bins(radar).stop - searched_bins(radar).start
    # Paths share most of their bins: the greatest of them is less than that of as many independent powers.
    assert 0.1 * 0.01 < over / cells < 0.01 + 4.0 * np.sqrt(2.0 * 0.01 / cells)


def test_a_coherent_average_follows_a_target_too() -> None:
    radar = FOLLOWS.model_copy(update={"averaging": "coherent"})
    target = RadarTarget(40.0, range_rate=41.0, rcs=10.0 ** ((12.0 - float(snr_db(40.0, 1.0, radar))) / 10.0))
    samples = simulate_sweeps(radar, [target], 24, 8)
    at = int(np.round(beat_bins(radar, 40.0, 41.0)))
    peaks = []
    for config in (radar, radar.model_copy(update={"migration_corrected": False})):
        image = frame_image(config, samples)
        powers, _ = frame_powers(config, image)
        peaks.append(detection_power(config, image, powers, np.ones(4, np.bool_)).power[at - 3 : at + 4].max())
    assert peaks[0] > 3.0 * peaks[1]


@pytest.mark.parametrize("hann", [False, True])
@pytest.mark.parametrize("coherent", [False, True])
def test_spread_is_that_of_every_sweep_and_bin(hann: bool, coherent: bool) -> None:
    rng = np.random.default_rng(4)
    at, rate = rng.uniform(-0.5, 0.5, 50), rng.uniform(-60.0, 60.0, 50)
    # In the middle of bins, and a hair beside it.
    at[:4], rate[:4] = (0.0, 0.0, 1e-9, 1.5e-16), (0.0, 25.0, 0.0, 25.0)
    times = np.linspace(-0.04, 0.04, 16)
    power = np.empty((50, 13))
    kernels.spread_power(at, rate, times, hann, coherent, 1.5, power)
    expected = naive.spread_power(at, rate, times, hann, coherent, 6) / 1.5
    assert power == pytest.approx(expected, rel=1e-9, abs=1e-14)


@pytest.mark.parametrize("group", [1, 2, 3])
def test_groups_are_those_of_all_outcomes(group: int) -> None:
    p = np.random.default_rng(group).random((6, 7))
    p[0] = (0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0)
    found = np.empty(6)
    kernels.group_probabilities(p, group, found)
    assert found == pytest.approx([naive.group_probability(row, group) for row in p], abs=1e-12)
