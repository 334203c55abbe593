"""The life of tracks: births from the window, duplicates made one, confirmation, and the end."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, whitened_square
from wideberth.tracking.multi_target.bank_kernels import (
    CONFIRMED,
    Bank,
    Motion,
    add_track,
    combined,
    make_bank,
    place,
    remove_track,
)
from wideberth.tracking.multi_target.birth_kernels import birth
from wideberth.tracking.multi_target.buffers_kernels import (
    BIRTHS_DEFERRED,
    CONFIRMED_NOW,
    COUNTS,
    LEFT_VIEW,
    LOST,
    MERGED,
    NOT_SCANNED,
    TOO_UNCERTAIN,
    Rules,
    Scratch,
    log_odds,
    make_scratch,
    tell,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.window_kernels import Window, make_window

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

HANDED_BACK = -2.0
"""Existence of a track that no radar sees any more and that its ADS-B reports are to carry on."""

TENTATIVE_OUTSIDE_S = 0.5
"""A tentative track outside every field of view is not waited for."""


@jit_uncounted
def give_birth(
    bank: Bank,
    window: Window,
    motion: Motion,
    rules: Rules,
    sensor: int,
    false_plots: float,
    counts: IntArray,
    s: Scratch,
) -> None:
    """Make tentative tracks of the newest plots that agree with others in the window.

    Parameters
    ----------
    bank : Bank
        At the time of the newest scan; where it is full, births wait and are counted.
    window : Window
    motion : Motion
    rules : Rules
    sensor : int
        Whose scan the newest is.
    false_plots : float
        Expected in a scan.
    counts : ndarray of int64, shape (COUNTS,)
    s : Scratch
    """
    prior = math.log(rules.birth_per_scan / max(false_plots, 1.0))
    budget = rules.consensus_budget
    b = s.birth
    for m in range(window.filled[window.cursor[0]]):
        if window.used[window.cursor[0], m]:
            continue
        if bank.size[0] >= bank.mu.shape[0] or budget <= 0:
            counts[BIRTHS_DEFERRED] += 1
            continue
        odds, hits, tried = birth(
            window,
            m,
            rules.pair_scans,
            rules.speed_sigma,
            rules.speed_max,
            rules.gate,
            prior,
            rules.least_hits,
            rules.tentative_odds,
            budget,
            b,
        )
        budget -= tried
        if hits > 0:
            existence = 1.0 / (1.0 + math.exp(-min(odds, 30.0)))
            add_track(bank, b.x, b.p, min(existence, rules.existence_max), hits, sensor, motion)


@jit_uncounted
def distance_square(bank: Bank, i: int, j: int, motion: Motion, s: Scratch) -> float:
    """Return the normalised distance squared of two tracks in position and velocity."""
    combined(bank, i, motion, s.x, s.p, s.motion)
    combined(bank, j, motion, s.x2, s.p2, s.motion)
    for a in range(6):
        s.x[a] -= s.x2[a]
        for b in range(6):
            s.p[a, b] += s.p2[a, b]
    if not cholesky(s.p, 6, s.f):
        return math.inf
    return whitened_square(s.f, 6, s.x, s.x2)


@jit_uncounted
def merge(bank: Bank, clusters: int, motion: Motion, gate: float, s: Scratch) -> None:
    """Mark with existence -1 the lesser of two tracks that share plots and agree in position and velocity.

    Of two one of which is known by its ADS-B reports that one stays; two that both are, are two aircraft.
    """
    for q in range(clusters):
        for a in range(s.first[q], s.first[q + 1]):
            for b in range(a + 1, s.first[q + 1]):
                i, j = s.members[a], s.members[b]
                if bank.existence[i] < 0.0 or bank.existence[j] < 0.0:
                    continue
                known, other_known = bank.address[i] >= 0, bank.address[j] >= 0
                if known and other_known:
                    continue
                if distance_square(bank, i, j, motion, s) < gate:
                    same = bank.status[i] == bank.status[j]
                    keep = bank.hits[i] >= bank.hits[j] if same else bank.status[i] > bank.status[j]
                    keep = known if known != other_known else keep
                    ended, goes_on = (j, i) if keep else (i, j)
                    bank.existence[ended] = -1.0
                    if bank.status[ended] == CONFIRMED:
                        tell(s, MERGED, bank.identity[ended], bank.identity[goes_on])


@jit_uncounted
def settle(bank: Bank, t: float, rules: Rules, s: Scratch) -> None:
    """Confirm tracks, and drop those that are no longer believed, unseen for too long, or too uncertain.

    One that is known by its ADS-B reports is marked with existence `HANDED_BACK` instead, to go on by those alone.
    """
    i = 0
    while i < bank.size[0]:
        existence = bank.existence[i]
        confirmed = bank.status[i] == CONFIRMED
        odds = log_odds(existence)
        place(bank, i, s.x, s.f)
        reason = -1
        if existence < 0.0:
            reason = MERGED  # told by `merge`
        elif odds < (rules.drop_confirmed if confirmed else rules.drop_tentative):
            reason = LOST
        elif t - bank.seen[i] > (rules.outside_s if confirmed else TENTATIVE_OUTSIDE_S):
            reason = LEFT_VIEW
        elif not s.f[0, 0] + s.f[1, 1] + s.f[2, 2] < rules.spread_max * rules.spread_max:
            reason = TOO_UNCERTAIN
        if reason >= 0 and bank.address[i] >= 0:
            bank.existence[i] = HANDED_BACK
            i += 1
            continue
        if reason >= 0:
            if confirmed and reason != MERGED:
                tell(s, reason, bank.identity[i], -1)
            remove_track(bank, i)
            continue
        if not confirmed and odds >= rules.confirm_odds and bank.hits[i] >= rules.confirm_hits:
            bank.status[i] = CONFIRMED
            tell(s, CONFIRMED_NOW, bank.identity[i], -1)
        i += 1


@jit_uncounted
def drop_unscanned(bank: Bank, t: float, silent_s: float, s: Scratch) -> None:
    """Drop all tracks that only radars feed where no scan of any radar has come for too long before `t`."""
    if t - bank.t[1] <= silent_s:
        return
    for i in range(bank.size[0] - 1, -1, -1):
        if bank.address[i] >= 0:
            continue
        if bank.status[i] == CONFIRMED:
            tell(s, NOT_SCANNED, bank.identity[i], -1)
        remove_track(bank, i)


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = Rules._make([16.0, 100, 0.05, 3, 100.0, 30.0, 3, 4] + [0.0] * 4 + [0.9999] + [1.0] * 5 + [10, 0.0, 1.0])
    bank, window, s = make_bank(2), make_window(2, 1), make_scratch(2, 1, 2)
    window.cursor[:] = 0, 1
    give_birth(bank, window, motion, rules, 0, 1.0, np.zeros(COUNTS, np.int64), s)
    merge(bank, 0, motion, 4.0, s)
    settle(bank, 0.0, rules, s)
    drop_unscanned(bank, 0.0, 1.0, s)
    add_track(bank, np.ones(6), np.eye(6), 0.5, 4, 0, motion)
    distance_square(bank, 0, 0, motion, s)
