"""Naive twin of the fixed wing: vectors, matrices and the inverse of the inertia, one thought a line."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth.vehicles.aircraft import AIR_DENSITY, Aircraft, BlownDisc

FloatArray = NDArray[np.float64]
G = 9.81


def rotation(quaternion: FloatArray) -> FloatArray:
    """Body to NED."""
    e0, e = quaternion[0], quaternion[1:]
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.asarray((e0**2 - e @ e) * np.eye(3) + 2 * np.outer(e, e) + 2 * e0 * cross)


def sigma(alpha: float, c: Aircraft) -> float:
    a = math.exp(-c.stall_sharpness * (alpha - c.stall_angle))
    b = math.exp(c.stall_sharpness * (alpha + c.stall_angle))
    return (1 + a + b) / ((1 + a) * (1 + b))


def propulsion(speed: float, throttle: float, c: Aircraft) -> tuple[float, float]:
    """Thrust and torque; the motor's rate by bisection of motor torque against propeller torque."""
    m = c.propulsion
    if isinstance(m, BlownDisc):
        return 0.5 * AIR_DENSITY * m.area * ((m.k_motor * throttle) ** 2 - speed**2), 0.0

    def coefficients(rate: float) -> tuple[float, float]:
        j = 2 * math.pi * speed / (rate * m.diameter)
        return float(np.polyval(m.torque[::-1], j)), float(np.polyval(m.thrust[::-1], j))

    def excess(rate: float) -> float:
        current = (m.volts * throttle - m.kv * rate) / m.resistance - m.no_load_current
        load = AIR_DENSITY * (rate / (2 * math.pi)) ** 2 * m.diameter**5 * coefficients(rate)[0]
        return m.kv * current - load

    low, high = 1e-3, 2000.0
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    q, t = coefficients(low)
    n = low / (2 * math.pi)
    return AIR_DENSITY * n**2 * m.diameter**4 * t, AIR_DENSITY * n**2 * m.diameter**5 * q


def derivative(x: FloatArray, d: FloatArray, wind: FloatArray, c: Aircraft) -> FloatArray:
    velocity, quaternion, omega = x[3:6], x[6:10], x[10:]
    r = rotation(quaternion)
    air = velocity - r.T @ wind
    speed = float(np.linalg.norm(air))
    alpha, beta = math.atan2(air[2], air[0]), math.asin(air[1] / speed)
    force_scale = 0.5 * AIR_DENSITY * speed**2 * c.area
    half = omega * np.array([c.span, c.chord, c.span]) / (2 * speed)
    linear = c.lift[0] + c.lift[1] * alpha
    plate = 2 * math.sin(alpha) ** 2 * math.copysign(1, alpha)
    s = sigma(alpha, c)
    lift = (1 - s) * linear + s * plate * math.cos(alpha) + c.lift[2] * half[1] + c.lift[3] * d[0]
    drag = (1 - s) * (c.drag[0] + linear**2 * c.area / (math.pi * c.oswald * c.span**2)) + s * plate * math.sin(alpha)
    drag += c.drag[1] * abs(half[1]) + c.drag[2] * d[0] ** 2
    across = np.array([beta, half[0], half[2], d[1], d[2]])
    thrust, torque = propulsion(speed, d[3], c)
    stability = np.array([-drag, 0, -lift])
    turn = np.array([[math.cos(alpha), 0, -math.sin(alpha)], [0, 1, 0], [math.sin(alpha), 0, math.cos(alpha)]])
    force = force_scale * (turn @ stability + np.array([0, across @ c.side, 0]))
    force += np.array([thrust, 0, 0]) + c.mass * G * r.T @ np.array([0, 0, 1.0])
    pitch = c.pitch[0] + c.pitch[1] * alpha + c.pitch[2] * half[1] + c.pitch[3] * d[0]
    moment = force_scale * np.array([c.span * (across @ c.roll), c.chord * pitch, c.span * (across @ c.yaw)])
    moment[0] -= torque
    jx, jy, jz, jxz = c.inertia
    inertia = np.array([[jx, 0, -jxz], [0, jy, 0], [-jxz, 0, jz]])
    q_rate = np.empty(4)
    q_rate[0] = -0.5 * omega @ quaternion[1:]
    q_rate[1:] = 0.5 * (quaternion[0] * omega + np.cross(quaternion[1:], omega))
    turning = np.linalg.solve(inertia, moment - np.cross(omega, inertia @ omega))
    return np.concatenate([r @ velocity, force / c.mass - np.cross(omega, velocity), q_rate, turning])
