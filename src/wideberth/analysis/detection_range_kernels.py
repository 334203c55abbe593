"""Compiled minimum detection ranges in a head-on encounter, by the four methods of the thesis, chapter 2.

An intruder that starts its way at distance D from the place where the ownship turns is nearer than R at time t exactly
if D lies within sqrt(R^2 - y^2) of x + v_i t, with (x, y) the ownship's path. Every D is safe beyond the largest of

    U(t) = x(t) + v_i t + sqrt(R^2 - y(t)^2),

whose stationary points are the thesis' (2.22). For turns up to 90 degrees there is one; beyond, the largest is taken.
Distances here leave out the computation time. Frame and units as in `turn_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.analysis.turn_kernels import (
    BANK,
    COMMAND,
    LENGTH,
    N_PHASES,
    RATE,
    advance,
    bank_at,
    next_panel,
    turn_phases,
)
from wideberth.vehicles.kernels import GRAVITY

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TT, GT, GVV, TGVV = 0, 1, 2, 3
RIGHT_ANGLE = 0.5 * math.pi
COARSE_TURN, FINE_TURN = 1.2, 0.1  # change of course per panel: to integrate, and to look for several stationary points
REVERSED = 1e-9  # rad short of a half turn that count as a half turn


@jit
def slope_of_range(y: float, course: float, v_o: float, v_i: float, radius: float) -> float:
    """Return (2.22), which has the sign of -dU/dt; positive where the ownship is abeam by the radius."""
    s = math.sqrt(max(radius * radius - y * y, 0.0))
    return y * v_o * math.sin(course) - s * (v_i + v_o * math.cos(course))


@jit
def value_of_range(t: float, x: float, y: float, v_i: float, radius: float) -> float:
    """Return U."""
    return x + v_i * t + math.sqrt(max(radius * radius - y * y, 0.0))


@jit
def straight_leg(
    t: float, x: float, y: float, v_o: float, v_i: float, radius: float, turn: float
) -> tuple[float, float]:
    """Return largest U and its time on the leg after the turn; NaN where the ownship never comes abeam by the radius.

    (2.30): on that leg the closest point of approach lies at a fixed distance abeam.
    """
    if turn > math.pi - REVERSED:
        return (value_of_range(t, x, y, v_i, radius), t) if y >= radius else (math.nan, math.nan)
    relative = math.sqrt(v_o * v_o + v_i * v_i + 2.0 * v_o * v_i * math.cos(turn))
    abeam = radius * (v_i + v_o * math.cos(turn)) / relative if relative > 0.0 else 0.0
    dt = max((abeam - y) / (v_o * math.sin(turn)), 0.0)
    return value_of_range(t + dt, x + v_o * math.cos(turn) * dt, max(abeam, y), v_i, radius), t + dt


@jit
def stationary_in_panel(
    v_o: float,
    v_i: float,
    radius: float,
    t: float,
    course: float,
    x: float,
    y: float,
    s: float,
    h: float,
    bank: float,
    rate: float,
    command: float,
    tau: float,
) -> tuple[float, float]:
    """Return U and time of its maximum within a panel at whose ends (2.22) has different signs.

    A Newton step is taken where it stays within the bracket, else the bracket is halved: it cannot fail to converge.
    """
    low, high = 0.0, h
    u = 0.5 * h
    for _ in range(200):
        turn, dx, dy = advance(v_o, course, s, u, bank, rate, command, tau)
        chi, y_u = course + turn, y + dy
        f = slope_of_range(y_u, chi, v_o, v_i, radius)
        if f < 0.0:
            low = u
        else:
            high = u
        root = math.sqrt(max(radius * radius - y_u * y_u, 0.0))
        sine, cosine = math.sin(chi), math.cos(chi)
        chi_rate = GRAVITY / v_o * math.tan(bank_at(s + u, bank, rate, command, tau))
        slope = v_o * v_o * sine * sine + (y_u * v_o * cosine + root * v_o * sine) * chi_rate
        if root > 0.0:
            slope += y_u * v_o * sine / root * (v_i + v_o * cosine)
        step = u - f / slope if slope > 0.0 and root > 0.0 else -1.0
        if not low < step < high:
            step = 0.5 * (low + high)
        if abs(step - u) <= 1e-10 * (t + u) or high - low <= 1e-13 * (t + high):
            break
        u = step
    turn, dx, dy = advance(v_o, course, s, u, bank, rate, command, tau)
    return value_of_range(t + u, x + dx, y + dy, v_i, radius), t + u


@jit
def tgvv(
    v_o: float, v_i: float, radius: float, bank_max: float, turn: float, rate: float, tau: float
) -> tuple[float, float, bool]:
    """Return largest U, its time, and whether the largest bank is reached (Case A); NaN where no distance is enough."""
    phases = np.empty((N_PHASES, 4))
    peak, reached = turn_phases(v_o, turn, bank_max, rate, tau, phases)
    several = turn > RIGHT_ANGLE
    limit = FINE_TURN if several else COARSE_TURN
    t = course = x = y = 0.0
    best, best_t = radius, 0.0
    before = slope_of_range(y, course, v_o, v_i, radius)
    for k in range(N_PHASES):
        s, length = 0.0, phases[k, LENGTH]
        bank, roll, command = phases[k, BANK], phases[k, RATE], phases[k, COMMAND]
        while s < length:
            h = next_panel(phases, k, s, peak, rate, tau, limit, v_o)
            dchi, dx, dy = advance(v_o, course, s, h, bank, roll, command, tau)
            after = slope_of_range(y + dy, course + dchi, v_o, v_i, radius)
            if before < 0.0 <= after:
                value, time = stationary_in_panel(v_o, v_i, radius, t, course, x, y, s, h, bank, roll, command, tau)
                if value > best:
                    best, best_t = value, time
                if not several:
                    return best, best_t, reached
            t, course, x, y, before = t + h, course + dchi, x + dx, y + dy, after
            if y >= radius:
                return best, best_t, reached
            if s + h >= length:
                break
            s += h
    value, time = straight_leg(t, x, y, v_o, v_i, radius, turn)
    if math.isnan(value):
        return math.nan, math.nan, reached
    if value > best:
        best, best_t = value, time
    return best, best_t, reached


@jit
def circle_range(
    v_o: float, v_i: float, radius: float, turn_radius: float, low: float, high: float
) -> tuple[float, float]:
    """Return U and course of its maximum on a circle, between two courses at which (2.22) has different signs."""
    for _ in range(60):
        chi = 0.5 * (low + high)
        if slope_of_range(2.0 * turn_radius * math.sin(0.5 * chi) ** 2, chi, v_o, v_i, radius) < 0.0:
            low = chi
        else:
            high = chi
    y = 2.0 * turn_radius * math.sin(0.5 * high) ** 2
    return value_of_range(turn_radius * high / v_o, turn_radius * math.sin(high), y, v_i, radius), high


@jit
def within_turn(v_o: float, v_i: float, radius: float, turn_radius: float, abeam: float) -> tuple[float, float]:
    """Return U and course of its maximum on a circle where that lies before `abeam` and before 90 degrees.

    The cubic (2.43) in z = y / R, divided by its last coefficient. It can have other roots, but not in this bracket.
    """
    p, q = v_o / (v_i + v_o), radius / turn_radius
    a, b, c = 2.0 * (1.0 - p) * p * q, p * p * q * q - 1.0, -2.0 * p * q
    low, high = 0.0, abeam / radius
    # Without its cubic term it would be a difference of two squares.
    z = min(1.0 / (1.0 + p * q), high)
    for _ in range(100):
        f = ((a * z + b) * z + c) * z + 1.0
        if f > 0.0:
            low = z
        else:
            high = z
        slope = (3.0 * a * z + 2.0 * b) * z + c
        step = z - f / slope if slope < 0.0 else -1.0
        if not low <= step <= high:
            step = 0.5 * (low + high)
        done = abs(step - z) <= 1e-15
        z = step
        if done:
            break
    y = radius * z
    chi = 2.0 * math.asin(math.sqrt(0.5 * y / turn_radius))
    x = math.sqrt(y * (2.0 * turn_radius - y))
    return value_of_range(turn_radius * chi / v_o, x, y, v_i, radius), chi


@jit
def gvv(v_o: float, v_i: float, radius: float, bank_max: float, turn: float) -> tuple[float, float, int]:
    """Return largest U, its time and the case: 1 after the turn (2.37), 2 within it (2.46); NaN as `tgvv`.

    Beyond 90 degrees the whole circle is looked through, for there can be several maxima.
    """
    turn_radius = v_o * v_o / (GRAVITY * math.tan(bank_max))
    t, x, y = turn_radius * turn / v_o, turn_radius * math.sin(turn), 2.0 * turn_radius * math.sin(0.5 * turn) ** 2
    # The turn ends, or the ownship is abeam by the radius: U falls from there.
    last = turn if y <= radius else 2.0 * math.asin(math.sqrt(0.5 * radius / turn_radius))
    best, best_t, case = radius, 0.0, 2
    if radius == 0.0:
        return best, best_t, case
    if turn <= RIGHT_ANGLE:
        if y > radius or slope_of_range(y, turn, v_o, v_i, radius) > 0.0:
            value, chi = within_turn(v_o, v_i, radius, turn_radius, min(y, radius))
            return value, turn_radius * chi / v_o, 2
    else:
        steps = math.ceil(last / FINE_TURN)
        before = -1.0
        for i in range(1, steps + 1):
            chi = last * i / steps
            after = slope_of_range(2.0 * turn_radius * math.sin(0.5 * chi) ** 2, chi, v_o, v_i, radius)
            if i == steps and y > radius:
                after = 1.0
            if before < 0.0 <= after:
                value, at = circle_range(v_o, v_i, radius, turn_radius, last * (i - 1) / steps, chi)
                if value > best:
                    best, best_t = value, turn_radius * at / v_o
            before = after
        if y > radius:
            return best, best_t, case
    value, time = straight_leg(t, x, y, v_o, v_i, radius, turn)
    if math.isnan(value):
        return math.nan, math.nan, 1
    if value > best:
        best, best_t, case = value, time, 1
    return best, best_t, case


@jit
def turn_time(v_o: float, v_i: float, radius: float, bank_max: float) -> tuple[float, float]:
    """Return distance and time to maneuver by (2.4)."""
    t = math.sqrt(2.0 * radius / (GRAVITY * math.tan(bank_max)))
    return (v_o + v_i) * t, t


@jit
def geometric_tangent(v_o: float, v_i: float, radius: float, bank_max: float) -> tuple[float, float]:
    """Return distance and time to maneuver by (2.5)."""
    lateral = GRAVITY * math.tan(bank_max)
    # acos(1 / (1 + q)) without the cancellation of small q.
    q = radius * lateral / (v_o * v_o)
    t = v_o / lateral * 2.0 * math.asin(math.sqrt(0.5 * q / (1.0 + q)))
    return math.sqrt(radius * radius + 2.0 * radius * v_o * v_o / lateral) + v_i * t, t


@jit
def detection_ranges(
    method: int,
    arguments: FloatArray,
    out_distance: FloatArray,
    out_time: FloatArray,
    out_case: IntArray,
) -> None:
    """Write distance, time to maneuver and case of each element; case 1 stands for Case A and 2 for Case B too."""
    # A row for each argument.
    v_o, v_i, radius, bank_max, turn = arguments[0], arguments[1], arguments[2], arguments[3], arguments[4]
    rate, tau = arguments[5], arguments[6]
    for i in range(v_o.shape[0]):
        case = 0
        if method == TGVV:
            d, t, reached = tgvv(v_o[i], v_i[i], radius[i], bank_max[i], turn[i], rate[i], tau[i])
            case = 1 if reached else 2
        elif method == GVV:
            d, t, case = gvv(v_o[i], v_i[i], radius[i], bank_max[i], turn[i])
        elif method == TT:
            d, t = turn_time(v_o[i], v_i[i], radius[i], bank_max[i])
        else:
            d, t = geometric_tangent(v_o[i], v_i[i], radius[i], bank_max[i])
        out_distance[i], out_time[i], out_case[i] = d, t, case


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    arguments = np.array([[20.0], [80.0], [150.0], [0.5], [1.0], [1.0], [1.0]])
    for method in (TT, GT, GVV, TGVV):
        detection_ranges(method, arguments, np.empty(1), np.empty(1), np.empty(1, np.int64))
