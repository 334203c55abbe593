"""Naive twins of the kernels that take in ADS-B reports: the biases are states, and all is done with full matrices."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def consider(
    x: FloatArray, p: FloatArray, c: FloatArray, h: FloatArray, g: FloatArray, bias: FloatArray, z: float, r: float
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return state, covariance, covariance with the biases and log-likelihood after a scalar measurement.

    The Kalman filter of states and biases with the biases' gain struck out, in Joseph's form, which holds for any gain.
    """
    n = len(x)
    whole = np.block([[p, c], [c.T, np.diag(bias)]])
    row = np.concatenate([h, g])
    s = float(row @ whole @ row + r)
    gain = whole @ row / s
    gain[n:] = 0.0
    keep = np.eye(n + len(bias)) - np.outer(gain, row)
    after = keep @ whole @ keep.T + r * np.outer(gain, gain)
    error = z - float(h @ x)
    return x + gain[:n] * error, after[:n, :n], after[:n, n:], -0.5 * (error**2 / s + float(np.log(s)))


def report(x: FloatArray, age: float, bias: FloatArray) -> FloatArray:
    """Return what a report tells, `age` before the state's time by the sender's clock, less the latency's error."""
    a = age + bias[3]
    place = x[:3] - a * x[3:6] + 0.5 * a * a * x[6:9] + bias[:3]
    return np.concatenate([place, x[3:6] - a * x[6:9]])


def report_slopes(x: FloatArray, age: float, step: float = 1e-4) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives (6, 9) and (6, 4) of a report to states and biases, by central differences."""
    h, g, zero = np.zeros((6, 9)), np.zeros((6, 4)), np.zeros(4)
    for a in range(9):
        d = step * np.eye(9)[a]
        h[:, a] = (report(x + d, age, zero) - report(x - d, age, zero)) / (2 * step)
    for b in range(4):
        d = step * np.eye(4)[b]
        g[:, b] = (report(x, age, d) - report(x, age, -d)) / (2 * step)
    return h, g


def innovation_square(
    x: FloatArray,
    p: FloatArray,
    c: FloatArray,
    bias: FloatArray,
    elements: list[int],
    age: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
) -> float:
    """Return the normalised distance squared of some elements of a report from one state (9)."""
    h, g = report_slopes(x, age)
    rows = np.hstack([h, g])[elements]
    whole = np.block([[p, c], [c.T, np.diag(bias)]])
    noise = [r[k] + (time_sigma * x[3 + k]) ** 2 * (k < 3) for k in elements]
    e = z[elements] - h[elements] @ x
    return float(e @ np.linalg.solve(rows @ whole @ rows.T + np.diag(noise), e))


def first_track(
    z: FloatArray, variance: FloatArray, velocity_variance: FloatArray, latency: float, bias: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return state (6), covariance and covariance with the biases of a track begun from one report, to first order.

    With the errors of the report (6) and the biases (4): position = told - bias + latency velocity.
    """
    x = np.concatenate([z[:3] + latency * z[3:6], z[3:6]])
    slopes = np.zeros((6, 10))
    slopes[:3, :3], slopes[:3, 3:6], slopes[3:, 3:6] = np.eye(3), latency * np.eye(3), np.eye(3)
    slopes[:3, 6:9], slopes[:3, 9] = -np.eye(3), z[3:6]
    errors = np.diag(np.concatenate([variance[:3], velocity_variance, bias]))
    whole = slopes @ errors @ slopes.T
    return x, whole, (slopes @ errors)[:, 6:]


def identity(scores: list[tuple[float, float]], gate: float, lead: float, waited: bool) -> int | None:
    """Return which of several tracks (distance squared, score) an aircraft is; None: none yet."""
    fitting = sorted((score, k) for k, (square, score) in enumerate(scores) if square <= gate)
    if not fitting:
        return None
    alone = len(fitting) == 1 or fitting[1][0] - fitting[0][0] >= lead
    return fitting[0][1] if alone or waited else None


def constant_offset(
    z: FloatArray, predicted: FloatArray, white: FloatArray, start: float, drift: float
) -> tuple[float, float, list[float]]:
    """Return mean and variance of a slowly drifting offset of measurements from predictions, and each one's chi-square.

    By the joint normal distribution of all measurements instead of a filter.
    """
    n = len(z)
    index = np.arange(n)
    walk = start + drift * np.minimum(index[:, None], index[None])
    squares = []
    for k in range(n):
        before = slice(0, k)
        s = walk[before, before] + np.diag(white[before])
        gain = np.linalg.solve(s, walk[before, k]) if k else np.zeros(0)
        mean = float(gain @ (z - predicted)[before])
        variance = float(walk[k, k] - gain @ walk[before, k] + white[k])
        squares.append(float((z[k] - predicted[k] - mean) ** 2 / variance))
    s = walk + np.diag(white)
    gain = np.linalg.solve(s, walk[:, -1])
    return float(gain @ (z - predicted)), float(walk[-1, -1] - gain @ walk[:, -1]), squares
