"""Aircraft that radar or ADS-B no longer tells of: reports carry on a lost track, and silence ends one."""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import (
    CONFIRMED,
    Bank,
    Motion,
    combined,
    make_bank,
    predict_track,
    prepare_step,
    remove_track,
)
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.consider_kernels import BIASES, forget_biases
from wideberth.tracking.multi_target.heard_kernels import STRAIGHT_S, STRAIGHT_WEIGHT, Heard, ReportRules, make_heard
from wideberth.tracking.multi_target.identity_kernels import (
    CARRIED_ON,
    FALLEN_SILENT,
    NO_MORE_HEARD,
    NOT_SEEN,
    find_slots,
    new_number,
    note,
    separation,
    witness,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.life_kernels import HANDED_BACK
from wideberth.tracking.ownship_kernels import STATE_WIDTH

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@jit_uncounted
def hand_back(
    bank: Bank,
    filters: Bank,
    heard: Heard,
    rules: ReportRules,
    motion: Motion,
    events: IntArray,
    event_count: IntArray,
    s: Scratch,
) -> None:
    """Let the reports carry on, under the same number, the tracks that no radar sees any more.

    The filter takes over the track's estimate, which is the better one. Where the two do not agree the track is lost.
    """
    find_slots(bank, heard)
    for i in range(bank.size[0] - 1, -1, -1):
        u = bank.address[i]
        if u < 0 or bank.existence[i] != HANDED_BACK:
            continue
        dt = bank.t[0] - heard.t[u]
        witness(filters, u, dt, motion, s)
        square, _ = separation(bank, i, motion, s)
        if square > rules.link_gate:
            note(events, event_count, NOT_SEEN, bank.identity[i], u, -1)
            heard.number[u] = new_number(bank)
            remove_track(bank, i)
            continue
        heard.number[u] = bank.identity[i]
        heard.status[u] = CONFIRMED
        for a in range(STATE_WIDTH):
            heard.own[u, a] = bank.own[i, a]
        if dt >= 0.0:
            for j in range(HYPOTHESES):
                filters.mu[u, j] = bank.mu[i, j]
                for a in range(9):
                    filters.x[u, j, a] = bank.x[i, j, a]
                    for b in range(9):
                        filters.p[u, j, a, b] = bank.p[i, j, a, b]
                    for b in range(BIASES):
                        filters.cross[u, j, a, b] = bank.cross[i, j, a, b]
            heard.t[u] = bank.t[0]
        heard.strikes[u], heard.waits[u], heard.pending[u] = 0, 0, 0
        note(events, event_count, CARRIED_ON, bank.identity[i], u, -1)
        remove_track(bank, i)


@jit_uncounted
def drop_silent(
    bank: Bank, heard: Heard, t: float, rules: ReportRules, events: IntArray, event_count: IntArray
) -> None:
    """End the filters of aircraft that have not been heard for too long; radar tracks live on without the address."""
    find_slots(bank, heard)
    for u in range(heard.alive.shape[0]):
        if heard.alive[u] == 0:
            continue
        confirmed = heard.status[u] == CONFIRMED
        if t - heard.heard[u] <= (rules.keep_s if confirmed else rules.keep_tentative_s):
            continue
        i = heard.slot[u]
        if i >= 0:
            bank.address[i] = -1
            forget_biases(bank.cross[i])
            heard.slot[u] = -1
            note(events, event_count, NO_MORE_HEARD, bank.identity[i], u, -1)
        elif confirmed:
            note(events, event_count, FALLEN_SILENT, heard.number[u], u, -1)
        heard.alive[u], heard.status[u], heard.reports[u] = 0, 0, 0


@jit_uncounted
def report_heard(
    filters: Bank,
    heard: Heard,
    users: IntArray,
    t: float,
    motion: Motion,
    one: Bank,
    x: FloatArray,
    p: FloatArray,
    s: Scratch,
) -> None:
    """Write means (n, 9) and covariances (n, 9, 9) of the filters of `users`, predicted to `t`; `one` is scratch."""
    for k in range(len(users)):
        u = users[k]
        for j in range(HYPOTHESES):
            one.mu[0, j] = filters.mu[u, j]
            for a in range(9):
                one.x[0, j, a] = filters.x[u, j, a]
                for b in range(9):
                    one.p[0, j, a, b] = filters.p[u, j, a, b]
        dt = t - heard.t[u]
        if dt > 0.0:
            prepare_step(heard.habit[u], STRAIGHT_WEIGHT, STRAIGHT_S, dt, motion, s.motion.stay)
            predict_track(one, 0, dt, motion, s.motion)
        combined(one, 0, motion, x[k], p[k], s.motion)


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = ReportRules(25.0, 0.3, 1.0, 1e4, 60.0, 350.0, 1.5, 1, 22.5, 35.0, 9.0, 8, 3, 60.0, 15.0, 0.999)
    bank, filters, heard, s = make_bank(1), make_bank(1), make_heard(1), make_scratch(1, 1, 2)
    events, count, zero = np.zeros((4, 4), np.int64), np.zeros(1, np.int64), np.zeros(1, np.int64)
    hand_back(bank, filters, heard, rules, motion, events, count, s)
    report_heard(filters, heard, zero, 1.0, motion, make_bank(1), np.zeros((1, 9)), np.zeros((1, 9, 9)), s)
    drop_silent(bank, heard, 100.0, rules, events, count)
