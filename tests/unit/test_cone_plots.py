"""Plots of a line of elements: what angle and errors a cone stands for, against drawn errors."""

import math

import numpy as np
import pytest

from wideberth.tracking.multi_target.intake_kernels import azimuth_on_cone, cone_at_height


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
