"""What a straight flight at constant speed meets in sampled traffic."""

import math

import numpy as np

from wideberth._jit import jit
from wideberth.conflict.kernels import well_clear_violation


@jit
def meetings(
    states: np.ndarray,
    first: int,
    count: int,
    step: float,
    start: np.ndarray,
    velocity: np.ndarray,
    volumes: np.ndarray,
    filtered: np.ndarray,
    cross_radius: float,
    cross_height: float,
    ceiling: float,
    t_cross: np.ndarray,
    t_loss: np.ndarray,
) -> int:
    """Fill the first crossing and the first loss of each volume for each aircraft, s from the start of the flight.

    Parameters
    ----------
    states : (m, k, 6)
        Position and velocity of each aircraft at times `step` apart, NED; NaN where absent.
    first, count
        Samples flown: the flight starts at sample `first`.
    start, velocity : (3,)
    volumes : (v, 4)
        DTHR, ZTHR, TTHR, TCOA.
    filtered : (v,)
        Whether modified tau counts only towards a miss of at most DTHR.
    cross_radius, cross_height, ceiling
        Nearer than the first two, an aircraft below the altitude `ceiling` is crossed.
    t_cross : (k,), t_loss : (k, v)
        Out; NaN where it does not happen.

    Returns
    -------
    int
        How many aircraft are inside the first volume at the last sample.
    """
    t_cross[:] = math.nan
    t_loss[:] = math.nan
    reach = cross_height
    tcoa = 0.0
    for j in range(volumes.shape[0]):
        reach = max(reach, volumes[j, 1])
        tcoa = max(tcoa, volumes[j, 3])
    inside_at_end = 0
    for i in range(count):
        t = i * step
        n, e, d = start[0] + velocity[0] * t, start[1] + velocity[1] * t, start[2] + velocity[2] * t
        for a in range(states.shape[1]):
            sz = states[first + i, a, 2] - d
            vz = states[first + i, a, 5] - velocity[2]
            # Absent aircraft (NaN) fail the comparison.
            if not abs(sz) <= max(reach, tcoa * abs(vz)):
                continue
            sx, sy = states[first + i, a, 0] - n, states[first + i, a, 1] - e
            near = abs(sz) <= cross_height and sx * sx + sy * sy <= cross_radius * cross_radius
            if near and math.isnan(t_cross[a]) and -states[first + i, a, 2] < ceiling:
                t_cross[a] = t
            vx, vy = states[first + i, a, 3] - velocity[0], states[first + i, a, 4] - velocity[1]
            for j in range(volumes.shape[0]):
                last = j == 0 and i == count - 1
                if (last or math.isnan(t_loss[a, j])) and well_clear_violation(
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
                    filtered[j],
                ):
                    if last:
                        inside_at_end += 1
                    if math.isnan(t_loss[a, j]):
                        t_loss[a, j] = t
    return inside_at_end


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    states, filtered = np.zeros((2, 1, 6)), np.array([False])
    meetings(
        states,
        0,
        2,
        1.0,
        np.zeros(3),
        np.ones(3),
        np.ones((1, 4)),
        filtered,
        1.0,
        1.0,
        1.0,
        np.empty(1),
        np.empty((1, 1)),
    )
