"""How a path is begun: with a turn, and from a climb or descent.

The corners of a path are cut, so that its legs are near what is flown. At its beginning nothing can be cut: the turn to
the first waypoint begins where the ownship is, and leads out of the leg by up to a turn's diameter. Bank and climb rate
do not change at once either.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.vehicles import kernels as vk

Floats = NDArray[np.float64]

TURN_LEAST = math.radians(12.0)  # what is turned by less stays near the leg
TURN_MOST = math.radians(250.0)  # a waypoint for which more is turned is inside the turn
PIECE = math.radians(40.0)  # of an arc: 0.06 radii off it
ROLL_LEAST = math.radians(5.0)  # of bank: less is rolled out at once
LAG_LEAST = 1.0  # m of height: a climb that lags by less is flown as it is
LAGS = 2.0  # time constants of the climb after which most of the lag is there
PLACES = 9  # so many more a path may get: of arcs, where the ownship has rolled out, where its climb has settled

# What the ownship first goes on with. Where it has rolled out of its turn: ahead and to the right of where it is (m),
# and its course there from its course now (rad; zero where it does not turn). How much lower it gets on a metre of way,
# and the way it flies in the time constant of its climb, m. How height is caught up with: the share of it on a metre of
# way, and the steepest climb and descent, in height on a metre of way.
ROLL_AHEAD, ROLL_RIGHT, ROLL_TURN, SLOPE, LAG, CATCH_UP, STEEPEST_CLIMB, STEEPEST_SINK = range(8)
N_INERTIA = 8


def inertia_of(state: Floats, vehicle: Floats, speed: float) -> Floats:
    """Return what an ownship first goes on with, (N_INERTIA,).

    Parameters
    ----------
    state : ndarray, shape (vehicles.kernels.N_STATES,)
    vehicle : ndarray, shape (vehicles.kernels.N_PARAMS,)
    speed : float
        Along paths, m/s.
    """
    inertia = np.zeros(N_INERTIA)
    bank = vk.clip(state[vk.BANK], -vehicle[vk.P_BANK_MAX], vehicle[vk.P_BANK_MAX])
    if abs(bank) >= ROLL_LEAST:
        lasts = abs(bank) / vehicle[vk.P_BANK_RATE_MAX]
        # The rate of the turn falls to zero about evenly.
        turn = 0.5 * lasts * vk.GRAVITY * math.tan(bank) / speed
        inertia[ROLL_AHEAD] = speed * lasts * math.cos(0.5 * turn)
        inertia[ROLL_RIGHT] = speed * lasts * math.sin(0.5 * turn)
        inertia[ROLL_TURN] = turn
    inertia[SLOPE], inertia[LAG] = -state[vk.CLIMB] / speed, vehicle[vk.P_TAU_CLIMB] * speed
    inertia[CATCH_UP] = vehicle[vk.P_ALTITUDE_GAIN] / speed
    inertia[STEEPEST_CLIMB], inertia[STEEPEST_SINK] = vehicle[vk.P_CLIMB_MAX] / speed, vehicle[vk.P_SINK_MAX] / speed
    return inertia


@jit_uncounted
def lagging(slope: float, wanted: float, way: float, lag: float) -> tuple[float, float]:
    """Return how much lower than wanted a climb or descent is after some way (m), and its slope then.

    Parameters
    ----------
    slope, wanted : float
        How much lower it gets on a metre of way, at first and on the path.
    way, lag : float
        m; the second is that of a time constant.
    """
    left = math.exp(-way / lag) if lag > 0.0 else 0.0
    return (slope - wanted) * lag * (1.0 - left), wanted + (slope - wanted) * left


@jit_uncounted
def caught_up(below: float, wanted: float, way: float, inertia: Floats) -> float:
    """Return how much lower than wanted a climb or descent with the slope `wanted` still is after some way, m.

    Parameters
    ----------
    below : float
        Before, m.
    wanted, way : float
        How much lower the path gets on a metre of way; m.
    inertia : ndarray, shape (N_INERTIA,)
    """
    spare = max(inertia[STEEPEST_CLIMB] + wanted if below > 0.0 else inertia[STEEPEST_SINK] - wanted, 0.0)
    left, share = abs(below), inertia[CATCH_UP]
    if share * left > spare:
        # At the limit, until the share of it is less.
        limited = way if spare * way <= left - spare / share else (left - spare / share) / spare
        left -= spare * limited
        way -= limited
    return math.copysign(left * math.exp(-share * way), below)


@jit_uncounted
def write_arc(points: Floats, course: float, radius: float, inertia: Floats, out: Floats) -> int:
    """Write where a path begins and the chords of its first turn into `out`, in the plane; return how many of these.

    Parameters
    ----------
    points : ndarray, shape (>= 2, 3)
        Local NED, m.
    course : float
        At the first place, rad; NaN where any will do.
    radius : float
        Of the turn, m.
    inertia : ndarray, shape (N_INERTIA,)
        A turn to the other side begins where the ownship has rolled out of the one it is in.
    out : ndarray, shape (>= PLACES, 3)
        Overwritten. No arc where the path begins with no turn, or the first waypoint is inside the turn.
    """
    out[0, 0], out[0, 1] = points[0, 0], points[0, 1]
    more = 0
    dn, de = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    cn, ce = math.cos(course), math.sin(course)
    side = 1.0 if de * cn - dn * ce >= 0.0 else -1.0
    rolls = inertia[ROLL_TURN] * side < 0.0
    bn, be = points[0, 0], points[0, 1]
    if rolls:
        bn += inertia[ROLL_AHEAD] * cn - inertia[ROLL_RIGHT] * ce
        be += inertia[ROLL_AHEAD] * ce + inertia[ROLL_RIGHT] * cn
        cn, ce = math.cos(course + inertia[ROLL_TURN]), math.sin(course + inertia[ROLL_TURN])
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
    return more


@jit_uncounted
def begin_turn(points: Floats, n: int, course: float, radius: float, inertia: Floats, out: Floats) -> int:
    """Write a path as it is begun into `out`, and return how many places it has: its first turn is an arc of chords.

    Its height lags behind by what the ownship climbs or sinks at first.

    Parameters
    ----------
    points : ndarray, shape (>= n, 3)
        Local NED, m.
    n : int
    course, radius, inertia
        As in `write_arc`.
    out : ndarray, shape (>= n + PLACES, 3)
        Overwritten.
    """
    more = write_arc(points, course, radius, inertia, out)
    out[0, 2] = points[0, 2]
    dn, de = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    # Wanted heights are by how much of the leg is behind, not of the way: a turn gains little of them.
    level2 = max(dn * dn + de * de, 1e-9)  # zero for a waypoint right above, which a turn leads to after a roll
    dd = points[1, 2] - points[0, 2]
    wanted, below, slope = points[0, 2], 0.0, inertia[SLOPE]
    for i in range(1, more + 1):
        way = math.hypot(out[i, 0] - out[i - 1, 0], out[i, 1] - out[i - 1, 1])
        done = ((out[i, 0] - points[0, 0]) * dn + (out[i, 1] - points[0, 1]) * de) / level2
        down = points[0, 2] + min(max(done, 0.0), 1.0) * dd
        if way > 0.0:
            more_below, slope = lagging(slope, (down - wanted) / way, way, inertia[LAG])
            below += more_below
        wanted = down
        out[i, 2] = wanted + below
    # Then straight on to the waypoint, and from there: the height is caught up with as far as it can be.
    n_, e_ = points[1, 0] - out[more, 0], points[1, 1] - out[more, 1]
    level, way = math.hypot(n_, e_), LAGS * inertia[LAG]
    if level > way > 0.0:
        leg_slope = (points[1, 2] - wanted) / level
        more_below, _slope = lagging(slope, leg_slope, way, inertia[LAG])
        if abs(more_below) > LAG_LEAST:
            more += 1
            out[more, 0] = out[more - 1, 0] + n_ * way / level
            out[more, 1] = out[more - 1, 1] + e_ * way / level
            wanted += leg_slope * way
            below += more_below
            out[more, 2] = wanted + below
    for i in range(1, n):
        k = i + more
        out[k, 0], out[k, 1], out[k, 2] = points[i, 0], points[i, 1], points[i, 2]
        if below != 0.0:
            way = math.hypot(out[k, 0] - out[k - 1, 0], out[k, 1] - out[k - 1, 1])
            if way > 0.0:
                below = caught_up(below, (points[i, 2] - wanted) / way, way, inertia)
            out[k, 2] += below
            wanted = points[i, 2]
            if abs(below) < LAG_LEAST:
                below = 0.0
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
    points: Floats, n: int, course: float, radius: float, inertia: Floats, speed: float, out: Floats, times: Floats
) -> tuple[int, float]:
    """Write a path as it is begun into `out`, as `begin_turn`, and when it is where into `times`, s.

    Returns
    -------
    n : int
        How many places it has then.
    length : float
        m.
    """
    m = begin_turn(points, n, course, radius, inertia, out)
    return m, leg_times(out, m, speed, times)


def warmup() -> None:
    """Compile what Python calls of this module."""
    flown_times(
        np.zeros((2, 3)), 2, 0.0, 1.0, np.zeros(N_INERTIA), 1.0, np.zeros((2 + PLACES, 3)), np.zeros(2 + PLACES)
    )
