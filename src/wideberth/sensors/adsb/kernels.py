"""Kernels of the ADS-B error model: what a broadcast says of a true state. All noise is handed in.

ADS-B paper, section "Error Characterization".
"""

import math

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.sensors.noise_kernels import (
    NORMALS as NORMALS_STREAM,
)
from wideberth.sensors.noise_kernels import (
    PER_BLOCK,
    START,
    aircraft_consumer,
    fill_normals,
    fill_uniforms,
)
from wideberth.sensors.noise_kernels import (
    UNIFORMS as UNIFORMS_STREAM,
)

# Indices into the parameters
POSITION_SIGMA = 0
CORRELATION_TIME = 1
VELOCITY_SIGMA = 2
ALTITUDE_SIGMA = 3
ALTITUDE_IS_BIAS = 4
CLIMB_SIGMA = 5
CLIMB_REGIME = 6
CLIMB_FRACTION = 7
POSITION_STEP = 8
ALTITUDE_STEP = 9
VELOCITY_STEP = 10
CLIMB_STEP = 11
LATENCY = 12
UNCOMPENSATED = 13
LOSS = 14
RANGE = 15
SIL_PROBABILITY = 16
SDA_PROBABILITY = 17
FAULT_DURATION = 18
NIC_BOUND = 19
GROSS_MAXIMUM = 20
SWAP_PROBABILITY = 21
PARAMETER_COUNT = 22

# Flags of a message
RECEIVED, LOST, OUT_OF_RANGE, GROSS, SWAPPED = 1, 2, 4, 8, 16

NORMALS = 6
"""Standard normal numbers a broadcast uses: position north, east, velocity north, east, altitude, climb rate."""

UNIFORMS = 6
"""Uniform numbers a broadcast uses: loss, swap, SIL, SDA, radius and direction of a gross error."""

START_NUMBERS = 4
"""Numbers an aircraft uses at the start: phase (uniform), position error north, east, altitude error (normal)."""

_NORMAL_BLOCKS = (NORMALS + PER_BLOCK - 1) // PER_BLOCK
_UNIFORM_BLOCKS = (UNIFORMS + 1 + PER_BLOCK - 1) // PER_BLOCK


@jit_uncounted
def draw_start(seed: int, intruders: int, encounter: int, aircraft: int, out: np.ndarray) -> None:
    """Write what an aircraft of an encounter uses at the start (START_NUMBERS,)."""
    fill_uniforms(seed, intruders, encounter, aircraft_consumer(aircraft, START), 0, out[:1])
    fill_normals(seed, intruders, encounter, aircraft_consumer(aircraft, START), 1, out[1:])


@jit_uncounted
def draw_broadcast(
    seed: int, intruders: int, encounter: int, aircraft: int, broadcast: int, normals: np.ndarray, uniforms: np.ndarray
) -> None:
    """Write the numbers of one broadcast, counted from 0: `normals` (NORMALS,), `uniforms` (UNIFORMS + 1,).

    The last uniform number is the jitter of its time.
    """
    consumer = aircraft_consumer(aircraft, NORMALS_STREAM)
    fill_normals(seed, intruders, encounter, consumer, broadcast * _NORMAL_BLOCKS, normals)
    consumer = aircraft_consumer(aircraft, UNIFORMS_STREAM)
    fill_uniforms(seed, intruders, encounter, consumer, broadcast * _UNIFORM_BLOCKS, uniforms)


@jit_uncounted
def quantise(value: float, step: float) -> float:
    """Return the multiple of `step` nearest to the value; the value itself for step 0."""
    result: float = value if step <= 0.0 else math.floor(value / step + 0.5) * step
    return result


@jit_uncounted
def gauss_markov(value: float, dt: float, correlation_time: float, sigma: float, normal: float) -> float:
    """Return a first-order Gauss-Markov process a time `dt` later: exact at any dt (ADS-B paper, sigma_u).

    Parameters
    ----------
    value : float
    dt, correlation_time : float
        s.
    sigma : float
        Stationary standard deviation.
    normal : float
        Standard normal number.
    """
    decay = math.exp(-dt / correlation_time)
    result: float = decay * value + sigma * math.sqrt(1.0 - decay * decay) * normal
    return result


@jit_uncounted
def climb_rate_error_sigma(climb_rate: float, level_sigma: float, regime: float, fraction: float) -> float:
    """Return the standard deviation of the climb rate's error: constant in the regime, beyond it a fraction, m/s."""
    result: float = level_sigma if abs(climb_rate) <= regime else fraction * abs(climb_rate)
    return result


@jit_uncounted
def report_state(
    position: np.ndarray,
    velocity: np.ndarray,
    error: np.ndarray,
    altitude_bias: float,
    gross: np.ndarray,
    swapped: bool,
    normals: np.ndarray,
    params: np.ndarray,
    z: np.ndarray,
) -> None:
    """Write what a message says: the true state with latency, errors and the resolution of the encoding.

    Parameters
    ----------
    position : ndarray, shape (3,)
        True position at the time that the message's position is of, local NED, m.
    velocity : ndarray, shape (3,)
        True velocity at the time that the message's velocity is of, m/s.
    error : ndarray, shape (2,)
        Slowly varying position error, north and east, m.
    altitude_bias : float
        Constant altitude error, m (used where the altitude error is a bias).
    gross : ndarray, shape (2,)
        Gross error, north and east, m.
    swapped : bool
        Whether north and east velocity are sent in reverse order.
    normals : ndarray, shape (NORMALS,)
    params : ndarray, shape (PARAMETER_COUNT,)
    z : ndarray, shape (6,)
        Written: north, east, down, velocity north, east, down.
    """
    for axis in range(2):
        z[axis] = quantise(position[axis] + error[axis] + gross[axis], params[POSITION_STEP])
        z[3 + axis] = quantise(velocity[axis] + params[VELOCITY_SIGMA] * normals[2 + axis], params[VELOCITY_STEP])
    if swapped:
        z[3], z[4] = z[4], z[3]
    altitude_error = params[ALTITUDE_SIGMA] * normals[4]
    if params[ALTITUDE_IS_BIAS] > 0.0:
        altitude_error = altitude_bias
    z[2] = quantise(position[2] + altitude_error, params[ALTITUDE_STEP])
    sigma = climb_rate_error_sigma(velocity[2], params[CLIMB_SIGMA], params[CLIMB_REGIME], params[CLIMB_FRACTION])
    z[5] = quantise(velocity[2] + sigma * normals[5], params[CLIMB_STEP])


@jit_uncounted
def truth_at(
    t: float,
    t0: float,
    t1: float,
    p0: np.ndarray,
    v0: np.ndarray,
    p1: np.ndarray,
    v1: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
) -> None:
    """Write the true position and velocity at a time from the states before and after it.

    Cubic Hermite between the two, straight on with the velocity there outside; straight back from the second where the
    first is NaN.

    Parameters
    ----------
    t, t0, t1 : float
        s, t0 < t1.
    p0, v0, p1, v1 : ndarray, shape (3,)
    position, velocity : ndarray, shape (3,)
        Written.
    """
    h = t1 - t0
    s = (t - t0) / h
    known = not math.isnan(p0[0])
    for i in range(3):
        if not known or s >= 1.0:
            position[i] = p1[i] + v1[i] * (t - t1)
            velocity[i] = v1[i]
        elif s <= 0.0:
            position[i] = p0[i] + v0[i] * (t - t0)
            velocity[i] = v0[i]
        else:
            d = p1[i] - p0[i]
            c2 = 3.0 * d - h * (2.0 * v0[i] + v1[i])
            c3 = h * (v0[i] + v1[i]) - 2.0 * d
            position[i] = p0[i] + s * (h * v0[i] + s * (c2 + s * c3))
            velocity[i] = v0[i] + s * (2.0 * c2 + s * 3.0 * c3) / h


@jit_uncounted
def broadcast_report(
    i: int,
    t: float,
    t0: float,
    t1: float,
    p0: np.ndarray,
    v0: np.ndarray,
    p1: np.ndarray,
    v1: np.ndarray,
    own: np.ndarray,
    error: np.ndarray,
    error_time: np.ndarray,
    altitude_bias: np.ndarray,
    fault: np.ndarray,
    normals: np.ndarray,
    uniforms: np.ndarray,
    params: np.ndarray,
    scratch: np.ndarray,
    z: np.ndarray,
) -> int:
    """Write what a broadcast of aircraft `i` at time `t` says, and return its flags.

    Parameters
    ----------
    i : int
    t : float
    normals, uniforms : ndarray, shape (NORMALS,), (UNIFORMS,) or longer
        Of this broadcast.
    scratch : ndarray, shape (4, 3)
        Buffer.
    z : ndarray, shape (6,)
        Written.
    t0, t1, p0, v0, p1, v1, own, error, error_time, altitude_bias, fault, params
        As for `broadcast_reports`.
    """
    position, velocity, sensed, gross = scratch[0], scratch[1], scratch[2], scratch[3]
    dt = t - error_time[i]
    for axis in range(2):
        error[i, axis] = gauss_markov(
            error[i, axis], dt, params[CORRELATION_TIME], params[POSITION_SIGMA], normals[axis]
        )
    error_time[i] = t
    u = uniforms
    flag = 0
    radius = params[NIC_BOUND] * (1.0 + (params[GROSS_MAXIMUM] - 1.0) * u[4])
    gross[0], gross[1] = 0.0, 0.0
    if u[3] < params[SDA_PROBABILITY] and t >= fault[i, 0]:
        north, east = radius * math.cos(2.0 * math.pi * u[5]), radius * math.sin(2.0 * math.pi * u[5])
        fault[i, 0], fault[i, 1], fault[i, 2] = t + params[FAULT_DURATION], north, east
    if t < fault[i, 0]:
        gross[0], gross[1] = fault[i, 1], fault[i, 2]
        flag = GROSS
    elif u[2] < params[SIL_PROBABILITY]:
        gross[0], gross[1] = radius * math.cos(2.0 * math.pi * u[5]), radius * math.sin(2.0 * math.pi * u[5])
        flag = GROSS
    swapped = u[1] < params[SWAP_PROBABILITY]
    if swapped:
        flag += SWAPPED
    truth_at(t, t0, t1, p0[i], v0[i], p1[i], v1[i], position, velocity)
    distance = math.sqrt((position[0] - own[0]) ** 2 + (position[1] - own[1]) ** 2 + (position[2] - own[2]) ** 2)
    if distance > params[RANGE]:
        flag += OUT_OF_RANGE
    elif u[0] < params[LOSS]:
        flag += LOST
    else:
        flag += RECEIVED
    truth_at(t - params[UNCOMPENSATED], t0, t1, p0[i], v0[i], p1[i], v1[i], position, velocity)
    truth_at(t - params[LATENCY], t0, t1, p0[i], v0[i], p1[i], v1[i], sensed, velocity)
    position[2] = sensed[2]  # only the horizontal position is extrapolated by the transmitter
    report_state(position, velocity, error[i], altitude_bias[i], gross, swapped, normals, params, z)
    return flag


@jit
def broadcast_reports(
    index: np.ndarray,
    times: np.ndarray,
    t0: float,
    t1: float,
    p0: np.ndarray,
    v0: np.ndarray,
    p1: np.ndarray,
    v1: np.ndarray,
    own: np.ndarray,
    error: np.ndarray,
    error_time: np.ndarray,
    altitude_bias: np.ndarray,
    fault: np.ndarray,
    normals: np.ndarray,
    uniforms: np.ndarray,
    params: np.ndarray,
    z: np.ndarray,
    flags: np.ndarray,
) -> None:
    """Write what the broadcasts of several aircraft, one each, say, and whether they are received.

    Parameters
    ----------
    index, times : ndarray, shape (k,)
        Aircraft and time of each broadcast.
    t0, t1 : float
        Times of the true states before and after.
    p0, v0, p1, v1 : ndarray, shape (n, 3)
        True states; p0 NaN where unknown.
    own : ndarray, shape (3,)
        Position of the receiver.
    error : ndarray, shape (n, 2)
        Slowly varying position errors; moved on.
    error_time : ndarray, shape (n,)
        Their times; moved on.
    altitude_bias : ndarray, shape (n,)
    fault : ndarray, shape (n, 3)
        End of each aircraft's system fault and the error that it sends, north and east; moved on.
    normals : ndarray, shape (k, NORMALS)
    uniforms : ndarray, shape (k, UNIFORMS)
    params : ndarray, shape (PARAMETER_COUNT,)
    z : ndarray, shape (k, 6)
        Written.
    flags : ndarray of int, shape (k,)
        Written: sum of `RECEIVED` or `LOST` or `OUT_OF_RANGE`, and `GROSS`, `SWAPPED`.
    """
    scratch = np.empty((4, 3))
    for k in range(index.shape[0]):
        flags[k] = broadcast_report(
            index[k], times[k], t0, t1, p0, v0, p1, v1, own, error, error_time, altitude_bias, fault,
            normals[k], uniforms[k], params, scratch, z[k],
        )  # fmt: skip


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    zero, three, params, z = np.zeros((1, 3)), np.zeros(3), np.ones(PARAMETER_COUNT), np.empty((1, 6))
    normals, uniforms, error = np.zeros((1, NORMALS)), np.full((1, UNIFORMS), 0.5), np.zeros((1, 2))
    draw_start(1, 1, 1, 0, np.empty(START_NUMBERS))
    draw_broadcast(1, 1, 1, 0, 0, normals[0], np.empty(UNIFORMS + 1))
    quantise(1.0, 1.0)
    gauss_markov(0.0, 1.0, 1.0, 1.0, 0.0)
    climb_rate_error_sigma(1.0, 1.0, 1.0, 1.0)
    report_state(three, three, error[0], 0.0, error[0], False, normals[0], params, z[0])
    truth_at(0.5, 0.0, 1.0, three, three, three, three, np.empty(3), np.empty(3))
    one, index = np.zeros(1), np.zeros(1, np.int64)
    broadcast_reports(
        index, one, 0.0, 1.0, zero, zero, zero, zero, three, error, one, one, zero, normals, uniforms, params, z, index
    )
