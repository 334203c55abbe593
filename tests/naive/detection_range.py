"""Naive twins of the detection ranges: fly it in small steps, look at all distances, and halve the interval."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.optimize import brentq

FloatArray = NDArray[np.float64]
G = 9.81


def rolls(lengths: list[float], tau: float, rate: float) -> tuple[FloatArray, FloatArray]:
    """Times and banks under ailerons +, -, 0, -, + held for `lengths`: tau bank'' + bank' = ailerons, in steps."""
    times, banks = [np.zeros(1)], [np.zeros(1)]
    state, t0 = [0.0, 0.0], 0.0
    for ailerons, length in zip((rate, -rate, 0.0, -rate, rate), lengths, strict=True):
        if length <= 0:
            continue
        if ailerons == 0.0:
            state[1] = 0.0
        t = np.linspace(0.0, length, 2001)
        answer = solve_ivp(
            lambda _, s, a=ailerons: [s[1], (a - s[1]) / tau], (0.0, length), state, t_eval=t, rtol=1e-11, atol=1e-13
        )
        times.append(t0 + t[1:])
        banks.append(answer.y[0, 1:])
        state, t0 = [answer.y[0, -1], answer.y[1, -1]], t0 + length
    return np.concatenate(times), np.concatenate(banks)


def course(times: FloatArray, banks: FloatArray, v: float) -> FloatArray:
    return np.asarray(cumulative_trapezoid(G / v * np.tan(banks), times, initial=0.0))


def to_rest(t1: float, tau: float) -> float:
    """How long the opposite ailerons stop the roll that `t1` of ailerons has begun."""
    roll = 1.0 - math.exp(-t1 / tau)
    return float(brentq(lambda s: (roll + 1.0) * math.exp(-s / tau) - 1.0, 0.0, tau))


def turn(v: float, angle: float, bank: float, rate: float, tau: float, until: float) -> tuple[FloatArray, FloatArray]:
    """Times and positions (n, 2) of a turn to the right that begins at 0, up to `until`."""

    def lengths(t1: float, hold: float) -> list[float]:
        return [t1, to_rest(t1, tau), hold, t1, to_rest(t1, tau)]

    def peak(t1: float) -> float:
        return float(rolls([t1, to_rest(t1, tau), 0.0, 0.0, 0.0], tau, rate)[1][-1])

    def turned(t1: float) -> float:
        return float(course(*rolls(lengths(t1, 0.0), tau, rate), v)[-1])

    t1 = float(brentq(lambda t: peak(t) - bank, 1e-9, bank / rate + tau, xtol=1e-12))
    if turned(t1) <= angle:
        hold = (angle - turned(t1)) * v / (G * math.tan(bank))
    else:
        t1, hold = float(brentq(lambda t: turned(t) - angle, 1e-9, t1, xtol=1e-12)), 0.0
    times, banks = rolls(lengths(t1, hold), tau, rate)
    chi = course(times, banks, v)
    xy = [cumulative_trapezoid(v * f(chi), times, initial=0.0) for f in (np.cos, np.sin)]
    after = np.arange(0.005, max(until - times[-1], 0.01), 0.005)
    straight = [p[-1] + v * f(angle) * after for p, f in zip(xy, (math.cos, math.sin), strict=True)]
    positions = np.stack([np.concatenate(pair) for pair in zip(xy, straight, strict=True)], axis=1)
    return np.concatenate([times, times[-1] + after]), positions


def after_waiting(times: FloatArray, positions: FloatArray, v: float, wait: float) -> tuple[FloatArray, FloatArray]:
    """The same path flown after `wait` of straight flight."""
    before = np.arange(0.0, wait, 0.02)
    lead = np.stack([v * before, np.zeros_like(before)], axis=1)
    return np.concatenate([before, wait + times]), np.concatenate([lead, positions + np.array([v * wait, 0.0])])


def velocity_change(
    v: float, new: FloatArray, acceleration: float, tau: float, until: float
) -> tuple[FloatArray, FloatArray]:
    """Times and positions while the velocity goes from (v, 0) to `new`, in steps of 2 ms."""
    dt = 0.002
    velocity, position, positions = np.array([v, 0.0]), np.zeros(2), [np.zeros(2)]
    for _ in range(round(until / dt)):
        missing = new - velocity
        size = float(np.hypot(*missing))
        wanted = min(size / tau if tau > 0 else math.inf, acceleration)
        change = missing * min(wanted * dt / size, 1.0) if size > 0 else missing
        position = position + (velocity + change / 2) * dt
        velocity = velocity + change
        positions.append(position)
    return dt * np.arange(len(positions), dtype=np.float64), np.array(positions)


def height(t: FloatArray, rate: float, acceleration: float, tau: float) -> FloatArray:
    """Height gained at times `t`, in steps of 1 ms; nothing before 0."""
    dt, speed, h, heights = 0.001, 0.0, 0.0, [0.0]
    for _ in range(round(max(float(t.max()), 0.0) / dt) + 1):
        change = min((rate - speed) * (dt / tau if tau > 0 else 1.0), acceleration * dt, rate - speed)
        h += (speed + change / 2) * dt
        speed += change
        heights.append(h)
    return np.interp(t, np.arange(len(heights)) * dt, heights)


def nearest(times: FloatArray, positions: FloatArray, start: FloatArray, velocities: FloatArray) -> FloatArray:
    """The smallest distance to each intruder that flies straight from `start` with one of `velocities` (m, 2)."""
    found = []
    for velocity in np.atleast_2d(velocities):
        r = positions - start - velocity * times[:, None]
        found.append(np.hypot(r[:, 0], r[:, 1]).min())
    return np.array(found)


def largest_unsafe(safe: Callable[[float], bool], low: float, high: float, parts: int = 200) -> float:
    """The largest distance within [low, high] that is not safe: looked for from afar, then halved."""
    grid = np.linspace(high, low, parts)
    k = next(i for i, d in enumerate(grid) if not safe(float(d)))
    assert k > 0, "unsafe at the far end"
    bad, good = float(grid[k]), float(grid[k - 1])
    while good - bad > 1e-7 * good:
        middle = (bad + good) / 2
        bad, good = (bad, middle) if safe(middle) else (middle, good)
    return good
