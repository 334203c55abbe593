"""Close passes of an intruder and the ownship, tracked by a ground radar: for tests of who is taken as the ownship.

Each pass has two aircraft at 50-500 m from the radar when they are nearest, each with a Kalman filter of constant
velocity in the plane that touches the sphere around the radar. Plots reach the filter of their own aircraft, or, with
`nearest`, that of the track that fits best, and then tracks may swap aircraft.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, whitened_square
from wideberth.tracking.motion_kernels import CONSTANT_VELOCITY, predict
from wideberth.tracking.ownship_kernels import (
    STATE_WIDTH,
    WORK_ROWS,
    OwnshipTest,
    count_inlier,
    identify,
    inside_plot_gate,
    inside_state_gate,
)
from wideberth.tracking.radar_kernels import directions, plot_covariance, to_plot, to_position, to_sensor
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

KINDS = (
    "crossing",
    "head-on",
    "overtaking",
    "formation for a while",
    "same altitude",
    "straight above or below",
    "formation throughout",
)
DT = 0.1
SCANS = 250
SIGMA = np.array([0.4, math.radians(1.0), math.radians(1.0)])
P_D = 0.8


@dataclass(frozen=True)
class Passes:
    """Truth (passes, scans, 2, 6) NED of ownship and intruder, telemetry (passes, scans, 6), draws, first scans."""

    kind: IntArray
    truth: FloatArray
    telemetry: FloatArray
    noise: FloatArray
    detected: NDArray[np.bool_]
    first: IntArray
    miss: FloatArray


def _across(rng: np.random.Generator, velocity: FloatArray, level: bool) -> FloatArray:
    """A unit vector at right angles to a relative velocity."""
    v = velocity / np.linalg.norm(velocity)
    side = np.array([-v[1], v[0], 0.0]) / max(math.hypot(v[0], v[1]), 1e-9)
    if level:
        return np.array(side * rng.choice([-1.0, 1.0]))
    up = np.cross(v, side)
    a = rng.uniform(0.0, 2.0 * math.pi)
    return np.array(math.cos(a) * side + math.sin(a) * up)


def make_passes(count: int, seed: int) -> Passes:
    """Make passes; kinds take turns. The intruder's track is born at any time up to three seconds after the pass."""
    rng = np.random.default_rng(seed)
    t = np.arange(SCANS) * DT
    kind = np.arange(count) % len(KINDS)
    truth, miss = np.empty((count, SCANS, 2, 6)), np.empty(count)
    first = np.zeros((count, 2), np.int64)
    for i in range(count):
        name = KINDS[kind[i]]
        t_pass = rng.uniform(8.0, 16.0)
        course, speed = rng.uniform(-math.pi, math.pi), rng.uniform(8.0, 20.0)
        own_velocity = np.array([speed * math.cos(course), speed * math.sin(course), rng.normal(0.0, 0.5)])
        distance, azimuth = rng.uniform(50.0, 500.0), rng.uniform(-math.pi, math.pi)
        elevation = rng.uniform(math.radians(5.0), math.radians(60.0))
        ground = distance * math.cos(elevation)
        place = np.array([ground * math.cos(azimuth), ground * math.sin(azimuth), -distance * math.sin(elevation)])
        truth[i, :, 0, :3] = place + (t[:, None] - t_pass) * own_velocity
        truth[i, :, 0, 3:] = own_velocity
        miss[i] = rng.uniform(5.0, 50.0)
        level = name != "straight above or below"
        turn, other_speed = {
            "crossing": (rng.uniform(0.5, 2.6) * rng.choice([-1, 1]), rng.uniform(8.0, 30.0)),
            "head-on": (math.pi + rng.normal(0.0, 0.1), rng.uniform(8.0, 30.0)),
            "overtaking": (rng.normal(0.0, 0.05), speed + rng.uniform(1.5, 6.0) * rng.choice([-1, 1])),
            "same altitude": (rng.uniform(-math.pi, math.pi), rng.uniform(8.0, 30.0)),
            "straight above or below": (rng.uniform(-math.pi, math.pi), rng.uniform(8.0, 30.0)),
        }.get(name, (rng.normal(0.0, 0.3), speed + rng.uniform(-4.0, 4.0)))
        velocity = np.array([other_speed * math.cos(course + turn), other_speed * math.sin(course + turn), 0.0])
        if name == "same altitude":
            velocity[2] = own_velocity[2]
        relative = velocity - own_velocity
        offset = miss[i] * (_across(rng, relative, True) if level else np.array([0.0, 0.0, rng.choice([-1.0, 1.0])]))
        if name in ("crossing", "head-on", "overtaking"):
            offset = miss[i] * _across(rng, relative, False)
        # Relative velocity over time: constant, or none while in formation.
        rates = np.tile(relative, (SCANS, 1))
        if name == "formation throughout":
            rates[:] = 0.0
        elif name == "formation for a while":
            half = rng.uniform(3.0, 6.0)
            leave = _across(rng, relative, True) * np.linalg.norm(relative)
            rates[np.abs(t - t_pass) <= half] = 0.0
            rates[t > t_pass + half] = leave
            # A change of speed takes about a second.
            kernel = np.hanning(13) / np.hanning(13).sum()
            padded = np.pad(rates, ((6, 6), (0, 0)), mode="edge")
            rates = np.stack([np.convolve(padded[:, a], kernel, mode="valid") for a in range(3)], axis=1)
        at_pass = round(t_pass / DT)
        moved = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * DT * (rates[1:] + rates[:-1]), axis=0)])
        truth[i, :, 1, :3] = truth[i, :, 0, :3] + offset + moved - moved[at_pass]
        truth[i, :, 1, 3:] = own_velocity + rates
        if rng.random() < 0.5:
            first[i, 1] = rng.integers(0, at_pass + 30)
    # Satellite navigation errs slowly: first-order Gauss-Markov, a minute long.
    sigma = np.array([1.2, 1.2, 2.5, 0.1, 0.1, 0.15])
    decay = np.exp(-DT / np.array([60.0] * 3 + [5.0] * 3))
    error = rng.normal(size=(count, 6)) * sigma
    telemetry = np.empty((count, SCANS, 6))
    for k in range(SCANS):
        telemetry[:, k] = truth[:, k, 0] + error
        error = decay * error + rng.normal(size=(count, 6)) * sigma * np.sqrt(1.0 - decay**2)
    noise = rng.normal(size=(count, SCANS, 2, 3)) * SIGMA
    return Passes(kind, truth, telemetry, noise, rng.random((count, SCANS, 2)) < P_D, first, miss)


class PrintedRule(NamedTuple):
    """Gates of the printed rule: in range and angles, and in states; length of the window; threshold."""

    plot_gate: FloatArray
    state_gate: FloatArray
    window: int
    threshold: float


@jit_uncounted
def level(attitude: FloatArray) -> None:
    for i in range(3):
        for j in range(3):
            attitude[i, j] = 1.0 if i == j else 0.0


@jit_uncounted
def misfit(
    p: FloatArray, x: FloatArray, position: FloatArray, plot: FloatArray, sigma: FloatArray, work: FloatArray
) -> float:
    """Normalised square of a plot's distance from a track; `work` is (14, 6)."""
    rows, factor, d = work[0:3], work[3:9], work[9]
    level(work[10:13])
    plot_covariance(work[10:13], plot[0], plot[1], plot[2], sigma, rows)
    for i in range(3):
        d[i] = position[i] - x[i]
        for j in range(3):
            rows[i, j] += p[i, j]
    cholesky(rows, 3, factor)
    return whitened_square(factor, 3, d, work[13])


@jit_uncounted
def correct(
    x: FloatArray, p: FloatArray, position: FloatArray, attitude: FloatArray, sigma: FloatArray, work: FloatArray
) -> None:
    """Update a track in the plane that touches the sphere in the direction where it is expected."""
    seen, expected, rows, h = work[0], work[1], work[2:5], work[5:8]
    innovation, variance = work[8], work[9]
    to_sensor(work[13], attitude, x, seen)
    to_plot(seen, expected)
    directions(attitude, expected[1], expected[2], rows)
    for a in range(3):
        innovation[a] = 0.0
        for b in range(3):
            h[a, b] = rows[a, b]
            h[a, 3 + b] = 0.0
            innovation[a] += rows[a, b] * (position[b] - x[b])
    variance[0] = sigma[0] ** 2
    variance[1] = (expected[0] * math.cos(expected[2]) * sigma[1]) ** 2
    variance[2] = (expected[0] * sigma[2]) ** 2
    update(6, 3, x, p, h, innovation, variance, work[10:12])


@jit
def fly(
    truth: FloatArray,
    telemetry: FloatArray,
    telemetry_covariance: FloatArray,
    noise: FloatArray,
    detected: NDArray[np.bool_],
    first: IntArray,
    q: FloatArray,
    sigma: FloatArray,
    nearest: bool,
    test: OwnshipTest,
    printed: PrintedRule,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Track both aircraft of one pass, and ask at each scan which track is the ownship.

    Returns the track that the test flags at each scan (0 the ownship's, 1 the intruder's, -1 none, -2 the ownship has
    no track yet), bits of what the printed rule flags (1 the ownship's track and 2 the intruder's with the gate in
    range and angles, 4 and 8 with that in states), and the normalised squares of the tracks' errors.
    """
    scans = len(truth)
    flagged, rule, nees = np.full(scans, -2), np.zeros(scans, np.int64), np.full((scans, 2), np.nan)
    x, p, alive = np.zeros((2, 6)), np.zeros((2, 6, 6)), np.zeros(2, np.bool_)
    states, work, scratch = np.zeros((2, STATE_WIDTH)), np.zeros((WORK_ROWS, 6)), np.zeros((14, 6))
    f, g = np.zeros((6, 6)), np.zeros((6, 6))
    sensor, attitude = np.zeros(3), np.eye(3)
    rings, counts = np.zeros((4, printed.window), np.uint8), np.zeros((4, 2), np.int64)
    plots, positions, seen, square = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3), np.zeros((3, 3))
    cost, source = np.zeros((2, 2)), np.zeros(2, np.int64)
    for k in range(scans):
        for i in range(2):
            if alive[i]:
                predict(CONSTANT_VELOCITY, 0.1, q, x[i], p[i], f, g)
            to_sensor(sensor, attitude, truth[k, i], seen)
            to_plot(seen, plots[i])
            for a in range(3):
                plots[i, a] += noise[k, i, a]
            to_position(sensor, attitude, plots[i, 0], plots[i, 1], plots[i, 2], positions[i])
            source[i] = i if detected[k, i] else -1
        if nearest and alive[0] and alive[1]:
            for i in range(2):
                for j in range(2):
                    cost[i, j] = misfit(p[i], x[i], positions[j], plots[j], sigma, scratch)
            if detected[k, 0] and detected[k, 1]:
                if cost[0, 1] + cost[1, 0] < cost[0, 0] + cost[1, 1]:
                    source[0], source[1] = 1, 0
            elif detected[k, 0] or detected[k, 1]:
                plot = 0 if detected[k, 0] else 1
                taker = 0 if cost[0, plot] < cost[1, plot] else 1
                source[0], source[1] = -1, -1
                source[taker] = plot
        for i in range(2):
            if source[i] < 0 or k < first[i]:
                continue
            if alive[i]:
                scratch[13] = 0.0
                correct(x[i], p[i], positions[source[i]], attitude, sigma, scratch)
                continue
            alive[i] = True
            plot_covariance(attitude, plots[i, 0], plots[i, 1], plots[i, 2], sigma, p[i])
            for a in range(3):
                x[i, a] = positions[i, a]
                p[i, 3 + a, 3 + a] = 20.0**2 if a < 2 else 5.0**2
        for i in range(2):
            if alive[i]:
                for a in range(6):
                    scratch[0, a] = x[i, a] - truth[k, i, a]
                cholesky(p[i], 6, f)
                nees[k, i] = whitened_square(f, 6, scratch[0], scratch[1])
                by_plot = inside_plot_gate(x[i], telemetry[k], sensor, attitude, printed.plot_gate, square)
                by_state = inside_state_gate(x[i], telemetry[k], printed.state_gate)
                if count_inlier(by_plot, rings[i], counts[i]) > printed.threshold:
                    rule[k] += 1 << i
                if count_inlier(by_state, rings[2 + i], counts[2 + i]) > printed.threshold:
                    rule[k] += 4 << i
        # The tracker's rows are packed: the tracks that live, in order.
        start, end = 0 if alive[0] else 1, 2 if alive[1] else 1
        chosen = identify(
            end - start, 0.1, x[start:], p[start:], telemetry[k], telemetry_covariance, test, states[start:], work
        )
        if alive[0] or chosen >= 0:
            flagged[k] = start + chosen if chosen >= 0 else -1
    return flagged, rule, nees
