"""Naive twins of the cooperative controllers and of the fleet: plain vectors, one thought a line."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.avoidance.cas.config import CasConfig

FloatArray = NDArray[np.float64]


def closest(p: FloatArray, v: FloatArray) -> tuple[float, float]:
    """Time and distance of the closest point ahead."""
    t = max(0.0, -float(p @ v) / float(v @ v)) if v @ v > 0 else 0.0
    return t, float(np.linalg.norm(p + v * t))


def guidance(z: float, wanted: float, c: CasConfig) -> float:
    rate = c.guidance_gain_per_s * (wanted - z)
    return float(np.clip(rate, -c.return_climb_rate_max_mps, c.return_sink_rate_max_mps))


def tangents(p: FloatArray, v: FloatArray, d: float) -> FloatArray | None:
    """Roots w of d*^2(w) = d^2, as a quadratic in w: (p.v)^2 = (p.p - d^2) v.v; above first."""
    level = float(p[:2] @ v[:2])
    outside = float(p @ p) - d * d
    quadratic = [p[2] ** 2 - outside, 2 * p[2] * level, level**2 - outside * float(v[:2] @ v[:2])]
    if outside <= 0 or abs(quadratic[0]) < 1e-12:
        return None
    roots = np.roots(quadratic)
    if np.iscomplex(roots).any():
        return None
    ascending: FloatArray = np.sort(np.real(roots).astype(np.float64))
    return ascending if quadratic[0] < 0 else ascending[::-1]


def chosen_side(heights: list[float], first: bool, c: CasConfig) -> int:
    for height in heights:
        if height != 0:
            return int(np.sign(height))
    return (-1 if first else 1) if c.tie_break else 0


def other_avoids(other: FloatArray, c: CasConfig) -> bool:
    return c.other_cooperates and -other[2] >= c.altitude_min_m


def too_low(own: FloatArray, c: CasConfig) -> bool:
    return bool(-own[2] < c.altitude_min_m)


def continuous(
    own: FloatArray, other: FloatArray, wanted: float, avoiding: bool, first: bool, c: CasConfig
) -> tuple[str, float]:
    d, back = c.separation_m + c.margin_m, guidance(own[2], wanted, c)
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    v_back = np.array([v[0], v[1], back - other[5]])
    (t, dist), (t_back, dist_back) = closest(p, v), closest(p, v_back)
    soon = math.inf if c.t_star_min_s is None else c.t_star_min_s
    inside = float(p @ p) < d * d
    reason = "none"
    if c.force:
        reason = "forced"
    if inside and c.leave_inside:
        reason = "inside"
    if 0 < t < soon and avoiding and abs(dist - d) <= c.hysteresis_m:
        reason = "held"
    if 0 < t_back < soon and dist_back <= d:
        reason = "return trajectory"
    if 0 < t < soon and dist <= d - c.hysteresis_m:
        reason = "current trajectory"
    if reason == "none" or c.disable:
        return "none", back
    which = chosen_side([p[2] + v[2] * (t or t_back)], first, c)
    roots = tangents(p, v, d)
    if which == 0 or (roots is None and not inside):
        return "none", back
    if roots is None:
        reason, rate = "inside", which * 1e9
    else:
        relative = roots[0 if which < 0 else 1]
        law = c.law if other_avoids(other, c) else "full"
        rate = {
            "full": other[5] + relative,
            "shared": other[5] + relative / 2,
            "shared_corrected": own[5] + (relative - v[2]) / 2,
        }[law]
    rate = float(np.clip(rate, -c.climb_rate_max_mps, c.sink_rate_max_mps))
    return reason, min(rate, 0.0) if too_low(own, c) else rate


def bang_bang(
    own: FloatArray, other: FloatArray, wanted: float, avoiding: bool, rate: float, first: bool, c: CasConfig
) -> tuple[str, float]:
    d, back = c.separation_m + c.margin_m, guidance(own[2], wanted, c)
    p, v = own[:3] - other[:3], own[3:] - other[3:]
    t, dist = closest(p, v)
    if c.disable:
        return "none", back
    if avoiding:
        theirs = other[5]
        if other_avoids(other, c):
            theirs = -c.return_climb_rate_max_mps if rate < 0 else c.return_sink_rate_max_mps
        t_back, dist_back = closest(p, np.array([v[0], v[1], back - theirs]))
        late = c.return_time_max_s is not None and t_back >= c.return_time_max_s
        if (dist_back >= d or late or (too_low(own, c) and back > 0)) and not c.force:
            return "none", back
        return "held", rate
    if dist > d and not c.force:
        return "none", back
    begun = p + v * 4 * c.lag_s
    at = begun if c.direction_at == "rise_time" else p + v * t
    which = -1 if not c.other_cooperates and too_low(own, c) else chosen_side([at[2], p[2]], first, c)
    if which == 0 or (which > 0 and too_low(own, c)):
        return "none", back
    mine, theirs = (
        (-c.climb_rate_max_mps, c.sink_rate_max_mps) if which < 0 else (c.sink_rate_max_mps, -c.climb_rate_max_mps)
    )
    if not other_avoids(other, c):
        theirs = other[5]
    if closest(begun, np.array([v[0], v[1], mine - theirs]))[1] <= d:
        return "current trajectory", mine
    return ("forced", mine) if c.force else ("none", back)


def meets(p: FloatArray, v: FloatArray, d: float, half: float) -> bool:
    """Whether straight flight enters the sphere, or with `half` the cylinder: on a fine grid of times."""
    t = np.linspace(0.0, 300.0, 60_001)
    at = p + v * t[:, None]
    if half > 0:
        return bool(np.any((np.hypot(at[:, 0], at[:, 1]) < d) & (np.abs(at[:, 2]) < half)))
    return bool(np.any(np.linalg.norm(at, axis=1) < d))


def forbidden(p: FloatArray, v: FloatArray, d: float) -> tuple[float, float, float] | None:
    """Relative velocities down that lead into the sphere, and the time of the horizontal closest point."""
    t, level = closest(p[:2], v[:2])
    if level >= d or (math.hypot(p[0], p[1]) >= d and float(p[:2] @ v[:2]) >= 0):
        return None
    if p @ p <= d * d:
        return -math.inf, math.inf, 0.0
    roots = tangents(p, v, d)
    above, below = (0.0, 0.0) if roots is None else roots
    if math.hypot(p[0], p[1]) < d:
        return (above, math.inf, t) if p[2] < 0 else (-math.inf, below, t)
    return above, below, t


def interval(
    own: FloatArray, number: int, wanted: float, back: float, others: dict[int, FloatArray], c: CasConfig
) -> float:
    """The velocity of a fine grid that is nearest to guidance among those allowed, or that falls least short."""
    d, grid = c.separation_m + c.margin_m, np.linspace(-c.climb_rate_max_mps, c.sink_rate_max_mps, 20_001)
    if too_low(own, c):
        grid = grid[grid <= 0]
    shortfall, bound = np.zeros(len(grid)), False
    free = True
    for j, other in others.items():
        p, v = own[:3] - other[:3], own[3:] - other[3:6]
        found = forbidden(p, v, d)
        if found is None:
            continue
        low, high, t = found
        bound = True
        inside = low == -math.inf and high == math.inf
        at = 4 * p[2] if inside else p[2] + v[2] * t
        above = at < 0 if abs(at) > 0.75 * d else (wanted, number) < (other[6], j)
        if inside:
            low, high = grid[0] - other[5], grid[-1] - other[5]
        elif low == -math.inf or high == math.inf:
            above = high == math.inf
        missing = grid - (low + other[5]) if above else high + other[5] - grid
        free = free and (back <= low + other[5] if above else back >= high + other[5])
        shortfall = np.maximum(shortfall, np.maximum(missing, 0) * max(t, c.lag_s))
    if not bound or free:
        return back
    allowed = shortfall <= 1e-4
    if allowed.any():
        return float(grid[allowed][np.argmin(np.abs(grid[allowed] - back))])
    return float(grid[np.argmin(shortfall)])


def helicopter(x: FloatArray, u: FloatArray, heading: float, q: FloatArray, dt: float, n: int = 4000) -> FloatArray:
    """The differential equations of the rotorcraft, in many small steps (midpoint rule)."""
    tau_level, tau_vertical, fastest, climb, sink, coupling = q[:6]
    speed = math.hypot(u[0], u[1])
    command = np.array([u[0], u[1], np.clip(u[2], -climb, sink)])
    if speed > fastest:
        command[:2] *= fastest / speed
    right = np.array([-math.sin(heading), math.cos(heading)])

    def rate(y: FloatArray) -> FloatArray:
        down = (command[2] - y[5]) / tau_vertical
        level = (command[:2] - y[3:5]) / tau_level + coupling * down * right
        return np.array([*y[3:], *level, down])

    y = x.copy()
    for _ in range(n):
        y = y + dt / n * rate(y + dt / n / 2 * rate(y))
    return y


@dataclass
class NaiveVehicle:
    """A vehicle of the fleet: state, what it decided, and its mailbox."""

    x: FloatArray
    wanted: float
    config: CasConfig
    avoiding: bool = False
    rate: float = 0.0
    mailbox: list[tuple[int, int, FloatArray]] = field(default_factory=list)  # arrival step, sent step, state
    newest: tuple[int, FloatArray] | None = None


def head_on(vehicles: list[NaiveVehicle], steps: int, dt: float, delay: int, lost: Any) -> tuple[float, FloatArray]:
    """Least separation of two vehicles that send a message at each step, `delay` steps late, and their last states.

    `lost(step, receiver)` says whether a message is lost. The vertical loop is exact, the horizontal velocity constant.
    """
    first = [v.x.copy() for v in vehicles]
    least = float(np.linalg.norm(first[0][:3] - first[1][:3]))
    for k in range(steps):
        for i, vehicle in enumerate(vehicles):
            if not lost(k, i):
                vehicle.mailbox.append((k + delay, k, vehicles[1 - i].x.copy()))
        for i, vehicle in enumerate(vehicles):
            come = [(sent, state) for arrives, sent, state in vehicle.mailbox if arrives <= k]
            if come:
                vehicle.newest = max(come, key=lambda one: one[0])
            other = (first[1 - i] if vehicle.newest is None else vehicle.newest[1]).copy()
            if vehicle.config.delay_compensation == "estimate":
                other[:3] += other[3:] * vehicle.config.delay_estimate_s
            if vehicle.config.controller == "bang_bang":
                reason, vehicle.rate = bang_bang(
                    vehicle.x, other, vehicle.wanted, vehicle.avoiding, vehicle.rate, i == 0, vehicle.config
                )
            else:
                reason, vehicle.rate = continuous(
                    vehicle.x, other, vehicle.wanted, vehicle.avoiding, i == 0, vehicle.config
                )
            vehicle.avoiding = reason != "none"
        for vehicle in vehicles:
            fly_vertically(vehicle.x, vehicle.rate, vehicle, dt)
        least = min(least, float(np.linalg.norm(vehicles[0].x[:3] - vehicles[1].x[:3])))
    return least, np.array([v.x for v in vehicles])


def cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def missing_separation(
    command: FloatArray, own: FloatArray, other: FloatArray, c: CasConfig, widening: float, sided: bool
) -> float:
    """How much of the separation a command misses against one other; negative where it keeps more."""
    d = c.separation_m + c.margin_m
    p, v_now = own[:3] - other[:3], own[3:] - other[3:]
    wanted = min(d * widening, 0.98 * float(np.linalg.norm(p)))
    share = 0.75 if c.controller == "roundabout" else 0.25
    decided = abs(cross(p, v_now)) > share * d * np.linalg.norm(v_now[:2])
    side = np.sign(cross(p, v_now)) if decided else -1
    lag = np.array([c.level_lag_s, c.level_lag_s, c.lag_s])
    p, v = p + (own[3:] - command) * lag, command - other[3:]
    t, distance = closest(p, v)
    if sided and t > 0 and cross(p, v) * side < 0 and abs(p[2] + v[2] * t) < 0.95 * wanted:
        beyond = abs(cross(p, v)) / float(np.linalg.norm(v[:2]))
        distance = -beyond if beyond > 1e-6 else distance
    return wanted - distance


def velocity_cost(
    command: FloatArray,
    own: FloatArray,
    others: list[FloatArray],
    preferred: FloatArray,
    held: FloatArray,
    c: CasConfig,
) -> float:
    missing = max(0.0, *(missing_separation(command, own, other, c, 1.0, True) for other in others))
    return float(np.linalg.norm(command - preferred) + 0.15 * np.linalg.norm(command - held) + 1000.0 * missing)


def turned(v: FloatArray, degrees: float) -> FloatArray:
    """To the right."""
    s, k = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return np.array([v[0] * k - v[1] * s, v[1] * k + v[0] * s, v[2]])


def choose_velocity(
    own: FloatArray,
    others: list[FloatArray],
    preferred: FloatArray,
    held: FloatArray,
    avoiding: bool,
    climb: float,
    c: CasConfig,
) -> tuple[FloatArray | None, float, int]:
    """Command, its cost and whom it avoids first; None where guidance flies. `climb` is that of `interval`."""
    misses = [missing_separation(preferred, own, other, c, 2.0 if avoiding else 1.0, False) for other in others]
    if max(misses) <= 0:
        return None, 0.0, -1
    name, speed = c.controller, float(np.linalg.norm(preferred[:2]))
    lowest = 0.0 if too_low(own, c) else c.sink_rate_max_mps
    candidates = [preferred]
    for degrees in range(5, 125, 5):
        if name != "speed":
            candidates.append(turned(preferred, degrees))
        if name not in {"speed", "roundabout"}:
            candidates.append(turned(preferred, -degrees))
    paces = [c.speed_max_mps * k / 20 for k in range(21)] if speed > 1e-6 else []
    if name in {"speed", "combined", "least_deviation"}:
        candidates += [np.array([*preferred[:2] * pace / speed, preferred[2]]) for pace in paces]
    if name in {"combined", "least_deviation"}:
        for more in np.linspace(1.0, 2.0, 6):
            rate = preferred[2] + (climb - preferred[2]) * more
            candidates.append(np.array([*preferred[:2], np.clip(rate, -c.climb_rate_max_mps, lowest)]))
    if name == "combined" and speed > 1e-6:
        for degrees in range(-60, 75, 15):
            for pace in paces[::5]:
                level = turned(preferred, degrees)[:2] * pace / speed
                candidates += [np.array([*level, rate]) for rate in np.linspace(-c.climb_rate_max_mps, lowest, 7)]
    costs = [velocity_cost(v, own, others, preferred, held, c) for v in candidates]
    best = int(np.argmin(costs))
    return candidates[best], costs[best], int(np.argmax(misses))


def commanded_by_a_hub(vehicles: list[NaiveVehicle], steps: int, dt: float, delay: int) -> tuple[float, FloatArray]:
    """As `head_on`, decided by a hub that hears and is heard `delay` steps late; nothing is known before.

    With the compensation ``timestamp`` it decides on the states in which its commands will find the vehicles.
    """
    reports: list[list[FloatArray]] = []
    sent: list[list[tuple[str, float]]] = []
    least = math.inf
    for k in range(steps):
        least = min(least, float(np.linalg.norm(vehicles[0].x[:3] - vehicles[1].x[:3])))
        reports.append([v.x.copy() for v in vehicles])
        known = [x.copy() for x in reports[k - delay]] if k >= delay else None
        decided: list[tuple[str, float]] = [("none", 0.0), ("none", 0.0)]
        if known is not None:
            for i, vehicle in enumerate(vehicles):
                if vehicle.config.delay_compensation == "timestamp":
                    for j in range(max(k - 2 * delay, 0), k):
                        reason, rate = sent[j][i]
                        fly_vertically(known[i], rate if reason != "none" else None, vehicle, dt)
            for i, vehicle in enumerate(vehicles):
                law = continuous if vehicle.config.controller == "continuous" else None
                args = (known[i], known[1 - i], vehicle.wanted, vehicle.avoiding)
                decided[i] = (
                    law(*args, i == 0, vehicle.config)
                    if law
                    else bang_bang(*args, vehicle.rate, i == 0, vehicle.config)
                )
            for vehicle, (reason, vehicle.rate) in zip(vehicles, decided, strict=True):
                vehicle.avoiding = reason != "none"
        sent.append(decided)
        for i, vehicle in enumerate(vehicles):
            reason, rate = sent[k - delay][i] if k >= delay else ("none", 0.0)
            fly_vertically(vehicle.x, rate if reason != "none" else None, vehicle, dt)
    last = [v.x for v in vehicles]
    return min(least, float(np.linalg.norm(last[0][:3] - last[1][:3]))), np.array(last)


def fly_vertically(x: FloatArray, rate: float | None, vehicle: NaiveVehicle, dt: float) -> None:
    """Move a state on by a step at a commanded velocity down; None: guidance."""
    if rate is None:
        rate = guidance(x[2], vehicle.wanted, vehicle.config)
    tau = vehicle.config.lag_s
    left = math.exp(-dt / tau)
    x[:2] += x[3:5] * dt
    x[2] += rate * dt + (x[5] - rate) * tau * (1 - left)
    x[5] = rate + (x[5] - rate) * left
