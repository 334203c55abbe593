"""Naive twin of the ADS-B filter: one 12-state Kalman filter with full matrices, walked step by step."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

FloatArray = NDArray[np.float64]


def discrete(dt: float, density: float, tau_a: float, tau_j: float) -> tuple[FloatArray, FloatArray]:
    """Return transition and process noise of one axis: the matrix exponential, and its integral by Gauss's rule."""
    f = np.diag([1.0, 1.0, 1.0], 1)
    f[2, 2], f[3, 3] = -1 / tau_a, -1 / tau_j
    g = np.zeros((4, 4))
    g[3, 3] = density
    nodes, weights = np.polynomial.legendre.leggauss(20)
    values = [expm(f * s) @ g @ expm(f * s).T for s in 0.5 * dt * (nodes + 1)]
    return expm(f * dt), 0.5 * dt * np.einsum("i,ijk->jk", weights, np.array(values))


class TwelveStates:
    """States in the order position, velocity, acceleration, jerk, each north, east, down."""

    def __init__(
        self, phi: tuple[FloatArray, FloatArray], q: tuple[FloatArray, FloatArray], x: FloatArray, p: FloatArray
    ) -> None:
        order = [axis * 4 + state for state in range(4) for axis in range(3)]
        pick = np.ix_(order, order)
        self.f = block_diag(phi[0], phi[0], phi[1])[pick]
        self.q = block_diag(q[0], q[0], q[1])[pick]
        self.x = x.reshape(12)[order]
        self.p = block_diag(*p)[pick]

    def predict(self) -> None:
        self.x = self.f @ self.x
        self.p = self.f @ self.p @ self.f.T + self.q

    def update(self, states: list[int], z: FloatArray, r: FloatArray, gate: float) -> tuple[bool, float]:
        """Update with measurements of some states at once, if they pass the gate; return that and the NIS."""
        h = np.eye(12)[states]
        s = h @ self.p @ h.T + np.diag(r)
        y = z - h @ self.x
        nis = float(y @ np.linalg.solve(s, y))
        if nis > gate**2:
            return False, nis
        k = self.p @ h.T @ np.linalg.inv(s)
        self.x = self.x + k @ y
        i = np.eye(12) - k @ h
        self.p = i @ self.p @ i.T + k @ np.diag(r) @ k.T  # Joseph's form
        return True, nis

    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Return states (3, 4) and covariances (3, 4, 4) by axis."""
        x = self.x.reshape(4, 3).T
        p = np.array([self.p[np.ix_(range(a, 12, 3), range(a, 12, 3))] for a in range(3)])
        return x, p


def output(
    x: FloatArray,
    p: FloatArray,
    phi: tuple[FloatArray, FloatArray],
    q: tuple[FloatArray, FloatArray],
    steps: int,
    residual: float,
    bias: FloatArray,
    latency: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return position, velocity, acceleration, covariance (9, 9) and own spread of a track some steps after its update.

    Parameters
    ----------
    x, p : ndarray, shape (3, 4), (3, 4, 4)
    phi, q : tuple of ndarray
        Transition and noise of one step, horizontally and vertically.
    steps, residual : int, float
        Steps to walk, and what is left of the time, s, over which only the mean is moved.
    bias : ndarray, shape (2,)
    latency : float
    """
    twin = TwelveStates(phi, q, x, p)
    for _ in range(steps):
        twin.predict()
    position, velocity, acceleration = twin.x[:3], twin.x[3:6], twin.x[6:9]
    position = position + residual * velocity + 0.5 * residual**2 * acceleration
    velocity = velocity + residual * acceleration
    covariance = twin.p[:9, :9].copy()
    spread = float(np.sqrt(np.diag(covariance)[:2].max()))
    covariance[range(3), range(3)] += bias[[0, 0, 1]]
    covariance[:2, :2] += latency**2 * np.outer(velocity[:2], velocity[:2])
    return position, velocity, acceleration, covariance, spread


def delay_on_path(
    offset: FloatArray, velocity: FloatArray, track: FloatArray, margin: float, latest: float, turn_rate: float
) -> float | None:
    """Return the delay at which the aircraft was nearest to an offset behind it; None where it was elsewhere."""
    speed = float(np.linalg.norm(velocity))
    if speed < 1.0 or velocity @ track < 0.5 * speed * np.linalg.norm(track):
        return None
    delays = np.linspace(-1.1 * latest, 1.1 * latest, 20_001)
    away = np.linalg.norm(offset + delays[:, None] * velocity, axis=1)
    delay, across = float(delays[away.argmin()]), float(away.min())
    fits = abs(delay) <= latest and across <= margin + 0.5 * turn_rate * speed * delay**2
    return delay if fits else None
