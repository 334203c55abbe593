"""What holds for any state, pose and plot: round trips, angles in their circle, covariances that stay covariances."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from wideberth.frames import rotation_ned_body
from wideberth.tracking import motion_kernels, radar_kernels, unscented_kernels, update_kernels

FloatArray = NDArray[np.float64]

models = st.sampled_from(
    [motion_kernels.CONSTANT_VELOCITY, motion_kernels.CONSTANT_ACCELERATION, motion_kernels.TURNING]
)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(rotation_ned_body, angles, st.floats(-1.5, 1.5), angles)
positions = arrays(float, 3, elements=st.floats(-2e3, 2e3))
seeds = st.integers(0, 2**32 - 1)


@given(st.floats(-1e3, 1e3))
def test_wrap_stays_in_the_circle_and_keeps_the_angle(angle: float) -> None:
    wrapped = radar_kernels.wrap(angle)
    assert -math.pi <= wrapped <= math.pi
    assert abs(math.remainder(wrapped - angle, 2 * math.pi)) < 1e-12


@given(poses, positions, positions)
def test_plots_lead_back_to_the_position(attitude: FloatArray, sensor: FloatArray, position: FloatArray) -> None:
    seen, plot, back = np.empty(3), np.empty(3), np.empty(3)
    radar_kernels.to_sensor(sensor, attitude, position, seen)
    radar_kernels.to_plot(seen, plot)
    assert plot[0] >= 0.0
    assert abs(plot[1]) <= math.pi
    assert abs(plot[2]) <= math.pi / 2
    radar_kernels.to_position(sensor, attitude, plot[0], plot[1], plot[2], back)
    assert np.allclose(back, position, rtol=0.0, atol=1e-8)


@given(models, st.floats(-5.0, 5.0), seeds)
def test_propagation_there_and_back(model: int, dt: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.normal(size=motion_kernels.state_count(model)) * 10.0
    there, back = np.empty(len(x)), np.empty(len(x))
    motion_kernels.propagate(model, dt, x, there)
    motion_kernels.propagate(model, -dt, there, back)
    assert np.allclose(back, x, rtol=1e-9, atol=1e-7)


@given(models, st.floats(-3.0, 3.0), seeds, poses, st.sets(st.integers(0, 3)))
def test_covariances_stay_covariances(
    model: int, dt: float, seed: int, attitude: FloatArray, missing: set[int]
) -> None:
    """Prediction adds, measurement takes away, and the result is symmetric and not negative."""
    rng = np.random.default_rng(seed)
    n = motion_kernels.state_count(model)
    x = rng.normal(size=n) * 30.0 + 50.0
    if model == motion_kernels.TURNING:
        x[4:] = rng.normal(size=5) * 0.2
    a = rng.normal(size=(n, n))
    p = (a @ a.T / n + 0.05 * np.eye(n)) * (0.01 if model == motion_kernels.TURNING else 1.0)
    sensor, sensor_velocity = np.zeros(3), np.zeros(3)
    motion_kernels.predict(model, dt, np.full(3, 0.1), x, p, np.zeros((9, 9)), np.zeros((9, 9)))
    assert np.array_equal(p, p.T)
    assert np.linalg.eigvalsh(p)[0] > 0.0
    seen, plot = np.empty(3), np.empty(4)
    radar_kernels.to_sensor(sensor, attitude, x, seen)
    assume(math.hypot(seen[0], seen[1]) > 20.0)
    radar_kernels.to_plot(seen, plot)
    variance = np.array([0.4, 0.02, 0.02, 0.5]) ** 2
    h = np.zeros((4, n))
    jacobian, gradient, rate, moving = np.empty((3, 3)), np.empty(6), np.empty(9), np.zeros((9, 9))
    motion_kernels.kinematics(model, x, rate, moving)
    radar_kernels.plot_jacobian(seen, attitude, jacobian)
    radar_kernels.range_rate_gradient(sensor, sensor_velocity, rate[:6], gradient)
    h[:3] = jacobian @ moving[:3, :n]
    h[3] = gradient @ moving[:6, :n]
    plot[3] = radar_kernels.range_rate(sensor, sensor_velocity, rate[:6])
    plot += rng.normal(size=4) * np.sqrt(variance)
    innovation = plot - [*plot[:3], 0.0]
    innovation[list(missing)] = math.nan
    before, xe, pe = p.copy(), x.copy(), p.copy()
    nis, _ = update_kernels.update(n, 4, xe, pe, h, innovation, variance, np.zeros((2, n)))
    assert nis >= 0.0
    assert np.array_equal(pe, pe.T)
    assert np.linalg.eigvalsh(pe)[0] > 0.0
    assert np.linalg.eigvalsh(before - pe)[0] > -1e-9 * np.linalg.norm(before)
    plot[list(missing)] = math.nan
    rows = unscented_kernels.POINT_ROWS
    points, plots, work = np.zeros((rows, 9)), np.zeros((rows, 4)), np.zeros((unscented_kernels.WORK_ROWS, 9))
    scaling = np.array([1.0, 0.0, 1.0])  # all weights positive
    nis, _ = unscented_kernels.unscented_update(
        model, scaling, x, p, sensor, sensor_velocity, attitude, plot, variance, points, plots, work
    )
    assert nis >= 0.0
    assert np.array_equal(p, p.T)
    assert np.linalg.eigvalsh(p)[0] > -1e-9 * np.linalg.norm(before)
    assert np.linalg.eigvalsh(before - p)[0] > -1e-9 * np.linalg.norm(before)
