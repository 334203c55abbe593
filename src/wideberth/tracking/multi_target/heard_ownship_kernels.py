"""Which aircraft that only reports tell of is the ownship: its own ADS-B, heard back, is no threat.

The test is that of `ownship_kernels`, among these aircraft alone: a radar's track of the ownship that has not yet been
found to be the same as its reports is the ownship as well. Reports are too coarse to tell an aircraft that flies along
with the ownship from it, so that only those can be the ownship that may be (`Heard.mine`): where the ownship's address
is known, its users, and where it does not broadcast, nobody.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, Bank, Motion, make_bank
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.heard_kernels import Heard, make_heard
from wideberth.tracking.multi_target.identity_kernels import FARTHEST_M, find_slots, is_ours, split, witness
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT
from wideberth.tracking.ownship_kernels import (
    EVIDENCE,
    FLAG,
    STATE_WIDTH,
    OwnshipTest,
    choose,
    explained,
    forget,
    look,
    telemetry_known,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

OLDEST_S = 10.0
"""An aircraft not heard for longer is not compared."""


@jit_uncounted
def find_heard_ownship(
    bank: Bank,
    filters: Bank,
    heard: Heard,
    t: float,
    dt: float,
    telemetry: FloatArray,
    covariance: FloatArray,
    motion: Motion,
    test: OwnshipTest,
    addressed: bool,
    events: IntArray,
    event_count: IntArray,
    s: Scratch,
) -> int:
    """Compare the aircraft that no radar's track is with telemetry; return the place of the ownship's, -1: none.

    The one returned is marked if it may be the ownship. A radar's track of the ownship loses the address of an aircraft
    that may not.

    Parameters
    ----------
    bank : Bank
        The radars' tracks.
    filters : Bank
    heard : Heard
    t, dt : float
        Time of the telemetry, and since this was done last, s.
    telemetry : ndarray, shape (6,)
        Position and velocity of the ownship, NED; anything not finite: no telemetry.
    covariance : ndarray, shape (6, 6)
    motion : Motion
    test : OwnshipTest
    addressed : bool
        Whether the ownship's address is known: then telemetry need only explain it.
    events, event_count
        As in `take_reports`.
    s : Scratch
    """
    known = telemetry_known(telemetry, covariance)
    find_slots(bank, heard)
    for i in range(bank.size[0]):
        u = bank.address[i]
        if u >= 0 and is_ours(bank, heard, u, i):
            split(bank, heard, u, events, event_count)
    for u in range(heard.alive.shape[0]):
        near = heard.alive[u] == 1 and heard.slot[u] < 0
        near = near and (heard.status[u] == CONFIRMED or (addressed and heard.mine[u] == 1))
        near = near and t - heard.t[u] <= OLDEST_S
        if near and known:
            north, east = filters.x[u, STRAIGHT, 0] - telemetry[0], filters.x[u, STRAIGHT, 1] - telemetry[1]
            near = math.hypot(north, east) <= FARTHEST_M
        if not near:
            for a in range(STATE_WIDTH):
                heard.own[u, a] = 0.0
        elif not known:
            forget(dt, test, heard.own[u])
        else:
            witness(filters, u, t - heard.t[u], motion, s)
            look(dt, s.x, s.p, telemetry, covariance, test, heard.own[u], s.own_work)
    if not known:
        return -1
    users = heard.alive.shape[0]
    chosen = choose(users, test, heard.own)
    if addressed:
        best = -1
        for u in range(users):
            better = best < 0 or heard.own[u, EVIDENCE] > heard.own[best, EVIDENCE]
            if heard.mine[u] == 1 and better and explained(test, heard.own[u]):
                best = u
        chosen = best if best >= 0 else chosen
    for u in range(users):
        heard.own[u, FLAG] = 1.0 if u == chosen and heard.mine[u] == 1 else 0.0
    return chosen


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    test = OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -25.0)
    bank, heard, s = make_bank(1), make_heard(1), make_scratch(1, 1, 2)
    events, count = np.zeros((4, 4), np.int64), np.zeros(1, np.int64)
    parts = (motion, test, False, events, count, s)
    find_heard_ownship(bank, make_bank(1), heard, 0.0, 0.1, np.zeros(6), np.eye(6), *parts)
