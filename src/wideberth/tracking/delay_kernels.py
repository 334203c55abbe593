"""Whether positions away from a track are those of its own aircraft, told late: behind it on the path that it flies."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]

LATEST = 10.0
"""Positions further behind than this are another aircraft's, s."""

TURN_RATE = 0.06
"""At which an aircraft may turn off its straight continuation meanwhile, rad/s."""


@jit_uncounted
def delay_on_path(north: float, east: float, v_north: float, v_east: float, track: FloatArray, margin: float) -> float:
    """Return how late positions are that lie on a track's path; NaN where they are another aircraft's.

    Receivers and links may hold messages up by seconds, and many formats tell no time of validity. Such positions
    follow the aircraft, at its own speed, where it was that long ago.

    Parameters
    ----------
    north, east : float
        The positions' latest, from where the track is expected then, m.
    v_north, v_east : float
        Velocity told with them, or that at which they go on, m/s.
    track : ndarray, shape (2,)
        Velocity of the track, m/s; only where it leads to counts, as late positions may have spoilt its speed.
    margin : float
        How far off the path they may be, m.

    Returns
    -------
    float
        s; negative where they are ahead of the track, which then is the late one.
    """
    speed = math.hypot(v_north, v_east)
    if speed < 1.0 or track[0] * v_north + track[1] * v_east < 0.5 * speed * math.hypot(track[0], track[1]):
        return math.nan
    delay = -(north * v_north + east * v_east) / (speed * speed)
    across = abs(north * v_east - east * v_north) / speed
    if abs(delay) > LATEST or across > margin + 0.5 * TURN_RATE * speed * delay * delay:
        return math.nan
    return delay


def warmup() -> None:
    """Compile what Python calls."""
    delay_on_path(1.0, 1.0, 1.0, 1.0, np.ones(2), 1.0)
