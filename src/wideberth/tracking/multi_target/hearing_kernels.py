"""What one ADS-B report makes of the filter of its address, and of the radar's track that is the same aircraft."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.delay_kernels import delay_on_path
from wideberth.tracking.multi_target.bank_kernels import (
    Bank,
    Motion,
    MotionScratch,
    make_bank,
    make_motion_scratch,
)
from wideberth.tracking.multi_target.consider_kernels import BIASES
from wideberth.tracking.multi_target.heard_kernels import (
    MEMORY_S,
    REJECTS,
    RIVALS,
    Heard,
    ReportRules,
    advance,
    make_heard,
    remember,
    start,
)
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.report_kernels import (
    ACCEPTED,
    ALTITUDE,
    CLIMB,
    POSITION,
    REJECTED,
    VELOCITY,
    ReportScratch,
    absorb_report,
    distance_square,
    judge,
    known,
    make_report_scratch,
    start_axis,
    surprise,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REJECT_MEMORY_S = 10.0
VERTICAL_REJECTS = 5

SUPPORT = 0.9
"""A radar's track that a report fits exists at least with this probability."""

(USED, NO_POSITION, NOT_NEW, NO_PLACE, NO_HEIGHT, OUTSIDE, SECOND_USER, SHARED, STARTED, AGAIN, LATE) = range(11)
"""What became of a report; `SECOND_USER`: a place must be made for the other aircraft with this address; `LATE`: told
seconds after it was true, without saying so."""

(ALTITUDE_OUTSIDE, CLIMB_OUTSIDE, VELOCITY_OUTSIDE, TRACK_OUTSIDE, ALTITUDE_AGAIN) = range(11, 16)
REPORT_COUNTS = 16


@jit_uncounted
def agreeing(heard: Heard, u: int, t: float, z: FloatArray, speed_max: float, margin: float) -> bool:
    """Note a position outside the gate; return whether the last `REJECTS` lie on one path that can be flown."""
    kept = heard.rejected[u]
    if heard.rejects[u] > 0 and t - kept[REJECTS - 1, 0] > REJECT_MEMORY_S:
        heard.rejects[u] = 0
    for k in range(REJECTS - 1):
        for a in range(3):
            kept[k, a] = kept[k + 1, a]
    kept[REJECTS - 1, 0], kept[REJECTS - 1, 1], kept[REJECTS - 1, 2] = t, z[0], z[1]
    heard.rejects[u] += 1
    if heard.rejects[u] < REJECTS:
        return False
    first, last = kept[0], kept[REJECTS - 1]
    span = last[0] - first[0]
    if span <= 0.0:
        return False
    if math.hypot(last[1] - first[1], last[2] - first[2]) > speed_max * span + margin:
        return False
    for k in range(1, REJECTS - 1):
        part = (kept[k, 0] - first[0]) / span
        north, east = first[1] + part * (last[1] - first[1]), first[2] + part * (last[2] - first[2])
        if math.hypot(kept[k, 1] - north, kept[k, 2] - east) > margin + 5.0 * span * span:
            return False
    return True


@jit_uncounted
def delay_of_rejected(filters: Bank, heard: Heard, u: int, t: float, margin: float) -> float:
    """Return how late (s) the last positions outside the gate of `u` are, NaN where they are another aircraft's.

    The parameters are those of `delay_on_path` and `take_report`.
    """
    first, last = heard.rejected[u, 0], heard.rejected[u, REJECTS - 1]
    span = last[0] - first[0]
    v_north, v_east = (last[1] - first[1]) / span, (last[2] - first[2]) / span
    if t - heard.velocity[u, 0] <= MEMORY_S:
        v_north, v_east = heard.velocity[u, 1], heard.velocity[u, 2]
    x, age = filters.x[u, np.argmax(filters.mu[u])], t - heard.t[u]
    north, east = last[1] - x[0] - age * x[3], last[2] - x[1] - age * x[4]
    return delay_on_path(north, east, v_north, v_east, x[3:5], margin)


@jit_uncounted
def start_again(
    filters: Bank,
    heard: Heard,
    source: int,
    u: int,
    t: float,
    z: FloatArray,
    r: FloatArray,
    rules: ReportRules,
    motion: Motion,
) -> None:
    """Start the filter of `u` from the positions outside the gate of `source`: their velocity, not the one told."""
    first = heard.rejected[source, 0]
    span = t - first[0]
    heard.velocity[u, 0] = t
    heard.velocity[u, 1], heard.velocity[u, 2] = (z[0] - first[1]) / span, (z[1] - first[2]) / span
    heard.velocity[u, 3] = z[5]
    if not known(z, ALTITUDE) and u != source:
        heard.altitude[u, 0], heard.altitude[u, 1] = heard.altitude[source, 0], heard.altitude[source, 1]
    start(filters, heard, u, t, z, r, rules, motion)
    heard.rejects[source] = 0


@jit_uncounted
def settle_report(
    filters: Bank,
    heard: Heard,
    u: int,
    t: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    rules: ReportRules,
    motion: Motion,
    counts: IntArray,
    m: MotionScratch,
    s: ReportScratch,
) -> int:
    """Use one report for the filter of `u`; return what became of it."""
    advance(filters, heard, u, t, motion, m)
    age = heard.t[u] - t + rules.latency
    bias = heard.bias[u]
    judge(filters, u, age, z, r, time_sigma, bias, rules.gate, s)
    if s.codes[POSITION] == REJECTED:
        return OUTSIDE
    heard.surprise[u] = surprise(filters, u, age, z, r, time_sigma, bias, s)
    absorb_report(filters, u, age, z, r, time_sigma, bias, s)
    if s.codes[CLIMB] == REJECTED:
        counts[CLIMB_OUTSIDE] += 1
    if s.codes[VELOCITY] == REJECTED:
        counts[VELOCITY_OUTSIDE] += 1
    if s.codes[ALTITUDE] == ACCEPTED:
        heard.vertical_rejects[u] = 0
    elif s.codes[ALTITUDE] == REJECTED:
        counts[ALTITUDE_OUTSIDE] += 1
        heard.vertical_rejects[u] += 1
        if heard.vertical_rejects[u] >= VERTICAL_REJECTS:
            counts[ALTITUDE_AGAIN] += 1
            heard.vertical_rejects[u] = 0
            climb = z[5] if known(z, CLIMB) else 0.0
            variance = r[5] + rules.velocity_variance if known(z, CLIMB) else rules.climb_variance
            start_axis(filters, u, 2, z[2], r[2], climb, variance, rules.latency, bias, motion)
    if s.codes[POSITION] != ACCEPTED:
        return NO_POSITION
    heard.reports[u] += 1
    heard.heard[u] = max(heard.heard[u], t)
    return USED


@jit_uncounted
def take_report(
    filters: Bank,
    heard: Heard,
    row: int,
    t: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    rules: ReportRules,
    motion: Motion,
    counts: IntArray,
    m: MotionScratch,
    s: ReportScratch,
) -> tuple[int, int]:
    """Use one report of an address for whom of its users it fits.

    Parameters
    ----------
    filters : Bank
        The filters, by the places of their users.
    heard : Heard
    row : int
        Place of the address's first user.
    t : float
        Time of validity, s.
    z, r : ndarray, shape (6,)
        As in a Scan of kind "adsb", and the variances.
    time_sigma : float
        Of the time stamp, s.
    rules : ReportRules
    motion : Motion
    counts : ndarray of int64, shape (REPORT_COUNTS,)
    m, s
        Scratch.

    Returns
    -------
    user, outcome : int
        Whose it was, and what became of it.
    """
    other = heard.other[row]
    positioned = known(z, POSITION)
    if positioned:
        # Sent again, or heard by two receivers; an aircraft that hovers sends the same place in earnest.
        repeated = z[0] == heard.place[row, 0] and z[1] == heard.place[row, 1]
        hovers = known(z, VELOCITY) and math.hypot(z[3], z[4]) < rules.hover_speed
        if repeated and (not hovers or t == heard.heard[row]):
            return row, NOT_NEW
        heard.place[row, 0], heard.place[row, 1] = z[0], z[1]
    elif other >= 0 and heard.alive[other] == 1:
        return row, SHARED
    u = row
    if positioned and other >= 0 and heard.alive[other] == 1:
        if heard.alive[row] == 0:
            u = other
        else:
            advance(filters, heard, row, t, motion, m)
            advance(filters, heard, other, t, motion, m)
            d0 = distance_square(
                filters, row, 0, True, heard.t[row] - t + rules.latency, z, r, time_sigma, heard.bias[row], s
            )
            d1 = distance_square(
                filters, other, 0, True, heard.t[other] - t + rules.latency, z, r, time_sigma, heard.bias[other], s
            )
            u = other if d1 < d0 else row
    remember(heard, u, t, z)
    if heard.alive[u] == 0:
        if not positioned:
            return u, NO_PLACE
        if not known(z, ALTITUDE) and t - heard.altitude[u, 0] > MEMORY_S:
            return u, NO_HEIGHT
        start(filters, heard, u, t, z, r, rules, motion)
        return u, STARTED
    outcome = settle_report(filters, heard, u, t, z, r, time_sigma, rules, motion, counts, m, s)
    if outcome != OUTSIDE:
        return u, outcome
    margin = 100.0 + 5.0 * math.sqrt(r[0])
    if not agreeing(heard, u, t, z, rules.speed_max, margin):
        return u, OUTSIDE
    if u == row and heard.heard[u] > heard.rejected[u, 0, 0]:
        # The other place and this one are heard in turn: some reports come late, or two aircraft have one address.
        delay = delay_of_rejected(filters, heard, u, t, margin)
        if delay >= 0.0:
            heard.rejects[u] = REJECTS - 1
            return u, LATE
        if delay < 0.0:
            start_again(filters, heard, u, u, t, z, r, rules, motion)
            return u, AGAIN
        if other < 0:
            heard.rejects[u] = REJECTS - 1
            return u, SECOND_USER
        if heard.alive[other] == 0:
            start_again(filters, heard, u, other, t, z, r, rules, motion)
            return other, STARTED
    start_again(filters, heard, u, u, t, z, r, rules, motion)
    return u, AGAIN


@jit_uncounted
def support(
    bank: Bank,
    heard: Heard,
    u: int,
    i: int,
    t: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    rules: ReportRules,
    s: ReportScratch,
) -> bool:
    """Update the radar's track in slot `i` of the bank with a report of its aircraft `u`; return whether it fits."""
    age = bank.t[0] - t + rules.latency
    judge(bank, i, age, z, r, time_sigma, heard.bias[u], rules.gate, s)
    if s.codes[POSITION] == REJECTED:
        return False
    absorb_report(bank, i, age, z, r, time_sigma, heard.bias[u], s)
    if s.codes[POSITION] == ACCEPTED:
        bank.existence[i] = max(bank.existence[i], SUPPORT)
    return True


@jit_uncounted
def scale_column(cross: FloatArray, b: int, factor: float) -> None:
    """Scale the covariances (HYPOTHESES, 9, BIASES) with one bias."""
    for j in range(HYPOTHESES):
        for a in range(9):
            cross[j, a, b] *= factor


@jit_uncounted
def rescale(bank: Bank, filters: Bank, heard: Heard, row: int, bias: FloatArray) -> None:
    """Note the variances (BIASES,) of an address's biases where the aircraft says another accuracy than before.

    A larger bias is the old one and more. Of a smaller one the rest has become an error of the state, which knows it.
    """
    for b in range(BIASES):
        before = heard.bias[row, b]
        if bias[b] == before:
            continue
        u = row
        for _ in range(2):
            if u < 0:
                break
            heard.bias[u, b] = bias[b]
            for k in range(RIVALS):
                if b < 3:
                    heard.offset[u, k, 1, b] += max(bias[b] - before, 0.0)
            if bias[b] < before:
                scale_column(filters.cross[u], b, bias[b] / before)
                if heard.slot[u] >= 0:
                    scale_column(bank.cross[heard.slot[u]], b, bias[b] / before)
            u = heard.other[row]


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = ReportRules(25.0, 0.3, 1.0, 1e4, 60.0, 350.0, 1.5, 3, 22.5, 35.0, 9.0, 8, 3, 60.0, 15.0, 0.999)
    filters, heard, m, s = make_bank(2), make_heard(2), make_motion_scratch(), make_report_scratch()
    counts, z = np.zeros(REPORT_COUNTS, np.int64), np.ones(6)
    for k in range(2):
        take_report(filters, heard, 0, float(k), z + k, np.ones(6), 0.1, rules, motion, counts, m, s)
    delay_of_rejected(filters, heard, 0, 0.0, 1.0)
    rescale(make_bank(1), filters, heard, 0, z[:4])
    support(make_bank(1), heard, 0, 0, 0.0, z, z, 0.1, rules, s)
