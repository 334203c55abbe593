"""Flights of an aircraft that turns, climbs and changes speed at constant rates, leg by leg (turning model (3.48))."""

import bisect
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.tracking.motion_kernels import TURNING, path_velocity, propagate

FloatArray = NDArray[np.float64]

# Simpson's rule over a piece errs with its length to the fifth power: below a millimetre at 30 deg/s and 60 m/s.
_PIECE_S = 0.25
_STEEPEST = math.radians(80.0)


class Leg(NamedTuple):
    """Rates that stay for a while: s, m/s2, rad/s of the course and of the flight path angle."""

    duration: float
    acceleration: float
    turn_rate: float
    path_angle_rate: float


class LegFlight:
    """A flight through legs and straight on afterwards; before the start it came straight.

    Speed stays at `speed_min` or above and the path within 80 deg of level: the rate that would go further ends there.

    Parameters
    ----------
    position : array_like, shape (3,)
        At the start, local NED, m.
    speed, course, path_angle : float
        At the start; m/s along the path, rad, rad (positive climbing).
    legs : sequence of Leg
    speed_min : float
        m/s.
    """

    def __init__(
        self,
        position: Sequence[float] | FloatArray,
        speed: float,
        course: float,
        path_angle: float,
        legs: Sequence[Leg],
        speed_min: float = 0.0,
    ) -> None:
        x = np.array([*position, speed, course, path_angle, 0.0, 0.0, 0.0])
        self._times, self._states = [0.0], [x]
        t = 0.0
        for leg in legs:
            pieces = max(1, math.ceil(leg.duration / _PIECE_S))
            for _ in range(pieces):
                x = x.copy()
                x[6:] = leg[1:]
                dt = leg.duration / pieces
                if x[3] + dt * x[6] < speed_min or x[3] + dt * x[6] < 0.0:
                    x[6] = 0.0
                if abs(x[5] + dt * x[8]) > _STEEPEST:
                    x[8] = 0.0
                self._states[-1] = x
                ahead = x.copy()
                propagate(TURNING, dt, x, ahead)
                x = ahead
                t += dt
                self._times.append(t)
                self._states.append(x)
        last = self._states[-1].copy()
        last[6:] = 0.0
        self._states[-1] = last
        self._first = self._states[0].copy()
        self._first[6:] = 0.0

    def state(self, t: float) -> FloatArray:
        """Return position and velocity at `t` s after the start, local NED, shape (6,)."""
        if t < 0.0:
            x, dt = self._first, t
        else:
            k = bisect.bisect_right(self._times, t) - 1
            x, dt = self._states[k], t - self._times[k]
        ahead, out = np.empty(9), np.empty(6)
        propagate(TURNING, dt, x, ahead)
        out[:3] = ahead[:3]
        path_velocity(ahead[3], ahead[4], ahead[5], out[3:])
        return out
