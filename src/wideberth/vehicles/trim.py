"""Steady flight of a fixed wing, and its linear model about it."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from wideberth.types import FloatArray
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.kernels import GRAVITY

_STILL = np.zeros(3)
# Rows of the linear model: u, w, q, pitch; v, p, r, roll.
_LONGITUDINAL = (0, 2, 4, 7)
_LATERAL = (1, 3, 5, 6)


@dataclass(frozen=True, slots=True)
class Trim:
    """Steady flight.

    Attributes
    ----------
    state : ndarray, shape (13,)
        At the origin, yaw 0.
    controls : ndarray, shape (4,)
        Elevator, aileron, rudder (rad), throttle; the throttle may lie outside [0, 1] where power does not suffice.
    alpha, beta, roll, pitch : float
        rad.
    residual : float
        Largest unwanted acceleration, m/s2 or rad/s2.
    """

    state: FloatArray
    controls: FloatArray
    alpha: float
    beta: float
    roll: float
    pitch: float
    residual: float


def trim(aircraft: FloatArray, speed: float, climb_angle: float = 0.0, radius: float = math.inf) -> Trim:
    """Return the steady flight at an airspeed, m/s, a climb angle, rad, and a turn radius, m (positive: to the right).

    An aircraft with a rudder flies without sideslip, one without takes the sideslip that comes.

    Raises
    ------
    ValueError
        If there is no such flight (stalled, or the turn too tight), or arguments are not finite or positive.
    """
    if not (speed > 0.0 and abs(climb_angle) < math.pi / 2 and abs(radius) > 0.0 and math.isfinite(speed)):
        raise ValueError(
            f"trim: speed {speed} must be positive and finite, climb_angle {climb_angle} within"
            f" (-pi/2, pi/2), radius {radius} not 0"
        )
    rudder = aircraft[fk.A_CN_DR] != 0.0
    turn = speed * math.cos(climb_angle) / radius
    pressure = 0.5 * aircraft[fk.A_DENSITY] * speed**2 * aircraft[fk.A_AREA]
    bank = math.atan(turn * speed / GRAVITY)
    lift = aircraft[fk.A_MASS] * GRAVITY / math.cos(bank) / pressure
    alpha = min((lift - aircraft[fk.A_CL0]) / aircraft[fk.A_CL_ALPHA], 0.4)
    elevator = -(aircraft[fk.A_CM0] + aircraft[fk.A_CM_ALPHA] * alpha) / aircraft[fk.A_CM_DE]
    guess = np.array([alpha, 0.0, bank, alpha * math.cos(bank) + climb_angle, elevator, 0.0, 0.0, 0.5])
    rate = np.empty(fk.N_BODY)

    def unwanted(z: FloatArray) -> FloatArray:
        x, d = _steady(z, speed, turn)
        fk.fixed_wing_derivative(x, d, _STILL, aircraft, rate)
        climb = -rate[2] - speed * math.sin(climb_angle)
        return np.array([*rate[fk.U : fk.W + 1], *rate[fk.P : fk.R + 1], climb, z[1] if rudder else z[6]])

    found = root(unwanted, guess, method="lm", options={"xtol": 1e-14, "ftol": 1e-14, "maxiter": 2000})
    residual = float(np.max(np.abs(unwanted(found.x))))
    if not residual < 1e-6 or abs(found.x[0]) > aircraft[fk.A_STALL_ALPHA]:
        raise ValueError(
            f"no steady flight at {speed:g} m/s, climb angle {math.degrees(climb_angle):.1f} deg, radius {radius:g} m:"
            " fly faster, or turn less tightly"
        )
    x, d = _steady(found.x, speed, turn)
    alpha, beta, roll, pitch = (float(v) for v in found.x[:4])
    return Trim(x, d, alpha, beta, roll, pitch, residual)


def _steady(z: FloatArray, speed: float, turn: float) -> tuple[FloatArray, FloatArray]:
    alpha, beta, roll, pitch = z[:4]
    x = np.zeros(fk.N_BODY)
    x[fk.U] = speed * math.cos(alpha) * math.cos(beta)
    x[fk.V] = speed * math.sin(beta)
    x[fk.W] = speed * math.sin(alpha) * math.cos(beta)
    x[fk.E0 : fk.E3 + 1] = quaternion(roll, pitch, 0.0)
    x[fk.P] = -turn * math.sin(pitch)
    x[fk.Q] = turn * math.sin(roll) * math.cos(pitch)
    x[fk.R] = turn * math.cos(roll) * math.cos(pitch)
    return x, np.ascontiguousarray(z[4:])


def quaternion(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the quaternion (4,), scalar first, from body to NED, of Euler angles (rad, order 3-2-1)."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return np.array(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ]
    )


@dataclass(frozen=True, slots=True)
class Modes:
    """Eigenvalues (1/s) of the linear motion about a trim.

    Attributes
    ----------
    short_period, phugoid, dutch_roll : complex
        Of a pair that oscillates the one above the real axis; of a pair that does not, the faster one.
    roll, spiral : float
    """

    short_period: complex
    phugoid: complex
    dutch_roll: complex
    roll: float
    spiral: float


def linear_model(aircraft: FloatArray, flight: Trim) -> tuple[FloatArray, FloatArray]:
    """Return A (8, 8) and B (8, 4) of the states u, v, w, p, q, r, roll, pitch and the controls, by differences."""

    def rates(y: FloatArray) -> FloatArray:
        x = np.zeros(fk.N_BODY)
        x[fk.U : fk.W + 1], x[fk.P : fk.R + 1] = y[:3], y[3:6]
        x[fk.E0 : fk.E3 + 1] = quaternion(y[6], y[7], 0.0)
        out = np.empty(fk.N_BODY)
        fk.fixed_wing_derivative(x, y[8:].copy(), _STILL, aircraft, out)
        p, q, r = y[3:6]
        around = q * math.sin(y[6]) + r * math.cos(y[6])
        roll = p + around * math.tan(y[7])
        pitch = q * math.cos(y[6]) - r * math.sin(y[6])
        return np.array([*out[fk.U : fk.W + 1], *out[fk.P : fk.R + 1], roll, pitch])

    x = flight.state
    at = np.array([*x[fk.U : fk.W + 1], *x[fk.P : fk.R + 1], flight.roll, flight.pitch, *flight.controls])
    jacobian = np.empty((8, 12))
    for i in range(12):
        step = np.zeros(12)
        step[i] = 1e-5
        jacobian[:, i] = (rates(at + step) - rates(at - step)) / 2e-5
    return jacobian[:, :8], jacobian[:, 8:]


def modes(aircraft: FloatArray, flight: Trim) -> Modes:
    """Return the modes of straight flight; longitudinal and lateral motion are taken as uncoupled."""
    full, _ = linear_model(aircraft, flight)
    longitudinal = _upper(np.linalg.eigvals(full[np.ix_(_LONGITUDINAL, _LONGITUDINAL)]))
    lateral = np.linalg.eigvals(full[np.ix_(_LATERAL, _LATERAL)])
    pair = lateral[np.abs(lateral.imag) > 1e-9]
    real = np.sort(lateral[np.abs(lateral.imag) <= 1e-9].real)
    if len(pair) != 2:
        raise ValueError(f"no dutch roll that oscillates among the lateral eigenvalues {lateral}")
    return Modes(
        complex(longitudinal[0]),
        complex(longitudinal[-1]),
        complex(pair[np.argmax(pair.imag)]),
        float(real[0]),
        float(real[-1]),
    )


def _upper(values: NDArray[Any]) -> NDArray[Any]:
    upper = values[values.imag >= -1e-12]
    return upper[np.argsort(-np.abs(upper))]
