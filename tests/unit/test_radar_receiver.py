import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.processing.frame import process
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.sweeps.config import ReceiverConfig
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.receiver import (
    channel_response,
    coupling_matrix,
    if_response,
    sample_noise,
    saturated,
)
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

PLANE = PRESETS["uplooking_4x4"]


def radar(*, sampling="real", **receiver):
    return RadarConfig(sampling=sampling, receiver=ReceiverConfig(**receiver))


def near(config, distance=30.0, rcs=1.0, **kwargs):
    """A target at a bin's middle."""
    return RadarTarget(round(distance / config.range_bin) * config.range_bin, rcs=rcs, **kwargs)


@pytest.mark.parametrize("config", [PRESETS["table_5_1"], PLANE])
def test_coupling_has_the_peak_of_the_table_and_loses_nothing(config):
    coupling = coupling_matrix(config)
    np.testing.assert_allclose(coupling @ coupling.conj().T, np.eye(config.channels), atol=1e-12)
    np.testing.assert_allclose(coupling, coupling.T, atol=1e-15)
    others = coupling - np.diag(np.diag(coupling))
    assert 20 * np.log10(np.abs(others).max()) == pytest.approx(-20.0, abs=0.5)
    # Twice as far means a quarter of the amplitude, but for what goes by two elements.
    assert np.abs(others[0, 2]) < 0.5 * np.abs(others[0, 1])


def test_without_coupling_channels_are_alone():
    np.testing.assert_array_equal(coupling_matrix(RadarConfig()), np.eye(4))
    np.testing.assert_array_equal(
        coupling_matrix(radar(channel_coupling_db=-20.0).model_copy(update={"channels": 1})), 1.0
    )


def test_coupled_samples_are_mixtures_of_those_without():
    plain, coupled = radar(sampling="complex"), radar(sampling="complex", channel_coupling_db=-15.0)
    target = [near(plain, azimuth=0.4, rcs=1e3)]
    alone = simulate_sweeps(plain, target, 2, 1) - simulate_noise(plain, 2, 1)
    mixed = simulate_sweeps(coupled, target, 2, 1) - simulate_noise(coupled, 2, 1)
    expected = np.einsum("cd,sdn->scn", coupling_matrix(coupled), alone)
    np.testing.assert_allclose(mixed, expected, atol=1e-5 * np.abs(alone).max())
    assert np.mean(np.abs(mixed) ** 2) == pytest.approx(np.mean(np.abs(alone) ** 2), rel=1e-4)


def test_the_noise_of_channels_is_independent_and_that_of_the_link_budget():
    for sampling in ("real", "complex"):
        config = radar(sampling=sampling, channel_coupling_db=-10.0)
        image = range_compress(config, simulate_noise(config, 12, 2))[..., 1:]
        across = np.einsum("scb,sdb->cd", image, image.conj()) / (image.shape[0] * image.shape[2])
        # 24,000 powers: 1 sigma is 0.65 % of the mean.
        np.testing.assert_allclose(across / noise_power(config), np.eye(4), atol=0.03)
        assert sample_noise(config) == pytest.approx(np.std(simulate_noise(config, 12, 2).real), rel=0.02)


def test_if_filters():
    ideal = if_response(RadarConfig(), [-1e6, 0.0, 1e6, 1.0001e6])
    np.testing.assert_array_equal(ideal, [1.0, 1.0, 1.0, 0.0])
    np.testing.assert_array_equal(
        if_response(radar(sampling="complex"), [-1.0, 0.0, 5e5, 1e6, 1.01e6]), [0, 1, 1, 1, 0]
    )
    power = if_response(radar(if_filter_order=4, if_filter_cutoff_mhz=0.5), [0.0, 5e5, 5e6]) ** 2
    np.testing.assert_allclose(power, [1.0, 0.5, 1e-8], rtol=1e-6)
    around = if_response(radar(sampling="complex", if_filter_order=4), [0.0, 5e5, 1e6]) ** 2
    np.testing.assert_allclose(around, [0.5, 1.0, 0.5])
    high = if_response(radar(high_pass_khz=20.0), [0.0, 2e3, 20e3, 9e5]) ** 2
    np.testing.assert_allclose(high, [0.0, 1 / 101, 0.5, 1.0], rtol=1e-3)
    with pytest.raises(ValueError, match="frequency must be finite"):
        if_response(RadarConfig(), np.nan)
    with pytest.raises(ValueError, match="needs an if_filter_order"):
        ReceiverConfig(if_filter_cutoff_mhz=0.5)


@pytest.mark.parametrize("sampling", ["real", "complex"])
def test_filtered_noise_has_the_spectrum_of_the_filter_with_what_folds(sampling):
    config = radar(sampling=sampling, if_filter_order=2, if_filter_cutoff_mhz=0.6, high_pass_khz=50.0)
    image = range_compress(config, simulate_noise(config, 25, 3))
    measured = np.mean(np.abs(image) ** 2, axis=(0, 1)).reshape(64, -1).mean(axis=1) / noise_power(config)
    f = np.arange(config.range_bins) / (config.sweep_time_ms * 1e-3)
    expected = sum(if_response(config, f + k * config.sampling_frequency) ** 2 for k in range(-20, 21))
    # 3,200 powers each; 1 sigma is 1.8 %.
    np.testing.assert_allclose(measured / expected.reshape(64, -1).mean(axis=1), 1.0, atol=0.08)


def test_a_beat_is_weakened_by_the_filter():
    plain, filtered = radar(), radar(if_filter_order=3, if_filter_cutoff_mhz=0.3, high_pass_khz=100.0)
    for distance in (30.0, 300.0):
        target = [near(plain, distance, rcs=1e6 if distance > 100 else 100.0)]
        power = [
            np.mean(np.square(simulate_sweeps(c, target, 1, 1) - simulate_noise(c, 1, 1))) for c in (plain, filtered)
        ]
        beat = target[0].range / plain.range_bin / 2.048e-3
        assert power[1] / power[0] == pytest.approx(if_response(filtered, beat) ** 2, rel=0.01)


def test_the_converter_rounds_to_steps_and_clips():
    config = radar(adc_bits=6, noise_rms_lsb=4.0)
    step = sample_noise(config) / 4.0
    codes = simulate_sweeps(config, [near(config, 20.0)], 1, 1) / step
    np.testing.assert_allclose(codes, np.round(codes), atol=1e-4)
    assert np.round(codes.min()) == -32 and np.round(codes.max()) == 31
    share = saturated(config, codes * np.float32(step))
    np.testing.assert_array_equal(share, np.count_nonzero((codes > 30.5) | (codes < -31.5), axis=-1))
    assert share.min() > 500


@pytest.mark.parametrize("sampling", ["real", "complex"])
def test_only_near_objects_saturate(sampling):
    config = PRESETS["table_5_1"].model_copy(update={"sampling": sampling})
    assert saturated(config, simulate_sweeps(config, [near(config, 3.0)], 1, 1)).min() > 100
    assert saturated(config, simulate_sweeps(config, [near(config, 30.0)], 1, 1)).max() == 0
    assert saturated(radar(), simulate_noise(radar(), 1, 1)).max() == 0


def test_rounding_adds_little_noise():
    exact, rounded = radar(), radar(adc_bits=12)
    ratio = np.var(simulate_noise(rounded, 10, 1)) / np.var(simulate_noise(exact, 10, 1))
    assert 10 * np.log10(ratio) == pytest.approx(0.09, abs=0.01)


@pytest.mark.parametrize(("offset", "spacing"), [(0.0, 2), (400.0, 1)])
def test_overflow_makes_harmonics_at_equal_distances(offset, spacing):
    config = radar(adc_bits=12, adc_offset_lsb=offset)
    target = near(config, 2.0, rcs=0.3)
    bin_ = round(target.range / config.range_bin)
    image = np.abs(range_compress(config, simulate_sweeps(config, [target], 1, 1)))[0, 0] ** 2
    seen = np.flatnonzero(image[: 7 * bin_ + 3] > 100 * noise_power(config))
    seen = seen[seen > 0]
    np.testing.assert_array_equal(seen, bin_ * np.arange(1, 8, spacing))
    unclipped = radar(adc_bits=20, adc_offset_lsb=offset)
    image = np.abs(range_compress(unclipped, simulate_sweeps(unclipped, [target], 1, 1)))[0, 0] ** 2
    assert np.flatnonzero(image > 100 * noise_power(config))[1 if offset else 0 :].tolist() == [bin_]


def test_leakage_fills_the_near_bins_in_every_frame():
    config = radar(leakage_db=-60.0)
    image = np.abs(range_compress(config, simulate_noise(config, 2, 1))) ** 2
    power = config.transmit_power_w * 1e-6
    np.testing.assert_allclose(image[..., 1], power, rtol=0.05)
    assert np.all(image[..., 100:] < 100 * noise_power(config))
    weak = radar(leakage_db=-60.0, high_pass_khz=50.0)
    weakened = np.abs(range_compress(weak, simulate_noise(weak, 2, 1))[..., 1]) ** 2
    np.testing.assert_allclose(weakened / power, if_response(weak, 1 / 2.048e-3) ** 2, rtol=0.1)


def test_channels_that_differ_bias_directions_unless_they_are_calibrated():
    alike = RadarConfig(if_bandwidth_mhz=0.125, averages=8)
    uneven = ReceiverConfig(
        channel_coupling_db=-20.0, channel_gain_spread_db=1.0, channel_phase_spread_deg=15.0, channel_seed=3
    )
    config = alike.model_copy(update={"receiver": uneven})
    response = channel_response(config)
    assert np.mean(np.sum(np.abs(response) ** 2, axis=1)) == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_array_equal(response, channel_response(config))
    assert not np.allclose(
        response,
        channel_response(config.model_copy(update={"receiver": uneven.model_copy(update={"channel_seed": 4})})),
    )
    target = [RadarTarget(40.0, azimuth=0.5, rcs=1.0)]
    error: dict[bool, list[float]] = {False: [], True: []}
    for k in range(10):
        samples = simulate_sweeps(config, target, 8, [1, k])
        for known in error:
            scan = process(config, samples, calibration=ArrayCalibration(response) if known else None)
            (i,) = np.flatnonzero(np.abs(scan.z[:, 0] - 40.0) < 1.0)
            error[known].append(float((scan.z[i, 1] - 0.5) / np.sqrt(scan.R[i, 1, 1])))
    assert abs(np.mean(error[False])) > 8.0
    assert abs(np.mean(error[True])) < 3.5 / np.sqrt(10) and np.std(error[True]) < 2.0
