import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.range_compression import range_compress
from wideberth.sensors.radar.sweeps.paths import Multipath, RadarTarget, echo_paths
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

LINE = RadarConfig()


def echo(targets, **kwargs):
    return range_compress(LINE, simulate_sweeps(LINE, targets, 1, 1, **kwargs) - simulate_noise(LINE, 1, 1))[0, 0]


def place(r, az, el):
    """Forward, right and up of a level sensor."""
    return r * np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])


def test_images_are_as_deep_as_targets_are_high():
    target = RadarTarget(120.0, 0.3, 0.1, -12.0, 1.0, azimuth_rate=0.05, elevation_rate=-0.02)
    paths = echo_paths([target], 0.0, Multipath(8.0))
    step = 1e-3
    images = []
    for t in (-step, 0.0, step):
        forward, right, up = place(120.0 - 12.0 * t, 0.3 + 0.05 * t, 0.1 - 0.02 * t)
        below = np.array([forward, right, -16.0 - up])
        r = np.linalg.norm(below)
        images.append([r, np.arctan2(right, forward), np.arcsin(below[2] / r)])
    before, now, after = np.array(images)
    rate = (after - before) / (2 * step)
    np.testing.assert_allclose(paths.back[1], [now[0], rate[0], now[1], now[2]], rtol=1e-6)
    np.testing.assert_allclose(paths.turn[1], rate[1:], rtol=1e-5)
    np.testing.assert_allclose(paths.out[[0, 1]], paths.back[[0, 2]])
    np.testing.assert_allclose(paths.factor, [1.0, -0.7, -0.7, 0.49])


def test_a_radar_that_looks_up_has_the_ground_behind_it():
    # Up is its forward axis, and level ahead what is down for it.
    target = RadarTarget(100.0, 0.2, -0.5)
    forward, right, up = place(100.0, 0.2, -0.5)
    image = np.array([-4.0 - forward, right, up])
    mirrored = echo_paths([target], np.pi / 2, Multipath(2.0)).back[1]
    np.testing.assert_allclose(place(mirrored[0], mirrored[2], mirrored[3]), image, atol=1e-9)


@pytest.mark.parametrize("height", [0.6, 0.85, 1.1, 1.4])
def test_lobes_of_a_target_over_ground(height):
    r, reflection = 500 * LINE.range_bin, -0.8
    elevation = np.arcsin(1.5 / r)
    target = [RadarTarget(r, 0.0, elevation, rcs=1e3)]
    longer = np.linalg.norm([r * np.cos(elevation), 2 * height + 1.5]) - r
    ratio = np.abs(echo(target, multipath=Multipath(height, reflection))).max() / np.abs(echo(target)).max()
    # Both ways there and both back; they differ by far less than a range bin.
    expected = np.abs(1 + reflection * np.exp(2j * np.pi * longer / LINE.wavelength)) ** 2
    assert ratio == pytest.approx(expected, rel=0.03, abs=0.02)


def test_no_ground_no_lobes():
    target = [RadarTarget(60.0, 0.1, 0.2)]
    np.testing.assert_allclose(echo(target, multipath=Multipath(3.0, 0.0)), echo(target), atol=1e-12)


def test_bad_values():
    with pytest.raises(ValueError, match="target 1 is not above the ground"):
        echo([RadarTarget(50.0), RadarTarget(50.0, 0.0, -0.3)], multipath=Multipath(5.0))
    with pytest.raises(ValueError, match="radar_height must be"):
        Multipath(-1.0)
    for reflection in (1.5, np.nan):
        with pytest.raises(ValueError, match="reflection must be"):
            Multipath(5.0, reflection)
