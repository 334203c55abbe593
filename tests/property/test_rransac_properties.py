"""R-RANSAC and ER-RANSAC stand any plots: what they answer is finite, and all that is left out is counted."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.made_plots import made_plots, straight
from wideberth.tracking.rransac.config import ErRransacConfig, RransacConfig
from wideberth.tracking.rransac.tracker import ErRransacTracker, RransacTracker

TRACKERS = {
    "linear": RransacTracker(RransacConfig(preset="robust")),
    "printed": RransacTracker(RransacConfig(window_scans=8, lifetime_scans=2, ransac_iterations=5)),
    "turning": ErRransacTracker(ErRransacConfig(preset="robust", hypothesis="turning", window_scans=8)),
}
STRANGE = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.sampled_from([0.0, -0.0, 1e-300, 1e300, np.pi, np.pi / 2])
)


@pytest.mark.parametrize("name", TRACKERS)
@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    values=st.lists(st.tuples(st.integers(0, 3000), st.integers(0, 2), STRANGE), max_size=30),
    times=st.lists(st.tuples(st.integers(0, 24), STRANGE), max_size=3),
)
def test_any_plots_are_stood(name, seed, values, times):
    truth = straight([[120, 60, -60], [0, 150, -5]], [[-12, 6, -1], [2, -20, 0]], 25)
    plots = made_plots(truth, seed)
    z, t = plots.z.copy(), plots.t.copy()
    for row, column, value in values:
        z[row % len(z), column] = value
    for k, value in times:
        t[k] = value
    table = TRACKERS[name].run(replace(plots, z=z, t=t))
    assert np.isfinite(table.x).all()
    assert np.isfinite(table.P).all()
    assert np.all(np.diagonal(table.P, axis1=1, axis2=2) >= 0.0)
    wrong = ~np.isfinite(z[:, :3]).all(axis=1)
    if not times:
        assert table.counters.get("plot not finite", 0) == wrong.sum()
