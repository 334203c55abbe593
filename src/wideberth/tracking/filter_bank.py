"""Storage of many ADS-B filters side by side, and the models they share."""

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.kernels import filter_reports, predicted_distance
from wideberth.tracking.motion import axis_model, model_tables
from wideberth.tracking.output_kernels import output_tracks
from wideberth.types import FloatArray

_TABLE_SECONDS = 4.0
"""Length of the transition tables: longer transitions are walked in pieces."""


def spectral_density(
    acceleration_sigma: float,
    acceleration_time_constant: float | None,
    jerk_time_constant: float | None,
    jerk_noise: float,
) -> float:
    """Return the density of the noise on the jerk's rate (m2/s7) that gives a stationary acceleration spread.

    Parameters
    ----------
    acceleration_sigma : float
        m/s2.
    acceleration_time_constant, jerk_time_constant : float or None
        s; with one missing nothing is stationary, and `jerk_noise` is returned.
    jerk_noise : float
        m2/s7.
    """
    if acceleration_time_constant is None or jerk_time_constant is None:
        return jerk_noise
    product = acceleration_time_constant * jerk_time_constant
    return 2.0 * acceleration_sigma**2 * (acceleration_time_constant + jerk_time_constant) / product**2


@functools.lru_cache(maxsize=64)
def transition_tables(config: AdsbKalmanConfig) -> tuple[FloatArray, FloatArray]:
    """Return transitions and process noises over 1 to m steps, of the horizontal axes and of the vertical one.

    They are kept, since a Monte Carlo asks for the same ones with each block of encounters: not to be written to.

    Parameters
    ----------
    config : AdsbKalmanConfig

    Returns
    -------
    phi, q : ndarray, shape (2, m, 4, 4)
    """
    times = (config.acceleration_time_constant_s, config.jerk_time_constant_s)
    taus = tuple(math.inf if tau is None else tau for tau in times)
    count = max(1, round(_TABLE_SECONDS / config.step_s))
    tables = []
    for sigma in (config.acceleration_sigma_mps2, config.vertical_acceleration_sigma_mps2):
        density = spectral_density(sigma, *times, config.jerk_noise_m2_per_s7)
        tables.append(model_tables(*axis_model(config.step_s, density, *taus), count))
    return np.stack([table[0] for table in tables]), np.stack([table[1] for table in tables])


class FilterBank:
    """States and covariances of all filters, by slot.

    Parameters
    ----------
    config : AdsbKalmanConfig

    Attributes
    ----------
    x, p : ndarray, shape (n, 3, 4) and (n, 3, 4, 4)
    last : ndarray of int, shape (n,)
        Internal step of each filter's state.
    bias : ndarray, shape (n, 2)
        Variance of the slowly varying horizontal (each axis) and altitude error, m2.
    phi, q : ndarray, shape (2, m, 4, 4)
        Transition tables of the horizontal axes and of the vertical one.
    """

    def __init__(self, config: AdsbKalmanConfig) -> None:
        self.dt = config.step_s
        self._latency = config.latency_sigma_s
        self._gate = config.gate_mahalanobis
        self.phi, self.q = transition_tables(config)
        self.x = np.zeros((0, 3, 4))
        self.p = np.zeros((0, 3, 4, 4))
        self.last = np.zeros(0, np.int64)
        self.bias = np.zeros((0, 2))
        self._free: list[int] = []

    def allocate(self) -> int:
        """Return the number of a slot that is free from now on used."""
        if not self._free:
            n = len(self.last)
            more = max(16, n)
            self.x = np.concatenate([self.x, np.zeros((more, 3, 4))])
            self.p = np.concatenate([self.p, np.zeros((more, 3, 4, 4))])
            self.last = np.concatenate([self.last, np.zeros(more, np.int64)])
            self.bias = np.concatenate([self.bias, np.zeros((more, 2))])
            self._free = list(range(n + more - 1, n - 1, -1))
        return self._free.pop()

    def release(self, slot: int) -> None:
        """Give a slot back."""
        self._free.append(slot)

    def update(
        self,
        slots: Sequence[int],
        steps: Sequence[int],
        z: Sequence[Sequence[float]],
        r: Sequence[Sequence[float]],
        use: Sequence[tuple[bool, bool, bool, bool]],
        time_sigma: Sequence[float],
    ) -> tuple[NDArray[np.int64], FloatArray]:
        """Take filters to the time of one report each and update them.

        Parameters
        ----------
        slots, steps : sequence of int
            The filter of each of the k reports, and its internal step.
        z, r : sequence of sequence of float
            North, east, down, velocity north, east, down (SI), and the variances.
        use : sequence of tuple of bool
            Whether to use horizontal position, altitude, climb rate, horizontal velocity.
        time_sigma : sequence of float
            Uncertainty of the time of validity, s.

        Returns
        -------
        outcome, nis : ndarray, shape (k, 4)
            What became of each element, and its normalised innovation squared.
        """
        k = len(slots)
        outcome, nis = np.empty((k, 4), np.int64), np.empty((k, 4))
        filter_reports(
            self.x,
            self.p,
            self.last,
            np.array(slots, np.int64),
            np.array(steps, np.int64),
            self.phi,
            self.q,
            np.array(z, np.float64),
            np.array(r, np.float64),
            np.array(use, np.bool_),
            self._gate,
            np.array(time_sigma, np.float64),
            outcome,
            nis,
        )
        return outcome, nis

    def distance(self, slot: int, step: int, north: float, east: float, variance: float, time_sigma: float) -> float:
        """Return the squared Mahalanobis distance of a horizontal position from a filter's prediction at a step."""
        ahead = step - int(self.last[slot])
        return predicted_distance(
            self.x[slot], self.p[slot], ahead, self.phi, self.q, north, east, variance, time_sigma
        )

    def output(self, slots: list[int], t: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return position, velocity, acceleration (k, 3), covariance (k, 9, 9) and horizontal spread (k,) at `t`."""
        k = len(slots)
        position, velocity, acceleration = np.empty((k, 3)), np.empty((k, 3)), np.empty((k, 3))
        covariance, spread = np.zeros((k, 9, 9)), np.empty(k)
        now = round(t / self.dt)
        output_tracks(
            self.x,
            self.p,
            self.last,
            np.array(slots, np.int64),
            now,
            t - now * self.dt,
            self.dt,
            self.phi,
            self.q,
            self.bias,
            self._latency,
            position,
            velocity,
            acceleration,
            covariance,
            spread,
        )
        return position, velocity, acceleration, covariance, spread
