import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power, snr_db
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.sweeps.ground_clutter import GroundClutter, clutter_samples
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

LINE = RadarConfig()
EVEN = RadarConfig(azimuth_beamwidth_deg=None, elevation_beamwidth_deg=None)
UP = EVEN.model_copy(update={"channels": 16, "array_rows": 4, "boresight_elevation_deg": 90.0})


def image(radar, clutter, start=0.0, sweeps=1):
    """With a window: the ground is so much stronger near the radar that sidelobes would hide the rest."""
    samples = clutter_samples(radar, clutter, start, sweeps)
    window = np.hanning(samples.shape[-1])
    return range_compress(radar, samples * (window / np.sqrt(np.mean(window**2))).astype(np.float32))


def mean_power(radar, bins, **kwargs):
    """Mean over 40 grounds, channels (which see the same ground), and ranges."""
    return np.mean([np.mean(np.abs(image(radar, GroundClutter(seed=i, **kwargs))[..., bins]) ** 2) for i in range(40)])


@pytest.mark.parametrize("radar", [EVEN, UP, EVEN.model_copy(update={"sampling": "complex"})])
def test_the_level_is_that_of_constant_gamma(radar):
    height, gamma = 20.0, 10**-1.5
    for bins in (slice(100, 140), slice(900, 1100)):
        r = np.arange(bins.start, bins.stop) * radar.range_bin
        # A ring of the length of a range bin.
        rcs = gamma * height / r * 2 * np.pi * r * radar.range_bin
        expected = np.mean(noise_power(radar) * 10 ** (snr_db(r, rcs, radar) / 10))
        # About 800 independent cells and more: 3.5 % for 1 sigma.
        assert mean_power(radar, bins, radar_height=height) == pytest.approx(expected, rel=0.12)


def test_an_element_hears_little_of_the_ground_behind_and_below_it():
    bins = slice(400, 600)
    everywhere = mean_power(EVEN, bins, radar_height=5.0)
    ahead = mean_power(LINE, bins, radar_height=5.0)
    # Two ways through a Gaussian lobe of 80 degrees, all round: its mean.
    azimuth = np.linspace(-np.pi, np.pi, 10_001)
    share = np.mean(0.5 ** (2 * (azimuth / np.radians(40.0)) ** 2))
    assert ahead / everywhere == pytest.approx(share, rel=0.2)
    up = LINE.model_copy(update={"boresight_elevation_deg": 60.0})
    # What is left is the ground to both sides, far off in azimuth.
    assert mean_power(up, bins, radar_height=5.0) < 1e-3 * ahead


def test_there_is_none_nearer_than_the_ground():
    power = np.abs(image(EVEN, GroundClutter(60.0))[0, 0]) ** 2
    assert power[:190].max() < 0.01 * power[205:400].mean()


def test_the_ground_is_the_same_in_every_sweep_and_frame():
    ground = GroundClutter(5.0, gamma_db=0.0, seed=3)
    first = simulate_sweeps(LINE, [], 3, 1, clutter=ground) - simulate_noise(LINE, 3, 1)
    later = simulate_sweeps(LINE, [], 3, 2, clutter=ground, start_time=9.0) - simulate_noise(LINE, 3, 2)
    scale = np.abs(first).max()
    np.testing.assert_allclose(first[1:], first[:-1], atol=1e-5 * scale)
    np.testing.assert_allclose(later, first, atol=1e-5 * scale)
    other = clutter_samples(LINE, GroundClutter(5.0, gamma_db=0.0, seed=4), 0.0, 1)
    assert np.abs(np.corrcoef(first[0].ravel(), other[0].ravel())[0, 1]) < 0.5


def test_what_the_wind_moves_loses_its_correlation():
    ground = GroundClutter(5.0, moving_share=0.4, moving_speed=0.3)
    waited = [0.0, 0.004, 0.008, 5.0]
    frames = [image(EVEN, ground, start)[0, :, 50:1000] for start in waited]
    likeness = [np.abs(np.vdot(frames[0], f)) / np.vdot(f, f).real for f in frames]
    # Gaussian speeds: the moving part keeps exp(-(2 pi 2 sigma t / wavelength)^2 / 2).
    phase = 4 * np.pi * 0.3 / EVEN.wavelength * np.array(waited)
    np.testing.assert_allclose(likeness, 0.6 + 0.4 * np.exp(-(phase**2) / 2), atol=0.1)
    still = clutter_samples(EVEN, GroundClutter(5.0), 0.0, 3)
    assert still.shape[0] == 1
    assert clutter_samples(EVEN, ground, 0.0, 3).shape[0] == 3


def test_texture_makes_the_ground_spiky():
    bins = slice(300, 1000)

    def contrast(shape):
        powers = [
            np.abs(image(EVEN, GroundClutter(5.0, texture_shape=shape, seed=i))[0, 0, bins]) ** 2 for i in range(20)
        ]
        level = np.arange(bins.start, bins.stop) ** -4.0
        return np.mean((powers / level) ** 2) / np.mean(powers / level) ** 2

    # Of exponential powers 2; a Gamma distributed texture multiplies by 1 + 1 / shape (less what neighbours mix in).
    assert contrast(None) == pytest.approx(2.0, rel=0.15)
    assert contrast(1.0) > 2.8


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"radar_height": 0.0}, "radar_height must be"),
        ({"gamma_db": np.nan}, "gamma_db must be"),
        ({"texture_shape": 0.0}, "texture_shape must be"),
        ({"moving_share": 1.5}, "moving_share must be"),
        ({"moving_speed": -1.0}, "moving_speed must be"),
    ],
)
def test_bad_values(values, words):
    with pytest.raises(ValueError, match=words):
        GroundClutter(**{"radar_height": 5.0, **values})
