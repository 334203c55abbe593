"""Naive twins of the avoidance kernels: named values, complex numbers for the horizontal plane, explicit graphs."""

import cmath
import heapq
import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

RISK_NAMES = [
    *("hard_radius", "hard_height", "inner_radius", "inner_height", "outer_radius", "outer_height", "outer_tau"),
    *("sigmas", "sigma_cap", "growth_h", "growth_v", "growth_time"),
    *("weight_hard", "weight_inner", "weight_outer", "weight_near", "floor", "ceiling"),
    *("turn_significance", "turn_rate_min", "turn_rate_max", "turn_time", "turn_weight", "beyond"),
]


def named(risk: FloatArray) -> dict[str, float]:
    return dict(zip(RISK_NAMES, risk.tolist(), strict=True))


@dataclass
class Met:
    """What a path met: times inside each volume, and which hypothesis was first."""

    inside: dict[str, list[float]] = field(default_factory=lambda: {"hard": [], "inner": [], "outer": []})
    cost: float = 0.0
    culprit: int = -1

    def first(self, volume: str) -> float:
        return min(self.inside[volume], default=math.inf)


def believed_turn_rate(velocity: complex, acceleration: complex, sigma: float, risk: FloatArray) -> float:
    q = named(risk)
    speed = abs(velocity)
    if speed < 5.0:
        return 0.0
    across = (acceleration * (velocity / speed).conjugate()).imag
    rate = across / speed
    if abs(across) < q["turn_significance"] * sigma or abs(rate) < q["turn_rate_min"]:
        return 0.0
    return math.copysign(min(abs(rate), q["turn_rate_max"]), rate)


def predicted(
    position: FloatArray, velocity: FloatArray, rate: float, turn_time: float, dt: float, n: int
) -> FloatArray:
    """Positions and velocities (n, 6) of one hypothesis."""
    p, v = complex(position[0], position[1]), complex(velocity[0], velocity[1])
    rows = []
    for k in range(n):
        rows.append([p.real, p.imag, position[2] + k * dt * velocity[2], v.real, v.imag, velocity[2]])
        if k * dt < turn_time:
            v *= cmath.exp(1j * rate * dt)
        p += v * dt
    return np.array(rows)


def spread(covariance: FloatArray, t: float) -> tuple[float, float]:
    """Standard deviations of horizontal (mean of both axes) and vertical position after `t` of straight flight."""
    transition = np.hstack([np.eye(3), t * np.eye(3)])
    p = transition @ covariance[:6, :6] @ transition.T
    return math.sqrt(max((p[0, 0] + p[1, 1]) / 2, 0.0)), math.sqrt(max(p[2, 2], 0.0))


def widened(size: float, sigma: float, growth: float, q: dict[str, float], t: float) -> float:
    return size + min(q["sigmas"] * sigma, q["sigma_cap"] * size) + growth * min(t, q["growth_time"])


def risk_at(
    own: FloatArray,
    rows: FloatArray,
    weights: FloatArray,
    t: float,
    dt: float,
    margin: float,
    risk: FloatArray,
    met: Met,
) -> float:
    """Own (6): position and velocity; rows (m, 9): the predictions at this time."""
    q = named(risk)
    cost = 0.0
    inside: set[str] = set()
    first_culprit = -1
    for m, row in enumerate(rows):
        if row[8] == 0.0:
            continue
        s, v = row[:3] - own[:3], row[3:6] - own[3:]
        distance, height = float(np.hypot(s[0], s[1])), abs(float(s[2]))
        r = {name: widened(margin * q[f"{name}_radius"], row[6], q["growth_h"], q, t) for name in ("inner", "outer")}
        z = {name: widened(margin * q[f"{name}_height"], row[7], q["growth_v"], q, t) for name in ("inner", "outer")}
        # The hard volume is neither grown nor widened by the margin.
        r["hard"], z["hard"] = (
            widened(q["hard_radius"], row[6], 0.0, q, t),
            widened(q["hard_height"], row[7], 0.0, q, t),
        )
        cost += weights[m] * q["weight_near"] * dt / max(math.hypot(distance / r["outer"], height / z["outer"]), 0.1)
        closing = float(s[0] * v[0] + s[1] * v[1])
        tau = (r["outer"] ** 2 - distance**2) / closing if closing < 0 else math.inf
        depth = -1.0
        if height <= z["outer"] and distance <= r["outer"]:
            depth = 2.0 - distance / r["outer"]
        elif height <= z["outer"] and q["outer_tau"] > 0 and tau <= margin * q["outer_tau"]:
            depth = 1.0 - tau / (margin * q["outer_tau"])
        if depth >= 0.0:
            if "outer" not in inside:
                first_culprit = m
            inside.add("outer")
            cost += weights[m] * q["weight_outer"] * dt * (0.2 + 0.8 * (1 - height / z["outer"])) * (0.3 + depth)
        for name in ("inner", "hard"):
            if (depth >= 0.0 or name == "hard") and distance <= r[name] and height <= z[name]:
                inside.add(name)
                share = 0.3 + min(1 - distance / r[name], 1 - height / z[name])
                cost += weights[m] * q[f"weight_{name}"] * dt * share
    if not met.inside["outer"] and "outer" in inside:
        met.culprit = first_culprit
    cost += q["weight_hard"] * dt * (1 + 0.1 * (q["floor"] + own[2])) if -own[2] < q["floor"] else 0.0
    cost += q["weight_inner"] * dt * (1 + 0.1 * (-own[2] - q["ceiling"])) if -own[2] > q["ceiling"] else 0.0
    for name in inside:
        met.inside[name].append(t)
    met.cost += cost
    return cost


def evaluate(
    grid_states: FloatArray, dt: float, intruders: FloatArray, weights: FloatArray, margin: float, risk: FloatArray
) -> Met:
    """States (n, 7) at the grid times; intruders (m, n, 9)."""
    met = Met()
    velocity = np.diff(grid_states[:, :2], axis=0) / dt
    velocity = np.vstack([velocity, velocity[-1:]])  # at the last time: that of the last step
    for k, x in enumerate(grid_states):
        own = np.array([*x[:3], *velocity[k], -x[6]])
        risk_at(own, intruders[:, k], weights, k * dt, dt, margin, risk, met)
    return met


def beyond(
    end: FloatArray, velocity: FloatArray, rows: FloatArray, weight: FloatArray, t: float, risk: FloatArray
) -> float:
    """Return the cost of flying straight on from a path's end, by small steps.

    `end` is its place (NED), `velocity` north and east there, `rows` the predictions at that time.
    """
    q = named(risk)
    total = 0.0
    step = 0.002
    times = np.arange(0.5 * step, q["beyond"], step)
    for row, w in zip(rows, weight, strict=True):
        radius = widened(q["hard_radius"], row[6], 0.0, q, t)
        height = widened(q["hard_height"], row[7], 0.0, q, t)
        apart = abs(row[2] - end[2])
        start, away = row[:2] - end[:2], row[3:5] - velocity
        if row[8] == 0.0 or apart >= height or start @ away >= 0.0:
            continue
        inside = np.linalg.norm(start + times[:, None] * away, axis=1) < radius
        nearest = np.linalg.norm(start - (start @ away) / (away @ away) * away)
        share = 0.3 + min(1 - nearest / radius, 1 - apart / height)
        total += w * q["weight_hard"] * inside.sum() * step * share
    return total


def point_along(waypoints: FloatArray, index: int, position: FloatArray, ahead: float) -> FloatArray:
    """By the distances of the waypoints along the rest of the path; the last leg goes on level."""
    index = min(max(index, 1), len(waypoints) - 1)
    rest = waypoints[index - 1 :]
    leg = rest[1, :2] - rest[0, :2]
    length = float(np.hypot(*leg))
    s = ahead
    if length > 0:
        s += float(np.clip((position[:2] - rest[0, :2]) @ leg / length, 0.0, length))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(rest[:, :2], axis=0).T))])
    if s <= along[-1]:
        return np.array([np.interp(s, along, rest[:, i]) for i in range(3)])
    last = (rest[-1, :2] - rest[-2, :2]) / (along[-1] - along[-2])
    return np.array([*(rest[-1, :2] + (s - along[-1]) * last), rest[-1, 2]])


@dataclass
class Edge:
    """Where an edge of the map ends, and what it costs beside the turns and climbs."""

    end: FloatArray
    cost: float


def fly_edge(
    label: FloatArray,
    course: float,
    down: float,
    k_start: int,
    n_steps: int,
    dt: float,
    delay: float,
    limits: dict[str, float],
    intruders: FloatArray,
    weights: FloatArray,
    risk: FloatArray,
    fine_time: float,
) -> Edge:
    """Turn and climb within the limits; label (6) is position, course, climb rate, cost."""
    stride = 2 if k_start * dt >= fine_time and n_steps % 2 == 0 else 1
    step_time = stride * dt
    p, altitude, heading, climb = complex(label[0], label[1]), -label[2], label[3], label[4]
    met = Met()
    for step in range(1, n_steps // stride + 1):
        turn = 0.0
        if step * step_time > delay:
            error = cmath.phase(cmath.exp(1j * (course - heading)))
            turn = float(np.clip(error, -limits["turn_rate"] * step_time, limits["turn_rate"] * step_time))
        v = cmath.rect(limits["speed"], heading + turn / 2)
        heading += turn
        wanted = np.clip((-down - altitude) / (2 * step_time), -limits["sink"], limits["climb"])
        climb += float(np.clip(wanted - climb, -limits["acceleration"] * step_time, limits["acceleration"] * step_time))
        p += v * step_time
        altitude += climb * step_time
        k = k_start + stride * step
        own = np.array([p.real, p.imag, -altitude, v.real, v.imag, -climb])
        risk_at(own, intruders[:, k], weights, k * dt, step_time, 1.0, risk, met)
    return Edge(np.array([p.real, p.imag, -altitude, heading, climb]), met.cost)


def ring_graph(
    start: FloatArray,
    rings: list[list[tuple[float, float]]],
    steps: list[int],
    dt: float,
    speed: float,
    climb_max: float,
    intruders: FloatArray,
    weights: FloatArray,
    risk: FloatArray,
    goal: FloatArray,
    goal_weights: FloatArray,
) -> dict[int, dict[int, float]]:
    """The printed map as an explicit graph: source -1, nodes in order, sink -2; edges with their costs."""
    places: dict[int, FloatArray] = {-1: start[:3]}
    layers = [[-1]]
    for ring, elapsed in zip(rings, itertools.accumulate(steps), strict=True):
        first = len(places) - 1
        for i, (course, height) in enumerate(ring):
            reach = speed * elapsed * dt * np.array([math.cos(start[3] + course), math.sin(start[3] + course)])
            places[first + i] = np.array([*(start[:2] + reach), start[2] - height])
        layers.append(list(range(first, first + len(ring))))
    graph: dict[int, dict[int, float]] = {node: {} for node in [*places, -2]}
    k_start = 0
    for (sources, targets), n in zip(itertools.pairwise(layers), steps, strict=True):
        for a, b in itertools.product(sources, targets):
            velocity = (places[b] - places[a]) / (n * dt)
            met = Met()
            for step in range(1, n + 1):
                k = k_start + step
                own = np.concatenate([places[a] + step * dt * velocity, velocity])
                risk_at(own, intruders[:, k], weights, k * dt, dt, 1.0, risk, met)
            graph[a][b] = 1.0 + met.cost
        k_start += n
    for node in layers[-1]:
        away = goal - places[node]
        graph[node][-2] = float(
            goal_weights[0] * np.hypot(away[0], away[1]) / speed + goal_weights[1] * abs(away[2]) / climb_max
        )
    return graph


def dijkstra(graph: dict[int, dict[int, float]], source: int, sink: int) -> tuple[float, list[int]]:
    queue: list[tuple[float, int, list[int]]] = [(0.0, source, [])]
    done: set[int] = set()
    while queue:
        cost, node, path = heapq.heappop(queue)
        if node == sink:
            return cost, path
        if node in done:
            continue
        done.add(node)
        for target, edge in graph[node].items():
            heapq.heappush(queue, (cost + edge, target, [*path, target]))
    return math.inf, []


def all_paths(graph: dict[int, dict[int, float]], source: int, sink: int) -> Any:
    """Yield the cost of every path."""
    for target, edge in graph[source].items():
        if target == sink:
            yield edge
        else:
            for rest in all_paths(graph, target, sink):
                yield edge + rest
