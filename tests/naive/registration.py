"""Naive twins of the registration of radars: rotations by scipy, derivatives by differences, full matrices."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]


def biased_plot(b: FloatArray, sensor: FloatArray, attitude: FloatArray, x: FloatArray, dt: float) -> FloatArray:
    """Return range, azimuth, elevation (3,) of an aircraft with state `x` (6,) measured at the told time `dt`."""
    turned = attitude @ Rotation.from_euler("YX", [b[5], b[4]]).as_matrix()
    aircraft = x[:3] + (dt - b[9]) * x[3:]
    forward, right, down = turned.T @ (aircraft - (sensor + b[6:9]))
    distance = np.sqrt(forward**2 + right**2 + down**2)
    azimuth = np.arctan2(right, forward) + b[2]
    plot = np.array([distance + b[1] * distance + b[0], azimuth, np.arcsin(-down / distance) + b[3]])
    plot[1] = np.angle(np.exp(1j * plot[1]))
    return plot


def difference(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the difference of two plots, its azimuth the short way round."""
    d: FloatArray = a - b
    d[1] = np.angle(np.exp(1j * d[1]))
    return d


def slopes(function: object, at: FloatArray, steps: FloatArray) -> FloatArray:
    """Return the derivatives (3, n) of a function with three values, by central differences."""
    columns = []
    for k, step in enumerate(steps):
        move = np.zeros(len(at))
        move[k] = step
        columns.append(difference(function(at + move), function(at - move)) / (2 * step))  # type: ignore[operator]
    return np.array(columns).T


BIAS_STEPS = np.array([1e-2, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-2, 1e-2, 1e-2, 1e-3])
STATE_STEPS = np.full(6, 1e-2)


def place(
    b: FloatArray, sensor: FloatArray, attitude: FloatArray, z: FloatArray, velocity: FloatArray, guess: FloatArray
) -> FloatArray:
    """Return where an aircraft must be (3,) to be measured at `z`: by solving the equations of `biased_plot`."""

    def miss(position: FloatArray) -> FloatArray:
        x = np.concatenate([position, velocity])
        error: FloatArray = difference(biased_plot(b, sensor, attitude, x, 0.0), z) * [1.0, z[0], z[0]]
        return error

    found: FloatArray = fsolve(miss, guess, xtol=1e-13)
    return found


def distance(
    p: FloatArray, a: int, b: int, ja: FloatArray, jb: FloatArray, difference: FloatArray, noise: FloatArray
) -> float:
    """Return the squared Mahalanobis distance of two places with biases of radars `a` and `b` in them."""
    h = np.zeros((3, len(p)))
    h[:, 10 * a : 10 * a + 10] += ja
    h[:, 10 * b : 10 * b + 10] -= jb
    return float(difference @ np.linalg.inv(h @ p @ h.T + noise) @ difference)


def fuse(
    b: FloatArray,
    p: FloatArray,
    x: FloatArray,
    px: FloatArray,
    seeded: bool,
    plots: list[tuple[int, FloatArray, FloatArray, FloatArray, FloatArray, float]],
    gate: float,
) -> tuple[FloatArray, FloatArray, list[float]]:
    """Return the biases, their covariance and the NIS of each plot (radar, sensor, attitude, z, variance, dt)."""
    n = len(b)
    state = np.concatenate([b, x])
    cov = np.zeros((n + 6, n + 6))
    cov[:n, :n], cov[n:, n:] = p, px
    found = []
    for number, (radar, sensor, attitude, z, variance, dt) in enumerate(plots):
        own = slice(10 * radar, 10 * radar + 10)
        now = state.copy()
        predicted = biased_plot(now[own], sensor, attitude, now[n:], dt)
        h = np.zeros((3, n + 6))
        h[:, own] = slopes(lambda v: biased_plot(v, sensor, attitude, now[n:], dt), now[own], BIAS_STEPS)  # noqa: B023
        h[:, n:] = slopes(lambda v: biased_plot(now[own], sensor, attitude, v, dt), now[n:], STATE_STEPS)  # noqa: B023
        second = sum(cov[own, own][k, k] for k in (2, 3, 4, 5))
        if number or not seeded:
            second += min(np.trace(cov[n : n + 3, n : n + 3]) / 2 / predicted[0] ** 2, 0.1)
        r = np.diag(variance + 0.75 * np.array([predicted[0] * second, second, second]) ** 2)
        measured = np.isfinite(z)
        h, r, y = h[measured], r[np.ix_(measured, measured)], difference(z, predicted)[measured]
        s = h @ cov @ h.T + r
        nis = float(y @ np.linalg.solve(s, y))
        found.append(nis)
        if nis > gate and (number or not seeded):
            continue
        k = np.linalg.solve(s, h @ cov).T
        state = state + k @ y
        i = np.eye(n + 6) - k @ h
        cov = i @ cov @ i.T + k @ r @ k.T
    return state[:n], cov[:n, :n], found
