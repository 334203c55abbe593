"""The turn with which a path is begun.

The corners of a path are cut, so that its legs are near what is flown. At its beginning nothing can be cut: the turn to
the first waypoint begins where the ownship is, and leads out of the leg by up to a turn's diameter.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.vehicles.kernels import GRAVITY

Floats = NDArray[np.float64]

TURN_LEAST = math.radians(12.0)  # what is turned by less stays near the leg
TURN_MOST = math.radians(250.0)  # a waypoint for which more is turned is inside the turn
PIECE = math.radians(40.0)  # of an arc: 0.06 radii off it
ROLL_LEAST = math.radians(5.0)  # of bank: less is rolled out at once
PLACES = 8  # so many more a path may get: of arcs, and where the ownship has rolled out

# Where the ownship has rolled out of its turn: ahead and to the right of where it is (m), and its course there from its
# course now (rad; zero where it does not turn).
ROLL_AHEAD, ROLL_RIGHT, ROLL_TURN = 0, 1, 2
N_ROLL = 3


def roll_out(bank: float, rate: float, speed: float) -> Floats:
    """Return where the ownship will have rolled out of its turn, (N_ROLL,).

    Parameters
    ----------
    bank : float
        Now, rad, positive to the right.
    rate : float
        Of the roll, rad/s.
    speed : float
        m/s.
    """
    roll = np.zeros(N_ROLL)
    if abs(bank) >= ROLL_LEAST:
        lasts = abs(bank) / rate
        # The rate of the turn falls to zero about evenly.
        turn = 0.5 * lasts * GRAVITY * math.tan(bank) / speed
        roll[ROLL_AHEAD], roll[ROLL_RIGHT] = speed * lasts * math.cos(0.5 * turn), speed * lasts * math.sin(0.5 * turn)
        roll[ROLL_TURN] = turn
    return roll


@jit_uncounted
def begin_turn(points: Floats, n: int, course: float, radius: float, roll: Floats, out: Floats) -> int:
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
    roll : ndarray, shape (N_ROLL,)
        Where the ownship has rolled out of its turn: the new one begins there if it is to the other side.
    out : ndarray, shape (>= n + PLACES, 3)
        Overwritten. As the path is where it begins with no turn, or the first waypoint is inside the turn.
    """
    out[0, 0], out[0, 1], out[0, 2] = points[0, 0], points[0, 1], points[0, 2]
    more = 0
    dn, de = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    cn, ce = math.cos(course), math.sin(course)
    side = 1.0 if de * cn - dn * ce >= 0.0 else -1.0
    rolls = roll[ROLL_TURN] * side < 0.0
    bn, be = points[0, 0], points[0, 1]
    if rolls:
        bn += roll[ROLL_AHEAD] * cn - roll[ROLL_RIGHT] * ce
        be += roll[ROLL_AHEAD] * ce + roll[ROLL_RIGHT] * cn
        cn, ce = math.cos(course + roll[ROLL_TURN]), math.sin(course + roll[ROLL_TURN])
    along = (points[1, 0] - bn) * cn + (points[1, 1] - be) * ce
    aside = (points[1, 1] - be) * cn - (points[1, 0] - bn) * ce
    # From the centre of the turn, abeam of where it begins, to the waypoint: along the course, and outwards.
    off = radius - side * aside
    reach2 = along * along + off * off
    if reach2 > radius * radius and not math.isnan(course):
        left = math.sqrt(reach2 - radius * radius)
        turn = math.atan2(-off, along) + math.atan2(radius, left)
        if turn < 0.0:
            turn += 2.0 * math.pi
        if TURN_LEAST < turn < TURN_MOST:
            if rolls:
                more = 1
                out[1, 0], out[1, 1] = bn, be
            count = math.ceil(turn / PIECE)
            for i in range(1, count + 1):
                angle = turn * i / count
                ahead, out_of_it = radius * math.sin(angle), side * radius * (1.0 - math.cos(angle))
                out[more + i, 0] = bn + ahead * cn - out_of_it * ce
                out[more + i, 1] = be + ahead * ce + out_of_it * cn
            more += count
            level2 = max(dn * dn + de * de, 1e-9)  # zero for a waypoint right above, which a turn leads to after a roll
            for i in range(1, more + 1):
                # The height is flown by how much of the leg is behind, not of the way: a turn gains little of it.
                done = ((out[i, 0] - points[0, 0]) * dn + (out[i, 1] - points[0, 1]) * de) / level2
                out[i, 2] = points[0, 2] + min(max(done, 0.0), 1.0) * (points[1, 2] - points[0, 2])
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
    points: Floats, n: int, course: float, radius: float, roll: Floats, speed: float, out: Floats, times: Floats
) -> tuple[int, float]:
    """Write a path with its first turn into `out`, as `begin_turn`, and when it is where into `times`, s.

    Returns
    -------
    n : int
        How many places it has then.
    length : float
        m.
    """
    m = begin_turn(points, n, course, radius, roll, out)
    return m, leg_times(out, m, speed, times)


def warmup() -> None:
    """Compile what Python calls of this module."""
    flown_times(np.zeros((2, 3)), 2, 0.0, 1.0, np.zeros(N_ROLL), 1.0, np.zeros((2 + PLACES, 3)), np.zeros(2 + PLACES))
