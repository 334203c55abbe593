"""What a path meets as it is flown, all at once."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.avoidance.waypoint_paths.first_turn_kernels import N_INERTIA, PLACES, flown_times, leg_times
from wideberth.avoidance.waypoint_paths.intruder_kernels import N_INTRUDER, path_inside
from wideberth.vehicles.kernels import wrap_angle

Floats = NDArray[np.float64]


@jit
def judge_path(
    points: Floats,
    course: float,
    radius: float,
    inertia: Floats,
    speed: float,
    intruders: Floats,
    scale: float,
    decide_by: float,
) -> tuple[float, float, float, float, float, Floats, Floats, Floats]:
    """Return what a path meets.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Local NED, m; the first is the ownship.
    course : float
        Of the ownship, rad; NaN where any will do.
    radius : float
        Of a turn, m.
    inertia : ndarray, shape (N_INERTIA,)
        What the ownship first goes on with.
    speed : float
        m/s.
    intruders : ndarray, shape (m, N_INTRUDER)
    scale : float
        Factor on the cylinders.
    decide_by : float
        s.

    Returns
    -------
    length, turn : float
        As flown with the turn that begins it, m; from the course to the first leg, rad, not negative.
    entry, inside, soon : float
        When it first enters a cylinder (s, inf if never), seconds in all of them, and those on the legs that begin
        before `decide_by`.
    times, arrivals : ndarray, shape (n,)
        When the places are reached along the legs, and with the turn (the first means nothing), s from now.
    entries : ndarray, shape (m,)
        When each cylinder is entered, s, inf if never.
    """
    n, count = points.shape[0], intruders.shape[0]
    times, entries = np.empty(n), np.empty(count)
    flown, arrivals = np.empty((n + PLACES, 3)), np.empty(n + PLACES)
    leg_times(points, n, speed, times)
    places, length = flown_times(points, n, course, radius, inertia, speed, flown, arrivals)
    entry, inside = path_inside(flown, arrivals, places, intruders, count, scale, entries)
    soon = inside
    if inside > 0.0:
        begun = 0
        while begun < places and arrivals[begun] < decide_by:
            begun += 1
        soon = path_inside(flown, arrivals, min(begun + 1, places), intruders, count, scale, np.empty(count))[1]
    leg_n, leg_e = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1]
    turn = 0.0 if math.isnan(course) else abs(wrap_angle(math.atan2(leg_e, leg_n) - course))
    return length, turn, entry, inside, soon, times, arrivals[places - n : places].copy(), entries


def warmup() -> None:
    """Compile what Python calls of this module."""
    judge_path(np.zeros((2, 3)), 0.0, 1.0, np.zeros(N_INERTIA), 1.0, np.ones((1, N_INTRUDER)), 1.0, 1.0)
