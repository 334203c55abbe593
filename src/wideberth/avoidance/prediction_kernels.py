"""Where intruders may be."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.avoidance.kernels import (
    GROWTH_H,
    GROWTH_V,
    MARGIN_MAX,
    N_PREDICTION,
    N_RISK,
    OUTER_HEIGHT,
    OUTER_RADIUS,
    OUTER_TAU,
    TURN_RATE_MAX,
    TURN_RATE_MIN,
    TURN_SIGNIFICANCE,
    TURN_TIME,
    TURN_WEIGHT,
    widened,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@jit_uncounted
def turn_rate(vn: float, ve: float, an: float, ae: float, sigma_a: float, risk: Floats) -> float:
    """Return the believed turn rate (rad/s, positive clockwise from above), zero unless significant."""
    v2 = vn * vn + ve * ve
    if v2 < 25.0:
        return 0.0
    lateral = (vn * ae - ve * an) / math.sqrt(v2)
    omega = lateral / math.sqrt(v2)
    if abs(lateral) < risk[TURN_SIGNIFICANCE] * sigma_a or abs(omega) < risk[TURN_RATE_MIN]:
        return 0.0
    return float(max(-risk[TURN_RATE_MAX], min(risk[TURN_RATE_MAX], omega)))


@jit_uncounted
def predict_intruders(
    own: Floats,
    own_speed: float,
    own_climb: float,
    position: Floats,
    velocity: Floats,
    acceleration: Floats,
    covariance: Floats,
    risk: Floats,
    dt: float,
    n: int,
    out: Floats,
    weight: Floats,
    owner: Integers,
) -> int:
    """Predict every intruder over a time grid, straight and, where it turns, also along its turn.

    What the ownship cannot meet at a grid time, whatever it does, is marked there; what it can never meet is left out.

    Parameters
    ----------
    own : ndarray, shape (3,)
        Position of the ownship, local NED.
    own_speed, own_climb : float
        The most it can do horizontally and vertically, m/s.
    position, velocity, acceleration : ndarray, shape (m, 3)
        Local NED.
    covariance : ndarray, shape (m, 9, 9)
    risk : ndarray
        Risk parameters, see the constants of `kernels`.
    dt : float
        Step of the grid, s.
    n : int
        Number of grid points; the first is now.
    out : ndarray, shape (2 m, n, N_PREDICTION)
        Filled with position, velocity, the standard deviations of horizontal and vertical position, and whether the
        ownship can be where it would matter (0 or 1).
    weight : ndarray, shape (2 m,)
        Filled with the belief in each hypothesis.
    owner : ndarray of int, shape (2 m,)
        Filled with the intruder of each hypothesis.

    Returns
    -------
    int
        Number of hypotheses.
    """
    count = 0
    for i in range(position.shape[0]):
        c = covariance[i]
        sigma_a = math.sqrt(max(0.5 * (c[6, 6] + c[7, 7]), 0.0))
        omega = turn_rate(velocity[i, 0], velocity[i, 1], acceleration[i, 0], acceleration[i, 1], sigma_a, risk)
        for hypothesis in range(2):
            if hypothesis == 1 and omega == 0.0:
                break
            weight[count] = 1.0
            if omega != 0.0:
                weight[count] = risk[TURN_WEIGHT] if hypothesis == 1 else 1.0 - risk[TURN_WEIGHT]
            owner[count] = i
            pn, pe, pd = position[i, 0], position[i, 1], position[i, 2]
            vn, ve, vd = velocity[i, 0], velocity[i, 1], velocity[i, 2]
            rate = omega if hypothesis == 1 else 0.0
            cos_step, sin_step = math.cos(rate * dt), math.sin(rate * dt)
            closing = own_speed + math.hypot(vn, ve)
            ever = False
            for k in range(n):
                t = k * dt
                row = out[count, k]
                row[0], row[1], row[2] = pn, pe, pd
                row[3], row[4], row[5] = vn, ve, vd
                s_n = c[0, 0] + 2.0 * t * c[0, 3] + t * t * c[3, 3]
                s_e = c[1, 1] + 2.0 * t * c[1, 4] + t * t * c[4, 4]
                s_d = c[2, 2] + 2.0 * t * c[2, 5] + t * t * c[5, 5]
                row[6] = math.sqrt(max(0.5 * (s_n + s_e), 0.0))
                row[7] = math.sqrt(max(s_d, 0.0))
                reach_h = widened(risk[OUTER_RADIUS], row[6], risk[GROWTH_H], risk, t) + risk[OUTER_TAU] * closing
                reach_v = widened(risk[OUTER_HEIGHT], row[7], risk[GROWTH_V], risk, t)
                relevant = (
                    math.hypot(pn - own[0], pe - own[1]) <= MARGIN_MAX * reach_h + own_speed * t
                    and abs(pd - own[2]) <= MARGIN_MAX * reach_v + own_climb * t
                )
                row[8] = 1.0 if relevant else 0.0
                ever = ever or relevant
                if t < risk[TURN_TIME]:
                    vn, ve = cos_step * vn - sin_step * ve, sin_step * vn + cos_step * ve
                pn += vn * dt
                pe += ve * dt
                pd += vd * dt
            if ever:
                count += 1
    return count


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    out, weight, owner, one = np.zeros((2, 4, N_PREDICTION)), np.zeros(2), np.zeros(2, np.int64), np.ones((1, 3))
    covariance, risk = np.zeros((1, 9, 9)), np.ones(N_RISK)
    predict_intruders(np.ones(3), 1.0, 1.0, one, one, one, covariance, risk, 1.0, 4, out, weight, owner)
