"""Sensor and tracker of the fast tier: what aircraft broadcast, what is received of it, and the tracks.

The same kernels as `sensors.adsb.simulated` and `tracking.adsb_kalman` run, without what stands around them.
"""

import math
from typing import NamedTuple

import numpy as np

from wideberth._jit import jit, jit_uncounted
from wideberth.sensors.adsb.kernels import (
    ALTITUDE_SIGMA,
    NORMALS,
    POSITION_SIGMA,
    RECEIVED,
    START_NUMBERS,
    UNIFORMS,
    broadcast_report,
    draw_broadcast,
    draw_start,
)
from wideberth.tracking.life_kernels import (
    ACCEPTED_COUNT,
    CONFIRM,
    N_FLOATS,
    N_INTEGERS,
    NEEDS_MORE,
    STARTED,
    T_POSITION,
    take_report,
)
from wideberth.tracking.output_kernels import output_motion, output_track

# Settings of sensor and tracker, SI.
INTERVAL, JITTER, STATIONARY, DT, LATENCY, BOUND, COAST_AFTER, LOST_AFTER = 0, 1, 2, 3, 4, 5, 6, 7
TENTATIVE_LOST_AFTER = 8
CLIMB_REGIME, CLIMB_FRACTION_SIGMA, CLIMB_RESOLUTION_VARIANCE = 9, 10, 11
N_SENSING = 12


class SensingSettings(NamedTuple):
    """Sensor and tracker.

    Attributes
    ----------
    errors : ndarray, shape (sensors.adsb.kernels.PARAMETER_COUNT,)
    numbers : ndarray, shape (N_SENSING,)
    variances : ndarray, shape (1, 6)
        Of reports in level flight: the white part.
    phi, q : ndarray, shape (2, m, 4, 4)
    bias : ndarray, shape (2,)
        Variance of the slowly varying horizontal and altitude error, m2.
    track : ndarray, shape (tracking.life_kernels.N_SETTINGS,)
    """

    errors: np.ndarray
    numbers: np.ndarray
    variances: np.ndarray
    phi: np.ndarray
    q: np.ndarray
    bias: np.ndarray
    track: np.ndarray


class SensingState(NamedTuple):
    """All that changes; copied as a whole where a run forks. Aircraft along the first axis."""

    base: np.ndarray
    due: np.ndarray
    sent: np.ndarray
    error: np.ndarray
    error_time: np.ndarray
    altitude_bias: np.ndarray
    fault: np.ndarray
    normals: np.ndarray
    uniforms: np.ndarray
    x: np.ndarray
    p: np.ndarray
    last: np.ndarray
    floats: np.ndarray
    integers: np.ndarray
    heard: np.ndarray
    order: np.ndarray
    counts: np.ndarray  # tracks started
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    covariance: np.ndarray


class Buffers(NamedTuple):
    """Small arrays that kernels write into."""

    slot: np.ndarray
    scratch: np.ndarray
    z: np.ndarray
    r: np.ndarray
    step: np.ndarray
    use: np.ndarray
    sigma: np.ndarray
    outcome: np.ndarray
    nis: np.ndarray
    state: np.ndarray
    cov: np.ndarray
    start: np.ndarray
    p0: np.ndarray
    p1: np.ndarray


@jit
def new_sensing(m: int) -> SensingState:
    """Return the state of sensor and tracker for `m` aircraft, to be begun."""
    return SensingState(
        np.zeros(m), np.zeros(m), np.zeros(m, np.int64), np.zeros((m, 2)), np.zeros(m), np.zeros(m),
        np.zeros((m, 3)), np.zeros((m, NORMALS)), np.zeros((m, UNIFORMS + 1)), np.zeros((m, 3, 4)),
        np.zeros((m, 3, 4, 4)), np.zeros(m, np.int64), np.zeros((m, N_FLOATS)), np.zeros((m, N_INTEGERS), np.int64),
        np.zeros(m), np.zeros(m, np.int64), np.zeros(1, np.int64), np.zeros((m, 3)), np.zeros((m, 3)),
        np.zeros((m, 3)), np.zeros((m, 9, 9)),
    )  # fmt: skip


@jit
def new_buffers(m: int) -> Buffers:
    """Return the buffers."""
    return Buffers(
        np.zeros(1, np.int64), np.zeros((4, 3)), np.zeros((1, 6)), np.zeros((1, 6)),
        np.zeros(1, np.int64), np.zeros((1, 4), np.bool_), np.zeros(1), np.zeros((1, 4), np.int64), np.zeros((1, 4)),
        np.zeros((3, 4)), np.zeros((3, 4, 4)), np.zeros(START_NUMBERS), np.zeros((m, 3)), np.zeros((m, 3)),
    )  # fmt: skip


@jit
def copy_sensing(source: SensingState, target: SensingState) -> None:
    """Copy the state of sensor and tracker."""
    target.base[:] = source.base
    target.due[:] = source.due
    target.sent[:] = source.sent
    target.error[:] = source.error
    target.error_time[:] = source.error_time
    target.altitude_bias[:] = source.altitude_bias
    target.fault[:] = source.fault
    target.normals[:] = source.normals
    target.uniforms[:] = source.uniforms
    target.x[:] = source.x
    target.p[:] = source.p
    target.last[:] = source.last
    target.floats[:] = source.floats
    target.integers[:] = source.integers
    target.heard[:] = source.heard
    target.order[:] = source.order
    target.counts[:] = source.counts
    target.position[:] = source.position
    target.velocity[:] = source.velocity
    target.acceleration[:] = source.acceleration
    target.covariance[:] = source.covariance


@jit_uncounted
def schedule(
    seed: int,
    intruders: int,
    encounter: int,
    i: int,
    numbers: np.ndarray,
    base: np.ndarray,
    sent: np.ndarray,
    normals: np.ndarray,
    uniforms: np.ndarray,
    due: np.ndarray,
) -> None:
    """Draw the noise of an aircraft's next broadcast, and with it its time; the arrays are those of `SensingState`."""
    draw_broadcast(seed, intruders, encounter, i, sent[i], normals[i], uniforms[i])
    jitter = (2.0 * uniforms[i, UNIFORMS] - 1.0) * numbers[JITTER]
    due[i] = base[i] + sent[i] * numbers[INTERVAL] + jitter


@jit_uncounted
def begin_sensing(
    seed: int,
    intruders: int,
    encounter: int,
    settings: SensingSettings,
    state: SensingState,
    buffers: Buffers,
) -> None:
    """Begin at time 0, having listened for one interval; no aircraft is tracked yet."""
    errors, interval = settings.errors, settings.numbers[INTERVAL]
    state.fault[:] = 0.0
    state.fault[:, 0] = -math.inf
    state.integers[:] = 0
    state.floats[:] = 0.0
    state.sent[:] = 0
    state.counts[0] = 0
    state.covariance[:] = 0.0
    state.error[:] = 0.0
    for i in range(intruders):
        draw_start(seed, intruders, encounter, i, buffers.start)
        phase = buffers.start[0] * interval
        if settings.numbers[STATIONARY] > 0.0:
            state.error[i, 0] = errors[POSITION_SIGMA] * buffers.start[1]
            state.error[i, 1] = errors[POSITION_SIGMA] * buffers.start[2]
        state.altitude_bias[i] = errors[ALTITUDE_SIGMA] * buffers.start[3]
        state.base[i] = phase + math.ceil((-interval - phase) / interval) * interval
        state.error_time[i] = state.base[i] - settings.numbers[JITTER]
        state.heard[i] = math.inf
        schedule(
            seed, intruders, encounter, i, settings.numbers, state.base, state.sent, state.normals, state.uniforms,
            state.due,
        )  # fmt: skip


@jit_uncounted
def note_heard(i: int, t: float, state: SensingState) -> None:
    """Put an aircraft into the order in which they were first heard."""
    state.heard[i] = t
    n = state.counts[0]
    while n > 0 and state.heard[state.order[n - 1]] > t:
        state.order[n] = state.order[n - 1]
        n -= 1
    state.order[n] = i
    state.counts[0] += 1


@jit_uncounted
def track_output(t: float, i: int, settings: SensingSettings, state: SensingState, buffers: Buffers) -> float:
    """Write a track's output at time `t`; return the filter's own horizontal standard deviation, m."""
    dt = settings.numbers[DT]
    now = round(t / dt)
    return output_track(
        state.x[i], state.p[i], state.last[i], now, t - now * dt, dt, settings.phi, settings.q, settings.bias,
        settings.numbers[LATENCY], buffers.state, buffers.cov,
        state.position[i], state.velocity[i], state.acceleration[i], state.covariance[i],
    )  # fmt: skip


@jit_uncounted
def is_lost(t: float, spread: float, accepted: int, t_position: float, numbers: np.ndarray, track: np.ndarray) -> bool:
    """Return whether the tracker gives a track up at time `t`."""
    longest = numbers[LOST_AFTER] if accepted >= track[CONFIRM] else numbers[TENTATIVE_LOST_AFTER]
    return not (spread <= numbers[BOUND] and t - t_position <= longest)


@jit_uncounted
def hear(
    seed: int,
    intruders: int,
    encounter: int,
    i: int,
    t: float,
    t_before: float,
    own: np.ndarray,
    start: np.ndarray,
    flight: np.ndarray,
    settings: SensingSettings,
    state: SensingState,
    buffers: Buffers,
) -> bool:
    """Take in the broadcasts of one aircraft up to time `t`; False where its track needs the full tracker.

    The other parameters are those of `sense_and_track`.
    """
    numbers, errors, variances = settings.numbers, settings.errors, settings.variances
    base, due, sent, normals, uniforms = state.base, state.due, state.sent, state.normals, state.uniforms
    error, error_time, bias, fault = state.error, state.error_time, state.altitude_bias, state.fault
    p0, p1, z, r, scratch = buffers.p0, buffers.p1, buffers.z, buffers.r, buffers.scratch
    first = math.isnan(t_before)
    t0 = t - numbers[INTERVAL] if first else t_before
    for k in range(3):
        p0[i, k] = math.nan if first else start[i, k] + t_before * flight[i, k]
        p1[i, k] = start[i, k] + t * flight[i, k]
    one = slice(i, i + 1)
    while due[i] <= t:
        t_report = due[i]
        flags = broadcast_report(
            i, t_report, t0, t, p0, flight, p1, flight, own, error, error_time, bias, fault,
            normals[i], uniforms[i], errors, scratch, z[0],
        )  # fmt: skip
        sent[i] += 1
        schedule(seed, intruders, encounter, i, numbers, base, sent, normals, uniforms, due)
        if flags & RECEIVED == 0:
            continue
        for k in range(6):
            r[0, k] = variances[0, k]
        rate = abs(z[0, 5])
        if rate > numbers[CLIMB_REGIME]:
            r[0, 5] = (numbers[CLIMB_FRACTION_SIGMA] * rate) ** 2 + numbers[CLIMB_RESOLUTION_VARIANCE]
        if state.integers[i, STARTED] == 0:
            note_heard(i, t_report, state)
        elif t_report - state.floats[i, T_POSITION] > numbers[COAST_AFTER]:
            spread = track_output(t_report, i, settings, state, buffers)
            accepted, t_position = state.integers[i, ACCEPTED_COUNT], state.floats[i, T_POSITION]
            if is_lost(t_report, spread, accepted, t_position, numbers, settings.track):
                return False
        became = take_report(
            t_report, z, r, state.x[one], state.p[one], state.last[one], state.floats[i],
            state.integers[i], settings.phi, settings.q, settings.track, buffers.slot, buffers.step, buffers.use,
            buffers.sigma, buffers.outcome, buffers.nis,
        )  # fmt: skip
        if became == NEEDS_MORE:
            return False
    return True


@jit_uncounted
def hear_all(
    seed: int,
    intruders: int,
    encounter: int,
    t: float,
    t_before: float,
    own: np.ndarray,
    start: np.ndarray,
    flight: np.ndarray,
    needed: np.ndarray,
    settings: SensingSettings,
    state: SensingState,
    buffers: Buffers,
) -> bool:
    """Take in the broadcasts of all aircraft up to time `t`; False where a track needs the full tracker.

    Parameters
    ----------
    t, t_before : float
        Now and the time of the step before, s; NaN before the first.
    own : ndarray, shape (3,)
        Position of the receiver.
    start, flight : ndarray, shape (intruders, 3)
        Positions at time 0 and velocities of the aircraft, which fly straight.
    needed : ndarray of bool, shape (intruders,)
        The others' broadcasts wait: they are taken in, just the same, once they are needed.
    """
    for i in range(intruders):
        if (
            needed[i]
            and state.due[i] <= t
            and not hear(seed, intruders, encounter, i, t, t_before, own, start, flight, settings, state, buffers)
        ):
            return False
    return True


@jit_uncounted
def any_due(t: float, due: np.ndarray, needed: np.ndarray) -> bool:
    """Return whether any aircraft that is needed broadcasts up to time `t`."""
    found = False
    for i in range(due.shape[0]):
        found = found or (needed[i] and due[i] <= t)
    return found


@jit_uncounted
def move_tracks(t: float, needed: np.ndarray, settings: SensingSettings, state: SensingState, buffers: Buffers) -> bool:
    """Write position, velocity and their covariance of the tracks needed at time `t`; False where one is lost."""
    dt = settings.numbers[DT]
    now = math.floor(t / dt + 0.5)
    residual = t - now * dt
    for i in range(needed.shape[0]):
        if not needed[i] or state.integers[i, STARTED] == 0:
            continue
        steps = now - state.last[i]
        if 1 <= steps <= settings.phi.shape[1]:
            spread = output_motion(
                i, state.x, state.p, steps, residual, settings.phi, settings.q, settings.bias,
                settings.numbers[LATENCY], state.position, state.velocity, state.covariance,
            )  # fmt: skip
        else:
            spread = output_track(
                state.x[i], state.p[i], state.last[i], now, residual, dt, settings.phi, settings.q, settings.bias,
                settings.numbers[LATENCY], buffers.state, buffers.cov,
                state.position[i], state.velocity[i], state.acceleration[i], state.covariance[i],
            )  # fmt: skip
        accepted, t_position = state.integers[i, ACCEPTED_COUNT], state.floats[i, T_POSITION]
        if is_lost(t, spread, accepted, t_position, settings.numbers, settings.track):
            return False
    return True


def warmup() -> None:
    """Compile what is shared at the start; `encounter_kernels.fly_encounters` compiles the rest with itself."""
    new_sensing(1)
    new_buffers(1)
