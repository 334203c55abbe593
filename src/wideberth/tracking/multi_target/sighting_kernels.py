"""How a plot lies to a predicted position: innovation and its errors in the plane across the predicted direction.

Three elements in metres: range, across the line of sight clockwise, across it upwards; and the range rate in m/s.
All are taken along directions of the prediction, not of the plot: the noise of the plot's angles then cannot leak into
the weights, and nothing breaks down straight above the sensor, where the azimuth loses its meaning.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.radar_kernels import NEAR_M, directions, range_rate, range_rate_gradient, to_plot, to_sensor

FloatArray = NDArray[np.float64]


WIDEST_CROSS = 0.01
"""The second-order terms of the range count cross variances up to this share of the range squared.

A track whose height nothing measures (2-D radar, no known altitude) is followed in the slant plane.
"""


@jit_uncounted
def line_of_sight(attitude: FloatArray, azimuth: float, elevation: float, out: FloatArray) -> None:
    """Write the unit vector (3, NED) towards a plot."""
    ce = math.cos(elevation)
    x, y, z = ce * math.cos(azimuth), ce * math.sin(azimuth), -math.sin(elevation)
    for i in range(3):
        out[i] = attitude[i, 0] * x + attitude[i, 1] * y + attitude[i, 2] * z


@jit_uncounted
def frame_at(
    sensor: FloatArray, attitude: FloatArray, position: FloatArray, frame: FloatArray, look: FloatArray
) -> None:
    """Write the directions out, across and up (3, 3, as rows, NED) at a position, and how it is seen.

    Parameters
    ----------
    sensor : ndarray, shape (3,)
    attitude : ndarray, shape (3, 3)
    position : ndarray, shape (3,) or more
        NED, m.
    frame : ndarray, shape (3, 3)
    look : ndarray, shape (3,)
        Range (m), azimuth and elevation (rad); also used as scratch.
    """
    to_sensor(sensor, attitude, position, frame[0])
    to_plot(frame[0], look)
    look[0] = max(look[0], NEAR_M)
    directions(attitude, look[1], look[2], frame)


@jit_uncounted
def projected(frame: FloatArray, p: FloatArray, i: int) -> float:
    """Return the variance of the position along row `i` of a frame, m2."""
    total = 0.0
    for a in range(3):
        for b in range(3):
            total += frame[i, a] * p[a, b] * frame[i, b]
    return total


@jit_uncounted
def element_variances(look: FloatArray, across: float, up: float, variance: FloatArray, out: FloatArray) -> None:
    """Write the error variances (4) of a plot's elements.

    Parameters
    ----------
    look : ndarray, shape (3,)
        Predicted range, azimuth and elevation.
    across, up : float
        Variances of the prediction across the line of sight, m2.
    variance : ndarray, shape (4,)
        Of range (m2), azimuth, elevation (rad2), range rate (m2/s2).
    out : ndarray, shape (4,)
    """
    distance = look[0]
    d2 = distance * distance
    c = math.cos(look[2])
    c2 = c * c
    # Second order of the range in the cross errors of the prediction.
    widest = WIDEST_CROSS * d2
    out[0] = variance[0] + 0.5 * (min(across, widest) ** 2 + min(up, widest) ** 2) / d2
    # Near the zenith the azimuth's error shrinks to nothing, and the predicted directions across and up may be turned
    # against the true ones: both leave some of the elevation's error in the element across.
    elevation = variance[2] if variance[2] == variance[2] else 0.0
    turned = across / d2
    share = turned / (c2 + turned + 1e-12)
    out[1] = d2 * (variance[1] * (c2 + elevation) + elevation * share)
    out[2] = d2 * variance[2]
    out[3] = variance[3]


@jit_uncounted
def innovation(
    sensor: FloatArray,
    sensor_velocity: FloatArray,
    frame: FloatArray,
    look: FloatArray,
    across: float,
    up: float,
    x: FloatArray,
    z: FloatArray,
    sight: FloatArray,
    out: FloatArray,
) -> None:
    """Write the elements (4) of a plot minus those of a state; NaN where the plot lacks one.

    Parameters
    ----------
    sensor, sensor_velocity : ndarray, shape (3,)
    frame, look : ndarray
        Of `frame_at`, at a position near that of `x` (that of all hypotheses together).
    across, up : float
        Variances of the prediction across the line of sight, m2: the mean range is longer by their half over range.
    x : ndarray, shape (6,) or more
    z : ndarray, shape (4,)
        The plot.
    sight : ndarray, shape (3,)
        Unit vector towards the plot.
    out : ndarray, shape (4,)
    """
    n, e, d = x[0] - sensor[0], x[1] - sensor[1], x[2] - sensor[2]
    distance = math.sqrt(n * n + e * e + d * d)
    widest = WIDEST_CROSS * look[0] * look[0]
    out[0] = z[0] - distance - 0.5 * (min(across, widest) + min(up, widest)) / look[0]
    for i in range(1, 3):
        a, b, c = frame[i, 0], frame[i, 1], frame[i, 2]
        out[i] = look[0] * (a * sight[0] + b * sight[1] + c * sight[2]) - (a * n + b * e + c * d)
    if math.isnan(z[2]):
        out[2] = math.nan
    out[3] = math.nan
    if z[3] == z[3]:
        out[3] = z[3] - range_rate(sensor, sensor_velocity, x)


@jit_uncounted
def sight_rows(
    sensor: FloatArray, sensor_velocity: FloatArray, frame: FloatArray, x: FloatArray, rate: bool, h: FloatArray
) -> None:
    """Write the derivatives (4, n) of the elements to a state of n >= 6; the last row only where `rate`."""
    for i in range(3):
        for j in range(h.shape[1]):
            h[i, j] = frame[i, j] if j < 3 else 0.0
    for j in range(h.shape[1]):
        h[3, j] = 0.0
    if rate:
        range_rate_gradient(sensor, sensor_velocity, x, h[3])


@jit_uncounted
def detection_at(ranges: FloatArray, probabilities: FloatArray, distance: float) -> float:
    """Return the probability of detection at a range: linear between the nodes, zero beyond the last."""
    n = ranges.shape[0]
    if not distance <= ranges[n - 1]:
        return 0.0
    if distance <= ranges[0]:
        nearest: float = probabilities[0]
        return nearest
    k = 1
    while ranges[k] < distance:
        k += 1
    width = ranges[k] - ranges[k - 1]
    if width <= 0.0:
        return float(probabilities[k])
    part = (distance - ranges[k - 1]) / width
    value: float = probabilities[k - 1] + part * (probabilities[k] - probabilities[k - 1])
    return value


@jit_uncounted
def inside(margin: float, sigma: float) -> float:
    """Return the probability that a normal error of spread `sigma` leaves a margin positive."""
    if sigma <= 0.0:
        return 1.0 if margin >= 0.0 else 0.0
    return 0.5 * math.erfc(-margin / (sigma * 1.4142135623730951))


@jit_uncounted
def visibility(look: FloatArray, spread: FloatArray, field_of_view: FloatArray, range_max: float) -> float:
    """Return the probability that a prediction lies inside range and field of view.

    Parameters
    ----------
    look : ndarray, shape (3,)
        Predicted range, azimuth and elevation.
    spread : ndarray, shape (3,)
        Its variances out, across and up, m2.
    field_of_view : ndarray, shape (2,)
        Half-widths in azimuth and elevation, rad.
    range_max : float
        m.
    """
    share = inside(range_max - look[0], math.sqrt(spread[0]))
    if field_of_view[0] < math.pi - 1e-9:
        ground = look[0] * max(abs(math.cos(look[2])), 1e-3)
        share *= inside((field_of_view[0] - abs(look[1])) * ground, math.sqrt(spread[1]))
    if field_of_view[1] < 0.5 * math.pi - 1e-9:
        share *= inside((field_of_view[1] - abs(look[2])) * look[0], math.sqrt(spread[2]))
    return share


@jit_uncounted
def sector_volume(range_max: float, field_of_view: FloatArray) -> float:
    """Return the volume that a sensor watches, m3."""
    solid = 4.0 * field_of_view[0] * math.sin(field_of_view[1])
    volume: float = solid * range_max * range_max * range_max / 3.0
    return max(volume, 1.0)


@jit_uncounted
def log_density(density: float, look: FloatArray, field_of_view: FloatArray, speed_max: float, z: FloatArray) -> float:
    """Return the logarithm of the density of false plots where a plot lies, in the units of its elements.

    Parameters
    ----------
    density : float
        Per cubic metre.
    look : ndarray, shape (3,)
    field_of_view : ndarray, shape (2,)
    speed_max : float
        False range rates are even over twice this, m/s.
    z : ndarray, shape (4,)
        The plot: without elevation it stands for the whole height of the field of view, and with a range rate its
        density is also per m/s.
    """
    value = density
    if math.isnan(z[2]):
        value *= 2.0 * look[0] * field_of_view[1]
    if z[3] == z[3]:
        value /= 2.0 * speed_max
    return math.log(value)


def warmup() -> None:
    """Compile what Python calls."""
    zero, eye, x, z = np.zeros(3), np.eye(3), np.array([30.0, 20.0, -10.0, 1.0, 2.0, 3.0]), np.ones(4)
    frame, look, out, h = np.zeros((3, 3)), np.zeros(3), np.zeros(4), np.zeros((4, 6))
    fov, table = np.ones(2), np.array([1.0, 2.0])
    line_of_sight(eye, 0.1, 0.2, look)
    frame_at(zero, eye, x, frame, look)
    projected(frame, eye, 0)
    element_variances(look, 1.0, 1.0, z, out)
    innovation(zero, zero, frame, look, 1.0, 1.0, x, z, zero, out)
    sight_rows(zero, zero, frame, x, True, h)
    detection_at(table, table, 1.5)
    visibility(look, np.ones(3), fov, 100.0)
    sector_volume(100.0, fov)
    log_density(1e-9, look, fov, 100.0, z)
