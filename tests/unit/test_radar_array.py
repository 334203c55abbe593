import numpy as np
import pytest

from wideberth.sensors.radar.array import element_positions, steering_vector
from wideberth.sensors.radar.config import RadarConfig

LINE = RadarConfig()
PLANE = RadarConfig(channels=16, array_rows=4)


def test_the_sampling_of_table_5_1_is_that_of_the_errata():
    assert LINE.samples_per_sweep == 4096
    assert LINE.sampling_frequency == pytest.approx(2.0e6)
    assert LINE.range_bins == 2048
    assert LINE.range_bin == pytest.approx(0.2998, abs=1e-4)
    complex_radar = RadarConfig(sampling="complex")
    assert (complex_radar.samples_per_sweep, complex_radar.range_bins) == (2048, 2048)


def test_elements_stand_around_the_middle_half_a_wavelength_apart():
    places = element_positions(PLANE)
    np.testing.assert_allclose(places.mean(axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(places[1] - places[0], [0.0, 0.5 * PLANE.wavelength, 0.0], atol=1e-15)
    np.testing.assert_allclose(places[4] - places[0], [0.0, 0.0, 0.5 * PLANE.wavelength], atol=1e-15)


def test_a_wave_from_ahead_has_no_phases_and_from_the_right_half_a_turn_a_column():
    np.testing.assert_allclose(steering_vector(PLANE, 0.0, 0.0), 1.0)
    phases = steering_vector(LINE, np.pi / 2)
    # The right-most element is the nearest to the target, and lags in the beat signal.
    np.testing.assert_allclose(np.angle(phases[1:] / phases[:-1]), np.full(3, -np.pi), atol=1e-9)
    slightly = steering_vector(LINE, 0.1)
    np.testing.assert_allclose(np.angle(slightly[1:] / slightly[:-1]), -np.pi * np.sin(0.1))


def test_a_wave_from_above_reaches_the_upper_rows_first():
    phases = steering_vector(PLANE, 0.0, 0.2).reshape(4, 4)
    np.testing.assert_allclose(np.angle(phases[0] / phases[1]), -np.pi * np.sin(0.2))


def test_broadcasting():
    assert steering_vector(PLANE, np.zeros((3, 1)), np.zeros(5)).shape == (3, 5, 16)


def test_channels_must_fill_the_rows_and_sweeps_the_interval():
    with pytest.raises(ValueError, match="do not fill"):
        RadarConfig(channels=4, array_rows=3)
    with pytest.raises(ValueError, match="shorter than sweep_time_ms"):
        RadarConfig(sweep_interval_ms=1.0)
