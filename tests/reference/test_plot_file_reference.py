"""Recorded radar plots: their noise about the truth is what the file says, in the frame that it says."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from wideberth.evaluation.tracking_figures import polar
from wideberth.sensors.radar.plot_file import read_plot_file

FOLDER = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "tracking"


@pytest.mark.parametrize("name", ["bench_3", "bench_5", "bench_5_c20", "bench_man", "bench_onboard"])
def test_errors_of_plots_are_as_told(name):
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        pytest.skip(f"no recorded plots at {path}")
    file = read_plot_file(path)
    truth = file.truth
    assert truth is not None
    assert file.seeds() == tuple(range(10))
    assert file.onboard == (name == "bench_onboard")
    with np.load(path) as data:
        target = data["meas_truth_id"]
    rows = target >= 0
    scan, target = file.scan[rows], target[rows]
    assert truth.visible[scan, target].all()
    there = polar(truth.position[scan, target], file.sensor_position[scan], file.sensor_attitude[scan])
    error = file.z[rows, :3] - there
    error[:, 1] = (error[:, 1] + np.pi) % (2 * np.pi) - np.pi
    # Two-sided at 99.99 %.
    low, high = chi2.ppf([0.00005, 0.99995], rows.sum()) / rows.sum()
    mean_square = (error**2).mean(axis=0) / file.sigma[:3] ** 2
    assert (low < mean_square).all() and (mean_square < high).all(), mean_square
    assert (np.abs(file.z[:, 2]) < file.field_of_view[1] + 5 * file.sigma[2]).all()
