"""Biases that a track's filter accounts for but does not estimate (Schmidt-Kalman, "consider" filter).

The errors of an aircraft's ADS-B positions hardly change from one report to the next: NACp bounds an error with a time
constant of minutes (ADS-B paper, "Error Characterization"), pressure altitude is off by a nearly constant amount, and
so is the uncompensated latency. Averaging would take them for known. So each track that is fed by reports keeps the
covariance C of its state's error with four biases b of covariance B: north, east and down (m), and latency (s). With
z = H x + G b + w, S = H P H' + H C G' + G C' H' + G B G' + R, K = (P H' + C G') / S:

    x += K (z - H x),  P -= K S K',  C -= K (H C + G B),  and b stays zero with covariance B.

Schmidt (1966), Application of state-space methods to navigation problems; Bar-Shalom, Li and Kirubarajan (2001), 8.2.
Estimating the biases would do better where their model is right, but nobody vouches for it: a receiver that changes
its satellites jumps within what NACp allows.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, solve_cholesky
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES, LONGEST_STEP_S, STRAIGHT, turning_transition

FloatArray = NDArray[np.float64]

NORTH, EAST, DOWN, LATENCY = 0, 1, 2, 3
BIASES = 4

POSITION_TIME_S = 1100.0
"""Time constant of the position's biases (ADS-B paper: Gauss-Markov), s; altitude and latency do not change."""


@jit_uncounted
def forget_biases(cross: FloatArray) -> None:
    """Set the covariances with the biases (HYPOTHESES, 9, BIASES) to zero."""
    for j in range(HYPOTHESES):
        for a in range(9):
            for b in range(BIASES):
                cross[j, a, b] = 0.0


@jit_uncounted
def mix_cross(weight: FloatArray, cross: FloatArray, mixed: FloatArray) -> None:
    """Mix the covariances with the biases as `imm_kernels.mix` has mixed the states.

    Parameters
    ----------
    weight : ndarray, shape (HYPOTHESES, HYPOTHESES)
        Share of hypothesis i in the new j, as `mix` left it.
    cross : ndarray, shape (HYPOTHESES, 9, BIASES)
        In place; the biases have zero mean under all hypotheses, so that nothing spreads.
    mixed : ndarray, shape (HYPOTHESES, 9)
        Written over.
    """
    for b in range(BIASES):
        for j in range(HYPOTHESES):
            for a in range(9):
                mixed[j, a] = 0.0
                for i in range(HYPOTHESES):
                    mixed[j, a] += weight[i, j] * cross[i, a, b]
        for j in range(HYPOTHESES):
            for a in range(6 if j == STRAIGHT else 9):
                cross[j, a, b] = mixed[j, a]


@jit_uncounted
def predict_cross(dt: float, x: FloatArray, cross: FloatArray, f: FloatArray, mixed: FloatArray) -> None:
    """Take the covariances with the biases `dt` further in place; the states are still those of before.

    Parameters
    ----------
    dt : float
    x : ndarray, shape (HYPOTHESES, 9)
    cross : ndarray, shape (HYPOTHESES, 9, BIASES)
    f : ndarray, shape (9, 9)
    mixed : ndarray, shape (HYPOTHESES, 9)
        Both written over.
    """
    kept = math.exp(-abs(dt) / POSITION_TIME_S)
    for b in range(BIASES):
        for a in range(3):
            cross[STRAIGHT, a, b] += dt * cross[STRAIGHT, 3 + a, b]
    steps = max(1, math.ceil(abs(dt) / LONGEST_STEP_S - 1e-9))
    for j in range(1, HYPOTHESES):
        state, column = mixed[0], mixed[1]
        for a in range(9):
            state[a] = x[j, a]
        for _ in range(steps):
            turning_transition(dt / steps, state, f)
            for b in range(BIASES):
                for a in range(9):
                    column[a] = 0.0
                    for c in range(9):
                        column[a] += f[a, c] * cross[j, c, b]
                for a in range(9):
                    cross[j, a, b] = column[a]
    for j in range(HYPOTHESES):
        for a in range(9):
            cross[j, a, NORTH] *= kept
            cross[j, a, EAST] *= kept


@jit_uncounted
def consider(
    n: int,
    x: FloatArray,
    p: FloatArray,
    cross: FloatArray,
    h: FloatArray,
    g: FloatArray,
    bias: FloatArray,
    z: float,
    variance: float,
    gain: FloatArray,
) -> float:
    """Update in place with one scalar z = h x + g b + w; return its log-likelihood less the constant.

    Parameters
    ----------
    n : int
        Number of states.
    x : ndarray, shape (n,)
    p : ndarray, shape (n, n)
    cross : ndarray, shape (n, BIASES)
    h : ndarray, shape (n,)
    g, bias : ndarray, shape (BIASES,)
        Derivatives to the biases, and their variances.
    z, variance : float
        The measurement, and the variance of w.
    gain : ndarray, shape (n,)
        Written over.
    """
    s, error = variance, z
    for b in range(BIASES):
        s += g[b] * g[b] * bias[b]
    for i in range(n):
        error -= h[i] * x[i]
        total = 0.0
        for j in range(n):
            total += p[i, j] * h[j]
        s += h[i] * total
        for b in range(BIASES):
            total += cross[i, b] * g[b]
            s += 2.0 * h[i] * cross[i, b] * g[b]
        gain[i] = total
    for b in range(BIASES):
        column = g[b] * bias[b]
        for i in range(n):
            column += h[i] * cross[i, b]
        for i in range(n):
            cross[i, b] -= gain[i] * column / s
    for i in range(n):
        x[i] += gain[i] * error / s
        for j in range(i + 1):
            p[i, j] -= gain[i] * gain[j] / s
            p[j, i] = p[i, j]
    return -0.5 * (error * error / s + math.log(s))


@jit_uncounted
def carry_cross(n: int, p: FloatArray, cross: FloatArray, new: FloatArray, factor: FloatArray, b: FloatArray) -> bool:
    """Update C for a measurement without these biases that took P to `new`; return whether P was sound.

    Such an update is P+ = (I - K H) P, so that C+ = (I - K H) C = P+ P^-1 C, also for a weighted sum of updates.

    Parameters
    ----------
    n : int
    p, new : ndarray, shape (n, n)
        Covariance before, and after less the spread of the means where several updates are mixed.
    cross : ndarray, shape (n, BIASES)
        In place.
    factor : ndarray, shape (n, n)
    b : ndarray, shape (n,)
        Both written over.
    """
    if not cholesky(p, n, factor):
        return False
    for k in range(BIASES):
        for i in range(n):
            b[i] = cross[i, k]
        solve_cholesky(factor, n, b)
        for i in range(n):
            cross[i, k] = 0.0
            for j in range(n):
                cross[i, k] += new[i, j] * b[j]
    return True


def warmup() -> None:
    """Compile what Python calls."""
    n = HYPOTHESES
    cross, x, eye, nine = np.zeros((n, 9, BIASES)), np.ones((n, 9)), np.eye(9), np.zeros(9)
    forget_biases(cross)
    mix_cross(np.eye(n), cross, np.zeros((n, 9)))
    predict_cross(0.1, x, cross, np.zeros((9, 9)), np.zeros((n, 9)))
    consider(9, x[0], eye, cross[0], nine, np.ones(BIASES), np.ones(BIASES), 1.0, 1.0, np.zeros(9))
    carry_cross(9, eye, cross[0], eye, np.zeros((9, 9)), np.zeros(9))
