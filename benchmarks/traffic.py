"""Made traffic for benchmarks: straight flights about an ownship that flies north, each reporting once a second."""

import numpy as np

from wideberth.simulation.truth import Truth
from wideberth.types import FloatArray, Scan, SourceInfo

SIGMA = np.array([20.0, 20.0, 10.0, 3.0, 3.0, 0.3])
INFO = SourceInfo(nic=8, nacp=9, nacv=2, sil=3, sda=2)


class MadeTraffic:
    """Aircraft within 15 km and 1000 m of the ownship's altitude; the first comes head on, so that all stages work.

    Parameters
    ----------
    count : int
    altitude : float
        Of the ownship, m.
    """

    def __init__(self, count: int, altitude: float) -> None:
        self._random = np.random.default_rng(count)
        angle, distance = self._random.uniform(0, 2 * np.pi, count), 15_000 * np.sqrt(self._random.uniform(0, 1, count))
        down = -altitude + self._random.uniform(-1000, 1000, count)
        course, speed = self._random.uniform(0, 2 * np.pi, count), self._random.uniform(40, 120, count)
        self._position = np.stack([distance * np.cos(angle), distance * np.sin(angle), down], axis=1)
        self._velocity = np.stack([speed * np.cos(course), speed * np.sin(course), np.zeros(count)], axis=1)
        self._position[0], self._velocity[0] = (9000.0, 0.0, -altitude), (-60.0, 0.0, 0.0)
        self._phase = self._random.uniform(0, 1, count)
        self._t = 0.0
        self._ids = tuple(f"{0x400000 + k:06x}" for k in range(count))

    def truth(self, t: float) -> Truth:
        """Return the true states at time `t`, s."""
        return Truth(t, self._ids, self._position + t * self._velocity, self._velocity)

    def sense(self, t: float, own_position: FloatArray) -> Scan:
        """Return the reports since the last call; the range does not depend on the ownship's position."""
        heard = np.flatnonzero(np.floor(t - self._phase) > np.floor(self._t - self._phase))
        self._t = t
        position = self._position[heard] + t * self._velocity[heard]
        z = np.hstack([position, self._velocity[heard]]) + SIGMA * self._random.standard_normal((len(heard), 6))
        return Scan(
            t=t,
            t_received=t,
            sensor="adsb",
            kind="adsb",
            z=z,
            R=np.tile(np.diag(SIGMA**2), (len(heard), 1, 1)),
            t_valid=np.full(len(heard), t),
            source_ids=tuple(self._ids[k] for k in heard),
            sources=(INFO,) * len(heard),
        )
