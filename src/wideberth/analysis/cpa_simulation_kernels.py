"""Compiled simulation of one avoiding turn: the closest approach to an intruder that flies straight.

The bank is the exact answer to the ailerons; course and path are integrated over small steps by Simpson's rule. Frame
and units as in `turn_kernels`: x along the ownship's first course, y to its right.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.analysis.turn_kernels import BANK, COMMAND, LENGTH, N_PHASES, NO_LAG, RATE, bank_at, turn_phases
from wideberth.conflict.kernels import horizontal_cpa
from wideberth.vehicles.kernels import GRAVITY

FloatArray = NDArray[np.float64]

COURSE_STEP = 0.02  # rad
STEPS_PER_PHASE = 24


@jit
def closest_on_leg(sx: float, sy: float, vx: float, vy: float, length: float) -> tuple[float, float]:
    """Return time and distance of the closest approach within [0, length] of straight flight."""
    t, _ = horizontal_cpa(sx, sy, vx, vy)
    t = min(max(t, 0.0), length)
    return t, math.hypot(sx + vx * t, sy + vy * t)


@jit
def turning_step(
    v: float, course: float, s: float, h: float, bank: float, rate: float, command: float, tau: float
) -> tuple[float, float, float]:
    """Return change of course, x and y over a step `h`, from `s` into a phase on at course `course`."""
    g_v = GRAVITY / v
    first = g_v * math.tan(bank_at(s, bank, rate, command, tau))
    middle = g_v * math.tan(bank_at(s + 0.5 * h, bank, rate, command, tau))
    last = g_v * math.tan(bank_at(s + h, bank, rate, command, tau))
    half = course + h / 24.0 * (5.0 * first + 8.0 * middle - last)
    end = h / 6.0 * (first + 4.0 * middle + last)
    dx = v * h / 6.0 * (math.cos(course) + 4.0 * math.cos(half) + math.cos(course + end))
    dy = v * h / 6.0 * (math.sin(course) + 4.0 * math.sin(half) + math.sin(course + end))
    return end, dx, dy


@jit
def closest_approach(
    px: float,
    py: float,
    ux: float,
    uy: float,
    v: float,
    bank_max: float,
    wait: float,
    turn: float,
    max_rate: float,
    tau: float,
) -> tuple[float, float]:
    """Return distance and time of the closest approach, for all time from now.

    The intruder is at (px, py) with velocity (ux, uy); the ownship waits, turns right, and flies straight.
    """
    t, best = closest_on_leg(px, py, ux - v, uy, wait)
    # Relative position, intruder minus ownship.
    sx, sy = px + (ux - v) * wait, py + uy * wait
    now, course = wait, 0.0
    phases = np.empty((N_PHASES, 4))
    turn_phases(v, turn, bank_max, max_rate, tau, phases)
    for k in range(N_PHASES):
        s, length = 0.0, phases[k, LENGTH]
        bank, rate, command = phases[k, BANK], phases[k, RATE], phases[k, COMMAND]
        while s < length:
            steepest = max(bank_at(s, bank, rate, command, tau), phases[2, BANK] if k < 2 else 1e-9)
            h = min(length - s, COURSE_STEP * v / (GRAVITY * math.tan(steepest)))
            if k != 2:
                # The tangent has a pole at 90 degrees.
                h = min(h, length / STEPS_PER_PHASE, 0.05 * (0.5 * math.pi - steepest) / max_rate)
                if tau > NO_LAG:
                    h = min(h, 0.1 * max(s, tau))
            before = sx * (ux - v * math.cos(course)) + sy * (uy - v * math.sin(course))
            dchi, dx, dy = turning_step(v, course, s, h, bank, rate, command, tau)
            x, y = sx + ux * h - dx, sy + uy * h - dy
            after = x * (ux - v * math.cos(course + dchi)) + y * (uy - v * math.sin(course + dchi))
            if before < 0.0 <= after:
                low, high = 0.0, h
                for _ in range(50):
                    u = 0.5 * (low + high)
                    du, dx, dy = turning_step(v, course, s, u, bank, rate, command, tau)
                    x_u, y_u = sx + ux * u - dx, sy + uy * u - dy
                    closing = x_u * (ux - v * math.cos(course + du)) + y_u * (uy - v * math.sin(course + du))
                    if closing < 0.0:
                        low = u
                    else:
                        high = u
                    if math.hypot(x_u, y_u) < best:
                        t, best = now + u, math.hypot(x_u, y_u)
            sx, sy, course, now = x, y, course + dchi, now + h
            if s + h >= length:
                break
            s += h
    dt, distance = closest_on_leg(sx, sy, ux - v * math.cos(turn), uy - v * math.sin(turn), math.inf)
    if distance < best:
        t, best = now + dt, distance
    return best, t


@jit
def closest_approaches(
    arguments: FloatArray,
    out_cpa: FloatArray,
    out_time: FloatArray,
) -> None:
    """Write distance and time of the closest approach of each element."""
    # A row for each argument.
    distance, bearing, course, v_o, v_i = arguments[0], arguments[1], arguments[2], arguments[3], arguments[4]
    bank_max, wait, turn, max_rate, tau = arguments[5], arguments[6], arguments[7], arguments[8], arguments[9]
    for i in range(distance.shape[0]):
        out_cpa[i], out_time[i] = closest_approach(
            distance[i] * math.cos(bearing[i]),
            distance[i] * math.sin(bearing[i]),
            v_i[i] * math.cos(course[i]),
            v_i[i] * math.sin(course[i]),
            v_o[i],
            bank_max[i],
            wait[i],
            turn[i],
            max_rate[i],
            tau[i],
        )


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    closest_approaches(np.ones((10, 1)), np.empty(1), np.empty(1))
    closest_approach(1e3, 0.0, -80.0, 0.0, 20.0, 0.5, 5.0, 1.5, 0.5, 0.5)
