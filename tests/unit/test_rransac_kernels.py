"""The parts of R-RANSAC against dense algebra and finite differences, and the whole against its naive twin."""

import math

import numpy as np
import pytest

from tests.made_plots import made_plots, straight
from tests.naive.rransac import NaiveRransac
from wideberth.tracking.motion_kernels import TURNING, kinematics
from wideberth.tracking.rransac.config import RransacArticleConfig, RransacConfig
from wideberth.tracking.rransac.consensus_kernels import fit_acceleration, fit_velocity
from wideberth.tracking.rransac.plot_kernels import farthest_kept, height_angles
from wideberth.tracking.rransac.settings import settings_of
from wideberth.tracking.rransac.state_kernels import make_window
from wideberth.tracking.rransac.tracker import RransacArticleTracker, RransacTracker
from wideberth.tracking.rransac.turning_kernels import start_of_fit, turning_jacobian, turning_state

STATE = np.array([10.0, -20.0, -80.0, 14.0, 0.7, -0.2, 1.3, -0.1, 0.05])


@pytest.mark.parametrize("size", [2, 3])
def test_hypotheses_pass_their_positions(size):
    window = make_window(4, 2)
    window.t[:] = [0.0, 0.4, 0.5, 1.3]
    window.position[:] = np.random.default_rng(1).normal(size=window.position.shape) * 50
    subset = np.array([[3, 1], [0, 0], [2, 1]])
    x = np.zeros(9)
    (fit_velocity if size == 2 else fit_acceleration)(window, subset, x)
    for slot, plot in subset[:size]:
        dt = window.t[slot] - window.t[3]
        np.testing.assert_allclose(x[:3] + dt * x[3:6] + dt * dt / 2 * x[6:], window.position[slot, plot], atol=1e-9)


def test_gauss_newton_starts_on_the_line_from_the_earliest_plot():
    window = make_window(4, 1)
    window.t[:] = [0.0, 0.4, 0.5, 2.0]
    window.position[:, 0] = window.t[:, None] * np.array([3.0, -4.0, -12.0])
    window.position[2] += 7.0
    start = np.zeros(9)
    start_of_fit(window, np.array([[3, 0], [2, 0], [0, 0]]), start)
    np.testing.assert_allclose(start[:3], [6.0, -8.0, -24.0])
    np.testing.assert_allclose(start[3:], [13.0, math.atan2(-4, 3), math.asin(12 / 13), 0, 0, 0])


def test_turning_states_are_the_inverse_of_their_motion():
    motion, jacobian, turning = np.zeros(9), np.zeros((9, 9)), np.zeros(9)
    kinematics(TURNING, STATE, motion, jacobian)
    turning_state(motion, True, turning)
    np.testing.assert_allclose(turning, STATE, atol=1e-12)
    inverse = np.zeros((9, 9))
    turning_jacobian(turning, np.zeros((9, 9)), inverse)
    np.testing.assert_allclose(inverse @ jacobian, np.eye(9), atol=1e-9)
    turning_state(motion, False, turning)
    np.testing.assert_array_equal(turning[6:], 0.0)


@pytest.mark.parametrize("cone", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_a_known_altitude_gives_the_elevation(cone, seed):
    rng = np.random.default_rng(seed)
    pitch, yaw = rng.uniform(0.0, 0.3), rng.uniform(-3, 3)
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    # Thesis (5.3), from sensor to north-east-down.
    attitude = np.array([[cp * cy, cp * sy, -sp], [-sy, cy, 0.0], [sp * cy, sp * sy, cp]]).T
    x, y, z = rng.uniform(50, 200), rng.uniform(-80, 80), rng.uniform(-25, 5)
    below = float((attitude @ [x, y, z])[2])
    distance = math.sqrt(x * x + y * y + z * z)
    azimuth = math.atan2(y, math.hypot(x, z)) if cone else math.atan2(y, x)
    out = np.zeros(2)
    assert height_angles(attitude, below, distance, azimuth, cone, out)
    np.testing.assert_allclose(out, [math.atan2(y, x), math.atan2(-z, math.hypot(x, y))], atol=1e-9)


def test_a_plot_nearer_than_the_altitude_has_no_elevation():
    assert not height_angles(np.eye(3), -50.0, 40.0, 0.1, False, np.zeros(2))


def test_the_nearest_plots_are_kept():
    rng = np.random.default_rng(2)
    plots = rng.uniform(1, 500, size=(300, 3))
    fate = np.ones(300, np.uint8)
    fate[rng.random(300) < 0.2] = 0
    longest = farthest_kept(settings_of(RransacConfig(plots_per_scan_max=40)), plots, fate)
    assert np.count_nonzero((plots[:, 0] <= longest) & (fate != 0)) == 40
    few = farthest_kept(settings_of(RransacConfig(plots_per_scan_max=1000)), plots, fate)
    assert few == plots[fate != 0, 0].max()


CASES = {
    "thesis": RransacConfig(
        window_scans=15, lifetime_scans=5, consensus_ratio=0.2, ransac_iterations=20, begin_ratio=0.3, end_ratio=0.2
    ),
    "article": RransacArticleConfig(window_scans=15, lifetime_scans=5, ransac_iterations=10, gate_sigmas=(17.5, 4, 4)),
    "robust": RransacConfig(preset="robust"),
    "robust, accelerating": RransacConfig(
        preset="robust", model="constant_acceleration", noise_density=(0.1, 0.1, 0.1), covariance_inflation=1.0
    ),
    "polar": RransacConfig(preset="robust", update="polar", gate="thresholds", gate_sigmas=(10.0, 4.0, 4.0)),
}


@pytest.mark.parametrize("case", CASES)
def test_the_tracker_does_what_its_naive_twin_does(case):
    config = CASES[case]
    truth = straight([[150, 80, -60], [-60, 200, -90]], [[-12, 6, -1], [14, -3, 0]], 40)
    plots = made_plots(truth, seed=4, clutter=3)
    kind = RransacArticleTracker if isinstance(config, RransacArticleConfig) else RransacTracker
    table = kind(config).run(plots)
    naive = NaiveRransac(config)
    seen = 0
    for k in range(plots.n_scans):
        z = plots.z[plots.first[k] : plots.first[k + 1]]
        naive.scan(plots.t[k], z, plots.sensor_position[k], plots.sensor_attitude[k], plots.sigma[:3])
        expected = sorted((track for track in naive.tracks if track.good), key=lambda track: track.name)
        rows = np.flatnonzero(table.scan == k)
        rows = rows[np.argsort(table.track_id[rows])]
        assert table.track_id[rows].tolist() == [track.name for track in expected], k
        for row, track in zip(rows, expected, strict=True):
            np.testing.assert_allclose(table.x[row, : naive.n], track.x, rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(table.P[row, : naive.n, : naive.n], track.P, rtol=1e-5, atol=1e-6)
            seen += 1
    assert seen > 20
