"""Compiled fleet of helicopters that avoid each other by messages (CAS thesis, 4.3): its flight step by step.

m, m/s, s, NED.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.simulation import fleet_decision_kernels as decision
from wideberth.simulation import fleet_hub_kernels as hub_kernels
from wideberth.simulation import fleet_message_kernels as messages
from wideberth.simulation.fleet_hub_kernels import Hub, make_hub
from wideberth.simulation.fleet_message_kernels import Buffers, Results, make_buffers, make_results
from wideberth.vehicles import rotorcraft_kernels as rotorcraft

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
    reasons[i], commands[i], targets[i] = decision.decide(
        i, b.known[i], start[i], wanted[i], p[i], before, rate, targets[i], b.level[i], b
    )
    return settle(i, t, before, rate, reasons, targets, commands, open_events, events, results)


@jit_uncounted
def settle(
    i: int,
    t: float,
    before: int,
    rate: float,
    reasons: IntArray,
    targets: IntArray,
    commands: FloatArray,
    open_events: IntArray,
    events: int,
    results: Results,
) -> int:
    """Count what vehicle `i` now does otherwise than `before`, at `rate`, and return how many avoidances there were."""
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
    hub: Hub,
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
        For n vehicles, or with a hub that decides for n + 1 participants.
    hub : Hub
    results : Results
    """
    n = x.shape[0]
    messages.reset(b, results)
    dt, events, logged = r[messages.R_DT], 0, 0
    central = r[messages.R_CENTRAL] > 0.0
    if central:
        hub_kernels.reset(start, hub)
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
        if central:
            if k % decide_every == 0:
                hub_kernels.decide_for_all(k, t, start, wanted, p, r, seed, encounter, scratch, b, hub, results)
                messages.receive(k, r, p, b, results)  # a command that takes no time
            for i in range(n):
                before, rate = reasons[i], commands[i]
                hub_kernels.obey(i, k, start[i], wanted[i], p[i], r, reasons, targets, commands, b, hub, results)
                events = settle(i, t, before, rate, reasons, targets, commands, open_events, events, results)
        elif k % decide_every == 0:
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
    settle(0, 0.1, 0, 0.0, ints.copy(), ints.copy(), floats.copy(), ints.copy(), 0, make_results(n, 4, 2))
    messages.receive(0, r, p, make_buffers(n, 4), make_results(n, 4, 2))
    fly(
        x, x.copy(), floats, p, q, r, 1, 1, 2, 1,
        ints, ints.copy(), ints.astype(float), ints.copy(), np.zeros(4), make_buffers(n, 4, n + 1),
        make_hub(n, 4), make_results(n, 4, 2),
    )  # fmt: skip
