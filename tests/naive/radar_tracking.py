"""Naive twins of the kernels that the radar trackers share: full matrices, small steps, finite differences."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

FloatArray = NDArray[np.float64]


def differences(function: Callable[[FloatArray], FloatArray], x: FloatArray, steps: FloatArray) -> FloatArray:
    """Return the Jacobian by central differences of fourth order."""
    columns = []
    for i, step in enumerate(steps):
        e = np.zeros(len(x))
        e[i] = step
        near = function(x + e) - function(x - e)
        far = function(x + 2 * e) - function(x - 2 * e)
        columns.append((8 * near - far) / (12 * step))
    return np.array(columns).T


def turning_rate(x: FloatArray) -> FloatArray:
    """Return the time derivative of the turning model (3.48), NED."""
    speed, course, gamma = x[3:6]
    velocity = speed * np.array([np.cos(course) * np.cos(gamma), np.sin(course) * np.cos(gamma), -np.sin(gamma)])
    return np.concatenate([velocity, x[6:9], np.zeros(3)])


def turning_after(x: FloatArray, dt: float) -> FloatArray:
    """Return the turning model's state after `dt`, by an adaptive integrator."""
    done = solve_ivp(lambda _, y: turning_rate(y), (0.0, dt), x, rtol=1e-12, atol=1e-12, method="DOP853")
    return np.array(done.y[:, -1])


def chain(order: int, dt: float, density: float) -> tuple[FloatArray, FloatArray]:
    """Return transition and noise of one axis of `order` integrators behind white noise, also backwards in time."""
    f = np.diag(np.ones(order - 1), 1)
    g = np.zeros((order, order))
    g[-1, -1] = density
    nodes, weights = np.polynomial.legendre.leggauss(12)
    values = [expm(f * s) @ g @ expm(f * s).T for s in 0.5 * dt * (nodes + 1)]
    return expm(f * dt), 0.5 * abs(dt) * np.einsum("i,ijk->jk", weights, np.array(values))


def plot_of(sensor: FloatArray, attitude: FloatArray, position: FloatArray) -> FloatArray:
    """Return range, azimuth and elevation of a NED position."""
    x, y, z = attitude.T @ (position - sensor)
    return np.array([np.sqrt(x * x + y * y + z * z), np.arctan2(y, x), np.arctan2(-z, np.sqrt(x * x + y * y))])


def matrix_update(
    x: FloatArray, p: FloatArray, h: FloatArray, innovation: FloatArray, r: FloatArray
) -> tuple[FloatArray, FloatArray, float, float]:
    """Return state, covariance, NIS and log-likelihood of the update (3.7)-(3.9), all elements at once."""
    s = h @ p @ h.T + r
    k = p @ h.T @ np.linalg.inv(s)
    nis = float(innovation @ np.linalg.solve(s, innovation))
    log_likelihood = -0.5 * (nis + np.linalg.slogdet(2 * np.pi * s)[1])
    i = np.eye(len(x)) - k @ h
    return x + k @ innovation, i @ p @ i.T + k @ r @ k.T, nis, float(log_likelihood)
