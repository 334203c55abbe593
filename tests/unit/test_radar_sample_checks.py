"""Broken channels and sweeps are left out, counted, and processing goes on with the rest."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.processing.config import FixedPointConfig, ProcessingConfig
from wideberth.sensors.radar.processing.fixed_point import converter_step, fixed_point_image, fixed_point_powers
from wideberth.sensors.radar.processing.frame import process
from wideberth.sensors.radar.processing.frame_powers import frame_image, frame_powers
from wideberth.sensors.radar.processing.noise_statistics import theoretical_noise
from wideberth.sensors.radar.processing.sample_checks import usable_samples
from wideberth.sensors.radar.processing.sample_extremes_kernels import sample_extremes

RADAR = RadarConfig(sweep_time_ms=0.256, averages=32, false_alarm_probability=1e-4)  # 256 bins
SIGMA = np.float32(np.sqrt(0.5 * noise_power(RADAR) * RADAR.samples_per_sweep))


@cache
def _made(seed: int) -> np.ndarray:
    n = RADAR.samples_per_sweep
    amplitude = np.sqrt(2.0 * noise_power(RADAR) * 30.0)
    turns = 100.3 * np.arange(n) / n + 0.11 * np.arange(32)[:, None, None]
    noise = np.random.default_rng(seed).normal(size=(32, 4, n)) * SIGMA
    return np.asarray(noise + amplitude * np.cos(2.0 * np.pi * turns), np.float32)


def frame(seed: int = 1) -> np.ndarray:
    """Noise, and a target ahead in bin 100."""
    return _made(seed).copy()


def zero(x: np.ndarray) -> None:
    x[:, 1] = 0.0


def infinite(x: np.ndarray) -> None:
    x[:20, 1, 5] = np.inf


def clip(x: np.ndarray) -> None:
    x[:, 1] = np.clip(x[:, 1], -SIGMA, SIGMA)


def faint(x: np.ndarray) -> None:
    x[:, 1] *= 0.01


def loud(x: np.ndarray) -> None:
    x[:, 1] *= 1e5


@pytest.mark.parametrize("estimator", ["maximum_likelihood", "printed"])
@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        (zero, "channel_constant"),
        (infinite, "channel_not_finite"),
        (clip, "channel_clipped"),
        (faint, "channel_dead"),
        (loud, "channel_too_loud"),
    ],
)
def test_processing_goes_on_without_a_channel(broken, cause: str, estimator: str) -> None:
    radar = RADAR.model_copy(update={"processing": ProcessingConfig(estimator=estimator)})
    whole, samples = process(radar, frame()), frame()
    broken(samples)
    scan = process(radar, samples)
    assert scan.health is not None and scan.health.rejects[cause] == 1
    assert scan.health.state == "degraded: 3 of 4 channels"
    assert len(scan.z) == len(whole.z) == 1
    assert abs(scan.z[0, 0] - whole.z[0, 0]) < 6.0 * np.sqrt(scan.R[0, 0, 0])
    assert abs(scan.z[0, 1]) < 6.0 * np.sqrt(scan.R[0, 1, 1])


def test_a_broken_sweep_is_left_out_and_the_time_is_that_of_the_rest() -> None:
    samples = frame()
    samples[4, 2, 7] = np.nan
    usable = usable_samples(RADAR, samples)
    assert usable.sweeps == slice(5, 32) and usable.channels.all()
    assert usable.rejects == {"sweep_not_finite": 1, "sweep_outside_run": 4}
    scan = process(RADAR, samples, t=3.0)
    assert scan.t == pytest.approx(3.0 + 2.5 * RADAR.sweep_interval) and len(scan.z) == 1
    assert np.isfinite(scan.z[0, [0, 1]]).all()


def test_nothing_usable_is_an_error_that_says_why() -> None:
    with pytest.raises(InputError, match="channel_not_finite"):
        process(RADAR, np.full_like(frame(), np.nan))
    with pytest.raises(InputError, match="channel_dead"):
        process(RADAR, 1e-3 * frame())
    with pytest.raises(InputError, match=r"channel_too_loud 4; .* volts"):
        process(RADAR, 1e5 * frame())


def test_noise_of_another_radar_and_a_time_before_it_are_refused() -> None:
    other = RADAR.model_copy(update={"noise_figure_db": 3.0})
    with pytest.raises(ValueError, match="another radar"):
        process(RADAR, frame(), theoretical_noise(other))
    with pytest.raises(ValueError, match="after the frame"):
        process(RADAR, frame(), theoretical_noise(RADAR, 10.0), t=5.0)


def test_fixed_point_words_lose_little_and_stay_at_their_limits() -> None:
    radar = RADAR.model_copy(update={"processing": ProcessingConfig(fixed_point=FixedPointConfig(fft_shift_bits=3))})
    powers, looks = frame_powers(radar, frame_image(radar, frame()))
    exact, _ = frame_powers(RADAR, frame_image(RADAR, frame()))
    assert looks == 32 and powers.shape == exact.shape
    np.testing.assert_allclose(powers[:, 100], exact[:, 100], rtol=0.05)
    assert powers[:, 1:-1].mean() == pytest.approx(exact[:, 1:-1].mean(), rel=0.05)
    step = converter_step(radar)
    n = radar.samples_per_sweep
    strong = 1e6 * step * np.cos(2.0 * np.pi * 50.0 * np.arange(n) / n)
    image = fixed_point_image(radar, np.broadcast_to(strong, (2, 4, n)).astype(np.float32))
    most = 2047.5 * step * 4.0 / np.pi / np.sqrt(2.0)  # fundamental of the square wave that is left
    assert np.abs(image[0, 0, 50]) <= 1.01 * most
    # Overflow makes odd harmonics.
    assert np.abs(image[0, 0, 150]) > 0.2 * np.abs(image[0, 0, 50])
    assert np.isfinite(fixed_point_powers(radar, image)).all()


def test_fixed_point_has_no_moving_target_filter() -> None:
    with pytest.raises(ValueError, match="moving-target"):
        ProcessingConfig(fixed_point=FixedPointConfig(), clutter_filter="moving_target")


@given(
    rows=st.integers(1, 3),
    n=st.integers(1, 200),
    odd=st.sampled_from([0.0, np.nan, np.inf, -np.inf]),
    seed=st.integers(0, 99),
)
def test_extremes_are_those_of_each_row(rows: int, n: int, odd: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, n)).astype(np.float32)
    values[rng.integers(rows), rng.integers(n)] += np.float32(odd)
    high, low = np.empty(rows, np.float32), np.empty(rows, np.float32)
    with np.errstate(invalid="ignore"):  # where it is not compiled
        sample_extremes(values.ravel(), high, low)
    finite = np.isfinite(values).all(axis=1)
    np.testing.assert_array_equal(high, np.where(finite, values.max(axis=1), np.nan))
    np.testing.assert_array_equal(low, np.where(finite, values.min(axis=1), np.nan))
