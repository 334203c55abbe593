"""Compiled 12-degree rigid-body model of a fixed wing: forces, moments, propulsion, and its motion by Runge-Kutta 4.

State ``x`` (13): position NED (m), velocity over ground in body axes (m/s), quaternion from body to NED (scalar first;
four numbers for three angles, so that no attitude is singular), body rates (rad/s). Controls ``d`` (4): elevator,
aileron, rudder (rad), throttle (0 to 1). ``wind`` (3): velocity of the air, NED, m/s. ``a``: see the indices below.
The model is that of Beard and McLain, Small Unmanned Aircraft, chapters 3 and 4.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.vehicles.kernels import GRAVITY, clip

FloatArray = NDArray[np.float64]

N_BODY = 13
U, V, W, E0, E1, E2, E3, P, Q, R = 3, 4, 5, 6, 7, 8, 9, 10, 11, 12

N_CONTROLS = 4
ELEVATOR, AILERON, RUDDER, THROTTLE = 0, 1, 2, 3

# Indices into the array of an aircraft.
A_MASS, A_JY, A_AREA, A_SPAN, A_CHORD, A_DENSITY = 0, 1, 2, 3, 4, 5  # kg, kg m2, m2, m, m, kg/m3
A_GAMMA = 6  # 8 numbers: the terms Gamma_1 to Gamma_8 of the inertias (Beard and McLain, eq. 3.13)
A_STALL_M, A_STALL_ALPHA = 14, 15  # sharpness of the stall and the angle of attack where it is half done, rad
A_CL0, A_CL_ALPHA, A_CL_Q, A_CL_DE = 16, 17, 18, 19
A_CD_P, A_CD_INDUCED, A_CD_Q, A_CD_DE = 20, 21, 22, 23  # induced: 1 / (pi e AR)
A_CM0, A_CM_ALPHA, A_CM_Q, A_CM_DE = 24, 25, 26, 27
A_CY_BETA, A_CY_P, A_CY_R, A_CY_DA, A_CY_DR = 28, 29, 30, 31, 32
A_CROLL_BETA, A_CROLL_P, A_CROLL_R, A_CROLL_DA, A_CROLL_DR = 33, 34, 35, 36, 37
A_CN_BETA, A_CN_P, A_CN_R, A_CN_DA, A_CN_DR = 38, 39, 40, 41, 42
A_MOTOR = 43  # 0: electric motor with a propeller; 1: disc that blows air at k_motor times the throttle
A_PROP_AREA, A_K_MOTOR = 44, 45  # m2, m/s; of the disc
A_PROP_DIAMETER, A_VOLTS, A_KV, A_RESISTANCE, A_NO_LOAD = 46, 47, 48, 49, 50  # m, V, V s/rad, ohm, A
A_CQ, A_CT = 51, 54  # 3 numbers each: constant, J, J squared
N_AIRCRAFT = 57

SLOWEST = 1.0  # m/s: below this airspeed the terms that divide by it keep its value


@jit_uncounted
def euler_angles(x: FloatArray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw (rad, order 3-2-1) of a state."""
    a, b, c, d = x[E0], x[E1], x[E2], x[E3]
    roll = math.atan2(2.0 * (a * b + c * d), a * a + d * d - b * b - c * c)
    pitch = math.asin(clip(2.0 * (a * c - b * d), -1.0, 1.0))
    return roll, pitch, math.atan2(2.0 * (a * d + b * c), a * a + b * b - c * c - d * d)


@jit_uncounted
def body_to_ned(x: FloatArray, u: float, v: float, w: float) -> tuple[float, float, float]:
    """Return a vector in body axes as one in NED."""
    a, b, c, d = x[E0], x[E1], x[E2], x[E3]
    north = (a * a + b * b - c * c - d * d) * u + 2.0 * (b * c - a * d) * v + 2.0 * (b * d + a * c) * w
    east = 2.0 * (b * c + a * d) * u + (a * a - b * b + c * c - d * d) * v + 2.0 * (c * d - a * b) * w
    down = 2.0 * (b * d - a * c) * u + 2.0 * (c * d + a * b) * v + (a * a - b * b - c * c + d * d) * w
    return north, east, down


@jit_uncounted
def ned_to_body(x: FloatArray, north: float, east: float, down: float) -> tuple[float, float, float]:
    """Return a vector in NED as one in body axes."""
    a, b, c, d = x[E0], x[E1], x[E2], x[E3]
    u = (a * a + b * b - c * c - d * d) * north + 2.0 * (b * c + a * d) * east + 2.0 * (b * d - a * c) * down
    v = 2.0 * (b * c - a * d) * north + (a * a - b * b + c * c - d * d) * east + 2.0 * (c * d + a * b) * down
    w = 2.0 * (b * d + a * c) * north + 2.0 * (c * d - a * b) * east + (a * a - b * b - c * c + d * d) * down
    return u, v, w


@jit_uncounted
def air_data(x: FloatArray, wind: FloatArray) -> tuple[float, float, float]:
    """Return airspeed (m/s), angle of attack and sideslip (rad) of a state."""
    wu, wv, ww = ned_to_body(x, wind[0], wind[1], wind[2])
    u, v, w = x[U] - wu, x[V] - wv, x[W] - ww
    speed = math.sqrt(u * u + v * v + w * w)
    beta = math.asin(clip(v / speed, -1.0, 1.0)) if speed > 1e-9 else 0.0
    return speed, math.atan2(w, u), beta


@jit_uncounted
def stall_share(alpha: float, a: FloatArray) -> float:
    """Return how far the wing is stalled, 0 to 1: sigma(alpha) of Beard and McLain, eq. 4.10."""
    m, half = a[A_STALL_M], a[A_STALL_ALPHA]
    low = math.exp(clip(-m * (alpha - half), -300.0, 300.0))
    high = math.exp(clip(m * (alpha + half), -300.0, 300.0))
    return (1.0 + low + high) / ((1.0 + low) * (1.0 + high))


@jit_uncounted
def lift_and_drag(alpha: float, a: FloatArray) -> tuple[float, float]:
    """Return the coefficients of lift and drag without rates and deflections.

    Both blend into those of a flat plate (the normal force 2 sin(alpha)^2), so that drag grows in the stall too.
    """
    sigma = stall_share(alpha, a)
    linear = a[A_CL0] + a[A_CL_ALPHA] * alpha
    sine = math.sin(alpha)
    plate = 2.0 * sine * abs(sine)
    lift = (1.0 - sigma) * linear + sigma * plate * math.cos(alpha)
    return lift, (1.0 - sigma) * (a[A_CD_P] + a[A_CD_INDUCED] * linear * linear) + sigma * plate * sine


@jit_uncounted
def thrust_and_torque(speed: float, throttle: float, a: FloatArray) -> tuple[float, float]:
    """Return the thrust (N) and the propeller's torque (N m; the airframe gets minus it) at an airspeed."""
    rho = a[A_DENSITY]
    if a[A_MOTOR] == 1.0:
        blown = a[A_K_MOTOR] * throttle
        return 0.5 * rho * a[A_PROP_AREA] * (blown * blown - speed * speed), 0.0
    diameter, kv = a[A_PROP_DIAMETER], a[A_KV]
    c0, c1, c2 = a[A_CQ], a[A_CQ + 1], a[A_CQ + 2]
    # The rate where the motor's torque is the propeller's: a quadratic (Beard and McLain, 2nd edition, eq. 4.19).
    square = c0 * rho * diameter**5 / (2.0 * math.pi) ** 2
    linear = c1 * rho * diameter**4 / (2.0 * math.pi) * speed + kv * kv / a[A_RESISTANCE]
    constant = c2 * rho * diameter**3 * speed * speed - kv / a[A_RESISTANCE] * a[A_VOLTS] * throttle
    constant += kv * a[A_NO_LOAD]
    rate = (-linear + math.sqrt(max(linear * linear - 4.0 * square * constant, 0.0))) / (2.0 * square)
    # The coefficients C_0 + C_1 J + C_2 J^2 times rho n^2 D^4, without a division by n: it may stand still.
    tip, rho_square = max(rate, 0.0) / (2.0 * math.pi) * diameter, rho * diameter * diameter
    thrust = rho_square * ((a[A_CT] * tip + a[A_CT + 1] * speed) * tip + a[A_CT + 2] * speed * speed)
    return thrust, rho_square * diameter * ((c0 * tip + c1 * speed) * tip + c2 * speed * speed)


@jit_uncounted
def fixed_wing_derivative(x: FloatArray, d: FloatArray, wind: FloatArray, a: FloatArray, out: FloatArray) -> None:
    """Write the rate of change of the state into `out` (13)."""
    u, v, w, p, q, r = x[U], x[V], x[W], x[P], x[Q], x[R]
    speed, alpha, beta = air_data(x, wind)
    pressure = 0.5 * a[A_DENSITY] * speed * speed * a[A_AREA]
    span = a[A_SPAN] / (2.0 * max(speed, SLOWEST))
    chord = a[A_CHORD] / (2.0 * max(speed, SLOWEST))
    de, da, dr = d[ELEVATOR], d[AILERON], d[RUDDER]

    lift, drag = lift_and_drag(alpha, a)
    lift += a[A_CL_Q] * chord * q + a[A_CL_DE] * de
    # Printed as C_D_de de, which is a thrust for the elevator up; a deflection only ever adds drag.
    drag += a[A_CD_Q] * chord * abs(q) + a[A_CD_DE] * de * de
    ca, sa = math.cos(alpha), math.sin(alpha)
    side = a[A_CY_BETA] * beta + span * (a[A_CY_P] * p + a[A_CY_R] * r) + a[A_CY_DA] * da + a[A_CY_DR] * dr
    thrust, torque = thrust_and_torque(speed, d[THROTTLE], a)
    gu, gv, gw = ned_to_body(x, 0.0, 0.0, GRAVITY)
    mass = a[A_MASS]
    out[0], out[1], out[2] = body_to_ned(x, u, v, w)
    out[U] = r * v - q * w + gu + (pressure * (lift * sa - drag * ca) + thrust) / mass
    out[V] = p * w - r * u + gv + pressure * side / mass
    out[W] = q * u - p * v + gw - pressure * (lift * ca + drag * sa) / mass

    out[E0] = 0.5 * (-p * x[E1] - q * x[E2] - r * x[E3])
    out[E1] = 0.5 * (p * x[E0] + r * x[E2] - q * x[E3])
    out[E2] = 0.5 * (q * x[E0] - r * x[E1] + p * x[E3])
    out[E3] = 0.5 * (r * x[E0] + q * x[E1] - p * x[E2])

    roll = a[A_CROLL_BETA] * beta + span * (a[A_CROLL_P] * p + a[A_CROLL_R] * r)
    roll = pressure * a[A_SPAN] * (roll + a[A_CROLL_DA] * da + a[A_CROLL_DR] * dr) - torque
    pitch = a[A_CM0] + a[A_CM_ALPHA] * alpha + a[A_CM_Q] * chord * q + a[A_CM_DE] * de
    pitch *= pressure * a[A_CHORD]
    yaw = a[A_CN_BETA] * beta + span * (a[A_CN_P] * p + a[A_CN_R] * r)
    yaw = pressure * a[A_SPAN] * (yaw + a[A_CN_DA] * da + a[A_CN_DR] * dr)
    g = A_GAMMA - 1
    out[P] = a[g + 1] * p * q - a[g + 2] * q * r + a[g + 3] * roll + a[g + 4] * yaw
    out[Q] = a[g + 5] * p * r - a[g + 6] * (p * p - r * r) + pitch / a[A_JY]
    out[R] = a[g + 7] * p * q - a[g + 1] * q * r + a[g + 4] * roll + a[g + 8] * yaw


@jit_uncounted
def fixed_wing_step(x: FloatArray, d: FloatArray, wind: FloatArray, a: FloatArray, dt: float, work: FloatArray) -> None:
    """Advance the state by `dt` seconds with constant controls and wind, in place, by Runge-Kutta 4.

    `work` (3, 13) is scratch. The quaternion's length is set to 1 afterwards.
    """
    rate, at, total = work[0], work[1], work[2]
    for i in range(N_BODY):
        at[i] = x[i]
        total[i] = 0.0
    for stage in range(4):  # one place that calls the derivative: it is compiled once
        fixed_wing_derivative(at, d, wind, a, rate)
        weight = 1.0 if stage == 0 or stage == 3 else 2.0
        ahead = dt if stage == 2 else 0.5 * dt
        for i in range(N_BODY):
            total[i] += weight * rate[i]
            at[i] = x[i] + ahead * rate[i]
    for i in range(N_BODY):
        x[i] += dt / 6.0 * total[i]
    length = math.sqrt(x[E0] ** 2 + x[E1] ** 2 + x[E2] ** 2 + x[E3] ** 2)
    for i in range(E0, E3 + 1):
        x[i] /= length


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    x, d, wind, a = np.ones(N_BODY), np.zeros(N_CONTROLS), np.zeros(3), np.ones(N_AIRCRAFT)
    work = np.empty((3, N_BODY))
    euler_angles(x)
    body_to_ned(x, 1.0, 0.0, 0.0)
    ned_to_body(x, 1.0, 0.0, 0.0)
    air_data(x, wind)
    stall_share(0.0, a)
    lift_and_drag(0.0, a)
    thrust_and_torque(1.0, 0.5, a)
    fixed_wing_derivative(x, d, wind, a, np.empty(N_BODY))
    fixed_wing_step(x, d, wind, a, 0.01, work)
