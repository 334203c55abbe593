"""Separations of all aircraft at one instant, and which volumes they are inside."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.conflict.kernels import well_clear_violation

FloatArray = NDArray[np.float64]

LARGER, SMALLER, HORIZONTAL, VERTICAL = range(4)
N_MEASURES = 4


@jit
def score_states(
    own_position: FloatArray,
    own_velocity: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    unit_horizontal: float,
    unit_vertical: float,
    volumes: FloatArray,
    miss_filter: bool,
    measures: FloatArray,
    inside: NDArray[np.bool_],
) -> int:
    """Measure all aircraft, and return how many pairs of aircraft and volume are inside.

    Parameters
    ----------
    own_position, own_velocity : (3,)
    positions, velocities : (k, 3)
        Local NED, m and m/s.
    unit_horizontal, unit_vertical : float
        What separations are measured in, m.
    volumes : (v, 4)
        DTHR, ZTHR, TTHR, TCOA.
    miss_filter : bool
        Whether modified tau counts only towards a miss of at most DTHR.
    measures : (k, N_MEASURES)
        Out: the larger and the smaller of both separations in their units, then both in m; NaN where a state is not
        finite.
    inside : bool, (k, v)
        Out.
    """
    count = 0
    for i in range(positions.shape[0]):
        sx, sy, sz = (
            own_position[0] - positions[i, 0],
            own_position[1] - positions[i, 1],
            own_position[2] - positions[i, 2],
        )
        vx, vy, vz = (
            own_velocity[0] - velocities[i, 0],
            own_velocity[1] - velocities[i, 1],
            own_velocity[2] - velocities[i, 2],
        )
        inside[i, :] = False
        if not math.isfinite(sx + sy + sz + vx + vy + vz):
            measures[i, :] = math.nan
            continue
        horizontal, vertical = math.hypot(sx, sy), abs(sz)
        a, b = horizontal / unit_horizontal, vertical / unit_vertical
        measures[i, LARGER], measures[i, SMALLER] = max(a, b), min(a, b)
        measures[i, HORIZONTAL], measures[i, VERTICAL] = horizontal, vertical
        for j in range(volumes.shape[0]):
            if well_clear_violation(
                sx,
                sy,
                sz,
                vx,
                vy,
                vz,
                volumes[j, 0],
                volumes[j, 1],
                volumes[j, 2],
                volumes[j, 3],
                miss_filter,
            ):
                inside[i, j] = True
                count += 1
    return count


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    one, states = np.ones(3), np.zeros((1, 3))
    score_states(
        one,
        one,
        states,
        states,
        1.0,
        1.0,
        np.ones((1, 4)),
        False,
        np.empty((1, N_MEASURES)),
        np.empty((1, 1), np.bool_),
    )
