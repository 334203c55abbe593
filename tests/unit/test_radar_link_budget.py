import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import (
    averaging_gain_db,
    beamforming_gain_db,
    max_range,
    migration_loss_db,
    noise_power,
    pattern_loss_db,
    snr_db,
)

RADAR = RadarConfig()


def test_the_two_numbers_of_the_errata():
    assert snr_db(250.0, 0.01, RADAR) == pytest.approx(9.5, abs=0.01)
    assert snr_db(800.0, 1.0, RADAR) == pytest.approx(9.3, abs=0.02)


def test_budget_by_hand():
    wavelength = 299_792_458.0 / 10.25e9
    received = 0.25 * 10**2.4 * wavelength**2 * 0.5 / ((4 * math.pi) ** 3 * 300.0**4)
    noise = 1.380649e-23 * 290.0 / 2.048e-3 * 10**0.6
    assert noise_power(RADAR) == pytest.approx(noise, rel=1e-12)
    assert snr_db(300.0, 0.5, RADAR) == pytest.approx(10 * math.log10(received / noise), abs=1e-9)


def test_ranges_of_the_waveform():
    assert RADAR.range_bin == pytest.approx(0.2998, abs=5e-5)
    assert RADAR.instrumented_range == pytest.approx(614.0, abs=0.05)
    assert RADAR.range_limit == RADAR.instrumented_range
    assert RadarConfig(range_max_m=300.0).range_limit == 300.0


def test_gains():
    assert beamforming_gain_db(4) == pytest.approx(6.0206, abs=1e-4)
    np.testing.assert_allclose(averaging_gain_db([1, 32]), [0.0, 7.5257], atol=1e-4)
    np.testing.assert_allclose(averaging_gain_db([1, 32], "coherent"), [0.0, 15.0515], atol=1e-4)


def test_losses_lower_the_ratio():
    assert snr_db(100.0, 1.0, RADAR) - snr_db(100.0, 1.0, RadarConfig(losses_db=3.5)) == pytest.approx(3.5)


def test_the_beam_is_3_dB_down_at_half_its_width_each_way():
    edge = np.radians([-40.0, 0.0, 40.0])
    np.testing.assert_allclose(pattern_loss_db(edge, 0.0, RADAR), [3.0103, 0.0, 3.0103], atol=1e-4)
    assert pattern_loss_db(0.0, np.radians(9.0), RADAR) == pytest.approx(3.0103, abs=1e-4)
    two_way = snr_db(100.0, 1.0, RADAR) - snr_db(100.0, 1.0, RADAR, azimuth=edge)
    np.testing.assert_allclose(two_way, [6.0206, 0.0, 6.0206], atol=1e-4)
    even = RadarConfig(azimuth_beamwidth_deg=None, elevation_beamwidth_deg=None)
    np.testing.assert_array_equal(pattern_loss_db([0.1, 1.0], [[0.1], [1.0]], even), np.zeros((2, 2)))


def test_a_target_that_crosses_bins_loses_in_the_average():
    bins_a_second = RADAR.range_bin / (32 * 2.048e-3)  # the speed that crosses one bin while averaging
    speeds = bins_a_second * np.array([0.0, 1.0, 4.0, -4.0])
    np.testing.assert_allclose(migration_loss_db(speeds, RADAR), [0.0, 0.0, 6.0206, 6.0206], atol=1e-4)
    coherent = RadarConfig(averaging="coherent")
    np.testing.assert_allclose(migration_loss_db(speeds, coherent), [0.0, 0.0, 12.0412, 12.0412], atol=1e-4)
    np.testing.assert_array_equal(migration_loss_db(speeds, RadarConfig(migration_corrected=True)), np.zeros(4))


def test_arguments_broadcast():
    found = snr_db([[100.0], [200.0]], [0.01, 0.1, 1.0], RADAR, azimuth=[0.0, 0.1, 0.2])
    assert found.shape == (2, 3)
    assert max_range([0.01, 1.0], [[10.0], [20.0]], RADAR).shape == (2, 2)


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf, [100.0, -1.0], "far", None])
def test_bad_ranges_and_cross_sections_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match="range_m must be"):
        snr_db(wrong, 1.0, RADAR)
    with pytest.raises(ValueError, match="rcs_m2 must be"):
        snr_db(100.0, wrong, RADAR)
    with pytest.raises(ValueError, match="rcs_m2 must be"):
        max_range(wrong, 10.0, RADAR)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, [0.0, math.nan], "left"])
def test_bad_angles_and_levels_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match="azimuth must be"):
        snr_db(100.0, 1.0, RADAR, azimuth=wrong)
    with pytest.raises(ValueError, match="elevation must be"):
        pattern_loss_db(0.0, wrong, RADAR)
    with pytest.raises(ValueError, match="required_snr_db must be"):
        max_range(1.0, wrong, RADAR)
    with pytest.raises(ValueError, match="closing_speed must be"):
        migration_loss_db(wrong, RADAR)


@pytest.mark.parametrize("wrong", [0, -1, 1.5, math.nan, math.inf])
def test_bad_counts_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match="channels must be"):
        beamforming_gain_db(wrong)
    with pytest.raises(ValueError, match="averages must be"):
        averaging_gain_db(wrong)


def test_an_unknown_way_of_averaging_is_refused():
    with pytest.raises(ValueError, match="averaging must be one of noncoherent, coherent"):
        averaging_gain_db(4, "binary")


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"carrier_frequency_ghz": 0.0}, "carrier_frequency_ghz"),
        ({"noise_figure_db": math.nan}, "noise_figure_db"),
        ({"transmit_power_w": -1.0}, "transmit_power_w"),
        ({"channels": 0}, "channels"),
        ({"swerling": 2}, "swerling"),
        ({"false_alarm_probability": 0.0}, "false_alarm_probability"),
        ({"boresight_azimuths_deg": []}, "boresight_azimuths_deg"),
        ({"confirm_hits": 11}, "confirm_hits 11 is more than confirm_window 10"),
        ({"update_interval_s": 0.05}, "update_interval_s 0.05 is shorter than the averaged sweeps take, 0.065536 s"),
        ({"range_min_m": 700.0}, "range_min_m 700 is not below the greatest range, 613.975 m"),
        ({"antenna_gain_dbi": 12.0}, "antenna_gain_dbi"),
    ],
)
def test_settings_without_meaning_are_refused(keys, message):
    with pytest.raises(ValidationError, match=message):
        RadarConfig(**keys)
