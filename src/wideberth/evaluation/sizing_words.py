"""The answer of a sensor's sizing in plain words, for the terminal and the report."""

import math
from collections.abc import Sequence

from wideberth.analysis.ground_sizing import GroundProtection
from wideberth.analysis.sizing_answer import Intruder, SizingAnswer, SpeedLimit
from wideberth.units import DEGREE, KNOT


def speed_text(speed: float) -> str:
    """Return a speed in m/s and kt, one decimal below 20 m/s."""
    return f"{speed:.{1 if speed < 20 else 0}f} m/s ({speed / KNOT:.0f} kt)"


def intruder_text(intruder: Intruder) -> str:
    """Return an intruder's speed and, where it says more than the speed, its name."""
    speed = f"{intruder.speed:.3g} m/s"
    return speed if intruder.name.replace(" ", "") == speed.replace(" ", "") else f"{speed}: {intruder.name}"


def _up_to(limit: SpeedLimit) -> str:
    if limit.speed is None:
        return "against none"
    if limit.at_least:
        return f"against every intruder up to {speed_text(limit.speed)}, the fastest asked for"
    # Rounded down: the number is a promise.
    return f"against intruders up to {speed_text(math.floor(10 * limit.speed) / 10)}"


def answer_text(answer: SizingAnswer) -> str:
    """Return the answer in a sentence or two."""
    head, field, around = answer.head_on, answer.field_of_view, answer.all_round
    if head.speed is None and field.speed is None and around.speed is None:
        return "Not protected, neither from ahead nor from all directions, even against the slowest intruders."
    if around == field == head:
        return f"Protected from all directions {_up_to(around)}."
    if answer.visible.all():
        return f"Protected head-on {_up_to(head)}; from all directions {_up_to(around)}."
    return (
        f"Protected head-on {_up_to(head)}; in all of the sensor's field of view {_up_to(field)}; from all directions "
        f"{_up_to(around)}."
    )


def ground_text(found: GroundProtection, intruders: Sequence[Intruder]) -> str:
    """Return what a radar on the ground does, in a sentence or two."""
    good = [k for k, safe in enumerate(found.protected) if safe]
    if not good:
        return "Protected nowhere: against none of the intruders is there an operation volume."
    fastest = max(good, key=lambda k: intruders[k].speed)
    volume = found.operation[fastest]
    assert volume is not None
    return (
        f"Protected against intruders up to {speed_text(intruders[fastest].speed)} (of those asked for) within "
        f"{volume.radius:,.0f} m of the radar and up to {volume.height:,.0f} m above it."
    )


def bearings_text(stretches: Sequence[tuple[float, float]]) -> str:
    """Return stretches of bearings, in degrees."""
    if not stretches:
        return "none"
    if stretches[0] == (-math.pi, math.pi):
        return "all"
    return ", ".join(f"{a / DEGREE:.0f}° to {b / DEGREE:.0f}°".replace("-", "−") for a, b in stretches)
