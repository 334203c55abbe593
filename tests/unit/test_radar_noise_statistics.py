"""Noise statistics: from a run, in a file, older, and followed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.config import FixedPointConfig, ProcessingConfig
from wideberth.sensors.radar.processing.detection_level import searched_bins
from wideberth.sensors.radar.processing.noise_statistics import (
    NoiseStatistics,
    fingerprint,
    noise_statistics,
    theoretical_noise,
)

RADAR = RadarConfig(sweep_time_ms=0.256, averages=8)  # 256 bins
ALL = np.ones(4, np.bool_)


def frames(n: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.normal(size=(8, 4, RADAR.samples_per_sweep)).astype(np.float32) for _ in range(n)]


def test_a_run_has_the_mean_over_all_sweeps() -> None:
    found = noise_statistics(RADAR, frames(5, 1), created=7.0)
    assert found.power.shape == (4, 256) and found.samples == 40 and found.created == found.level_time == 7.0
    each = [noise_statistics(RADAR, [f]).power for f in frames(5, 1)]
    np.testing.assert_allclose(found.power, np.mean(each, axis=0))
    assert found.looks(4) == 160.0
    with pytest.raises(ValueError, match="noise frames"):
        noise_statistics(RADAR, [])


def test_a_channel_that_breaks_in_the_run_is_not_known() -> None:
    run = frames(3, 2)
    run[1][:, 2] = 0.0
    found = noise_statistics(RADAR, run)
    assert not found.power[2].any() and found.power[[0, 1, 3]].all()
    run[2][:] = np.nan
    with pytest.raises(InputError, match="frame 2 of the noise run: nothing of the frame"):
        noise_statistics(RADAR, run)


def test_a_file_gives_back_what_was_saved(tmp_path: Path) -> None:
    saved = noise_statistics(RADAR, frames(2, 3), created=5.0).aged(9.0, 0.1)
    saved.save(tmp_path / "noise.npz")
    found = NoiseStatistics.load(tmp_path / "noise.npz")
    np.testing.assert_array_equal(found.power, saved.power)
    for name in ("samples", "fingerprint", "created", "level_time", "level_variance"):
        assert getattr(found, name) == getattr(saved, name)


@pytest.mark.parametrize("content", [b"", b"no archive", None, {"version": 2}, {"samples": 0.0}, {"power": [[np.nan]]}])
def test_files_that_hold_something_else_are_refused(tmp_path: Path, content: bytes | dict[str, object] | None) -> None:
    path = tmp_path / "noise.npz"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        theoretical_noise(RADAR).save(path)
        with np.load(path) as file:
            values = dict(file)
        np.savez(path, **{**values, **content})
    with pytest.raises(InputError, match=r"noise\.npz"):
        NoiseStatistics.load(path)


@pytest.mark.parametrize(
    "other",
    [
        {"channels": 8},
        {"noise_figure_db": 5.0},
        {"sweep_time_ms": 0.128},
        {"processing": ProcessingConfig(window="rectangular")},
        {"processing": ProcessingConfig(clutter_filter="moving_target")},
        {"processing": ProcessingConfig(fixed_point=FixedPointConfig())},
    ],
)
def test_another_radar_is_told_apart(other: dict[str, object]) -> None:
    radar = RadarConfig.model_validate({**RADAR.model_dump(), **other})
    assert fingerprint(radar) != fingerprint(RADAR)
    with pytest.raises(ValueError, match="another radar or of other settings"):
        theoretical_noise(RADAR).check(radar)


def test_what_does_not_matter_to_noise_is_not_asked() -> None:
    theoretical_noise(RADAR).check(RADAR.model_copy(update={"false_alarm_probability": 0.1, "swerling": 3}))


def test_older_statistics_are_worth_fewer_samples() -> None:
    noise = noise_statistics(RADAR, frames(5, 4))
    assert noise.aged(0.0, 0.1).looks(4) == pytest.approx(noise.looks(4))
    later = noise.aged(3600.0, 0.1)
    assert 1.0 / later.looks(4) == pytest.approx(1.0 / 160 + (0.1 * np.log(10.0) / 10.0) ** 2)
    assert noise.aged(100.0, 0.1).aged(3600.0, 0.1).looks(4) == pytest.approx(later.looks(4))
    assert np.isinf(theoretical_noise(RADAR).looks(4))
    with pytest.raises(ValueError, match="after the frame"):
        later.aged(10.0, 0.1)


def test_the_level_is_followed_with_targets_and_false_alarms_in_the_frames() -> None:
    rng, looks = np.random.default_rng(5), 8
    noise = theoretical_noise(RADAR)
    gains = np.array([1.0, 1.05, 0.9, 1.02])[:, None]
    searched, p_fa = searched_bins(RADAR), 0.1
    for k in range(1, 200):
        noise = noise.aged(60.0 * k, 0.2)
        powers = theoretical_noise(RADAR).power * gains * rng.gamma(looks, 1.0 / looks, (4, 256))
        powers[:, 50:55] *= 100.0
        mean = powers.mean(axis=0) / noise.power.mean(axis=0)
        detected = mean > 1.235  # the threshold of 32 looks for a tenth of false alarms
        noise = noise.updated(powers, detected, searched, ALL, looks, p_fa)
    level = noise.power.mean(axis=1) / theoretical_noise(RADAR).power.mean(axis=1)
    sigma = np.sqrt(noise.level_variance)
    assert sigma < 0.015
    np.testing.assert_allclose(level, gains[:, 0], atol=0.03)
    assert level.mean() == pytest.approx(gains.mean(), abs=4.0 * sigma + 0.003)


def test_the_level_stays_where_too_few_bins_are_quiet_or_nothing_is_unsure() -> None:
    noise = theoretical_noise(RADAR)
    args = (searched_bins(RADAR), ALL, 8.0, 0.01)
    assert noise.updated(2.0 * noise.power, np.ones(256, np.bool_), *args) is noise
    np.testing.assert_array_equal(noise.updated(2.0 * noise.power, np.zeros(256, np.bool_), *args).power, noise.power)


@pytest.mark.parametrize(
    "wrong",
    [
        {"power": np.full((4, 256), np.nan)},
        {"power": np.ones(4)},
        {"samples": 0.0},
        {"level_variance": -1.0},
        {"created": np.inf},
    ],
)
def test_impossible_statistics_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError):
        replace(theoretical_noise(RADAR), **wrong)
