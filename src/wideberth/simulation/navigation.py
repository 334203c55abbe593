"""What the ownship's own navigation says of it in the simulated world: errors, a jump, and telemetry that stops."""

import dataclasses
import math

import numpy as np

from wideberth.simulation.config import NavigationConfig
from wideberth.types import Ownship

_ON_TIME = 1e-6
"""A step this little before the time of a fault, s, belongs to it: times are sums of tenths."""


class SimulatedNavigation:
    """Errors on the ownship's own position and velocity.

    Each axis has its own error, a Gauss-Markov process of first order: e' = a e + sigma sqrt(1 - a^2) w with
    a = exp(-dt / time constant) and w normal; white with a time constant of 0.

    Parameters
    ----------
    config : NavigationConfig
    seed : int
    """

    def __init__(self, config: NavigationConfig, seed: int) -> None:
        self._config = config
        self._sigma = np.repeat([config.position_sigma_m, config.velocity_sigma_mps], 3)
        self._jump = np.array([config.jump_north_m, config.jump_east_m, -config.jump_up_m])
        self._random = np.random.default_rng([seed, 0x0E])
        self._error = np.zeros(6)
        self._start = self._t = math.nan
        self._last: Ownship | None = None

    def sense(self, ownship: Ownship) -> Ownship:
        """Return the latest telemetry of an ownship that truly is `ownship`; while it is lost, what was last received.

        The jump is not in the covariance: navigation does not know of it. Times must rise; the first is the start.
        """
        noise = self._random.standard_normal(6)
        if self._last is None:
            self._start = ownship.t
            self._error = self._sigma * noise
        else:
            kept = self._kept(ownship.t - self._t)
            self._error = kept * self._error + self._sigma * math.sqrt(1.0 - kept**2) * noise
        self._t = ownship.t
        age = ownship.t - self._start + _ON_TIME
        c = self._config
        if self._last is None or not _within(age, c.lost_from_s, c.lost_until_s):
            jump = self._jump if _within(age, c.jump_at_s, c.jump_until_s) else 0.0
            self._last = dataclasses.replace(
                ownship,
                position=ownship.position + self._error[:3] + jump,
                velocity=ownship.velocity + self._error[3:],
                covariance=np.diag(self._sigma**2),
            )
        return self._last

    def _kept(self, dt: float) -> float:
        tau = self._config.time_constant_s
        return math.exp(-dt / tau) if tau > 0.0 else 0.0


def _within(age: float, start: float | None, end: float | None) -> bool:
    return start is not None and start <= age < (math.inf if end is None else end)
