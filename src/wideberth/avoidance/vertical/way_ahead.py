"""The mission's way ahead as places in time, and a flight along it as few waypoints."""

import math

import numpy as np

from wideberth.avoidance.vertical import vertical_kernels as vk
from wideberth.types import FloatArray, Mission

_JOIN_TIME = 5.0  # s after which the mission's line is joined again
_JOIN_SLOPE = 3.0  # times the distance from it, if that is farther
_STRAIGHT_ON = 1e6  # m beyond the mission's end
_SAME_PLACE = 1.0  # m


def way_ahead(position: FloatArray, mission: Mission, speed: float, dt: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Return the places of the way from here along the mission, and straight on beyond its end.

    Parameters
    ----------
    position : ndarray, shape (3,)
        Local NED, m.
    mission : Mission
        With a waypoint left.
    speed : float
        Over ground, m/s.
    dt, n : float, int
        Step, s, and number of places; the first is here.

    Returns
    -------
    places : ndarray, shape (n, N_PLACE)
    corners : ndarray, shape (k,)
        When the way turns, s from now.
    """
    points = _points(position, mission, speed)
    legs = np.diff(points, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    at = np.concatenate([[0.0], np.cumsum(lengths)]) / speed
    times = dt * np.arange(n)
    places = np.empty((n, vk.N_PLACE))
    for column, values in ((vk.NORTH, points[:, 0]), (vk.EAST, points[:, 1]), (vk.WANTED, points[:, 2])):
        places[:, column] = np.interp(times, at, values)
    leg = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(legs) - 1)
    places[:, [vk.V_NORTH, vk.V_EAST, vk.SLOPE]] = (legs * (speed / lengths)[:, np.newaxis])[leg]
    corners = at[1:-1]
    return places, corners[corners < times[-1]]


def _points(position: FloatArray, mission: Mission, speed: float) -> FloatArray:
    """Return the way's corners (k, 3): horizontally from here, the altitude is the one that the mission has there."""
    k = mission.index
    target = mission.waypoints[k]
    start = next((w for w in mission.waypoints[k - 1 :: -1] if k > 0 and _apart(w, target) > _SAME_PLACE), None)
    points = []
    if start is None:
        points.append([position[0], position[1], target[2]])
    else:
        length = _apart(start, target)
        along = (target[:2] - start[:2]) / length
        offset = position[:2] - start[:2]
        done = float(offset @ along)
        aside = float(offset[0] * along[1] - offset[1] * along[0])
        share = min(max(done / length, 0.0), 1.0)
        points.append([position[0], position[1], start[2] + share * (target[2] - start[2])])
        join = done + max(_JOIN_TIME * speed, _JOIN_SLOPE * abs(aside))
        if 0.0 < join < length:
            points.append([*(start[:2] + join * along), start[2] + join / length * (target[2] - start[2])])
    for waypoint in mission.waypoints[k:]:
        if _apart(waypoint, np.array(points[-1])) > _SAME_PLACE:
            points.append(list(waypoint))
    if len(points) == 1:
        points.append(list(target + np.array([1.0, 0.0, 0.0])))
    last = np.array(points[-1])
    beyond = last - np.array(points[-2])
    beyond[2] = 0.0
    points.append(list(last + beyond / np.hypot(beyond[0], beyond[1]) * _STRAIGHT_ON))
    return np.array(points)


def _apart(a: FloatArray, b: FloatArray) -> float:
    return math.hypot(float(a[0] - b[0]), float(a[1] - b[1]))


def few_points(times: FloatArray, down: FloatArray, corners: FloatArray, tolerance: float) -> FloatArray:
    """Return the times of the fewest places between which a flight's height may be interpolated (Douglas-Peucker).

    Parameters
    ----------
    times, down : ndarray, shape (n,)
        s and m; the first is now.
    corners : ndarray, shape (k,)
        Times that are kept.
    tolerance : float
        m.

    Returns
    -------
    ndarray
        Without the first.
    """
    keep = np.zeros(len(times), bool)
    keep[-1] = True
    pieces = [(0, len(times) - 1)]
    while pieces:
        a, b = pieces.pop()
        if b - a < 2:
            continue
        chord = np.interp(times[a : b + 1], times[[a, b]], down[[a, b]])
        off = np.abs(down[a : b + 1] - chord)
        middle = a + int(np.argmax(off))
        if off.max() > tolerance:
            keep[middle] = True
            pieces += [(a, middle), (middle, b)]
    kept = np.union1d(times[keep], corners[corners < times[-1]])
    return np.asarray(kept[np.diff(kept, prepend=0.0) > 1e-3])
