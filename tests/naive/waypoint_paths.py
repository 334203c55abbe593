"""Obvious twins of the kernels of keep-out volumes, A* and the chain."""

import heapq
import itertools
import math
from typing import Any

import numpy as np

from wideberth.types import FloatArray

HEADINGS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]


def inside_polygon(place: FloatArray, corners: FloatArray) -> bool:
    """Sum of the angles under which the sides are seen: a full turn from inside, none from outside."""
    turns = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u, v = a - place, b - place
        turns += math.atan2(u[0] * v[1] - u[1] * v[0], u @ v)
    return abs(turns) > math.pi


def distance_to_outline(place: FloatArray, corners: FloatArray) -> float:
    least = math.inf
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        s = np.clip((place - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
        least = min(least, float(np.linalg.norm(place - a - s * (b - a))))
    return least


def depth_in_volume(place: FloatArray, bottom: float, top: float, corners: FloatArray, margin: float) -> float:
    """How deep a place is in a volume, m; negative outside."""
    away = distance_to_outline(place[:2], corners)
    flat = margin + away if len(corners) > 1 and inside_polygon(place[:2], corners) else margin - away
    return float(min(flat, top + place[2], -place[2] - bottom))


def place_at(row: FloatArray, t: float) -> FloatArray:
    """Small steps along the turn, then straight."""
    place, velocity = row[:3].copy(), row[3:6].copy()
    rate, turning = row[8], min(max(t, 0.0), row[9])
    n = 4000
    if rate != 0.0 and turning > 0.0:
        dt = turning / n
        course, speed = math.atan2(velocity[1], velocity[0]), math.hypot(velocity[0], velocity[1])
        for k in range(n):
            middle = course + rate * dt * (k + 0.5)
            place[:2] += speed * dt * np.array([math.cos(middle), math.sin(middle)])
        course += rate * turning
        velocity[:2] = speed * math.cos(course), speed * math.sin(course)
        place[2] += velocity[2] * turning
        return np.asarray(place + velocity * (t - turning))
    return np.asarray(place + velocity * t)


def seconds_inside(a: FloatArray, b: FloatArray, t: float, duration: float, row: FloatArray, scale: float) -> float:
    """Share of many moments in which the ownship is in the cylinder."""
    moments = (np.arange(2000) + 0.5) / 2000
    inside = 0
    for s in moments:
        d = place_at_straight(row, t + s * duration) - a - s * (b - a)
        inside += math.hypot(d[0], d[1]) <= scale * row[6] and abs(d[2]) <= scale * row[7]
    return inside / len(moments) * duration


def place_at_straight(row: FloatArray, t: float) -> FloatArray:
    return np.asarray(row[:3] + row[3:6] * t)


def edge_cost(
    a: FloatArray, b: FloatArray, rise: int, turn: int, aside: float, t: float, grid: Any, cost: Any, rows: FloatArray
) -> tuple[float, float]:
    """Cost and duration of an edge in free air; `aside` is how far its end lies off the axis, in cells and levels."""
    length = float(np.linalg.norm(b - a))
    duration = length / grid["SPEED"]
    flat = math.hypot(b[0] - a[0], b[1] - a[1])
    total = cost["K_N"] * aside + (cost["K_LEFT"] if turn < 0 else 0.0)
    if rise == 0:
        total += cost["K_DIST"] * length / grid["CELL"]
    else:
        step = math.hypot(grid["CELL"], grid["LEVEL"])
        total += cost["K_ALT"] * math.hypot(flat, grid["LEVEL"]) / step
    velocity = (b - a) / duration
    for row in rows:
        nearest = math.inf
        for k in range(1, 9):
            d = place_at_straight(row, t + k / 8 * duration) - a - k / 8 * (b - a)
            if abs(d[2]) <= row[7]:
                nearest = min(nearest, math.hypot(d[0], d[1]))
        reach = cost["VARRHO"] * row[6]
        if nearest < reach:
            total += cost["K_R"] * min((reach - nearest) / (reach - row[6]), 1.0)
        inside = seconds_inside_exact(a, velocity, t, duration, row)
        if inside > 0.0:
            total += cost["K_MAX"] * max(inside / duration, 0.1)
        s = place_at_straight(row, t + duration) - b
        w = row[3:6] - velocity
        t_cpa = -(s[:2] @ w[:2]) / (w[:2] @ w[:2]) if w[:2] @ w[:2] > 0.0 else 0.0
        if t_cpa > 0.0:
            d_cpa = float(np.linalg.norm(s[:2] + w[:2] * t_cpa))
            if d_cpa <= reach and abs(s[2] + w[2] * t_cpa) <= cost["DELTA_2"] * row[7]:
                total += cost["K_CPA"] / (max(d_cpa, 1.0) * max(t_cpa, 1.0))
                along = velocity[:2] @ row[3:5] + np.linalg.norm(velocity[:2]) * np.linalg.norm(row[3:5])
                total += cost["K_V"] * along / max(t_cpa, 1.0)
    return total, duration


def seconds_inside_exact(a: FloatArray, velocity: FloatArray, t: float, duration: float, row: FloatArray) -> float:
    """Roots of the two conditions cut the edge into pieces that are inside or not as a whole."""
    s, w = place_at_straight(row, t) - a, row[3:6] - velocity
    cuts = [0.0, duration]
    if w[2] != 0.0:
        cuts += [(h - s[2]) / w[2] for h in (-row[7], row[7])]
    roots = np.roots([w[:2] @ w[:2], 2.0 * (s[:2] @ w[:2]), s[:2] @ s[:2] - row[6] ** 2])
    cuts += [float(r.real) for r in roots if abs(r.imag) < 1e-12]
    cuts = sorted(c for c in cuts if 0.0 <= c <= duration)
    inside = 0.0
    for first, last in itertools.pairwise(cuts):
        d = s + w * 0.5 * (first + last)
        if math.hypot(d[0], d[1]) <= row[6] and abs(d[2]) <= row[7]:
            inside += last - first
    return inside


def seconds_inside_turning(
    a: FloatArray, b: FloatArray, t: float, duration: float, row: FloatArray, step: float
) -> float:
    """The same for one that flies chords of its turn, of equal times up to `step`; all of them are looked at."""
    n = math.ceil(duration / step)
    velocity, step = (b - a) / duration, duration / n
    places = [place_at_once(row, t + k * step) for k in range(n + 1)]
    total = 0.0
    for k, (first, last) in enumerate(itertools.pairwise(places)):
        chord = np.concatenate([first, (last - first) / step, row[6:8]])
        total += seconds_inside_exact(a + k * step * velocity, velocity, 0.0, step, chord)
    return total


def place_at_once(row: FloatArray, t: float) -> FloatArray:
    """The turn as of a complex number."""
    turning = min(t, row[9])
    velocity = complex(row[3], row[4])
    turned = velocity * complex(math.cos(row[8] * turning), math.sin(row[8] * turning))
    moved = (turned - velocity) / complex(0.0, row[8]) + turned * (t - turning)
    return np.array([row[0] + moved.real, row[1] + moved.imag, row[2] + row[5] * t])


def cheapest_path(grid: dict[str, float], cost: dict[str, float], heading: int, rows: FloatArray) -> float:
    """Dijkstra's algorithm over the same moves, with exact arrival times, and no estimate of the rest."""

    def place(i: int, j: int, level: int) -> FloatArray:
        x, y = i * grid["CELL"], j * grid["CELL"]
        return np.array([x, y, grid["SLOPE"] * min(max(x, 0.0), grid["GOAL"] * grid["CELL"]) - level * grid["LEVEL"]])

    queue = [(0.0, 0, 0, 0, heading, 0.0)]
    done = set()
    while queue:
        g, i, j, level, head, t = heapq.heappop(queue)
        if (i, j, level) == (grid["GOAL"], 0, 0):
            return g
        key = (i, j, level, head, round(t, 6))
        if key in done:
            continue
        done.add(key)
        for turn, rise in ((-1, 0), (0, 0), (1, 0), (0, 1), (0, -1)):
            new = (head + turn) % 8
            ni, nj, nl = i + HEADINGS[new][0], j + HEADINGS[new][1], level + rise
            if not (-grid["BEHIND"] <= ni <= grid["BEYOND"] and abs(nj) <= grid["ASIDE"]):
                continue
            if not grid["LEVEL_LOW"] <= nl <= grid["LEVEL_HIGH"]:
                continue
            a, b = place(i, j, level), place(ni, nj, nl)
            added, duration = edge_cost(a, b, rise, turn, math.hypot(nj, nl), t, grid, cost, rows)
            if t + duration <= grid["TIME_MAX"]:
                heapq.heappush(queue, (g + added, ni, nj, nl, new, t + duration))
    return math.inf


def phi(x: float, x0: float, x1: float, k: float, f_max: float) -> float:
    return f_max if x <= x0 else float(np.clip(k * (1.0 / (x - x0) - 1.0 / (x1 - x0)), 0.0, f_max))


def wrapped(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))


def chain_forces(
    points: FloatArray, velocities: FloatArray, course: float, rows: FloatArray, q: dict[str, float]
) -> FloatArray:
    """The forces of the errata, one mass after the other; on the masses that move."""
    n = len(points)
    links = np.diff(points, axis=0)
    lengths = np.linalg.norm(links, axis=1)
    times = np.concatenate(([0.0], np.cumsum(lengths) / q["SPEED"]))
    mean = times[-1] / (n - 1)
    courses = np.arctan2(links[:, 1], links[:, 0])
    slopes = np.arctan2(-links[:, 2], np.hypot(links[:, 0], links[:, 1]))
    before = np.concatenate(([course], courses[:-1]))
    turns = np.array([wrapped(c - b) for c, b in zip(courses, before, strict=True)])
    out = np.zeros((n, 3))
    for i in range(1, n - 1):
        for k, e in ((i, links[i]), (i - 1, -links[i - 1])):
            out[i] += q["K"] * (lengths[k] - q["REST_LENGTH"]) * e / lengths[k]
        out[i] += q["B"] * (velocities[i + 1] + velocities[i - 1] - 2.0 * velocities[i])
        out[i] += q["KAPPA"] * (0.5 * (points[i - 1] + points[i + 1]) - points[i])
        for k in (i - 1, i, i + 1):  # corners at this mass and at its neighbours
            if k >= n - 1 or abs(turns[k]) <= q["THETA_MAX"]:
                continue
            push = q["LAMBDA"] * (abs(turns[k]) - q["THETA_MAX"])
            if k == 0:
                if i == 1:
                    right = np.array([-math.sin(courses[0]), math.cos(courses[0]), 0.0])
                    out[i] -= math.copysign(push, turns[0]) * right
                continue
            towards = 0.5 * (points[k - 1] + points[k + 1]) - points[k]
            towards[2] = 0.0
            towards *= push / np.linalg.norm(towards)
            out[i] += towards if k == i else -0.5 * towards
        for k, up in ((i, 1.0), (i - 1, -1.0)):
            excess = abs(slopes[k]) - q["GAMMA_MAX"]
            if excess > 0.0:
                out[i, 2] -= up * q["LAMBDA"] * excess * np.sign(slopes[k])
        threat = np.zeros(3)
        for row in rows:
            for j in (-1, 0, 1):
                d = points[i] - place_at_straight(row, times[i] + j * mean)
                flat, height = math.hypot(d[0], d[1]), abs(d[2])
                reach, reach_v = q["DELTA_1"] * row[6], q["DELTA_2"] * row[7]
                if flat >= reach or height >= reach_v:
                    continue
                fade_h = np.clip((reach - flat) / (reach - row[6]), 0.0, 1.0)
                fade_v = np.clip((reach_v - height) / (reach_v - row[7]), 0.0, 1.0)
                threat[:2] += phi(flat, row[6], reach, q["K_SH"], q["F_MAX"]) * fade_v * d[:2] / flat
                threat[2] += phi(height, row[7], reach_v, q["K_SV"], q["F_MAX"]) * fade_h * np.sign(d[2])
                threat -= q["K_B"] * row[3:6] / max(float(np.linalg.norm(d)), 1.0) * fade_h * fade_v
        size = float(np.linalg.norm(threat))
        out[i] += threat * min(1.0, q["F_MAX"] / size) if size > 0.0 else 0.0
    return out


def refined_path(points: FloatArray, step: float, least: float, vertical: float, bounds: Any, judge: Any) -> FloatArray:
    """Waypoints left out in blocks, then moved with shorter and shorter steps, as long as `judge` finds it better.

    `judge` gives the faults of a path (a set), its time in cylinders and its length; `bounds` are the lowest and the
    highest `down`. Heights are changed only where the path is not free.
    """
    path = [np.array(place) for place in points]
    longest = 2.0 * judge(path)[2]

    def better(new: list[FloatArray], old: list[FloatArray], least: float = 0.1) -> bool:
        (wrong, inside, length), (wrong_before, inside_before, length_before) = judge(new), judge(old)
        if not wrong <= wrong_before or (inside_before > 0.0 and length >= longest):
            return False
        return bool(inside < inside_before - 1e-6 or (inside <= inside_before and length < length_before - least))

    def shorter(block: int) -> bool:
        """Leave out `block` places from each on."""
        nonlocal path
        k, gained = 1, False
        while len(path) > 2 and k < len(path) - 1:
            new = path[:k] + path[min(k + block, len(path) - 1) :]
            if better(new, path, -1e-10):
                path, gained = new, True
                k = min(k, len(path) - 2)
            else:
                k += max(1, block // 2)
        return gained

    def moved(k: int, direction: int) -> list[FloatArray]:
        chord = path[k + 1][:2] - path[k - 1][:2]
        ahead = chord / max(float(np.hypot(*chord)), 1e-6)
        right = np.array([-ahead[1], ahead[0]])
        new = [place.copy() for place in path]
        if direction < 8:
            d = math.sqrt(0.5)
            a, r = [(1, 0), (-1, 0), (0, 1), (0, -1), (d, d), (-d, -d), (d, -d), (-d, d)][direction]
            new[k][:2] += step * (a * ahead + r * right)
        else:
            lowest, highest = max(bounds[0], new[k][2]), min(bounds[1], new[k][2])
            new[k][2] = np.clip(new[k][2] + [-1, 1][direction - 8] * step * vertical, highest, lowest)
        return new

    block = max(1, (len(path) - 2) // 2)
    while block > 1:
        shorter(block)
        block = max(1, min(block, len(path) - 2) // 2)
    while step >= least and len(path) > 2:
        k, gained = 1, False
        while len(path) > 2 and k < len(path) - 1:
            without = path[:k] + path[k + 1 :]
            if better(without, path, -1e-10):
                path, gained = without, True
                k = min(k, len(path) - 2)
                continue
            for direction in range(10):
                if direction >= 8 and (vertical == 0.0 or judge(path)[1] == 0.0):
                    break
                while better(moved(k, direction), path):
                    path, gained = moved(k, direction), True
            k += 1
        if not gained:
            step *= 0.5
    return np.array(path)


def begun_places(
    points: FloatArray,
    course: float,
    radius: float,
    least: float,
    most: float,
    piece: float,
    roll: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> FloatArray:
    """The places, (n, 2), at which a path begins if its first turn is by more than `least` and less than `most`.

    They are on its arc. The turn ends where its tangent leads to the first waypoint: found by bisection, after a search
    in small steps. With `roll` (ahead, to the right, course there) it begins where the ownship has rolled out of a turn
    to the other side, which then is the first.
    """
    start, waypoint = points[0], points[1]
    none = np.zeros((0, 2))
    if math.isnan(course):
        return none
    ahead = np.array([math.cos(course), math.sin(course)])
    right = np.array([-ahead[1], ahead[0]])
    side = 1.0 if (waypoint[:2] - start[:2]) @ right >= 0.0 else -1.0
    begin, before = start[:2], []
    if roll[2] * side < 0.0:
        begin = begin + roll[0] * ahead + roll[1] * right
        before = [begin]
        ahead = np.array([math.cos(course + roll[2]), math.sin(course + roll[2])])
        right = np.array([-ahead[1], ahead[0]])
    centre = begin + side * radius * right

    def on_arc(angle: float) -> FloatArray:
        place: FloatArray = begin + radius * (math.sin(angle) * ahead + side * (1.0 - math.cos(angle)) * right)
        return place

    def still_to_turn(angle: float) -> float:
        """Inwards of the tangent to the waypoint: positive as long as the turn has to go on."""
        along = math.cos(angle) * ahead + side * math.sin(angle) * right
        inwards = centre - on_arc(angle)
        return float((waypoint[:2] - on_arc(angle)) @ inwards) if (waypoint[:2] - on_arc(angle)) @ along > 0 else 1.0

    if np.linalg.norm(waypoint[:2] - centre) <= radius:
        return none
    angles = np.linspace(0.0, 2.0 * math.pi, 2001)
    if still_to_turn(0.0) <= 1e-9:
        return none
    last = next((k for k in range(1, len(angles)) if still_to_turn(angles[k]) <= 0.0), None)
    if last is None:
        return none
    low, high = angles[last - 1], angles[last]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if still_to_turn(middle) > 0.0 else (low, middle)
    turn = 0.5 * (low + high)
    if not least < turn < most:
        return none
    count = math.ceil(turn / piece)
    arc = [on_arc(turn * k / count) for k in range(1, count + 1)]
    return np.array([*before, *arc])


def begun_path(points: FloatArray, course: float, radius: float, least: float, most: float, piece: float) -> FloatArray:
    """A path with the places of its first turn, their heights by how much of the leg to the waypoint is behind."""
    places = begun_places(points, course, radius, least, most, piece)
    leg = points[1, :2] - points[0, :2]
    done = np.clip((places - points[0, :2]) @ leg / (leg @ leg), 0.0, 1.0) if len(places) else np.zeros(0)
    heights = points[0, 2] + done * (points[1, 2] - points[0, 2])
    return np.vstack([points[:1], np.column_stack([places, heights]), points[1:]])


def lagging_heights(ways: FloatArray, wanted: FloatArray, slope: float, lag: float) -> FloatArray:
    """Heights that follow those wanted after some way, their slope by a first-order lag from `slope`: small steps."""
    height, found = wanted[0], [wanted[0]]
    for k in range(1, len(ways)):
        way = ways[k] - ways[k - 1]
        aim = (wanted[k] - wanted[k - 1]) / way
        n = math.ceil(2000.0 * way / lag)
        for _ in range(n):
            middle = slope + 0.5 * (aim - slope) * way / n / lag
            height += middle * way / n
            slope += (aim - middle) * way / n / lag
        found.append(height)
    return np.array(found)


def caught_up(below: float, slope: float, way: float, share: float, climb: float, sink: float) -> float:
    """How much lower than wanted it still is after some way on a path with a slope (down): small steps.

    Of what is left a `share` is caught up with on a metre of way, as far as the steepest climb and descent let it.
    """
    n = math.ceil(50.0 * way)
    for _ in range(n):
        spare = max(climb + slope if below > 0.0 else sink - slope, 0.0)
        below -= math.copysign(min(share * abs(below), spare), below) * way / n
    return below
