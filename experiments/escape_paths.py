"""Whether the ownship had a way out: simple maneuvers flown ahead among intruders whose true future is known."""

import math
from collections.abc import Callable

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import kernels as vk

STEP, LONGEST = 0.2, 60.0
_GRAVITY = 9.81
_TURNS = np.radians(np.arange(-180.0, 181.0, 15.0))
_CLIMBS = (-1.0, -0.5, 0.0, 0.5, 1.0)
_SPEEDS = 3


def way_out_exists(
    position: FloatArray,
    velocity: FloatArray,
    vehicle: FloatArray,
    intruders: Callable[[float], FloatArray],
    *,
    radius: float,
    half_height: float,
    floor: float,
    ceiling: float,
) -> bool:
    """Return whether one of 375 maneuvers keeps out of all cylinders for a minute.

    Each is a turn at the bank limit to a new course, a climb or descent to a bound of altitude, and a change of speed,
    all begun at once with the vehicle's lags, straight on afterwards. One that keeps clear proves that there was a way;
    none that does is no proof that there was not, but then no simple one was left.

    Parameters
    ----------
    position, velocity : ndarray, shape (3,)
        Of the ownship, true, local NED, m and m/s.
    vehicle : ndarray
        Of the point mass (`vehicles.kernels`).
    intruders : callable
        True positions (n, 3) so many seconds from now.
    radius, half_height : float
        Of the cylinder, m.
    floor, ceiling : float
        Bounds of altitude, m.
    """
    turn, climb, speed = (
        values.ravel()
        for values in np.meshgrid(
            _TURNS, _CLIMBS, np.linspace(vehicle[vk.P_SPEED_MIN], vehicle[vk.P_SPEED_MAX], _SPEEDS), indexing="ij"
        )
    )
    place = np.tile(np.asarray(position, float), (turn.size, 1))
    course = np.full(turn.size, math.atan2(velocity[1], velocity[0]))
    left = turn.copy()
    fast = np.full(turn.size, math.hypot(velocity[0], velocity[1]))
    rising = np.full(turn.size, -float(velocity[2]))
    wanted = np.where(climb > 0.0, climb * vehicle[vk.P_CLIMB_MAX], climb * vehicle[vk.P_SINK_MAX])
    clear = np.ones(turn.size, bool)
    for k in range(1, round(LONGEST / STEP) + 1):
        rate = np.sign(left) * _GRAVITY * math.tan(vehicle[vk.P_BANK_MAX]) / fast
        # The bank is rolled into within the first second.
        rate *= min(1.0, k * STEP)
        turned = np.where(np.abs(rate * STEP) < np.abs(left), rate * STEP, left)
        course, left = course + turned, left - turned
        fast += np.clip(speed - fast, -1.0, 1.0) * STEP / vehicle[vk.P_TAU_SPEED]
        up = -place[:, 2]
        aim = np.where((wanted > 0.0) & (up >= ceiling) | (wanted < 0.0) & (up <= floor), 0.0, wanted)
        rising += (aim - rising) * STEP / vehicle[vk.P_TAU_CLIMB]
        place += STEP * np.column_stack([fast * np.cos(course), fast * np.sin(course), -rising])
        apart = intruders(k * STEP)[None, :, :] - place[:, None, :]
        inside = (np.hypot(apart[..., 0], apart[..., 1]) <= radius) & (np.abs(apart[..., 2]) <= half_height)
        clear &= ~inside.any(axis=1)
        if not clear.any():
            return False
    return True
