"""Times of validity in messages, held against their receipt."""

import math

from wideberth.links.config import RadarClockConfig


def time_of_validity(t_message: float, t: float, clock: RadarClockConfig) -> float | str:
    """Return when a message was true, s; or why its time is not believed, in words.

    Parameters
    ----------
    t_message : float
        What it says, s; NaN where it says nothing.
    t : float
        Of receipt, s.
    clock : RadarClockConfig
    """
    if math.isnan(t_message) or clock.use == "receipt":
        return t - clock.latency_s
    if t_message > t + clock.ahead_max_s:
        return "time ahead of its receipt"
    if t_message < t - clock.age_max_s:
        return "time too long before its receipt"
    return min(t_message, t)
