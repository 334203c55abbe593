"""New tracks of R-RANSAC: hypotheses through random subsets, the best of them smoothed (thesis algorithm 1)."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.gauss_newton_kernels import CONVERGED, fit_turning
from wideberth.tracking.matrix_kernels import cholesky, solve_cholesky
from wideberth.tracking.motion_kernels import CONSTANT_ACCELERATION, CONSTANT_VELOCITY, TURNING, state_count
from wideberth.tracking.radar_kernels import directions
from wideberth.tracking.rransac.consensus_kernels import (
    count_consensus,
    draw_subset,
    fit_acceleration,
    fit_velocity,
    gather_candidates,
    slot_back,
)
from wideberth.tracking.rransac.filter_kernels import (
    hold_altitude,
    predict_track,
    retrace_track,
    tangent_variances,
    update_track,
)
from wideberth.tracking.rransac.state_kernels import (
    FILLED,
    FIT_TURNING,
    FIT_VELOCITY,
    FITS,
    FITS_FAILED,
    HEAD,
    PSEUDO,
    SCANS,
    Clock,
    Settings,
    Window,
    Work,
    small_settings,
)
from wideberth.tracking.rransac.turning_kernels import start_of_fit, to_turning

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_KNOWN = 1e12  # information of a vertical state that is known, 1/m2


@jit_uncounted
def fit_model(s: Settings) -> int:
    """Return the motion model that RANSAC fits."""
    if s.fit == FIT_TURNING:
        return TURNING
    return CONSTANT_VELOCITY if s.fit == FIT_VELOCITY else CONSTANT_ACCELERATION


@jit_uncounted
def subset_covariance(
    s: Settings, window: Window, model: int, subset: IntArray, size: int, work: Work, p: FloatArray
) -> bool:
    """Write the covariance of the state through a minimum subset of positions (thesis (3.42)); False if singular."""
    n = state_count(model)
    axes, variance, row = work.rows[0:3, 0:3], work.rows[3, 0:3], work.rows[4]
    information, factor = work.square, work.f
    for i in range(n):
        for j in range(n):
            information[i, j] = 0.0
        if s.dimensions == 2 and i % 3 == 2:
            information[i, i] = _KNOWN
    for member in range(size):
        k, i = subset[member, 0], subset[member, 1]
        dt = window.t[k] - window.t[subset[0, 0]]
        if s.update == PSEUDO:
            for a in range(3):
                variance[a] = s.fixed_variance[a]
                for b in range(3):
                    axes[a, b] = 1.0 if a == b else 0.0
        else:
            z = window.z[k, i]
            directions(window.attitude[k], z[1], z[2], axes)
            tangent_variances(z[0], z[2], window.sigma[k], variance)
        for a in range(3):
            for j in range(n):
                power = j // 3
                row[j] = axes[a, j % 3] * (1.0 if power == 0 else (dt if power == 1 else 0.5 * dt * dt))
            for j in range(n):
                for m in range(j + 1):
                    information[j, m] += row[j] * row[m] / variance[a]
    for j in range(n):
        row[j] = 1.0 / math.sqrt(information[j, j])
    for j in range(n):
        for m in range(j + 1):
            information[j, m] *= row[j] * row[m]
    if not cholesky(information, n, factor):
        return False
    column = work.rows[5]
    for j in range(n):
        for i in range(n):
            column[i] = row[j] if i == j else 0.0
        solve_cholesky(factor, n, column)
        for i in range(n):
            p[i, j] = column[i] * row[i]
    return True


@jit_uncounted
def _fit(s: Settings, window: Window, size: int, counts: IntArray, work: Work) -> bool:
    """Write the ending state of a subset to `work.x`, for the turning model also the covariance to `work.p`."""
    if s.fit == FIT_VELOCITY:
        fit_velocity(window, work.subset, work.x)
        return True
    if s.fit != FIT_TURNING:
        fit_acceleration(window, work.subset, work.x)
        return True
    for m in range(size):
        k, i = work.subset[m, 0], work.subset[m, 1]
        work.fit_times[m] = window.t[k] - window.t[work.subset[0, 0]]
        for a in range(3):
            work.fit_plots[m, a] = window.z[k, i, a]
            work.fit_sensor[m, a] = window.sensor[k, a]
            for b in range(3):
                work.fit_attitude[m, a, b] = window.attitude[k, a, b]
    start_of_fit(window, work.subset, work.start)
    status, _ = fit_turning(
        work.fit_plots,
        work.fit_times,
        work.fit_sensor,
        work.fit_attitude,
        window.sigma[work.subset[0, 0]],
        work.start,
        s.gn_limits,
        s.gn_prior,
        s.gn_tolerance,
        s.gn_iterations,
        True,
        work.x,
        work.p,
        work.fit,
    )
    counts[FITS] += 1
    if status != CONVERGED:
        counts[FITS_FAILED] += 1
        return False
    return True


@jit_uncounted
def _smooth(s: Settings, window: Window, clock: Clock, model: int, work: Work) -> bool:
    """Run a filter over the consensus set from its first plot on; `work.best_x`, `work.best_p` are changed.

    Thesis (3.47): the ending state is taken back, then the filter runs forwards. It starts at the first plot of the
    consensus set, as nothing changes before it. `inflation` widens the covariance that it starts from, whose plots it
    uses a second time.
    """
    head, filled = clock.integers[HEAD], clock.integers[FILLED]
    x, p = work.best_x, work.best_p
    first = -1
    for back in range(filled - 1, -1, -1):
        if work.best_hit[slot_back(head, back, s.window)] >= 0:
            first = back
            break
    if first < 0:
        return False
    k = slot_back(head, first, s.window)
    retrace_track(model, window.t[k] - window.t[head], x, p, work)
    n = state_count(model)
    for i in range(n):
        for j in range(n):
            p[i, j] *= s.inflation
    if s.dimensions == 2:
        hold_altitude(s, model, x, p)
    t = window.t[k]
    for back in range(first, -1, -1):
        k = slot_back(head, back, s.window)
        if window.t[k] > t:
            predict_track(s, model, window.t[k] - t, x, p, work)
            t = window.t[k]
        i = work.best_hit[k]
        if i >= 0:
            update_track(
                s,
                model,
                x,
                p,
                window.z[k, i],
                window.position[k, i],
                window.sensor[k],
                window.attitude[k],
                window.sigma[k],
                work,
            )
    sound = True
    for i in range(n):
        sound = sound and math.isfinite(x[i]) and p[i, i] >= 0.0
    return sound


@jit_uncounted
def find_track(s: Settings, window: Window, clock: Clock, plot: int, counts: IntArray, work: Work) -> int:
    """Look for a new track with a plot of the last scan (thesis algorithm 1).

    Parameters
    ----------
    s : Settings
    window : Window
    clock : Clock
    plot : int
        Of the last scan.
    counts : ndarray of int64
    work : Work
        `best_x`, `best_p` and `best_hit` hold state, covariance and consensus set.

    Returns
    -------
    int
        Scans in the consensus set; 0 where no hypothesis has enough.
    """
    head = clock.integers[HEAD]
    model = fit_model(s)
    n, size = state_count(model), 2 if model == CONSTANT_VELOCITY else 3
    candidates = gather_candidates(s, window, clock, head, plot, work)
    # No set can be larger than the candidates and the new plot.
    if candidates + 1 < max(size, s.consensus):
        return 0
    work.subset[0, 0], work.subset[0, 1] = head, plot
    best = 0
    for trial in range(s.iterations if size == 3 else min(s.iterations, candidates)):
        if not draw_subset(s, window, clock.integers[SCANS], plot, trial, size, candidates, work):
            continue
        if not _fit(s, window, size, counts, work):
            continue
        if s.speed_max > 0.0 and model != TURNING:
            v = work.x
            if v[3] * v[3] + v[4] * v[4] + v[5] * v[5] > 4.0 * s.speed_max * s.speed_max:
                continue
        total = count_consensus(s, window, clock, model, work.x, plot, candidates, work)
        if total > best:
            best = total
            for k in range(s.window):
                work.best_hit[k] = work.hit[k]
            for i in range(n):
                work.best_x[i] = work.x[i]
                for j in range(n):
                    work.best_p[i, j] = work.p[i, j]
            for m in range(3):
                work.best_subset[m, 0], work.best_subset[m, 1] = work.subset[m, 0], work.subset[m, 1]
        if total >= s.enough:
            break
    if best < max(s.consensus, size):
        return 0
    if model != TURNING and not subset_covariance(s, window, model, work.best_subset, size, work, work.best_p):
        return 0
    if not _smooth(s, window, clock, model, work):
        return 0
    if s.model == TURNING and model != TURNING:
        to_turning(s, model, work)
    return best


def warmup() -> None:
    """Compile a part: the rest is called by `scan_kernels` alone, and compiled with it."""
    fit_model(small_settings())
