"""The life of one ADS-B track, compiled: how it starts, what becomes of each report, when it starts again.

For aircraft whose reports come in order and whose address is theirs alone, decision for decision what
`adsb_aircraft.AdsbAircraft` does. Where that would do more (a second aircraft, a track lost or taken anew after many
rejections), `NEEDS_MORE` says so and the caller takes the full tracker.
"""

import math

import numpy as np

from wideberth._jit import jit_uncounted
from wideberth.tracking.kernels import ACCEPTED, REJECTED, filter_reports

USED, NOT_NEW, NEEDS_MORE = 0, 1, 2

# What is remembered of a track, floats and integers.
T_POSITION, FIX_NORTH, FIX_EAST, LAST_NORTH, LAST_EAST = 0, 1, 2, 3, 4
N_FLOATS = 5
STARTED, ACCEPTED_COUNT, FIX_STEP, CONSECUTIVE, REJECTS, FIRST_REJECT, SECOND_REJECT, VERTICAL_REJECTS = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
)
N_INTEGERS = 8

# Settings (see `AdsbKalmanConfig`), SI.
DT, GATE, TIME_SIGMA, WHOLE_SECOND_SIGMA, VELOCITY_SIGMA, ACCELERATION_SIGMA, JERK_SIGMA, SPEED_MAX = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
)
HOVER_SPEED, CONFIRM, RESTART_REJECTS, REJECT_MEMORY, USE_VELOCITY, UNKNOWN_SIGMA = 8, 9, 10, 11, 12, 13
START_REPORTED = 14
N_SETTINGS = 15

TURN_ACCELERATION = 5.0  # m/s2 that positions of one aircraft may show and still agree


@jit_uncounted
def start_axis(
    x: np.ndarray,
    p: np.ndarray,
    position: float,
    velocity: float,
    position_variance: float,
    velocity_variance: float,
    acceleration_sigma: float,
    jerk_sigma: float,
) -> None:
    """Set one axis (4,), (4, 4) to a position and velocity with independent errors."""
    x[0], x[1], x[2], x[3] = position, velocity, 0.0, 0.0
    p[:] = 0.0
    p[0, 0], p[1, 1] = position_variance, velocity_variance
    p[2, 2], p[3, 3] = acceleration_sigma * acceleration_sigma, jerk_sigma * jerk_sigma


@jit_uncounted
def velocity_between(
    dt: float,
    north: float,
    east: float,
    position_variance: float,
    time_sigma: float,
    speed_max: float,
) -> tuple[float, float, float]:
    """Return north, east, standard deviation of the velocity from a move over `dt`; NaN if no aircraft flies so."""
    if dt <= 0.0:
        return math.nan, math.nan, math.nan
    vn, ve = north / dt, east / dt
    speed = math.hypot(vn, ve)
    if speed > speed_max:
        return math.nan, math.nan, math.nan
    noise = 2.0 * (position_variance + (time_sigma * speed) ** 2) / dt**2
    return vn, ve, math.sqrt(noise + (0.5 * TURN_ACCELERATION * dt) ** 2)


@jit_uncounted
def start_horizontal(
    x: np.ndarray,
    p: np.ndarray,
    z: np.ndarray,
    r: np.ndarray,
    vn: float,
    ve: float,
    sigma: float,
    time_sigma: float,
    acceleration_sigma: float,
    jerk_sigma: float,
) -> None:
    """Set the horizontal axes of a track (3, 4), (3, 4, 4) to a reported position and a velocity."""
    for axis in range(2):
        speed = vn if axis == 0 else ve
        variance = r[axis] + (time_sigma * speed) ** 2
        start_axis(x[axis], p[axis], z[axis], speed, variance, sigma * sigma, acceleration_sigma, jerk_sigma)


@jit_uncounted
def restart(
    x: np.ndarray,
    p: np.ndarray,
    z: np.ndarray,
    r: np.ndarray,
    velocity: tuple[float, float, float],
    time_sigma: float,
    settings: np.ndarray,
) -> None:
    """Set a track to a report, with a horizontal velocity (north, east, sigma) that is not the reported one."""
    vn, ve, sigma = velocity
    start_horizontal(x, p, z, r, vn, ve, sigma, time_sigma, settings[ACCELERATION_SIGMA], settings[JERK_SIGMA])
    start_axis(x[2], p[2], z[2], z[5], r[2], r[5], settings[ACCELERATION_SIGMA], settings[JERK_SIGMA])


@jit_uncounted
def take_report(
    t: float,
    z: np.ndarray,
    r: np.ndarray,
    x: np.ndarray,
    p: np.ndarray,
    last: np.ndarray,
    floats: np.ndarray,
    integers: np.ndarray,
    phi: np.ndarray,
    q: np.ndarray,
    settings: np.ndarray,
    slot: np.ndarray,
    step_of: np.ndarray,
    use: np.ndarray,
    sigma_of: np.ndarray,
    outcome: np.ndarray,
    nis: np.ndarray,
) -> int:
    """Use a whole report (all six elements, later than those before) of the only aircraft with its address.

    Parameters
    ----------
    t : float
        Time of validity, s.
    z, r : ndarray, shape (1, 6)
        North, east, down, velocity north, east, down; and the variances of the white part of their errors.
    x, p, last : ndarray, shape (1, 3, 4), (1, 3, 4, 4), (1,)
        The filter.
    floats, integers : ndarray, shape (N_FLOATS,), (N_INTEGERS,)
        What is remembered of the track; zero before the first report.
    phi, q : ndarray, shape (2, m, 4, 4)
        Transition tables.
    settings : ndarray, shape (N_SETTINGS,)
    slot, step_of, use, sigma_of, outcome, nis : ndarray
        Buffers: int (1,) of zero, int (1,), bool (1, 4), float (1,), int (1, 4), float (1, 4).

    Returns
    -------
    int
        `USED`, `NOT_NEW` or `NEEDS_MORE`.
    """
    step = round(t / settings[DT])
    time_sigma = settings[WHOLE_SECOND_SIGMA] if math.floor(t) == t else settings[TIME_SIGMA]
    if integers[STARTED] > 0:
        repeated = z[0, 0] == floats[LAST_NORTH] and z[0, 1] == floats[LAST_EAST]
        if repeated and not math.hypot(z[0, 3], z[0, 4]) < settings[HOVER_SPEED]:
            return NOT_NEW
    floats[LAST_NORTH], floats[LAST_EAST] = z[0, 0], z[0, 1]
    if integers[STARTED] == 0:
        reported = settings[START_REPORTED] > 0.0
        velocity = (
            z[0, 3] if reported else 0.0,
            z[0, 4] if reported else 0.0,
            settings[VELOCITY_SIGMA] if reported else settings[UNKNOWN_SIGMA],
        )
        restart(x[0], p[0], z[0], r[0], velocity, time_sigma, settings)
        last[0] = step
        integers[:] = 0
        integers[STARTED] = integers[ACCEPTED_COUNT] = 1
        integers[FIX_STEP] = step
        floats[T_POSITION], floats[FIX_NORTH], floats[FIX_EAST] = t, z[0, 0], z[0, 1]
        return USED
    step_of[0], sigma_of[0] = step, time_sigma
    use[0, 0] = use[0, 1] = use[0, 2] = True
    use[0, 3] = settings[USE_VELOCITY] > 0.0
    filter_reports(x, p, last, slot, step_of, phi, q, z, r, use, settings[GATE], sigma_of, outcome, nis)
    if outcome[0, 0] == ACCEPTED:
        integers[ACCEPTED_COUNT] += 1
        integers[FIX_STEP] = step
        integers[CONSECUTIVE] = 0
        floats[T_POSITION], floats[FIX_NORTH], floats[FIX_EAST] = t, z[0, 0], z[0, 1]
        if outcome[0, 1] == ACCEPTED:
            integers[VERTICAL_REJECTS] = 0
        elif outcome[0, 1] == REJECTED:
            integers[VERTICAL_REJECTS] += 1
            if integers[VERTICAL_REJECTS] >= settings[RESTART_REJECTS]:
                return NEEDS_MORE
        return USED
    integers[CONSECUTIVE] += 1
    if integers[ACCEPTED_COUNT] < settings[CONFIRM]:
        dt = (step - integers[FIX_STEP]) * settings[DT]
        velocity = velocity_between(
            dt, z[0, 0] - floats[FIX_NORTH], z[0, 1] - floats[FIX_EAST], r[0, 0], time_sigma, settings[SPEED_MAX]
        )
        if not math.isnan(velocity[0]):
            restart(x[0], p[0], z[0], r[0], velocity, time_sigma, settings)
            last[0] = step
            integers[ACCEPTED_COUNT] = 2
            integers[FIX_STEP] = step
            integers[CONSECUTIVE] = integers[REJECTS] = 0
            floats[T_POSITION], floats[FIX_NORTH], floats[FIX_EAST] = t, z[0, 0], z[0, 1]
            return USED
    # Two rejected positions are remembered; what a third one means is for the full tracker to say.
    horizon = step - round(settings[REJECT_MEMORY] / settings[DT])
    if integers[REJECTS] == 2 and integers[FIRST_REJECT] < horizon:
        integers[FIRST_REJECT] = integers[SECOND_REJECT]
        integers[REJECTS] = 1
    if integers[REJECTS] == 1 and integers[FIRST_REJECT] < horizon:
        integers[REJECTS] = 0
    if integers[REJECTS] == 2 or integers[CONSECUTIVE] >= settings[RESTART_REJECTS]:
        return NEEDS_MORE
    if integers[REJECTS] == 0:
        integers[FIRST_REJECT] = step
    else:
        integers[SECOND_REJECT] = step
    integers[REJECTS] += 1
    return USED


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    x, p = np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4))
    tables = np.zeros((2, 1, 4, 4))
    tables[:] = np.eye(4)
    z, r, one, settings = np.zeros((1, 6)), np.ones((1, 6)), np.zeros(1), np.ones(N_SETTINGS)
    index, codes, use = np.zeros(1, np.int64), np.zeros((1, 4), np.int64), np.ones((1, 4), np.bool_)
    start_axis(x[0, 0], p[0, 0], 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
    start_horizontal(x[0], p[0], z[0], r[0], 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
    velocity_between(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    take_report(
        0.5, z, r, x, p, index, np.zeros(N_FLOATS), np.zeros(N_INTEGERS, np.int64), tables, tables, settings,
        index, index, use, one, codes, np.zeros((1, 4)),
    )  # fmt: skip
