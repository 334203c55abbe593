"""How plots lie to predictions: geometry, the zenith, the field of view, and honest variances by Monte Carlo."""

import math

import numpy as np
import pytest

from wideberth.tracking.multi_target.sighting_kernels import (
    detection_at,
    element_variances,
    frame_at,
    innovation,
    inside,
    line_of_sight,
    log_density,
    projected,
    sector_volume,
    sight_rows,
    visibility,
)
from wideberth.tracking.radar_kernels import to_plot, to_sensor

ZERO = np.zeros(3)
SIGMA = np.array([0.4, math.radians(1.0), math.radians(1.0), 0.2])


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q @ np.diag(np.sign(np.diag(r)))
    return q * np.sign(np.linalg.det(q))


def seen(sensor, attitude, position):
    a, b = np.zeros(3), np.zeros(3)
    to_sensor(sensor, attitude, position, a)
    to_plot(a, b)
    return b


@pytest.mark.parametrize("seed", range(5))
def test_a_perfect_plot_has_no_innovation_from_any_pose(seed):
    rng = np.random.default_rng(seed)
    sensor, attitude, x = rng.normal(size=3) * 50, rotation(rng), rng.normal(size=6) * 200
    frame, look, sight, e = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(4)
    frame_at(sensor, attitude, x, frame, look)
    np.testing.assert_allclose(look, seen(sensor, attitude, x))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frame[0], (x[:3] - sensor) / look[0], atol=1e-12)
    line_of_sight(attitude, look[1], look[2], sight)
    np.testing.assert_allclose(sight, frame[0], atol=1e-12)
    velocity = rng.normal(size=3)
    rate = (x[:3] - sensor) @ (x[3:] - velocity) / look[0]
    innovation(sensor, velocity, frame, look, 0.0, 0.0, x, np.array([*look, rate]), sight, e)
    np.testing.assert_allclose(e, 0.0, atol=1e-9)
    innovation(sensor, velocity, frame, look, 0.0, 0.0, x, np.array([*look[:2], np.nan, np.nan]), sight, e)
    assert math.isnan(e[2]) and math.isnan(e[3]) and abs(e[1]) < 1e-9


@pytest.mark.parametrize("elevation", [5.0, 45.0, 80.0, 89.0, 89.9])
def test_innovations_are_as_large_as_their_variances_say_up_to_the_zenith(elevation):
    """Mean normalised square over 4000 plots: 3 within four standard errors, and some for what is second order."""
    rng = np.random.default_rng(1)
    el, distance, n = math.radians(elevation), 250.0, 4000
    x = np.array([distance * math.cos(el), 0.0, -distance * math.sin(el), 0, 0, 0.0])
    total = 0.0
    frame, look, sight, e, r = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(4), np.zeros(4)
    across = up = 1.0
    for _ in range(n):
        # The prediction is off by a metre each way: its direction across is turned near the zenith.
        off = x.copy()
        off[:3] += rng.normal(size=3)
        frame_at(ZERO, np.eye(3), off, frame, look)
        z = np.array([distance, 0.0, el, np.nan]) + np.array([*rng.normal(size=3), 0.0]) * SIGMA
        line_of_sight(np.eye(3), z[1], z[2], sight)
        element_variances(look, across, up, SIGMA**2, r)
        innovation(ZERO, ZERO, frame, look, across, up, off, z, sight, e)
        total += np.sum(e[:3] ** 2 / (r[:3] + 1.0))
    assert total / n == pytest.approx(3.0, abs=4 * math.sqrt(6 / n) + 0.15)


def test_variances_grow_with_range_and_shrink_towards_the_zenith():
    out = np.zeros(4)
    element_variances(np.array([500.0, 0.0, 0.0]), 0.0, 0.0, SIGMA**2, out)
    assert math.sqrt(out[1]) == pytest.approx(500 * SIGMA[1], rel=1e-3)
    assert math.sqrt(out[2]) == pytest.approx(500 * SIGMA[2])
    element_variances(np.array([500.0, 0.0, math.radians(60)]), 0.0, 0.0, SIGMA**2, out)
    assert math.sqrt(out[1]) == pytest.approx(250 * SIGMA[1], rel=1e-3)


def test_rows_are_the_derivatives():
    rng = np.random.default_rng(4)
    attitude, x, velocity = rotation(rng), rng.normal(size=6) * 100, rng.normal(size=3)
    frame, look, sight, h = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros((4, 6))
    frame_at(ZERO, attitude, x, frame, look)
    line_of_sight(attitude, look[1], look[2], sight)
    sight_rows(ZERO, velocity, frame, x, True, h)
    z = np.array([*look, 1.0])
    for j in range(6):
        ends = []
        for sign in (1e-4, -1e-4):
            y, e = x.copy(), np.zeros(4)
            y[j] += sign
            innovation(ZERO, velocity, frame, look, 0.0, 0.0, y, z, sight, e)
            ends.append(e)
        np.testing.assert_allclose(h[:, j], -(ends[0] - ends[1]) / 2e-4, atol=1e-6)


def test_projection_is_the_variance_along_a_row():
    rng = np.random.default_rng(5)
    a = rng.normal(size=(3, 3))
    frame = rotation(rng)
    assert projected(frame, a @ a.T, 1) == pytest.approx(frame[1] @ a @ a.T @ frame[1])


def test_detection_table():
    ranges, probabilities = np.array([100.0, 200.0, 200.0]), np.array([0.9, 0.5, 0.5])
    assert [detection_at(ranges, probabilities, r) for r in (0.0, 100.0, 150.0, 200.0, 201.0, math.nan)] == (
        pytest.approx([0.9, 0.9, 0.7, 0.5, 0.0, 0.0])
    )


def test_visibility_is_a_probability_at_the_edges():
    fov, spread = np.array([math.radians(60), math.radians(30)]), np.ones(3)
    assert visibility(np.array([100.0, 0.0, 0.0]), spread, fov, 600.0) == pytest.approx(1.0)
    assert visibility(np.array([600.0, 0.0, 0.0]), spread, fov, 600.0) == pytest.approx(0.5)
    assert visibility(np.array([100.0, fov[0], 0.0]), spread, fov, 600.0) == pytest.approx(0.5)
    assert visibility(np.array([100.0, 0.0, -fov[1]]), spread, fov, 600.0) == pytest.approx(0.5)
    assert visibility(np.array([100.0, math.pi, 0.0]), spread, fov, 600.0) == pytest.approx(0.0)
    everything = np.array([math.pi, math.pi / 2])
    assert visibility(np.array([100.0, math.pi, math.pi / 2]), spread, everything, 600.0) == pytest.approx(1.0)
    assert inside(1.0, 0.0) == 1.0 and inside(-1.0, 0.0) == 0.0


def test_volume_and_density():
    assert sector_volume(600.0, np.array([math.pi, math.pi / 2])) == pytest.approx(4 / 3 * math.pi * 600**3)
    fov, look = np.array([1.0, 0.5]), np.array([100.0, 0.0, 0.0])
    nan = np.nan
    assert log_density(1e-6, look, fov, 50.0, np.array([1, 1, 1, nan])) == pytest.approx(math.log(1e-6))
    assert log_density(1e-6, look, fov, 50.0, np.array([1, 1, nan, nan])) == pytest.approx(math.log(1e-4))
    assert log_density(1e-6, look, fov, 50.0, np.array([1, 1, 1, 2.0])) == pytest.approx(math.log(1e-8))
