"""Naive twin of the detection ranges: fly the turn in small steps and look at all distances."""

import math

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
        t = np.linspace(0.0, length, 501)
        answer = solve_ivp(
            lambda _, s, a=ailerons: [s[1], (a - s[1]) / tau], (0.0, length), state, t_eval=t, rtol=1e-8, atol=1e-10
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

    t1 = float(brentq(lambda t: peak(t) - bank, 1e-9, bank / rate + tau, xtol=1e-8))
    if turned(t1) <= angle:
        hold = (angle - turned(t1)) * v / (G * math.tan(bank))
    else:
        t1, hold = float(brentq(lambda t: turned(t) - angle, 1e-9, t1, xtol=1e-8)), 0.0
    times, banks = rolls(lengths(t1, hold), tau, rate)
    chi = course(times, banks, v)
    xy = [cumulative_trapezoid(v * f(chi), times, initial=0.0) for f in (np.cos, np.sin)]
    after = np.arange(0.02, max(until - times[-1], 0.03), 0.02)
    straight = [p[-1] + v * f(angle) * after for p, f in zip(xy, (math.cos, math.sin), strict=True)]
    positions = np.stack([np.concatenate(pair) for pair in zip(xy, straight, strict=True)], axis=1)
    return np.concatenate([times, times[-1] + after]), positions


def after_waiting(times: FloatArray, positions: FloatArray, v: float, wait: float) -> tuple[FloatArray, FloatArray]:
    """The same path flown after `wait` of straight flight."""
    before = np.arange(0.0, wait, 0.02)
    lead = np.stack([v * before, np.zeros_like(before)], axis=1)
    return np.concatenate([before, wait + times]), np.concatenate([lead, positions + np.array([v * wait, 0.0])])


def nearest(times: FloatArray, positions: FloatArray, start: FloatArray, velocities: FloatArray) -> FloatArray:
    """The smallest distance to each intruder that flies straight from `start` with one of `velocities` (m, 2)."""
    found = []
    for velocity in np.atleast_2d(velocities):
        r = positions - start - velocity * times[:, None]
        found.append(np.hypot(r[:, 0], r[:, 1]).min())
    return np.array(found)
