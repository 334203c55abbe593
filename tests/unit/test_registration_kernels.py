"""The kernels of registration against their naive twins."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.naive import registration as naive
from wideberth.tracking import registration_kernels as kernels
from wideberth.types import FloatArray

SIGMA = np.array([20.0, 0.01, 0.05, 0.03, 0.04, 0.04, 15.0, 15.0, 10.0, 0.2])


def made(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Biases, told pose, and an aircraft, not near the axis of the azimuth."""
    rng = np.random.default_rng(seed)
    attitude = Rotation.from_euler("ZYX", rng.uniform([-3, -0.3, -0.3], [3, 0.3, 0.3])).as_matrix()
    ground, angle = rng.uniform(300.0, 2000.0), rng.uniform(-np.pi, np.pi)
    sensor = rng.uniform(-500.0, 500.0, 3) * [1.0, 1.0, 0.02]
    position = sensor + np.array([ground * np.cos(angle), ground * np.sin(angle), -rng.uniform(20.0, 300.0)])
    return rng.normal(0.0, SIGMA), sensor, attitude, np.concatenate([position, rng.normal(0.0, 20.0, 3)])


def plot_of(b: FloatArray, sensor: FloatArray, attitude: FloatArray, x: FloatArray, dt: float):
    plot, to_bias, to_state = np.zeros(3), np.zeros((3, 10)), np.zeros((3, 6))
    kernels.biased_plot(b, sensor, attitude, x, dt, plot, to_bias, to_state, np.zeros((12, 3)))
    return plot, to_bias, to_state


@pytest.mark.parametrize("seed", range(8))
def test_biased_plot_and_its_derivatives(seed: int) -> None:
    b, sensor, attitude, x = made(seed)
    plot, to_bias, to_state = plot_of(b, sensor, attitude, x, 0.7)
    assert naive.difference(plot, naive.biased_plot(b, sensor, attitude, x, 0.7)) == pytest.approx(0.0, abs=1e-9)
    twin = naive.slopes(lambda v: naive.biased_plot(v, sensor, attitude, x, 0.7), b, naive.BIAS_STEPS)
    assert to_bias == pytest.approx(twin, rel=1e-4, abs=1e-5)
    twin = naive.slopes(lambda v: naive.biased_plot(b, sensor, attitude, v, 0.7), x, naive.STATE_STEPS)
    assert to_state == pytest.approx(twin, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("seed", range(8))
def test_place_is_the_inverse(seed: int) -> None:
    b, sensor, attitude, x = made(seed)
    plot, _, _ = plot_of(b, sensor, attitude, x, 0.0)
    variance = np.array([9.0, 1e-4, 4e-4])
    position, to_bias, noise = np.zeros(3), np.zeros((3, 10)), np.zeros((3, 3))
    kernels.place(b, sensor, attitude, plot, variance, x[3:], position, to_bias, noise, np.zeros((28, 10)))
    assert position == pytest.approx(x[:3], abs=1e-6)
    steps = naive.BIAS_STEPS
    for k in range(10):
        move = np.zeros(10)
        move[k] = steps[k]
        high, low = (naive.place(b + s * move, sensor, attitude, plot, x[3:], x[:3]) for s in (1, -1))
        assert to_bias[:, k] == pytest.approx((high - low) / (2 * steps[k]), rel=1e-3, abs=1e-3)
    slopes = naive.slopes(lambda v: naive.biased_plot(b, sensor, attitude, v, 0.0), x, naive.STATE_STEPS)[:, :3]
    inverse = np.linalg.inv(slopes)
    assert noise == pytest.approx(inverse @ np.diag(variance) @ inverse.T, rel=1e-5, abs=1e-4)


def covariance(seed: int, n: int) -> FloatArray:
    mixed = np.random.default_rng(seed).normal(0.0, 1.0, (n, n)) / np.sqrt(n)
    scale = np.tile(SIGMA, n // 10)
    out: FloatArray = (np.eye(n) + mixed @ mixed.T) * np.outer(scale, scale) * 0.25
    return out


def test_pair_distances() -> None:
    rng = np.random.default_rng(3)
    p = covariance(3, 30)
    mine, theirs = rng.normal(0, 50, (3, 10)), rng.normal(0, 50, (4, 3, 10))
    position, positions = rng.normal(0, 100, 3), rng.normal(0, 100, (4, 3))
    noise, noises = 30.0 * np.eye(3), np.array([k * 20.0 * np.eye(3) for k in range(1, 5)])
    out = np.zeros(4)
    kernels.pair_distances(p, 2, position, mine, noise, 0, positions, theirs, noises, out)
    for k in range(4):
        twin = naive.distance(p, 2, 0, mine, theirs[k], position - positions[k], noise + noises[k])
        assert out[k] == pytest.approx(twin, rel=1e-9)
    kernels.pair_distances(p, 2, position, mine, noise, -1, positions, theirs, noises, out)
    twin = naive.distance(p, 2, 0, mine, np.zeros((3, 10)), position - positions[1], noise + noises[1])
    assert out[1] == pytest.approx(twin, rel=1e-9)


def test_pair_distance_of_a_covariance_that_is_none_is_infinite() -> None:
    out = np.zeros(1)
    nothing = np.zeros((1, 3, 10))
    bad = np.full((1, 3, 3), np.nan)
    kernels.pair_distances(
        np.zeros((10, 10)), 0, np.zeros(3), nothing[0], bad[0], -1, np.zeros((1, 3)), nothing, bad, out
    )
    assert out[0] == np.inf


@pytest.mark.parametrize("seeded", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_fuse(seed: int, seeded: bool) -> None:
    """Three radars, one twice with a far plot, one without elevation, with and without a known place."""
    rng = np.random.default_rng(seed)
    b, p = np.zeros(30), covariance(seed, 30)
    true = np.concatenate([made(seed)[0] * 0.5, made(seed + 10)[0] * 0.5, made(seed + 20)[0] * 0.5])
    x = made(seed)[3]
    plots = []
    for k, radar in enumerate((1, 0, 2, 0)):
        _, sensor, attitude, _ = made(seed + 30 + radar)
        variance = np.array([9.0, 1e-4, 2e-4])
        dt = float(rng.uniform(-0.5, 0.5)) if k else 0.0
        z = naive.biased_plot(true[10 * radar : 10 * radar + 10], sensor, attitude, x, dt)
        z = z + rng.normal(0.0, np.sqrt(variance))
        if radar == 2:
            z[2] = np.nan
        if k == 3:
            z[0] += 900.0
        plots.append((radar, sensor, attitude, z, variance, dt))
    guess = x + rng.normal(0.0, [5.0, 5.0, 5.0, 1.0, 1.0, 1.0])
    px = np.diag([1e5, 1e5, 1e5, 4.0, 4.0, 4.0]) if seeded else np.diag([25.0, 25.0, 25.0, 1.0, 1.0, 1.0])
    if seeded:
        guess[:3] = naive.place(b[:10], plots[0][1], plots[0][2], plots[0][3], x[3:], x[:3])
    b_twin, p_twin, nis_twin = naive.fuse(b, p, guess, px, seeded, plots, 16.0)
    nis = np.zeros(len(plots))
    rejected = kernels.fuse(
        b, p, guess, px, seeded,
        np.array([q[0] for q in plots]), np.array([q[1] for q in plots]), np.array([q[2] for q in plots]),
        np.array([q[3] for q in plots]), np.array([q[4] for q in plots]), np.array([q[5] for q in plots]), 16.0, nis,
    )  # fmt: skip
    scale = np.tile(SIGMA, 3)
    assert nis == pytest.approx(nis_twin, rel=1e-4, abs=1e-6)
    assert nis[3] > 16.0 and rejected == sum(v > 16.0 for v in nis_twin[seeded:])
    assert b / scale == pytest.approx(b_twin / scale, abs=1e-5)
    assert p / np.outer(scale, scale) == pytest.approx(p_twin / np.outer(scale, scale), abs=1e-5)
    assert np.array_equal(p, p.T)


def test_match_takes_the_nearest_track_and_its_height_where_a_plot_has_none() -> None:
    b, p = np.zeros(10), np.diag((0.1 * SIGMA) ** 2)
    sensor, eye = np.zeros(3), np.eye(3)
    x = np.array([[800.0, 100.0, -90.0, 10.0, 0.0, 0.0], [820.0, 300.0, -150.0, 0.0, 10.0, 0.0]])
    px = np.tile(np.diag([25.0, 25.0, 25.0, 1.0, 1.0, 1.0]), (2, 1, 1))
    times = np.array([10.0, 10.0])
    z = np.array([naive.biased_plot(b, sensor, eye, row, 0.5) for row in (x[1], x[0], x[1])])
    z[2, 2] = np.nan
    z = np.concatenate([z, [[2000.0, 0.0, 0.1]]])
    variance = np.tile([9.0, 1e-4, 4e-4], (4, 1))
    track, state, cov = np.full(4, -1), np.zeros((4, 6)), np.zeros((4, 6, 6))
    position, to_bias, noise = np.zeros((4, 3)), np.zeros((4, 3, 10)), np.zeros((4, 3, 3))
    wanted = np.ones(4, np.bool_)
    kernels.match_plots(
        b, p, 0, sensor, eye, z, variance, np.full(4, 10.5), wanted, times, x, px, 4.0, 100.0, 16.0,
        track, state, cov, position, to_bias, noise,
    )  # fmt: skip
    assert track.tolist() == [1, 0, 1, -1]
    assert state[0] == pytest.approx([820.0, 305.0, -150.0, 0.0, 10.0, 0.0])
    assert np.diag(cov[0]) == pytest.approx([26.25, 26.25, 26.25, 5.0, 5.0, 5.0])
    assert position[[0, 2]] == pytest.approx(state[[0, 2], :3], abs=1e-6)
    assert cov[2, 2, 2] == pytest.approx(126.25)
