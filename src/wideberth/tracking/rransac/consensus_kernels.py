"""RANSAC inside R-RANSAC: which earlier plots may stand with a new one, and which of them a hypothesis explains."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.sensors.noise_kernels import fill_uniforms
from wideberth.tracking.motion_kernels import CONSTANT_VELOCITY, TURNING, propagate
from wideberth.tracking.radar_kernels import to_plot, to_sensor
from wideberth.tracking.rransac.filter_kernels import inside_box
from wideberth.tracking.rransac.state_kernels import FILLED, HEAD, Clock, Settings, Window, Work

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

REACH_SIGMAS = 3.0
_SAME_TIME_S = 1e-6


@jit_uncounted
def slot_back(head: int, back: int, n: int) -> int:
    """Return the slot of the scan that is `back` scans before the last."""
    return (head - back + n) % n


@jit_uncounted
def gather_candidates(s: Settings, window: Window, clock: Clock, slot: int, plot: int, work: Work) -> int:
    """Write the earlier plots that one of the last scan may be of one aircraft with; return how many.

    All of the window as printed; with `unassociated` only those that no track has had, and with a `speed_max` only
    those that an aircraft could have come from.
    """
    head, filled = clock.integers[HEAD], clock.integers[FILLED]
    here = window.position[slot, plot]
    distance = window.z[slot, plot, 0]
    across = distance * max(window.sigma[slot, 1], window.sigma[slot, 2])
    noise = REACH_SIGMAS * (window.sigma[slot, 0] + math.sqrt(2.0) * across)
    n = 0
    for back in range(1, filled):
        k = slot_back(head, back, s.window)
        dt = window.t[slot] - window.t[k]
        if dt < _SAME_TIME_S:
            continue
        reach = noise + s.speed_max * dt
        for i in range(window.n_plots[k]):
            if s.unassociated and window.used[k, i]:
                continue
            if s.speed_max > 0.0:
                there = window.position[k, i]
                square = (here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + (here[2] - there[2]) ** 2
                if square > reach * reach:
                    continue
            work.candidates[n, 0] = k
            work.candidates[n, 1] = i
            n += 1
    return n


@jit_uncounted
def _apart(s: Settings, window: Window, a: int, i: int, b: int, j: int) -> bool:
    """Return whether two plots come from two times, and one aircraft could have been at both."""
    dt = abs(window.t[a] - window.t[b])
    if dt < _SAME_TIME_S:
        return False
    if s.speed_max == 0.0:
        return True
    here, there = window.position[a, i], window.position[b, j]
    across = max(window.z[a, i, 0], window.z[b, j, 0]) * max(window.sigma[a, 1], window.sigma[a, 2])
    reach = REACH_SIGMAS * (window.sigma[a, 0] + math.sqrt(2.0) * across) + s.speed_max * dt
    square = (here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + (here[2] - there[2]) ** 2
    return bool(square <= reach * reach)


@jit_uncounted
def draw_subset(
    s: Settings, window: Window, scan: int, plot: int, trial: int, size: int, candidates: int, work: Work
) -> bool:
    """Write a random minimum subset: the new plot first, then others from other scans; False where the draw fails.

    Counter-based: the same for the same seed, scan, plot and trial, whatever was drawn before. Pairs are taken in turn
    where there are no more of them than trials.
    """
    if size == 2 and candidates <= s.iterations:
        first = trial
    else:
        fill_uniforms(s.seed, 1, scan, plot, trial, work.uniform)
        first = min(int(work.uniform[0] * candidates), candidates - 1)
    work.subset[1, 0], work.subset[1, 1] = work.candidates[first, 0], work.candidates[first, 1]
    if size == 2:
        return True
    for attempt in range(1, 4):
        second = min(int(work.uniform[attempt] * candidates), candidates - 1)
        k, i = work.candidates[second, 0], work.candidates[second, 1]
        if _apart(s, window, work.subset[1, 0], work.subset[1, 1], k, i):
            work.subset[2, 0], work.subset[2, 1] = k, i
            return True
    return False


@jit_uncounted
def fit_velocity(window: Window, subset: IntArray, out: FloatArray) -> None:
    """Write position and velocity (6) at the time of the first of two plots from both."""
    a, b = window.position[subset[0, 0], subset[0, 1]], window.position[subset[1, 0], subset[1, 1]]
    dt = window.t[subset[1, 0]] - window.t[subset[0, 0]]
    for i in range(3):
        out[i] = a[i]
        out[3 + i] = (b[i] - a[i]) / dt


@jit_uncounted
def fit_acceleration(window: Window, subset: IntArray, out: FloatArray) -> None:
    """Write position, velocity and acceleration (9) at the time of the first of three plots from all.

    The ending state of thesis 3.2.4 ("final improvement"): the parabola through three positions in closed form.
    """
    zero = window.t[subset[0, 0]]
    u, v = window.t[subset[1, 0]] - zero, window.t[subset[2, 0]] - zero
    a = window.position[subset[0, 0], subset[0, 1]]
    b = window.position[subset[1, 0], subset[1, 1]]
    c = window.position[subset[2, 0], subset[2, 1]]
    for i in range(3):
        p, q = (b[i] - a[i]) / u, (c[i] - a[i]) / v
        out[i] = a[i]
        out[6 + i] = 2.0 * (p - q) / (u - v)
        out[3 + i] = p - 0.5 * u * out[6 + i]


@jit_uncounted
def count_consensus(
    s: Settings, window: Window, clock: Clock, model: int, x: FloatArray, plot: int, candidates: int, work: Work
) -> int:
    """Write the plot of each scan that an ending state explains to `work.hit`, -1 for none; return how many there are.

    Thesis (3.45): the state is taken backwards in time, and a plot is an inlier where each element is within its
    threshold of what the radar should have seen. Of several inliers in a scan the nearest counts, so that the inlier
    ratio stays at most one.

    Parameters
    ----------
    s : Settings
    window : Window
    clock : Clock
    model : int
    x : ndarray, shape (6,) or (9,)
        State at the last scan.
    plot : int
        The new plot in the last scan, which the state was made from.
    candidates : int
        Filled rows of `work.candidates`, scan by scan.
    work : Work

    Returns
    -------
    int
    """
    head = clock.integers[HEAD]
    state, seen, expected = work.rows[0], work.rows[1, 0:3], work.rows[2, 0:3]
    for k in range(s.window):
        work.hit[k] = -1
    work.hit[head] = plot
    n_states = 9 if model != CONSTANT_VELOCITY else 6
    for i in range(n_states):
        state[i] = x[i]
    total, slot, before = 1, head, window.t[head]
    best, angles_known, distance, reach = math.inf, False, 0.0, 0.0
    for c in range(candidates):
        k, i = work.candidates[c, 0], work.candidates[c, 1]
        if k != slot:
            slot = k
            if model == TURNING:
                propagate(model, window.t[k] - before, state, state)
                before = window.t[k]
            else:
                propagate(model, window.t[k] - before, x, state)
            to_sensor(window.sensor[k], window.attitude[k], state, seen)
            distance = math.sqrt(seen[0] * seen[0] + seen[1] * seen[1] + seen[2] * seen[2])
            reach = s.birth_box[0] * window.sigma[k, 0]
            best, angles_known = math.inf, False
        if not abs(window.z[k, i, 0] - distance) < reach:
            continue
        if not angles_known:
            to_plot(seen, expected)
            angles_known = True
        inside, square = inside_box(s, s.birth_box, window.sigma[k], window.z[k, i], expected)
        if inside and square < best:
            best = square
            total += work.hit[k] < 0
            work.hit[k] = i
    return total


def warmup() -> None:
    """Compile a part: the rest is called by `scan_kernels` alone, and compiled with it."""
    slot_back(2, 3, 4)
