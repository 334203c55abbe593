"""Compiled 5-DOF point mass, straight-line path following, and look-ahead along a path.

State ``x`` (7): north, east, down (m), airspeed (m/s), heading, bank (rad), climb rate (m/s, up). Command ``u`` (3):
airspeed (m/s), course (rad), climb rate (m/s, up). ``wind`` (3): north, east, down (m/s). ``p``: see the indices below.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted

FloatArray = NDArray[np.float64]

GRAVITY = 9.81

N_STATES = 7
NORTH, EAST, DOWN, AIRSPEED, HEADING, BANK, CLIMB = 0, 1, 2, 3, 4, 5, 6

# Indices into the parameter array.
P_TAU_SPEED = 0  # time constant of the airspeed, s
P_ACCEL_MAX = 1  # m/s2
P_SPEED_MIN = 2  # airspeed, m/s
P_SPEED_MAX = 3
P_TAU_BANK = 4  # s
P_BANK_MAX = 5  # rad
P_BANK_RATE_MAX = 6  # rad/s
P_COURSE_GAIN = 7  # turn rate per course error, 1/s
P_TAU_CLIMB = 8  # s
P_CLIMB_MAX = 9  # m/s, positive
P_SINK_MAX = 10  # m/s, positive
P_VERTICAL_ACCEL_MAX = 11  # m/s2
P_CHI_INF = 12  # course offset from the path far away from it, rad
P_PATH_GAIN = 13  # k_path times ground speed, 1/s
P_ALTITUDE_GAIN = 14  # climb rate per altitude error, 1/s
P_CAPTURE = 15  # m: farther abeam than this a waypoint is not passed but flown back to; inf: never flown back to
N_PARAMS = 16


@jit_uncounted
def wrap_angle(angle: float) -> float:
    """Return an angle in (-pi, pi]."""
    return angle - 2.0 * math.pi * math.ceil((angle - math.pi) / (2.0 * math.pi))


@jit_uncounted
def clip(value: float, low: float, high: float) -> float:
    """Return `value` limited to [low, high]."""
    return min(max(value, low), high)


@jit_uncounted
def air_speed_level(x: FloatArray) -> float:
    """Return the horizontal part of the airspeed, m/s."""
    return math.sqrt(max(x[AIRSPEED] ** 2 - x[CLIMB] ** 2, 0.0))


@jit_uncounted
def velocity_level(x: FloatArray, wind: FloatArray) -> tuple[float, float]:
    """Return the horizontal velocity over ground, north and east, m/s."""
    horizontal = air_speed_level(x)
    return horizontal * math.cos(x[HEADING]) + wind[0], horizontal * math.sin(x[HEADING]) + wind[1]


@jit_uncounted
def ground_speed(x: FloatArray, wind: FloatArray) -> float:
    """Return the speed over ground, m/s."""
    if wind[0] == 0.0 and wind[1] == 0.0:
        return air_speed_level(x)
    vn, ve = velocity_level(x, wind)
    return math.sqrt(vn * vn + ve * ve)


@jit_uncounted
def ground_velocity(x: FloatArray, wind: FloatArray, out: FloatArray) -> None:
    """Write the velocity over ground (3), NED, of a state into `out`."""
    out[0], out[1] = velocity_level(x, wind)
    out[2] = wind[2] - x[CLIMB]


@jit_uncounted
def course_over_ground(x: FloatArray, wind: FloatArray) -> float:
    """Return the course (rad); the heading where the aircraft stands still over ground."""
    if wind[0] == 0.0 and wind[1] == 0.0:
        return float(x[HEADING])
    vn, ve = velocity_level(x, wind)
    if vn * vn + ve * ve < 1e-6:
        return float(x[HEADING])
    return math.atan2(ve, vn)


@jit_uncounted
def lag_shares(p: FloatArray, dt: float) -> tuple[float, float, float]:
    """Return which share of their changes airspeed, climb rate and bank make in `dt` seconds, as first-order lags."""
    return -math.expm1(-dt / p[P_TAU_SPEED]), -math.expm1(-dt / p[P_TAU_CLIMB]), -math.expm1(-dt / p[P_TAU_BANK])


@jit_uncounted
def move_point_mass(
    x: FloatArray, u: FloatArray, wind: FloatArray, p: FloatArray, dt: float, shares: tuple[float, float, float]
) -> None:
    """Advance the state by `dt` seconds, in place; `shares` are those of `lag_shares`.

    Speed, bank and climb rate follow their commands as first-order lags with limited rates, solved exactly over the
    step; heading and position then use the mean of the old and the new values (second order, stable to 0.5 s).
    """
    speed0, heading0, bank0, climb0 = x[AIRSPEED], x[HEADING], x[BANK], x[CLIMB]

    change = (clip(u[0], p[P_SPEED_MIN], p[P_SPEED_MAX]) - speed0) * shares[0]
    speed = speed0 + clip(change, -p[P_ACCEL_MAX] * dt, p[P_ACCEL_MAX] * dt)

    change = (clip(u[2], -p[P_SINK_MAX], p[P_CLIMB_MAX]) - climb0) * shares[1]
    climb = climb0 + clip(change, -p[P_VERTICAL_ACCEL_MAX] * dt, p[P_VERTICAL_ACCEL_MAX] * dt)

    error = wrap_angle(u[1] - course_over_ground(x, wind))
    wanted = math.atan(p[P_COURSE_GAIN] * error * speed0 / GRAVITY)
    change = (clip(wanted, -p[P_BANK_MAX], p[P_BANK_MAX]) - bank0) * shares[2]
    bank = bank0 + clip(change, -p[P_BANK_RATE_MAX] * dt, p[P_BANK_RATE_MAX] * dt)

    mean_speed = 0.5 * (speed0 + speed)
    mean_climb = 0.5 * (climb0 + climb)
    turn = GRAVITY * math.tan(0.5 * (bank0 + bank)) / max(mean_speed, 1.0) * dt
    mean_heading = heading0 + 0.5 * turn
    horizontal = math.sqrt(max(mean_speed * mean_speed - mean_climb * mean_climb, 0.0))
    x[NORTH] += (horizontal * math.cos(mean_heading) + wind[0]) * dt
    x[EAST] += (horizontal * math.sin(mean_heading) + wind[1]) * dt
    x[DOWN] += (wind[2] - mean_climb) * dt
    x[AIRSPEED] = speed
    x[HEADING] = wrap_angle(heading0 + turn)
    x[BANK] = bank
    x[CLIMB] = climb


@jit_uncounted
def point_mass_step(x: FloatArray, u: FloatArray, wind: FloatArray, p: FloatArray, dt: float) -> None:
    """Advance the state by `dt` seconds, in place: see `move_point_mass`."""
    move_point_mass(x, u, wind, p, dt, lag_shares(p, dt))


@jit_uncounted
def leg_start(waypoints: FloatArray, index: int) -> int:
    """Return the last waypoint before `index` that is not at the same place (horizontally 1 m), or -1."""
    i = index - 1
    while i >= 0:
        dn, de = waypoints[index, 0] - waypoints[i, 0], waypoints[index, 1] - waypoints[i, 1]
        if dn * dn + de * de > 1.0:
            return i
        i -= 1
    return -1


@jit_uncounted
def leg_end(waypoints: FloatArray, index: int) -> int:
    """Return the next waypoint after `index` that is not at the same place (horizontally 1 m), or -1."""
    for i in range(index + 1, waypoints.shape[0]):
        dn, de = waypoints[i, 0] - waypoints[index, 0], waypoints[i, 1] - waypoints[index, 1]
        if dn * dn + de * de > 1.0:
            return i
    return -1


@jit_uncounted
def turn_radius(speed: float, bank: float) -> float:
    """Return the radius (m) of a coordinated turn: V^2 / (g tan(bank))."""
    return speed * speed / (GRAVITY * math.tan(bank))


@jit_uncounted
def waypoint_passed(x: FloatArray, waypoints: FloatArray, index: int, p: FloatArray, wind: FloatArray) -> bool:
    """Return whether the aircraft has passed waypoint `index`: flown by it inside the turn to the next leg.

    The half-plane across the leg at the waypoint, moved back by the turn anticipation R tan(dchi / 2). Without a leg
    before it (the path is joined at this waypoint) it is passed within 1.5 turn radii, so that it is never circled.
    """
    dn, de = waypoints[index, 0] - x[NORTH], waypoints[index, 1] - x[EAST]
    start = leg_start(waypoints, index)
    qn = qe = length = remaining = 0.0
    if start >= 0:
        qn, qe = waypoints[index, 0] - waypoints[start, 0], waypoints[index, 1] - waypoints[start, 1]
        length = math.sqrt(qn * qn + qe * qe)
        qn, qe = qn / length, qe / length
        remaining = dn * qn + de * qe
        if remaining > 0.5 * length:
            return False  # no turn is anticipated by more than half of the leg
    speed = ground_speed(x, wind)
    radius = turn_radius(max(speed, x[AIRSPEED]), p[P_BANK_MAX])
    if start < 0:
        return math.hypot(dn, de) <= 1.5 * radius
    anticipation = 0.0
    end = leg_end(waypoints, index)
    if end >= 0:
        nn, ne = waypoints[end, 0] - waypoints[index, 0], waypoints[end, 1] - waypoints[index, 1]
        turn = abs(math.atan2(qn * ne - qe * nn, qn * nn + qe * ne))
        if turn < 2.8:  # a reversal is flown over, not cut
            roll = speed * (p[P_TAU_BANK] + 0.5 * p[P_BANK_MAX] / p[P_BANK_RATE_MAX]) * min(turn, 1.0)
            anticipation = 1.15 * radius * min(math.tan(0.5 * turn), 1.5) + roll
            anticipation = min(anticipation, 0.5 * length, 0.5 * math.hypot(nn, ne))
    if remaining > anticipation:
        return False
    return abs(dn * qe - de * qn) <= max(p[P_CAPTURE], 1.5 * radius) or math.hypot(dn, de) <= 1.5 * radius


@jit_uncounted
def airspeed_for(speed: float, course: float, climb: float, wind: FloatArray) -> float:
    """Return the airspeed (m/s) that, with the wind, gives a ground speed along a course while climbing."""
    if wind[0] != 0.0 or wind[1] != 0.0:
        an, ae = speed * math.cos(course) - wind[0], speed * math.sin(course) - wind[1]
        speed = math.sqrt(an * an + ae * ae)
    return math.sqrt(speed * speed + climb * climb)


@jit_uncounted
def follow_path(
    x: FloatArray,
    waypoints: FloatArray,
    speeds: FloatArray,
    index: int,
    p: FloatArray,
    wind: FloatArray,
    u: FloatArray,
) -> int:
    """Write the command that follows a path into `u`, and return the waypoint that is flown to now.

    Straight-line following: course = leg - chi_inf 2/pi atan(k_path e) with k_path = path gain / ground speed; the
    altitude is interpolated along the leg, with the slope fed forward. `speeds` (n,) are ground speeds wanted on the
    leg that ends at each waypoint. `index` 0 flies directly to the first waypoint (no leg before it); repeated
    waypoints are passed at once. Returns ``n`` once all are passed: the last leg's line, altitude and speed are kept.
    """
    n = waypoints.shape[0]
    while index < n and waypoint_passed(x, waypoints, index, p, wind):
        index += 1
    target = min(index, n - 1)
    start = leg_start(waypoints, target)
    dn, de = waypoints[target, 0] - x[NORTH], waypoints[target, 1] - x[EAST]
    altitude = -waypoints[target, 2]
    slope = 0.0
    if start < 0:
        course = math.atan2(de, dn) if index < n else course_over_ground(x, wind)
    else:
        qn, qe = waypoints[target, 0] - waypoints[start, 0], waypoints[target, 1] - waypoints[start, 1]
        length = math.sqrt(qn * qn + qe * qe)
        qn, qe = qn / length, qe / length
        remaining = dn * qn + de * qe
        cross = dn * qe - de * qn  # the aircraft's offset to the right of the leg
        if remaining <= 0.0 and index < n:
            course = math.atan2(de, dn)
        else:
            offset = math.atan(p[P_PATH_GAIN] / max(ground_speed(x, wind), 1.0) * cross)
            course = math.atan2(qe, qn) - p[P_CHI_INF] * 2.0 / math.pi * offset
        if 0.0 < remaining < length:
            slope = (waypoints[start, 2] - waypoints[target, 2]) / length
        altitude -= (altitude + waypoints[start, 2]) * clip(remaining / length, 0.0, 1.0)
        if slope != 0.0:
            vn, ve = velocity_level(x, wind)
            slope *= max(vn * qn + ve * qe, 0.0)
    climb = clip(slope + p[P_ALTITUDE_GAIN] * (altitude + x[DOWN]), -p[P_SINK_MAX], p[P_CLIMB_MAX])
    u[0] = clip(airspeed_for(speeds[target], course, climb, wind), p[P_SPEED_MIN], p[P_SPEED_MAX])
    u[1] = course
    u[2] = climb
    return index


@jit_uncounted
def speed_to_arrive(
    t: float, x: FloatArray, waypoint: FloatArray, time: float, slowest: float, fastest: float
) -> float:
    """Return the ground speed (m/s, within limits) that reaches `waypoint` at `time`, flying straight from `t`."""
    distance = math.hypot(waypoint[0] - x[NORTH], waypoint[1] - x[EAST])
    if time <= t:
        return fastest
    return clip(distance / (time - t), slowest, fastest)


@jit
def fly_path(
    x0: FloatArray,
    waypoints: FloatArray,
    speeds: FloatArray,
    index: int,
    p: FloatArray,
    wind: FloatArray,
    dt: float,
    n_steps: int,
    out_states: FloatArray,
) -> int:
    """Fly a path ahead from `x0` (which is kept): `out_states` (>= n_steps, 7) is the state after each step of `dt`.

    Returns the waypoint that is flown to at the end (``len(waypoints)`` once all are passed).
    """
    x = x0.copy()
    u = np.empty(3)
    shares = lag_shares(p, dt)  # the same in all steps
    for k in range(n_steps):
        index = follow_path(x, waypoints, speeds, index, p, wind, u)
        move_point_mass(x, u, wind, p, dt, shares)
        for i in range(N_STATES):
            out_states[k, i] = x[i]
    return index


def warmup() -> None:
    """Compile every kernel that is called from Python."""
    x, u, wind, p = np.ones(N_STATES), np.ones(3), np.zeros(3), np.ones(N_PARAMS)
    waypoints, speeds = np.array([[0.0, 0.0, 0.0], [1e6, 0.0, 0.0]]), np.ones(2)
    point_mass_step(x, u, wind, p, 0.1)
    ground_velocity(x, wind, u)
    course_over_ground(x, wind)
    follow_path(x, waypoints, speeds, 1, p, wind, u)
    fly_path(x, waypoints, speeds, 1, p, wind, 0.1, 1, np.empty((1, N_STATES)))
    speed_to_arrive(0.0, x, waypoints[1], 1.0, 1.0, 2.0)
    waypoint_passed(x, waypoints, 1, p, wind)
    leg_start(waypoints, 1)
    leg_end(waypoints, 0)
    turn_radius(1.0, 1.0)
    airspeed_for(1.0, 0.0, 0.0, wind)
    wrap_angle(1.0)
    clip(1.0, 0.0, 2.0)
