"""How one aircraft moves under several hypotheses, and how they exchange what they know (interacting multiple model).

All have position, velocity and acceleration (NED, 9 states), so that mixing needs no change of coordinates:

- straight (0): constant velocity with little noise; the acceleration is zero and its rows are not used;
- gentle and hard (1, 2): the acceleration keeps its part along the path and turns with the path, which is the turning
  model of thesis (3.48) written without angles; noise acts on the jerk. They differ in how large an acceleration they
  expect: a slight curve is poor evidence for a hard turn, and would be taken for straight flight until far too late.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import congruence
from wideberth.tracking.motion_kernels import CONSTANT_ACCELERATION, CONSTANT_VELOCITY, add_process_noise

FloatArray = NDArray[np.float64]

STRAIGHT = 0
HYPOTHESES = 3

LONGEST_STEP_S = 0.25
"""Longer predictions of the turning model are made in steps of at most this."""

SLOW_MPS = 3.0
"""Below about this speed a path has no direction to turn: the acceleration simply stays."""


@jit_uncounted
def turning_transition(dt: float, x: FloatArray, f: FloatArray) -> None:
    """Take a turning state (9) `dt` further in place and write the Jacobian (9, 9) of that step.

    The jerk j = w x (a + a_t u), with w = v x a / v^2 and a_t u the part of a along the path, is what turning
    acceleration and thesis (3.48) have in common; with b = v.a and s = v.v it is (2 b/s) a - (a.a/s + b^2/s^2) v.
    """
    s = SLOW_MPS * SLOW_MPS
    b, a2 = 0.0, 0.0
    for i in range(3):
        s += x[3 + i] * x[3 + i]
        b += x[3 + i] * x[6 + i]
        a2 += x[6 + i] * x[6 + i]
    s1, s2, s3 = 1.0 / s, 1.0 / (s * s), 1.0 / (s * s * s)
    k = a2 * s1 + b * b * s2
    w1, w2, w3 = dt, dt * dt / 2.0, dt * dt * dt / 6.0
    for i in range(9):
        for j in range(9):
            f[i, j] = 1.0 if i == j else 0.0
    for i in range(3):
        v, a = x[3 + i], x[6 + i]
        f[i, 3 + i] += w1
        f[i, 6 + i] += w2
        f[3 + i, 6 + i] += w1
        for j in range(3):
            vj, aj = x[3 + j], x[6 + j]
            to_v = 2.0 * s1 * a * aj - 4.0 * b * s2 * a * vj
            to_v -= v * (-2.0 * a2 * s2 * vj + 2.0 * b * s2 * aj - 4.0 * b * b * s3 * vj)
            to_a = 2.0 * s1 * a * vj - v * (2.0 * s1 * aj + 2.0 * b * s2 * vj)
            if i == j:
                to_v -= k
                to_a += 2.0 * b * s1
            f[i, 3 + j] += w3 * to_v
            f[i, 6 + j] += w3 * to_a
            f[3 + i, 3 + j] += w2 * to_v
            f[3 + i, 6 + j] += w2 * to_a
            f[6 + i, 3 + j] += w1 * to_v
            f[6 + i, 6 + j] += w1 * to_a
    for i in range(3):
        v, a = x[3 + i], x[6 + i]
        jerk = 2.0 * b * s1 * a - k * v
        x[i] += w1 * v + w2 * a + w3 * jerk
        x[3 + i] += w1 * a + w2 * jerk
        x[6 + i] += w1 * jerk


@jit_uncounted
def predict_straight(dt: float, q: FloatArray, x: FloatArray, p: FloatArray) -> None:
    """Take position, velocity and covariance (leading 6 states) of the straight hypothesis `dt` further in place."""
    for i in range(3):
        x[i] += dt * x[3 + i]
        for j in range(i + 1):
            p[i, j] += dt * (p[i, 3 + j] + p[3 + i, j] + dt * p[3 + i, 3 + j])
            p[j, i] = p[i, j]
    for i in range(3):
        for j in range(3):
            p[i, 3 + j] += dt * p[3 + i, 3 + j]
            p[3 + j, i] = p[i, 3 + j]
    add_process_noise(CONSTANT_VELOCITY, dt, q, p)


@jit_uncounted
def predict_turning(dt: float, q: FloatArray, x: FloatArray, p: FloatArray, f: FloatArray, work: FloatArray) -> None:
    """Take state and covariance of the turning hypothesis `dt` further in place; `f` and `work` are (9, 9)."""
    steps = max(1, math.ceil(abs(dt) / LONGEST_STEP_S - 1e-9))
    for _ in range(steps):
        turning_transition(dt / steps, x, f)
        congruence(f, p, 9, 9, work, p)
        add_process_noise(CONSTANT_ACCELERATION, dt / steps, q, p)


@jit_uncounted
def mix(
    stay: FloatArray,
    least: float,
    acceleration_variance: FloatArray,
    mu: FloatArray,
    x: FloatArray,
    p: FloatArray,
    weight: FloatArray,
    mixed: FloatArray,
    spread: FloatArray,
) -> None:
    """Mix the hypotheses in place, as the interacting multiple model does before a prediction.

    Shares below `least` change the probabilities but not the states: else the straight hypothesis would be blurred at
    every step by maneuvers that nobody believes in, and would be no better than a far noisier one.

    Parameters
    ----------
    stay : ndarray, shape (HYPOTHESES,)
        Probability that an aircraft goes on as it does, over the step; the others are as likely as each other.
    least : float
        Smallest share that is mixed in.
    acceleration_variance : ndarray, shape (HYPOTHESES,)
        Of each component of the acceleration of an aircraft that begins to maneuver, m2/s4.
    mu : ndarray, shape (HYPOTHESES,)
        Probabilities of the hypotheses; become the predicted ones.
    x : ndarray, shape (HYPOTHESES, 9)
    p : ndarray, shape (HYPOTHESES, 9, 9)
    weight : ndarray, shape (HYPOTHESES, HYPOTHESES)
    mixed : ndarray, shape (HYPOTHESES, 9)
    spread : ndarray, shape (HYPOTHESES, 9, 9)
        All three written over.
    """
    for j in range(HYPOTHESES):
        total = 0.0
        for i in range(HYPOTHESES):
            share = stay[i] if i == j else (1.0 - stay[i]) / (HYPOTHESES - 1)
            weight[i, j] = mu[i] * share
            total += weight[i, j]
        kept = 0.0
        for i in range(HYPOTHESES):
            weight[i, j] /= total
            if weight[i, j] < least:
                weight[i, j] = 0.0
            kept += weight[i, j]
        for i in range(HYPOTHESES):
            weight[i, j] /= kept
        mixed[j, 0] = total
    for j in range(HYPOTHESES):
        mu[j] = mixed[j, 0]
    for j in range(HYPOTHESES):
        if weight[j, j] == 1.0:
            continue
        states = 6 if j == STRAIGHT else 9
        for a in range(states):
            mixed[j, a] = 0.0
            for i in range(HYPOTHESES):
                mixed[j, a] += weight[i, j] * x[i, a]
        for a in range(states):
            for b in range(a + 1):
                value = 0.0
                for i in range(HYPOTHESES):
                    w = weight[i, j]
                    if w == 0.0:
                        continue
                    value += w * (p[i, a, b] + (x[i, a] - mixed[j, a]) * (x[i, b] - mixed[j, b]))
                    if a == b and a >= 6:
                        value += w * max(acceleration_variance[j] - acceleration_variance[i], 0.0)
                spread[j, a, b] = value
    for j in range(HYPOTHESES):
        if weight[j, j] == 1.0:
            continue
        states = 6 if j == STRAIGHT else 9
        for a in range(states):
            x[j, a] = mixed[j, a]
            for b in range(a + 1):
                p[j, a, b] = spread[j, a, b]
                p[j, b, a] = spread[j, a, b]


@jit_uncounted
def combine(
    least: float,
    straight_variance: float,
    mu: FloatArray,
    x: FloatArray,
    p: FloatArray,
    share: FloatArray,
    out: FloatArray,
    covariance: FloatArray,
) -> None:
    """Write the mean (9) and covariance (9, 9) of all hypotheses together.

    Parameters
    ----------
    least : float
        Hypotheses less likely than this are left out.
    straight_variance : float
        Of the acceleration's components of an aircraft that flies straight, m2/s4.
    mu : ndarray, shape (HYPOTHESES,)
    x : ndarray, shape (HYPOTHESES, 9)
        The acceleration of the straight hypothesis must be zero, and its covariance.
    p : ndarray, shape (HYPOTHESES, 9, 9)
    share : ndarray, shape (HYPOTHESES,)
        Written over.
    out : ndarray, shape (9,)
    covariance : ndarray, shape (9, 9)
    """
    total = 0.0
    for j in range(HYPOTHESES):
        share[j] = mu[j] if mu[j] >= least else 0.0
        total += share[j]
    for j in range(HYPOTHESES):
        share[j] /= total
    for a in range(9):
        out[a] = 0.0
        for j in range(HYPOTHESES):
            out[a] += share[j] * x[j, a]
    for a in range(9):
        for b in range(a + 1):
            value = 0.0
            for j in range(HYPOTHESES):
                if share[j] > 0.0:
                    value += share[j] * (p[j, a, b] + (x[j, a] - out[a]) * (x[j, b] - out[b]))
            if a == b and a >= 6:
                value += share[STRAIGHT] * straight_variance
            covariance[a, b] = value
            covariance[b, a] = value


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    x, p, q, work = np.ones((n, 9)), np.stack([np.eye(9)] * n), np.ones(3), np.zeros((9, 9))
    mu, square = np.full(n, 1.0 / n), np.zeros((n, n))
    turning_transition(0.1, x[1], work)
    predict_straight(0.1, q, x[0], p[0])
    predict_turning(0.1, q, x[1], p[1], np.zeros((9, 9)), work)
    mix(np.full(n, 0.9), 0.01, np.ones(n), mu, x, p, square, np.zeros((n, 9)), np.zeros((n, 9, 9)))
    combine(0.01, 0.01, mu, x, p, np.zeros(n), np.zeros(9), work)
