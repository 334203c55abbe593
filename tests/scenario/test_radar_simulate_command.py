"""A scenario's radar down to its samples, by the command, and from there to plots and scored tracks."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app
from wideberth.evaluation.radar_setup import load_radar
from wideberth.frames import euler_angles, rotation_ned_body
from wideberth.sensors.radar.plot_file import read_plot_file
from wideberth.sensors.radar.raw.recording import RawRecording

# Fewer samples than the 4 x 4 radar of the thesis, for speed: 154 m of range.
SCENARIO = """
name = "small"
seed = 3
[mission]
speed_mps = 13.0
waypoints = [
  {{ north_m = -60.0, east_m = 0.0, altitude_m = 70.0 }},
  {{ north_m = 140.0, east_m = 0.0, altitude_m = 70.0 }},
]
[origin]
lat_deg = 40.25
lon_deg = -111.65
[ownship]
kind = "point_mass"
speed_min_mps = 9.0
speed_max_mps = 17.0
waypoint_capture_m = 20.0
[traffic]
kind = "simulated"
ownship_rcs_m2 = 0.1
[[traffic.intruders]]
address = "000001"
position = {{ north_m = 60.0, east_m = 20.0, altitude_m = 90.0 }}
course_deg = 180.0
speed_mps = 14.0
rcs_m2 = 0.1
[[traffic.intruders]]
address = "000002"
position = {{ north_m = 0.0, east_m = -60.0, altitude_m = 80.0 }}
course_deg = 90.0
speed_mps = 12.0
rcs_m2 = 0.1
[sensor]
kind = "radar"
mount = "{mount}"
bandwidth_mhz = 500.0
sweep_time_ms = 2.0
if_bandwidth_mhz = 0.256
transmit_power_w = 20.0
azimuth_beamwidth_deg = 90.0
elevation_beamwidth_deg = 90.0
channels = 16
array_rows = 4
averages = 8
range_rate = true
false_alarm_probability = 1e-4
boresight_elevation_deg = {up}
azimuth_fov_deg = 180.0
elevation_fov_deg = 180.0
[tracker]
kind = "wideberth"
"""


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulate")
    (folder / "ground.toml").write_text(SCENARIO.format(mount="ground", up=90.0))
    (folder / "onboard.toml").write_text(SCENARIO.format(mount="ownship", up=0.0))
    return folder


def test_all_aircraft_are_tracked_from_samples(folder):
    raw = folder / "raw.npy"
    made = run("radar", "simulate", folder / "ground.toml", "--out", raw, "--duration", "11s", "--noise-frames", "10")
    assert made.exit_code == 0, made.output
    assert "111 frames" in made.output
    setup = load_radar(str(folder / "raw.toml"))
    recording = RawRecording(raw, setup.radar, setup.layout)
    assert recording.n_frames == 111
    assert recording.frame(10).middle(setup.radar) == pytest.approx(1.0)
    quiet = run("radar", "noise", folder / "raw_noise.npy", "--radar", folder / "raw.toml", "--out", folder / "n.npz")
    assert quiet.exit_code == 0, quiet.output
    assert "80 sweeps of 16 channels" in quiet.output
    options = ["--radar", folder / "raw.toml", "--noise", folder / "n.npz", "--truth", folder / "raw_truth.npz"]
    done = run("radar", "process", raw, *options, "--out", folder / "plots.npz")
    assert done.exit_code == 0, done.output
    truth = read_plot_file(folder / "plots.npz").truth
    assert truth is not None and truth.ownship == 2 and truth.visible.all()
    np.testing.assert_allclose(truth.position[0], [[60.0, 20.0, -90.0], [0.0, -60.0, -80.0], [-60.0, 0.0, -70.0]])
    tracked = run("track", folder / "plots.npz", "--out", folder / "tracks.parquet", "--json")
    assert tracked.exit_code == 0, tracked.output
    scores = json.loads(tracked.stdout)
    metrics = scores["metrics"]
    assert metrics["never_confirmed"] == 0 and metrics["false_tracks"] == 0
    assert metrics["missed_fraction"] < 0.35 and metrics["rmse_position_m"] < 0.5
    # Each plot has its own variances in the file. Aircraft that fly straight are tracked with caution.
    assert metrics["nees_per_dof"] < 1.5 and metrics["coverage_95_position"] > 0.9


def test_the_radar_on_board_says_where_it_was(folder):
    raw = folder / "board.npy"
    made = run("radar", "simulate", folder / "onboard.toml", "--out", raw, "--duration", "1s", "--seed", "7")
    assert made.exit_code == 0, made.output
    out = folder / "board.npz"
    options = ["--radar", folder / "board.toml", "--truth", folder / "board_truth.npz", "--out", out]
    done = run("radar", "process", raw, *options)
    assert done.exit_code == 0, done.output
    file = read_plot_file(out)
    assert file.onboard and file.truth.position.shape == (11, 2, 3)
    assert file.sensor_position[0] == pytest.approx([-60.0, 0.0, -70.0])
    assert file.sensor_position[10, 0] == pytest.approx(-47.0, abs=0.5)
    # The plots lie where the aircraft are.
    for k in (0, 5, 10):
        line = (file.truth.position[k, 0] - file.sensor_position[k]) @ file.sensor_attitude[k]
        z = file.z[file.scan == k]
        assert abs(z[:, 0] - np.linalg.norm(line)).min() < 0.1


def test_seeds_and_input_that_does_not_fit(folder):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        made = run("radar", "simulate", folder / "ground.toml", "--out", folder / f"{name}.npy", "--seed", seed,
                   "--duration", "0.2s")  # fmt: skip
        assert made.exit_code == 0, made.output
    a, b, c = (np.load(folder / f"{name}.npy") for name in "abc")
    assert np.array_equal(a, b) and not np.array_equal(a, c)
    assert "end it in .npy" in run("radar", "simulate", folder / "ground.toml", "--out", "raw.raw").output
    (folder / "adsb.toml").write_text((folder / "ground.toml").read_text().split("[sensor]")[0])
    wrong = run("radar", "simulate", folder / "adsb.toml", "--out", folder / "x.npy")
    assert wrong.exit_code != 0 and "there is no radar" in str(wrong.output) + str(wrong.exception)
    longer = run("radar", "simulate", folder / "ground.toml", "--out", folder / "d.npy", "--duration", "0.4s")
    assert longer.exit_code == 0, longer.output
    options = ["--radar", folder / "d.toml", "--truth", folder / "a_truth.npz", "--out", folder / "x.npz"]
    mixed = run("radar", "process", folder / "d.npy", *options)
    assert mixed.exit_code != 0 and "not of the times" in str(mixed.output) + str(mixed.exception)


@pytest.mark.parametrize(
    "angles", [(0.1, -0.4, 2.0), (-3.0, 1.2, -3.1), (0.0, np.pi / 2, 0.7), (0.0, -np.pi / 2, -2.0)]
)
def test_euler_angles_are_those_of_the_rotation(angles):
    np.testing.assert_allclose(euler_angles(rotation_ned_body(*angles)), angles, atol=1e-7)
