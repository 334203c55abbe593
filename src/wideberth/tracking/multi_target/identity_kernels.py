"""Which radar track is which aircraft that says by ADS-B who it is.

An address has its own filter, fed by its reports alone. At each report it is compared, in position and velocity, with
the tracks of radars: the normalised distance squared of two estimates is chi-square with 6 degrees of freedom where
they are of one aircraft, and as the filters run on from report to report it is the whole sequence that is tested.
An address belongs to one track at most, and a track to one address.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, congruence, log_determinant, whitened_square
from wideberth.tracking.multi_target.bank_kernels import (
    CONFIRMED,
    Bank,
    Motion,
    combined,
    make_bank,
    predict_tracks,
)
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.consider_kernels import BIASES, forget_biases
from wideberth.tracking.multi_target.heard_kernels import Heard, ReportRules, make_heard
from wideberth.tracking.multi_target.hearing_kernels import (
    AGAIN,
    NO_POSITION,
    REPORT_COUNTS,
    STARTED,
    TRACK_OUTSIDE,
    USED,
    rescale,
    support,
    take_report,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.report_kernels import ReportScratch, make_report_scratch
from wideberth.tracking.multi_target.rival_kernels import (
    is_denied,
    place_of_rival,
    renumber_rivals,
    score_of,
    weigh_rivals,
)
from wideberth.tracking.ownship_kernels import FLAG, STATE_WIDTH

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FARTHEST_M = 3000.0
"""Tracks further apart than this are not compared."""

APART_S = 3.0
"""Estimates whose times differ by more than this are not compared."""

STEP_S = 0.25
"""The radars' tracks are taken forward where a report is later than they by more than this."""

(HEARD_NOW, IS, ONE_WITH, IS_NOT, CARRIED_ON, FALLEN_SILENT, MOVED, NO_MORE_HEARD, NOT_SEEN) = range(9)
"""What happened; an event is code, number of the track, place of the address, other number."""


@jit_uncounted
def note(events: IntArray, count: IntArray, code: int, number: int, u: int, other: int) -> None:
    """Note an event; where there is no more room it is left out."""
    n = count[0]
    if n < events.shape[0]:
        events[n, 0], events[n, 1], events[n, 2], events[n, 3] = code, number, u, other
        count[0] = n + 1


@jit_uncounted
def new_number(bank: Bank) -> int:
    """Return the number of the next track."""
    number: int = bank.size[1]
    bank.size[1] += 1
    return number


@jit_uncounted
def find_slots(bank: Bank, heard: Heard) -> None:
    """Write to `heard.slot` where the bank has the track of each address, -1 where it has none."""
    for u in range(heard.slot.shape[0]):
        heard.slot[u] = -1
    for i in range(bank.size[0]):
        if bank.address[i] >= 0:
            heard.slot[bank.address[i]] = i


@jit_uncounted
def witness(filters: Bank, u: int, dt: float, motion: Motion, s: Scratch) -> None:
    """Write the filter's estimate, `dt` further, to `s.x` and `s.p`."""
    combined(filters, u, motion, s.x2, s.p2, s.motion)
    for a in range(9):
        for b in range(9):
            s.f[a, b] = 1.0 if a == b else 0.0
    for a in range(3):
        s.f[a, 3 + a], s.f[a, 6 + a], s.f[3 + a, 6 + a] = dt, 0.5 * dt * dt, dt
    for a in range(9):
        s.x[a] = 0.0
        for b in range(a, 9):
            s.x[a] += s.f[a, b] * s.x2[b]
    congruence(s.f, s.p2, 9, 9, s.work, s.p)


@jit_uncounted
def separation(bank: Bank, i: int, motion: Motion, s: Scratch) -> tuple[float, float]:
    """Return the normalised distance squared of track `i` from `s.x`, `s.p` (kept), and its log-determinant added."""
    combined(bank, i, motion, s.x2, s.p2, s.motion)
    for a in range(6):
        s.x2[a] -= s.x[a]
        for b in range(6):
            s.p2[a, b] += s.p[a, b]
    if not cholesky(s.p2, 6, s.f):
        return math.inf, math.inf
    square = whitened_square(s.f, 6, s.x2, s.work[0])
    return square, square + log_determinant(s.f, 6)


@jit_uncounted
def link(bank: Bank, heard: Heard, u: int, i: int, rules: ReportRules, events: IntArray, event_count: IntArray) -> None:
    """Give the address of `u` to the track in slot `i`; of two confirmed tracks' numbers the older one stays."""
    mine, its = heard.number[u], bank.identity[i]
    bank.address[i] = u
    forget_biases(bank.cross[i])
    if heard.status[u] == CONFIRMED:
        bank.identity[i] = min(mine, its)
        renumber_rivals(heard, its, bank.identity[i])
        note(events, event_count, ONE_WITH, bank.identity[i], u, max(mine, its))
    note(events, event_count, IS, bank.identity[i], u, -1)
    heard.slot[u] = i
    heard.status[u] = CONFIRMED
    for a in range(STATE_WIDTH):
        if heard.own[u, FLAG] != 0.0:
            bank.own[i, a] = heard.own[u, a]
    heard.own[u, FLAG] = 0.0
    heard.strikes[u], heard.waits[u], heard.pending[u] = 0, 0, 0


@jit_uncounted
def split(bank: Bank, heard: Heard, u: int, events: IntArray, event_count: IntArray) -> None:
    """Take the address of `u` from its track; the reports go on as another."""
    i = heard.slot[u]
    note(events, event_count, IS_NOT, bank.identity[i], u, -1)
    bank.address[i] = -1
    forget_biases(bank.cross[i])
    heard.slot[u] = -1
    heard.number[u] = new_number(bank)
    heard.strikes[u], heard.waits[u], heard.pending[u] = 0, 0, 0


@jit_uncounted
def move(bank: Bank, heard: Heard, u: int, i: int, j: int, events: IntArray, event_count: IntArray) -> None:
    """Pass the address of `u` from the track in slot `i` to that in slot `j`, whose own address goes the other way."""
    w = bank.address[j]
    note(events, event_count, IS_NOT, bank.identity[i], u, -1)
    if w >= 0:
        note(events, event_count, IS_NOT, bank.identity[j], w, -1)
        note(events, event_count, IS, bank.identity[i], w, -1)
        heard.slot[w], heard.strikes[w] = i, 0
    bank.address[i], bank.address[j] = w, u
    forget_biases(bank.cross[i])
    forget_biases(bank.cross[j])
    heard.slot[u], heard.strikes[u] = j, 0
    note(events, event_count, IS, bank.identity[j], u, -1)


@jit_uncounted
def is_ours(bank: Bank, heard: Heard, u: int, i: int) -> bool:
    """Return whether the track in slot `i` is the ownship's and the aircraft `u` is not the ownship."""
    return bool(bank.own[i, FLAG] != 0.0 and heard.mine[u] == 0)


@jit_uncounted
def passes_to(bank: Bank, heard: Heard, u: int, i: int, lead: float) -> int:
    """Return the slot of the track that makes the reports of `u` rather than its own in slot `i`; -1: none does.

    Where that one has another address, both must change to explain the reports of both better.
    """
    own = score_of(heard, u, bank.identity[i])
    best, most = -1, lead
    for j in range(bank.size[0]):
        k = place_of_rival(heard, u, bank.identity[j])
        if j == i or k < 0 or bank.status[j] != CONFIRMED or is_ours(bank, heard, u, j):
            continue
        gain, w = own - heard.score[u, k], bank.address[j]
        if w >= 0:
            k = place_of_rival(heard, w, bank.identity[i])
            gain += score_of(heard, w, bank.identity[j]) - heard.score[w, k] if k >= 0 else -math.inf
        if gain > most:
            best, most = j, gain
    return best


@jit_uncounted
def find_identity(
    bank: Bank,
    filters: Bank,
    heard: Heard,
    u: int,
    fits: bool,
    rules: ReportRules,
    motion: Motion,
    events: IntArray,
    event_count: IntArray,
    s: Scratch,
) -> None:
    """Find whose track the aircraft `u` is, or whether its track is still its own.

    Without a track it gets the one that fits, if no other fits nearly as well; where two do, it waits, and takes the
    better one after `rules.waits` reports. What its reports have told since (`rival_kernels`) takes it to another
    track, or to none, by twice `rules.lead`. `rules.strikes` reports in a row outside the track's gate take it to none.
    """
    dt = bank.t[0] - heard.t[u]
    if heard.reports[u] < rules.confirm or abs(dt) > APART_S:
        return
    own = heard.slot[u]
    if own >= 0:
        heard.strikes[u] = 0 if fits else heard.strikes[u] + 1
        alone = is_denied(heard, u, bank.identity[own], 3.0 * rules.lead)
        j = passes_to(bank, heard, u, own, 2.0 * rules.lead)
        if j >= 0:
            move(bank, heard, u, own, j, events, event_count)
        if j >= 0 or not (alone or heard.strikes[u] >= rules.strikes):
            return
        split(bank, heard, u, events, event_count)
    witness(filters, u, dt, motion, s)
    best, first, second = -1, math.inf, math.inf
    for i in range(bank.size[0]):
        if bank.address[i] >= 0 or bank.status[i] != CONFIRMED or i == own or is_ours(bank, heard, u, i):
            continue
        if is_denied(heard, u, bank.identity[i], 2.0 * rules.lead):
            continue
        if math.hypot(bank.x[i, 0, 0] - s.x[0], bank.x[i, 0, 1] - s.x[1]) > FARTHEST_M:
            continue
        square, score = separation(bank, i, motion, s)
        if square > rules.link_gate:
            continue
        if score < first:
            best, first, second = i, score, first
        elif score < second:
            second = score
    heard.pending[u] = 0
    if best < 0:
        heard.waits[u] = 0
        return
    if second - first >= rules.lead or heard.waits[u] >= rules.waits:
        link(bank, heard, u, best, rules, events, event_count)
        return
    heard.waits[u] += 1
    heard.pending[u] = 1


@jit_uncounted
def find_rivals(
    bank: Bank, filters: Bank, heard: Heard, u: int, rules: ReportRules, motion: Motion, s: Scratch
) -> None:
    """Mark in `s.near` the tracks that may be the aircraft `u`: its own, and those not far from its reports."""
    dt = bank.t[0] - heard.t[u]
    witness(filters, u, dt, motion, s)
    for i in range(bank.size[0]):
        s.near[i] = 0
        if bank.status[i] != CONFIRMED or place_of_rival(heard, u, bank.identity[i]) >= 0:
            continue
        if math.hypot(bank.x[i, 0, 0] - s.x[0], bank.x[i, 0, 1] - s.x[1]) > FARTHEST_M:
            continue
        square, _ = separation(bank, i, motion, s)
        if bank.address[i] == u or square <= rules.split_gate:
            s.near[i] = 1


@jit_uncounted
def find_identities(
    bank: Bank,
    filters: Bank,
    heard: Heard,
    rules: ReportRules,
    motion: Motion,
    events: IntArray,
    event_count: IntArray,
    s: Scratch,
) -> None:
    """Look whether tracks that a radar has just confirmed are aircraft whose reports go on by themselves."""
    find_slots(bank, heard)
    for u in range(heard.alive.shape[0]):
        if heard.alive[u] == 1 and heard.slot[u] < 0 and heard.waits[u] == 0:
            find_identity(bank, filters, heard, u, True, rules, motion, events, event_count, s)


@jit_uncounted
def take_reports(
    bank: Bank,
    filters: Bank,
    heard: Heard,
    rows: IntArray,
    times: FloatArray,
    z: FloatArray,
    r: FloatArray,
    time_sigma: FloatArray,
    bias: FloatArray,
    sensor: int,
    rules: ReportRules,
    motion: Motion,
    users: IntArray,
    outcome: IntArray,
    counts: IntArray,
    events: IntArray,
    event_count: IntArray,
    s: Scratch,
    rs: ReportScratch,
) -> None:
    """Take in reports in the order given: filters, radar tracks with these addresses, and identities.

    Parameters
    ----------
    bank : Bank
        The radars' tracks.
    filters : Bank
    heard : Heard
    rows : ndarray of int64, shape (k,)
        Place of each report's address.
    times : ndarray, shape (k,)
        Of validity, s.
    z, r : ndarray, shape (k, 6)
    time_sigma : ndarray, shape (k,)
    bias : ndarray, shape (k, BIASES)
        Variances of the biases, as the aircraft's categories say.
    sensor : int
    rules : ReportRules
    motion : Motion
    users, outcome : ndarray of int64, shape (k,)
        Written: the place of the aircraft that each report is of, and the codes of `hearing_kernels`.
    counts : ndarray of int64, shape (REPORT_COUNTS,)
    events : ndarray of int64, shape (n, 4)
    event_count : ndarray of int64, shape (1,)
    s, rs
        Scratch.
    """
    find_slots(bank, heard)
    for q in range(len(rows)):
        if heard.slot[rows[q]] >= 0 and times[q] - bank.t[0] > STEP_S:
            predict_tracks(bank, times[q], motion, s.motion)
    for q in range(len(rows)):
        t = times[q]
        rescale(bank, filters, heard, rows[q], bias[q])
        u, code = take_report(
            filters, heard, rows[q], t, z[q], r[q], time_sigma[q], rules, motion, counts, s.motion, rs
        )
        users[q], outcome[q] = u, code
        counts[code] += 1
        if code == STARTED:
            heard.number[u] = new_number(bank)
        if heard.alive[u] == 0:
            continue
        heard.fed[u] |= 1 << min(sensor, 62)
        i = heard.slot[u]
        if code == AGAIN and i < 0 and heard.reports[u] == 1:
            old = heard.number[u]
            heard.number[u] = new_number(bank)
            note(events, event_count, MOVED, old, u, heard.number[u])
        fits = True
        if i >= 0 and code in (USED, NO_POSITION, AGAIN) and abs(bank.t[0] - t) <= APART_S:
            fits = support(bank, heard, u, i, t, z[q], r[q], time_sigma[q], rules, rs)
            if not fits:
                counts[TRACK_OUTSIDE] += 1
        if code in (USED, NO_POSITION) and bank.size[0] > 0 and abs(bank.t[0] - t) <= APART_S:
            find_rivals(bank, filters, heard, u, rules, motion, s)
            weigh_rivals(bank, heard, u, s.near, t, z[q], r[q], time_sigma[q], rules.latency, motion, s)
        if code in (USED, AGAIN):
            find_identity(bank, filters, heard, u, fits, rules, motion, events, event_count, s)
            if heard.status[u] != CONFIRMED and heard.reports[u] >= rules.confirm and heard.pending[u] == 0:
                heard.status[u] = CONFIRMED
                note(events, event_count, HEARD_NOW, heard.number[u], u, -1)


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = ReportRules(25.0, 0.3, 1.0, 1e4, 60.0, 350.0, 1.5, 1, 22.5, 35.0, 9.0, 8, 3, 60.0, 15.0, 0.999)
    bank, filters, heard, s = make_bank(1), make_bank(1), make_heard(1), make_scratch(1, 1, 2)
    counts, events, count = np.zeros(REPORT_COUNTS, np.int64), np.zeros((4, 4), np.int64), np.zeros(1, np.int64)
    z, zero, t = np.ones((1, 6)), np.zeros(1, np.int64), np.zeros(1)
    rs = make_report_scratch()
    take_reports(
        bank,
        filters,
        heard,
        zero,
        t,
        z,
        z,
        t,
        np.ones((1, BIASES)),
        0,
        rules,
        motion,
        zero.copy(),
        zero.copy(),
        counts,
        events,
        count,
        s,
        rs,
    )
    find_identities(bank, filters, heard, rules, motion, events, count, s)
