"""Compiled autopilot of a fixed wing by successive loop closure, and its flight with it.

Command ``u`` (4): airspeed (m/s), course (rad), climb rate (m/s, up), bank fed forward (rad). Memory ``m``: see the
indices. ``k``: gains and limits. Roll, course, pitch, climb and airspeed are loops around each other (Beard and McLain,
chapter 6); the steady flight of `trim` is fed forward, so that integrators only take what the model does not know.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.gust_kernels import dryden_step
from wideberth.vehicles.kernels import GRAVITY, clip, wrap_angle

FloatArray = NDArray[np.float64]

M_COURSE, M_CLIMB, M_SPEED, M_YAW = 0, 1, 2, 3  # integrals of course, climb angle and airspeed; slow yaw rate
M_BANK_WANTED, M_CLIMB_WANTED, M_SPEED_WANTED = 4, 5, 6  # commands after their rate limits
N_MEMORY = 7

K_DESIGN_SPEED = 0  # m/s
K_ROLL, K_ROLL_RATE, K_COURSE, K_COURSE_INTEGRAL, K_YAW_DAMPER = 1, 2, 3, 4, 5
K_PITCH, K_PITCH_RATE, K_CLIMB, K_CLIMB_INTEGRAL = 6, 7, 8, 9
K_SPEED, K_SPEED_INTEGRAL, K_WEIGHT_THROTTLE, K_DRAG_THROTTLE = 10, 11, 12, 13
K_AILERON, K_RUDDER, K_THROTTLE, K_THROTTLE_SLOPE = 14, 15, 16, 17  # trimmed at the design speed; per m/s
K_BANK_MAX, K_BANK_RATE_MAX, K_CLIMB_MAX, K_SINK_MAX, K_VERTICAL_ACCEL_MAX = 18, 19, 20, 21, 22
K_SPEED_MIN, K_SPEED_MAX, K_ACCEL_MAX, K_DEFLECTION_MAX, K_PITCH_MAX = 23, 24, 25, 26, 27
K_TURN_AILERON, K_TURN_RUDDER = 28, 29  # per yaw rate times span / (2 airspeed): what a steady turn needs
N_GAINS = 30

YAW_WASHOUT = 0.5  # 1/s: yaw rates slower than this are turns, which the damper leaves alone


@jit_uncounted
def approach(value: float, wanted: float, most: float) -> float:
    """Return `value` moved towards `wanted` by at most `most`."""
    return value + clip(wanted - value, -most, most)


@jit_uncounted
def autopilot_step(
    x: FloatArray,
    u: FloatArray,
    wind: FloatArray,
    a: FloatArray,
    k: FloatArray,
    dt: float,
    m: FloatArray,
    d: FloatArray,
) -> None:
    """Write the controls into `d` and advance the memory by `dt` seconds.

    Airspeed, attitude, rates and velocity over ground are taken as measured without error; `wind` (3) is the air's
    velocity at the aircraft.
    """
    speed = max(fk.air_data(x, wind)[0], 0.5 * k[K_DESIGN_SPEED])
    roll, pitch, yaw = fk.euler_angles(x)
    north, east, down = fk.body_to_ned(x, x[fk.U], x[fk.V], x[fk.W])
    course = math.atan2(east, north) if north * north + east * east > 1.0 else yaw
    ratio = (k[K_DESIGN_SPEED] / speed) ** 2  # surfaces do less at a lower dynamic pressure

    # Course to bank to aileron; an aircraft too slow for the load of a steep bank keeps it smaller.
    error = wrap_angle(u[1] - course)
    bank_max = k[K_BANK_MAX] * clip((speed - 0.7 * k[K_SPEED_MIN]) / (0.3 * k[K_SPEED_MIN]), 0.2, 1.0)
    turn = k[K_COURSE] * error + m[M_COURSE]
    bank = u[3] + math.atan(turn * speed / GRAVITY)
    if abs(bank) < bank_max and abs(error) < 0.2:
        m[M_COURSE] = clip(m[M_COURSE] + k[K_COURSE_INTEGRAL] * error * dt, -0.1, 0.1)
    bank = clip(bank, -bank_max, bank_max)
    m[M_BANK_WANTED] = approach(m[M_BANK_WANTED], bank, k[K_BANK_RATE_MAX] * dt)
    aileron = k[K_AILERON] * ratio + ratio * (k[K_ROLL] * (m[M_BANK_WANTED] - roll) - k[K_ROLL_RATE] * x[fk.P])
    yawing = GRAVITY / speed * math.sin(roll) * a[fk.A_SPAN] / (2.0 * speed)
    aileron += k[K_TURN_AILERON] * yawing
    m[M_YAW] += (x[fk.R] - m[M_YAW]) * min(YAW_WASHOUT * dt, 1.0)
    rudder = k[K_RUDDER] * ratio + ratio * k[K_YAW_DAMPER] * (x[fk.R] - m[M_YAW]) + k[K_TURN_RUDDER] * yawing

    # Climb rate to pitch to elevator; climbing waits where the aircraft is too slow for it.
    climb = clip(u[2], -k[K_SINK_MAX], k[K_CLIMB_MAX])
    reserve = (speed - 0.92 * k[K_SPEED_MIN]) / (0.08 * k[K_SPEED_MIN])
    climb = min(climb, k[K_CLIMB_MAX] * reserve if reserve >= 0.0 else k[K_SINK_MAX] * max(reserve, -1.0))
    m[M_CLIMB_WANTED] = approach(m[M_CLIMB_WANTED], climb, k[K_VERTICAL_ACCEL_MAX] * dt)
    angle_wanted = math.asin(clip((m[M_CLIMB_WANTED] + wind[2]) / speed, -0.7, 0.7))
    angle_error = angle_wanted - math.asin(clip((wind[2] - down) / speed, -1.0, 1.0))
    load = 1.0 / max(math.cos(roll), 0.3)
    lift = a[fk.A_MASS] * GRAVITY * load / (0.5 * a[fk.A_DENSITY] * speed * speed * a[fk.A_AREA])
    alpha = (lift - a[fk.A_CL0] + a[fk.A_CL_DE] * a[fk.A_CM0] / a[fk.A_CM_DE]) / (
        a[fk.A_CL_ALPHA] - a[fk.A_CL_DE] * a[fk.A_CM_ALPHA] / a[fk.A_CM_DE]
    )
    alpha = min(alpha, 0.8 * a[fk.A_STALL_ALPHA])
    wanted = alpha * math.cos(roll) + angle_wanted + k[K_CLIMB] * angle_error + m[M_CLIMB]
    if abs(wanted) < k[K_PITCH_MAX]:
        m[M_CLIMB] = clip(m[M_CLIMB] + k[K_CLIMB_INTEGRAL] * angle_error * dt, -0.2, 0.2)
    wanted = clip(wanted, -k[K_PITCH_MAX], k[K_PITCH_MAX])
    turning = GRAVITY / speed * math.sin(roll) * math.tan(clip(roll, -1.2, 1.2))
    elevator = a[fk.A_CM0] + a[fk.A_CM_ALPHA] * alpha + a[fk.A_CM_Q] * a[fk.A_CHORD] / (2.0 * speed) * turning
    elevator = -elevator / a[fk.A_CM_DE]
    elevator += ratio * (k[K_PITCH] * (wanted - pitch) - k[K_PITCH_RATE] * (x[fk.Q] - turning))

    # Airspeed to throttle, with the weight's share along the path and the drag of a turn fed forward.
    # A bank stalls faster: the slowest speed is that of the lift it takes.
    slowest = min(k[K_SPEED_MIN] / math.sqrt(math.cos(m[M_BANK_WANTED])), k[K_SPEED_MAX])
    m[M_SPEED_WANTED] = approach(m[M_SPEED_WANTED], clip(u[0], slowest, k[K_SPEED_MAX]), k[K_ACCEL_MAX] * dt)
    speed_error = m[M_SPEED_WANTED] - speed
    throttle = k[K_THROTTLE] + k[K_THROTTLE_SLOPE] * (m[M_SPEED_WANTED] - k[K_DESIGN_SPEED])
    throttle += k[K_WEIGHT_THROTTLE] * math.sin(angle_wanted) + k[K_DRAG_THROTTLE] * ratio * (load * load - 1.0)
    throttle += k[K_SPEED] * speed_error + m[M_SPEED]
    if 0.0 < throttle < 1.0 or throttle * speed_error < 0.0:
        m[M_SPEED] = clip(m[M_SPEED] + k[K_SPEED_INTEGRAL] * speed_error * dt, -0.3, 0.3)

    most = k[K_DEFLECTION_MAX]
    d[fk.ELEVATOR], d[fk.AILERON] = clip(elevator, -most, most), clip(aileron, -most, most)
    d[fk.RUDDER], d[fk.THROTTLE] = clip(rudder, -most, most), clip(throttle, 0.0, 1.0)


@jit
def fly_fixed_wing(
    x: FloatArray,
    u: FloatArray,
    wind: FloatArray,
    a: FloatArray,
    k: FloatArray,
    dt: float,
    n_steps: int,
    m: FloatArray,
    d: FloatArray,
    gust: FloatArray,
    filters: FloatArray,
    normals: FloatArray,
) -> None:
    """Fly `n_steps` steps of `dt` seconds under one command, in place.

    `wind` is the steady one; `normals` (n_steps, 5) drive the gusts `gust` through `filters`; (0, 5): calm.
    """
    work, air = np.empty((3, fk.N_BODY)), np.empty(3)
    for step in range(n_steps):
        air[0], air[1], air[2] = wind[0], wind[1], wind[2]
        if normals.shape[0] > 0:
            speed = max(fk.air_data(x, wind)[0], fk.SLOWEST)
            along, right, below = dryden_step(filters, speed, dt, normals[step], gust)
            north, east, down = fk.body_to_ned(x, along, right, below)
            air[0], air[1], air[2] = air[0] + north, air[1] + east, air[2] + down
        autopilot_step(x, u, air, a, k, dt, m, d)
        fk.fixed_wing_step(x, d, air, a, dt, work)


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    x, u, wind, a, k = np.ones(fk.N_BODY), np.ones(4), np.zeros(3), np.ones(fk.N_AIRCRAFT), np.ones(N_GAINS)
    m, d = np.zeros(N_MEMORY), np.zeros(fk.N_CONTROLS)
    autopilot_step(x, u, wind, a, k, 0.01, m, d)
    fly_fixed_wing(x, u, wind, a, k, 0.01, 1, m, d, np.ones(6), np.zeros(5), np.zeros((1, 5)))
