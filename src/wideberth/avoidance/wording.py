"""Decisions in words, for people."""

import math

from wideberth.types import Threat


def describe_maneuver(
    label: str | None,
    threat: Threat | None,
    others: int,
    course_change: float,
    height_change: float,
    *,
    least_bad: bool,
) -> str:
    """Return why and what, such as "intruder A1B2C3 35 s ahead, miss 120 m: turn right 60 deg".

    Parameters
    ----------
    label : str or None
        Name of the first intruder in the way; None if none is.
    threat : Threat or None
        What is known of it.
    others : int
        How many more are in the way.
    course_change, height_change : float
        rad, positive right; m, positive up.
    least_bad : bool
    """
    if label is None:
        cause = "a better path round the traffic"
    else:
        cause = f"intruder {label}"
        if threat is not None and math.isfinite(threat.t_cpa) and threat.t_cpa > 0:
            cause += f" {threat.t_cpa:.0f} s ahead, miss {threat.horizontal_miss:.0f} m"
            cause += f" and {abs(threat.vertical_miss):.0f} m in height"
        if others:
            cause += f" (and {others} more)"
    actions = []
    degrees = round(math.degrees(course_change))
    if abs(degrees) >= 5:
        actions.append(f"turn {'right' if degrees > 0 else 'left'} {abs(degrees)} deg")
    if abs(height_change) >= 5:
        actions.append(f"{'climb' if height_change > 0 else 'descend'} {abs(height_change):.0f} m")
    text = f"{cause}: {', '.join(actions) or 'hold course and height'}"
    return f"{text}; every path is blocked, this is the least bad" if least_bad else text
