"""From waypoints to the lines and arcs that are flown: straight legs, fillets, Dubins paths."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import guidance_kernels as gk

_CLOSED = 2.0 * math.pi - 1e-9  # an arc of a full circle is none, rounded


def straight_segments(waypoints: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the legs between waypoints, each flown until the plane that halves the angle to the next.

    Parameters
    ----------
    waypoints : ndarray, shape (n, 3)
        NED, m.
    speeds : ndarray, shape (n,)
        Ground speed on the leg that ends at each, m/s; the first is not used.

    Returns
    -------
    ndarray, shape (n - 1, guidance_kernels.N_COLUMNS)

    Raises
    ------
    ValueError
        For fewer than two waypoints, two in a row at the same place, or numbers that are not finite or positive.
    """
    points, wanted = _checked(waypoints, speeds)
    rows = [_line(a, b, v) for a, b, v in zip(points[:-1], points[1:], wanted[1:], strict=True)]
    for i, row in enumerate(rows):
        row[gk.S_WAYPOINT] = i + 1
    for row, after in itertools.pairwise(rows):
        normal = _direction(row[gk.S_COURSE]) + _direction(after[gk.S_COURSE])
        length = math.hypot(*normal)
        if length > 1e-6:  # a reversal keeps the plane across the leg
            row[gk.S_NORMAL_NORTH : gk.S_NORMAL_EAST + 1] = normal / length
    return np.stack(rows)


def fillet_segments(waypoints: FloatArray, speeds: FloatArray, radius: float) -> FloatArray:
    """Return the legs between waypoints with an arc of `radius` (m) inside each corner.

    Arguments and result are those of `straight_segments`. Beard and McLain, section 11.1: for the angle
    beta between the legs, the arc starts and ends R / tan(beta / 2) from the waypoint.

    Raises
    ------
    ValueError
        As `straight_segments`, and where the legs are too short for the arcs, or one flies back on the other.
    """
    points, wanted = _checked(waypoints, speeds)
    _check_radius(radius)
    legs = np.diff(points[:, :2], axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    courses = np.arctan2(legs[:, 1], legs[:, 0])
    turns = [math.remainder(b - a, 2.0 * math.pi) for a, b in itertools.pairwise(courses)]
    cuts = np.array([0.0, *(radius * math.tan(abs(t) / 2.0) for t in turns), 0.0])
    for i, length in enumerate(lengths):
        if cuts[i] + cuts[i + 1] > length:
            raise ValueError(
                f"the leg from waypoint {i} to {i + 1} is {length:.1f} m long, its fillets of radius {radius:g} m take"
                f" {cuts[i] + cuts[i + 1]:.4g} m: lengthen it, turn less, or fly Dubins paths"
            )
    rows = []
    for i, (course, length) in enumerate(zip(courses, lengths, strict=True)):
        start, end = _between(points[i], points[i + 1], cuts[i] / length, 1.0 - cuts[i + 1] / length)
        rows.append(_line(start, end, wanted[i + 1], course))
        rows[-1][gk.S_WAYPOINT] = i + 1
        if i < len(turns) and abs(turns[i]) > 1e-6:
            (after, _) = _between(points[i + 1], points[i + 2], cuts[i + 1] / lengths[i + 1], 1.0)
            turn = math.copysign(1.0, turns[i])
            rows.append(_arc(end, course, turn, abs(turns[i]), radius, after[2], wanted[i + 2]))
            rows[-1][gk.S_WAYPOINT] = i + 1
    return np.stack([row for row in rows if row[gk.S_LENGTH] > 1e-6])


def dubins_segments(
    waypoints: FloatArray, speeds: FloatArray, radius: float, courses: Sequence[float] | None = None
) -> FloatArray:
    """Return the shortest paths of arcs and lines through each waypoint with a course there.

    Of RSR, RSL, LSR and LSL the shortest that exists is taken; the crossing ones need circles 2R apart.

    Parameters
    ----------
    waypoints, speeds, radius
        As in `fillet_segments`.
    courses : sequence of float, optional
        At each waypoint, rad; by default along the leg that follows, the last one along the leg that ends there.

    Raises
    ------
    ValueError
        As `straight_segments`, and if there is not one finite course for each waypoint.
    """
    points, wanted = _checked(waypoints, speeds)
    _check_radius(radius)
    legs = np.diff(points[:, :2], axis=0)
    along = np.arctan2(legs[:, 1], legs[:, 0])
    at = np.append(along, along[-1]) if courses is None else np.asarray(courses, float)
    if at.shape != (len(points),) or not np.all(np.isfinite(at)):
        raise ValueError(f"one finite course for each of the {len(points)} waypoints is needed, not {courses}")
    rows: list[FloatArray] = []
    for i in range(len(points) - 1):
        pieces = _dubins(points[i], at[i], points[i + 1], at[i + 1], radius, wanted[i + 1])
        for row in pieces:
            row[gk.S_WAYPOINT] = i + 1
        rows += pieces
    return np.stack(rows)


def _dubins(
    start: FloatArray, course: float, end: FloatArray, end_course: float, radius: float, speed: float
) -> list[FloatArray]:
    best: tuple[float, float, float, float, float, float] | None = None
    for first, last in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        centre = start[:2] + radius * _direction(course + first * math.pi / 2)
        to = end[:2] + radius * _direction(end_course + last * math.pi / 2) - centre
        apart, along = math.hypot(to[0], to[1]), math.atan2(to[1], to[0])
        line = apart
        if first != last:
            if apart < 2.0 * radius:
                continue
            along += first * math.asin(2.0 * radius / apart)
            line = math.sqrt(apart * apart - 4.0 * radius * radius)
        arcs = [first * (along - course) % (2.0 * math.pi), last * (end_course - along) % (2.0 * math.pi)]
        one, two = (0.0 if arc > _CLOSED else arc for arc in arcs)
        total = line + radius * (one + two)
        if best is None or total < best[0]:
            best = total, first, last, one, two, line
    assert best is not None  # RSR always exists
    total, first, last, one, two, line = best
    rows: list[FloatArray] = []
    pieces = [(first, one * radius), (0.0, line), (last, two * radius)]
    at, altitude, heading = start[:2], -start[2], course
    for turn, length in pieces:
        for part in _halves(length, math.pi * radius if turn else math.inf):
            altitude += (-end[2] + start[2]) * part / total
            point = np.array([at[0], at[1], -(altitude - (-end[2] + start[2]) * part / total)])
            if turn:
                rows.append(_arc(point, heading, turn, part / radius, radius, -altitude, speed))
                heading += turn * part / radius
            else:
                to = at + part * _direction(heading)
                rows.append(_line(point, np.array([to[0], to[1], -altitude]), speed, heading))
            at = rows[-1][gk.S_END_NORTH : gk.S_END_EAST + 1]
    return rows


def _halves(length: float, most: float) -> list[float]:
    """Return a length as one or two parts, none longer than `most`; none at all where it is nothing."""
    if length < 1e-6:
        return []
    return [length] if length <= most else [length / 2.0, length / 2.0]


def _direction(course: float) -> FloatArray:
    return np.array([math.cos(course), math.sin(course)])


def _between(a: FloatArray, b: FloatArray, first: float, last: float) -> tuple[FloatArray, FloatArray]:
    return a + first * (b - a), a + last * (b - a)


def _line(start: FloatArray, end: FloatArray, speed: float, course: float | None = None) -> FloatArray:
    row = np.zeros(gk.N_COLUMNS)
    dn, de = float(end[0] - start[0]), float(end[1] - start[1])
    row[gk.S_COURSE] = math.atan2(de, dn) if course is None else course
    row[gk.S_NORTH], row[gk.S_EAST] = start[0], start[1]
    row[gk.S_LENGTH] = math.hypot(dn, de)
    _finish(row, end, float(row[gk.S_COURSE]), -float(start[2]), speed)
    return row


def _arc(
    start: FloatArray, course: float, turn: float, angle: float, radius: float, end_down: float, speed: float
) -> FloatArray:
    row = np.zeros(gk.N_COLUMNS)
    side = course + turn * math.pi / 2
    centre = start[:2] + radius * _direction(side)
    end = centre - radius * _direction(side + turn * angle)
    row[gk.S_TURN], row[gk.S_RADIUS], row[gk.S_LENGTH] = turn, radius, radius * angle
    row[gk.S_NORTH], row[gk.S_EAST] = centre
    row[gk.S_COURSE] = course
    _finish(row, np.array([end[0], end[1], end_down]), course + turn * angle, -float(start[2]), speed)
    return row


def _finish(row: FloatArray, end: FloatArray, course: float, altitude: float, speed: float) -> None:
    row[gk.S_END_NORTH], row[gk.S_END_EAST] = end[0], end[1]
    row[gk.S_NORMAL_NORTH : gk.S_NORMAL_EAST + 1] = _direction(course)
    row[gk.S_ALTITUDE], row[gk.S_END_ALTITUDE], row[gk.S_SPEED] = altitude, -end[2], speed


def _checked(waypoints: FloatArray, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    points, wanted = np.asarray(waypoints, float), np.asarray(speeds, float)
    if points.ndim != 2 or points.shape[1:] != (3,) or len(points) < 2 or wanted.shape != (len(points),):
        raise ValueError(f"a path needs waypoints (n >= 2, 3) and speeds (n,), not {points.shape} and {wanted.shape}")
    if not (np.all(np.isfinite(points)) and np.all(np.isfinite(wanted)) and np.all(wanted > 0.0)):
        raise ValueError("the path's waypoints must be finite and its speeds positive")
    apart = np.hypot(*np.diff(points[:, :2], axis=0).T)
    if np.any(apart < 1.0):
        raise ValueError(f"waypoints {int(np.argmin(apart))} and {int(np.argmin(apart)) + 1} are at the same place")
    return points, wanted


def _check_radius(radius: float) -> None:
    if not 0.0 < radius < math.inf:
        raise ValueError(f"the radius {radius} must be positive and finite")
