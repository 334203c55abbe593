"""Naive twins of the multi-target tracker's kernels: textbook formulas with full matrices, and plain enumeration."""

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def joint_association(plots: list[list[int]], ratio: list[list[float]], none: list[float]) -> list[list[float]]:
    """Return the marginal association probabilities by trying every combination of choices."""
    total = 0.0
    beta = [[0.0] * (len(p) + 1) for p in plots]
    for choice in itertools.product(*(range(len(p) + 1) for p in plots)):
        taken = [plots[i][c - 1] for i, c in enumerate(choice) if c > 0]
        if len(set(taken)) < len(taken):
            continue
        weight = 1.0
        for i, c in enumerate(choice):
            weight *= none[i] if c == 0 else ratio[i][c - 1]
        total += weight
        for i, c in enumerate(choice):
            beta[i][c] += weight
    return [[b / total for b in row] for row in beta]


def mixed(stay: FloatArray, mu: FloatArray, x: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return predicted probabilities, means and covariances of the interaction step; all states augmented alike."""
    n = len(mu)
    pi = np.where(np.eye(n, dtype=bool), stay[:, None], (1.0 - stay[:, None]) / (n - 1))
    c = mu @ pi
    weight = pi * mu[:, None] / c
    means = weight.T @ x
    covariances = np.array(
        [sum(weight[i, j] * (p[i] + np.outer(x[i] - means[j], x[i] - means[j])) for i in range(n)) for j in range(n)]
    )
    return c, means, covariances


def mixture(mu: FloatArray, x: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of a mixture of normal distributions."""
    mean = mu @ x
    return mean, np.einsum("i,iab->ab", mu, p) + np.einsum("i,ia,ib->ab", mu, x - mean, x - mean)


def turning_derivative(x: FloatArray) -> FloatArray:
    """Return the time derivative of position, velocity and acceleration of a turning aircraft."""
    v, a = x[3:6], x[6:9]
    speed = np.linalg.norm(v)
    w = np.cross(v, a) / speed**2
    along = (a @ v / speed) * v / speed
    return np.concatenate([v, a, np.cross(w, a + along)])


def fly(x: FloatArray, dt: float, steps: int = 200) -> FloatArray:
    """Return a turning state after `dt`, by Runge-Kutta in many small steps."""
    h = dt / steps
    for _ in range(steps):
        k1 = turning_derivative(x)
        k2 = turning_derivative(x + 0.5 * h * k1)
        k3 = turning_derivative(x + 0.5 * h * k2)
        k4 = turning_derivative(x + h * k3)
        x = x + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x


def straight_line_fit(
    t: FloatArray, place: FloatArray, covariance: FloatArray, speed_sigma: float
) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity at time 0, and their covariance, from places (n, 3) with covariances (n, 3, 3)."""
    information = np.diag([0.0] * 3 + [1.0 / speed_sigma**2] * 3)
    right = np.zeros(6)
    for tau, z, r in zip(t, place, covariance, strict=True):
        h = np.hstack([np.eye(3), tau * np.eye(3)])
        information += h.T @ np.linalg.solve(r, h)
        right += h.T @ np.linalg.solve(r, z)
    p = np.linalg.inv(information)
    return p @ right, p


def log_normal(e: FloatArray, s: FloatArray) -> float:
    """Return the log density of an innovation."""
    return float(multivariate_normal(np.zeros(len(e)), s).logpdf(e))


def merged_density(a: FloatArray, b: FloatArray, z: FloatArray, variance: FloatArray, sight: FloatArray) -> float:
    """Density of a plot that is two aircraft at once, in m of its elements; 0: it is not.

    `a` and `b` are direction (3), range, azimuth, elevation and the variances of range and across. The plot may lie on
    the straight line between two aircraft less than five range sigmas and forty angle sigmas apart, less three sigmas.
    """
    angle = np.sqrt(np.nanmax(variance[1:3]) if np.isfinite(z[2]) else variance[1])
    apart = np.arccos(np.clip(a[:3] @ b[:3], -1.0, 1.0))
    if abs(a[3] - b[3]) > 5.0 * np.sqrt(variance[0]) + 3.0 * np.sqrt(a[6] + b[6]) or apart > min(40.0 * angle, 0.5):
        return 0.0
    share = np.linspace(0.0, 1.0, 4001)[:, None]
    off = np.linalg.norm(sight - (1.0 - share) * a[:3] - share * b[:3], axis=1).min() * a[3]
    across = np.sqrt((a[3] * angle) ** 2 + max(a[7], b[7]))
    nearest, farthest = min(a[3], b[3]) * np.cos(0.5 * apart), max(a[3], b[3])
    along = np.sqrt(variance[0] + max(a[6], b[6]))
    beyond = abs(z[0] - np.clip(z[0], nearest, farthest))
    if beyond > 3.0 * along or off > 3.0 * across:
        return 0.0
    bell = np.exp(-0.5 * ((off / across) ** 2 + (beyond / along) ** 2))
    root = np.sqrt(2.0 * np.pi)
    density = bell / (root * along + farthest - nearest) / (root * across + a[3] * np.linalg.norm(a[:3] - b[:3]))
    return float(density / (root * across) if np.isfinite(z[2]) else density)


def shared_plots(density: FloatArray) -> dict[tuple[int, int], int]:
    """The plot that two tracks may share, for each pair that has exactly one: `density` is (tracks, tracks, plots)."""
    pairs = itertools.combinations(range(len(density)), 2)
    return {(i, j): int(density[i, j].argmax()) for i, j in pairs if np.count_nonzero(density[i, j]) == 1}
