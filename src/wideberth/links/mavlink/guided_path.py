"""A maneuver's path as set-points: where to go next, and how fast."""

import math

import numpy as np

from wideberth.types import FloatArray

_LEAST_TIME_S = 0.5
_SPEED_SLACK = 0.3  # how far a leg's speed may leave the planned one, to be in time


def with_floor(places: FloatArray, ground: float, floor: float) -> FloatArray:
    """Return places (..., 3), local NED, none lower than `floor` (m) above the ground at altitude `ground`.

    A ground that is not known (NaN) leaves them as they are.
    """
    raised = np.array(places, float)
    if math.isfinite(ground):
        raised[..., 2] = np.minimum(raised[..., 2], -(ground + floor))
    return raised


class GuidedPath:
    """Follows a path from where the ownship is, leg by leg, each waypoint at its time as far as the speed allows.

    Parameters
    ----------
    start : ndarray, shape (3,)
    waypoints : ndarray, shape (n, 3)
        Local NED, m.
    times : ndarray, shape (n,)
        When each is to be reached, s.
    t : float
        Now, s.
    radius : float
        Of the turns, m: a waypoint is passed where the turn to the next leg begins.
    """

    def __init__(self, start: FloatArray, waypoints: FloatArray, times: FloatArray, t: float, radius: float) -> None:
        self._points = np.vstack([start, waypoints])
        self._times = np.concatenate([[t], times])
        self._radius = radius
        self._index = 1
        legs = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        self._speeds = legs / np.maximum(np.diff(self._times), _LEAST_TIME_S)

    def set_point(self, t: float, position: FloatArray, lead: float) -> tuple[FloatArray, FloatArray]:
        """Return where to go, `lead` (m) ahead on the present leg, and the velocity there; both (3,), local NED.

        The leg's line is followed beyond its end, so that the vehicle neither stops nor circles there; the height stays
        between those of its ends.
        """
        while self._index < len(self._points) - 1 and self._left(position) <= self._anticipation():
            self._index += 1
        a, b = self._points[self._index - 1], self._points[self._index]
        leg = b - a
        level = math.hypot(leg[0], leg[1])
        speed = self._speed(t, position)
        if level < 0.1:
            return b.copy(), np.array([0.0, 0.0, math.copysign(speed, leg[2]) if abs(leg[2]) > 0.1 else 0.0])
        north, east = leg[0] / level, leg[1] / level
        along = max((position[0] - a[0]) * north + (position[1] - a[1]) * east, 0.0)
        share = min((along + lead) / level, 1.0)
        target = np.array([a[0] + (along + lead) * north, a[1] + (along + lead) * east, a[2] + share * leg[2]])
        climb = leg[2] / level if along < level else 0.0
        flat = speed / math.hypot(1.0, climb)
        return target, np.array([flat * north, flat * east, flat * climb])

    def _speed(self, t: float, position: FloatArray) -> float:
        """Return the speed (m/s) that reaches the present waypoint in time, near the planned one."""
        planned = float(self._speeds[self._index - 1])
        remaining = float(self._times[self._index]) - t
        if remaining <= _LEAST_TIME_S:
            return planned
        left = float(np.linalg.norm(self._points[self._index] - position))
        return min(max(left / remaining, (1.0 - _SPEED_SLACK) * planned), (1.0 + _SPEED_SLACK) * planned)

    def _left(self, position: FloatArray) -> float:
        """Return how far (m, level) the present waypoint is away along its leg; where the leg is upright, in height."""
        a, b = self._points[self._index - 1], self._points[self._index]
        leg = b - a
        level = math.hypot(leg[0], leg[1])
        if level < 0.1:
            return max(abs(float(b[2] - position[2])) - 1.0, 0.0)
        return float((b[0] - position[0]) * leg[0] + (b[1] - position[1]) * leg[1]) / level

    def _anticipation(self) -> float:
        """Return how far (m) before the present waypoint the turn to the next leg begins."""
        a, b, c = self._points[self._index - 1 : self._index + 2]
        into, out = (b - a)[:2], (c - b)[:2]
        turn = abs(math.atan2(into[0] * out[1] - into[1] * out[0], float(into @ out)))
        early = self._radius * min(math.tan(0.5 * min(turn, 2.8)), 1.5)
        return min(early, 0.5 * math.hypot(*into), 0.5 * math.hypot(*out))
