"""The refinement of a path: its limits and buffers."""

import numpy as np

from wideberth.avoidance.keep_out.kernels import KeepOuts
from wideberth.avoidance.waypoint_paths import refinement_kernels as rk
from wideberth.avoidance.waypoint_paths.astar import Limits
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.avoidance.waypoint_paths.first_turn_kernels import PLACES
from wideberth.types import FloatArray

_FIRST, _LEAST = 0.5, 0.03  # steps of the search, in cells


class Refinement:
    """Refinements of one configuration.

    Parameters
    ----------
    config : AStarConfig
    keep_outs : KeepOuts
    """

    def __init__(self, config: AStarConfig, keep_outs: KeepOuts) -> None:
        self._config, self._keep_outs = config, keep_outs

    def refined(
        self, points: FloatArray, course: float, cell: float, limits: Limits, intruders: FloatArray, looks_max: int
    ) -> tuple[FloatArray, int]:
        """Return a path with fewer and better places, which is in cylinders no longer and is not longer where as free.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            Local NED, m; the first (the ownship) and the last are held. Kept as it is.
        course : float
            Of the ownship, rad; NaN where any will do.
        cell : float
            Of the grid, m: the search begins with steps of half of it.
        limits : Limits
        intruders : ndarray, shape (m, intruder_kernels.N_INTRUDER)
        looks_max : int
            Looks of a leg at an intruder; then the path is left as it is.

        Returns
        -------
        points : ndarray, shape (k, 3)
        looks : int
            How many were taken.
        """
        config, n, m = self._config, len(points), len(intruders)
        p = np.zeros(rk.N_REFINEMENT)
        p[rk.SPEED], p[rk.TURN_RADIUS] = limits.speed, limits.radius
        p[rk.CLIMB_MAX], p[rk.SINK_MAX] = limits.climb_max, limits.sink_max
        p[rk.FLOOR], p[rk.CEILING] = config.altitude_min_m, config.altitude_max_m
        p[rk.STEP], p[rk.STEP_LEAST], p[rk.LOOKS_MAX] = _FIRST * cell, _LEAST * cell, looks_max
        p[rk.INERTIA :] = limits.inertia
        p[rk.VERTICAL] = 0.0 if config.constant_altitude else config.cell_height_m / config.cell_m
        places = np.array(points, float)
        left, looks = rk.refine(
            places, n, course, intruders, m, self._keep_outs.volumes, self._keep_outs.vertices, p,
            np.empty((n, 3)), np.empty((n + PLACES, 3)), np.empty(n), np.empty(n + PLACES),
        )  # fmt: skip
        return places[:left].copy(), int(looks)
