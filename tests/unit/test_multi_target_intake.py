"""Scans as the kernels take them: always arrays of the same kind, or the compiler would start in flight."""

import dataclasses

import numpy as np
import pytest

from wideberth.plots import Plots
from wideberth.simulation.radar_plots import radar_scan
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.intake import SensorLog, ready

SIGMA = np.array([0.4, 0.02, 0.02, np.nan])


def plots_of(n):
    z = np.tile([300.0, 0.1, 0.2, np.nan], (n, 1))
    return Plots(
        first=np.array([0, n]), z=z, t=np.zeros(1), sensor_position=np.zeros((1, 3)),
        sensor_attitude=np.eye(3)[None], sigma=SIGMA, detection_probability=0.8, range_max=614.0,
        field_of_view=(np.pi, np.pi / 2), dt=0.1, ownship=np.full((1, 6), np.nan),
    )  # fmt: skip


@pytest.mark.parametrize("n", [0, 1, 2])
def test_what_cannot_be_written_is_copied(n):
    given = radar_scan(plots_of(n), 0)
    frozen = {name: np.array(getattr(given, name)) for name in ("z", "R", "sensor_position", "sensor_attitude")}
    for array in frozen.values():
        array.flags.writeable = False
    made = ready(dataclasses.replace(given, **frozen), SensorLog(0), MultiTargetConfig())
    for name in ("z", "variance", "position", "velocity", "attitude", "field_of_view", "ranges", "probabilities"):
        array = getattr(made, name)
        assert array.flags.writeable and array.flags.c_contiguous, name
    np.testing.assert_array_equal(made.z, given.z)
    np.testing.assert_array_equal(made.variance, np.tile(np.square(SIGMA), (n, 1)))


def test_scans_of_plots_have_the_variances_of_each_plot():
    plots = dataclasses.replace(
        plots_of(2), first=np.array([0, 1, 2]), t=np.array([0.0, 0.1]), sensor_position=np.zeros((2, 3)),
        sensor_attitude=np.tile(np.eye(3), (2, 1, 1)),
        variance=np.array([[1.0, 2.0, 3.0, np.nan], [4.0, 5.0, 6.0, np.nan]]),
    )  # fmt: skip
    for k in range(2):
        np.testing.assert_array_equal(radar_scan(plots, k).R, np.diag(plots.variance[k])[None])
    plain = dataclasses.replace(plots, variance=None)
    np.testing.assert_array_equal(radar_scan(plain, 1).R, np.diag(SIGMA**2)[None])
