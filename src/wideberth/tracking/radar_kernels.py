"""What a radar in any pose measures of a position and velocity, and back (thesis (3.50)-(3.56), (4.7), (4.10)-(4.12)).

A measurement is range, azimuth clockwise from the sensor's forward axis, elevation above its horizontal plane, and
range rate (positive opening). The sensor's pose is its position (NED) and C_ned_sensor, which turns its
forward-right-down axes into north-east-down: a ground radar's is the identity where it looks north and stands level, an
on-board radar's is the attitude of the aircraft. Elements that a sensor does not give are NaN.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]

NEAR_M = 1e-6
"""Closer to the sensor, or to the axis of its azimuth, angles have no meaning and are taken from this distance."""


@jit_uncounted
def wrap(angle: float) -> float:
    """Return an angle difference in [-pi, pi] (pi itself only where rounding ends there)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@jit_uncounted
def to_sensor(sensor: FloatArray, attitude: FloatArray, position: FloatArray, out: FloatArray) -> None:
    """Write a NED position as seen in the sensor's forward-right-down axes, m (3)."""
    n, e, d = position[0] - sensor[0], position[1] - sensor[1], position[2] - sensor[2]
    for i in range(3):
        out[i] = attitude[0, i] * n + attitude[1, i] * e + attitude[2, i] * d


@jit_uncounted
def to_plot(seen: FloatArray, out: FloatArray) -> None:
    """Write range, azimuth and elevation (3) of a position in the sensor's axes."""
    ground = math.hypot(seen[0], seen[1])
    out[0] = math.hypot(ground, seen[2])
    out[1] = math.atan2(seen[1], seen[0])
    out[2] = math.atan2(-seen[2], ground)


@jit_uncounted
def plot_jacobian(seen: FloatArray, attitude: FloatArray, out: FloatArray) -> None:
    """Write the derivatives (3, 3) of range, azimuth and elevation to the NED position."""
    x, y, z = seen[0], seen[1], seen[2]
    ground = max(math.hypot(x, y), NEAR_M)
    distance = max(math.hypot(ground, z), NEAR_M)
    ground2, distance2 = ground * ground, distance * distance
    for j in range(3):
        a, b, c = attitude[j, 0], attitude[j, 1], attitude[j, 2]
        out[0, j] = (x * a + y * b + z * c) / distance
        out[1, j] = (x * b - y * a) / ground2
        out[2, j] = (z * (x * a + y * b) / ground - ground * c) / distance2


@jit_uncounted
def to_position(
    sensor: FloatArray, attitude: FloatArray, distance: float, azimuth: float, elevation: float, out: FloatArray
) -> None:
    """Write the NED position of a plot, m (3) (thesis (4.10)-(4.12), for any pose)."""
    ground = distance * math.cos(elevation)
    x, y, z = ground * math.cos(azimuth), ground * math.sin(azimuth), -distance * math.sin(elevation)
    for i in range(3):
        out[i] = sensor[i] + attitude[i, 0] * x + attitude[i, 1] * y + attitude[i, 2] * z


@jit_uncounted
def directions(attitude: FloatArray, azimuth: float, elevation: float, out: FloatArray) -> None:
    """Write three unit vectors in NED as rows: outwards along the line of sight, across it clockwise, and across it up.

    The plane of the last two touches the sphere around the sensor: errors in it stay small and finite straight above
    the sensor, where the azimuth loses its meaning.
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    for i in range(3):
        a, b, c = attitude[i, 0], attitude[i, 1], attitude[i, 2]
        out[0, i] = ce * ca * a + ce * sa * b - se * c
        out[1, i] = -sa * a + ca * b
        out[2, i] = -se * ca * a - se * sa * b - ce * c


@jit_uncounted
def plot_covariance(
    attitude: FloatArray,
    distance: float,
    azimuth: float,
    elevation: float,
    sigma: FloatArray,
    out: FloatArray,
) -> None:
    """Write the NED covariance (3, 3) of a plot's position, m2.

    Parameters
    ----------
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    distance, azimuth, elevation : float
        Of the plot, or of a prediction, which has less noise in it.
    sigma : ndarray, shape (3,) or more
        Standard deviations of range (m), azimuth and elevation (rad).
    out : ndarray, shape (3, 3)
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    radial = sigma[0] * sigma[0]
    across = (distance * ce * sigma[1]) ** 2
    up = (distance * sigma[2]) ** 2
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
    for i in range(3):
        a, b, c = attitude[i, 0], attitude[i, 1], attitude[i, 2]
        ri, ti, ui = ce * ca * a + ce * sa * b - se * c, -sa * a + ca * b, -se * ca * a - se * sa * b - ce * c
        for j in range(i + 1):
            a2, b2, c2 = attitude[j, 0], attitude[j, 1], attitude[j, 2]
            rj = ce * ca * a2 + ce * sa * b2 - se * c2
            tj = -sa * a2 + ca * b2
            uj = -se * ca * a2 - se * sa * b2 - ce * c2
            out[i, j] = radial * ri * rj + across * ti * tj + up * ui * uj
            out[j, i] = out[i, j]


@jit_uncounted
def range_rate(sensor: FloatArray, sensor_velocity: FloatArray, x: FloatArray) -> float:
    """Return how fast the distance to position and velocity `x` (6, NED) opens, m/s."""
    n, e, d = x[0] - sensor[0], x[1] - sensor[1], x[2] - sensor[2]
    distance: float = max(math.sqrt(n * n + e * e + d * d), NEAR_M)
    vn, ve, vd = x[3] - sensor_velocity[0], x[4] - sensor_velocity[1], x[5] - sensor_velocity[2]
    rate: float = (n * vn + e * ve + d * vd) / distance
    return rate


@jit_uncounted
def range_rate_gradient(sensor: FloatArray, sensor_velocity: FloatArray, x: FloatArray, out: FloatArray) -> None:
    """Write the derivatives of the range rate to position and velocity (6)."""
    rate = range_rate(sensor, sensor_velocity, x)
    n, e, d = x[0] - sensor[0], x[1] - sensor[1], x[2] - sensor[2]
    distance = max(math.sqrt(n * n + e * e + d * d), NEAR_M)
    out[3], out[4], out[5] = n / distance, e / distance, d / distance
    for i in range(3):
        out[i] = (x[3 + i] - sensor_velocity[i] - rate * out[3 + i]) / distance


def warmup() -> None:
    """Compile what Python calls."""
    eye, zero, x = np.eye(3), np.zeros(3), np.array([30.0, 20.0, -10.0, 1.0, 2.0, 3.0])
    seen, plot, square = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    to_sensor(zero, eye, x, seen)
    to_plot(seen, plot)
    plot_jacobian(seen, eye, square)
    to_position(zero, eye, 1.0, 0.0, 0.0, plot)
    directions(eye, 0.1, 0.2, square)
    plot_covariance(eye, 100.0, 0.1, 0.2, np.ones(3), square)
    range_rate_gradient(zero, zero, x, np.zeros(6))
    wrap(4.0)
