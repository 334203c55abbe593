"""A radar of a scenario at the level of samples: the same mounts, names and faults as with modelled plots."""

import math
import os

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.frames import rotation_ned_body
from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.plot_model import PlotModel
from wideberth.sensors.radar.sampled_look import SampledLook, measured_noise
from wideberth.sensors.radar.simulated import SimulatedRadar
from wideberth.tracking.radar_kernels import to_position
from wideberth.types import Ownship

# 154 m of range in 512 samples, four times the bins of the radar of table 5.1 and its sweeps.
SMALL = {
    "level": "samples",
    "if_bandwidth_mhz": 0.25,
    "channels": 16,
    "array_rows": 4,
    "averages": 8,
    "false_alarm_probability": 1e-6,
    "transmit_power_w": 1.0,
    "azimuth_fov_deg": 180.0,
    "elevation_fov_deg": 180.0,
    "azimuth_beamwidth_deg": 90.0,
    "elevation_beamwidth_deg": 90.0,
    "swerling": 0,
    "range_rate": True,
}
UP = {**SMALL, "boresight_elevation_deg": 90.0}
POSITIONS = np.array([[60.0, 20.0, -90.0], [-40.0, 30.0, -80.0]])
VELOCITIES = np.array([[-10.0, 3.0, 0.0], [4.0, 12.0, 1.0]])


def radar(seed=1, name="radar", **settings):
    return SimulatedRadar(SimulatedRadarConfig.model_validate(settings), seed, (1.0, 1.0), 1.0, name)


def own(t=0.0, position=(0.0, 0.0, -50.0), velocity=(13.0, 0.0, 0.0), attitude=None):
    turned = np.eye(3) if attitude is None else attitude
    return Ownship(t, np.array(position, float), np.array(velocity, float), turned)


def moving(t):
    return POSITIONS + t * VELOCITIES, VELOCITIES


def places(scan):
    out = np.empty((len(scan.z), 3))
    for row, z in zip(out, scan.z, strict=True):
        to_position(scan.sensor_position, scan.sensor_attitude, z[0], z[1], z[2], row)
    return out


def nearest(scan, place):
    distance = np.linalg.norm(places(scan) - place, axis=1)
    return int(distance.argmin()), float(distance.min())


def test_a_radar_on_the_ground_sees_traffic_and_the_ownship():
    sensor = radar(north_m=5.0, altitude_m=2.0, **UP)
    for k in range(3):
        t = 0.1 * k
        (scan,) = sensor.sense(t, moving, own(t))
        assert scan.t == t and scan.kind == "radar" and scan.sensor == "radar"
        assert len(scan.z) == 3
        for place, velocity in zip([*moving(t)[0], [0.0, 0.0, -50.0]], [*VELOCITIES, [13.0, 0.0, 0.0]], strict=True):
            i, off = nearest(scan, place)
            assert off < 3.0
            line = np.subtract(place, [5.0, 0.0, -2.0])
            rate = line @ velocity / np.linalg.norm(line)
            assert abs(scan.z[i, 3] - rate) < 5.0 * math.sqrt(scan.R[i, 3, 3])
            assert abs(scan.z[i, 0] - np.linalg.norm(line)) < 5.0 * math.sqrt(scan.R[i, 0, 0])


def test_a_radar_on_the_ownship_turns_with_it():
    sensor = radar(mount="ownship", boresight_azimuths_deg=[0.0, 180.0], **SMALL)
    ahead = np.array([[80.0, 10.0, -40.0], [-70.0, 5.0, -60.0]])
    scans = sensor.sense(0.0, lambda t: (ahead, np.zeros((2, 3))), own(attitude=rotation_ned_body(0.1, 0.0, 0.2)))
    assert [scan.sensor for scan in scans] == ["radar/1", "radar/2"]
    for scan, place in zip(scans, ahead, strict=True):
        assert len(scan.z) == 1
        i, off = nearest(scan, place)
        assert off < 3.0
        line = place - [0.0, 0.0, -50.0]
        assert scan.z[i, 3] == pytest.approx(-13.0 * line[0] / np.linalg.norm(line), abs=0.5)


def test_a_line_of_elements_measures_the_angle_of_a_cone():
    sensor = radar(**{**SMALL, "channels": 4, "array_rows": 1, "range_rate": False})
    (scan,) = sensor.sense(0.0, lambda t: (np.array([[80.0, 40.0, -30.0], [9e9, 0, 0]]), np.zeros((2, 3))), own())
    assert scan.kind == "radar_cone"
    i = int(np.argmin(abs(scan.z[:, 0] - math.sqrt(80**2 + 40**2 + 30**2))))
    assert scan.z[i, 1] == pytest.approx(math.asin(40 / math.sqrt(80**2 + 40**2 + 30**2)), abs=0.05)
    assert np.isnan(scan.z[:, 2:]).all() and np.isnan(scan.R[:, [2, 3], [2, 3]]).all()


def test_faults_are_those_of_modelled_plots():
    settings = {**UP, "silent_from_s": 0.3, "burst_at_s": 0.1, "burst_s": 0.1, "burst_plots": 5, "range_scale": 1.02}
    sensor = radar(pose_error_up_m=3.0, **settings)
    scans = [sensor.sense(0.1 * k, moving, own(0.1 * k)) for k in range(4)]
    assert [len(found) for found in scans] == [1, 1, 1, 0]
    assert [len(found[0].z) for found in scans[:3]] == [3, 8, 3]
    really = POSITIONS[0] + [0.0, 0.0, 3.0]
    assert abs(scans[0][0].z[:, 0] - 1.02 * np.linalg.norm(really)).min() < 0.05


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="whole frames: minutes without the compiler")
def test_noise_is_a_stream_of_each_unit_and_look():
    def plots(other, **changed):
        sensor = radar(**{**UP, "swerling": 1, "false_alarm_probability": 0.01, **changed})
        gone = np.array([[0.0] * 3, [math.nan] * 3])
        found = []
        for k in range(3):
            t = 0.1 * k
            states = moving if other else (lambda t: (moving(t)[0] + gone, VELOCITIES))
            found += sensor.sense(t, states, own(t))
        return found

    first, again, alone, seeded = plots(True), plots(True), plots(False), plots(True, north_m=1e-9)
    for a, b, c, d in zip(first, again, alone, seeded, strict=True):
        assert np.array_equal(a.z, b.z, equal_nan=True)
        i, _ = nearest(a, moving(a.t)[0][0])
        assert abs(c.z[:, 0] - a.z[i, 0]).min() < 1e-3
        assert len(a.z) == len(d.z)


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="whole frames: minutes without the compiler")
def test_noise_can_be_measured_before_the_start():
    settings = {**UP, "noise_run_frames": 20, "receiver": {"adc_bits": 12, "if_filter_order": 3}}
    sensor = radar(**settings)
    (scan,) = sensor.sense(0.0, moving, own())
    assert len(scan.z) == 3
    config = SimulatedRadarConfig.model_validate(settings)
    assert measured_noise(config, 20) is measured_noise(config, 20)
    assert measured_noise(config, 20).samples == 160.0
    with pytest.raises(ValidationError, match="noise_run_frames"):
        SimulatedRadarConfig(noise_run_frames=20)


def test_what_cannot_be_simulated_is_left_out():
    config = SimulatedRadarConfig.model_validate(UP)
    look = SampledLook(config, PlotModel(config), "radar")
    random = np.random.default_rng(1)
    # Through the radar within the frame, behind the array, and far too far.
    positions = np.array([[1.0, 0.1, 0.0], [-50.0, 1.0, 1.0], [1e7, 0.0, 0.0], [math.nan] * 3])
    velocities = np.array([[-300.0, 0.0, 0.0]] + [[0.0] * 3] * 3)
    z, variance = look.look(0.0, random, positions, velocities, np.ones(4))
    assert z.shape == variance.shape == (0, 4)


def test_calibration_is_a_key():
    uneven = {"channel_gain_spread_db": 1.0, "channel_phase_spread_deg": 60.0, "channel_coupling_db": -20.0}
    place = np.array([[80.0, 10.0, -40.0], [math.nan] * 3])
    off = {}
    for known in (False, True):
        sensor = radar(mount="ownship", calibrated=known, receiver=uneven, **SMALL)
        (scan,) = sensor.sense(0.0, lambda t: (place, np.zeros((2, 3))), own())
        line = place[0] - [0.0, 0.0, -50.0]
        i = int(np.argmin(abs(scan.z[:, 0] - np.linalg.norm(line))))
        angles = [math.atan2(line[1], line[0]), math.asin(-line[2] / np.linalg.norm(line))]
        off[known] = float(np.linalg.norm(scan.z[i, 1:3] - angles))
    assert off[True] < 0.2 * off[False]
    with pytest.raises(ValidationError, match="calibrated is of level"):
        SimulatedRadarConfig(calibrated=True)
