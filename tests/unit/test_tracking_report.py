"""The report of a tracker: its pictures, its words, and files that have little to show."""

from dataclasses import replace

import numpy as np
import pytest

from tests.made_tracks import MadeTracker, NoTracks, made_arrays, made_truth, save
from wideberth.errors import InputError
from wideberth.evaluation.plot_run import load_tracker, run_file, summary_of
from wideberth.evaluation.tracking_figures import plot_positions, polar
from wideberth.evaluation.tracking_report import verdict, write_tracking_report
from wideberth.part_config import PartConfig
from wideberth.sensors.radar.plot_file import read_plot_file

SCORED = {"paths", "plots", "polar", "position", "velocity", "acceleration"}
SCORED |= {"ospa", "errors", "velocity_errors", "nees", "timeline"}


@pytest.fixture
def made(tmp_path, monkeypatch):
    def make(onboard=False, without=(), tracker="MadeTracker"):
        truth = made_truth(60, onboard=onboard)
        monkeypatch.setattr(MadeTracker, "truth", truth, raising=False)
        file = read_plot_file(save(tmp_path / "plots.npz", made_arrays(truth, onboard=onboard), without=without))
        runs = run_file(file, load_tracker(f"tests.made_tracks:{tracker}"), file.seeds())
        return file, runs, summary_of(file, "made", runs)

    return make


@pytest.mark.parametrize("onboard", [False, True])
def test_pictures_and_page(made, tmp_path, onboard):
    page = write_tracking_report(tmp_path / "new" / "report", *made(onboard))
    assert {path.stem for path in page.parent.glob("*.png")} == SCORED
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg role=") == len(SCORED)
    assert "Every aircraft tracked, no false track, no identity switch" in text
    assert ("figure 3.12" in text) == onboard
    assert ("figure 4.17" in text) != onboard
    assert "http" not in text.replace("http://www.w3.org", "")


def test_without_truth_there_is_nothing_scored(made, tmp_path):
    without = ("truth_pos", "truth_vel", "truth_visible", "ownship_id")
    page = write_tracking_report(tmp_path / "report", *made(onboard=True, without=without))
    assert {path.stem for path in page.parent.glob("*.png")} == SCORED & {
        "plots", "polar", "position", "velocity", "acceleration",
    }  # fmt: skip
    assert "Not scored" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("without", [(), ("truth_pos", "truth_vel", "truth_visible", "ownship_id")])
def test_no_track_at_all(made, tmp_path, without):
    page = write_tracking_report(tmp_path / "report", *made(without=without, tracker="NoTracks"))
    text = page.read_text(encoding="utf-8")
    assert ("4 aircraft never tracked" in text) != bool(without)
    assert NoTracks.Config is PartConfig


def test_a_folder_that_cannot_be_made(made, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="cannot write the report into"):
        write_tracking_report(tmp_path / "file", *made())


def test_verdict(made):
    _, _, summary = made()
    assert verdict(summary)[0] == "good"
    worse = {**summary, "metrics": {**summary["metrics"], "false_tracks": 1, "identity_switches": 2}}
    assert verdict(worse)[:2] == ("warn", "1 false track, 2 identity switches")
    worse["metrics"]["intruder_taken_for_ownship_scans"] = 1
    assert verdict(worse)[:2] == (
        "bad",
        "1 scan with an intruder taken for the ownship, 1 false track, 2 identity switches",
    )


@pytest.mark.parametrize("onboard", [False, True])
def test_plots_are_put_where_the_targets_are(made, onboard):
    file, _, _ = made(onboard)
    assert file.truth is not None
    rng = np.random.default_rng(1)
    turned, _ = np.linalg.qr(rng.normal(size=(60, 3, 3)))
    file = replace(file, sensor_attitude=turned)
    seen = polar(file.truth.position[:, 0], file.sensor_position, file.sensor_attitude)
    plots = replace(file.scans(0), first=np.arange(61), z=np.c_[seen, np.full(60, np.nan)])
    np.testing.assert_allclose(plot_positions(plots), file.truth.position[:, 0], atol=1e-9)


@pytest.mark.parametrize("n_scans", [1, 30])
def test_hardly_anything_to_draw(tmp_path, monkeypatch, n_scans):
    """One scan; time that goes back and stands still; no plot that is finite."""
    truth = made_truth(n_scans)
    arrays = made_arrays(truth, seeds=1)
    t = np.minimum(arrays["time"], 1.0)
    t[n_scans // 2 + 1 :] = 0.3
    file = read_plot_file(save(tmp_path / "plots.npz", arrays, time=t, meas_az=np.full(len(arrays["meas_az"]), np.nan)))
    monkeypatch.setattr(MadeTracker, "truth", truth, raising=False)
    runs = run_file(file, load_tracker("tests.made_tracks:MadeTracker"), file.seeds())
    assert write_tracking_report(tmp_path / "report", file, runs, summary_of(file, "made", runs)).exists()
