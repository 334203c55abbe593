"""From frames to plots: errors against the Cramer-Rao bound, honest variances, several echoes, bad input.

Bands of ratios hold estimators that are as good as they should be in all but one of ten thousand runs of these tests.
"""

import numpy as np
import pytest

from tests.made_frames import clean_frame, noisy_frame, peak_bins, radar
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.cramer_rao import bounds
from wideberth.sensors.radar.estimation.plots import estimate_plots

LINE, PLANE, COLUMN = radar(1, 4), radar(4, 16), radar(4, 4)
SWEEPS = 20


def errors(config, echo, snr_db, runs, *, sweeps=SWEEPS, seed=0, response=None, calibration=None):
    """Return errors and variances of plots of one echo, (runs, 4) each."""
    rng = np.random.default_rng(seed)
    clean, peaks = clean_frame(config, sweeps, echo), peak_bins(config, [echo])
    z, variance = np.empty((2, runs, 4))
    for i in range(runs):
        frame = noisy_frame([clean], [snr_db], rng, response)
        found = estimate_plots(config, frame, peaks, np.ones(config.channels), calibration)
        assert found.peak.tolist() == [0]
        z[i], variance[i] = found.z[0], found.variance[0]
    return z - echo, variance


@pytest.mark.parametrize(
    ("config", "echo", "snr_db"),
    [
        (PLANE, (40.21, 0.0, 0.0, 0.0), 20.0),
        (PLANE, (40.4, 0.9, 0.1, 30.0), 20.0),
        (PLANE, (42.0, -0.3, 0.4, -44.0), 0.0),
        (PLANE, (42.0, -0.3, 0.4, -11.0), 30.0),
        (LINE, (40.33, np.radians(55.0), 0.0, 0.0), 20.0),
        (LINE, (40.33, 0.2, 0.0, 17.0), 3.0),
        (COLUMN, (40.1, 0.0, 0.3, 5.0), 10.0),
    ],
)
def test_errors_are_near_the_bound_and_variances_honest(config, echo, snr_db):
    runs = 100
    error, variance = errors(config, echo, snr_db, runs)
    measured = np.isfinite(variance[0])
    assert (np.isnan(error) == ~np.isfinite(variance)).all()
    bound = bounds(config, snr_db, azimuth=echo[1], elevation=echo[2], sweeps=SWEEPS)
    ratio = np.sqrt(np.mean(error[:, measured] ** 2, axis=0)) / bound[measured]
    # An efficient estimate is within 1.28 with this many runs.
    assert (ratio < 1.35).all() and (ratio > 0.7).all()
    nees = np.sum(error[:, measured] ** 2 / variance[:, measured])
    degrees = runs * measured.sum()
    assert abs(nees / degrees - 1.0) < 4.0 * np.sqrt(2.0 / degrees) + 0.05


def test_signal_to_noise_ratio_is_that_of_a_channel_and_sweep():
    clean, peaks = clean_frame(PLANE, SWEEPS, (40.0, 0.1, 0.1, 3.0)), peak_bins(PLANE, [(40.0, 0.1, 0.1, 3.0)])
    rng = np.random.default_rng(0)
    noise = np.linspace(1.0, 2.0, 16)
    frame = noisy_frame([clean], [10.0], rng) * np.sqrt(noise).astype(np.float32)[:, None]
    found = estimate_plots(PLANE, frame, peaks, noise)
    assert found.snr_db[0] == pytest.approx(10.0, abs=0.5)
    by_bin = estimate_plots(PLANE, frame, peaks, np.repeat(noise[:, None], PLANE.range_bins, axis=1))
    np.testing.assert_allclose(by_bin.z, found.z)


def test_an_ambiguous_range_rate_is_none_and_range_says_so():
    echo = (40.3, 0.1, 0.0, 18.0)
    error, variance = errors(LINE, echo, 10.0, 60, sweeps=2)
    assert np.isnan(error[:, 3]).all()
    coupling = 10.25e9 * 2e-3 / 500e6
    spread = coupling * 50.0 / np.sqrt(3.0)
    assert (np.sqrt(variance[:, 0]) > 0.15 * spread).all() and (np.sqrt(variance[:, 0]) < 1.1 * spread).all()
    assert 0.5 < np.mean(error[:, 0] ** 2 / variance[:, 0]) < 2.0
    single, variance = errors(LINE, echo, 20.0, 5, sweeps=1)
    assert np.isnan(single[:, 3]).all()
    np.testing.assert_allclose(np.sqrt(variance[:, 0]), spread, rtol=0.05)
    # The angle is as good as ever.
    assert (np.abs(single[:, 1]) < 5.0 * np.sqrt(variance[:, 1])).all()


def test_calibration_takes_the_bias_of_coupling_away():
    true = ArrayCalibration(np.eye(4) + 0.1j * (np.eye(4, k=1) + np.eye(4, k=-1)) - 0.06 * np.eye(4, k=2))
    echo = (40.0, np.radians(55.0), 0.0, 0.0)
    known, variance = errors(LINE, echo, 20.0, 60, response=true, calibration=true)
    assert 0.6 < np.mean(known[:, 1] ** 2 / variance[:, 1]) < 1.7
    blind, _ = errors(LINE, echo, 20.0, 60, response=true)
    assert abs(blind[:, 1].mean()) > 10.0 * np.sqrt(variance[:, 1].mean() / 60)


def found_pairs(config, echoes, snrs_db, runs, peaks, seed=0, calibration=None):
    rng = np.random.default_rng(seed)
    cleans = [clean_frame(config, SWEEPS, e) for e in echoes]
    for _ in range(runs):
        frame = noisy_frame(cleans, snrs_db, rng)
        yield estimate_plots(config, frame, peaks, np.ones(config.channels), calibration)


@pytest.mark.parametrize("rows", [1, 4])
def test_mvdr_parts_what_the_conventional_beamformer_merges(rows):
    ten = np.radians(10.0)
    coupling = 0.041
    echoes = [(40.0, -ten, 0.0, 4.0), (40.0 + 3.0 * coupling, ten, 0.0, 1.0)]
    channels, peaks = 4 * rows, peak_bins(LINE, echoes[:1])
    apart, nees = 0, []
    runs = 40
    for found in found_pairs(radar(rows, channels, "mvdr"), echoes, (10.0, 10.0), runs, peaks):
        z = found.z[np.argsort(found.z[:, 1])]
        if len(z) == 2 and np.all(np.abs(z[:, 1] - [-ten, ten]) < np.radians(5.0)):
            apart += 1
            error = z - echoes
            variance = found.variance[np.argsort(found.z[:, 1])]
            nees.append(np.nanmean(error**2 / variance))
            assert found.peak.tolist() == [0, 0]
    assert apart >= runs - 1
    assert 0.7 < np.mean(nees) < 1.3
    merged = list(found_pairs(radar(rows, channels), echoes, (10.0, 10.0), 5, peaks))
    assert all(len(f.z) == 1 for f in merged)


@pytest.mark.parametrize("phase", [0.0, 0.7, 3.1])
@pytest.mark.parametrize("rows", [1, 4])
def test_with_known_channels_a_coherent_pair_is_parted_whatever_its_phase(rows, phase):
    ten = np.radians(10.0)
    config, calibration = radar(rows, 4 * rows, "mvdr"), ArrayCalibration.ideal(4 * rows)
    echoes = [(40.0, -ten, 0.0, 4.0), (40.0, ten, 0.0, 4.0)]
    peaks, rng = peak_bins(config, echoes[:1]), np.random.default_rng(2)
    cleans = []
    for echo, turn in zip(echoes, (0.0, phase), strict=True):
        image = clean_frame(config, SWEEPS, echo)
        # Turned to this phase in the middle of array and frame.
        middle = np.vdot(steering_vector(config, echo[1]), image[SWEEPS // 2, :, peaks[0]])
        cleans.append(image * np.complex64(np.exp(1j * (turn - np.angle(middle)))))
    error, variance = [], []
    for _ in range(15):
        frame = noisy_frame([cleans[0] + cleans[1]], (20.0,), rng)
        found = estimate_plots(config, frame, peaks, np.ones(4 * rows), calibration)
        assert len(found.z) == 2
        order = np.argsort(found.z[:, 1])
        error.append(found.z[order, 1] - (-ten, ten))
        variance.append(found.variance[order, 1])
    assert np.abs(error).max() < np.radians(5.0)
    assert 0.3 < np.mean(np.square(error) / variance) < 2.5


def test_one_echo_is_not_taken_for_two():
    echo = (40.0, 0.2, 0.1, -12.0)
    for snr, calibration in ((0.0, None), (20.0, None), (40.0, None), (40.0, ArrayCalibration.ideal(16))):
        config = radar(4, 16, "mvdr")
        found = found_pairs(config, [echo], (snr,), 10, peak_bins(config, [echo]), calibration=calibration)
        assert all(len(f.z) == 1 for f in found)


@pytest.mark.parametrize("snr", [10.0, 25.0])
@pytest.mark.parametrize("cosine", [0.875, 0.92, 0.95, 0.97])
@pytest.mark.parametrize("rows", [1, 4])
def test_one_echo_from_far_off_boresight_is_one_plot_where_it_is(rows, cosine, snr):
    # There the flank of its beam goes on at the opposite edge.
    config = radar(rows, rows * 4, "mvdr")
    for turn in np.radians([0.0, 90.0, 220.0] if rows > 1 else [0.0, 180.0]):
        right, down = cosine * np.cos(turn), cosine * np.sin(turn)
        elevation = -np.arcsin(down) if rows > 1 else 0.0
        echo = (40.33, np.arcsin(np.clip(right / np.cos(elevation), -1.0, 1.0)), elevation, 5.0)
        clean, peaks = clean_frame(config, SWEEPS, echo), peak_bins(config, [echo])
        rng = np.random.default_rng(1)
        for _ in range(5):
            z = estimate_plots(config, noisy_frame([clean], [snr], rng), peaks, np.ones(config.channels)).z
            assert len(z) == 1
            level = np.cos(z[0, 2]) if rows > 1 else 1.0
            assert abs(level * np.sin(z[0, 1]) - right) < 0.06
            assert rows == 1 or abs(-np.sin(z[0, 2]) - down) < 0.06


@pytest.mark.parametrize("apart", [1, 2, 3])
def test_a_neighbour_a_few_bins_off_does_not_disturb(apart):
    bin_length = PLANE.range_bin
    echoes = [(40.0, 0.1, 0.0, 5.0), (40.0 + apart * bin_length, -0.1, 0.1, 2.0)]
    nees = []
    for found in found_pairs(PLANE, echoes, (20.0, 12.0), 25, peak_bins(PLANE, echoes)):
        assert len(found.z) == 2
        nees.append((found.z - echoes) ** 2 / found.variance)
    assert 0.7 < np.mean(nees) < 1.3


def test_a_strong_echo_far_off_does_not_bias_a_weak_one():
    echoes = [(20.0, 0.3, 0.0, 10.0), (45.0, -0.2, 0.1, -20.0)]
    config = radar(4, 16, sampling="complex")
    nees = []
    for found in found_pairs(config, echoes, (55.0, 0.0), 25, peak_bins(config, echoes)):
        assert len(found.z) == 2
        nees.append((found.z[1] - echoes[1]) ** 2 / found.variance[1])
    assert 0.6 < np.mean(nees) < 1.4


@pytest.mark.parametrize("rate", [0.0, 25.0])
def test_the_negative_frequency_of_real_samples_does_not_bias(rate):
    echo = (20.0, 0.1, 0.1, rate)
    clean = clean_frame(PLANE, SWEEPS, echo)
    # As simulated: noise of its own, 90 dB down; the mirror image is 52 dB down in all sweeps alike.
    found = estimate_plots(PLANE, clean, peak_bins(PLANE, [echo]), np.full(16, 1e-9))
    assert (np.abs(found.z[0] - echo) < 5.0 * np.sqrt(found.variance[0])).all()
    assert np.sqrt(found.variance[0, 0]) < 3.0 * bounds(PLANE, 90.0, sweeps=SWEEPS)[0]


def test_peaks_of_one_echo_are_one_plot():
    echo = (40.0, 0.1, 0.0, 40.0)
    at = peak_bins(PLANE, [echo])[0]
    for found in found_pairs(PLANE, [echo], (25.0,), 5, np.array([at - 2, at, at + 2])):
        assert len(found.z) == 1
        np.testing.assert_allclose(found.z[0], echo, atol=6.0 * np.sqrt(found.variance[0].max()))


def test_frames_without_peaks_and_bad_input():
    clean = clean_frame(LINE, 3, (40.0, 0.0, 0.0, 0.0))
    none = estimate_plots(LINE, clean, np.array([], dtype=int), np.ones(4))
    assert none.z.shape == (0, 4) and none.peak.shape == (0,)
    peak = np.array([133])
    with pytest.raises(ValueError, match="image must have"):
        estimate_plots(LINE, clean[:, :3], peak, np.ones(4))
    with pytest.raises(ValueError, match="noise_power must have"):
        estimate_plots(LINE, clean, peak, np.ones(3))
    with pytest.raises(ValueError, match="noise_power must be positive"):
        estimate_plots(LINE, clean, peak, np.zeros(4))
    with pytest.raises(ValueError, match="whole numbers"):
        estimate_plots(LINE, clean, peak + 0.5, np.ones(4))
    with pytest.raises(ValueError, match="bins from 0"):
        estimate_plots(LINE, clean, np.array([LINE.range_bins]), np.ones(4))
    with pytest.raises(ValueError, match="calibration is of 16"):
        estimate_plots(LINE, clean, peak, np.ones(4), ArrayCalibration.ideal(16))
    bad = clean.copy()
    bad[1, 2, 135] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        estimate_plots(LINE, bad, peak, np.ones(4))


def test_peaks_at_the_ends_of_the_image_are_estimated():
    config = radar(4, 16, sampling="complex")
    for distance in (0.9, config.range_bin * (config.range_bins - 2)):
        echo = (distance, 0.1, 0.1, 0.0)
        for found in found_pairs(config, [echo], (25.0,), 3, peak_bins(config, [echo])):
            assert abs(found.z[0, 0] - distance) < 6.0 * np.sqrt(found.variance[0, 0])
