"""Compiled guidance along lines and arcs: vector fields, and which segment is flown now.

A path is rows of `N_COLUMNS` numbers, one for each segment (`path_segments` makes them); see the indices. An arc
turns by half a circle at most. ``u`` (4): airspeed, course, climb rate, bank fed forward, as `autopilot_kernels`
takes it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.vehicles.kernels import (
    AIRSPEED,
    CLIMB,
    DOWN,
    EAST,
    GRAVITY,
    HEADING,
    N_PARAMS,
    N_STATES,
    NORTH,
    P_ALTITUDE_GAIN,
    P_BANK_MAX,
    P_CHI_INF,
    P_CLIMB_MAX,
    P_PATH_GAIN,
    P_SINK_MAX,
    P_SPEED_MAX,
    P_SPEED_MIN,
    airspeed_for,
    clip,
    course_over_ground,
    ground_speed,
    wrap_angle,
)

FloatArray = NDArray[np.float64]

S_TURN = 0  # 0: a line; 1: an arc to the right (clockwise from above); -1: to the left
S_NORTH, S_EAST = 1, 2  # a line's start, an arc's centre, m
S_COURSE = 3  # of a line, rad
S_RADIUS = 4  # of an arc, m
S_END_NORTH, S_END_EAST = 5, 6  # where it ends, m
S_NORMAL_NORTH, S_NORMAL_EAST = 7, 8  # of the half-plane there; it points ahead
S_LENGTH = 9  # m
S_ALTITUDE, S_END_ALTITUDE = 10, 11  # m, linear in between
S_SPEED = 12  # ground speed, m/s
S_WAYPOINT = 13  # number of the waypoint that it leads to, or rounds
N_COLUMNS = 14

K_ORBIT = 4.0  # of the source


@jit_uncounted
def line_course(cross: float, course: float, chi_inf: float, k_path: float) -> float:
    """Return the course (rad) that joins a line from `cross` metres to its right."""
    return course - chi_inf * 2.0 / math.pi * math.atan(k_path * cross)


@jit_uncounted
def orbit_course(distance: float, bearing: float, radius: float, turn: float, k_orbit: float) -> float:
    """Return the course (rad) that joins an orbit, at a distance (m) and bearing (rad) from its centre.

    `turn` is 1 clockwise, -1 counter-clockwise.
    """
    return bearing + turn * (0.5 * math.pi + math.atan(k_orbit * (distance - radius) / radius))


@jit_uncounted
def segment_left(x: FloatArray, row: FloatArray) -> float:
    """Return how far (m) the end of a segment is away along it; negative: passed."""
    dn, de = row[S_END_NORTH] - x[NORTH], row[S_END_EAST] - x[EAST]
    if row[S_TURN] == 0.0:
        return float(dn * row[S_NORMAL_NORTH] + de * row[S_NORMAL_EAST])
    here = math.atan2(x[EAST] - row[S_EAST], x[NORTH] - row[S_NORTH])
    end = math.atan2(row[S_END_EAST] - row[S_EAST], row[S_END_NORTH] - row[S_NORTH])
    angle = wrap_angle(row[S_TURN] * (end - here))
    if angle < -0.5 * math.pi:  # it ends ahead, nearly half a circle from here, not behind
        angle += 2.0 * math.pi
    return float(angle * row[S_RADIUS])


@jit_uncounted
def follow_segments(
    x: FloatArray, segments: FloatArray, index: int, p: FloatArray, wind: FloatArray, u: FloatArray
) -> int:
    """Write the command that follows a path into `u` and return the segment flown now; their number: all are flown.

    `x`, `p` and `wind` are those of the point mass (`vehicles.kernels`). After the last one its line or orbit is kept.
    """
    n = segments.shape[0]
    while index < n and segment_left(x, segments[index]) <= 0.0:
        index += 1
    row = segments[min(index, n - 1)]
    speed = ground_speed(x, wind)
    dn, de = x[NORTH] - row[S_NORTH], x[EAST] - row[S_EAST]
    u[3] = 0.0
    if row[S_TURN] == 0.0:
        qn, qe = math.cos(row[S_COURSE]), math.sin(row[S_COURSE])
        cross, along = de * qn - dn * qe, dn * qn + de * qe
        course = line_course(cross, row[S_COURSE], p[P_CHI_INF], p[P_PATH_GAIN] / max(speed, 1.0))
    else:
        along = row[S_LENGTH] - segment_left(x, row)
        distance = math.sqrt(dn * dn + de * de)
        course = orbit_course(distance, math.atan2(de, dn), row[S_RADIUS], row[S_TURN], K_ORBIT)
        if abs(distance - row[S_RADIUS]) < 0.5 * row[S_RADIUS]:
            crab = math.cos(course_over_ground(x, wind) - x[HEADING])
            bank = math.atan(speed * speed / (GRAVITY * row[S_RADIUS] * max(crab, 0.3)))
            u[3] = row[S_TURN] * min(bank, p[P_BANK_MAX])
    share = clip(along / row[S_LENGTH], 0.0, 1.0)
    altitude = row[S_ALTITUDE] + share * (row[S_END_ALTITUDE] - row[S_ALTITUDE])
    slope = (row[S_END_ALTITUDE] - row[S_ALTITUDE]) / row[S_LENGTH] if 0.0 < share < 1.0 else 0.0
    climb = clip(slope * speed + p[P_ALTITUDE_GAIN] * (altitude + x[DOWN]), -p[P_SINK_MAX], p[P_CLIMB_MAX])
    u[0] = clip(airspeed_for(row[S_SPEED], course, climb, wind), p[P_SPEED_MIN], p[P_SPEED_MAX])
    u[1], u[2] = wrap_angle(course), climb
    return index


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    x, row = np.zeros(N_STATES), np.ones(N_COLUMNS)
    x[AIRSPEED], x[CLIMB] = 1.0, 0.0
    line_course(0.0, 0.0, 1.0, 0.1)
    orbit_course(1.0, 0.0, 1.0, 1.0, K_ORBIT)
    segment_left(x, row)
    follow_segments(x, row[np.newaxis], 0, np.ones(N_PARAMS), np.zeros(3), np.zeros(4))
