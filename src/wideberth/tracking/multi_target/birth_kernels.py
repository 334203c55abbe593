"""New tracks from plots that no track explains: pairs of plots that one aircraft could have made, and their consensus.

Every pair of a new plot with one of the last few scans is a line in space and time. It is fitted to the best plot of
every scan of a longer window and scored: the logarithm of how much likelier an aircraft is than false plots, hits and
misses together.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.fit_kernels import (
    FitScratch,
    begin_fit,
    fit_plot,
    gate_square,
    look_back,
    make_fit_scratch,
    refit,
)
from wideberth.tracking.multi_target.sighting_kernels import detection_at, log_density, visibility
from wideberth.tracking.multi_target.window_kernels import TABLE_NODES, Window, make_window
from wideberth.tracking.radar_kernels import to_position

FloatArray = NDArray[np.float64]

LEAST_SHARE = 1e-3
"""Probability of detection, and of a miss, that a score reckons with at least."""

HOPELESS = 16.0
"""A score this far below its best has gone past the aircraft's first plot."""

REACH_SIGMAS = 4.0


@jit_uncounted
def reachable(window: Window, k: int, m: int, k0: int, m0: int, tau: float, speed_max: float, gate: float) -> bool:
    """Return whether an aircraft could have made both plots: by distance, line of sight, and range rate."""
    reach = speed_max * tau
    va, vb = window.variance[k, m], window.variance[k0, m0]
    za, zb = window.z[k, m], window.z[k0, m0]
    n = window.place[k, m, 0] - window.place[k0, m0, 0]
    e = window.place[k, m, 1] - window.place[k0, m0, 1]
    d = window.place[k, m, 2] - window.place[k0, m0, 2]
    u = window.sight[k, m]
    along = n * u[0] + e * u[1] + d * u[2]
    angle = za[0] * za[0] * max(va[1], 0.0 if math.isnan(va[2]) else va[2])
    # Errors across the sight bend away from the line: second order, as far as both plots may be off.
    radial = gate * math.sqrt(va[0] + vb[0]) + 2.0 * gate * angle / max(za[0], 1.0)
    if abs(along) > reach + radial:
        return False
    if math.isnan(za[2]) or math.isnan(zb[2]):
        return True
    distance = math.sqrt(n * n + e * e + d * d)
    if distance > reach + radial + gate * math.sqrt(2.0 * angle):
        return False
    if za[3] == za[3]:
        # It says the speed along the sight, beside the sensor's own; the rest may come from the motion across.
        speed = za[3]
        for a in range(3):
            speed += u[a] * window.velocity[k, a]
        bend = reach * reach / max(za[0], 1.0)
        if abs(along - speed * tau) > radial + bend + gate * math.sqrt(va[3]) * tau:
            return False
    return True


@jit_uncounted
def consensus(
    window: Window,
    k0: int,
    m0: int,
    k1: int,
    m1: int,
    speed_sigma: float,
    speed_max: float,
    gate: float,
    s: FitScratch,
) -> tuple[float, int]:
    """Fit a pair of plots to the whole window, in `s.x`, `s.p` and `s.chosen`.

    Parameters
    ----------
    window : Window
    k0, m0, k1, m1 : int
        The new plot and the older one: scan and place in it.
    speed_sigma : float
        Prior spread of each velocity component, m/s.
    speed_max : float
        m/s.
    gate : float
        Largest normalised distance squared of a plot.
    s : FitScratch

    Returns
    -------
    score : float
        Log of the likelihood ratio of an aircraft against false plots, from the oldest plot used on; without the prior.
    hits : int
        Plots used; 0 where the pair does not fit.
    """
    scans = window.cursor[1]
    size = window.t.shape[0]
    begin_fit(window, k0, m0, speed_sigma, s)
    t0 = window.t[k0]
    for a in range(size):
        s.chosen[a] = -1
    s.chosen[k0] = m0
    tau = window.t[k1] - t0
    look_back(window, k1, tau, s)
    nis, log_likelihood = fit_plot(window, k1, m1, tau, s.x, s.p, s)
    if nis > gate:
        return 0.0, 0
    s.chosen[k1] = m1
    pair_score = log_likelihood - log_density(
        window.density[k1], s.look, window.field_of_view[k1], speed_max, window.z[k1, m1]
    )
    score, best, hits, best_hits = 0.0, -1e9, 1, 0
    k = k0
    for _ in range(scans - 1):
        k = k - 1 if k > 0 else size - 1
        tau = window.t[k] - t0
        look_back(window, k, tau, s)
        seen = detection_at(window.ranges[k], window.probabilities[k], s.look[0])
        seen *= visibility(s.look, s.spread, window.field_of_view[k], window.ranges[k, TABLE_NODES - 1])
        if k == k1:
            score += pair_score + math.log(max(seen, LEAST_SHARE))
            hits += 1
            if score > best:
                best, best_hits = score, hits
            continue
        nearest, least = -1, gate
        for m in range(window.filled[k]):
            if window.used[k, m]:
                continue
            limit = 4.0 * math.sqrt(window.variance[k, m, 0] + s.spread[0]) + s.spread[1] / s.look[0]
            if abs(window.z[k, m, 0] - s.look[0]) > limit:
                continue
            square = gate_square(window, k, m, s)
            if square < least:
                nearest, least = m, square
        taken = False
        if nearest >= 0:
            for i in range(6):
                s.other_x[i] = s.x[i]
                for j in range(6):
                    s.other_p[i, j] = s.p[i, j]
            nis, log_likelihood = fit_plot(window, k, nearest, tau, s.other_x, s.other_p, s)
            gain = (
                log_likelihood
                + math.log(max(seen, LEAST_SHARE))
                - log_density(window.density[k], s.look, window.field_of_view[k], speed_max, window.z[k, nearest])
            )
            if nis < gate and gain > math.log(max(1.0 - seen, LEAST_SHARE)):
                taken = True
                for i in range(6):
                    s.x[i] = s.other_x[i]
                    for j in range(6):
                        s.p[i, j] = s.other_p[i, j]
                s.chosen[k] = nearest
                score += gain
                hits += 1
        if taken:
            if score > best:
                best, best_hits = score, hits
        else:
            score += math.log(max(1.0 - seen, LEAST_SHARE))
            if score < best - HOPELESS:
                break
    return best, best_hits


@jit_uncounted
def birth(
    window: Window,
    m0: int,
    pair_scans: int,
    speed_sigma: float,
    speed_max: float,
    gate: float,
    prior: float,
    least_hits: int,
    least_score: float,
    budget: int,
    s: FitScratch,
) -> tuple[float, int, int]:
    """Look for the best new track that ends at plot `m0` of the newest scan; leave it in `s.x` and `s.p`.

    Parameters
    ----------
    window : Window
    m0 : int
    pair_scans : int
        How many scans back the second plot of a pair may be.
    speed_sigma, speed_max : float
        m/s.
    gate : float
        Largest normalised distance squared.
    prior : float
        Log of the odds that a plot that no track explains is an aircraft's.
    least_hits : int
    least_score : float
        Log of the odds that a new track must have.
    budget : int
        Pairs that may be fitted at most.
    s : FitScratch

    Returns
    -------
    score : float
        Log of the odds that it is an aircraft.
    hits : int
        0 where there is none; else its plots are marked as used.
    tried : int
        Pairs that were fitted.
    """
    k0, scans = window.cursor[0], window.cursor[1]
    size = window.t.shape[0]
    best, best_hits, tried = least_score, 0, 0
    k = k0
    for _ in range(min(pair_scans, scans - 1)):
        k = k - 1 if k > 0 else size - 1
        tau = window.t[k0] - window.t[k]
        for m in range(window.filled[k]):
            if tau < 1e-6 or window.used[k, m] or not reachable(window, k0, m0, k, m, tau, speed_max, REACH_SIGMAS):
                continue
            if tried >= budget:
                break
            tried += 1
            score, hits = consensus(window, k0, m0, k, m, speed_sigma, speed_max, gate, s)
            if hits >= least_hits and score + prior >= best:
                best, best_hits = score + prior, hits
                for a in range(size):
                    s.best[a] = s.chosen[a]
                for i in range(6):
                    s.best_x[i] = s.x[i]
    if best_hits:
        for a in range(size):
            s.chosen[a] = s.best[a]
        for i in range(6):
            s.x[i] = s.best_x[i]
        refit(window, k0, speed_sigma, s)
        for a in range(size):
            if s.chosen[a] >= 0:
                window.used[a, s.chosen[a]] = True
    return best, best_hits, tried


def warmup() -> None:
    """Compile what Python calls."""
    window, scratch = make_window(4, 2), make_fit_scratch(4)
    window.attitude[:] = np.eye(3)
    window.field_of_view[:] = (math.pi, math.pi / 2)
    window.ranges[:], window.probabilities[:] = 1000.0, 0.9
    window.variance[:] = 1e-4
    window.z[:, :, 0], window.z[:, :, 3] = 100.0, math.nan
    for k in range(4):
        window.t[k], window.filled[k], window.cursor[0], window.cursor[1] = 0.1 * k, 1, k, k + 1
        window.sight[k, 0] = 1.0, 0.0, 0.0
        to_position(window.position[k], window.attitude[k], 100.0, 0.0, 0.0, window.place[k, 0])
    birth(window, 0, 3, 30.0, 100.0, 16.0, 0.0, 3, 0.0, 100, scratch)
