"""Compiled decisions of one vehicle of a fleet on what is known of all (CAS thesis, 4.2.3, 4.3).

m, m/s, s, NED.
"""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.cas import maneuver_kernels as maneuver
from wideberth.avoidance.cas import multi_kernels as multi
from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.simulation.fleet_message_kernels import Buffers, make_buffers

FloatArray = NDArray[np.float64]


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
    i: int,
    own: FloatArray,
    start: FloatArray,
    wanted: float,
    p: FloatArray,
    reason: int,
    command: float,
    target: int,
    level: FloatArray,
    b: Buffers,
) -> tuple[int, float, int]:
    """Return reason, velocity down and the vehicle avoided, of vehicle `i`, and write its horizontal command.

    `own` (6) is what is known of its state, `start` (6) its state at the start, `p` are its settings, `level` (2) is
    its horizontal command, before and after; the others are the views of `b`.
    """
    guidance = pair.guidance_rate(own[2], wanted, p)
    controller = p[pair.P_CONTROLLER]
    if controller == pair.MANEUVERS and p[pair.P_DISABLE] == 0.0:
        b.held[0], b.held[1], b.held[2] = level[0], level[1], command
        maneuver.preferred_velocity(own, start, wanted, p, b.preferred)
        reason, target = maneuver.choose_velocity(
            own, i, wanted, reason != pair.NO_REASON, b.preferred, b.held, b.views, b.use, p, b.bounds, b.best
        )
        level[0], level[1] = b.best[0], b.best[1]
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
        assigned = level_of(i, wanted, own, p, b)
        return pair.CURRENT, pair.limited(p[pair.P_GAIN] * (assigned - own[2]), p[pair.P_UP], p[pair.P_DOWN]), j
    if controller == pair.BANG_BANG:
        reason, command, _, _ = pair.bang_bang(
            own[2], own[5], other_w, px, py, pz, vx, vy, guidance, avoiding, command, i < j, p
        )
    else:
        reason, command, _, _ = pair.continuous(
            own[2], own[5], other_w, px, py, pz, vx, vy, guidance, avoiding, i < j, p
        )
    return reason, command, j


def warmup() -> None:
    """Compile what is called from Python."""
    one, p, b = np.ones(6), np.ones(pair.N_SETTINGS), make_buffers(2, 4)
    level_of(0, 0.0, one, p, b)
    decide(0, one, one, 0.0, p, 0, 0.0, -1, np.ones(2), b)
