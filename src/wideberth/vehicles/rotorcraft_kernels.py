"""Compiled helicopter: three first-order velocity loops with limits, solved exactly (CAS thesis, 3.6 and 5.3.1).

State ``x`` (6): position and velocity, NED, m and m/s. Command ``u`` (3): velocity, NED. ``q``: the indices below.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]

# Indices into the parameter array.
Q_TAU_LEVEL = 0  # time constant of the horizontal velocity, s
Q_TAU_VERTICAL = 1  # s
Q_SPEED_MAX = 2  # horizontal, m/s
Q_CLIMB_MAX = 3  # m/s, positive
Q_SINK_MAX = 4
Q_COUPLING = 5  # lateral acceleration to the right per vertical acceleration down
Q_POSITION_GAIN = 6  # horizontal velocity per distance, 1/s
Q_ALTITUDE_GAIN = 7  # 1/s
Q_GROUND = 8  # position down of the ground, m
N_PARAMS = 9

# What guidance does.
HOVER, STOP, LAND = 0, 1, 2


@jit_uncounted
def rotorcraft_step(x: FloatArray, u: FloatArray, heading: float, q: FloatArray, dt: float) -> None:
    """Advance the state by `dt` seconds under a constant command, in place; exact for any step.

    The horizontal command is shortened to the largest speed, the vertical one limited. A vertical acceleration pushes
    the vehicle sideways (across `heading`, rad), which its lateral loop then takes back.
    """
    speed = math.hypot(u[0], u[1])
    shorter = q[Q_SPEED_MAX] / speed if speed > q[Q_SPEED_MAX] else 1.0
    a, b = 1.0 / q[Q_TAU_VERTICAL], 1.0 / q[Q_TAU_LEVEL]
    if abs(b - a) < 1e-4 * a:
        b = a * (1.0 + 1e-4)  # the two exponentials of the coupling must differ
    fast, slow = -math.expm1(-a * dt), -math.expm1(-b * dt)
    change = min(max(u[2], -q[Q_CLIMB_MAX]), q[Q_SINK_MAX]) - x[5]
    push = q[Q_COUPLING] * change * a / (b - a)
    across, shifted = push * (slow - fast), push * (fast / a - slow / b)
    side = (-math.sin(heading), math.cos(heading))
    for i in range(2):
        level = u[i] * shorter - x[3 + i]
        x[i] += x[3 + i] * dt + level * (dt - slow / b) + shifted * side[i]
        x[3 + i] += level * slow + across * side[i]
    x[2] += x[5] * dt + change * (dt - fast / a)
    x[5] += change * fast


@jit_uncounted
def guide(x: FloatArray, target: FloatArray, speed: float, mode: int, q: FloatArray, u: FloatArray) -> None:
    """Write the command to `target` (3) into `u`: fly there at `speed` and hover, stop where it is, or land there.

    Landing descends once the vehicle is within 1 m of the place, and no command leads below the ground.
    """
    u[0], u[1], u[2] = 0.0, 0.0, 0.0
    if mode == STOP:
        return
    dn, de = target[0] - x[0], target[1] - x[1]
    distance = math.hypot(dn, de)
    if distance > 0.0:
        pace = min(q[Q_POSITION_GAIN] * distance, speed, q[Q_SPEED_MAX])
        u[0], u[1] = pace * dn / distance, pace * de / distance
    down = target[2]
    if mode == LAND:
        down = q[Q_GROUND] if distance <= 1.0 else x[2]
    down = min(down, q[Q_GROUND])
    u[2] = min(max(q[Q_ALTITUDE_GAIN] * (down - x[2]), -q[Q_CLIMB_MAX]), q[Q_SINK_MAX])


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, u, q = np.ones(6), np.ones(3), np.ones(N_PARAMS)
    rotorcraft_step(x, u, 0.0, q, 0.1)
    guide(x, u, 1.0, HOVER, q, u)
