"""The turn with which a path is begun.

The corners of a path are cut, so that its legs are near what is flown. At its beginning nothing can be cut: the turn to
the first waypoint begins where the ownship is, and leads out of the leg by up to a turn's diameter.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted

Floats = NDArray[np.float64]

TURN_LEAST = math.radians(12.0)  # what is turned by less stays near the leg
TURN_MOST = math.radians(250.0)  # a waypoint for which more is turned is inside the turn
PIECE = math.radians(40.0)  # of an arc: 0.06 radii off it
PLACES = 7  # so many more a path may get: of arcs


@jit_uncounted
def begin_turn(points: Floats, n: int, course: float, radius: float, out: Floats) -> int:
    """Write a path with its first turn as an arc of chords into `out`, and return how many places it has.

    Parameters
    ----------
    points : ndarray, shape (>= n, 3)
        Local NED, m.
    n : int
    course : float
        At the first place, rad; NaN where any will do.
    radius : float
        Of the turn, m.
    out : ndarray, shape (>= n + PLACES, 3)
        Overwritten. As the path is where it begins with no turn, or the first waypoint is inside the turn.
    """
    out[0, 0], out[0, 1], out[0, 2] = points[0, 0], points[0, 1], points[0, 2]
    more = 0
    dn, de = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    cn, ce = math.cos(course), math.sin(course)
    along, aside = dn * cn + de * ce, de * cn - dn * ce
    side = 1.0 if aside >= 0.0 else -1.0
    # From the centre of the turn, abeam of the ownship, to the waypoint: along the course, and outwards.
    off = radius - abs(aside)
    reach2 = along * along + off * off
    if reach2 > radius * radius and not math.isnan(course):
        left = math.sqrt(reach2 - radius * radius)
        turn = math.atan2(-off, along) + math.atan2(radius, left)
        if turn < 0.0:
            turn += 2.0 * math.pi
        if TURN_LEAST < turn < TURN_MOST:
            more = math.ceil(turn / PIECE)
            length = radius * turn + left
            for i in range(1, more + 1):
                angle = turn * i / more
                ahead, out_of_it = radius * math.sin(angle), side * radius * (1.0 - math.cos(angle))
                out[i, 0] = points[0, 0] + ahead * cn - out_of_it * ce
                out[i, 1] = points[0, 1] + ahead * ce + out_of_it * cn
                out[i, 2] = points[0, 2] + radius * angle / length * (points[1, 2] - points[0, 2])
    for i in range(1, n):
        k = i + more
        out[k, 0], out[k, 1], out[k, 2] = points[i, 0], points[i, 1], points[i, 2]
    return n + more


@jit_uncounted
def leg_times(points: Floats, n: int, speed: float, times: Floats) -> float:
    """Write when a path flown at `speed` is at its places into `times` (>= n,), s, and return its length, m."""
    length = 0.0
    times[0] = 0.0
    for i in range(n - 1):
        dn, de = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        dd = points[i + 1, 2] - points[i, 2]
        length += math.sqrt(dn * dn + de * de + dd * dd)
        times[i + 1] = length / speed
    return length


@jit
def flown_times(
    points: Floats, n: int, course: float, radius: float, speed: float, out: Floats, times: Floats
) -> tuple[int, float]:
    """Write a path with its first turn into `out`, as `begin_turn`, and when it is where into `times`, s.

    Returns
    -------
    n : int
        How many places it has then.
    length : float
        m.
    """
    m = begin_turn(points, n, course, radius, out)
    return m, leg_times(out, m, speed, times)


def warmup() -> None:
    """Compile what Python calls of this module."""
    flown_times(np.zeros((2, 3)), 2, 0.0, 1.0, 1.0, np.zeros((2 + PLACES, 3)), np.zeros(2 + PLACES))
