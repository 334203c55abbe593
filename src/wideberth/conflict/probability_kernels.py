"""Probabilities that a normally distributed relative position lies where a conflict follows.

The conflicts of a time of straight flight are a stadium: the disc swept along the relative velocity. With w across the
velocity and u along it, its probability is one integral over w of normal probabilities of u. Local NED, m, m/s, s.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.conflict.cylinder_kernels import leg
from wideberth.conflict.detection_kernels import band_probability, miss_direction, relative_covariance
from wideberth.conflict.kernels import horizontal_cpa

FloatArray = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_PANELS = 24
_FAR = 8.5  # sigmas; less than 1e-16 lies beyond


@jit_uncounted
def interval_probability(low: float, high: float, mean: float, sigma: float) -> float:
    """Return the probability that a normal value lies in [low, high]."""
    return band_probability(0.5 * (high - low), mean - 0.5 * (low + high), sigma)


@jit
def stadium_probability(
    mean_w: float,
    mean_u: float,
    var_w: float,
    var_u: float,
    cov_wu: float,
    radius: float,
    back: float,
    ahead: float,
) -> float:
    """Return the probability that a point is in the disc at a time while it moves along u from -`back` to `ahead`.

    Parameters
    ----------
    mean_w, mean_u, var_w, var_u, cov_wu : float
        Of the point, across and along the motion, from the centre of the disc.
    radius : float
    back, ahead : float
        How far it has come and will go; both 0: a disc. Not negative.
    """
    sigma_w = math.sqrt(max(var_w, 0.0))
    if sigma_w < 1e-12 * radius:
        if abs(mean_w) > radius:
            return 0.0
        chord = math.sqrt(radius * radius - mean_w * mean_w)
        return interval_probability(-chord - ahead, chord + back, mean_u, math.sqrt(max(var_u, 0.0)))
    slope = cov_wu / var_w
    sigma_u = math.sqrt(max(var_u - slope * cov_wu, 0.0))
    low, high = max(-radius, mean_w - _FAR * sigma_w), min(radius, mean_w + _FAR * sigma_w)
    if low >= high:
        return 0.0
    # Along u all or none of it may be certain, at every w: then there is nothing to integrate.
    a, b = mean_u + slope * (low - mean_w), mean_u + slope * (high - mean_w)
    first, last = min(a, b), max(a, b)
    if first > radius + back + _FAR * sigma_u or last < -radius - ahead - _FAR * sigma_u:
        return 0.0
    chord = math.sqrt(max(radius * radius - max(low * low, high * high), 0.0))
    if last < chord + back - _FAR * sigma_u and first > -chord - ahead + _FAR * sigma_u:
        return interval_probability(low, high, mean_w, sigma_w)
    # By the angle, as the chord has an upright tangent at the ends.
    begin, end = math.asin(low / radius), math.asin(high / radius)
    half = 0.5 * (end - begin) / _PANELS
    total = 0.0
    for k in range(_PANELS):
        middle = begin + (2 * k + 1) * half
        for j in range(_NODES.shape[0]):
            angle = middle + half * _NODES[j]
            w, chord = radius * math.sin(angle), radius * math.cos(angle)
            z = (w - mean_w) / sigma_w
            density = math.exp(-0.5 * z * z) / (sigma_w * math.sqrt(2.0 * math.pi))
            inside = interval_probability(-chord - ahead, chord + back, mean_u + slope * (w - mean_w), sigma_u)
            total += _WEIGHTS[j] * half * chord * density * inside
    return min(total, 1.0)


@jit_uncounted
def disc_probability(x: float, y: float, cxx: float, cyy: float, cxy: float, radius: float) -> float:
    """Return the probability that a point with this mean and covariance is within the disc around the origin."""
    # Across the narrow axis of the ellipse, where the other one is the smoother.
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    c, s = math.cos(angle), math.sin(angle)
    wide = c * c * cxx + 2.0 * c * s * cxy + s * s * cyy
    narrow = s * s * cxx - 2.0 * c * s * cxy + c * c * cyy
    return stadium_probability(c * y - s * x, c * x + s * y, narrow, wide, 0.0, radius, 0.0, 0.0)


@jit_uncounted
def passing_probability(s: FloatArray, v: FloatArray, c: FloatArray, radius: float, half_height: float) -> float:
    """Return the probability of one pair that its separation is lost; see `probability.conflict_probability`."""
    t_cpa, _ = horizontal_cpa(s[0], s[1], v[0], v[1])
    t = max(t_cpa, 0.0)
    if v[0] == 0.0 and v[1] == 0.0:
        probability = disc_probability(s[0], s[1], c[0, 0], c[1, 1], 0.5 * (c[0, 1] + c[1, 0]), radius)
        t = max(-s[2] / v[2], 0.0) if v[2] != 0.0 else 0.0
    else:
        ex, ey = miss_direction(s[0], s[1], v[0], v[1], t)
        mean = ex * (s[0] + v[0] * t) + ey * (s[1] + v[1] * t)
        variance = ex * ex * c[0, 0] + ex * ey * (c[0, 1] + c[1, 0]) + ey * ey * c[1, 1]
        probability = band_probability(radius, mean, math.sqrt(max(variance, 0.0)))
    if half_height < math.inf:
        probability *= band_probability(half_height, s[2] + v[2] * t, math.sqrt(max(c[2, 2], 0.0)))
    return probability


@jit_uncounted
def passing_probabilities(
    s: FloatArray, v: FloatArray, c: FloatArray, radius: float, half_height: float, out: FloatArray
) -> None:
    """Fill `out` (n) with `passing_probability`; `s`, `v` are (n, 3), `c` is (n, 3, 3)."""
    for i in range(out.shape[0]):
        out[i] = passing_probability(s[i], v[i], c[i], radius, half_height)


@jit_uncounted
def leg_probability(
    s: FloatArray,
    v: FloatArray,
    covariance: FloatArray,
    zero: FloatArray,
    start: float,
    duration: float,
    radius: float,
    half_height: float,
) -> float:
    """Return the probability of a conflict in a time of straight flight.

    Parameters
    ----------
    s, v : ndarray, shape (3,)
        Mean relative position at its beginning, and relative velocity.
    covariance : ndarray, shape (6, 6)
        Of the relative position and velocity now.
    zero : ndarray, shape (6, 6)
        Zeros.
    start, duration : float
        When it begins, from now, and how long it is; finite.
    radius, half_height : float
    """
    speed = math.hypot(v[0], v[1])
    if speed > 0.0:
        t = min(max(-(s[0] * v[0] + s[1] * v[1]) / (speed * speed), 0.0), duration)
    else:
        t = min(max(-s[2] / v[2], 0.0), duration) if v[2] != 0.0 else 0.0
    # The spread at the closest point stands for that of the whole leg.
    later = start + t
    cxx = relative_covariance(zero, covariance, 0, 0, 0.0, later)
    cyy = relative_covariance(zero, covariance, 1, 1, 0.0, later)
    cxy = 0.5 * (
        relative_covariance(zero, covariance, 0, 1, 0.0, later)
        + relative_covariance(zero, covariance, 1, 0, 0.0, later)
    )
    x, y, z = s[0] + v[0] * t, s[1] + v[1] * t, s[2] + v[2] * t
    t_in, t_out = -t, duration - t
    if speed > 0.0:
        ux, uy = v[0] / speed, v[1] / speed
        across = ux * y - uy * x
        probability = stadium_probability(
            across,
            ux * x + uy * y,
            uy * uy * cxx - 2.0 * ux * uy * cxy + ux * ux * cyy,
            ux * ux * cxx + 2.0 * ux * uy * cxy + uy * uy * cyy,
            ux * uy * (cyy - cxx) + (ux * ux - uy * uy) * cxy,
            radius,
            speed * t,
            speed * (duration - t),
        )
        # The height counts while the mean intruder crosses the circle.
        chord = math.sqrt(max(radius * radius - across * across, 0.0)) / speed
        t_in, t_out = max(t_in, -chord), min(t_out, chord)
    else:
        probability = disc_probability(x, y, cxx, cyy, cxy, radius)
    sigma = math.sqrt(max(relative_covariance(zero, covariance, 2, 2, 0.0, later), 0.0))
    lowest, highest = min(v[2] * t_in, v[2] * t_out), max(v[2] * t_in, v[2] * t_out)
    return probability * interval_probability(-half_height - highest, half_height - lowest, z, sigma)


@jit
def path_probabilities(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    p: FloatArray,
    v: FloatArray,
    covariance: FloatArray,
    lookahead: float,
    radius: float,
    half_height: float,
    out: FloatArray,
) -> None:
    """Fill `out` (n) with the probability of a conflict on each segment until the look-ahead (finite).

    Other arguments as for `cylinder_kernels.path_intervals` and `leg_probability`.
    """
    zero, s, u = np.zeros((6, 6)), np.empty(3), np.empty(3)
    start = 0.0
    for i in range(waypoints.shape[0]):
        out[i] = 0.0
        if start > lookahead:
            continue
        a = own if i == 0 else waypoints[i - 1]
        duration, vx, vy, vz = leg(a, waypoints[i], speeds[i])
        u[0], u[1], u[2] = v[0] - vx, v[1] - vy, v[2] - vz
        for k in range(3):
            s[k] = p[k] + v[k] * start - a[k]
        out[i] = leg_probability(s, u, covariance, zero, start, min(duration, lookahead - start), radius, half_height)
        start += duration


@jit
def largest_path_probabilities(
    own: FloatArray,
    speeds: FloatArray,
    waypoints: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    covariances: FloatArray,
    lookahead: float,
    radius: float,
    half_height: float,
    out: FloatArray,
) -> None:
    """Fill `out` (k) with the largest of `path_probabilities` of k intruders; `covariances` are (k, 6, 6)."""
    chance = np.empty(waypoints.shape[0])
    for i in range(out.shape[0]):
        path_probabilities(
            own,
            speeds,
            waypoints,
            positions[i],
            velocities[i],
            covariances[i],
            lookahead,
            radius,
            half_height,
            chance,
        )
        out[i] = np.max(chance)


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    one, zero = np.ones((1, 3)), np.zeros((1, 3))
    stadium_probability(0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0)
    disc_probability(0.0, 0.0, 1.0, 1.0, 0.0, 1.0)
    passing_probabilities(one, zero, np.eye(3)[None].copy(), 1.0, 1.0, np.zeros(1))
    covariances = np.eye(6)[None].copy()
    path_probabilities(zero[0], np.ones(1), one, one[0], one[0], covariances[0], 1.0, 1.0, 1.0, np.zeros(1))
    largest_path_probabilities(zero[0], np.ones(1), one, one, one, covariances, 1.0, 1.0, 1.0, np.zeros(1))
