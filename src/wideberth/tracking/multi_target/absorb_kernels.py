"""What plots make of tracks: gates, likelihoods, association, and the update by all that may be a track's."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.association_kernels import (
    event_count,
    find_clusters,
    joint_probabilities,
    shared_probabilities,
)
from wideberth.tracking.multi_target.bank_kernels import Bank, make_bank
from wideberth.tracking.multi_target.buffers_kernels import CANDIDATES, COUNTS, LARGE_CLUSTERS, Scratch, make_scratch
from wideberth.tracking.multi_target.consider_kernels import BIASES, carry_cross
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT
from wideberth.tracking.multi_target.intake_kernels import azimuth_on_cone, first_above
from wideberth.tracking.multi_target.sighting_kernels import (
    element_variances,
    innovation,
    line_of_sight,
    log_density,
    projected,
    sight_rows,
)
from wideberth.tracking.multi_target.window_kernels import Window, make_window
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_SEEN = 0.02
"""A plot may still be that of a track which is thought to be just outside the field of view."""

LEAST_PROBABILITY = 1e-6
"""No hypothesis of motion dies out for good."""

MOST_SHARED = 1e100
"""No plot is likelier as two aircraft at once than this, against a false one."""

ALL = 0.9999
"""A mixture in which one event has this share is that event."""


@jit_uncounted
def gate_plots(bank: Bank, i: int, window: Window, n: int, gate: float, cone: bool, s: Scratch) -> None:
    """Fill the candidates of track `i`: plots in its gate under either hypothesis, with what they would make of it.

    `s.look`, `s.frame` and `s.spread` must hold how the scan's sensor sees the track; `cone` is that of `take_in`.
    """
    k = window.cursor[0]
    s.counts[i] = 0
    if n == 0:
        return
    sensor, velocity = window.position[k], window.velocity[k]
    widest = 0.0
    for m in range(HYPOTHESES):
        for a in range(3):
            for b in range(3):
                s.f[a, b] = bank.p[i, m, a, b]
        widest = max(widest, projected(s.frame, s.f, 0))
    reach = math.sqrt(gate)
    half = reach * math.sqrt(max(widest, s.spread[0])) + (s.spread[1] + s.spread[2]) / s.look[0]
    # Range noise may differ from plot to plot: the widest of the scan's bounds the search.
    noise = 0.0
    for q in range(n):
        noise = max(noise, s.variance[s.order[q], 0])
    half += reach * math.sqrt(noise)
    q = first_above(s.key, s.order, n, s.look[0] - half)
    count = 0
    while q < n and s.key[s.order[q]] <= s.look[0] + half:
        m = s.order[q]
        q += 1
        if math.isnan(s.z[m, 2]):
            azimuth = azimuth_on_cone(s.z[m, 1], s.look[2]) if cone else s.z[m, 1]
            line_of_sight(window.attitude[k], azimuth, s.look[2], s.sight[m])
        element_variances(s.look, s.spread[1], s.spread[2], s.variance[m], s.r)
        least = math.inf
        for j in range(HYPOTHESES):
            innovation(
                sensor, velocity, s.frame, s.look, s.spread[1], s.spread[2], bank.x[i, j], s.z[m], s.sight[m], s.e
            )
            square = 0.0
            for a in range(3):
                if s.e[a] == s.e[a]:
                    square += s.e[a] * s.e[a] / (s.r[a] + s.spread[a])
            least = min(least, square)
        if least > 2.0 * gate:
            continue
        if count < CANDIDATES:
            place_of = count
            count += 1
        else:
            place_of = 0
            for c in range(1, CANDIDATES):
                if s.square[i, c] > s.square[i, place_of]:
                    place_of = c
            if least >= s.square[i, place_of]:
                continue
        s.square[i, place_of], s.plots[i, place_of] = least, m
    kept = 0
    for c in range(count):
        m = s.plots[i, c]
        if math.isnan(s.z[m, 2]):
            azimuth = azimuth_on_cone(s.z[m, 1], s.look[2]) if cone else s.z[m, 1]
            line_of_sight(window.attitude[k], azimuth, s.look[2], s.sight[m])
        element_variances(s.look, s.spread[1], s.spread[2], s.variance[m], s.r)
        rate = s.z[m, 3] == s.z[m, 3]
        least = math.inf
        for j in range(HYPOTHESES):
            states = 6 if j == STRAIGHT else 9
            x, p = s.cx[i, kept, j], s.cp[i, kept, j]
            for a in range(states):
                x[a] = bank.x[i, j, a]
                for b in range(states):
                    p[a, b] = bank.p[i, j, a, b]
            innovation(sensor, velocity, s.frame, s.look, s.spread[1], s.spread[2], x, s.z[m], s.sight[m], s.e)
            h = s.h0 if j == STRAIGHT else s.h1
            sight_rows(sensor, velocity, s.frame, x, rate, h)
            nis, log_likelihood = update(states, 4 if rate else 3, x, p, h, s.e, s.r, s.work)
            least = min(least, nis)
            s.nis[i, kept, j] = nis
            s.likelihood[i, kept, j] = log_likelihood
        if least <= gate:
            s.plots[i, kept] = m
            kept += 1
    s.counts[i] = kept


@jit_uncounted
def weigh(bank: Bank, i: int, window: Window, speed_max: float, s: Scratch) -> None:
    """Turn the candidates' log-likelihoods into shares of the hypotheses and ratios against false plots."""
    k = window.cursor[0]
    seen = max(s.seen[i], LEAST_SEEN)
    for c in range(s.counts[i]):
        top, total = -math.inf, 0.0
        for j in range(HYPOTHESES):
            top = max(top, s.likelihood[i, c, j])
        for j in range(HYPOTHESES):
            s.likelihood[i, c, j] = bank.mu[i, j] * math.exp(s.likelihood[i, c, j] - top)
            total += s.likelihood[i, c, j]
        m = s.plots[i, c]
        false = log_density(window.density[k], s.look, window.field_of_view[k], speed_max, s.z[m])
        s.ratio[i, c] = bank.existence[i] * seen * total * math.exp(min(top - false, 300.0))
        for j in range(HYPOTHESES):
            s.likelihood[i, c, j] /= total
    s.missed[i] = bank.existence[i] * (1.0 - s.seen[i])
    s.none[i] = max(1.0 - bank.existence[i] * s.seen[i], 1e-9)


@jit_uncounted
def allow_shared(bank: Bank, i: int, unresolved: float, shared: float, s: Scratch) -> None:
    """Let a track exist without a plot of its own, as one plot may be its and another's; after `weigh`.

    Parameters
    ----------
    bank : Bank
    i : int
    unresolved : float
        Probability that the sensor would not tell it from that other track.
    shared : float
        How much likelier that plot is as both than as a false one.
    s : Scratch
    """
    for c in range(s.counts[i]):
        s.ratio[i, c] *= 1.0 - unresolved
    s.missed[i] += bank.existence[i] * s.seen[i] * unresolved * min(shared, MOST_SHARED)
    s.none[i] = max(1.0 - bank.existence[i] + s.missed[i], 1e-9)


@jit_uncounted
def keep_nis(bank: Bank, i: int, s: Scratch) -> None:
    """Keep the normalised innovation squared of a track's likeliest plot, and how many elements that has.

    Over the hypotheses of motion it is the mean by how likely each makes the plot; to be called after `absorb`.
    """
    best = 0
    for c in range(1, s.counts[i]):
        if s.beta[i, c + 1] > s.beta[i, best + 1]:
            best = c
    m = s.plots[i, best]
    bank.nis[i], bank.nis_dof[i] = 0.0, 2.0
    for j in range(HYPOTHESES):
        bank.nis[i] += s.likelihood[i, best, j] * s.nis[i, best, j]
    for a in range(2, 4):
        if s.z[m, a] == s.z[m, a]:
            bank.nis_dof[i] += 1.0


@jit_uncounted
def absorb_cross(bank: Bank, i: int, s: Scratch) -> None:
    """Update a track's covariance with the biases of its ADS-B reports by its plots; to be called before `absorb`."""
    count = s.counts[i]
    missed = s.beta[i, 0] * s.missed[i] / s.none[i]
    for j in range(HYPOTHESES):
        states = 6 if j == STRAIGHT else 9
        weight = missed * bank.mu[i, j]
        whole = weight
        for c in range(count):
            whole += s.beta[i, c + 1] * s.likelihood[i, c, j]
        if whole <= 1e-300 or weight > ALL * whole:
            continue
        for a in range(states):
            for b in range(states):
                s.p2[a, b] = weight / whole * bank.p[i, j, a, b]
                for c in range(count):
                    s.p2[a, b] += s.beta[i, c + 1] * s.likelihood[i, c, j] / whole * s.cp[i, c, j, a, b]
        if not carry_cross(states, bank.p[i, j], bank.cross[i, j], s.p2, s.f, s.x2):
            for a in range(states):
                for b in range(BIASES):
                    bank.cross[i, j, a, b] = 0.0


@jit_uncounted
def absorb(bank: Bank, i: int, existence_max: float, s: Scratch) -> float:
    """Update a track with its association probabilities; return the probability that a plot was its own.

    Given that it exists, each hypothesis is a mixture of "no plot" and of each candidate, matched by its mean and
    covariance.
    """
    none, count = s.none[i], s.counts[i]
    missed = s.beta[i, 0] * s.missed[i] / none
    total = missed
    for c in range(count):
        total += s.beta[i, c + 1]
    if total <= 0.0:
        bank.existence[i] = 0.0
        return 0.0
    own: float = (total - missed) / total
    bank.existence[i] = min(total, existence_max)
    for j in range(HYPOTHESES):
        states = 6 if j == STRAIGHT else 9
        weight = missed / total * bank.mu[i, j]
        whole = weight
        for c in range(count):
            whole += s.beta[i, c + 1] / total * s.likelihood[i, c, j]
        bank.mu[i, j] = whole
        if whole <= 1e-300:
            continue
        x, p = bank.x[i, j], bank.p[i, j]
        # Nearly always one event has all the weight.
        single = -1
        for c in range(count):
            if s.beta[i, c + 1] / total * s.likelihood[i, c, j] > ALL * whole:
                single = c
        if single >= 0:
            for a in range(states):
                x[a] = s.cx[i, single, j, a]
                for b in range(states):
                    p[a, b] = s.cp[i, single, j, a, b]
            continue
        if weight > ALL * whole:
            continue
        share = weight / whole
        mean = s.x
        for a in range(states):
            mean[a] = share * x[a]
            for c in range(count):
                mean[a] += s.beta[i, c + 1] / total * s.likelihood[i, c, j] / whole * s.cx[i, c, j, a]
        for a in range(states):
            for b in range(a + 1):
                value = share * (p[a, b] + (x[a] - mean[a]) * (x[b] - mean[b]))
                for c in range(count):
                    w = s.beta[i, c + 1] / total * s.likelihood[i, c, j] / whole
                    da, db = s.cx[i, c, j, a] - mean[a], s.cx[i, c, j, b] - mean[b]
                    value += w * (s.cp[i, c, j, a, b] + da * db)
                p[a, b] = value
        for a in range(states):
            x[a] = mean[a]
            for b in range(a):
                p[b, a] = p[a, b]
    whole = 0.0
    for j in range(HYPOTHESES):
        bank.mu[i, j] = max(bank.mu[i, j], LEAST_PROBABILITY)
        whole += bank.mu[i, j]
    for j in range(HYPOTHESES):
        bank.mu[i, j] /= whole
    return own


@jit_uncounted
def associate(size: int, event_limit: int, counts: IntArray, s: Scratch) -> int:
    """Write the association probabilities of all tracks; return the number of clusters."""
    clusters = find_clusters(size, s.counts, s.plots, s.owner, s.parent, s.members, s.first)
    for q in range(clusters):
        begin, end = s.first[q], s.first[q + 1]
        if event_count(s.members, begin, end, s.counts, event_limit) <= event_limit:
            joint_probabilities(
                s.members, begin, end, s.counts, s.plots, s.ratio, s.none, s.beta, s.taken, s.choice, s.product
            )
        else:
            counts[LARGE_CLUSTERS] += 1
            shared_probabilities(s.members, begin, end, s.counts, s.plots, s.ratio, s.none, s.beta, s.claims)
    return clusters


def warmup() -> None:
    """Compile what Python calls."""
    bank, window, s = make_bank(1), make_window(2, 1), make_scratch(1, 1, 2)
    window.cursor[:] = 0, 1
    gate_plots(bank, 0, window, 0, 16.0, False, s)
    weigh(bank, 0, window, 100.0, s)
    associate(1, 10, np.zeros(COUNTS, np.int64), s)
    absorb_cross(bank, 0, s)
    allow_shared(bank, 0, 0.9, 1.0, s)
    absorb(bank, 0, 0.999, s)
    keep_nis(bank, 0, s)
