"""A radar among simulated aircraft: when it looks, from where, what it says of itself, and its faults."""

import math
import zlib

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.frames import rotation_ned_body
from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.coverage import plot_probability
from wideberth.sensors.radar.simulated import SimulatedRadar, stated_detection
from wideberth.tracking.radar_kernels import to_position
from wideberth.types import Ownship

SURE = {"channels": 16, "array_rows": 4, "false_alarm_probability": 1e-12, "transmit_power_w": 1000.0, "swerling": 0}
WIDE = {"azimuth_fov_deg": 180.0, "elevation_fov_deg": 180.0, "elevation_beamwidth_deg": 90.0}
UP = {**SURE, **WIDE, "boresight_elevation_deg": 90.0}
NORTH = np.array([[300.0, 0.0, -150.0]])


def radar(seed=1, name="radar", rcs=(1.0,), **settings):
    return SimulatedRadar(SimulatedRadarConfig.model_validate(settings), seed, rcs, 0.1, name)


def own(t=0.0, position=(0.0, 0.0, -100.0), velocity=(15.0, 0.0, 0.0), attitude=None):
    turned = np.eye(3) if attitude is None else attitude
    return Ownship(t, np.array(position, float), np.array(velocity, float), turned)


def standing(positions=NORTH):
    return lambda t: (positions, np.zeros_like(positions))


def test_each_look_has_its_own_stream():
    one = radar(seed=7, name="a", update_interval_s=0.5)
    for look in range(4):
        drawn = one._random(0)
        key = [7, zlib.crc32(b"a")]
        fresh = np.random.Generator(np.random.Philox(key=key, counter=[0, 0, look, 0]))
        # Halves of words and rejected tries leave something behind, which the next look must not find.
        assert drawn.random(3, dtype=np.float32).tolist() == fresh.random(3, dtype=np.float32).tolist()
        assert drawn.standard_normal(5 + look).tolist() == fresh.standard_normal(5 + look).tolist()
        assert drawn.permutation(7).tolist() == fresh.permutation(7).tolist()
        one.sense(0.5 * look, standing(), own(0.5 * look))


def places(scan):
    """Where the plots of a scan are, by what it says of its pose."""
    out = np.empty((len(scan.z), 3))
    for row, z in zip(out, scan.z, strict=True):
        to_position(scan.sensor_position, scan.sensor_attitude, z[0], z[1], z[2], row)
    return out[out[:, 0].argsort()]


def test_a_radar_on_the_ground_sees_traffic_and_the_ownship_where_they_are():
    sensor = radar(north_m=50.0, east_m=-40.0, altitude_m=20.0, **UP)
    (scan,) = sensor.sense(0.0, standing(), own())
    assert scan.kind == "radar" and scan.sensor == "radar" and scan.z.shape == (2, 4)
    assert np.allclose(scan.sensor_position, [50.0, -40.0, -20.0])
    assert np.allclose(scan.sensor_attitude[:, 0], [0, 0, -1]) and np.allclose(scan.sensor_attitude[:, 1], [0, 1, 0])
    assert np.allclose(places(scan), [[0, 0, -100], NORTH[0]], atol=12.0)
    assert scan.health.state == "ok" and scan.health.age == 0.0
    assert scan.R.shape == (2, 4, 4) and (np.diagonal(scan.R, axis1=1, axis2=2)[:, :3] > 0).all()


def test_a_radar_on_the_ownship_turns_with_it_and_does_not_see_it():
    sensor = radar(mount="ownship", boresight_azimuths_deg=[0.0, 120.0, 240.0], **SURE)
    attitude = rotation_ned_body(0.0, 0.0, math.radians(-120.0))
    scans = sensor.sense(0.0, standing(np.array([[300.0, 0.0, -100.0]])), own(attitude=attitude))
    assert [scan.sensor for scan in scans] == ["radar/1", "radar/2", "radar/3"]
    assert [len(scan.z) for scan in scans] == [0, 1, 0]
    assert np.allclose(scans[1].sensor_attitude, np.eye(3), atol=1e-12)
    assert np.allclose(scans[0].sensor_attitude, attitude) and np.allclose(scans[0].sensor_position, [0, 0, -100])
    assert np.allclose(places(scans[1]), [[300, 0, -100]], atol=10.0)
    banked = sensor.sense(0.1, standing(), own(0.1, attitude=rotation_ned_body(0.3, 0.0, 0.0)))
    assert np.allclose(banked[0].sensor_attitude, rotation_ned_body(0.3, 0.0, 0.0))


def test_range_rates_are_relative_to_the_carrier():
    sensor = radar(mount="ownship", range_rate=True, **SURE)
    moving = np.array([[400.0, 0.0, -100.0]]), np.array([[-20.0, 5.0, 0.0]])
    (scan,) = sensor.sense(0.0, lambda t: moving, own())
    assert scan.z[0, 3] == pytest.approx(-35.0, abs=1.0) and scan.R[0, 3, 3] > 0
    (ground,) = radar(range_rate=True, **SURE).sense(0.0, lambda t: moving, own(position=(0, 0, -9000)))
    assert ground.z[0, 3] == pytest.approx(-20.0 * 400 / math.hypot(400, 100), abs=1.0)


@pytest.mark.parametrize(
    ("interval", "step", "n"), [(0.1, 0.1, 11), (0.25, 0.1, 5), (0.07, 0.1, 15), (1.0, 0.1, 2), (0.1, 1.0, 11)]
)
def test_every_radar_looks_at_its_own_rate(interval, step, n):
    asked = []

    def states(t):
        asked.append(t)
        return np.array([[300.0 + 10.0 * t, 0.0, -150.0]]), np.array([[10.0, 0.0, 0.0]])

    sensor = radar(update_interval_s=interval, **UP)
    times = []
    for k in range(round(1.0 / step) + 1):
        t = 100.0 + k * step
        for scan in sensor.sense(t, states, own(t, position=(15.0 * (t - 100.0), 0, -100.0))):
            assert t - step < scan.t <= t == scan.t_received
            # The ownship too is seen where it was then.
            assert np.allclose(places(scan)[0], [15.0 * (scan.t - 100.0), 0.0, -100.0], atol=6.0)
            times.append(scan.t)
    assert len(times) == n and np.allclose(np.diff(times), interval) and asked == times


def test_noise_is_that_of_seed_name_and_look_alone():
    def run(steps, **changes):
        sensor = radar(**{"seed": 5, "update_interval_s": 0.2, "name": "radar", **UP, "swerling": 1, **changes})
        return [scan for t in steps for scan in sensor.sense(t, standing(), own(t, velocity=(0, 0, 0)))]

    a, b = run(np.arange(21) / 10), run(np.arange(11) / 5)
    assert len(a) == len(b) == 11
    assert all(np.array_equal(x.z, y.z, equal_nan=True) for x, y in zip(a, b, strict=True))
    for changes in ({"seed": 6}, {"name": "other"}):
        assert not any(
            np.array_equal(x.z, y.z, equal_nan=True) for x, y in zip(a, run(np.arange(11) / 5, **changes), strict=True)
        )
    assert not np.array_equal(a[0].z, a[1].z, equal_nan=True)


def test_a_silent_radar_gives_nothing_and_comes_back():
    sensor = radar(silent_from_s=0.5, silent_until_s=0.8, **UP)
    times = [scan.t for k in range(15) for scan in sensor.sense(50.0 + k / 10, standing(), own())]
    assert np.allclose(np.array(times) - 50.0, [0.0, 0.1, 0.2, 0.3, 0.4, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4])
    forever = radar(silent_from_s=0.0, **UP)
    assert not any(forever.sense(k / 10, standing(), own()) for k in range(20))


def test_a_burst_of_clutter_lasts_as_long_as_it_is_told():
    sensor = radar(burst_at_s=1.0, burst_s=0.3, burst_plots=40, **UP)
    counts = [len(scan.z) for k in range(20) for scan in sensor.sense(k / 10, standing(), own())]
    assert counts == [42 if 10 <= k < 13 else 2 for k in range(20)]


def test_the_rate_of_scans_is_counted():
    sensor = radar(update_interval_s=0.2, silent_from_s=6.0, silent_until_s=11.0, **UP)
    rates = {}
    for k in range(160):
        for scan in sensor.sense(k / 10, standing(), own()):
            rates[round(scan.t, 1)] = scan.health.rate
    assert rates[5.8] == pytest.approx(5.0, abs=0.2) and rates[11.0] == pytest.approx(2.5, abs=0.2)


def test_true_pose_and_range_scale_may_differ_from_what_is_said():
    settings = {"pose_error_north_m": 5.0, "pose_error_east_m": -3.0, "pose_error_up_m": 2.0, "range_scale": 1.02}
    still = {"range_floor_bins": 1e-3, "direction_floor_beamwidths": 1e-4, "direction_error_factor": 0.0}
    target = np.array([[300.0, 40.0, -50.0]])
    (scan,) = radar(plot_model=still, **settings, **SURE).sense(0.0, standing(target), own(position=(0, 0, -9000)))
    assert np.allclose(scan.sensor_position, 0) and np.allclose(scan.sensor_attitude, np.eye(3))
    assert np.allclose(places(scan)[0], 1.02 * (target[0] - [5.0, -3.0, -2.0]), atol=0.2)
    (turned,) = radar(plot_model=still, pose_error_heading_deg=2.0, **SURE).sense(
        0.0, standing(target), own(position=(0, 0, -9000))
    )
    assert turned.z[0, 1] == pytest.approx(math.atan2(40, 300) - math.radians(2.0), abs=1e-3)


def test_a_line_array_says_so_in_its_kind():
    assert SimulatedRadarConfig().scan_kind == "radar_cone"
    (scan,) = radar(transmit_power_w=100.0, azimuth_fov_deg=170.0, elevation_fov_deg=90.0).sense(
        0.0, standing(), own(position=(0, 0, -9000))
    )
    assert scan.kind == "radar_cone" and len(scan.z) and np.isnan(scan.z[:, 2]).all()


def test_the_stated_detection_is_that_of_the_reference_aircraft():
    config = SimulatedRadarConfig(
        reference_rcs_m2=0.01, reference_closing_speed_mps=0.0, azimuth_beamwidth_deg=360.0, stated_probability_max=1.0,
        elevation_beamwidth_deg=360.0, azimuth_fov_deg=20.0, elevation_fov_deg=20.0,
    )  # fmt: skip
    loss = config.plot_model.processing_loss_db
    model = stated_detection(config)
    assert model.ranges[0] == config.range_min_m and model.ranges[-1] == config.range_limit
    assert np.allclose(model.probabilities, plot_probability(model.ranges, 0.01, 0.0, config, loss_db=loss), atol=0.01)
    capped = stated_detection(config.model_copy(update={"stated_probability_max": 0.5}))
    assert np.array_equal(capped.probabilities, np.minimum(model.probabilities, 0.5))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"channels": 4, "array_rows": 4}, "one column measures no azimuth"),
        ({"mount": "ownship", "north_m": 3.0}, 'of mount = "ground"'),
        ({"azimuth_beamwidth_deg": None}, "give 360 for an element that sees all"),
        ({"silent_until_s": 3.0}, "needs silent_from_s"),
        ({"silent_from_s": 4.0, "silent_until_s": 3.0}, "later than silent_from_s"),
        ({"burst_at_s": 3.0}, "both burst_at_s and burst_plots"),
        ({"plot_model": {"range_bias_m": 3.0}}, "range_bias_m"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, message):
    with pytest.raises(ValidationError, match=message):
        SimulatedRadarConfig.model_validate(settings)


def test_bad_calls_are_refused():
    with pytest.raises(ValueError, match="finite"):
        radar(**UP).sense(math.nan, standing(), own())
    with pytest.raises(ValueError, match="of 2 aircraft are wanted"):
        radar(**UP).sense(0.0, standing(np.zeros((3, 3))), own())
    with pytest.raises(ValueError, match="rcs_m2"):
        radar(rcs=(0.0,), **UP)
