"""What places cost among the intruders, laid out for a search that asks for it many thousand times.

The cost is that of `kernels.risk_at`. Its two parts are taken apart: the volumes, which few intruders have where the
ownship can get to from one place in one ring of the map, and the cost of being near, which all have but which hardly
differs between the ways from there. So most ways are given up by the first part and a bound of the second.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.avoidance.kernels import (
    GROWTH_H,
    GROWTH_V,
    HARD_HEIGHT,
    HARD_RADIUS,
    N_PREDICTION,
    N_RISK,
    NEAR_MIN,
    OUTER_HEIGHT,
    OUTER_RADIUS,
    OUTER_TAU,
    WEIGHT_NEAR,
    altitude_risk,
    volume_risk,
    widened,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns: position, velocity, the outer volume, what its scaled distance takes, weights, deviations.
NORTH, EAST, DOWN, SPEED_NORTH, SPEED_EAST = 0, 1, 2, 3, 4
R_OUTER, Z_OUTER, INVERSE_R2, INVERSE_Z2 = 5, 6, 7, 8
NEAR, WEIGHT, SIGMA_H, SIGMA_V = 9, 10, 11, 12
H_REACH, Z_REACH = 13, 14  # m horizontally, and vertically, beyond which the intruder has no volume
N_COLUMN = 15


class Traffic(NamedTuple):
    """The intruders at each grid time.

    Attributes
    ----------
    columns : ndarray, shape (times, N_COLUMN, m)
        At each time the first ``present`` of the last axis.
    present : ndarray of int, shape (times,)
    smallest : ndarray, shape (times, 2)
        The smallest outer radius and half-height, m.
    """

    columns: Floats
    present: Integers
    smallest: Floats


class Around(NamedTuple):
    """What one place's surroundings hold at the samples of a ring, and buffers for the way to them.

    Attributes
    ----------
    members : ndarray of int, shape (samples, m)
        Which intruders have a volume that can be got into: the first ``found`` of the last axis.
    found : ndarray of int, shape (samples,)
    near_left, volumes_left : ndarray, shape (samples + 1,)
        The least that being near, and the volumes, cost from each sample on.
    way : ndarray, shape (samples, 3)
        Places at the samples, local NED.
    near : ndarray, shape (m,)
    """

    members: Integers
    found: Integers
    near_left: Floats
    volumes_left: Floats
    way: Floats
    near: Floats


@jit
def lay_out(
    speed: float, intruders: Floats, weight: Floats, n_intruders: int, n_times: int, dt: float, risk: Floats
) -> Traffic:
    """Lay out the intruders that matter at each grid time.

    Parameters
    ----------
    speed : float
        The most that the ownship does horizontally, m/s.
    intruders, weight, n_intruders
        As filled by `prediction_kernels.predict_intruders`.
    n_times : int
    dt : float
        Step of the grid, s.
    risk : ndarray, shape (N_RISK,)
    """
    columns, present = np.empty((n_times, N_COLUMN, n_intruders)), np.zeros(n_times, np.int64)
    smallest = np.full((n_times, 2), math.inf)
    for k in range(n_times):
        t = k * dt
        n = 0
        rows = columns[k]
        for m in range(n_intruders):
            row = intruders[m, k]
            if row[8] == 0.0:
                continue
            z_outer = widened(risk[OUTER_HEIGHT], row[7], risk[GROWTH_V], risk, t)
            r_outer = widened(risk[OUTER_RADIUS], row[6], risk[GROWTH_H], risk, t)
            for j in range(5):
                rows[j, n] = row[j]
            rows[R_OUTER, n], rows[Z_OUTER, n] = r_outer, z_outer
            rows[INVERSE_R2, n], rows[INVERSE_Z2, n] = 1.0 / (r_outer * r_outer), 1.0 / (z_outer * z_outer)
            rows[NEAR, n], rows[WEIGHT, n] = weight[m] * risk[WEIGHT_NEAR], weight[m]
            rows[SIGMA_H, n], rows[SIGMA_V, n] = row[6], row[7]
            # The modified tau is smallest where both fly at each other: (d^2 - r^2) / (d times the closing speed).
            closing = 0.5 * risk[OUTER_TAU] * (speed + math.hypot(row[3], row[4]))
            reach = closing + math.sqrt(closing * closing + r_outer * r_outer)
            rows[H_REACH, n] = max(reach, widened(risk[HARD_RADIUS], row[6], 0.0, risk, t))
            rows[Z_REACH, n] = max(z_outer, widened(risk[HARD_HEIGHT], row[7], 0.0, risk, t))
            smallest[k, 0], smallest[k, 1] = min(smallest[k, 0], r_outer), min(smallest[k, 1], z_outer)
            n += 1
        present[k] = n
    return Traffic(columns, present, smallest)


@jit
def make_around(samples: int, n_intruders: int) -> Around:
    """Return buffers for rings of at most so many samples."""
    return Around(
        np.empty((samples, n_intruders), np.int64),
        np.empty(samples, np.int64),
        np.empty(samples + 1),
        np.empty(samples + 1),
        np.empty((samples, 3)),
        np.empty(n_intruders),
    )


@jit_uncounted
def scaled_distances(pn: float, pe: float, pd: float, rows: Floats, n: int, near: Floats) -> None:
    """Write into `near` how far a place is from each intruder, in outer volumes."""
    # Without branches, so that the compiler does several at once.
    for m in range(n):
        sn, se, sd = rows[NORTH, m] - pn, rows[EAST, m] - pe, rows[DOWN, m] - pd
        near[m] = math.sqrt((sn * sn + se * se) * rows[INVERSE_R2, m] + sd * sd * rows[INVERSE_Z2, m])


@jit_uncounted
def near_risk(pn: float, pe: float, pd: float, farther: float, rows: Floats, n: int, near: Floats) -> float:
    """Return the cost of a second of being near the intruders, were each `farther` away (in outer volumes)."""
    scaled_distances(pn, pe, pd, rows, n, near)
    for m in range(n):
        near[m] = rows[NEAR, m] / max(near[m] + farther, NEAR_MIN)
    cost = 0.0
    for m in range(n):
        cost += near[m]
    return cost


@jit_uncounted
def look_around(
    pn: float,
    pe: float,
    pd: float,
    speed: float,
    climb: float,
    k_start: int,
    stride: int,
    samples: int,
    dt: float,
    traffic: Traffic,
    risk: Floats,
    around: Around,
) -> None:
    """Find what can be met from one place in one ring, sampled at grid times k_start + stride, k_start + 2 stride ...

    Parameters
    ----------
    pn, pe, pd : float
        The place at grid time `k_start`, local NED.
    speed, climb : float
        The most that the ownship does from there, horizontally and vertically, m/s.
    dt : float
        Step of the grid, s.
    traffic : Traffic
    around : Around
        Overwritten.
    """
    around.near_left[samples] = around.volumes_left[samples] = 0.0
    for sample in range(samples - 1, -1, -1):
        elapsed = (sample + 1) * stride * dt
        k = k_start + (sample + 1) * stride
        rows, n = traffic.columns[k], traffic.present[k]
        away, high = speed * elapsed, climb * elapsed
        found = 0
        least = 0.0
        for m in range(n):
            sn, se = rows[NORTH, m] - pn, rows[EAST, m] - pe
            reach = rows[H_REACH, m] + away
            range2, height = sn * sn + se * se, abs(rows[DOWN, m] - pd)
            if range2 > reach * reach or height > rows[Z_REACH, m] + high:
                continue
            around.members[sample, found] = m
            found += 1
            if height + high > rows[Z_REACH, m]:
                continue
            # The risk of volumes falls with distance and height, and grows with the rate at which the distance shrinks.
            farthest = math.sqrt(range2) + away
            closing = sn * rows[SPEED_NORTH, m] + se * rows[SPEED_EAST, m] + farthest * speed
            closing += away * math.hypot(rows[SPEED_NORTH, m], rows[SPEED_EAST, m])
            rate, _ = volume_risk(
                farthest * farthest, height + high, closing, rows[R_OUTER, m], rows[Z_OUTER, m],
                rows[SIGMA_H, m], rows[SIGMA_V, m], k * dt, 1.0, risk,
            )  # fmt: skip
            least += rows[WEIGHT, m] * rate
        around.found[sample] = found
        farther = math.hypot(away / traffic.smallest[k, 0], high / traffic.smallest[k, 1])
        near = near_risk(pn, pe, pd, farther, rows, n, around.near)
        # A billionth is left off, so that rounding makes no bound too high.
        duration = stride * dt * (1.0 - 1e-9)
        around.near_left[sample] = around.near_left[sample + 1] + near * duration
        around.volumes_left[sample] = around.volumes_left[sample + 1] + least * duration


@jit_uncounted
def volumes_risk(
    pn: float,
    pe: float,
    pd: float,
    vn: float,
    ve: float,
    k: int,
    t: float,
    sample: int,
    traffic: Traffic,
    around: Around,
    risk: Floats,
) -> float:
    """Return the cost of a second at a place within reach: all of it but that of being near."""
    rows = traffic.columns[k]
    cost = altitude_risk(-pd, risk)
    for i in range(around.found[sample]):
        m = around.members[sample, i]
        height = abs(rows[DOWN, m] - pd)
        if height > rows[Z_REACH, m]:
            continue
        sn, se = rows[NORTH, m] - pn, rows[EAST, m] - pe
        closing = sn * (rows[SPEED_NORTH, m] - vn) + se * (rows[SPEED_EAST, m] - ve)
        rate, _ = volume_risk(
            sn * sn + se * se, height, closing, rows[R_OUTER, m], rows[Z_OUTER, m],
            rows[SIGMA_H, m], rows[SIGMA_V, m], t, 1.0, risk,
        )  # fmt: skip
        cost += rows[WEIGHT, m] * rate
    return cost


@jit_uncounted
def near_on_way(
    k_start: int, stride: int, samples: int, dt: float, traffic: Traffic, around: Around, bound: float
) -> float:
    """Return the cost of being near along ``around.way``, or infinity once it can only end at `bound` or above."""
    cost = 0.0
    for sample in range(samples):
        k = k_start + (sample + 1) * stride
        p = around.way[sample]
        cost += near_risk(p[0], p[1], p[2], 0.0, traffic.columns[k], traffic.present[k], around.near) * stride * dt
        if cost + around.near_left[sample + 1] >= bound:
            return math.inf
    return cost


def warmup() -> None:
    """Compile what Python calls of this module; `graph_kernels` compiles the rest."""
    lay_out(1.0, np.ones((1, 2, N_PREDICTION)), np.ones(1), 1, 2, 1.0, np.ones(N_RISK))
    make_around(1, 1)
