"""The chain over a path: its parameters, buffers, and how long it may settle."""

import math

import numpy as np

from wideberth.avoidance.keep_out.kernels import KeepOuts
from wideberth.avoidance.waypoint_paths import chain_kernels as ck
from wideberth.avoidance.waypoint_paths.astar import Limits
from wideberth.avoidance.waypoint_paths.config import AStarConfig
from wideberth.types import FloatArray


class Chain:
    """Chains of one configuration.

    Parameters
    ----------
    config : AStarConfig
    keep_outs : KeepOuts
    """

    def __init__(self, config: AStarConfig, keep_outs: KeepOuts) -> None:
        self._config, self._keep_outs = config, keep_outs
        forces = config.forces
        p = np.zeros(ck.N_CHAIN)
        p[ck.K], p[ck.B], p[ck.KAPPA] = forces.k, forces.b, forces.kappa
        p[ck.K_SH], p[ck.K_B] = forces.k_sh, forces.k_b
        p[ck.K_SV] = 0.0 if config.constant_altitude else forces.k_sv
        p[ck.DELTA_1], p[ck.DELTA_2], p[ck.F_MAX] = forces.delta_1, forces.delta_2, forces.f_max
        p[ck.THETA_MAX], p[ck.LAMBDA] = math.radians(forces.theta_max_deg), forces.limit_gain
        p[ck.FLOOR], p[ck.CEILING] = config.altitude_min_m, config.altitude_max_m
        p[ck.STEP], p[ck.SETTLED] = forces.step_s, forces.settled_mps
        self._params = p

    def settle(
        self, points: FloatArray, course: float, cell: float, limits: Limits, intruders: FloatArray, distances_max: int
    ) -> tuple[FloatArray, FloatArray, int]:
        """Let a path settle among intruders.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            Local NED, m; the first (the ownship) and the last are held. Kept as it is.
        course : float
            Of the ownship, rad; NaN where any will do.
        cell : float
            Of the grid, m: the links' length at rest, unless the configuration has one.
        limits : Limits
        intruders : ndarray, shape (m, intruder_kernels.N_INTRUDER)
        distances_max : int
            How many distances to intruders may be taken; then the chain stops where it is.

        Returns
        -------
        points, times : ndarray, shape (n, 3), (n,)
            Times in s from now.
        distances : int
            How many were taken.
        """
        config, p, n = self._config, self._params.copy(), len(points)
        p[ck.SPEED], p[ck.REST_LENGTH] = limits.speed, config.forces.rest_length_m or cell
        slope = math.atan(min(limits.climb_max, limits.sink_max) / limits.speed)
        p[ck.GAMMA_MAX] = min(math.radians(config.forces.gamma_max_deg), slope)
        # Each step looks at every intruder three times from every mass; what else it does there is as much again.
        each = 3 * n * (len(intruders) + 1)
        p[ck.STEPS_MAX] = min(config.forces.steps_max, distances_max // each)
        settled, times = points.copy(), np.zeros(n)
        steps = ck.relax(
            settled, n, course, intruders, len(intruders), self._keep_outs.volumes, self._keep_outs.vertices, p,
            np.empty((n, 3)), np.empty((n, 3)), times,
        )  # fmt: skip
        return settled, times, steps * each
