"""The turning model of thesis (3.48) in closed form: where an aircraft is after any time, not only a short one.

Speed V, course chi and flight path angle gamma are linear in time, so that the position is made of integrals
of s^n exp(i (angle + rate s)) over the flight. (The tracker's step, `tracking.motion_kernels.propagate`, is Simpson's
rule and good for short times.) State: position (3), V, chi, gamma, and the rates of these three.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]


@jit_uncounted
def moment(n: int, x: float) -> tuple[float, float]:
    """Return real and imaginary part of the integral of u^n exp(i x u) over u in [0, 1], for n in 0, 1, 2."""
    if abs(x) < 1.0:
        re, im, term = 1.0 / (n + 1.0), 0.0, 1.0
        for k in range(1, 20):
            term *= x / k
            part = term / (n + k + 1.0)
            # i^k = i, -1, -i, 1
            if k % 4 == 1:
                im += part
            elif k % 4 == 2:
                re -= part
            elif k % 4 == 3:
                im -= part
            else:
                re += part
            if abs(term) < 1e-18:
                break
        return re, im
    c, s = math.cos(x), math.sin(x)
    re, im = s / x, (1.0 - c) / x
    for k in range(1, n + 1):
        # Integration by parts: (exp(i x) - k A_{k-1}) / (i x).
        re, im = (s - k * im) / x, -(c - k * re) / x
    return re, im


@jit_uncounted
def travelled(speed: float, acceleration: float, angle: float, rate: float, t: float) -> tuple[float, float]:
    """Return the integrals of (speed + acceleration s) cos and sin (angle + rate s) over s in [0, t]."""
    r0, i0 = moment(0, rate * t)
    r1, i1 = moment(1, rate * t)
    re = t * (speed * r0 + acceleration * t * r1)
    im = t * (speed * i0 + acceleration * t * i1)
    c, s = math.cos(angle), math.sin(angle)
    return c * re - s * im, s * re + c * im


@jit_uncounted
def turning_position(t: float, x: FloatArray) -> tuple[float, float, float]:
    """Return where an aircraft with state `x` (9) is after `t` seconds: north, east, down, m."""
    # cos chi cos gamma is half the sum of the cosines of chi + gamma and chi - gamma; sin chi cos gamma likewise.
    n1, e1 = travelled(x[3], x[6], x[4] + x[5], x[7] + x[8], t)
    n2, e2 = travelled(x[3], x[6], x[4] - x[5], x[7] - x[8], t)
    _, climbed = travelled(x[3], x[6], x[5], x[8], t)
    return x[0] + 0.5 * (n1 + n2), x[1] + 0.5 * (e1 + e2), x[2] - climbed


@jit_uncounted
def turning_velocity(t: float, x: FloatArray) -> tuple[float, float, float]:
    """Return the NED velocity after `t` seconds."""
    speed, course, gamma = x[3] + t * x[6], x[4] + t * x[7], x[5] + t * x[8]
    level = speed * math.cos(gamma)
    return level * math.cos(course), level * math.sin(course), -speed * math.sin(gamma)


@jit_uncounted
def turning_acceleration_bounds(t0: float, t1: float, x: FloatArray) -> tuple[float, float]:
    """Return bounds of the horizontal and of the vertical acceleration between two times."""
    fastest = max(abs(x[3] + t0 * x[6]), abs(x[3] + t1 * x[6]))
    horizontal = math.sqrt(x[6] * x[6] + fastest * fastest * (x[7] * x[7] + x[8] * x[8]))
    return horizontal, math.sqrt(x[6] * x[6] + fastest * fastest * x[8] * x[8])


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    turning_position(1.0, np.ones(9))
    turning_velocity(1.0, np.ones(9))
    turning_acceleration_bounds(0.0, 1.0, np.ones(9))
