"""The time line of detect and avoid and the range that it asks for (ADS-B paper, (1), figure 5; thesis, figure 2.1)."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import NOT_NEGATIVE, FloatArray, checked


@dataclass(frozen=True, slots=True)
class TimeLine:
    """What happens between detection and the closest point of approach, s; each a number or an array.

    Attributes
    ----------
    tracking : array_like
        Until the track is sure.
    detection : array_like
        Until the collision or the loss of well clear is found.
    planning : array_like
        Until the maneuver is planned.
    review : array_like
        Until a human has approved it: the pilot's delay, with that of the link and of air traffic control.
    maneuver : array_like
        t_r, from its begin to the closest point of approach, as `DetectionRange.maneuver_time`.

    Raises
    ------
    ValueError
        If a time is negative or not finite; the message names it.
    """

    tracking: ArrayLike = 0.0
    detection: ArrayLike = 0.0
    planning: ArrayLike = 0.0
    review: ArrayLike = 0.0
    maneuver: ArrayLike = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            checked(item.name, getattr(self, item.name), NOT_NEGATIVE)

    @property
    def computation_time(self) -> FloatArray:
        """t_c, from detection to the begin of the maneuver, s: what the range functions ask for."""
        parts = (self.tracking, self.detection, self.planning, self.review)
        total: FloatArray = sum((np.asarray(part, np.float64) for part in parts), np.zeros(()))
        return total

    @property
    def total(self) -> FloatArray:
        """t_daa, s."""
        return self.computation_time + np.asarray(self.maneuver, np.float64)


def sensing_range(closing_speed: ArrayLike, time_line: TimeLine) -> FloatArray:
    """Return the required sensing distance d_r = v_c t_daa (ADS-B paper, (1)).

    Parameters
    ----------
    closing_speed : array_like
        v_c, m/s, not negative; head-on the sum of both speeds. Broadcasts with the time line.
    time_line : TimeLine

    Returns
    -------
    ndarray
        m.

    Raises
    ------
    ValueError
        If a closing speed is negative or not finite.
    """
    return checked("closing_speed", closing_speed, NOT_NEGATIVE) * time_line.total
