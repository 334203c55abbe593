"""The true states of all traffic at one time; only a simulation or a recording knows them."""

from dataclasses import dataclass

import numpy as np

from wideberth.types import FloatArray


@dataclass(frozen=True, slots=True)
class Truth:
    """True states of the aircraft around, without the ownship.

    Attributes
    ----------
    t : float
        Time, s.
    ids : tuple of str
        Address of each aircraft.
    positions, velocities : ndarray, shape (k, 3)
        Local NED, m and m/s.
    """

    t: float
    ids: tuple[str, ...]
    positions: FloatArray
    velocities: FloatArray

    @staticmethod
    def empty(t: float) -> "Truth":
        """Return the truth of an empty sky."""
        return Truth(t, (), np.empty((0, 3)), np.empty((0, 3)))
