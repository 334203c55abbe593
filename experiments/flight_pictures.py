"""A flight among intruders as two pictures: from above, with how near they came, and altitudes over time."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.patches import Circle

from wideberth.evaluation.report_style import LIMIT, OWNSHIP, traffic_colour
from wideberth.types import FloatArray

_LEAST_HEIGHT = 10.0  # m either way that altitudes are drawn over


class FlightTrace(NamedTuple):
    """True states of a flight.

    Attributes
    ----------
    t : ndarray, shape (n,)
        s since the start.
    own : ndarray, shape (n, 3)
        Local NED, m.
    intruders : ndarray, shape (n, k, 3)
    mission : ndarray, shape (m, 3)
        Waypoints, the start first.
    radius, half_height : float
        The volume that is to be kept, m.
    """

    t: FloatArray
    own: FloatArray
    intruders: FloatArray
    mission: FloatArray
    radius: float
    half_height: float


def draw_flight(figure: Any, places: tuple[Any, Any], trace: FlightTrace, title: str) -> None:
    """Draw a flight in two places of a figure; circles are the volume's at the closest points.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    places : tuple of matplotlib.gridspec.SubplotSpec
        For the map and for the altitudes.
    trace : FlightTrace
    title : str
    """
    t, own, intruders = trace.t, trace.own, trace.intruders
    above, side = figure.add_subplot(places[0]), figure.add_subplot(places[1])
    apart = np.hypot(*(intruders - own[:, None, :])[..., :2].transpose(2, 0, 1))
    for i in range(intruders.shape[1]):
        colour = traffic_colour(i)
        above.plot(intruders[:, i, 1], intruders[:, i, 0], color=colour, linewidth=1.2)
        near = int(np.argmin(apart[:, i]))
        at = intruders[near, i, 1], intruders[near, i, 0]
        above.add_patch(Circle(at, trace.radius, fill=False, color=colour, linewidth=0.8))
        above.plot(own[near, 1], own[near, 0], "o", color=colour, markersize=4)
        height = np.where(apart[:, i] < trace.radius, -intruders[:, i, 2], np.nan)
        band = height - trace.half_height, height + trace.half_height
        side.fill_between(t, *band, color=colour, alpha=0.25, linewidth=0)
        side.plot(t, -intruders[:, i, 2], color=colour, linewidth=1.0)
    above.plot(own[:, 1], own[:, 0], color=OWNSHIP, linewidth=2)
    above.plot(trace.mission[:, 1], trace.mission[:, 0], linestyle=(0, (4, 3)), color=LIMIT, linewidth=1)
    flown = np.concatenate([own[:, :2], trace.mission[:, :2]])
    low, high = flown.min(axis=0), flown.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max()) + 1.3 * trace.radius
    above.set_xlim(middle[1] - half, middle[1] + half)
    above.set_ylim(middle[0] - half, middle[0] + half)
    above.set_aspect("equal", adjustable="box")
    above.set_xlabel("east, m")
    above.set_ylabel("north, m")
    above.set_title(title)
    side.plot(t, -own[:, 2], color=OWNSHIP, linewidth=2)
    side.set_xlabel("s")
    side.set_ylabel("altitude, m")
    side.set_title(f"±{trace.half_height:g} m within {trace.radius:.0f} m")
    bottom, top = side.get_ylim()
    side.set_ylim(min(bottom, -own[0, 2] - _LEAST_HEIGHT), max(top, -own[0, 2] + _LEAST_HEIGHT))
