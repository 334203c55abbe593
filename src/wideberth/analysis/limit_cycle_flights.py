"""Flights that show the limit cycles of `describing_functions`: the loops with t* held, step by step."""

import math

import numpy as np

from wideberth.analysis.describing_functions import LimitCycle, exact_switching_limit_cycle
from wideberth.argument_checks import FloatArray

_CYCLES = 20


def saturation_flight(
    t_star: float, tau: float, delay: float, limit: float, start: float | None = None, duration: float = 200.0
) -> tuple[FloatArray, FloatArray]:
    """Return time and the command wanted of two vehicles that avoid each other alike, with limited commands.

    Parameters
    ----------
    t_star, tau, delay, limit : float
        As of `describing_functions.saturation_limit_cycle`.
    start : float, optional
        Height off the equilibrium at the start, m; by default what wants the limit.
    duration : float
        s.

    Returns
    -------
    time, wanted : ndarray
        s and m/s.
    """
    late = max(round(delay / (tau / 50.0)), 1)
    dt = delay / late
    n = round(duration / dt)
    z, w, wanted = np.full(n + 1, 0.5 * limit * t_star if start is None else start), np.zeros(n + 1), np.zeros(n)
    decay = math.exp(-dt / tau)
    for k in range(n):
        past = max(k - late, 0)
        wanted[k] = -((z[k] + z[past]) / t_star + w[past])
        command = min(max(wanted[k], -limit), limit)
        w[k + 1] = command + (w[k] - command) * decay
        z[k + 1] = z[k] + command * dt + (w[k] - command) * tau * (1.0 - decay)
    return np.arange(n, dtype=np.float64) * dt, wanted


def switching_flight(
    t_star: float, tau: float, level: float, hysteresis: float, delay: float
) -> tuple[FloatArray, FloatArray]:
    """Return time and the miss, less its limit, of a vehicle that switches between avoidance and return.

    Parameters
    ----------
    t_star, tau, level, hysteresis, delay : float
        As of `describing_functions.switching_limit_cycle`; hysteresis or delay must be positive.

    Returns
    -------
    time, miss : ndarray
        s and m.

    Raises
    ------
    ValueError
        If both hysteresis and delay are 0: there is no period then.
    """
    cycle = exact_switching_limit_cycle(t_star, tau, level, hysteresis, delay)
    if cycle is None:
        raise ValueError("without hysteresis and delay the switch has no period: give one of them")
    dt = min(2.0 * math.pi / cycle.frequency / 1000.0, tau / 20.0)
    n = round((_CYCLES * 2.0 * math.pi / cycle.frequency + 10.0 * tau) / dt)
    late = round(delay / dt)
    miss, commands = np.zeros(n), np.zeros(n)
    z, w, command, decay = 0.0, 0.0, level, math.exp(-dt / tau)
    for k in range(n):
        miss[k] = z + w * t_star
        if miss[k] < -hysteresis:
            command = level
        elif miss[k] > hysteresis:
            command = -level
        commands[k] = command
        flown = commands[max(k - late, 0)]
        z += flown * dt + (w - flown) * tau * (1.0 - decay)
        w = flown + (w - flown) * decay
    return np.arange(n, dtype=np.float64) * dt, miss


def measured(time: FloatArray, values: FloatArray, least: float = 0.0) -> LimitCycle | None:
    """Return half the range and the frequency of the second half of a record; None where it has died to `least`."""
    end, t = values[len(values) // 2 :], time[len(values) // 2 :]
    amplitude = float(0.5 * (end.max() - end.min()))
    middle = end - 0.5 * (end.max() + end.min())
    ups = t[:-1][(middle[:-1] < 0.0) & (middle[1:] >= 0.0)]
    if amplitude <= least or len(ups) < 3:
        return None
    return LimitCycle(amplitude, 2.0 * math.pi * (len(ups) - 1) / float(ups[-1] - ups[0]))
