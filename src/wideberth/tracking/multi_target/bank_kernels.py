"""The tracks of the multi-target tracker as arrays, their prediction, and what becomes of them between scans."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.consider_kernels import BIASES, forget_biases, mix_cross, predict_cross
from wideberth.tracking.multi_target.imm_kernels import (
    HYPOTHESES,
    STRAIGHT,
    combine,
    mix,
    predict_straight,
    predict_turning,
)
from wideberth.tracking.ownship_kernels import STATE_WIDTH

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TENTATIVE = 0
CONFIRMED = 1

HABIT_WEIGHT = 0.2
"""How many maneuvers the duration of straight flight in the settings is worth, against those that were seen."""

HABIT_S = 300.0
"""Maneuvers longer ago than about this are forgotten."""

STRAIGHT_SIGMA_MPS2 = 0.1
"""Spread of the acceleration of an aircraft that flies straight, in what is reported."""


class Bank(NamedTuple):
    """Tracks, the first `size[0]` of N slots; they move when one is dropped.

    Attributes
    ----------
    x : ndarray, shape (N, HYPOTHESES, 9)
        State under each hypothesis, NED.
    p : ndarray, shape (N, HYPOTHESES, 9, 9)
    mu : ndarray, shape (N, HYPOTHESES)
        Probabilities of the hypotheses.
    existence : ndarray, shape (N,)
    identity, status, hits, home, inside, fed : ndarray of int64, shape (N,)
        Number of the track; TENTATIVE or CONFIRMED; plots so far; the sensor in whose field of view it was last, and
        whether it still is; the sensors that had plots of it, as bits.
    updated, seen : ndarray, shape (N,)
        Times of the last plot, and of the last scan that could have seen it.
    own : ndarray, shape (N, STATE_WIDTH)
        The numbers of `ownship_kernels`: a running chi-square of position and velocity against telemetry.
    turning : ndarray of int64, shape (N,)
        Whether it is in a maneuver.
    habit : ndarray, shape (2,)
        Maneuvers that were begun lately by any track, and seconds that tracks flew straight.
    address : ndarray of int64, shape (N,)
        The place in `heard_kernels.Heard` of the aircraft's ADS-B reports; -1: it has not been found among them.
    cross : ndarray, shape (N, HYPOTHESES, 9, BIASES)
        Covariance of the state's error with the biases of those reports (`consider_kernels`); zero without them.
    nis, nis_dof : ndarray, shape (N,)
        Normalised innovation squared of the last scan's plot, and its degrees of freedom; 0 of them: it had none.
    size : ndarray of int64, shape (2,)
        Tracks now, and the number that the next one gets.
    t : ndarray, shape (2,)
        Time of the states, and of the last radar scan.
    """

    x: FloatArray
    p: FloatArray
    mu: FloatArray
    existence: FloatArray
    identity: IntArray
    status: IntArray
    hits: IntArray
    home: IntArray
    inside: IntArray
    fed: IntArray
    updated: FloatArray
    seen: FloatArray
    own: FloatArray
    turning: IntArray
    habit: FloatArray
    address: IntArray
    cross: FloatArray
    nis: FloatArray
    nis_dof: FloatArray
    size: IntArray
    t: FloatArray


class Motion(NamedTuple):
    """Numbers of the motion, one for each hypothesis.

    Attributes
    ----------
    noise : ndarray, shape (HYPOTHESES, 3)
        Spectral densities: of the acceleration (m2/s3) where straight, else of the jerk (m2/s5).
    acceleration_variance : ndarray, shape (HYPOTHESES,)
        At the beginning of a maneuver, m2/s4.
    duration : ndarray, shape (HYPOTHESES,)
        How long it lasts on average, s.
    share : ndarray, shape (HYPOTHESES,)
        Probabilities at birth.
    survival_s : float
    least_mix, least_report : float
        Smallest shares that are mixed in, and reported.
    """

    noise: FloatArray
    acceleration_variance: FloatArray
    duration: FloatArray
    share: FloatArray
    survival_s: float
    least_mix: float
    least_report: float


class MotionScratch(NamedTuple):
    """Buffers of prediction and combination."""

    f: FloatArray
    work: FloatArray
    stay: FloatArray
    weight: FloatArray
    mixed: FloatArray
    spread: FloatArray
    share: FloatArray


def make_motion_scratch() -> MotionScratch:
    """Return the buffers of prediction and combination."""
    n = HYPOTHESES
    return MotionScratch(
        np.zeros((9, 9)),
        np.zeros((9, 9)),
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros((n, 9)),
        np.zeros((n, 9, 9)),
        np.zeros(n),
    )


def grown_bank(bank: Bank) -> Bank:
    """Return a bank with the same tracks and twice the slots."""
    larger = make_bank(2 * bank.mu.shape[0])
    for new, old in zip(larger, bank, strict=True):
        new[: len(old)] = old
    return larger


def copied_bank(bank: Bank, n: int) -> Bank:
    """Return a copy of the first `n` slots and of what belongs to no slot."""
    whole = {"habit", "size", "t"}
    return Bank._make(a.copy() if name in whole else a[:n].copy() for name, a in zip(Bank._fields, bank, strict=True))


def make_bank(n: int) -> Bank:
    """Return an empty bank of `n` slots."""
    return Bank(
        x=np.zeros((n, HYPOTHESES, 9)),
        p=np.zeros((n, HYPOTHESES, 9, 9)),
        mu=np.zeros((n, HYPOTHESES)),
        existence=np.zeros(n),
        identity=np.zeros(n, np.int64),
        status=np.zeros(n, np.int64),
        hits=np.zeros(n, np.int64),
        home=np.zeros(n, np.int64),
        inside=np.zeros(n, np.int64),
        fed=np.zeros(n, np.int64),
        updated=np.zeros(n),
        seen=np.zeros(n),
        own=np.zeros((n, STATE_WIDTH)),
        turning=np.zeros(n, np.int64),
        habit=np.zeros(2),
        address=np.full(n, -1, np.int64),
        cross=np.zeros((n, HYPOTHESES, 9, BIASES)),
        nis=np.zeros(n),
        nis_dof=np.zeros(n),
        size=np.array([0, 1], np.int64),
        t=np.array([-np.inf, -np.inf]),
    )


@jit_uncounted
def prepare_step(
    habit: FloatArray, weight: float, straight_s: float, dt: float, motion: Motion, stay: FloatArray
) -> float:
    """Write the probabilities that an aircraft goes on as it does over a step; return that it stays.

    Parameters
    ----------
    habit : ndarray, shape (2,)
        Maneuvers begun lately, and seconds of straight flight.
    weight, straight_s : float
        How many maneuvers it is worth, against those, that straight flight lasts so long (s) on average.
    dt : float
        s.
    motion : Motion
    stay : ndarray, shape (HYPOTHESES,)
    """
    for j in range(HYPOTHESES):
        stay[j] = math.exp(-abs(dt) / motion.duration[j])
    stay[STRAIGHT] = math.exp(-abs(dt) * (weight + habit[0]) / (weight * straight_s + habit[1]))
    return math.exp(-abs(dt) / motion.survival_s)


@jit_uncounted
def predict_track(bank: Bank, i: int, dt: float, motion: Motion, s: MotionScratch) -> None:
    """Take one track `dt` further; `s.stay` is of `prepare_step`."""
    x, p = bank.x[i], bank.p[i]
    mix(s.stay, motion.least_mix, motion.acceleration_variance, bank.mu[i], x, p, s.weight, s.mixed, s.spread)
    if bank.address[i] >= 0:
        mix_cross(s.weight, bank.cross[i], s.mixed)
        predict_cross(dt, x, bank.cross[i], s.f, s.mixed)
    predict_straight(dt, motion.noise[STRAIGHT], x[STRAIGHT], p[STRAIGHT])
    for j in range(1, HYPOTHESES):
        predict_turning(dt, motion.noise[j], x[j], p[j], s.f, s.work)


@jit_uncounted
def predict_tracks(bank: Bank, t: float, motion: Motion, s: MotionScratch) -> None:
    """Take all tracks to time `t`."""
    dt = t - bank.t[0]
    if bank.t[0] == -math.inf or dt == 0.0:
        bank.t[0] = t
        return
    alive = prepare_step(bank.habit, HABIT_WEIGHT, motion.duration[STRAIGHT], dt, motion, s.stay)
    for i in range(bank.size[0]):
        predict_track(bank, i, dt, motion, s)
        bank.existence[i] *= alive
    bank.t[0] = t


@jit_uncounted
def fade_habit(habit: FloatArray, dt: float) -> None:
    """Let what is known of maneuvers (2) fade over `dt`."""
    kept = math.exp(-abs(dt) / HABIT_S)
    habit[0] *= kept
    habit[1] *= kept


@jit_uncounted
def note_maneuver(bank: Bank, i: int, dt: float, habit: FloatArray) -> None:
    """Add to what is known of maneuvers (2) whether track `i` has begun one, and the time if it flies straight."""
    straight = bank.mu[i, STRAIGHT]
    if bank.turning[i] == 0 and straight < 0.1:
        bank.turning[i] = 1
        habit[0] += 1.0
    elif bank.turning[i] == 1 and straight > 0.7:
        bank.turning[i] = 0
    if bank.turning[i] == 0:
        habit[1] += abs(dt)


@jit_uncounted
def note_maneuvers(bank: Bank, dt: float) -> None:
    """Count maneuvers that confirmed tracks begin, and the time that they fly straight."""
    fade_habit(bank.habit, dt)
    for i in range(bank.size[0]):
        if bank.status[i] == CONFIRMED:
            note_maneuver(bank, i, dt, bank.habit)


@jit_uncounted
def copy_track(bank: Bank, i: int, j: int) -> None:
    """Copy slot `i` to slot `j`."""
    for m in range(STATE_WIDTH):
        bank.own[j, m] = bank.own[i, m]
    for m in range(HYPOTHESES):
        bank.mu[j, m] = bank.mu[i, m]
        for a in range(9):
            bank.x[j, m, a] = bank.x[i, m, a]
            for b in range(9):
                bank.p[j, m, a, b] = bank.p[i, m, a, b]
    bank.existence[j] = bank.existence[i]
    bank.identity[j] = bank.identity[i]
    bank.status[j] = bank.status[i]
    bank.hits[j] = bank.hits[i]
    bank.home[j] = bank.home[i]
    bank.inside[j] = bank.inside[i]
    bank.fed[j] = bank.fed[i]
    bank.updated[j] = bank.updated[i]
    bank.seen[j] = bank.seen[i]
    bank.turning[j] = bank.turning[i]
    bank.address[j] = bank.address[i]
    bank.nis[j], bank.nis_dof[j] = bank.nis[i], bank.nis_dof[i]
    for m in range(HYPOTHESES):
        for a in range(9):
            for b in range(BIASES):
                bank.cross[j, m, a, b] = bank.cross[i, m, a, b]


@jit_uncounted
def add_track(
    bank: Bank,
    x: FloatArray,
    p: FloatArray,
    existence: float,
    hits: int,
    sensor: int,
    motion: Motion,
) -> None:
    """Put a new tentative track with position and velocity `x` (6) and covariance `p` (6, 6) into the next slot."""
    i = bank.size[0]
    for m in range(HYPOTHESES):
        bank.mu[i, m] = motion.share[m]
        for a in range(9):
            bank.x[i, m, a] = x[a] if a < 6 else 0.0
            for b in range(9):
                bank.p[i, m, a, b] = p[a, b] if a < 6 and b < 6 else 0.0
            if m != STRAIGHT and a >= 6:
                bank.p[i, m, a, a] = motion.acceleration_variance[m]
    bank.existence[i] = existence
    bank.identity[i] = bank.size[1]
    bank.status[i] = TENTATIVE
    bank.turning[i] = 0
    bank.nis_dof[i] = 0.0
    bank.hits[i] = hits
    bank.home[i] = sensor
    bank.inside[i] = 1
    bank.updated[i], bank.seen[i] = bank.t[0], bank.t[0]
    bank.fed[i] = 1 << min(sensor, 62)
    for m in range(STATE_WIDTH):
        bank.own[i, m] = 0.0
    bank.address[i] = -1
    forget_biases(bank.cross[i])
    bank.size[0] += 1
    bank.size[1] += 1


@jit_uncounted
def remove_track(bank: Bank, i: int) -> None:
    """Drop a track; the last one takes its slot."""
    last = bank.size[0] - 1
    if i != last:
        copy_track(bank, last, i)
    bank.size[0] = last


@jit_uncounted
def combined(bank: Bank, i: int, motion: Motion, x: FloatArray, p: FloatArray, s: MotionScratch) -> None:
    """Write a track's mean (9) and covariance (9, 9) as they are reported."""
    variance = STRAIGHT_SIGMA_MPS2 * STRAIGHT_SIGMA_MPS2
    combine(motion.least_report, variance, bank.mu[i], bank.x[i], bank.p[i], s.share, x, p)


@jit_uncounted
def place(bank: Bank, i: int, x: FloatArray, p: FloatArray) -> None:
    """Write a track's mean position (3) and its covariance (3, 3) over all hypotheses."""
    for a in range(3):
        x[a] = 0.0
        for j in range(HYPOTHESES):
            x[a] += bank.mu[i, j] * bank.x[i, j, a]
    for a in range(3):
        for b in range(3):
            p[a, b] = 0.0
            for j in range(HYPOTHESES):
                p[a, b] += bank.mu[i, j] * (bank.p[i, j, a, b] + (bank.x[i, j, a] - x[a]) * (bank.x[i, j, b] - x[b]))


def warmup() -> None:
    """Compile what Python calls."""
    bank, scratch, n = make_bank(4), make_motion_scratch(), HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    add_track(bank, np.ones(6), np.eye(6), 0.5, 4, 0, motion)
    add_track(bank, np.ones(6), np.eye(6), 0.5, 4, 0, motion)
    predict_tracks(bank, 0.0, motion, scratch)
    note_maneuvers(bank, 0.1)
    combined(bank, 0, motion, np.zeros(9), np.zeros((9, 9)), scratch)
    place(bank, 0, np.zeros(3), np.zeros((3, 3)))
    remove_track(bank, 0)
