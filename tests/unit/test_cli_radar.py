"""Raw samples to plots by the command: files, noise runs, figures, and input that does not fit."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from wideberth.cli.main import app
from wideberth.errors import InputError
from wideberth.evaluation.radar_figures import angle_figure, parabola_figure
from wideberth.evaluation.radar_report import Watched, draw
from wideberth.evaluation.radar_run import process_recording
from wideberth.evaluation.radar_setup import load_radar
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.plot_file import read_plot_file
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.processing.frame import process_frame
from wideberth.sensors.radar.raw.recording import RawRecording, write_raw
from wideberth.sensors.radar.sweeps.simulate import RadarTarget, simulate_frames

TOML = """
preset = "uplooking_4x4"
if_bandwidth_mhz = 0.128
averages = 8
false_alarm_probability = 0.001
[receiver]
noise_rms_lsb = 4.0
[pose]
north_m = 10.0
altitude_m = 2.0
"""
FRAMES = 12


def run(*arguments):
    return CliRunner().invoke(app, ["radar", *map(str, arguments)])


def scene(k):
    t = 0.1 * k
    return [
        RadarTarget(range=50.0 - 4.0 * t, azimuth=0.3, elevation=-0.2, range_rate=-4.0, rcs=1e-5),
        RadarTarget(range=30.0 + 3.0 * t, azimuth=-0.4, elevation=0.1, range_rate=3.0, rcs=1e-5),
    ]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("radar")
    (folder / "radar.toml").write_text(TOML)
    radar = load_radar(str(folder / "radar.toml")).radar
    write_raw(folder / "raw.npy", simulate_frames(radar, map(scene, range(FRAMES)), 8, 1), FRAMES)
    write_raw(folder / "quiet.npy", simulate_frames(radar, [()] * 60, 8, 2), 60)
    return folder


def test_a_radar_is_a_preset_with_a_file_over_it(files):
    setup = load_radar(str(files / "radar.toml"))
    assert setup.radar.channels == 16
    assert setup.radar.samples_per_sweep == 512
    assert setup.radar.receiver.noise_rms_lsb == 4.0
    assert setup.radar.receiver.channel_coupling_db == -20.0
    np.testing.assert_allclose(setup.position, [10.0, 0.0, -2.0])
    # It looks up: its forward axis is up, its down axis north.
    np.testing.assert_allclose(setup.attitude @ [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], atol=1e-12)
    assert load_radar("table_5_1").radar == PRESETS["table_5_1"]


def test_samples_become_plots_with_their_variances(files):
    quiet = run("noise", files / "quiet.npy", "--radar", files / "radar.toml", "--out", files / "noise.npz")
    assert quiet.exit_code == 0, quiet.output
    assert "480 sweeps of 16 channels" in quiet.output
    out = files / "plots.parquet"
    options = ["--radar", files / "radar.toml", "--noise", files / "noise.npz", "--out", out]
    result = run("process", files / "raw.npy", *options)
    assert result.exit_code == 0, result.output
    table = pq.read_table(out).to_pydict()
    assert set(table["kind"]) == {"radar"}
    for k in range(FRAMES):
        rows = np.flatnonzero(np.array(table["scan"]) == k)
        found = np.array(table["range_m"])[rows]
        for target in scene(k):
            i = rows[np.argmin(abs(found - target.range))]
            assert abs(table["range_m"][i] - target.range) < 6 * table["range_variance_m2"][i] ** 0.5
            off = abs(table["azimuth_rad"][i] - target.azimuth)
            # Uncalibrated coupling shifts directions by a little more than noise does.
            assert off < 0.1
            assert table["snr_db"][i] > 5.0


def test_a_tracker_takes_the_plots(files):
    options = ["--radar", files / "radar.toml", "--out", files / "plots.npz"]
    assert run("process", files / "raw.npy", *options).exit_code == 0
    file = read_plot_file(files / "plots.npz")
    np.testing.assert_allclose(file.sensor_position[0], [10.0, 0.0, -2.0])
    np.testing.assert_allclose(file.sensor_attitude[0], load_radar(str(files / "radar.toml")).attitude, atol=1e-12)
    assert file.range_max == pytest.approx(load_radar(str(files / "radar.toml")).radar.range_limit)
    tracked = CliRunner().invoke(
        app, ["track", str(files / "plots.npz"), "--out", str(files / "tracks.parquet"), "--json"]
    )
    assert tracked.exit_code == 0, tracked.output
    assert json.loads(tracked.stdout)["rows"] > 0
    rows = pq.read_table(files / "tracks.parquet").to_pydict()
    # Two aircraft above the radar.
    assert len(set(rows["track_id"])) == 2
    assert min(rows["up_m"]) > 15.0


def test_the_report_has_its_pictures(files):
    result = run("show", files / "raw.npy", "--radar", files / "radar.toml", "--out", files / "show")
    assert result.exit_code == 0, result.output
    names = {path.stem for path in (files / "show").glob("*.png")}
    assert {"range_time", "threshold", "parabola", "range_doppler", "angles", "false_alarms"} <= names
    page = (files / "show" / "report.html").read_text()
    assert f"{FRAMES} of {FRAMES} frames" in page


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('preset = "other"', "preset"),
        ("chanels = 4", "chanels: unknown key"),
        ("[layout]\naxis = 3", "layout.axis"),
        ("[pose]\nnorth = 3", "pose.north"),
    ],
)
def test_radars_that_are_wrong(tmp_path, text, words):
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        load_radar(str(tmp_path / "r.toml"))


def test_input_that_does_not_fit(files, tmp_path):
    other = run("process", files / "raw.npy", "--radar", "table_5_1", "--out", tmp_path / "p.parquet")
    assert other.exit_code == 2
    assert "16 channels, the radar has 4" in other.output
    assert run("process", files / "raw.npy", "--radar", "none").exit_code == 2
    noise = files / "noise_of_another.npz"
    line = tmp_path / "line.toml"
    line.write_text("if_bandwidth_mhz = 0.128\naverages = 8\n")
    radar = load_radar(str(line)).radar
    write_raw(tmp_path / "line.npy", simulate_frames(radar, [()] * 3, 8, 2), 3)
    assert run("noise", tmp_path / "line.npy", "--radar", line, "--out", noise).exit_code == 0
    wrong = run("process", files / "raw.npy", "--radar", files / "radar.toml", "--noise", noise)
    assert wrong.exit_code == 2
    assert "another radar" in wrong.output
    one = run("process", tmp_path / "line.npy", "--radar", line, "--out", tmp_path / "p.npz")
    assert one.exit_code == 2
    assert "one angle" in one.output
    assert (
        run("process", files / "raw.npy", "--radar", files / "radar.toml", "--out", tmp_path / "p.csv").exit_code == 2
    )


def changed(files, change):
    samples = np.load(files / "raw.npy")
    change(samples)
    np.save(files / "changed.npy", samples)
    return files / "changed.npy"


def channel_of_nan(samples):
    samples[:, :, 5] = np.nan


def channel_of_zeros(samples):
    samples[:, :, 5] = 0.0


def frames_of_nan(samples):
    samples[:3] = np.nan


def counts(samples):
    samples *= 1e8


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (channel_of_nan, ["channel not finite", "channel 5 (from 0) not used, scans"]),
        (channel_of_zeros, ["channel constant", "channel 5 (from 0) not used, scans"]),
        (frames_of_nan, ["frame unusable", "channel_not_finite 16; look at the cables"]),
        (counts, ["frame unusable", "channel_too_loud 16", "volts"]),
    ],
)
def test_what_is_wrong_with_samples_is_told(files, change, words):
    file = changed(files, change)
    for command in (["process", file, "--out", files / "p.parquet"], ["show", file, "--out", files / "page"]):
        result = run(*command, "--radar", files / "radar.toml")
        assert result.exit_code == 0, result.output
        assert all(word in result.output for word in words), result.output
    page = (files / "page" / "report.html").read_text()
    assert words[0] in page and words[1] in page


def test_a_noise_run_says_which_channel_is_not_usable(files):
    file = changed(files, channel_of_zeros)
    result = run("noise", file, "--radar", files / "radar.toml", "--out", files / "some.npz")
    assert result.exit_code == 0, result.output
    levels = result.output.splitlines()[1].split(": ")[-1].split(", ")
    assert levels[5] == "not usable"
    assert len(levels) == 16
    assert "volts_per_unit" not in result.output
    file = changed(files, counts)
    assert "volts_per_unit" in run("noise", file, "--radar", files / "radar.toml", "--out", files / "n.npz").output


def test_files_that_are_something_else_are_refused_with_what_to_do(files):
    (files / "text.npy").write_text("no array")
    ArrayCalibration.ideal(4).save(files / "four.npz")
    radar = ["--radar", files / "radar.toml", "--out", files / "p.parquet"]
    for options, words in (
        ([files / "text.npy"], "numpy.save"),
        ([files / "raw.npy", "--noise", files / "text.npy"], "wideberth radar noise"),
        ([files / "raw.npy", "--noise", files / "none.npz"], "no such file"),
        ([files / "raw.npy", "--calibration", files / "text.npy"], "not a calibration"),
        ([files / "raw.npy", "--calibration", files / "four.npz"], "of 4 channels, the radar has 16"),
    ):
        result = run("process", *options, *radar)
        assert result.exit_code == 2, result.output
        assert words in result.output


def test_pictures_are_of_the_frame_with_most_plots_of_the_file(files):
    setup = load_radar(str(files / "radar.toml"))
    recording = RawRecording(changed(files, frames_of_nan), setup.radar, setup.layout)
    watched = Watched()
    process_recording(setup, recording, None, watch=watched)
    assert len(watched.times) == FRAMES - 3
    assert watched.chosen >= 3
    drawn = draw(setup, recording, watched)
    # Cells are drawn around their middles: that of no Doppler around 0.
    left, right, bottom, top = drawn["range_doppler"].axes[0].images[0].get_extent()
    cell = (top - bottom) / 8
    assert bottom + 4.5 * cell == pytest.approx(0.0, abs=1e-9)
    assert left == pytest.approx(-0.5 * setup.radar.range_bin)
    assert right == pytest.approx((setup.radar.range_bins - 0.5) * setup.radar.range_bin)


def test_mvdr_spectra_do_without_the_channels_that_were_not_used():
    radar = RadarConfig()
    wave = steering_vector(radar, 0.3, 0.0).ravel() * [1.0, 0.0, 1.0, 1.0]
    used = np.array([True, False, True, True])
    figure = angle_figure(radar, [np.outer(wave, wave.conj())], ["echo"], used)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    x, y = lines["echo, MVDR"].get_data()
    assert abs(x[np.argmax(y)] - np.degrees(0.3)) < 1.0
    assert np.median(y) < -15.0


def test_the_parabola_is_drawn_through_the_greatest_peak(files):
    setup = load_radar(str(files / "radar.toml"))
    processed = process_frame(setup.radar, RawRecording(files / "raw.npy", setup.radar).frame(0).samples)
    figure = parabola_figure(setup.radar, processed)
    points, curve, top = figure.axes[0].lines
    x, y = curve.get_data()
    places, magnitudes = points.get_data()
    for k in (0, 50, 100):
        assert y[k] == pytest.approx(magnitudes[places == x[k]][0])
    assert top.get_xdata()[0] == pytest.approx(x[np.argmax(y)], abs=0.02)
