"""Whether the ownship can fly a path of waypoints within its limits."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.vehicles.kernels import wrap_angle

Floats = NDArray[np.float64]

TURN_MAX = math.radians(100.0)  # a sharper corner is no way round anything
SLACK = 1.05  # on slopes


# What of a path cannot be flown: slopes and corners, of the first leg and later.
STEEP_FIRST, SHARP_FIRST, STEEP, SHARP = 1, 2, 4, 8


@jit_uncounted
def path_flaws(
    points: Floats, times: Floats, n: int, course: float, radius: float, climb_max: float, sink_max: float
) -> int:
    """Return what of a path cannot be flown: turns that do not fit into its legs, and slopes beyond the rates.

    Parameters
    ----------
    points, times : ndarray, shape (>= n, 3), (>= n,)
        Local NED, m; s.
    n : int
    course : float
        At the start, rad; NaN where any will do.
    radius : float
        Of a turn, m.
    climb_max, sink_max : float
        m/s.
    """
    flaws = 0
    before, leg_before = course, math.inf
    for i in range(n - 1):
        dn, de = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        climb = points[i, 2] - points[i + 1, 2]
        duration = times[i + 1] - times[i]
        if climb > SLACK * climb_max * duration or -climb > SLACK * sink_max * duration:
            flaws |= STEEP_FIRST if i == 0 else STEEP
        leg = math.hypot(dn, de)
        if leg < 1e-6:
            continue
        after = math.atan2(de, dn)
        turn = 0.0 if math.isnan(before) else abs(wrap_angle(after - before))
        # A fillet takes R tan(turn / 2) of both legs; half of a leg belongs to each of its ends.
        if turn > TURN_MAX or radius * math.tan(0.5 * turn) > 0.5 * min(leg, leg_before):
            flaws |= SHARP_FIRST if i == 0 else SHARP
        before, leg_before = after, leg
    return flaws


def warmup() -> None:
    """Compile what Python calls of this module."""
    path_flaws(np.zeros((2, 3)), np.zeros(2), 2, 0.0, 1.0, 1.0, 1.0)
