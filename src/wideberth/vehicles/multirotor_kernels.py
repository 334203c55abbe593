"""Compiled multirotor: point mass under a thrust that tilts with a lag, with drag, flown by a velocity loop.

State ``x`` (10): position NED (m), velocity over ground NED (m/s), roll, pitch, yaw (rad), thrust per mass (m/s2).
Attitude and thrust follow their commands as first-order lags with a limited rate: the loops inside, of rates and
rotors, are much faster. Command ``u`` (4): velocity over ground NED (m/s), yaw (rad). ``q``: see the indices.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.vehicles.kernels import GRAVITY, clip, wrap_angle

FloatArray = NDArray[np.float64]

N_ROTOR = 10
ROLL, PITCH, YAW, THRUST = 6, 7, 8, 9

Q_TAU_ATTITUDE = 0  # s
Q_TAU_THRUST = 1  # s
Q_DRAG = 2  # deceleration per airspeed, 1/s
Q_TILT_MAX = 3  # rad
Q_TILT_RATE_MAX = 4  # rad/s
Q_THRUST_MAX = 5  # times the weight
Q_YAW_RATE_MAX = 6  # rad/s
Q_VELOCITY_GAIN = 7  # acceleration per velocity error, 1/s
Q_VELOCITY_INTEGRAL = 8  # 1/s2
Q_ACCEL_MAX = 9  # of a commanded change, horizontal and vertical, m/s2
N_ROTOR_PARAMS = 10


@jit_uncounted
def velocity_loop(
    x: FloatArray, u: FloatArray, wind: FloatArray, q: FloatArray, dt: float, m: FloatArray, out: FloatArray
) -> None:
    """Write roll, pitch, yaw and thrust per mass wanted into `out` (4), and advance the integrals `m` (3) by `dt`.

    The velocity errors ask for an acceleration, limited; the thrust has to make it against the drag, and to carry the
    weight.
    """
    north, east, down = u[0] - x[3], u[1] - x[4], u[2] - x[5]
    level = math.sqrt(north * north + east * east)
    share = min(1.0, q[Q_ACCEL_MAX] / max(q[Q_VELOCITY_GAIN] * level, 1e-9))
    if share == 1.0:  # integrals stand still while the error is large
        m[0] += q[Q_VELOCITY_INTEGRAL] * north * dt
        m[1] += q[Q_VELOCITY_INTEGRAL] * east * dt
        m[2] += q[Q_VELOCITY_INTEGRAL] * down * dt
    most = GRAVITY * math.tan(q[Q_TILT_MAX])
    for i in range(3):
        m[i] = clip(m[i], -most, most)
    an = share * q[Q_VELOCITY_GAIN] * north + m[0] + q[Q_DRAG] * (x[3] - wind[0])
    ae = share * q[Q_VELOCITY_GAIN] * east + m[1] + q[Q_DRAG] * (x[4] - wind[1])
    ad = clip(q[Q_VELOCITY_GAIN] * down, -q[Q_ACCEL_MAX], q[Q_ACCEL_MAX]) + m[2]
    ad += q[Q_DRAG] * (x[5] - wind[2])
    up = max(GRAVITY - ad, 0.2 * GRAVITY)
    ahead = an * math.cos(x[YAW]) + ae * math.sin(x[YAW])
    right = ae * math.cos(x[YAW]) - an * math.sin(x[YAW])
    tilt = math.sqrt(ahead * ahead + right * right) / up
    limit = math.tan(q[Q_TILT_MAX])
    if tilt > limit:
        ahead, right, tilt = ahead * limit / tilt, right * limit / tilt, limit
    out[1] = math.atan2(-ahead, up)
    out[0] = math.atan2(right * math.cos(out[1]), up)
    out[2] = u[3]
    out[3] = clip(up / max(math.cos(x[ROLL]) * math.cos(x[PITCH]), 0.3), 0.1 * GRAVITY, q[Q_THRUST_MAX] * GRAVITY)


@jit_uncounted
def multirotor_step(x: FloatArray, wanted: FloatArray, wind: FloatArray, q: FloatArray, dt: float) -> None:
    """Advance the state by `dt` seconds in place: attitude and thrust exactly, velocity by the midpoint."""
    share, most = -math.expm1(-dt / q[Q_TAU_ATTITUDE]), q[Q_TILT_RATE_MAX] * dt
    roll, pitch, yaw, thrust = x[ROLL], x[PITCH], x[YAW], x[THRUST]
    x[ROLL] = roll + clip((wanted[0] - roll) * share, -most, most)
    x[PITCH] = pitch + clip((wanted[1] - pitch) * share, -most, most)
    turn = clip(wrap_angle(wanted[2] - yaw) * share, -q[Q_YAW_RATE_MAX] * dt, q[Q_YAW_RATE_MAX] * dt)
    x[THRUST] = thrust - math.expm1(-dt / q[Q_TAU_THRUST]) * (wanted[3] - thrust)
    roll, pitch = 0.5 * (roll + x[ROLL]), 0.5 * (pitch + x[PITCH])
    yaw, thrust = yaw + 0.5 * turn, 0.5 * (thrust + x[THRUST])
    cr, sr, cp, sp, cy, sy = (
        math.cos(roll),
        math.sin(roll),
        math.cos(pitch),
        math.sin(pitch),
        math.cos(yaw),
        math.sin(yaw),
    )
    damped = 1.0 / (1.0 + 0.5 * q[Q_DRAG] * dt)
    for i in range(3):
        if i == 0:
            push = -thrust * (cr * sp * cy + sr * sy)
        elif i == 1:
            push = -thrust * (cr * sp * sy - sr * cy)
        else:
            push = GRAVITY - thrust * cr * cp
        before = x[3 + i]
        change = dt * (push - q[Q_DRAG] * (before - wind[i])) * damped
        x[3 + i] = before + change
        x[i] += dt * (before + 0.5 * change)
    x[YAW] = wrap_angle(x[YAW] + turn)


@jit
def fly_multirotor(
    x: FloatArray, u: FloatArray, wind: FloatArray, q: FloatArray, dt: float, n_steps: int, m: FloatArray
) -> None:
    """Fly `n_steps` steps of `dt` seconds under one command, in place."""
    wanted = np.empty(4)
    for _ in range(n_steps):
        velocity_loop(x, u, wind, q, dt, m, wanted)
        multirotor_step(x, wanted, wind, q, dt)


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    x, u, wind, q = np.ones(N_ROTOR), np.ones(4), np.zeros(3), np.ones(N_ROTOR_PARAMS)
    wanted, m = np.zeros(4), np.zeros(3)
    velocity_loop(x, u, wind, q, 0.01, m, wanted)
    multirotor_step(x, wanted, wind, q, 0.01)
    fly_multirotor(x, u, wind, q, 0.01, 1, m)
