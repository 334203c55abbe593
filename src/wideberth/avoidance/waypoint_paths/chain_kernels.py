"""The chain: unit masses joined by springs and dampers that settle in a field of forces (thesis 4.4; errata)."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.keep_out.kernels import N_VOLUME, volumes_entered
from wideberth.avoidance.waypoint_paths.intruder_kernels import (
    DOWN,
    HALF_HEIGHT,
    N_INTRUDER,
    RADIUS,
    V_DOWN,
    state_at,
)
from wideberth.vehicles.kernels import wrap_angle

Floats = NDArray[np.float64]

# Parameters, named as in the thesis; SI, rad.
K, K_SH, K_SV, KAPPA, B, K_B, THETA_MAX, LAMBDA, GAMMA_MAX, F_MAX, DELTA_1, DELTA_2, REST_LENGTH = range(13)
SPEED, FLOOR, CEILING, STEP, SETTLED, STEPS_MAX = 13, 14, 15, 16, 17, 18
N_CHAIN = 19


@jit_uncounted
def repulsion(x: float, x0: float, x1: float, k: float, f_max: float) -> float:
    """Return phi(x): f_max inside x0, falling as K (1/(x - x0) - 1/(x1 - x0)) to zero at x1."""
    if x <= x0:
        return f_max
    return max(0.0, min(f_max, k * (1.0 / (x - x0) - 1.0 / (x1 - x0))))


@jit_uncounted
def taper(x: float, x0: float, x1: float) -> float:
    """Return 1 inside x0, falling to 0 at x1: with it a force also fades where the other distance leaves the zone."""
    return max(0.0, min(1.0, (x1 - x) / (x1 - x0)))


@jit_uncounted
def threat_force(
    pn: float, pe: float, pd: float, t: float, right_n: float, right_e: float, row: Floats, chain: Floats
) -> tuple[float, float, float]:
    """Return the force of one intruder on a mass at a place at a time: away from it, and behind it (thesis eq. 4.17).

    Parameters
    ----------
    pn, pe, pd : float
        Local NED, m.
    t : float
        s from now.
    right_n, right_e : float
        Where to go from exactly the same place: a unit vector to the right of the path.
    row : ndarray, shape (N_INTRUDER,)
    chain : ndarray, shape (N_CHAIN,)
    """
    reach, reach_v = chain[DELTA_1] * row[RADIUS], chain[DELTA_2] * row[HALF_HEIGHT]
    if abs(pd - (row[DOWN] + row[V_DOWN] * t)) >= reach_v:
        return 0.0, 0.0, 0.0
    xn, xe, xd, vn, ve, vd = state_at(row, t)
    dn, de, dd = pn - xn, pe - xe, pd - xd
    if dn * dn + de * de >= reach * reach:
        return 0.0, 0.0, 0.0
    distance, height = math.hypot(dn, de), abs(dd)
    taper_h, taper_v = taper(distance, row[RADIUS], reach), taper(height, row[HALF_HEIGHT], reach_v)
    away_n, away_e = (dn / distance, de / distance) if distance > 1e-6 else (right_n, right_e)
    level = repulsion(distance, row[RADIUS], reach, chain[K_SH], chain[F_MAX]) * taper_v
    vertical = 0.0
    if chain[K_SV] > 0.0:
        # At the same height: up.
        sign = 1.0 if dd > 0.0 else -1.0
        vertical = sign * repulsion(height, row[HALF_HEIGHT], reach_v, chain[K_SV], chain[F_MAX]) * taper_h
    behind = -chain[K_B] / max(math.sqrt(dn * dn + de * de + dd * dd), 1.0) * taper_h * taper_v
    if chain[K_SV] == 0.0:
        vd = 0.0
    return level * away_n + behind * vn, level * away_e + behind * ve, vertical + behind * vd


@jit
def chain_forces(
    points: Floats,
    velocities: Floats,
    n: int,
    course: float,
    intruders: Floats,
    count: int,
    chain: Floats,
    times: Floats,
    force: Floats,
) -> None:
    """Write the forces on the masses of a chain.

    Parameters
    ----------
    points, velocities : ndarray, shape (>= n, 3)
        Local NED; the first and the last mass are held.
    n : int
    course : float
        Of the ownship at the first mass, rad; NaN where it has none.
    intruders, count, chain
        As for `relax`.
    times : ndarray, shape (>= n,)
        Overwritten with when the ownship is at each mass, s from now.
    force : ndarray, shape (>= n, 3)
        Overwritten.
    """
    force[:n] = 0.0
    times[0] = 0.0
    for i in range(n - 1):
        en, ee = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        ed = points[i + 1, 2] - points[i, 2]
        length = math.sqrt(en * en + ee * ee + ed * ed)
        times[i + 1] = times[i] + length / chain[SPEED]
        pull = chain[K] * (length - chain[REST_LENGTH]) / max(length, 1e-6)
        for c in range(3):
            e = points[i + 1, c] - points[i, c]
            pair = pull * e + chain[B] * (velocities[i + 1, c] - velocities[i, c])
            force[i, c] += pair
            force[i + 1, c] -= pair
        slope = math.atan2(-ed, math.hypot(en, ee))
        if abs(slope) > chain[GAMMA_MAX]:
            lift = math.copysign(chain[LAMBDA] * (abs(slope) - chain[GAMMA_MAX]), slope)
            force[i, 2] -= lift
            force[i + 1, 2] += lift
    mean_time = times[n - 1] / (n - 1)
    before = course
    for i in range(n - 1):
        en, ee = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        after = math.atan2(ee, en)
        turn = wrap_angle(after - before) if not math.isnan(before) else 0.0
        before = after
        if abs(turn) > chain[THETA_MAX]:
            push = chain[LAMBDA] * (abs(turn) - chain[THETA_MAX])
            if i == 0:
                # The start is held: its turn is made smaller by the next mass, back across the link.
                back = math.copysign(push, turn)
                force[1, 0] += back * math.sin(after)
                force[1, 1] -= back * math.cos(after)
            else:
                mn = 0.5 * (points[i - 1, 0] + points[i + 1, 0]) - points[i, 0]
                me = 0.5 * (points[i - 1, 1] + points[i + 1, 1]) - points[i, 1]
                size = max(math.hypot(mn, me), 1e-6)
                mn, me = push * mn / size, push * me / size
                force[i, 0] += mn
                force[i, 1] += me
                for k in (i - 1, i + 1):
                    force[k, 0] -= 0.5 * mn
                    force[k, 1] -= 0.5 * me
        if i == 0:
            continue
        for c in range(3):
            force[i, c] += chain[KAPPA] * (0.5 * (points[i - 1, c] + points[i + 1, c]) - points[i, c])
        fn = fe = fd = 0.0
        right_n, right_e = -math.sin(after), math.cos(after)
        for m in range(count):
            for k in range(-1, 2):
                n_, e_, d_ = threat_force(
                    points[i, 0], points[i, 1], points[i, 2], times[i] + k * mean_time,
                    right_n, right_e, intruders[m], chain,
                )  # fmt: skip
                fn, fe, fd = fn + n_, fe + e_, fd + d_
        total = math.sqrt(fn * fn + fe * fe + fd * fd)
        share = min(1.0, chain[F_MAX] / total) if total > 0.0 else 0.0
        force[i, 0] += share * fn
        force[i, 1] += share * fe
        force[i, 2] += share * fd


@jit
def relax(
    points: Floats,
    n: int,
    course: float,
    intruders: Floats,
    count: int,
    volumes: Floats,
    vertices: Floats,
    chain: Floats,
    velocities: Floats,
    force: Floats,
    times: Floats,
) -> int:
    """Let a chain settle, in place (semi-implicit Euler), and return the number of steps.

    Parameters
    ----------
    points : ndarray, shape (>= n, 3)
        The masses, local NED, m; the first and the last are held.
    n : int
    course : float
        rad.
    intruders : ndarray, shape (>= count, N_INTRUDER)
    count : int
    volumes, vertices : ndarray
        Keep-out volumes: a mass that would enter one, or whose link before it would, stays where it is.
    chain : ndarray, shape (N_CHAIN,)
    velocities, force, times : ndarray, shape (>= n, 3), (>= n, 3), (>= n,)
        Overwritten; `times` is when the ownship is at each mass, s from now.
    """
    velocities[:n] = 0.0
    dt = chain[STEP]
    steps = 0
    while steps < chain[STEPS_MAX]:
        chain_forces(points, velocities, n, course, intruders, count, chain, times, force)
        fastest = 0.0
        for i in range(1, n - 1):
            for c in range(3):
                velocities[i, c] += force[i, c] * dt
            pn = points[i, 0] + velocities[i, 0] * dt
            pe = points[i, 1] + velocities[i, 1] * dt
            # A height outside the limits (a start below the floor) may only come nearer to them.
            lowest, highest = max(-chain[FLOOR], points[i, 2]), min(-chain[CEILING], points[i, 2])
            pd = max(highest, min(lowest, points[i, 2] + velocities[i, 2] * dt))
            a, b = points[i - 1], points[i + 1]
            if volumes.shape[0] > 0 and (
                volumes_entered(a[0], a[1], a[2], pn, pe, pd, volumes, vertices) > 0
                or volumes_entered(pn, pe, pd, b[0], b[1], b[2], volumes, vertices) > 0
            ):
                velocities[i, 0] = velocities[i, 1] = velocities[i, 2] = 0.0
                continue
            points[i, 0], points[i, 1], points[i, 2] = pn, pe, pd
            fastest = max(fastest, math.sqrt(velocities[i, 0] ** 2 + velocities[i, 1] ** 2 + velocities[i, 2] ** 2))
        steps += 1
        if fastest < chain[SETTLED]:
            break
    times[0] = 0.0
    for i in range(n - 1):
        times[i + 1] = (
            times[i]
            + math.sqrt(
                (points[i + 1, 0] - points[i, 0]) ** 2
                + (points[i + 1, 1] - points[i, 1]) ** 2
                + (points[i + 1, 2] - points[i, 2]) ** 2
            )
            / chain[SPEED]
        )
    return steps


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    points, buffers = np.zeros((3, 3)), np.zeros((2, 3, 3))
    relax(
        points, 3, 0.0, np.ones((1, N_INTRUDER)), 1, np.zeros((0, N_VOLUME)), np.zeros((0, 2)), np.ones(N_CHAIN),
        buffers[0], buffers[1], np.zeros(3),
    )  # fmt: skip
