"""Range compression and averaged powers against a naive twin; targets and noise as the link budget has them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import radar_processing as naive
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.processing.averaged_power_kernels import add_powers
from wideberth.sensors.radar.processing.averaging import (
    channel_powers,
    correlation_matrices,
    detection_power,
    moving_targets,
    windowed,
)
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.range_cells import window_noise_gain


def small(sampling: str = "real", window: str = "hann", **more) -> RadarConfig:
    """A radar of 64 bins."""
    processing = ProcessingConfig(window=window, **more.pop("processing", {}))
    return RadarConfig(
        sampling=sampling, sweep_time_ms=0.064, update_interval_s=0.01, processing=processing, averages=8, **more
    )


def made(config: RadarConfig, sweeps: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shape = (sweeps, config.channels, config.samples_per_sweep)
    values = rng.normal(size=shape)
    if config.sampling == "complex":
        values = values + 1j * rng.normal(size=shape)
    return values.astype(np.float32 if config.sampling == "real" else np.complex64)


@pytest.mark.parametrize("sampling", ["real", "complex"])
@pytest.mark.parametrize("window", ["hann", "rectangular"])
@pytest.mark.parametrize("moving_target", [False, True])
def test_powers_are_those_of_the_naive_twin(sampling: str, window: str, moving_target: bool) -> None:
    config = small(sampling, window)
    samples = made(config, 5, 1)
    found = channel_powers(config, range_compress(config, samples), moving_target=moving_target)
    expected = naive.channel_powers(samples, config.range_bins, window == "hann", moving_target)
    last = -1 if sampling == "real" else None  # the bin after the last is not kept
    np.testing.assert_allclose(found[:, :last], expected[:, :last], rtol=2e-5)


@given(bins=st.integers(2, 9), sweeps=st.integers(1, 4), hann=st.booleans(), seed=st.integers(0, 1000))
def test_kernel_is_the_convolution(bins: int, sweeps: int, hann: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(sweeps, bins, 2)).astype(np.float32)
    before, after = rng.normal(size=(2, sweeps, 2))
    power, mean = np.empty(bins), np.empty(2 * bins)
    add_powers(rows.ravel(), rows[0].size, hann, before, after, power, mean)
    padded = np.concatenate([before[:, None], rows, after[:, None]], axis=1)
    value = padded[:, 1:-1] - 0.5 * (padded[:, :-2] + padded[:, 2:]) * hann
    np.testing.assert_allclose(power, (value**2).sum(axis=(0, 2)), rtol=1e-5)
    np.testing.assert_allclose(mean, value.sum(axis=0).ravel(), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("sampling", ["real", "complex"])
@pytest.mark.parametrize("window", ["hann", "rectangular"])
def test_a_target_in_the_middle_of_a_bin_has_its_received_power(sampling: str, window: str) -> None:
    config, power = small(sampling, window), 3e-12
    turns = 2.0 * np.pi * 20.0 * np.arange(config.samples_per_sweep) / config.samples_per_sweep + 0.7
    wave = np.sqrt(2.0 * power) * np.cos(turns) if sampling == "real" else np.sqrt(power) * np.exp(1j * turns)
    image = range_compress(config, np.broadcast_to(wave, (2, 4, len(wave))))
    assert image.dtype == np.complex64 and image.shape == (2, 4, config.range_bins)
    assert np.abs(image[0, 0, 20]) ** 2 == pytest.approx(power, rel=1e-5)
    assert np.abs(windowed(config, image)[1, 2, 20]) ** 2 == pytest.approx(power, rel=1e-5)
    assert channel_powers(config, image)[0, 20] == pytest.approx(power, rel=1e-5)


@pytest.mark.parametrize("sampling", ["real", "complex"])
@pytest.mark.parametrize("window", ["hann", "rectangular"])
def test_noise_has_the_power_of_the_link_budget(sampling: str, window: str) -> None:
    config = RadarConfig(sampling=sampling, processing=ProcessingConfig(window=window))
    n = config.samples_per_sweep
    samples = made(config, 16, 2) * np.float32(np.sqrt(0.5 * n * noise_power(config)))
    powers = channel_powers(config, range_compress(config, samples))[:, 1:-1]
    expected = noise_power(config) * window_noise_gain(window)
    # 64 x 2046 powers, neighbours correlated: 1 sigma is 0.4 %.
    assert powers.mean() == pytest.approx(expected, rel=0.016)


def test_windowed_image_has_the_powers() -> None:
    config = small()
    image = range_compress(config, made(config, 3, 3))
    np.testing.assert_allclose((np.abs(windowed(config, image)) ** 2).mean(axis=0), channel_powers(config, image), 1e-5)


def test_the_moving_target_filter_takes_out_what_stands_still() -> None:
    config = small()
    samples = made(config, 8, 4)
    still = 1e3 * np.cos(2.0 * np.pi * 10.3 * np.arange(config.samples_per_sweep) / config.samples_per_sweep)
    quiet = channel_powers(config, range_compress(config, samples), moving_target=True)
    loud = channel_powers(config, range_compress(config, samples + still.astype(np.float32)), moving_target=True)
    np.testing.assert_allclose(loud, quiet, rtol=2e-2)
    filtered = moving_targets(range_compress(config, samples))
    np.testing.assert_allclose(channel_powers(config, filtered) * 8 / 7, quiet, rtol=1e-4)
    with pytest.raises(ValueError, match="2 or more sweeps"):
        channel_powers(config, filtered[:1], moving_target=True)


def test_correlation_matrices_are_hermitian_with_powers_on_the_diagonal() -> None:
    config = small(window="rectangular")
    image = range_compress(config, made(config, 6, 5))
    bins = np.array([3, 17])
    matrices = correlation_matrices(image, bins)
    assert matrices.shape == (2, 4, 4)
    np.testing.assert_allclose(matrices, matrices.conj().swapaxes(1, 2))
    diagonal = np.einsum("mcc->cm", matrices).real
    np.testing.assert_allclose(diagonal, channel_powers(config, image)[:, bins], rtol=1e-5)
    expected = np.mean([np.outer(image[s, :, 17], image[s, :, 17].conj()) for s in range(6)], axis=0)
    np.testing.assert_allclose(matrices[1], expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("averaging", "detect_on", "looks", "cells", "gain"),
    [
        ("noncoherent", "channels", 32, 1, 1),
        ("coherent", "channels", 4, 8, 8),
        ("noncoherent", "beam", 8, 4, 4),
        ("coherent", "beam", 1, 32, 32),
    ],
)
def test_coherent_gains_of_a_target(averaging: str, detect_on: str, looks: int, cells: int, gain: int) -> None:
    config = small(averaging=averaging, detect_on=detect_on)
    n = config.samples_per_sweep
    sweep, channel = np.arange(8)[:, None, None], np.arange(4)[None, :, None]
    phase = 2.0 * np.pi * (20.0 * np.arange(n) / n + 3.0 * sweep / 8 + channel / 4)
    image = range_compress(config, np.sqrt(2.0) * np.cos(phase))
    found = detection_power(config, image, channel_powers(config, image), np.ones(4, np.bool_))
    assert (found.looks, found.cells) == (looks, cells)
    assert found.power[20] == pytest.approx(gain, rel=1e-4)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (np.zeros((2, 3, 128)), "shape"),
        (np.zeros((4, 128)), "shape"),
        (np.zeros((0, 4, 128)), "shape"),
        (np.zeros((2, 4, 64)), "shape"),
        (np.zeros((2, 4, 128), np.complex64), "complex64"),
        (np.full((2, 4, 128), "x"), "cannot be"),
    ],
)
def test_samples_of_another_radar_are_refused(samples: np.ndarray, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        range_compress(small(), samples)
