"""Flying a path of lines and arcs: which segment is flown now, and the command for it."""

from typing import Protocol

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import guidance_kernels as gk


class Flown(Protocol):
    """A vehicle as guidance sees it: the state (7,), parameters and wind of a point mass."""

    state: FloatArray
    params: FloatArray
    wind: FloatArray


class PathManager:
    """Guidance along a path.

    Parameters
    ----------
    segments : ndarray, shape (n, guidance_kernels.N_COLUMNS)
        From `path_segments`.

    Attributes
    ----------
    index : int
        Segment flown now.
    """

    def __init__(self, segments: FloatArray) -> None:
        if segments.ndim != 2 or segments.shape[1:] != (gk.N_COLUMNS,) or not len(segments):
            raise ValueError(f"segments must be (n, {gk.N_COLUMNS}) with n > 0, not {segments.shape}")
        self._segments = np.ascontiguousarray(segments, float)
        self._command = np.zeros(4)
        self.index = 0

    @property
    def done(self) -> bool:
        """Whether all segments are flown."""
        return self.index >= len(self._segments)

    def command(self, vehicle: Flown) -> FloatArray:
        """Return airspeed, course, climb rate and bank fed forward (4,) for a vehicle; m/s, rad, m/s, rad."""
        self.index = gk.follow_segments(
            vehicle.state, self._segments, self.index, vehicle.params, vehicle.wind, self._command
        )
        return self._command.copy()

    def cross_track(self, position: FloatArray) -> float:
        """Return how far (m) a position (3,) lies from the segment flown now: to its right, or outside its circle."""
        row = self._segments[min(self.index, len(self._segments) - 1)]
        dn, de = position[0] - row[gk.S_NORTH], position[1] - row[gk.S_EAST]
        if row[gk.S_TURN] == 0.0:
            return float(de * np.cos(row[gk.S_COURSE]) - dn * np.sin(row[gk.S_COURSE]))
        return float(np.hypot(dn, de) - row[gk.S_RADIUS])
