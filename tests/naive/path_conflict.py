"""Naive twins of conflict detection along paths: where both aircraft are at many times, and whether that is inside."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def own_track(own: FloatArray, speed: float, waypoints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the path (n + 1, 3) and when each is reached; infinite where it never is."""
    corners = np.vstack([own, waypoints])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        durations = np.where(lengths > 0, lengths / speed, 0.0)
    return corners, np.concatenate([[0.0], np.cumsum(durations)])


def outside(relative: FloatArray, radius: float, half_height: float) -> FloatArray:
    """Return how far relative positions (..., 3) are outside the cylinder, m; not positive inside."""
    horizontal = np.hypot(relative[..., 0], relative[..., 1]) - radius
    return np.asarray(np.maximum(horizontal, np.abs(relative[..., 2]) - half_height))


def sampled_segment(
    a: FloatArray,
    b: FloatArray,
    start: float,
    end: float,
    intruder: FloatArray,
    radius: float,
    half_height: float,
    times: FloatArray,
) -> FloatArray:
    """Return `outside` at `times` of the segment from `a` at `start` to `b` at `end` (infinite: standing at `a`).

    `intruder` (n, 3): where it is at these times.
    """
    share = (times - start) / (end - start) if start < end < np.inf else np.zeros_like(times)
    own = a + share[:, None] * (b - a)
    return outside(intruder - own, radius, half_height)


def maneuver_positions(motion: str, x: FloatArray, maneuver_time: float, times: FloatArray) -> FloatArray:
    """Return positions (n, 3) at times from 0 on, by summing the velocity in small steps (Gauss-Legendre)."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    times = np.asarray(times, float)
    out = np.empty((times.size, 3))
    out[0] = x[:3]
    for k in range(1, times.size):
        half = 0.5 * (times[k] - times[k - 1])
        s = np.minimum(times[k - 1] + half * (nodes + 1.0), maneuver_time)
        if motion == "turning":
            speed, course, gamma = x[3] + s * x[6], x[4] + s * x[7], x[5] + s * x[8]
            v = speed * np.array([np.cos(course) * np.cos(gamma), np.sin(course) * np.cos(gamma), -np.sin(gamma)])
        elif motion == "constant_acceleration":
            v = x[3:6, None] + s * x[6:9, None]
        else:
            v = np.repeat(x[3:6, None], s.size, axis=1)
        out[k] = out[k - 1] + half * (v @ weights)
    return out


def drawn_path_conflicts(
    own: FloatArray,
    speed: float,
    waypoints: FloatArray,
    states: FloatArray,
    radius: float,
    half_height: float,
    step: float,
) -> FloatArray:
    """Return the share of drawn intruder states (m, 6) that are inside at a sampled time of each segment."""
    corners, reached = own_track(own, speed, waypoints)
    share = np.empty(len(waypoints))
    for i in range(len(waypoints)):
        times = np.linspace(reached[i], reached[i + 1], max(int((reached[i + 1] - reached[i]) / step), 2))
        hit = np.zeros(len(states), bool)
        for t in times:
            along = (t - reached[i]) / (reached[i + 1] - reached[i])
            own_now = corners[i] + along * (corners[i + 1] - corners[i])
            hit |= outside(states[:, :3] + t * states[:, 3:] - own_now, radius, half_height) <= 0
        share[i] = hit.mean()
    return share
