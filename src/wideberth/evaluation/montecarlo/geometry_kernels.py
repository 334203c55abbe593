"""The encounters: where intruders start on the circle, and how they fly (ADS-B paper, "Simulation results")."""

import math

import numpy as np

from wideberth._jit import jit
from wideberth.sensors.noise_kernels import GEOMETRY, PER_BLOCK, fill_uniforms

# Parameters, SI.
RADIUS, POINTS, OWN_SPEED, SPEED_MIN, SPEED_MAX, HEIGHT_OFFSET, REDRAW_SPEED = 0, 1, 2, 3, 4, 5, 6
N_GEOMETRY = 7

_TRIES = 10_000
"""Draws after which a start is given up: a circle that no aircraft of these speeds can enter there."""


@jit
def draw_encounter(
    seed: int, intruders: int, encounter: int, geometry: np.ndarray, positions: np.ndarray, velocities: np.ndarray
) -> bool:
    """Draw the intruders of an encounter: starts and straight, level flight.

    Parameters
    ----------
    seed, intruders, encounter : int
        Which one.
    geometry : ndarray, shape (N_GEOMETRY,)
    positions, velocities : ndarray, shape (intruders, 3)
        Written: relative to the ownship's start, north, east, down, m and m/s.

    Returns
    -------
    bool
        Whether all intruders could be drawn.
    """
    n_points = int(geometry[POINTS])
    numbers = np.empty(PER_BLOCK)
    points = np.empty(n_points, np.int64)
    for k in range(n_points):
        points[k] = k
    # The first intruder takes the points in turn; the others one of those left, by exchange.
    first = encounter % n_points
    points[0], points[first] = first, 0
    for i in range(intruders):
        # Each intruder draws from its own stretch of the encounter's stream.
        block = i * (_TRIES + 1)
        fill_uniforms(seed, intruders, encounter, GEOMETRY, block, numbers)
        if i > 0:
            j = i + min(int(numbers[0] * (n_points - i)), n_points - i - 1)
            points[i], points[j] = points[j], points[i]
        angle = 2.0 * math.pi * points[i] / n_points
        north, east = math.cos(angle), math.sin(angle)
        positions[i, 0], positions[i, 1] = geometry[RADIUS] * north, geometry[RADIUS] * east
        positions[i, 2] = geometry[HEIGHT_OFFSET] * (2.0 * numbers[1] - 1.0)
        span = geometry[SPEED_MAX] - geometry[SPEED_MIN]
        speed = geometry[SPEED_MIN] + span * numbers[2]
        found = False
        for trial in range(_TRIES):
            fill_uniforms(seed, intruders, encounter, GEOMETRY, block + 1 + trial, numbers)
            # Without any heading that leads into the circle the speed is drawn anew in either reading.
            if geometry[REDRAW_SPEED] > 0.0 or speed + geometry[OWN_SPEED] * north <= 0.0:
                speed = geometry[SPEED_MIN] + span * numbers[1]
            heading = math.pi * (2.0 * numbers[0] - 1.0)
            vn, ve = speed * math.cos(heading), speed * math.sin(heading)
            if (vn - geometry[OWN_SPEED]) * north + ve * east < 0.0:
                velocities[i, 0], velocities[i, 1], velocities[i, 2] = vn, ve, 0.0
                found = True
                break
        if not found:
            return False
    return True


@jit
def draw_encounters(
    seed: int, intruders: int, first: int, geometry: np.ndarray, positions: np.ndarray, velocities: np.ndarray
) -> int:
    """Draw encounters from `first` on into (n, intruders, 3); return how many came before one that cannot be."""
    for i in range(positions.shape[0]):
        if not draw_encounter(seed, intruders, first + i, geometry, positions[i], velocities[i]):
            return int(i)
    return int(positions.shape[0])


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    geometry = np.array([1000.0, 4.0, 40.0, 20.0, 100.0, 50.0, 1.0])
    draw_encounters(1, 1, 0, geometry, np.empty((1, 1, 3)), np.empty((1, 1, 3)))
