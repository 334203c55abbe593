"""Compiled messages between the vehicles of a fleet: sent with noise, delayed, lost, doubled, reordered, judged.

Noise is counted by (seed, encounter, vehicle or link, message), so that nothing depends on what runs beside. m, m/s, s,
NED.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.sensors.noise_kernels import fill_normals, fill_uniforms

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Indices into the settings of the run.
R_DT = 0  # s
R_DECIDE_EVERY = 1  # steps
R_SEND_EVERY = 2  # steps
R_DELAY = 3  # s, mean
R_JITTER = 4  # s, mean of an exponential part on top
R_LOSS = 5  # probability, as are the next two
R_DUPLICATE = 6
R_ABSURD = 7
R_POSITION_SIGMA = 8  # m
R_OUTAGE_START = 9  # s
R_OUTAGE_END = 10
R_OUTAGE_VEHICLE = 11  # -1: all
R_HUB = 12  # 1: each message goes by a hub, with delay and loss on both ways
R_BEFORE = 13  # what was received of the time before the start
R_SPEED_LIMIT = 14  # m/s: faster is absurd
R_JUMP_LIMIT = 15  # m: farther from where it was expected is absurd
R_CENTRAL = 16  # 1: a hub decides for all
N_RUN = 17

SILENT, HELD, STRAIGHT = 0, 1, 2

# Columns of the counters.
RECEIVED, LOST, DUPLICATES, OUT_OF_ORDER, ABSURD, STALE, SWITCHES, REVERSALS = 0, 1, 2, 3, 4, 5, 6, 7
N_COUNTERS = 8

_NOISE_SET = 0xCA5
_ABSURD_SHIFT = 1000.0  # m, of a corrupted position
_REJECTED_IN_A_ROW = 5  # after which a jump is believed

# Columns of an event.
E_VEHICLE, E_OTHER, E_REASON, E_START, E_END, E_FIRST_RATE, E_LARGEST_RATE = 0, 1, 2, 3, 4, 5, 6
N_EVENT = 7

# Columns of the log, of each vehicle: its state, command and reason.
L_COMMAND, L_REASON = 6, 7
N_LOG = 8


class Buffers(NamedTuple):
    """What a run works in, made for n vehicles, a ring of m steps and q participants in the exchange of messages.

    The vehicles are the participants 0 to n - 1. A hub that decides for all is number n.

    Attributes
    ----------
    sent : ndarray, shape (m, n, 8)
        Messages by step: position, velocity, altitude wanted (down), time.
    newest : ndarray of int64, shape (m, q, q)
        Step of the newest message of a sender (third) that arrives at a receiver (second) at a step; -1.
    last : ndarray of int64, shape (q, q)
        Step of the newest message accepted; -1.
    rejected : ndarray of int64, shape (q, q)
    received : ndarray, shape (q, n, 8)
        The messages accepted, smoothed.
    known : ndarray, shape (n, 7)
        What each vehicle knows of itself: position, velocity, time.
    views, use, bounds : ndarray, shape (n, N_VIEW), (n,), (n, 3)
    order : ndarray of int64, shape (n,)
    level : ndarray, shape (n, 2)
        Commanded horizontal velocities.
    preferred, held, best : ndarray, shape (3,), (3,) and (4,)
        Scratch of one decision.
    """

    sent: FloatArray
    newest: IntArray
    last: IntArray
    rejected: IntArray
    received: FloatArray
    known: FloatArray
    views: FloatArray
    use: FloatArray
    bounds: FloatArray
    order: IntArray
    level: FloatArray
    preferred: FloatArray
    held: FloatArray
    best: FloatArray


class Results(NamedTuple):
    """What a run writes.

    Attributes
    ----------
    separation : ndarray, shape (n, n)
        Least distance of each pair.
    separation_time : ndarray, shape (n, n)
    drift : ndarray, shape (n, 2)
        Farthest above and below the altitude wanted, both positive.
    aside, late : ndarray, shape (n,)
        Farthest to the side of the straight track, and behind the place on it, m.
    counters : ndarray of int64, shape (n, N_COUNTERS)
    events : ndarray, shape (e, N_EVENT)
        Avoidance by avoidance; those that do not fit are counted, not written.
    log : ndarray, shape (l, n, N_LOG)
    log_separation : ndarray, shape (l,)
        Least distance of all pairs at that time.
    """

    separation: FloatArray
    separation_time: FloatArray
    drift: FloatArray
    aside: FloatArray
    late: FloatArray
    counters: IntArray
    events: FloatArray
    log: FloatArray
    log_separation: FloatArray


@jit_uncounted
def reset(b: Buffers, results: Results) -> None:
    """Empty buffers and results for a new run."""
    for k in range(b.newest.shape[0]):
        for i in range(b.newest.shape[1]):
            for j in range(b.newest.shape[2]):
                b.newest[k, i, j] = -1
    n = b.use.shape[0]
    for i in range(b.last.shape[0]):
        for j in range(b.last.shape[0]):
            b.last[i, j] = -1
            b.rejected[i, j] = 0
    for i in range(n):
        results.drift[i, 0] = results.drift[i, 1] = results.aside[i] = results.late[i] = 0.0
        for c in range(N_COUNTERS):
            results.counters[i, c] = 0
        for j in range(n):
            results.separation[i, j] = math.inf
            results.separation_time[i, j] = 0.0


@jit_uncounted
def one_way(delay: float, jitter: float, uniform: float) -> float:
    """Return the time that a message takes."""
    return delay - jitter * math.log(uniform) if jitter > 0.0 else delay


@jit_uncounted
def count(i: int, j: int, column: int, results: Results) -> None:
    """Count a message from `j` to `i` by its receiver, one to the hub by its sender."""
    results.counters[i if i < results.counters.shape[0] else j, column] += 1


@jit_uncounted
def put(b: Buffers, results: Results, step: int, late: int, receiver: int, sender: int) -> None:
    """Let a message of `step` arrive `late` steps later; of two that arrive together the older is out of order."""
    ring = b.newest.shape[0]
    slot = (step + min(late, ring - 1)) % ring
    held = b.newest[slot, receiver, sender]
    if held == step:
        count(receiver, sender, DUPLICATES, results)
    elif held >= 0:
        count(receiver, sender, OUT_OF_ORDER, results)
    b.newest[slot, receiver, sender] = max(held, step)


@jit_uncounted
def send(
    k: int, t: float, seed: int, encounter: int, r: FloatArray, b: Buffers, results: Results, u: FloatArray
) -> None:
    """Send a message of every vehicle to all others, or to the hub that decides for all, at step `k`.

    `u` (4) is scratch for random numbers.
    """
    n = b.use.shape[0]
    for j in range(n):
        if r[R_CENTRAL] > 0.0:
            carry(k, k, t, n, j, seed, encounter, r, b, results, u)
            continue
        for i in range(n):
            if i != j:
                carry(k, k, t, i, j, seed, encounter, r, b, results, u)


@jit_uncounted
def carry(
    k: int,
    now: int,
    t: float,
    i: int,
    j: int,
    seed: int,
    encounter: int,
    r: FloatArray,
    b: Buffers,
    results: Results,
    u: FloatArray,
) -> None:
    """Decide what the link from vehicle `j` to `i` makes of the message of step `k`: lost, late, doubled.

    It arrives at step `now` at the earliest; `u` (4) is scratch.
    """
    n = b.last.shape[0]
    out = r[R_OUTAGE_START] <= t < r[R_OUTAGE_END] and (r[R_OUTAGE_VEHICLE] < 0.0 or r[R_OUTAGE_VEHICLE] == j)
    up = 0.0
    hub_lost = False
    if r[R_HUB] > 0.0:
        fill_uniforms(seed, _NOISE_SET, encounter, 1 + n + n * j + j, k, u)
        hub_lost, up = u[0] < r[R_LOSS], one_way(r[R_DELAY], r[R_JITTER], u[1])
    fill_uniforms(seed, _NOISE_SET, encounter, 1 + n + n * i + j, k, u)
    if out or hub_lost or u[0] < r[R_LOSS]:
        count(i, j, LOST, results)
        return
    late = up + one_way(r[R_DELAY], r[R_JITTER], u[1])
    put(b, results, k, max(math.ceil(late / r[R_DT] - 1e-6), now - k), i, j)
    if u[2] < r[R_DUPLICATE]:
        late = up + one_way(r[R_DELAY], max(r[R_JITTER], r[R_DT]), u[3])
        put(b, results, k, max(math.ceil(late / r[R_DT] - 1e-6), now - k), i, j)


@jit_uncounted
def receive(k: int, r: FloatArray, p: FloatArray, b: Buffers, results: Results) -> None:
    """Take what arrives at step `k`: the newest of each sender, if it makes sense."""
    n, ring = b.last.shape[0], b.newest.shape[0]
    slot = k % ring
    for i in range(n):
        for j in range(n):
            step = b.newest[slot, i, j]
            if step < 0:
                continue
            b.newest[slot, i, j] = -1
            if step == b.last[i, j]:
                count(i, j, DUPLICATES, results)
            elif step < b.last[i, j]:
                count(i, j, OUT_OF_ORDER, results)
            elif j == b.use.shape[0]:
                b.last[i, j] = step  # a command of the hub
                count(i, j, RECEIVED, results)
            elif take(i, j, step, r, p, b):
                count(i, j, RECEIVED, results)
            else:
                count(i, j, ABSURD, results)


@jit_uncounted
def take(i: int, j: int, step: int, r: FloatArray, p: FloatArray, b: Buffers) -> bool:
    """Take one message into what `i` knows of `j`; False where it is absurd."""
    slot = step % b.newest.shape[0]
    speed_squared = jump_squared = 0.0
    age = b.sent[slot, j, 7] - b.received[i, j, 7]
    known = b.last[i, j] >= 0
    for c in range(3):
        position, velocity = b.sent[slot, j, c], b.sent[slot, j, 3 + c]
        speed_squared += velocity * velocity
        if known:
            jump_squared += (position - b.received[i, j, c] - age * b.received[i, j, 3 + c]) ** 2
        elif not math.isfinite(position):
            return False
    if not speed_squared <= r[R_SPEED_LIMIT] ** 2:
        return False
    far = r[R_JUMP_LIMIT] + age * r[R_SPEED_LIMIT]
    if not jump_squared <= far * far:
        b.rejected[i, j] += 1
        if b.rejected[i, j] < _REJECTED_IN_A_ROW or not math.isfinite(jump_squared):
            return False
        known = False
    b.rejected[i, j] = 0
    share = p[i if i < p.shape[0] else j, pair.P_SMOOTHING] if known else 1.0
    for c in range(3):
        expected = b.received[i, j, c] + age * b.received[i, j, 3 + c] if known else 0.0
        b.received[i, j, c] = expected + share * (b.sent[slot, j, c] - expected)
        b.received[i, j, 3 + c] = b.sent[slot, j, 3 + c]
    b.received[i, j, 6], b.received[i, j, 7] = b.sent[slot, j, 6], b.sent[slot, j, 7]
    b.last[i, j] = step
    return True


@jit_uncounted
def compensated(age: float, p: FloatArray) -> float:
    """Return by how long a state of that age is moved on, s."""
    if p[pair.P_COMPENSATION] == pair.ESTIMATE:
        return float(p[pair.P_DELAY])
    return age if p[pair.P_COMPENSATION] == pair.TIMESTAMP else 0.0


@jit_uncounted
def look(i: int, j: int, t: float, start: FloatArray, wanted: FloatArray, r: FloatArray, b: Buffers) -> float:
    """Write what participant `i` has last heard of vehicle `j` into its view, and return how old that is, s.

    NaN where nothing is known.
    """
    if b.last[i, j] >= 0:
        age = float(t - b.received[i, j, 7])
        for c in range(7):
            b.views[j, c] = b.received[i, j, c]
    elif r[R_BEFORE] != SILENT:
        age = float(r[R_DELAY])
        for c in range(6):
            b.views[j, c] = start[j, c]
        b.views[j, 6] = wanted[j]
        if r[R_BEFORE] == STRAIGHT:
            for c in range(3):
                b.views[j, c] += start[j, 3 + c] * (t - age)
    else:
        return math.nan
    b.views[j, multi.V_AGE] = age
    return age


@jit_uncounted
def see(
    i: int, t: float, start: FloatArray, wanted: FloatArray, r: FloatArray, p: FloatArray, b: Buffers, results: Results
) -> None:
    """Write what vehicle `i` takes the others to do now into the views."""
    for j in range(b.use.shape[0]):
        b.use[j] = 0.0
        if j == i:
            continue
        age = look(i, j, t, start, wanted, r, b)
        if age > p[i, pair.P_STALE]:
            results.counters[i, STALE] += 1
        elif not math.isnan(age):
            b.use[j] = 1.0
            ahead = compensated(age, p[i])
            for c in range(3):
                b.views[j, c] += ahead * b.views[j, 3 + c]


@jit_uncounted
def navigate(
    k: int,
    t: float,
    x: FloatArray,
    wanted: FloatArray,
    p: FloatArray,
    r: FloatArray,
    seed: int,
    encounter: int,
    noise: FloatArray,
    b: Buffers,
) -> None:
    """Write what each vehicle measures of itself into its message of step `k`, and what it then knows of itself."""
    slot, sigma = k % b.newest.shape[0], r[R_POSITION_SIGMA]
    for i in range(x.shape[0]):
        noise[0] = noise[1] = noise[2] = 0.0
        if sigma > 0.0:
            fill_normals(seed, _NOISE_SET, encounter, 1 + i, k, noise)
        age = t - b.known[i, 6]
        share = p[i, pair.P_SMOOTHING] if k > 0 else 1.0
        for c in range(3):
            measured = x[i, c] + sigma * noise[c]
            expected = b.known[i, c] + age * b.known[i, 3 + c] if k > 0 else measured
            b.known[i, c] = expected + share * (measured - expected)
            b.sent[slot, i, c], b.sent[slot, i, 3 + c] = measured, x[i, 3 + c]
        for c in range(3):
            b.known[i, 3 + c] = x[i, 3 + c]
        b.known[i, 6] = t
        b.sent[slot, i, 6], b.sent[slot, i, 7] = wanted[i], t
        if r[R_ABSURD] > 0.0:
            fill_uniforms(seed, _NOISE_SET, encounter, 0, k * x.shape[0] + i, noise)
            if noise[0] < r[R_ABSURD]:
                b.sent[slot, i, 0] = math.nan if noise[1] < 0.5 else b.sent[slot, i, 0] + _ABSURD_SHIFT


def make_buffers(n: int, ring: int, participants: int | None = None) -> Buffers:
    """Return buffers for `n` vehicles, a ring of `ring` steps, and by default no participants but the vehicles."""
    q = n if participants is None else participants
    return Buffers(
        sent=np.zeros((ring, n, 8)),
        newest=np.full((ring, q, q), -1, np.int64),
        last=np.full((q, q), -1, np.int64),
        rejected=np.zeros((q, q), np.int64),
        received=np.zeros((q, n, 8)),
        known=np.zeros((n, 7)),
        views=np.zeros((n, multi.N_VIEW)),
        use=np.zeros(n),
        bounds=np.zeros((n, 3)),
        order=np.zeros(n, np.int64),
        level=np.zeros((n, 2)),
        preferred=np.zeros(3),
        held=np.zeros(3),
        best=np.zeros(4),
    )


def make_results(n: int, events: int, logged: int) -> Results:
    """Return results for `n` vehicles, with room for so many events and lines of log."""
    return Results(
        separation=np.full((n, n), np.inf),
        separation_time=np.zeros((n, n)),
        drift=np.zeros((n, 2)),
        aside=np.zeros(n),
        late=np.zeros(n),
        counters=np.zeros((n, N_COUNTERS), np.int64),
        events=np.zeros((events, N_EVENT)),
        log=np.zeros((logged, n, N_LOG)),
        log_separation=np.zeros(logged),
    )


def warmup() -> None:
    """Compile what is called from Python."""
    reset(make_buffers(2, 4), make_results(2, 1, 1))
    put(make_buffers(2, 4), make_results(2, 1, 1), 1, 1, 0, 1)
    r, u = np.ones(N_RUN), np.empty(4)
    carry(1, 1, 0.1, 0, 1, 1, 1, r, make_buffers(2, 4), make_results(2, 1, 1), u)
    send(1, 0.1, 1, 1, r, make_buffers(2, 4, 3), make_results(2, 1, 1), u)
    ones = np.ones((2, pair.N_SETTINGS))
    navigate(1, 0.1, np.ones((2, 6)), np.ones(2), ones, r, 1, 1, u, make_buffers(2, 4))
