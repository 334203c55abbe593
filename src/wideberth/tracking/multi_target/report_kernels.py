"""One ADS-B report and one track: how they differ, whether that may be, and what the track becomes.

A report tells position and velocity at its time of validity t_v, less the latency that its sender has not extrapolated
away. The track is at another time; what it was then follows from its own state, over at most a few seconds: with
a = t - t_v + latency, position z = p - a v + a^2/2 acc + biases, velocity z = v - a acc.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import Bank, Motion, make_bank
from wideberth.tracking.multi_target.consider_kernels import BIASES, LATENCY, consider
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, STRAIGHT

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ABSENT, ACCEPTED, REJECTED = 0, 1, 2
POSITION, ALTITUDE, CLIMB, VELOCITY = 0, 1, 2, 3
"""Groups of a report's elements, each with a gate of its own."""

LEAST_JUDGE = 1e-3
"""Hypotheses of motion less likely than this do not decide whether a report may be the track's."""

CAPPED_SQUARE = 12.0
"""Where reports are weighed, no element counts as further off than this normalised distance squared."""

LEAST_SHARE = 1e-6
"""No hypothesis of motion dies out for good."""


class ReportScratch(NamedTuple):
    """Small buffers: derivatives of two elements to states and biases, gain, and the codes of the four groups."""

    h: FloatArray
    g: FloatArray
    gain: FloatArray
    likelihood: FloatArray
    codes: IntArray


def make_report_scratch() -> ReportScratch:
    """Return the buffers."""
    return ReportScratch(
        np.zeros((2, 9)), np.zeros((2, BIASES)), np.zeros(9), np.zeros(HYPOTHESES), np.zeros(4, np.int64)
    )


@jit_uncounted
def element_rows(k: int, age: float, x: FloatArray, turning: bool, h: FloatArray, g: FloatArray) -> None:
    """Write the derivatives of element `k` (0 to 5: north, east, down, their rates) to states (9) and biases (BIASES).

    Parameters
    ----------
    k : int
    age : float
        Time of the state minus time of the report, plus the latency expected, s.
    x : ndarray, shape (9,)
    turning : bool
        Whether the acceleration's rows are used.
    h : ndarray, shape (9,)
    g : ndarray, shape (BIASES,)
    """
    for a in range(9):
        h[a] = 0.0
    for b in range(BIASES):
        g[b] = 0.0
    axis = k % 3
    if k < 3:
        h[axis], h[3 + axis] = 1.0, -age
        g[axis], g[LATENCY] = 1.0, -x[3 + axis]
        if turning:
            h[6 + axis] = 0.5 * age * age
            g[LATENCY] += age * x[6 + axis]
    else:
        h[3 + axis] = 1.0
        if turning:
            h[6 + axis] = -age
            g[LATENCY] = -x[6 + axis]


@jit_uncounted
def joint_variance(
    n: int, p: FloatArray, cross: FloatArray, bias: FloatArray, h: FloatArray, g: FloatArray, a: int, b: int
) -> float:
    """Return the covariance of the predictions of two elements, rows `a` and `b` of `h` (2, 9) and `g` (2, BIASES)."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += h[a, i] * p[i, j] * h[b, j]
        for k in range(BIASES):
            total += h[a, i] * cross[i, k] * g[b, k] + h[b, i] * cross[i, k] * g[a, k]
    for k in range(BIASES):
        total += g[a, k] * bias[k] * g[b, k]
    return total


@jit_uncounted
def element_variance(k: int, x: FloatArray, r: FloatArray, time_sigma: float) -> float:
    """Return the variance of an element's white error; the time stamp's moves a position along the velocity."""
    moved = time_sigma * x[3 + k] if k < 3 else 0.0
    value: float = r[k] + moved * moved
    return value


@jit_uncounted
def distance_square(
    bank: Bank,
    i: int,
    k: int,
    pair: bool,
    age: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    bias: FloatArray,
    s: ReportScratch,
) -> float:
    """Return the least normalised distance squared, over the hypotheses, of element `k`, or of `k` and `k + 1`."""
    least = math.inf
    for j in range(HYPOTHESES):
        if bank.mu[i, j] < LEAST_JUDGE:
            continue
        n = 6 if j == STRAIGHT else 9
        x, p, cross = bank.x[i, j], bank.p[i, j], bank.cross[i, j]
        element_rows(k, age, x, j != STRAIGHT, s.h[0], s.g[0])
        e0 = z[k]
        for a in range(n):
            e0 -= s.h[0, a] * x[a]
        s00 = joint_variance(n, p, cross, bias, s.h, s.g, 0, 0) + element_variance(k, x, r, time_sigma)
        square = e0 * e0 / s00
        if pair:
            element_rows(k + 1, age, x, j != STRAIGHT, s.h[1], s.g[1])
            e1 = z[k + 1]
            for a in range(n):
                e1 -= s.h[1, a] * x[a]
            s11 = joint_variance(n, p, cross, bias, s.h, s.g, 1, 1) + element_variance(k + 1, x, r, time_sigma)
            s01 = joint_variance(n, p, cross, bias, s.h, s.g, 0, 1)
            square = (s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1) / (s00 * s11 - s01 * s01)
        least = min(least, square)
    return least


@jit_uncounted
def surprise(
    bank: Bank, i: int, age: float, z: FloatArray, r: FloatArray, time_sigma: float, bias: FloatArray, s: ReportScratch
) -> float:
    """Return the least chi-square of a report's elements, each by itself, over the hypotheses of motion of track `i`.

    The parameters are those of `judge`. No element counts for more than `CAPPED_SQUARE`: one wild one decides nothing.
    """
    least = math.inf
    for j in range(HYPOTHESES):
        if bank.mu[i, j] < LEAST_JUDGE:
            continue
        n = 6 if j == STRAIGHT else 9
        x = bank.x[i, j]
        total = 0.0
        for k in range(6):
            if not math.isfinite(z[k]):
                continue
            element_rows(k, age, x, j != STRAIGHT, s.h[0], s.g[0])
            v = joint_variance(n, bank.p[i, j], bank.cross[i, j], bias, s.h, s.g, 0, 0)
            v += element_variance(k, x, r, time_sigma)
            e = z[k]
            for a in range(n):
                e -= s.h[0, a] * x[a]
            total += min(e * e / v, CAPPED_SQUARE)
        least = min(least, total)
    return least


@jit_uncounted
def known(z: FloatArray, k: int) -> bool:
    """Return whether the group `k` of a report's elements is there."""
    if k == POSITION:
        return math.isfinite(z[0]) and math.isfinite(z[1])
    if k == ALTITUDE:
        return math.isfinite(z[2])
    if k == CLIMB:
        return math.isfinite(z[5])
    return math.isfinite(z[3]) and math.isfinite(z[4])


@jit_uncounted
def judge(
    bank: Bank,
    i: int,
    age: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    bias: FloatArray,
    gate: float,
    s: ReportScratch,
) -> None:
    """Write to `s.codes` which groups of a report's elements may be of the track.

    Nothing is of a report whose position is not: it may be of another aircraft.
    """
    for k in range(4):
        s.codes[k] = ABSENT
    if known(z, POSITION):
        d = distance_square(bank, i, 0, True, age, z, r, time_sigma, bias, s)
        s.codes[POSITION] = ACCEPTED if d <= gate else REJECTED
        if s.codes[POSITION] == REJECTED:
            return
    if known(z, ALTITUDE):
        d = distance_square(bank, i, 2, False, age, z, r, time_sigma, bias, s)
        s.codes[ALTITUDE] = ACCEPTED if d <= gate else REJECTED
    if known(z, CLIMB):
        d = distance_square(bank, i, 5, False, age, z, r, time_sigma, bias, s)
        s.codes[CLIMB] = ACCEPTED if d <= gate else REJECTED
    if known(z, VELOCITY):
        d = distance_square(bank, i, 3, True, age, z, r, time_sigma, bias, s)
        s.codes[VELOCITY] = ACCEPTED if d <= gate else REJECTED


@jit_uncounted
def absorb_report(
    bank: Bank,
    i: int,
    age: float,
    z: FloatArray,
    r: FloatArray,
    time_sigma: float,
    bias: FloatArray,
    s: ReportScratch,
) -> None:
    """Update a track with the groups of a report that `s.codes` accepts."""
    top = -math.inf
    for j in range(HYPOTHESES):
        n = 6 if j == STRAIGHT else 9
        x = bank.x[i, j]
        value = 0.0
        for k in range(6):
            group = POSITION if k < 2 else ALTITUDE if k == 2 else CLIMB if k == 5 else VELOCITY
            if s.codes[group] != ACCEPTED:
                continue
            element_rows(k, age, x, j != STRAIGHT, s.h[0], s.g[0])
            variance = element_variance(k, x, r, time_sigma)
            value += consider(n, x, bank.p[i, j], bank.cross[i, j], s.h[0], s.g[0], bias, z[k], variance, s.gain)
        s.likelihood[j] = value
        top = max(top, value)
    total = 0.0
    for j in range(HYPOTHESES):
        bank.mu[i, j] = max(bank.mu[i, j] * math.exp(s.likelihood[j] - top), LEAST_SHARE)
        total += bank.mu[i, j]
    for j in range(HYPOTHESES):
        bank.mu[i, j] /= total


@jit_uncounted
def start_axis(
    bank: Bank,
    i: int,
    axis: int,
    place: float,
    variance: float,
    rate: float,
    rate_variance: float,
    latency: float,
    bias: FloatArray,
    motion: Motion,
) -> None:
    """Set one axis of a track from a position as sent and a velocity, without regard to what was known of it.

    The error of position + latency velocity is that of the bias, of the latency times the velocity, and of the white
    parts; what it shares with the biases is their covariance with the track.
    """
    for j in range(HYPOTHESES):
        x, p, cross = bank.x[i, j], bank.p[i, j], bank.cross[i, j]
        x[axis], x[3 + axis], x[6 + axis] = place + latency * rate, rate, 0.0
        for a in range(axis, 9, 3):
            for b in range(9):
                p[a, b], p[b, a] = 0.0, 0.0
            for b in range(BIASES):
                cross[a, b] = 0.0
        # The velocity's own error times the latency's is of second order, but all there is where no velocity is known.
        late = bias[LATENCY] * (rate * rate + rate_variance) + latency * latency * rate_variance
        p[axis, axis] = variance + bias[axis] + late
        p[axis, 3 + axis] = latency * rate_variance
        p[3 + axis, axis] = latency * rate_variance
        p[3 + axis, 3 + axis] = rate_variance
        if j != STRAIGHT:
            p[6 + axis, 6 + axis] = motion.acceleration_variance[j]
        cross[axis, axis] = -bias[axis]
        cross[axis, LATENCY] = bias[LATENCY] * rate
        for other in range(3):
            # What the latency does to this axis it does to the others.
            if other != axis:
                shared = rate * cross[other, LATENCY]
                p[axis, other], p[other, axis] = shared, shared
                p[axis, 3 + other] = rate * cross[3 + other, LATENCY]
                p[3 + other, axis] = p[axis, 3 + other]
                if j != STRAIGHT:
                    p[axis, 6 + other] = rate * cross[6 + other, LATENCY]
                    p[6 + other, axis] = p[axis, 6 + other]


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    bank, s, z, bias = make_bank(1), make_report_scratch(), np.ones(6), np.ones(BIASES)
    bank.mu[0] = 1.0 / n
    for axis in range(3):
        start_axis(bank, 0, axis, 1.0, 1.0, 1.0, 1.0, 0.3, bias, motion)
    judge(bank, 0, 0.0, z, z, 0.1, bias, 25.0, s)
    surprise(bank, 0, 0.0, z, z, 0.1, bias, s)
    absorb_report(bank, 0, 0.0, z, z, 0.1, bias, s)
