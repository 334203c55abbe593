"""Naive twins of the vehicle kernels: plain vectors and complex numbers, one thought a line."""

import cmath
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
G = 9.81
NAMES = [
    *("tau_speed", "accel_max", "speed_min", "speed_max", "tau_bank", "bank_max", "bank_rate_max", "course_gain"),
    *("tau_climb", "climb_max", "sink_max", "vertical_accel_max", "chi_inf", "path_gain", "altitude_gain", "capture"),
]


def named(p: FloatArray) -> dict[str, float]:
    return dict(zip(NAMES, p.tolist(), strict=True))


def air_velocity(x: FloatArray) -> complex:
    """Horizontal, north + i east."""
    return cmath.rect(math.sqrt(max(x[3] ** 2 - x[6] ** 2, 0.0)), x[4])


def turned(angle: float) -> float:
    return cmath.phase(cmath.rect(1.0, angle))


def lag(value: float, command: float, tau: float, rate: float, dt: float) -> float:
    """Exact first-order response, limited in its mean rate."""
    return value + float(np.clip((command - value) * (1 - math.exp(-dt / tau)), -rate * dt, rate * dt))


def step(x: FloatArray, u: FloatArray, wind: FloatArray, p: FloatArray, dt: float) -> FloatArray:
    q = named(p)
    over_ground = air_velocity(x) + complex(wind[0], wind[1])
    course = cmath.phase(over_ground) if abs(over_ground) > 1e-3 else x[4]
    bank_command = math.atan(q["course_gain"] * turned(u[1] - course) * x[3] / G)
    bank_command = float(np.clip(bank_command, -q["bank_max"], q["bank_max"]))
    new = x.copy()
    new[3] = lag(x[3], np.clip(u[0], q["speed_min"], q["speed_max"]), q["tau_speed"], q["accel_max"], dt)
    new[5] = lag(x[5], bank_command, q["tau_bank"], q["bank_rate_max"], dt)
    new[6] = lag(x[6], np.clip(u[2], -q["sink_max"], q["climb_max"]), q["tau_climb"], q["vertical_accel_max"], dt)
    middle = (x + new) / 2
    turn = G * math.tan(middle[5]) / max(middle[3], 1.0) * dt
    middle[4] = x[4] + turn / 2
    velocity = air_velocity(middle) + complex(wind[0], wind[1])
    new[0] = x[0] + velocity.real * dt
    new[1] = x[1] + velocity.imag * dt
    new[2] = x[2] + (wind[2] - middle[6]) * dt
    new[4] = turned(x[4] + turn)
    return new


def derivative(x: FloatArray, u: FloatArray, wind: FloatArray, p: FloatArray) -> FloatArray:
    """The differential equation that the step solves."""
    q = named(p)
    velocity = air_velocity(x) + complex(wind[0], wind[1])
    course = cmath.phase(velocity) if abs(velocity) > 1e-3 else x[4]
    bank_command = math.atan(q["course_gain"] * turned(u[1] - course) * x[3] / G)
    bank_command = float(np.clip(bank_command, -q["bank_max"], q["bank_max"]))
    speed_command = np.clip(u[0], q["speed_min"], q["speed_max"])
    climb_command = np.clip(u[2], -q["sink_max"], q["climb_max"])
    return np.array(
        [
            velocity.real,
            velocity.imag,
            wind[2] - x[6],
            np.clip((speed_command - x[3]) / q["tau_speed"], -q["accel_max"], q["accel_max"]),
            G * math.tan(x[5]) / max(x[3], 1.0),
            np.clip((bank_command - x[5]) / q["tau_bank"], -q["bank_rate_max"], q["bank_rate_max"]),
            np.clip((climb_command - x[6]) / q["tau_climb"], -q["vertical_accel_max"], q["vertical_accel_max"]),
        ]
    )


def horizontal(point: FloatArray) -> complex:
    return complex(point[0], point[1])


def neighbour(waypoints: FloatArray, index: int, others: Any) -> int | None:
    for i in others:
        if abs(horizontal(waypoints[i]) - horizontal(waypoints[index])) > 1.0:
            return int(i)
    return None


def passed(x: FloatArray, waypoints: FloatArray, index: int, p: FloatArray, wind: FloatArray) -> bool:
    q = named(p)
    to_go = horizontal(waypoints[index]) - horizontal(x)
    ground_speed = abs(air_velocity(x) + complex(wind[0], wind[1]))
    radius = max(ground_speed, x[3]) ** 2 / (G * math.tan(q["bank_max"]))
    start = neighbour(waypoints, index, range(index - 1, -1, -1))
    if start is None:
        return bool(abs(to_go) <= 1.5 * radius)
    leg = horizontal(waypoints[index]) - horizontal(waypoints[start])
    along = to_go * (leg / abs(leg)).conjugate()
    anticipation = 0.0
    end = neighbour(waypoints, index, range(index + 1, len(waypoints)))
    if end is not None:
        following = horizontal(waypoints[end]) - horizontal(waypoints[index])
        turn = abs(cmath.phase(following / leg))
        if turn < 2.8:
            roll = ground_speed * (q["tau_bank"] + q["bank_max"] / q["bank_rate_max"] / 2) * min(turn, 1.0)
            anticipation = 1.15 * radius * min(math.tan(turn / 2), 1.5) + roll
            anticipation = min(anticipation, abs(leg) / 2, abs(following) / 2)
    near = abs(along.imag) <= max(q["capture"], 1.5 * radius) or abs(to_go) <= 1.5 * radius
    return bool(along.real <= anticipation and near)


def follow(
    x: FloatArray, waypoints: FloatArray, speeds: FloatArray, index: int, p: FloatArray, wind: FloatArray
) -> tuple[FloatArray, int]:
    q = named(p)
    n = len(waypoints)
    while index < n and passed(x, waypoints, index, p, wind):
        index += 1
    target = min(index, n - 1)
    over_ground = air_velocity(x) + complex(wind[0], wind[1])
    to_go = horizontal(waypoints[target]) - horizontal(x)
    altitude, slope = -waypoints[target, 2], 0.0
    start = neighbour(waypoints, target, range(target - 1, -1, -1))
    if start is None:
        course = cmath.phase(to_go) if index < n else cmath.phase(over_ground)
    else:
        leg = horizontal(waypoints[target]) - horizontal(waypoints[start])
        along = to_go * (leg / abs(leg)).conjugate()
        if along.real <= 0 and index < n:
            course = cmath.phase(to_go)
        else:
            k_path = q["path_gain"] / max(abs(over_ground), 1.0)
            course = cmath.phase(leg) - q["chi_inf"] * 2 / math.pi * math.atan(k_path * -along.imag)
        altitudes = [-waypoints[start, 2], -waypoints[target, 2]]
        flown = abs(leg) - along.real
        altitude = float(np.interp(flown, [0.0, abs(leg)], altitudes))
        if 0 < along.real < abs(leg):
            rate = max((over_ground * (leg / abs(leg)).conjugate()).real, 0.0)
            slope = (altitudes[1] - altitudes[0]) / abs(leg) * rate
    climb = float(np.clip(slope + q["altitude_gain"] * (altitude + x[2]), -q["sink_max"], q["climb_max"]))
    air = cmath.rect(speeds[target], course) - complex(wind[0], wind[1])
    speed = float(np.clip(math.hypot(abs(air), climb), q["speed_min"], q["speed_max"]))
    return np.array([speed, course, climb]), index


def states_at(t: float, segments: list[tuple[int, FloatArray, FloatArray]]) -> dict[int, FloatArray]:
    """Segments: aircraft, times, states."""
    return {
        aircraft: np.array([np.interp(t, times, states[:, i]) for i in range(6)])
        for aircraft, times, states in segments
        if times[0] <= t <= times[-1]
    }
