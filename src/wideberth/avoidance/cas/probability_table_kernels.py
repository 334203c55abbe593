"""Compiled Monte Carlo runs of a pair on a straight mean course, for `probability_table`.

The relative course runs along the first axis and passes at the miss distance along the second; m, m/s, s.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.sensors.noise_kernels import fill_normals

FloatArray = NDArray[np.float64]

_NOISE_SET = 8_003  # of `noise_kernels`: the third number of a stream


@jit
def violations(
    t_star: float,
    speed: float,
    misses: FloatArray,
    until: float,
    steps: int,
    sigma: float,
    rate_sigma: float,
    density: float,
    separation: float,
    seed: int,
    cell: int,
    samples: int,
    counts: FloatArray,
) -> None:
    """Count the samples whose protected zone is violated until a time, for each miss distance of the mean course.

    Parameters
    ----------
    t_star, speed : float
        Time to the closest point and relative speed of the mean course.
    misses : ndarray, shape (m,)
        The same samples serve all of them.
    until : float
    steps : int
        In which the white acceleration is drawn; straight flight within them.
    sigma, rate_sigma : float
        Of the relative position and velocity at the start, on each axis.
    density : float
        Of white acceleration, m2/s3.
    separation : float
        Radius of the zone.
    seed, cell : int
        Of the stream of random numbers: nothing else decides what is drawn.
    samples : int
    counts : ndarray, shape (m,)
        Written.
    """
    n, dt = misses.shape[0], until / steps
    noise, start = np.empty(6), np.empty(6)
    course = np.empty((steps + 1, 3))
    kick, shift = math.sqrt(density * dt), math.sqrt(density * dt**3 / 12.0)
    per_sample = 2 + 2 * steps  # blocks of four numbers, six at a time
    for k in range(n):
        counts[k] = 0.0
    for sample in range(samples):
        first = sample * per_sample
        fill_normals(seed, _NOISE_SET, cell, 0, first, start)
        for axis in range(3):
            course[0, axis] = sigma * start[axis]
            start[3 + axis] *= rate_sigma
        course[0, 0] -= speed * t_star
        start[3] += speed
        for step in range(steps):
            fill_normals(seed, _NOISE_SET, cell, 0, first + 2 + 2 * step, noise)
            for axis in range(3):
                change = kick * noise[axis]
                course[step + 1, axis] = (
                    course[step, axis] + dt * (start[3 + axis] + 0.5 * change) + shift * noise[3 + axis]
                )
                start[3 + axis] += change
        for k in range(n):
            for step in range(steps):
                x, y, z = course[step, 0], course[step, 1] + misses[k], course[step, 2]
                dx, dy, dz = course[step + 1, 0] - x, course[step + 1, 1] + misses[k] - y, course[step + 1, 2] - z
                length = dx * dx + dy * dy + dz * dz
                share = 0.0
                if length > 0.0:
                    share = min(max(-(x * dx + y * dy + z * dz) / length, 0.0), 1.0)
                x, y, z = x + share * dx, y + share * dy, z + share * dz
                if x * x + y * y + z * z < separation * separation:
                    counts[k] += 1.0
                    break


def warmup() -> None:
    """Compile what Python calls."""
    violations(1.0, 1.0, np.ones(1), 2.0, 1, 1.0, 1.0, 1.0, 1.0, 1, 1, 1, np.empty(1))
