"""Plots of a line of elements: what angle and errors a cone stands for, against drawn errors."""

import dataclasses
import math
import os

import numpy as np
import pytest

from wideberth.simulation.radar_plots import radar_plots, radar_scan
from wideberth.tracking.multi_target.intake_kernels import azimuth_on_cone, cone_at_height
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import TrackStatus


def tilted(pitch, yaw):
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cp * cy, cp * sy, -sp], [-sy, cy, 0.0], [sp * cy, sp * sy, cp]]).T


@pytest.mark.parametrize("seed", range(6))
def test_an_elevation_puts_the_plot_on_the_cone(seed):
    rng = np.random.default_rng(seed)
    cone, elevation = rng.uniform(-0.6, 0.6), rng.uniform(-0.5, 0.5)
    azimuth = azimuth_on_cone(cone, elevation)
    assert math.cos(elevation) * math.sin(azimuth) == pytest.approx(math.sin(cone))
    assert azimuth_on_cone(1.5, 1.0) == pytest.approx(math.pi / 2) and azimuth_on_cone(-1.5, 1.0) < 0.0


@pytest.mark.parametrize("seed", range(8))
def test_variances_at_a_known_height_are_those_of_drawn_errors(seed):
    """The errors of the cone's angle and of the height are drawn, and each plot is solved anew.

    The two variances are of angles that are correlated; what counts is that the ellipse is not too small: the variance
    along either axis is within a fifth of the drawn one, or above it.
    """
    rng = np.random.default_rng(seed)
    attitude = tilted(rng.uniform(0.0, 0.3), rng.uniform(-3.0, 3.0))
    place = np.array([rng.uniform(80, 200), rng.uniform(-60, 60), rng.uniform(-60, -20)])
    below, distance = float((attitude @ place)[2]), float(np.linalg.norm(place))
    cone, sigma, height = math.asin(place[1] / distance), 0.01, 2.0
    z = np.array([distance, cone, math.nan, math.nan])
    variance = np.array([0.1, sigma**2, math.nan, math.nan])
    assert cone_at_height(attitude, distance, below, height, z, variance)
    expected = [math.atan2(place[1], place[0]), math.asin(-place[2] / distance)]
    np.testing.assert_allclose(z[1:3], expected, atol=1e-9)
    drawn = []
    for _ in range(3000):
        one = np.array([distance, cone + sigma * rng.normal(), math.nan, math.nan])
        if cone_at_height(attitude, distance, below + height * rng.normal(), height, one, np.ones(4)):
            drawn.append(one[1:3])
    assert len(drawn) > 2900
    ratio = variance[1:3] / np.var(drawn, axis=0)
    # 3000 draws tell a variance to 2.6 % (one sigma).
    assert (ratio > 0.8).all() and (ratio < 3.0).all(), ratio


def test_a_cone_that_does_not_meet_the_height_is_left_as_it_is():
    z = np.array([50.0, 0.1, math.nan, math.nan])
    variance = np.ones(4)
    assert not cone_at_height(np.eye(3), 50.0, -80.0, 2.0, z, variance)
    assert z[1] == 0.1 and (variance == 1.0).all()


def flown(seed, height, kind, course):
    """Confirmed tracks after 10 s before a line array (or a 2-D radar) that looks north, and the truth."""
    rng = np.random.default_rng(seed)
    t, azimuth = 0.1 * np.arange(100), rng.uniform(-0.6, 0.6)
    start = rng.uniform(220.0, 320.0) * np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) - [0.0, 0.0, height]
    speed = 10.0 * np.array([math.cos(course), math.sin(course), 0.0])
    place, speeds = (start + t[:, None] * speed)[:, None], np.tile(speed, (len(t), 1, 1))
    view = {"field_of_view": (math.radians(60.0), math.radians(40.0)), "range_max": 500.0}
    plots, _ = radar_plots(rng, place, speeds, clutter_max=1, detection_probability=0.9, **view)
    tracker = MultiTargetTracker(MultiTargetTracker.Config())
    for k in range(len(t)):
        scan = radar_scan(plots, k)
        z = scan.z.copy()
        if kind == "radar_cone":
            z[:, 1] = np.arcsin(np.sin(z[:, 1]) * np.cos(z[:, 2]))
        z[:, 2] = np.nan
        tracks = tracker.step(float(t[k]), [dataclasses.replace(scan, kind=kind, z=z)])[0]
    held = [track for track in tracks if track.status is not TrackStatus.TENTATIVE]
    return held, place[-1, 0], speed


@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="thousands of scans: minutes without the compiler"
)
@pytest.mark.parametrize("kind", ["radar", "radar_cone"])
@pytest.mark.parametrize("height", [0.0, 40.0, 90.0])
def test_without_elevation_and_altitude_a_track_is_born_and_says_how_little_it_knows(kind, height):
    """Ten flights. The height's error is part of what is reported: horizontally within 3 sigma always."""
    for seed in range(10):
        tracks, place, speed = flown(seed, height, kind, course=0.6 * seed)
        assert len(tracks) == 1
        x, p = tracks[0], tracks[0].covariance
        e, v = (x.position - place)[:2], (x.velocity - speed)[:2]
        assert e @ np.linalg.solve(p[:2, :2], e) < 14.0 and v @ np.linalg.solve(p[3:5, 3:5], v) < 14.0
        # The range is known all the same; a line array knows what is across its forward axis.
        assert abs(np.linalg.norm(x.position) - np.linalg.norm(place)) < 5.0
        assert kind == "radar" or abs(e[1]) < 5.0
        assert abs(place[2] - x.position[2]) < 3.0 * math.sqrt(p[2, 2]) and math.sqrt(p[2, 2]) > 50.0
