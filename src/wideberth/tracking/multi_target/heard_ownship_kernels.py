"""Which aircraft that only reports tell of is the ownship: its own ADS-B, heard back, is no threat.

The test is that of `ownship_kernels`, among these aircraft alone: a radar's track of the ownship that has not yet been
found to be the same as its reports is the ownship as well.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, Bank, Motion, make_bank
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.heard_kernels import Heard, make_heard
from wideberth.tracking.multi_target.identity_kernels import FARTHEST_M, find_slots, witness
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT
from wideberth.tracking.ownship_kernels import STATE_WIDTH, OwnshipTest, choose, forget, look, telemetry_known

FloatArray = NDArray[np.float64]

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
    s: Scratch,
) -> int:
    """Compare the aircraft that no radar's track is with telemetry; return the place of the ownship's, -1: none.

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
    s : Scratch
    """
    known = telemetry_known(telemetry, covariance)
    find_slots(bank, heard)
    for u in range(heard.alive.shape[0]):
        near = heard.alive[u] == 1 and heard.slot[u] < 0 and heard.status[u] == CONFIRMED
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
    return choose(heard.alive.shape[0], test, heard.own) if known else -1


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    test = OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -25.0)
    bank, heard, s = make_bank(1), make_heard(1), make_scratch(1, 1, 2)
    find_heard_ownship(bank, make_bank(1), heard, 0.0, 0.1, np.zeros(6), np.eye(6), motion, test, s)
