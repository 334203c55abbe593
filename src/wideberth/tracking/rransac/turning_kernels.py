"""Between linear states and those of the turning model: the hybrids of thesis 6.2.2, and where Gauss-Newton starts."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import congruence
from wideberth.tracking.motion_kernels import CONSTANT_VELOCITY, TURNING, kinematics
from wideberth.tracking.rransac.state_kernels import Settings, Window, Work
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLOWEST_MPS = 0.5
"""Below this the direction of flight says nothing: the angles of slower states are taken as those of this speed."""
FREE_RATES = (1.0, math.radians(8.0), math.radians(3.0))
"""Standard deviations of the rates that a lower-order hypothesis leaves open: m/s2, rad/s, rad/s."""


@jit_uncounted
def start_of_fit(window: Window, subset: IntArray, out: FloatArray) -> None:
    """Write a turning state (9) at the first plot of a subset: the straight line from its earliest plot, no rates."""
    first = subset[1, 0], subset[1, 1]
    if window.t[subset[2, 0]] < window.t[subset[1, 0]]:
        first = subset[2, 0], subset[2, 1]
    here, there = window.position[subset[0, 0], subset[0, 1]], window.position[first[0], first[1]]
    dt = window.t[subset[0, 0]] - window.t[first[0]]
    n, e, d = (here[0] - there[0]) / dt, (here[1] - there[1]) / dt, (here[2] - there[2]) / dt
    ground = math.hypot(n, e)
    for i in range(3):
        out[i] = here[i]
        out[6 + i] = 0.0
    out[3] = math.hypot(ground, d)
    out[4] = math.atan2(e, n)
    out[5] = math.atan2(-d, ground)


@jit_uncounted
def turning_state(x: FloatArray, with_acceleration: bool, out: FloatArray) -> None:
    """Write the turning state (9) of a position, velocity and acceleration (9); without the last the rates are zero."""
    ground = math.hypot(x[3], x[4])
    speed = math.hypot(ground, x[5])
    for i in range(3):
        out[i] = x[i]
        out[6 + i] = 0.0
    out[3] = speed
    out[4] = math.atan2(x[4], x[3])
    out[5] = math.atan2(-x[5], ground)
    if not with_acceleration:
        return
    cc, sc, cg, sg = math.cos(out[4]), math.sin(out[4]), math.cos(out[5]), math.sin(out[5])
    slow, level = max(speed, SLOWEST_MPS), max(abs(cg), 1e-3)
    along = cc * x[6] + sc * x[7]
    out[6] = cg * along - sg * x[8]
    out[7] = (cc * x[7] - sc * x[6]) / (slow * level)
    out[8] = -(sg * along + cg * x[8]) / slow


@jit_uncounted
def turning_jacobian(turning: FloatArray, f: FloatArray, out: FloatArray) -> None:
    """Write the derivatives (9, 9) of a turning state to position, velocity and acceleration.

    The inverse of `kinematics`' Jacobian, by its blocks: with A of the velocity to (V, chi, gamma) and B of the
    acceleration to them, the blocks are A^-1 and -A^-1 B A^-1; A is a rotation times the speeds.
    """
    position, jacobian = out[0], f
    kinematics(TURNING, turning, position, jacobian)
    cc, sc, cg, sg = math.cos(turning[4]), math.sin(turning[4]), math.cos(turning[5]), math.sin(turning[5])
    slow = max(turning[3], SLOWEST_MPS)
    level = slow * max(abs(cg), 1e-3)
    for i in range(9):
        for j in range(9):
            out[i, j] = 1.0 if i == j and i < 3 else 0.0
    for block in range(2):
        o = 3 + 3 * block
        out[o, o], out[o, o + 1], out[o, o + 2] = cc * cg, sc * cg, -sg
        out[o + 1, o], out[o + 1, o + 1] = -sc / level, cc / level
        out[o + 2, o], out[o + 2, o + 1], out[o + 2, o + 2] = -cc * sg / slow, -sc * sg / slow, -cg / slow
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    total += out[3 + i, 3 + k] * jacobian[6 + k, 3 + m] * out[3 + m, 3 + j]
            out[6 + i, 3 + j] = -total


@jit_uncounted
def expect_small_accelerations(s: Settings, x: FloatArray, p: FloatArray, work: Work) -> None:
    """Update a linear state with accelerations of zero, as uncertain as the prior on the turning model's rates.

    A short window leaves accelerations of tens of m/s2 open, with which the turning model's filter diverges.
    """
    if not (s.gn_prior[6] > 0.0 and s.gn_prior[7] > 0.0):
        return
    speed2 = x[3] * x[3] + x[4] * x[4] + x[5] * x[5]
    h, innovation, variance = work.h, work.rows[0, 0:3], work.rows[1, 0:3]
    for i in range(3):
        for j in range(9):
            h[i, j] = 1.0 if j == 6 + i else 0.0
        innovation[i] = -x[6 + i]
        variance[i] = 1.0 / s.gn_prior[6] + speed2 / s.gn_prior[7]
    update(9, 3, x, p, h, innovation, variance, work.rows[2:4])


@jit_uncounted
def to_turning(s: Settings, model: int, work: Work) -> None:
    """Turn `work.best_x` and `work.best_p` of a linear model into those of the turning model (thesis 6.2.2).

    A constant-velocity hypothesis says nothing of the rates: zero, with the spread `FREE_RATES`.
    """
    x, p, jacobian = work.best_x, work.best_p, work.h
    linear = model == CONSTANT_VELOCITY
    if linear:
        for i in range(6, 9):
            x[i] = 0.0
            for j in range(9):
                p[i, j] = 0.0
                p[j, i] = 0.0
    else:
        expect_small_accelerations(s, x, p, work)
    turning_state(x, not linear, work.x)
    turning_jacobian(work.x, work.f, jacobian)
    congruence(jacobian, p, 9, 9, work.square, p)
    for i in range(9):
        x[i] = work.x[i]
    if linear:
        for i in range(3):
            for j in range(9):
                p[6 + i, j] = 0.0
                p[j, 6 + i] = 0.0
            p[6 + i, 6 + i] = FREE_RATES[i] ** 2


def warmup() -> None:
    """Compile what Python calls."""
    x, out, f = np.ones(9), np.zeros(9), np.zeros((9, 9))
    turning_state(x, True, out)
    turning_jacobian(out, f, np.zeros((9, 9)))
