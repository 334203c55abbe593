"""Scans as the kernels take them: always arrays of the same kind, or the compiler would start in flight."""

import dataclasses

import numpy as np
import pytest

from tests.made_plots import scan_of
from wideberth.plots import Plots
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.intake import SensorLog, ready

SIGMA = np.array([0.4, 0.02, 0.02, np.nan])


def scan(n):
    z = np.tile([300.0, 0.1, 0.2, np.nan], (n, 1))
    plots = Plots(
        first=np.array([0, n]), z=z, t=np.zeros(1), sensor_position=np.zeros((1, 3)),
        sensor_attitude=np.eye(3)[None], sigma=SIGMA, detection_probability=0.8, range_max=614.0,
        field_of_view=(np.pi, np.pi / 2), dt=0.1, ownship=np.full((1, 6), np.nan),
    )  # fmt: skip
    return scan_of(plots, 0)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_what_cannot_be_written_is_copied(n):
    given = scan(n)
    frozen = {name: np.array(getattr(given, name)) for name in ("z", "R", "sensor_position", "sensor_attitude")}
    for array in frozen.values():
        array.flags.writeable = False
    made = ready(dataclasses.replace(given, **frozen), SensorLog(0), MultiTargetConfig())
    for name in ("z", "variance", "position", "velocity", "attitude", "field_of_view", "ranges", "probabilities"):
        array = getattr(made, name)
        assert array.flags.writeable and array.flags.c_contiguous, name
    np.testing.assert_array_equal(made.z, given.z)
    np.testing.assert_array_equal(made.variance, np.tile(np.square(SIGMA), (n, 1)))
