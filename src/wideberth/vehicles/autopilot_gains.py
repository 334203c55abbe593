"""The autopilot's gains, computed from the aircraft's linear model and the wanted speed of each loop."""

import math

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import autopilot_kernels as ak
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.aircraft import Aircraft
from wideberth.vehicles.config import FixedWingConfig
from wideberth.vehicles.kernels import GRAVITY
from wideberth.vehicles.trim import Trim, trim


def gains(aircraft: Aircraft, config: FixedWingConfig) -> FloatArray:
    """Return the kernels' array of gains and limits (indices ``K_...``).

    Roll and pitch are second order with the aircraft's own stiffness and damping (Beard and McLain, eqs. 5.24 to 5.29):
    the gains place their frequency and damping. Course, climb angle and airspeed are slower first-order loops.
    """
    a = aircraft.array(config.air_density_kgm3)
    speed = aircraft.design_speed
    level = trim(a, speed)
    k = np.zeros(ak.N_GAINS)
    k[ak.K_DESIGN_SPEED] = speed
    pressure = 0.5 * a[fk.A_DENSITY] * speed**2 * a[fk.A_AREA]
    _roll_and_course(k, a, pressure, speed, config)
    _pitch_and_climb(k, a, pressure, speed, config)
    _throttle(k, a, pressure, level, config)
    k[ak.K_AILERON], k[ak.K_RUDDER] = level.controls[fk.AILERON], level.controls[fk.RUDDER]
    if aircraft.has_rudder:
        k[ak.K_YAW_DAMPER] = 0.2
    k[ak.K_TURN_AILERON], k[ak.K_TURN_RUDDER] = _turn_controls(a, aircraft.has_rudder)
    k[ak.K_BANK_MAX] = math.radians(config.bank_max_deg)
    k[ak.K_BANK_RATE_MAX] = math.radians(config.bank_rate_max_deg_s)
    k[ak.K_CLIMB_MAX], k[ak.K_SINK_MAX] = config.climb_rate_max_mps, config.sink_rate_max_mps
    k[ak.K_VERTICAL_ACCEL_MAX] = config.vertical_acceleration_max_mps2
    k[ak.K_SPEED_MIN], k[ak.K_SPEED_MAX] = config.speed_min_mps, config.speed_max_mps
    k[ak.K_ACCEL_MAX] = config.acceleration_max_mps2
    k[ak.K_DEFLECTION_MAX] = aircraft.deflection_max
    k[ak.K_PITCH_MAX] = math.radians(30.0)
    return k


def _roll_and_course(k: FloatArray, a: FloatArray, pressure: float, speed: float, config: FixedWingConfig) -> None:
    g3, g4 = a[fk.A_GAMMA + 2], a[fk.A_GAMMA + 3]
    moment = pressure * a[fk.A_SPAN]
    damping = -moment * (g3 * a[fk.A_CROLL_P] + g4 * a[fk.A_CN_P]) * a[fk.A_SPAN] / (2.0 * speed)
    effect = moment * (g3 * a[fk.A_CROLL_DA] + g4 * a[fk.A_CN_DA])
    frequency = math.sqrt(damping / config.bank_time_constant_s)
    k[ak.K_ROLL] = frequency**2 / effect
    k[ak.K_ROLL_RATE] = max(2.0 * 0.9 * frequency - damping, 0.0) / effect
    k[ak.K_COURSE] = config.course_gain_per_s
    k[ak.K_COURSE_INTEGRAL] = config.course_gain_per_s**2 / 8.0


def _turn_controls(a: FloatArray, rudder: bool) -> tuple[float, float]:
    """Return aileron and rudder per scaled yaw rate that leave no moment: without sideslip, or with that it takes."""
    last = (fk.A_CROLL_DR, fk.A_CN_DR) if rudder else (fk.A_CROLL_BETA, fk.A_CN_BETA)
    effect = np.array([[a[fk.A_CROLL_DA], a[last[0]]], [a[fk.A_CN_DA], a[last[1]]]])
    aileron, other = np.linalg.solve(effect, [-a[fk.A_CROLL_R], -a[fk.A_CN_R]])
    return float(aileron), float(other) if rudder else 0.0


def _pitch_and_climb(k: FloatArray, a: FloatArray, pressure: float, speed: float, config: FixedWingConfig) -> None:
    moment = pressure * a[fk.A_CHORD] / a[fk.A_JY]
    damping = -moment * a[fk.A_CM_Q] * a[fk.A_CHORD] / (2.0 * speed)
    stiffness, effect = -moment * a[fk.A_CM_ALPHA], moment * a[fk.A_CM_DE]
    frequency = 1.3 * math.sqrt(stiffness)
    k[ak.K_PITCH] = (frequency**2 - stiffness) / effect
    k[ak.K_PITCH_RATE] = (2.0 * 0.8 * frequency - damping) / effect
    k[ak.K_CLIMB] = 0.3 / config.climb_time_constant_s
    k[ak.K_CLIMB_INTEGRAL] = 0.5 / config.climb_time_constant_s


def _throttle(k: FloatArray, a: FloatArray, pressure: float, level: Trim, config: FixedWingConfig) -> None:
    speed, throttle = float(k[ak.K_DESIGN_SPEED]), float(level.controls[fk.THROTTLE])
    up, _ = fk.thrust_and_torque(speed, throttle + 0.01, a)
    low, _ = fk.thrust_and_torque(speed, throttle - 0.01, a)
    slope = (up - low) / 0.02  # N
    k[ak.K_THROTTLE] = throttle
    k[ak.K_THROTTLE_SLOPE] = (trim(a, 1.05 * speed).controls[fk.THROTTLE] - throttle) / (0.05 * speed)
    k[ak.K_WEIGHT_THROTTLE] = a[fk.A_MASS] * GRAVITY / slope
    lift = a[fk.A_MASS] * GRAVITY / pressure
    k[ak.K_DRAG_THROTTLE] = pressure * a[fk.A_CD_INDUCED] * lift**2 / slope
    k[ak.K_SPEED] = a[fk.A_MASS] / (slope * config.speed_time_constant_s)
    k[ak.K_SPEED_INTEGRAL] = k[ak.K_SPEED] / (3.0 * config.speed_time_constant_s)
