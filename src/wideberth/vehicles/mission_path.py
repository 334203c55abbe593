"""A mission flown along lines and arcs: its segments, and which waypoint is flown to meanwhile."""

import math

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import guidance_kernels as gk
from wideberth.vehicles.config import FixedWingConfig
from wideberth.vehicles.kernels import turn_radius
from wideberth.vehicles.path_manager import Flown, PathManager
from wideberth.vehicles.path_segments import dubins_segments, fillet_segments


class MissionPath:
    """A mission along fillets or Dubins paths (Beard and McLain, chapter 11).

    Parameters
    ----------
    config : FixedWingConfig
        With arcs.
    waypoints : ndarray, shape (n, 3)
        NED, m; none twice in a row.
    speeds : ndarray, shape (n,)
        Ground speed on the leg that ends at each, m/s.

    Raises
    ------
    ValueError
        Where the arcs cannot be flown at the bank limit, or do not fit: see `path_segments`.
    """

    def __init__(self, config: FixedWingConfig, waypoints: FloatArray, speeds: FloatArray) -> None:
        if config.turn_radius_m is None:
            raise ValueError("a path of arcs needs turn_radius_m")
        fastest = min(float(np.max(speeds[1:])), config.speed_max_mps)
        least = turn_radius(fastest, math.radians(config.bank_max_deg))
        if config.turn_radius_m < least:
            raise ValueError(
                f"turn_radius_m {config.turn_radius_m:g} is too small: at {fastest:g} m/s a bank of"
                f" {config.bank_max_deg:g} deg turns at {least:.0f} m"
            )
        make = fillet_segments if config.path_manager == "fillet" else dubins_segments
        self._rounds = config.path_manager == "fillet"
        self._segments = make(waypoints, speeds, config.turn_radius_m)
        self._manager = PathManager(self._segments)
        self._n = len(waypoints)

    def join(self, index: int) -> None:
        """Go on with the segments that lead to waypoint `index`."""
        self._manager.index = int((self._segments[:, gk.S_WAYPOINT] < index).sum())

    def command(self, vehicle: Flown) -> tuple[FloatArray, int]:
        """Return the command (4,) for a vehicle, as `PathManager.command`, and the waypoint that is flown to.

        A waypoint that an arc rounds is passed in the middle of the arc. The number of waypoints: all are passed.
        """
        command = self._manager.command(vehicle)
        if self._manager.done:
            return command, self._n
        row = self._segments[self._manager.index]
        waypoint = int(row[gk.S_WAYPOINT])
        rounded = self._rounds and row[gk.S_TURN] != 0.0
        passed = rounded and gk.segment_left(vehicle.state, row) < 0.5 * row[gk.S_LENGTH]
        return command, waypoint + int(passed)
