"""Compiled turn of an aircraft that rolls with a lag: bank, course and path (thesis 2.1.2 and appendix A).

The roll rate answers the ailerons with a first-order lag. To bank: full ailerons one way (for t1), then the other way
until the roll rate is zero (t2 in all); to level again: the same mirrored. In between the peak bank is held. Where it
is the largest bank allowed this is the thesis' Case A; where the turn ends before that is reached it is Case B, which
is Case A with a smaller peak and nothing to hold.

Course and path are integrated with Gauss collocation over panels on which the integrand is smooth. Frame: x ahead and y
to the right of the course before the turn; turns are to the right. SI, rad.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.vehicles.kernels import GRAVITY

FloatArray = NDArray[np.float64]

N_PHASES = 5  # rolling in, checking the roll, holding, rolling out, checking the roll

# Columns of the table of phases.
LENGTH, BANK, RATE, COMMAND = 0, 1, 2, 3  # s; bank and roll rate at the start; rate that the ailerons ask for

NO_LAG = 1e-9  # s; a time constant up to this counts as none

_NODES = 8
_abscissae, _weights = np.polynomial.legendre.leggauss(_NODES)
NODES = 0.5 * (_abscissae + 1.0)
WEIGHTS = 0.5 * _weights
# INTEGRATION[i, j]: what the value at node j adds to the integral from 0 to node i (exact for polynomials).
_powers = np.arange(_NODES)
INTEGRATION = np.linalg.solve(
    (NODES[:, None] ** _powers).T, (NODES[:, None] ** (_powers + 1) / (_powers + 1)).T
).T.copy()


@jit
def lagged(u: float) -> float:
    """Return u - (1 - exp(-u)) without cancellation."""
    if u < 0.03:
        return u * u * (0.5 - u * (1.0 / 6.0 - u * (1.0 / 24.0 - u * (1.0 / 120.0 - u / 720.0))))
    return u + math.expm1(-u)


@jit
def bank_at(s: float, bank: float, rate: float, command: float, tau: float) -> float:
    """Return the bank `s` after the start of a phase (2.13)."""
    if tau <= NO_LAG:
        return bank + command * s
    return bank + tau * (command * lagged(s / tau) - rate * math.expm1(-s / tau))


@jit
def roll_times(peak: float, rate: float, tau: float) -> tuple[float, float]:
    """Return t1 and t2 of rolling to a bank, in the form that does not underflow (errata on A.10)."""
    straight = peak / rate
    if tau <= NO_LAG or straight == 0.0:
        return straight, straight
    lag = tau * math.log1p(math.sqrt(-math.expm1(-straight / tau)))
    return straight + lag, straight + 2.0 * lag


@jit
def panel_length(
    s: float, left: float, phi: float, peak: float, rate: float, tau: float, turn: float, g_v: float
) -> float:
    """Return a length on which the turn is smooth, `s` into a phase of which `left` is left, at roll-in bank `phi`.

    It serves rolling in and out alike, for the bank is `phi` in one and `peak - phi` in the other. `turn` limits the
    change of course.
    """
    h = left
    if tau > NO_LAG:
        h = min(h, 1.5 * max(s, tau))
    # The tangent has a pole at 90 degrees: come no nearer to it in a panel than half of the distance.
    above = 0.5 * math.pi - phi
    if peak - phi > 0.5 * above:
        h = min(h, 0.5 * above / rate)
    h = min(h, (0.5 * math.pi - peak + phi) / rate)
    steepest = g_v * math.tan(min(peak, max(phi + rate * h, peak - phi)))
    while steepest * h > turn:
        h *= 0.5
        steepest = g_v * math.tan(min(peak, max(phi + rate * h, peak - phi)))
    return h


@jit
def roll_course_change(peak: float, rate: float, tau: float, g_v: float) -> float:
    """Return the change of course while rolling to `peak` and back to level (A.15 to A.18)."""
    t1, t2 = roll_times(peak, rate, tau)
    total = 0.0
    bank, roll, command = 0.0, 0.0, rate
    for part in range(2):
        length = t1 if part == 0 else t2 - t1
        s = 0.0
        while s < length:
            phi = bank_at(s, bank, roll, command, tau)
            h = panel_length(s, length - s, phi, peak, rate, tau, math.inf, g_v)
            for i in range(_NODES):
                phi = bank_at(s + NODES[i] * h, bank, roll, command, tau)
                total += WEIGHTS[i] * h * (math.tan(phi) + math.tan(peak - phi))
            if h >= length - s:
                break
            s += h
        bank = bank_at(t1, 0.0, 0.0, rate, tau)
        roll = -rate * math.expm1(-t1 / tau) if tau > NO_LAG else 0.0
        command = -rate
    return g_v * total


@jit
def peak_bank(turn: float, bank_max: float, rate: float, tau: float, g_v: float) -> tuple[float, float]:
    """Return the peak bank of a turn and the change of course while holding it; 0 where nothing is held (Case B)."""
    if math.isinf(rate):
        return bank_max, turn
    rolling = roll_course_change(bank_max, rate, tau, g_v)
    if rolling <= turn:
        return bank_max, turn - rolling
    # The change of course goes nearly with a power of the peak: a secant in logarithms, kept within its bracket.
    low, high = -math.inf, math.log(bank_max)
    x0, f0 = high, math.log(rolling / turn)
    slope = 2.0
    for _ in range(100):
        x = x0 - f0 / slope
        if not low < x < high:
            x = 0.5 * (low + high) if low > -math.inf else x0 - 1.0
        f = math.log(roll_course_change(math.exp(x), rate, tau, g_v) / turn)
        if f > 0.0:
            high = x
        else:
            low = x
        if x != x0 and f != f0:
            slope = min(max((f - f0) / (x - x0), 0.5), 50.0)
        x0, f0 = x, f
        if abs(f) < 1e-13 or high - low < 1e-15:
            break
    return math.exp(x0), 0.0


@jit
def turn_phases(
    v: float, turn: float, bank_max: float, rate: float, tau: float, phases: FloatArray
) -> tuple[float, bool]:
    """Write the phases of a turn into `phases` (5, 4); return the peak bank and whether it is the largest (Case A)."""
    g_v = GRAVITY / v
    peak, held = peak_bank(turn, bank_max, rate, tau, g_v)
    t1, t2 = roll_times(peak, rate, tau)
    middle = bank_at(t1, 0.0, 0.0, rate, tau) if t1 > 0.0 else peak
    roll = -rate * math.expm1(-t1 / tau) if tau > NO_LAG and t1 > 0.0 else 0.0
    for k in range(N_PHASES):
        phases[k, LENGTH] = t1 if k in (0, 3) else t2 - t1
        phases[k, COMMAND] = rate if k in (0, 4) else -rate
    phases[2, LENGTH] = held / (g_v * math.tan(peak))
    phases[2, COMMAND] = 0.0
    phases[0, BANK], phases[0, RATE] = 0.0, 0.0
    phases[1, BANK], phases[1, RATE] = middle, roll
    phases[2, BANK], phases[2, RATE] = peak, 0.0
    phases[3, BANK], phases[3, RATE] = peak, 0.0
    phases[4, BANK], phases[4, RATE] = peak - middle, -roll
    return peak, held > 0.0 or peak == bank_max


@jit
def advance(
    v: float, course: float, s: float, h: float, bank: float, rate: float, command: float, tau: float
) -> tuple[float, float, float]:
    """Return change of course, x and y over `h`, from `s` into a phase on at course `course` (2.9 to 2.11)."""
    g_v = GRAVITY / v
    if command == 0.0:
        turn = g_v * math.tan(bank) * h
        # A chord of the circle.
        chord = v * h if turn == 0.0 else v * h * math.sin(0.5 * turn) / (0.5 * turn)
        return turn, chord * math.cos(course + 0.5 * turn), chord * math.sin(course + 0.5 * turn)
    rates = np.empty(_NODES)
    turn = 0.0
    for i in range(_NODES):
        rates[i] = g_v * math.tan(bank_at(s + NODES[i] * h, bank, rate, command, tau))
        turn += WEIGHTS[i] * rates[i]
    dx = dy = 0.0
    for i in range(_NODES):
        chi = 0.0
        for j in range(_NODES):
            chi += INTEGRATION[i, j] * rates[j]
        chi = course + chi * h
        dx += WEIGHTS[i] * math.cos(chi)
        dy += WEIGHTS[i] * math.sin(chi)
    return turn * h, v * h * dx, v * h * dy


@jit
def next_panel(
    phases: FloatArray, k: int, s: float, peak: float, rate: float, tau: float, turn: float, v: float
) -> float:
    """Return the length of the next panel, `s` into phase `k`, with a change of course of at most `turn`."""
    left = float(phases[k, LENGTH]) - s
    if k == 2:
        return min(left, turn * v / (GRAVITY * math.tan(peak)))
    phi = bank_at(s, phases[k, BANK], phases[k, RATE], phases[k, COMMAND], tau)
    return panel_length(s, left, phi if k < 2 else peak - phi, peak, rate, tau, turn, GRAVITY / v)


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    phases = np.empty((N_PHASES, 4))
    peak, _ = turn_phases(20.0, 1.5, 0.5, 0.5, 0.5, phases)
    advance(20.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.5, 0.5)
    next_panel(phases, 0, 0.0, peak, 0.5, 0.5, 1.2, 20.0)
    roll_times(0.5, 0.5, 0.5)
    roll_course_change(0.5, 0.5, 0.5, 0.5)
