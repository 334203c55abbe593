import math

import numpy as np
import pytest

from wideberth.analysis.operation_volume import SurveillanceVolume, operation_volume

HEMISPHERE = SurveillanceVolume(1000.0, 1000.0, "hemisphere")
CYLINDER = SurveillanceVolume(1000.0, 400.0)


def test_all_round_the_hemisphere_shrinks_by_the_range():
    volume = operation_volume(HEMISPHERE, 300.0)
    assert (volume.radius, volume.height) == (700.0, 700.0)
    np.testing.assert_allclose(volume.radius_at([0.0, 420.0, 700.0, 701.0]), [700.0, 560.0, 0.0, 0.0])


def test_intruders_that_fly_level_reach_less_far_up():
    volume = operation_volume(HEMISPHERE, 300.0, required_height=0.0)
    assert volume.radius == 700.0
    assert volume.height == pytest.approx(math.sqrt(1000.0**2 - 300.0**2))
    assert volume.radius_at(600.0) == pytest.approx(500.0)
    steeper = operation_volume(HEMISPHERE, 300.0, required_height=100.0)
    assert steeper.radius == pytest.approx(math.sqrt(1000.0**2 - 100.0**2) - 300.0)
    assert steeper.height == pytest.approx(volume.height - 100.0)


def test_the_cylinder():
    level = operation_volume(CYLINDER, 300.0, required_height=0.0)
    assert (level.radius, level.height) == (700.0, 400.0)
    around = operation_volume(CYLINDER, 300.0, turn_margin=50.0)
    assert (around.radius, around.height) == (650.0, 50.0)
    np.testing.assert_array_equal(around.radius_at([0.0, 50.0, 51.0]), [650.0, 650.0, 0.0])


@pytest.mark.parametrize("surveillance", [HEMISPHERE, CYLINDER])
@pytest.mark.parametrize("required_height", [None, 0.0, 120.0])
def test_whoever_comes_has_been_inside_for_the_required_range(surveillance, required_height):
    required = 250.0
    volume = operation_volume(surveillance, required, required_height=required_height)
    rng = np.random.default_rng(1)
    heights = np.append(rng.uniform(0.0, volume.height, 200), [0.0, volume.height])
    corner = False
    for z, radius in zip(heights, volume.radius_at(heights), strict=True):
        azimuth = rng.uniform(0.0, 2 * math.pi, 400)
        if required_height is None:
            up = np.append(rng.uniform(-1.0, 1.0, 399), z / math.hypot(z, radius)) * required
        else:
            up = np.append(rng.uniform(-1.0, 1.0, 399), 1.0) * required_height
        azimuth[-1] = 0.0  # straight outwards
        side = np.sqrt(required**2 - up**2) if required_height is None else required
        out = np.hypot(radius + side * np.cos(azimuth), side * np.sin(azimuth))
        above = z + up
        if surveillance.shape == "cylinder":
            inside = (out <= surveillance.radius + 1e-6) & (above <= surveillance.height + 1e-6)
        else:
            inside = np.hypot(out, above) <= surveillance.radius + 1e-6
            corner |= bool(abs(np.hypot(out, above) - surveillance.radius).min() < 1e-6)
        assert np.all(inside | (above < 0.0))
    assert corner or surveillance.shape == "cylinder"  # and no smaller than it must be


def test_too_short_a_range_leaves_nothing():
    for required in (1000.0, 5000.0):
        volume = operation_volume(HEMISPHERE, required)
        assert (volume.radius, volume.height) == (0.0, 0.0)
        assert volume.radius_at(0.0) == 0.0
    assert operation_volume(CYLINDER, 450.0).radius == 0.0  # not high enough
    assert operation_volume(HEMISPHERE, 1200.0, required_height=10.0).height == 0.0


def test_bad_arguments_are_refused_by_name():
    for name in ("radius", "height"):
        with pytest.raises(ValueError, match=f"{name} must be"):
            SurveillanceVolume(**({"radius": 10.0, "height": 10.0} | {name: -1.0}))
    with pytest.raises(ValueError, match="height must be the radius"):
        SurveillanceVolume(10.0, 9.0, "hemisphere")
    with pytest.raises(ValueError, match="shape must be one of"):
        SurveillanceVolume(10.0, 9.0, "cone")
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="required_range must be"):
            operation_volume(CYLINDER, wrong)
    with pytest.raises(ValueError, match="required_height must be"):
        operation_volume(CYLINDER, 10.0, required_height=-1.0)
    with pytest.raises(ValueError, match="turn_margin must be"):
        operation_volume(CYLINDER, 10.0, turn_margin=math.inf)
    with pytest.raises(ValueError, match="height must be"):
        operation_volume(CYLINDER, 10.0).radius_at(-1.0)
