"""Naive twins of the conflict kernels: textbook definitions, evaluated at many times or drawn many times."""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def inside(
    s: FloatArray, v: FloatArray, volume: tuple[float, float, float, float], miss_filter: bool
) -> NDArray[np.bool_]:
    """Return whether relative states (..., 3) are inside WCV_TAUMOD (dthr, zthr, tthr, tcoa), by its definition."""
    dthr, zthr, tthr, tcoa = volume
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        sv = s[..., 0] * v[..., 0] + s[..., 1] * v[..., 1]
        r = np.hypot(s[..., 0], s[..., 1])
        tau = (dthr**2 - r**2) / sv
        t_cpa = -sv / (v[..., 0] ** 2 + v[..., 1] ** 2)
        miss = np.hypot(s[..., 0] + v[..., 0] * t_cpa, s[..., 1] + v[..., 1] * t_cpa)
        t_coa = -s[..., 2] / v[..., 2]
        by_tau = (sv < 0) & (tau <= tthr)
        if miss_filter:
            by_tau &= miss <= dthr
        horizontal = (r <= dthr) | by_tau
        vertical = (np.abs(s[..., 2]) <= zthr) | ((t_coa >= 0) & (t_coa <= tcoa))
    return np.asarray(horizontal & vertical)


def interval(
    s: FloatArray,
    v: FloatArray,
    volume: tuple[float, float, float, float],
    lookahead: float,
    miss_filter: bool,
    n: int = 4001,
) -> tuple[float, float]:
    """Return first and last sampled time inside the volume, refined by bisection; NaN where no sample is inside."""

    def at(t: float) -> bool:
        return bool(inside(s + v * t, v, volume, miss_filter))

    def edge(outside: float, within: float) -> float:
        for _ in range(60):
            middle = 0.5 * (outside + within)
            outside, within = (outside, middle) if at(middle) else (middle, within)
        return within

    times = np.linspace(0.0, lookahead, n)
    hits = np.nonzero(inside(s + v * times[:, None], np.broadcast_to(v, (n, 3)), volume, miss_filter))[0]
    if hits.size == 0:
        return math.nan, math.nan
    first, last = int(hits[0]), int(hits[-1])
    t_in = 0.0 if first == 0 else edge(times[first - 1], times[first])
    t_out = lookahead if last == n - 1 else edge(times[last + 1], times[last])
    return t_in, t_out


def line_1(
    s: FloatArray, v: FloatArray, d_th: float, h_th: float, tau_th: float, h_c: float, times: FloatArray
) -> NDArray[np.bool_]:
    """Return whether line 1 of algorithms 1 and 2 holds at each time, as the paper words it."""
    holds = np.zeros(times.size, bool)
    for k, t in enumerate(times):
        p = s + v * t
        converging = p[0] * v[0] + p[1] * v[1] < 0
        t_cpa = -(p[0] * v[0] + p[1] * v[1]) / (v[0] ** 2 + v[1] ** 2) if converging else math.inf
        horizontal = math.hypot(p[0], p[1]) < d_th or (converging and t_cpa <= tau_th)
        sinking_in = p[2] * v[2] < 0
        t_hc = (abs(p[2]) - h_c) / abs(v[2]) if sinking_in else math.inf
        vertical = abs(p[2]) < h_th or (sinking_in and t_hc <= tau_th)
        holds[k] = horizontal and vertical
    return holds


def drawn_conflict_probability(
    s: FloatArray,
    v: FloatArray,
    covariance: FloatArray,
    separation: float,
    half_height: float,
    n: int,
    rng: np.random.Generator,
) -> float:
    """Return the share of drawn relative positions whose straight flight passes within the separation."""
    p = rng.multivariate_normal(s, covariance, size=n)
    t = -(p[:, :2] @ v[:2]) / (v[:2] @ v[:2])
    miss = np.hypot(p[:, 0] + v[0] * t, p[:, 1] + v[1] * t)
    t_mean = -(s[:2] @ v[:2]) / (v[:2] @ v[:2])
    return float(np.mean((miss <= separation) & (np.abs(p[:, 2] + v[2] * t_mean) <= half_height)))
