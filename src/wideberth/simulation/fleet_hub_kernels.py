"""Compiled hub that gathers the states of a fleet, decides for all and sends commands (CAS thesis, 3.1, centralised).

m, m/s, s, NED.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import maneuver_kernels as maneuver
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.simulation import fleet_decision_kernels as decision
from wideberth.simulation import fleet_message_kernels as messages
from wideberth.simulation.fleet_message_kernels import Buffers, Results, make_buffers, make_results

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Columns of a command: velocity (NED), reason, vehicle avoided.
C_REASON, C_TARGET = 3, 4
N_COMMAND = 5


class Hub(NamedTuple):
    """What a hub works in, made for n vehicles and a ring of m decisions.

    Attributes
    ----------
    sent : ndarray, shape (m, n, N_COMMAND)
        Commands by decision.
    taken : ndarray, shape (n, N_COMMAND)
        The newest that each vehicle has.
    decided : ndarray, shape (n, N_COMMAND)
        The hub's last decisions.
    known : ndarray, shape (n,)
        1 where the hub knows a vehicle.
    """

    sent: FloatArray
    taken: FloatArray
    decided: FloatArray
    known: FloatArray


@jit_uncounted
def reset(start: FloatArray, hub: Hub) -> None:
    """Empty a hub for a new run from the states `start` (n, 6)."""
    for i in range(start.shape[0]):
        hub.decided[i, 0], hub.decided[i, 1], hub.decided[i, 2] = start[i, 3], start[i, 4], 0.0
        hub.decided[i, C_REASON], hub.decided[i, C_TARGET] = float(pair.NO_REASON), -1.0


@jit_uncounted
def expect(
    j: int,
    decision_number: int,
    horizon: float,
    period: float,
    start: FloatArray,
    wanted: float,
    p: FloatArray,
    b: Buffers,
    hub: Hub,
) -> None:
    """Move the view of vehicle `j` on by `horizon` s, through the commands that the hub has sent it meanwhile.

    A state that was reported a way ago obeys the commands that were sent a way before it: those of the last `horizon`,
    one each `period`. `start` (6) is the state at the start, `p` (N_SETTINGS) are the vehicle's settings.
    """
    ring = hub.sent.shape[0]
    count = min(math.floor(horizon / period + 0.5), ring - 1, decision_number)
    for c in range(3):
        b.views[j, c] += (horizon - count * period) * b.views[j, 3 + c]
    kept, kept_level = math.exp(-period / p[pair.P_LAG]), math.exp(-period / p[pair.P_LEVEL_LAG])
    for back in range(count, 0, -1):
        told = hub.sent[(decision_number - back) % ring, j]
        rate = told[2]
        if int(told[C_REASON]) == pair.NO_REASON:
            rate = pair.guidance_rate(b.views[j, 2], wanted, p)
        behind = b.views[j, 5] - rate
        b.views[j, 2] += rate * period + behind * p[pair.P_LAG] * (1.0 - kept)
        b.views[j, 5] = rate + behind * kept
        for c in range(2):
            b.views[j, c] += b.views[j, 3 + c] * period
            if p[pair.P_CONTROLLER] == pair.MANEUVERS and int(told[C_REASON]) != pair.NO_REASON:
                b.views[j, 3 + c] = told[c] + (b.views[j, 3 + c] - told[c]) * kept_level


@jit_uncounted
def gather(
    decision_number: int,
    t: float,
    period: float,
    start: FloatArray,
    wanted: FloatArray,
    p: FloatArray,
    r: FloatArray,
    b: Buffers,
    hub: Hub,
    results: Results,
) -> None:
    """Write what the hub expects all to do when a command that it sends now arrives, and whom it knows.

    The way down is taken to last as long as the reports are old on average.
    """
    n = b.use.shape[0]
    total = count = 0.0
    for j in range(n):
        age = messages.look(n, j, t, start, wanted, r, b)
        hub.known[j] = 1.0 if age <= p[j, pair.P_STALE] else 0.0
        if age > p[j, pair.P_STALE]:
            results.counters[j, messages.STALE] += 1
        if hub.known[j] > 0.0:
            total, count = total + age, count + 1.0
    down = total / max(count, 1.0)
    for j in range(n):
        if hub.known[j] > 0.0:
            age = b.views[j, multi.V_AGE]
            horizon = messages.compensated(age, p[j]) + messages.compensated(down, p[j])
            expect(j, decision_number, horizon, period, start[j], wanted[j], p[j], b, hub)


@jit_uncounted
def decide_for_all(
    k: int,
    t: float,
    start: FloatArray,
    wanted: FloatArray,
    p: FloatArray,
    r: FloatArray,
    seed: int,
    encounter: int,
    u: FloatArray,
    b: Buffers,
    hub: Hub,
    results: Results,
) -> None:
    """Let the hub decide for each vehicle that it knows, and send the commands; `u` (4) is scratch."""
    n, every = b.use.shape[0], int(r[messages.R_DECIDE_EVERY])
    decision_number = k // every
    slot = decision_number % hub.sent.shape[0]
    gather(decision_number, t, every * r[messages.R_DT], start, wanted, p, r, b, hub, results)
    for i in range(n):
        last = hub.decided[i]
        reason, target = pair.NO_REASON, -1
        if hub.known[i] > 0.0:
            for j in range(n):
                b.use[j] = hub.known[j] if j != i else 0.0
            reason, last[2], target = decision.decide(
                i, b.views[i], start[i], wanted[i], p[i], int(last[C_REASON]), last[2], int(last[C_TARGET]), last[:2], b
            )
        last[C_REASON], last[C_TARGET] = float(reason), float(target)
        for c in range(N_COMMAND):
            hub.sent[slot, i, c] = last[c]
        if hub.known[i] > 0.0:
            messages.carry(k, k, t, i, n, seed, encounter, r, b, results, u)


@jit_uncounted
def obey(
    i: int,
    k: int,
    start: FloatArray,
    wanted: float,
    p: FloatArray,
    r: FloatArray,
    reasons: IntArray,
    targets: IntArray,
    commands: FloatArray,
    b: Buffers,
    hub: Hub,
    results: Results,
) -> None:
    """Let vehicle `i` do what it was told: the newest command that avoids, else what its own guidance wants.

    `start` (6) is its state at the start, `p` (N_SETTINGS) its settings. Without a fresh command it follows guidance.
    """
    step, every, ring = b.last[i, b.use.shape[0]], int(r[messages.R_DECIDE_EVERY]), hub.sent.shape[0]
    told = step >= 0 and (k - step) * r[messages.R_DT] <= p[pair.P_STALE]
    if step >= 0 and not told:
        results.counters[i, messages.STALE] += 1
    if step >= 0 and (k - step) // every < ring:
        for c in range(N_COMMAND):
            hub.taken[i, c] = hub.sent[(step // every) % ring, i, c]
    if told and int(hub.taken[i, C_REASON]) != pair.NO_REASON:
        b.level[i, 0], b.level[i, 1], commands[i] = hub.taken[i, 0], hub.taken[i, 1], hub.taken[i, 2]
        reasons[i], targets[i] = int(hub.taken[i, C_REASON]), int(hub.taken[i, C_TARGET])
        return
    reasons[i], targets[i] = pair.NO_REASON, -1
    commands[i] = pair.guidance_rate(b.known[i, 2], wanted, p)
    if p[pair.P_CONTROLLER] == pair.MANEUVERS:
        maneuver.preferred_velocity(b.known[i], start, wanted, p, b.preferred)
        b.level[i, 0], b.level[i, 1] = b.preferred[0], b.preferred[1]


def make_hub(n: int, ring: int) -> Hub:
    """Return what a hub works in, for `n` vehicles and a ring of `ring` decisions."""
    return Hub(np.zeros((ring, n, N_COMMAND)), np.zeros((n, N_COMMAND)), np.zeros((n, N_COMMAND)), np.zeros(n))


def warmup() -> None:
    """Compile what is called from Python."""
    n = 2
    b, hub, results = make_buffers(n, 4, n + 1), make_hub(n, 4), make_results(n, 1, 1)
    x, wanted, p, r = np.ones((n, 6)), np.zeros(n), np.ones((n, pair.N_SETTINGS)), np.ones(messages.N_RUN)
    reset(x, hub)
    decide_for_all(1, 0.1, x, wanted, p, r, 1, 1, np.zeros(4), b, hub, results)
    ints = np.zeros(n, np.int64)
    obey(0, 1, x[0], 0.0, p[0], r, ints, ints.copy(), np.zeros(n), b, hub, results)
