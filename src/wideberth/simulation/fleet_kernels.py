"""Compiled fleet of helicopters that avoid each other by messages (CAS thesis, 4.2.3, 4.3): decisions and motion.

m, m/s, s, NED.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import maneuver_kernels as maneuver
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.simulation import fleet_message_kernels as messages
from wideberth.simulation.fleet_message_kernels import Buffers, Results, make_buffers, make_results
from wideberth.vehicles import rotorcraft_kernels as rotorcraft

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@jit_uncounted
def level_of(i: int, wanted: float, own: FloatArray, p: FloatArray, b: Buffers) -> float:
    """Return the position down assigned to vehicle `i`: all known vehicles in order of the altitude wanted, spread.

    Those that want nearly the same altitude are moved apart around their mean to the protected distance (pooling of
    neighbours), so that everybody who knows the same finds the same levels.
    """
    n, count = b.use.shape[0], 0
    gap = p[pair.P_SEPARATION]
    b.views[i, multi.V_WANTED] = wanted
    for j in range(n):
        if j != i and b.use[j] == 0.0:
            continue
        at = count
        while at > 0 and b.views[b.order[at - 1], multi.V_WANTED] > b.views[j, multi.V_WANTED]:
            b.order[at] = b.order[at - 1]
            at -= 1
        b.order[at] = j
        count += 1
    # Levels rise by `gap` at least: monotone regression of wanted - gap * rank.
    blocks = 0
    for rank in range(count):
        total, size = b.views[b.order[rank], multi.V_WANTED] - gap * rank, 1.0
        while blocks > 0 and b.bounds[blocks - 1, 0] / b.bounds[blocks - 1, 1] > total / size:
            blocks -= 1
            total, size = total + b.bounds[blocks, 0], size + b.bounds[blocks, 1]
        b.bounds[blocks, 0], b.bounds[blocks, 1] = total, size
        blocks += 1
    rank = 0
    for k in range(blocks):
        for _ in range(int(b.bounds[k, 1])):
            if b.order[rank] == i:
                level = b.bounds[k, 0] / b.bounds[k, 1] + gap * rank
                return float(min(level, max(p[pair.P_LOWEST], own[2])))
            rank += 1
    return wanted


@jit_uncounted
def decide(
    i: int, start: FloatArray, wanted: float, p: FloatArray, reason: int, command: float, target: int, b: Buffers
) -> tuple[int, float, int]:
    """Return reason, velocity down and the vehicle avoided, of vehicle `i`, and write its horizontal command.

    `start` (6) is its state at the start, `p` are its settings.
    """
    own = b.known[i]
    guidance = pair.guidance_rate(own[2], wanted, p)
    controller = p[pair.P_CONTROLLER]
    if controller == pair.MANEUVERS and p[pair.P_DISABLE] == 0.0:
        b.held[0], b.held[1], b.held[2] = b.level[i, 0], b.level[i, 1], command
        maneuver.preferred_velocity(own, start, wanted, p, b.preferred)
        reason, target = maneuver.choose_velocity(
            own, i, wanted, reason != pair.NO_REASON, b.preferred, b.held, b.views, b.use, p, b.bounds, b.best
        )
        b.level[i, 0], b.level[i, 1] = b.best[0], b.best[1]
        return reason, b.best[2], target
    if controller == pair.NONE or p[pair.P_DISABLE] > 0.0:
        return pair.NO_REASON, guidance, -1
    if controller == pair.INTERVAL:
        return multi.interval_rate(own, i, wanted, guidance, reason != pair.NO_REASON, b.views, b.use, p, b.bounds)
    avoiding = reason != pair.NO_REASON
    j = target
    if controller != pair.BANG_BANG or not avoiding or b.use[target] == 0.0:
        j = multi.most_critical(own, b.views, b.use, p)
    if j < 0:
        return pair.NO_REASON, guidance, -1
    px, py, pz = own[0] - b.views[j, 0], own[1] - b.views[j, 1], own[2] - b.views[j, 2]
    vx, vy, other_w = own[3] - b.views[j, 3], own[4] - b.views[j, 4], b.views[j, 5]
    if controller == pair.ALTITUDES:
        t, d = pair.closest_point(px, py, pz, vx, vy, guidance - other_w)
        if d > p[pair.P_SEPARATION] or not t < p[pair.P_T_STAR_MIN]:
            t, d = pair.closest_point(px, py, pz, vx, vy, own[5] - other_w)
            if d > p[pair.P_SEPARATION] or not t < p[pair.P_T_STAR_MIN]:
                return pair.NO_REASON, guidance, -1
        level = level_of(i, wanted, own, p, b)
        return pair.CURRENT, pair.limited(p[pair.P_GAIN] * (level - own[2]), p[pair.P_UP], p[pair.P_DOWN]), j
    if controller == pair.BANG_BANG:
        reason, command, _, _ = pair.bang_bang(
            own[2], own[5], other_w, px, py, pz, vx, vy, guidance, avoiding, command, i < j, p
        )
    else:
        reason, command, _, _ = pair.continuous(
            own[2], own[5], other_w, px, py, pz, vx, vy, guidance, avoiding, i < j, p
        )
    return reason, command, j


@jit_uncounted
def measure(t: float, x: FloatArray, start: FloatArray, wanted: FloatArray, results: Results) -> float:
    """Update least separations and drifts at time `t`, and return the least distance of any pair now."""
    n = x.shape[0]
    least = math.inf
    for i in range(n):
        north, east = start[i, 0] + start[i, 3] * t - x[i, 0], start[i, 1] + start[i, 4] * t - x[i, 1]
        speed = math.hypot(start[i, 3], start[i, 4])
        if speed > 0.0:
            behind = (north * start[i, 3] + east * start[i, 4]) / speed
            results.late[i] = max(results.late[i], behind)
            results.aside[i] = max(results.aside[i], abs(north * start[i, 4] - east * start[i, 3]) / speed)
        else:
            results.aside[i] = max(results.aside[i], math.hypot(north, east))
        drift = x[i, 2] - wanted[i]
        results.drift[i, 0] = max(results.drift[i, 0], -drift)
        results.drift[i, 1] = max(results.drift[i, 1], drift)
        for j in range(i + 1, n):
            dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
            squared = dx * dx + dy * dy + dz * dz
            least = min(least, squared)
            if squared < results.separation[i, j] * results.separation[i, j]:
                results.separation[i, j] = results.separation[j, i] = math.sqrt(squared)
                results.separation_time[i, j] = results.separation_time[j, i] = t
    return math.sqrt(least)


@jit_uncounted
def record(
    i: int, t: float, reason: int, rate: float, target: int, events: int, open_events: IntArray, results: Results
) -> int:
    """Open, continue or close the record of vehicle `i`'s avoidance, and return how many there were."""
    at = open_events[i]
    if reason == pair.NO_REASON:
        if at >= 0:
            results.events[at, messages.E_END] = t
        open_events[i] = -1
        return events
    if at == -1:
        if events < results.events.shape[0]:
            row = results.events[events]
            row[messages.E_VEHICLE], row[messages.E_OTHER], row[messages.E_REASON] = (
                float(i),
                float(target),
                float(reason),
            )
            row[messages.E_START], row[messages.E_END], row[messages.E_FIRST_RATE], row[messages.E_LARGEST_RATE] = (
                t,
                math.nan,
                rate,
                rate,
            )
            open_events[i] = events
        else:
            open_events[i] = -2  # no room: only counted
        return events + 1
    if at >= 0 and abs(rate) > abs(results.events[at, messages.E_LARGEST_RATE]):
        results.events[at, messages.E_LARGEST_RATE] = rate
    return events


@jit_uncounted
def avoid(
    i: int,
    t: float,
    start: FloatArray,
    wanted: FloatArray,
    p: FloatArray,
    r: FloatArray,
    reasons: IntArray,
    targets: IntArray,
    commands: FloatArray,
    open_events: IntArray,
    events: int,
    b: Buffers,
    results: Results,
) -> int:
    """Let vehicle `i` decide on what it has received, keep count, and return how many avoidances there were."""
    messages.see(i, t, start, wanted, r, p, b, results)
    before, rate = reasons[i], commands[i]
    reasons[i], commands[i], targets[i] = decide(i, start[i], wanted[i], p[i], before, rate, targets[i], b)
    if (before != pair.NO_REASON) != (reasons[i] != pair.NO_REASON):
        results.counters[i, messages.SWITCHES] += 1
    if rate * commands[i] < 0.0 and before != pair.NO_REASON and reasons[i] != pair.NO_REASON:
        results.counters[i, messages.REVERSALS] += 1
    return record(i, t, reasons[i], commands[i], targets[i], events, open_events, results)


@jit_uncounted
def move(
    i: int, x: FloatArray, start: FloatArray, commands: FloatArray, q: FloatArray, dt: float, u: FloatArray, b: Buffers
) -> None:
    """Fly vehicle `i` on by `dt` by its commands; `u` (4) is scratch."""
    u[0], u[1], u[2] = b.level[i, 0], b.level[i, 1], commands[i]
    rotorcraft.rotorcraft_step(x[i], u, math.atan2(start[i, 4], start[i, 3]), q[i], dt)


@jit_uncounted
def fly(
    x: FloatArray,
    start: FloatArray,
    wanted: FloatArray,
    p: FloatArray,
    q: FloatArray,
    r: FloatArray,
    seed: int,
    encounter: int,
    steps: int,
    log_every: int,
    reasons: IntArray,
    targets: IntArray,
    commands: FloatArray,
    open_events: IntArray,
    scratch: FloatArray,
    b: Buffers,
    results: Results,
) -> int:
    """Fly a fleet, and return how many avoidances there were.

    Parameters
    ----------
    x : ndarray, shape (n, 6)
        True states; at the end those then.
    start : ndarray, shape (n, 6)
        The states at the start; without a maneuver that changes it the horizontal velocity is kept.
    wanted : ndarray, shape (n,)
        Position down that each wants to have.
    p, q : ndarray, shape (n, N_SETTINGS) and (n, N_PARAMS)
    r : ndarray, shape (messages.N_RUN,)
    seed, encounter, steps, log_every : int
    reasons, targets, open_events : ndarray of int64, shape (n,)
    commands : ndarray, shape (n,)
    scratch : ndarray, shape (4,)
    b : Buffers
    results : Results
    """
    n = x.shape[0]
    messages.reset(b, results)
    dt, events, logged = r[messages.R_DT], 0, 0
    decide_every, send_every = int(r[messages.R_DECIDE_EVERY]), int(r[messages.R_SEND_EVERY])
    for i in range(n):
        reasons[i], targets[i], commands[i], open_events[i] = pair.NO_REASON, -1, 0.0, -1
        b.level[i, 0], b.level[i, 1] = start[i, 3], start[i, 4]
    least = measure(0.0, x, start, wanted, results)
    for k in range(steps):
        t = k * dt
        if k % decide_every == 0 or k % send_every == 0:
            messages.navigate(k, t, x, wanted, p, r, seed, encounter, scratch, b)
        if k % send_every == 0:
            messages.send(k, t, seed, encounter, r, b, results, scratch)
        messages.receive(k, r, p, b, results)
        if k % decide_every == 0:
            for i in range(n):
                events = avoid(i, t, start, wanted, p, r, reasons, targets, commands, open_events, events, b, results)
        if log_every > 0 and k % log_every == 0 and logged < results.log.shape[0]:
            for i in range(n):
                for c in range(6):
                    results.log[logged, i, c] = x[i, c]
                results.log[logged, i, messages.L_COMMAND], results.log[logged, i, messages.L_REASON] = (
                    commands[i],
                    float(reasons[i]),
                )
            results.log_separation[logged] = least
            logged += 1
        for i in range(n):
            move(i, x, start, commands, q, dt, scratch, b)
        least = measure((k + 1) * dt, x, start, wanted, results)
    for i in range(n):
        if open_events[i] >= 0:
            results.events[open_events[i], messages.E_END] = steps * dt
    return events


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    n = 2
    x, p, q, r = (
        np.ones((n, 6)),
        np.ones((n, pair.N_SETTINGS)),
        np.ones((n, rotorcraft.N_PARAMS)),
        np.ones(messages.N_RUN),
    )
    ints, floats = np.zeros(n, np.int64), np.zeros(n)
    move(0, x, x.copy(), floats.copy(), q, 0.1, np.zeros(4), make_buffers(n, 4))
    measure(0.0, x, x.copy(), floats, make_results(n, 4, 2))
    avoid(
        0, 0.1, x, floats, p, r, ints.copy(), ints.copy(), floats.copy(), ints.copy(), 0,
        make_buffers(n, 4), make_results(n, 4, 2),
    )  # fmt: skip
    messages.receive(0, r, p, make_buffers(n, 4), make_results(n, 4, 2))
    fly(
        x, x.copy(), floats, p, q, r, 1, 1, 2, 1,
        ints, ints.copy(), ints.astype(float), ints.copy(), np.zeros(4), make_buffers(n, 4), make_results(n, 4, 2),
    )  # fmt: skip
