"""Which of several radar tracks makes an aircraft's reports: evidence report by report, against nobody as well.

While two aircraft fly closer to each other than their errors, one look cannot tell whose reports they are; once they
part, the reports go with one of them. Each pair of an address and a radar's track that may be its aircraft therefore
keeps how likely that track has made the reports one after the other: a report less the track is an offset that hardly
changes (the biases of the reports), known better with each report, and the white errors of both. The offset keeps
a constant bias from being counted again and again. Its likelihood is compared with that of the other tracks.

Whether it is none of them, but an aircraft that no radar sees, is told by how far the reports are off the track and off
the filter that only they feed, each in terms of what it expects: chi-squares, and not likelihoods, as a track that has
just begun knows less than that filter and is not denied by that. A track that turns is not denied either: the radar
follows it, and the reports alone would be late.

Sequential test of several hypotheses; Wald (1947), Sequential Analysis; Bar-Shalom, Li and Kirubarajan (2001), 1.4.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, Bank, Motion, combined, make_bank
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.consider_kernels import LATENCY, POSITION_TIME_S
from wideberth.tracking.multi_target.heard_kernels import RIVALS, Heard, make_heard
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.report_kernels import CAPPED_SQUARE

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FADE_S = 10.0
"""Evidence older than about this is forgotten: model errors must not add up for minutes."""

MOST_BEHIND = 60.0
"""No rival falls further behind than this (twice the log-likelihood), so that it can come back within a few reports."""

SLACK = 3.0
"""A track may fit a report by this much worse (chi-square) than the reports' own filter and is not denied by it."""

LARGEST_STEP = 15.0
"""One report does not change what is between two rivals by more than this."""


@jit_uncounted
def place_of_rival(heard: Heard, u: int, number: int) -> int:
    """Return where the track of that number stands among the rivals of `u`, -1 where it does not."""
    for k in range(RIVALS):
        if heard.rival[u, k] == number:
            return k
    return -1


@jit_uncounted
def score_of(heard: Heard, u: int, number: int) -> float:
    """Return how far a track is behind the best for the reports of `u` (twice the log-likelihood); 0 where unknown."""
    k = place_of_rival(heard, u, number)
    if k < 0:
        return 0.0
    value: float = heard.score[u, k]
    return value


@jit_uncounted
def is_denied(heard: Heard, u: int, number: int, limit: float) -> bool:
    """Return whether the reports of `u` are better explained by nobody's track than by the one of that number."""
    k = place_of_rival(heard, u, number)
    return k >= 0 and heard.denied[u, k] > limit


@jit_uncounted
def renumber_rivals(heard: Heard, old: int, new: int) -> None:
    """Note that the number of a track has changed."""
    for u in range(heard.alive.shape[0]):
        k = place_of_rival(heard, u, old)
        if k >= 0:
            heard.rival[u, k] = new


@jit_uncounted
def enter(heard: Heard, u: int, number: int) -> int:
    """Return a place for one more rival, level with the best; -1 where all are taken by rivals that are not far behind.

    Of a new rival the offset's variance is infinite, until it is weighed.
    """
    free = place_of_rival(heard, u, -1)
    if free < 0:
        free = 0
        for k in range(1, RIVALS):
            if heard.score[u, k] > heard.score[u, free]:
                free = k
        if heard.score[u, free] < 0.5 * MOST_BEHIND:
            return -1
    heard.rival[u, free], heard.score[u, free], heard.denied[u, free] = number, 0.0, 0.0
    for axis in range(3):
        heard.offset[u, free, 0, axis], heard.offset[u, free, 1, axis] = 0.0, math.inf
    return free


@jit_uncounted
def weigh_rival(
    heard: Heard,
    u: int,
    k: int,
    age: float,
    dt: float,
    x: FloatArray,
    p: FloatArray,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
) -> tuple[float, float]:
    """Weigh a report under rival `k`, and take it into its offset.

    Parameters
    ----------
    heard : Heard
    u, k : int
    age : float
        Time of the track minus time of the report, plus the latency expected, s.
    dt : float
        Since the last report, s.
    x : ndarray, shape (9,)
        The track's.
    p : ndarray, shape (9, 9)
    z, r : ndarray, shape (6,)
        The report and its white variances; NaN where it tells nothing.
    time_sigma : float
        Of the time stamp, s.

    Returns
    -------
    square : float
        Chi-square of all elements, each no more than `CAPPED_SQUARE`.
    spread : float
        Logarithm of the product of their variances: with it, twice the negative log-likelihood less a constant.
    """
    square, spread = 0.0, 0.0
    for axis in range(3):
        speed = x[3 + axis] - age * x[6 + axis]
        mean, variance, before = heard.offset[u, k, 0], heard.offset[u, k, 1], heard.offset[u, k, 2]
        bias = heard.bias[u]
        late = bias[LATENCY] * speed * speed
        first = math.isinf(variance[axis])
        if first:
            variance[axis] = bias[axis] + late
        else:
            changed = speed - before[axis]
            variance[axis] += bias[LATENCY] * changed * changed
            if axis < 2:
                variance[axis] += 2.0 * bias[axis] * abs(dt) / POSITION_TIME_S
            variance[axis] = min(variance[axis], bias[axis] + late)
        before[axis] = speed
        if math.isfinite(z[axis]):
            v = p[axis, axis] - 2.0 * age * p[axis, 3 + axis] + age * age * p[3 + axis, 3 + axis]
            v += r[axis] + time_sigma * time_sigma * speed * speed + variance[axis]
            e = z[axis] - (x[axis] - age * x[3 + axis] + 0.5 * age * age * x[6 + axis]) - mean[axis]
            # That the biases may be anything at first speaks against no track: their spread is the same for all.
            square += min(e * e / v, CAPPED_SQUARE)
            spread += math.log(v - variance[axis] if first else v)
            mean[axis] += variance[axis] / v * e
            variance[axis] -= variance[axis] * variance[axis] / v
        if math.isfinite(z[3 + axis]):
            v = p[3 + axis, 3 + axis] + age * age * p[6 + axis, 6 + axis] + r[3 + axis]
            e = z[3 + axis] - speed
            square += min(e * e / v, CAPPED_SQUARE)
            spread += math.log(v)
    return square, spread


@jit_uncounted
def settle_scores(heard: Heard, u: int, told: FloatArray, dt: float) -> None:
    """Add a report's scores (RIVALS) to those so far, faded, and put the best at zero; NaN: not weighed."""
    fade = math.exp(-abs(dt) / FADE_S)
    least = math.inf
    for k in range(RIVALS):
        if told[k] == told[k]:
            least = min(least, told[k])
    best = math.inf
    for k in range(RIVALS):
        if told[k] == told[k]:
            heard.score[u, k] = fade * heard.score[u, k] + min(told[k] - least, LARGEST_STEP)
            best = min(best, heard.score[u, k])
    for k in range(RIVALS):
        heard.score[u, k] = min(max(heard.score[u, k] - best, 0.0), MOST_BEHIND)


@jit_uncounted
def weigh_rivals(
    bank: Bank,
    heard: Heard,
    u: int,
    near: IntArray,
    t: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    latency: float,
    motion: Motion,
    s: Scratch,
) -> None:
    """Weigh one report of `u` among its rivals and the tracks that are new among them.

    Parameters
    ----------
    bank : Bank
        The radars' tracks.
    heard : Heard
        With `surprise` of this report.
    u : int
    near : ndarray of int64, shape (N,)
        Whether each track of the bank may be a rival that is not one yet.
    t : float
        Of the report, s.
    z, r : ndarray, shape (6,)
    time_sigma, latency : float
        s.
    motion : Motion
    s : Scratch
    """
    dt = t - heard.weighed[u] if heard.weighed[u] > -math.inf else 0.0
    heard.weighed[u] = t
    told, found, fade = s.told, 0, math.exp(-abs(dt) / FADE_S)
    for k in range(RIVALS):
        told[k] = math.nan
    age = bank.t[0] - t + latency
    for i in range(bank.size[0]):
        if bank.status[i] != CONFIRMED:
            continue
        k = place_of_rival(heard, u, bank.identity[i])
        if k < 0 and near[i] == 1:
            k = enter(heard, u, bank.identity[i])
        if k < 0:
            continue
        combined(bank, i, motion, s.x2, s.p2, s.motion)
        square, spread = weigh_rival(heard, u, k, age, dt, s.x2, s.p2, z, r, time_sigma)
        told[k] = square + spread
        found += 1
        step = min(max(square - heard.surprise[u] - SLACK, -LARGEST_STEP), LARGEST_STEP)
        heard.denied[u, k] = min(max(fade * heard.denied[u, k] + step, 0.0), MOST_BEHIND)
    for k in range(RIVALS):
        if told[k] != told[k]:
            heard.rival[u, k], heard.score[u, k] = -1, 0.0
    if found > 0:
        settle_scores(heard, u, told, dt)


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    heard, s, six, near = make_heard(1), make_scratch(1, 1, 2), np.ones(6), np.zeros(1, np.int64)
    enter(heard, 0, 1)
    score_of(heard, 0, 1)
    is_denied(heard, 0, 1, 1.0)
    weigh_rival(heard, 0, 0, 0.3, 1.0, np.ones(9), np.eye(9), six, six, 0.1)
    settle_scores(heard, 0, np.ones(RIVALS), 1.0)
    weigh_rivals(make_bank(1), heard, 0, near, 0.0, six, six, 0.1, 0.3, motion, s)
    renumber_rivals(heard, 1, 2)
