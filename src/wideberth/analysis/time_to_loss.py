"""How long it takes from detection to loss of separation and to collision, in straight encounters on one line.

ADS-B paper (Sahawneh, Duffield, Beard, McLain, 2015), "ADS-B as a DAA sensor", figure 3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import FINITE, NOT_NEGATIVE, POSITIVE, FloatArray, checked

SCENARIOS = ("head-on", "overtaking")
"""The scenarios, in the order of the last axis of `TimesToLoss`."""


@dataclass(frozen=True, slots=True)
class TimesToLoss:
    """Times from detection, for each scenario of `SCENARIOS` (the last axis).

    Attributes
    ----------
    closing_speed : ndarray, shape (..., 2)
        m/s, negative where the aircraft draw apart.
    to_loss_of_separation, to_collision : ndarray, shape (..., 2)
        s; infinite where the aircraft do not close.
    """

    closing_speed: FloatArray
    to_loss_of_separation: FloatArray
    to_collision: FloatArray


def time_to_distance(detection_range: ArrayLike, distance: ArrayLike, closing_speed: ArrayLike) -> FloatArray:
    """Return the time in which an aircraft closes from the range of its detection to a distance.

    Parameters
    ----------
    detection_range, distance : array_like
        m. They and `closing_speed` broadcast.
    closing_speed : array_like
        m/s.

    Returns
    -------
    ndarray
        s; infinite where the closing speed is 0 or negative.

    Raises
    ------
    ValueError
        If a value is not finite, a range or distance not positive, or a distance not below its range.
    """
    start = checked("detection_range", detection_range, POSITIVE)
    end = checked("distance", distance, POSITIVE)
    speed = checked("closing_speed", closing_speed, FINITE)
    if not (end < start).all():
        raise ValueError("distance must be below detection_range")
    travel, speed = np.broadcast_arrays(start - end, speed)
    times = np.full(speed.shape, np.inf)
    np.divide(travel, speed, out=times, where=speed > 0)
    return times


def times_to_loss(
    ownship_speed: ArrayLike,
    ownship_cruise_speed: ArrayLike,
    intruder_speed: ArrayLike,
    *,
    detection_range: ArrayLike,
    separation: ArrayLike,
    collision: ArrayLike,
) -> TimesToLoss:
    """Return the times to loss of separation and to collision, head-on and overtaking.

    Head-on both fly towards each other at their maximum speeds. Overtaking, the intruder comes from behind at its
    maximum speed, and the ownship is taken at its cruise speed, the worse case.

    Parameters
    ----------
    ownship_speed, ownship_cruise_speed, intruder_speed : array_like
        Maximum and cruise speed of the ownship, maximum speed of the intruder, m/s. All parameters broadcast.
    detection_range, separation, collision : array_like
        Range at which the intruder is detected, and distances that are loss of separation and collision, m.

    Returns
    -------
    TimesToLoss

    Raises
    ------
    ValueError
        If a value is not finite, a speed negative, a distance not positive, or a distance not below the range.
    """
    own = checked("ownship_speed", ownship_speed, NOT_NEGATIVE)
    cruise = checked("ownship_cruise_speed", ownship_cruise_speed, NOT_NEGATIVE)
    intruder = checked("intruder_speed", intruder_speed, NOT_NEGATIVE)
    closing = np.stack(np.broadcast_arrays(own + intruder, intruder - cruise), axis=-1)
    start, loss, touch = (np.asarray(d, dtype=np.float64)[..., None] for d in (detection_range, separation, collision))
    return TimesToLoss(closing, time_to_distance(start, loss, closing), time_to_distance(start, touch, closing))
