"""Aircraft that say by ADS-B who they are: what is kept of each, and what reports make of their filters.

Each address has a filter of its own that only its reports feed. It is the track of an aircraft that no radar sees, and
it is the witness by which a radar's track is found to be that aircraft, or not to be it any more (`identity_kernels`).
A radar's track with an address is updated by its reports as well.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import (
    TENTATIVE,
    Bank,
    Motion,
    MotionScratch,
    fade_habit,
    make_bank,
    make_motion_scratch,
    note_maneuver,
    predict_track,
    prepare_step,
)
from wideberth.tracking.multi_target.consider_kernels import BIASES
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES
from wideberth.tracking.multi_target.report_kernels import ALTITUDE, VELOCITY, known, start_axis
from wideberth.tracking.ownship_kernels import STATE_WIDTH

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REJECTS = 3
"""So many positions outside the gate that agree with one another are another place, or another aircraft."""

RIVALS = 4
"""Tracks of radars that an aircraft's reports are weighed among at most."""

MEMORY_S = 5.0
"""How long a velocity or an altitude that came by itself may serve to start a track."""

STRAIGHT_S, STRAIGHT_WEIGHT = 8.0, 3.0
"""How long straight flight is taken to last on average before an aircraft's habit is known, s, and how many maneuvers
that is worth. Reports show a turn only after seconds: who is surer of straight flight says a velocity of before it."""


class Heard(NamedTuple):
    """What is kept of R users of addresses, beside their filters.

    Attributes
    ----------
    alive, status, reports : ndarray of int64, shape (R,)
        Whether there is a filter, TENTATIVE or CONFIRMED, and positions accepted since it started.
    number : ndarray of int64, shape (R,)
        Number of the track, where no radar's track has the address.
    t, heard : ndarray, shape (R,)
        Times of the filter's state, and of the last position accepted.
    bias : ndarray, shape (R, BIASES)
        Variances of the biases.
    other : ndarray of int64, shape (R,)
        Place of the second aircraft that uses the same address; -1: none.
    fed : ndarray of int64, shape (R,)
        The sensors that hear it, as bits.
    place : ndarray, shape (R, 2)
        Last position as sent, to know repeats by.
    velocity : ndarray, shape (R, 4)
        Time, and the last velocity as sent; the climb may be NaN.
    altitude : ndarray, shape (R, 2)
        Time, and the last down coordinate as sent.
    rejected : ndarray, shape (R, REJECTS, 3)
        Time, north and east of the last positions outside the gate, newest last.
    rejects, vertical_rejects : ndarray of int64, shape (R,)
        How many of them there were in a row.
    own : ndarray, shape (R, STATE_WIDTH)
        As in `Bank`, where no radar's track has the address.
    strikes, waits, pending, slot : ndarray of int64, shape (R,)
        Of `identity_kernels`: reports in a row at which the radar's track with this address did not fit; reports
        for which it could have been that of several; whether it still can; the place of its radar's track in the bank.
    rival : ndarray of int64, shape (R, RIVALS)
        Of `rival_kernels`: numbers of the radars' tracks that its reports are weighed among; -1: none.
    offset : ndarray, shape (R, RIVALS, 3, 3)
        Mean and variance of what reports are off from each, and its velocity at the last; by axis.
    score, denied : ndarray, shape (R, RIVALS)
        How far each is behind the best (twice the log-likelihood), and by how much worse it fits than the filter of
        the reports alone (chi-square).
    surprise, weighed : ndarray, shape (R,)
        Chi-square of the last report under that filter, and the time of the last that was weighed.
    habit : ndarray, shape (R, 2)
        As in `Bank`, of each aircraft by itself.
    mine : ndarray of int64, shape (R,)
        1 where it may be the ownship.
    """

    alive: IntArray
    status: IntArray
    reports: IntArray
    number: IntArray
    t: FloatArray
    heard: FloatArray
    bias: FloatArray
    other: IntArray
    fed: IntArray
    place: FloatArray
    velocity: FloatArray
    altitude: FloatArray
    rejected: FloatArray
    rejects: IntArray
    vertical_rejects: IntArray
    own: FloatArray
    strikes: IntArray
    waits: IntArray
    pending: IntArray
    slot: IntArray
    rival: IntArray
    offset: FloatArray
    score: FloatArray
    denied: FloatArray
    surprise: FloatArray
    weighed: FloatArray
    habit: FloatArray
    mine: IntArray


class ReportRules(NamedTuple):
    """Numbers of ADS-B reports.

    Attributes
    ----------
    gate : float
        Largest normalised distance squared of position, altitude, climb rate and velocity, each by itself.
    latency : float
        Uncompensated latency expected, s.
    velocity_variance, speed_variance, climb_variance : float
        Added to a reported velocity's at the start; of each horizontal component of an unknown velocity, and of an
        unknown climb rate, m2/s2.
    speed_max, hover_speed : float
        Fastest aircraft; a repeated position of an aircraft slower than this is news, m/s.
    confirm : int
        Positions that confirm a track.
    link_gate, split_gate : float
        Normalised distance squared, position and velocity, below which a radar's track may have the address, and above
        which it cannot.
    lead : float
        By so much the best must be better than the next (twice the log-likelihood); by twice as much for the address
        to pass from one track to another, or from one to none.
    waits, strikes : int
        Reports after which the best is taken all the same; and in a row that take the address away.
    keep_s, keep_tentative_s : float
        How long a track without positions is kept.
    existence_max : float
    """

    gate: float
    latency: float
    velocity_variance: float
    speed_variance: float
    climb_variance: float
    speed_max: float
    hover_speed: float
    confirm: int
    link_gate: float
    split_gate: float
    lead: float
    waits: int
    strikes: int
    keep_s: float
    keep_tentative_s: float
    existence_max: float


def make_heard(n: int) -> Heard:
    """Return places for `n` users of addresses."""
    return Heard(
        alive=np.zeros(n, np.int64),
        status=np.zeros(n, np.int64),
        reports=np.zeros(n, np.int64),
        number=np.zeros(n, np.int64),
        t=np.full(n, -np.inf),
        heard=np.full(n, -np.inf),
        bias=np.ones((n, BIASES)),
        other=np.full(n, -1, np.int64),
        fed=np.zeros(n, np.int64),
        place=np.full((n, 2), np.nan),
        velocity=np.full((n, 4), -np.inf),
        altitude=np.full((n, 2), -np.inf),
        rejected=np.zeros((n, REJECTS, 3)),
        rejects=np.zeros(n, np.int64),
        vertical_rejects=np.zeros(n, np.int64),
        own=np.zeros((n, STATE_WIDTH)),
        strikes=np.zeros(n, np.int64),
        waits=np.zeros(n, np.int64),
        pending=np.zeros(n, np.int64),
        slot=np.full(n, -1, np.int64),
        rival=np.full((n, RIVALS), -1, np.int64),
        offset=np.zeros((n, RIVALS, 3, 3)),
        score=np.zeros((n, RIVALS)),
        denied=np.zeros((n, RIVALS)),
        surprise=np.zeros(n),
        weighed=np.full(n, -np.inf),
        habit=np.zeros((n, 2)),
        mine=np.zeros(n, np.int64),
    )


@jit_uncounted
def advance(filters: Bank, heard: Heard, u: int, t: float, motion: Motion, s: MotionScratch) -> None:
    """Take the filter of `u` to time `t`, unless that is before its own."""
    dt = t - heard.t[u]
    if dt <= 0.0:
        return
    fade_habit(heard.habit[u], dt)
    note_maneuver(filters, u, dt, heard.habit[u])
    prepare_step(heard.habit[u], STRAIGHT_WEIGHT, STRAIGHT_S, dt, motion, s.stay)
    predict_track(filters, u, dt, motion, s)
    heard.t[u] = t


@jit_uncounted
def remember(heard: Heard, u: int, t: float, z: FloatArray) -> None:
    """Note velocity and altitude of a report."""
    if known(z, VELOCITY):
        heard.velocity[u, 0] = t
        for a in range(3):
            heard.velocity[u, 1 + a] = z[3 + a]
    if known(z, ALTITUDE):
        heard.altitude[u, 0], heard.altitude[u, 1] = t, z[2]


@jit_uncounted
def start(
    filters: Bank,
    heard: Heard,
    u: int,
    t: float,
    z: FloatArray,
    r: FloatArray,
    rules: ReportRules,
    motion: Motion,
) -> None:
    """Start the filter of `u` from a report with position; altitude and velocity may be those heard just before."""
    down = z[2] if known(z, ALTITUDE) else heard.altitude[u, 1]
    down_variance = r[2] if known(z, ALTITUDE) else rules.climb_variance * MEMORY_S * MEMORY_S
    recent = t - heard.velocity[u, 0] <= MEMORY_S
    for j in range(HYPOTHESES):
        filters.mu[u, j] = motion.share[j]
        for a in range(9):
            filters.x[u, j, a] = 0.0
            for b in range(9):
                filters.p[u, j, a, b] = 0.0
            for b in range(BIASES):
                filters.cross[u, j, a, b] = 0.0
    filters.address[u], filters.turning[u] = u, 0
    bias = heard.bias[u]
    for axis in range(3):
        rate, variance = 0.0, rules.climb_variance if axis == 2 else rules.speed_variance
        if recent and math.isfinite(heard.velocity[u, 1 + axis]):
            rate = heard.velocity[u, 1 + axis]
            told = r[3 + axis] if math.isfinite(r[3 + axis]) else 0.0
            variance = told + rules.velocity_variance
        if axis == 2:
            start_axis(filters, u, 2, down, down_variance, rate, variance, rules.latency, bias, motion)
        else:
            start_axis(filters, u, axis, z[axis], r[axis], rate, variance, rules.latency, bias, motion)
    heard.alive[u], heard.status[u], heard.reports[u] = 1, TENTATIVE, 1
    heard.t[u], heard.heard[u] = t, t
    heard.rejects[u], heard.vertical_rejects[u] = 0, 0
    heard.strikes[u], heard.waits[u], heard.pending[u] = 0, 0, 0
    heard.weighed[u] = -math.inf
    for k in range(RIVALS):
        heard.rival[u, k], heard.score[u, k], heard.denied[u, k] = -1, 0.0, 0.0
    for a in range(STATE_WIDTH):
        heard.own[u, a] = 0.0


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    motion = Motion(np.full((n, 3), 1e-4), np.ones(n), np.full(n, 10.0), np.full(n, 1.0 / n), 1000.0, 0.01, 0.05)
    rules = ReportRules(25.0, 0.3, 1.0, 1e4, 60.0, 350.0, 1.5, 3, 22.5, 35.0, 9.0, 8, 3, 60.0, 15.0, 0.999)
    filters, heard, z = make_bank(1), make_heard(1), np.ones(6)
    remember(heard, 0, 0.0, z)
    start(filters, heard, 0, 0.0, z, z, rules, motion)
    advance(filters, heard, 0, 1.0, motion, make_motion_scratch())
