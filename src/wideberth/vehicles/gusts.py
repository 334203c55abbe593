"""Dryden gusts: the table of turbulence, and a source of them along a flight."""

from collections.abc import Mapping

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import gust_kernels as gk

# L_u, L_v, L_w (m), sigma_u, sigma_v, sigma_w (m/s): Beard and McLain, table 4.1.
TURBULENCE: Mapping[str, tuple[float, ...]] = {
    "none": (200.0, 200.0, 50.0, 0.0, 0.0, 0.0),
    "low_light": (200.0, 200.0, 50.0, 1.06, 1.06, 0.7),
    "low_moderate": (200.0, 200.0, 50.0, 2.12, 2.12, 1.4),
    "medium_light": (533.0, 533.0, 533.0, 1.5, 1.5, 1.5),
    "medium_moderate": (533.0, 533.0, 533.0, 3.0, 3.0, 3.0),
}


class DrydenGusts:
    """Gusts along a flight.

    Parameters
    ----------
    turbulence : str
        A key of `TURBULENCE`.
    seed : int

    Attributes
    ----------
    parameters : ndarray, shape (6,)
    state : ndarray, shape (5,)
        Of the filters; starts at rest.
    """

    def __init__(self, turbulence: str, seed: int) -> None:
        if turbulence not in TURBULENCE:
            raise ValueError(f"there is no turbulence '{turbulence}' (known: {', '.join(TURBULENCE)})")
        self.parameters = np.array(TURBULENCE[turbulence])
        self.state = np.zeros(gk.N_FILTER)
        self._calm = turbulence == "none"
        self._random = np.random.default_rng([seed, 0x6D])

    def normals(self, n: int) -> FloatArray:
        """Return the random numbers of `n` steps, shape (n, 5); (0, 5) where the air is calm."""
        return np.empty((0, 5)) if self._calm else self._random.standard_normal((n, 5))
