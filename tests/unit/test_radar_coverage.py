import math

import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import (
    confirmed_range,
    detection_range,
    looks_and_gain_db,
    off_boresight,
    scan_detection_probability,
)
from wideberth.sensors.radar.link_budget import max_range

RADAR = RadarConfig()
ALL_ROUND = RadarConfig(boresight_azimuths_deg=(0.0, 120.0, 240.0))


def test_what_the_threshold_is_put_to():
    assert looks_and_gain_db(RADAR) == (128, 0.0)
    looks, gain = looks_and_gain_db(RadarConfig(detect_on="beam"))
    assert looks == 32 and gain == pytest.approx(6.0206, abs=1e-4)
    looks, gain = looks_and_gain_db(RadarConfig(detect_on="beam", averaging="coherent"))
    assert looks == 1 and gain == pytest.approx(21.0721, abs=1e-4)


def test_the_detection_range_is_where_the_probability_is_reached():
    for radar in (RADAR, RadarConfig(detect_on="beam", swerling=0), RadarConfig(averaging="coherent", swerling=3)):
        reach = detection_range(0.001, [0.5, 0.9], radar, closing_speed=20.0, azimuth=0.2)
        p = scan_detection_probability(reach, 0.001, 20.0, radar, azimuth=0.2)
        np.testing.assert_allclose(p, [0.5, 0.9], rtol=1e-6)


def test_the_instrumented_range_ends_it():
    assert detection_range(1.0, 0.9, RADAR) == RADAR.instrumented_range
    assert max_range(1.0, 9.29, RADAR) == pytest.approx(800.0, abs=0.5)


def test_a_threshold_on_the_ratio():
    # 13 dB after beamforming and by the rule of 5 log10.
    radar = RadarConfig(snr_threshold_db=13.0, detect_on="beam", if_bandwidth_mhz=4.0)
    reach = detection_range(0.01, 0.9, radar)
    assert reach == pytest.approx(max_range(0.01, 13.0 - 6.0206 - 7.5257, radar), rel=1e-5)
    p = scan_detection_probability(reach * np.array([0.999, 1.001]), 0.01, 0.0, radar)
    np.testing.assert_array_equal(p, [1.0, 0.0])
    # Six sure detections in a row, then the track's least age.
    speed = 2.0
    assert confirmed_range(0.01, speed, radar) == pytest.approx(reach - 6 * 0.2 - 4.0 * speed, abs=0.21)


def test_the_track_comes_later_than_the_detection_for_what_closes_faster():
    speeds = np.array([5.0, 15.0, 30.0, 60.0])
    found = confirmed_range(0.1, speeds, RADAR)
    assert np.all(np.diff(found) < 0)
    np.testing.assert_allclose(
        confirmed_range(0.1, speeds, RadarConfig(confirm_time_s=0.0)) - found, 4.0 * speeds, atol=1e-9
    )


def test_the_field_of_view():
    bearings = np.radians([-180.0, -61.0, -60.0, 0.0, 60.0, 61.0, 180.0])
    found = confirmed_range(1.0, 20.0, RADAR, azimuth=bearings)
    np.testing.assert_array_equal(found[[0, 1, 5, 6]], np.zeros(4))
    assert found[3] > found[2] == pytest.approx(found[4]) and found[2] > 0
    assert confirmed_range(1.0, 20.0, RADAR, elevation=np.radians(16.0)) == 0.0
    up = RadarConfig(boresight_elevation_deg=10.0)
    assert confirmed_range(1.0, 20.0, up, elevation=np.radians(16.0)) > 0.0


def test_three_radars_see_all_round():
    bearings = np.radians(np.arange(-180.0, 181.0, 15.0))
    found = confirmed_range(1.0, 20.0, ALL_ROUND, azimuth=bearings)
    assert np.all(found > 0)
    np.testing.assert_allclose(found[8:], found[:-8], rtol=1e-12)  # 120 degrees on
    off, _, visible = off_boresight(bearings, 0.0, ALL_ROUND)
    assert np.all(np.abs(off) <= np.radians(60.0) + 1e-9) and visible.all()


def test_false_alarms_confirm_nothing():
    noisy = RadarConfig(false_alarm_probability=0.5, confirm_hits=1, confirm_window=1, confirm_time_s=0.0)
    assert confirmed_range(1e-12, 1.0, noisy) < 5.0


def test_averaging_less_is_better_for_what_is_fast():
    few = RadarConfig(averages=4)
    assert confirmed_range(0.01, 40.0, few) > confirmed_range(0.01, 40.0, RADAR)
    assert detection_range(0.01, 0.9, few) < detection_range(0.01, 0.9, RADAR)


def test_against_a_sampled_approach():
    radar = RadarConfig(confirm_time_s=0.0, confirm_hits=3, confirm_window=5, swerling=1)
    speed, rcs, samples = 25.0, 0.01, 4000
    rng = np.random.default_rng(3)
    ranges = radar.range_limit - speed * radar.update_interval_s * np.arange(1, 240)
    p = scan_detection_probability(ranges, rcs, speed, radar)
    noise = radar.false_alarm_probability
    seen = rng.random((samples, len(ranges))) < (p - noise) / (1 - noise)
    before = np.cumsum(np.pad(seen, ((0, 0), (5, 0))), axis=1)
    first = np.argmax(before[:, 5:] - before[:, :-5] >= 3, axis=1)
    assert np.quantile(ranges[first], 0.1) == pytest.approx(confirmed_range(rcs, speed, radar), abs=6.0)


def test_bad_arguments_are_refused_by_name():
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="rcs_m2 must be"):
            confirmed_range(wrong, 10.0, RADAR)
        with pytest.raises(ValueError, match="closing_speed must be"):
            confirmed_range(1.0, wrong, RADAR)
    with pytest.raises(ValueError, match="azimuth must be finite"):
        confirmed_range(1.0, 10.0, RADAR, azimuth=math.nan)
    with pytest.raises(ValueError, match="p_d must be"):
        detection_range(1.0, 1.0, RADAR)
