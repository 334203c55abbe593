"""Registration of radars: what a radar with biases measures, where its plots are, and the update of all biases.

The biases of one radar are ten numbers, each *measured minus true* or *true minus told*:

====  ===============  =====================================================================================
row   name             meaning
====  ===============  =====================================================================================
0     range            added to the range, m
1     range scale      the true range times this is added to the range
2     azimuth          added to the azimuth, rad (a radar turned clockwise by a and not told so has -a)
3     elevation        added to the elevation, rad
4, 5  roll, pitch      of the true sensor axes about the told forward and right axes, rad
6-8   north, east,     true minus told position of the radar, m
      down
9     clock            told minus true time of a plot, s
====  ===============  =====================================================================================

The state is the biases of all radars one after the other, ten each; a bias with no variance is not estimated.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, congruence, whitened_square
from wideberth.tracking.radar_kernels import directions, plot_jacobian, to_plot, to_position, to_sensor, wrap
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

BIASES = 10
RANGE, SCALE, AZIMUTH, ELEVATION, ROLL, PITCH, NORTH, EAST, DOWN, CLOCK = range(BIASES)


@jit_uncounted
def true_pose(b: FloatArray, sensor: FloatArray, attitude: FloatArray, pose: FloatArray) -> None:
    """Write the true pose of a radar, told to be at `sensor` with `attitude`: C_ned_sensor and the position (4, 3)."""
    cr, sr, cp, sp = math.cos(b[ROLL]), math.sin(b[ROLL]), math.cos(b[PITCH]), math.sin(b[PITCH])
    for i in range(3):
        x, y, z = attitude[i, 0], attitude[i, 1], attitude[i, 2]
        pose[i, 0] = cp * x - sp * z
        pose[i, 1] = sr * sp * x + cr * y + sr * cp * z
        pose[i, 2] = cr * sp * x - sr * y + cr * cp * z
        pose[3, i] = sensor[i] + b[NORTH + i]


@jit_uncounted
def biased_plot(
    b: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    x: FloatArray,
    dt: float,
    plot: FloatArray,
    to_bias: FloatArray,
    to_state: FloatArray,
    work: FloatArray,
) -> None:
    """Write what a radar with biases measures, and the derivatives of that.

    Parameters
    ----------
    b : ndarray, shape (10,)
        Biases of this radar.
    sensor, attitude : ndarray, shape (3,) and (3, 3)
        Told pose.
    x : ndarray, shape (6,)
        Position and velocity of the aircraft, NED.
    dt : float
        Told time of the plot minus the time of `x`, s.
    plot : ndarray, shape (3,)
        Range, azimuth, elevation; written.
    to_bias, to_state : ndarray, shape (3, 10) and (3, 6)
        Derivatives to `b` and `x`; written.
    work : ndarray, shape (12, 3)
        Written over.
    """
    pose, g, seen, position = work[0:4], work[4:7], work[7], work[8]
    true_pose(b, sensor, attitude, pose)
    lead = dt - b[CLOCK]
    for i in range(3):
        position[i] = x[i] + lead * x[3 + i]
    to_sensor(pose[3], pose, position, seen)
    to_plot(seen, plot)
    plot_jacobian(seen, pose, g)
    # How the aircraft moves in the sensor's axes as these roll and pitch.
    cr, sr = math.cos(b[ROLL]), math.sin(b[ROLL])
    z1 = sr * seen[1] + cr * seen[2]
    rolled, pitched = work[9], work[10]
    rolled[0], rolled[1], rolled[2] = 0.0, seen[2], -seen[1]
    pitched[0], pitched[1], pitched[2] = -z1, sr * seen[0], cr * seen[0]
    for i in range(3):
        factor = 1.0 + b[SCALE] if i == 0 else 1.0
        for j in range(BIASES):
            to_bias[i, j] = 0.0
        for j in range(3):
            slope = factor * g[i, j]
            to_state[i, j] = slope
            to_state[i, 3 + j] = lead * slope
            to_bias[i, NORTH + j] = -slope
            to_bias[i, CLOCK] -= slope * x[3 + j]
            for k in range(3):
                to_bias[i, ROLL] += slope * pose[j, k] * rolled[k]
                to_bias[i, PITCH] += slope * pose[j, k] * pitched[k]
    to_bias[0, RANGE] = 1.0
    to_bias[0, SCALE] = plot[0]
    to_bias[1, AZIMUTH] = 1.0
    to_bias[2, ELEVATION] = 1.0
    plot[0] = plot[0] * (1.0 + b[SCALE]) + b[RANGE]
    plot[1] = wrap(plot[1] + b[AZIMUTH])
    plot[2] += b[ELEVATION]


@jit_uncounted
def place(
    b: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    z: FloatArray,
    variance: FloatArray,
    velocity: FloatArray,
    position: FloatArray,
    to_bias: FloatArray,
    noise: FloatArray,
    work: FloatArray,
) -> None:
    """Write where the aircraft of a plot is if the biases are right, how that depends on them, and its covariance.

    Parameters
    ----------
    b : ndarray, shape (10,)
    sensor, attitude : ndarray, shape (3,) and (3, 3)
        Told pose.
    z, variance : ndarray, shape (3,)
        Measured range, azimuth, elevation, and the variances of their noise.
    velocity : ndarray, shape (3,)
        Of the aircraft, m/s; only a clock offset needs it.
    position : ndarray, shape (3,)
        At the told time, NED; written.
    to_bias : ndarray, shape (3, 10)
        Derivatives of `position` to `b`; written.
    noise : ndarray, shape (3, 3)
        Covariance of `position` from the noise alone, m2; written.
    work : ndarray, shape (28, 10)
        Written over.
    """
    axes, slopes, states, x, plot, inner = work[0:3], work[3:6], work[6:9], work[9], work[10], work[12:24, :3]
    pose = work[24:28, :3]
    distance = (z[0] - b[RANGE]) / (1.0 + b[SCALE])
    azimuth, elevation = z[1] - b[AZIMUTH], z[2] - b[ELEVATION]
    true_pose(b, sensor, attitude, pose)
    to_position(pose[3], pose, distance, azimuth, elevation, position)
    directions(pose, azimuth, elevation, axes)
    for i in range(3):
        position[i] += b[CLOCK] * velocity[i]
        x[i], x[3 + i] = position[i], velocity[i]
    biased_plot(b, sensor, attitude, x, 0.0, plot, slopes, states, inner)
    ground = distance * math.cos(elevation)
    for i in range(3):
        radial, across, up = axes[0, i] / (1.0 + b[SCALE]), axes[1, i] * ground, axes[2, i] * distance
        for j in range(BIASES):
            to_bias[i, j] = -(radial * slopes[0, j] + across * slopes[1, j] + up * slopes[2, j])
        for j in range(i + 1):
            noise[i, j] = (
                radial * axes[0, j] / (1.0 + b[SCALE]) * variance[0]
                + across * axes[1, j] * ground * variance[1]
                + up * axes[2, j] * distance * variance[2]
            )
            noise[j, i] = noise[i, j]


@jit_uncounted
def spread(p: FloatArray, first: int, second: int, left: FloatArray, right: FloatArray, out: FloatArray) -> None:
    """Write L P R' (3, 3) for the block of P (n, n) that belongs to the biases of radars `first` and `second`."""
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(BIASES):
                if left[i, k] != 0.0:
                    for m in range(BIASES):
                        total += left[i, k] * p[BIASES * first + k, BIASES * second + m] * right[j, m]
            out[i, j] = total


@jit
def pair_distances(
    p: FloatArray,
    radar: int,
    position: FloatArray,
    to_bias: FloatArray,
    covariance: FloatArray,
    others: int,
    positions: FloatArray,
    to_biases: FloatArray,
    covariances: FloatArray,
    out: FloatArray,
) -> None:
    """Write the squared Mahalanobis distances (k,) of one plot from the k plots of another radar, brought to its time.

    Parameters
    ----------
    p : ndarray, shape (n, n)
        Covariance of the biases.
    radar, others : int
        Numbers of the radars; the other one -1 where `positions` have no biases in them.
    position, to_bias, covariance : ndarray, shape (3,), (3, 10), (3, 3)
        As `place` writes them.
    positions, to_biases, covariances : ndarray, shape (k, 3), (k, 3, 10), (k, 3, 3)
    out : ndarray, shape (k,)
    """
    own, cross, total, factor = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    theirs, difference, work = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    spread(p, radar, radar, to_bias, to_bias, own)
    for k in range(len(positions)):
        if others >= 0:
            spread(p, others, others, to_biases[k], to_biases[k], theirs)
            spread(p, radar, others, to_bias, to_biases[k], cross)
        for i in range(3):
            difference[i] = position[i] - positions[k, i]
            for j in range(3):
                total[i, j] = (
                    own[i, j] + theirs[i, j] - cross[i, j] - cross[j, i] + covariance[i, j] + covariances[k, i, j]
                )
        out[k] = whitened_square(factor, 3, difference, work) if cholesky(total, 3, factor) else math.inf


@jit
def match_plots(
    b: FloatArray,
    p: FloatArray,
    radar: int,
    sensor: FloatArray,
    attitude: FloatArray,
    z: FloatArray,
    variance: FloatArray,
    t: FloatArray,
    wanted: BoolArray,
    track_t: FloatArray,
    track_x: FloatArray,
    track_p: FloatArray,
    velocity_variance: float,
    height_variance: float,
    gate: float,
    track: IntArray,
    state: FloatArray,
    covariance: FloatArray,
    position: FloatArray,
    to_bias: FloatArray,
    noise: FloatArray,
) -> None:
    """Place the plots of a radar, each with the track that is nearest to it.

    A plot without elevation is put at the height of the track in question, whose uncertainty it then has.

    Parameters
    ----------
    b, p : ndarray, shape (n,) and (n, n)
        Biases of all radars and their covariance.
    radar : int
        Number of the radar.
    sensor, attitude : ndarray, shape (3,) and (3, 3)
        Told pose.
    z, variance : ndarray, shape (k, 3)
        Range, azimuth, elevation (NaN: not measured), and the variances of their noise.
    t : ndarray, shape (k,)
        s.
    wanted : ndarray of bool, shape (k,)
        The others are passed over.
    track_t, track_x, track_p : ndarray, shape (m,), (m, 6), (m, 6, 6)
        Tracks: time, position and velocity, covariance.
    velocity_variance : float
        Added to each axis of the velocity, m2/s2.
    height_variance : float
        Added to the height where a plot has no elevation, m2.
    gate : float
        Largest squared Mahalanobis distance.
    track : ndarray, shape (k,), int64
        Number of the nearest track; written where there is one within the gate.
    state, covariance : ndarray, shape (k, 6) and (k, 6, 6)
        Of that track at the time of the plot; written.
    position, to_bias, noise : ndarray, shape (k, 3), (k, 3, 10), (k, 3, 3)
        As `place` writes them; written.
    """
    work, row, deviation = np.zeros((28, BIASES)), np.zeros(3), np.zeros(3)
    f, inner, x, px = np.eye(6), np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6))
    where, slopes, own, spot = np.zeros(3), np.zeros((3, BIASES)), np.zeros((3, 3)), np.zeros((3, 3))
    total, factor, difference, whitened = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    biases = b[BIASES * radar : BIASES * (radar + 1)]
    for i in range(len(z)):
        if not wanted[i]:
            continue
        nearest = gate
        for j in range(len(track_t)):
            dt = t[i] - track_t[j]
            for k in range(3):
                f[k, 3 + k] = dt
                x[k], x[3 + k] = track_x[j, k] + dt * track_x[j, 3 + k], track_x[j, 3 + k]
                row[k], deviation[k] = z[i, k], variance[i, k]
            px[:, :] = track_p[j]
            for k in range(3):
                px[3 + k, 3 + k] += velocity_variance
            congruence(f, px, 6, 6, inner, px)
            flat = math.isnan(row[2])
            if flat:
                px[2, 2] += height_variance
                row[2] = math.asin(min(max((sensor[2] - x[2]) / row[0], -1.0), 1.0))
                deviation[2] = px[2, 2] / (row[0] * row[0])
            place(biases, sensor, attitude, row, deviation, x[3:], where, slopes, spot, work)
            spread(p, radar, radar, slopes, slopes, own)
            for k in range(3):
                difference[k] = where[k] - x[k]
                for m in range(3):
                    total[k, m] = own[k, m] + spot[k, m] + px[k, m]
            if not cholesky(total, 3, factor):
                continue
            distance = whitened_square(factor, 3, difference, whitened)
            if distance < nearest:
                nearest = distance
                track[i] = j
                state[i], covariance[i] = x, px
                position[i], to_bias[i], noise[i] = where, slopes, spot


@jit
def fuse(
    b: FloatArray,
    p: FloatArray,
    x: FloatArray,
    px: FloatArray,
    seeded: bool,
    radars: IntArray,
    sensors: FloatArray,
    attitudes: FloatArray,
    z: FloatArray,
    variance: FloatArray,
    dt: FloatArray,
    gate: float,
    nis: FloatArray,
) -> int:
    """Update the biases of all radars in place with plots of one aircraft, whose own state drops out again.

    The filter's state is extended by position and velocity of the aircraft, so that the noise of a plot that is
    compared with several others is not counted more than once.

    Parameters
    ----------
    b, p : ndarray, shape (n,) and (n, n)
        Biases of all radars and their covariance.
    x, px : ndarray, shape (6,) and (6, 6)
        Position and velocity of the aircraft at the time that `dt` counts from, and their covariance.
    seeded : bool
        Whether the position in `x` comes from the first plot: that plot then takes part without being judged.
    radars : ndarray, shape (k,), int64
    sensors, attitudes : ndarray, shape (k, 3) and (k, 3, 3)
        Told poses.
    z, variance : ndarray, shape (k, 3)
        Range, azimuth, elevation; NaN where not measured.
    dt : ndarray, shape (k,)
        s.
    gate : float
        Largest normalised innovation squared of a plot.
    nis : ndarray, shape (k,)
        Of each plot; written. A plot beyond the gate changes nothing.

    Returns
    -------
    int
        Number of plots beyond the gate.
    """
    n, k = len(b), len(z)
    m = n + 6
    state, cov = np.zeros(m), np.zeros((m, m))
    state[:n], state[n:] = b, x
    cov[:n, :n], cov[n:, n:] = p, px
    before = np.zeros(m)
    cov_before = np.zeros((m, m))
    h, plot, innovation, noise = np.zeros((3, m)), np.zeros(3), np.zeros(3), np.zeros(3)
    to_bias, to_state, work, gains = np.zeros((3, BIASES)), np.zeros((3, 6)), np.zeros((12, 3)), np.zeros((2, m))
    rejected = 0
    for i in range(k):
        first = BIASES * radars[i]
        own = state[first : first + BIASES]
        biased_plot(own, sensors[i], attitudes[i], state[n:], dt[i], plot, to_bias, to_state, work)
        # What the linear update leaves out: terms of second order in the angles, and in the place across the line of
        # sight; they die away as the biases become known.
        turn = cov[first + AZIMUTH, first + AZIMUTH] + cov[first + ELEVATION, first + ELEVATION]
        turn += cov[first + ROLL, first + ROLL] + cov[first + PITCH, first + PITCH]
        if not (seeded and i == 0):
            turn += min(0.5 * (cov[n, n] + cov[n + 1, n + 1] + cov[n + 2, n + 2]) / (plot[0] * plot[0]), 0.1)
        h[:, :] = 0.0
        for r in range(3):
            h[r, first : first + BIASES] = to_bias[r]
            h[r, n:] = to_state[r]
            innovation[r] = z[i, r] - plot[r]
            curve = plot[0] * turn if r == 0 else turn
            noise[r] = variance[i, r] + 0.75 * curve * curve
        innovation[1] = wrap(innovation[1])
        before[:], cov_before[:, :] = state, cov
        square, _ = update(m, 3, state, cov, h, innovation, noise, gains)
        nis[i] = square
        if not square <= gate and not (seeded and i == 0):
            state[:], cov[:, :] = before, cov_before
            rejected += 1
    b[:], p[:, :] = state[:n], cov[:n, :n]
    return rejected


def warmup() -> None:
    """Compile what Python calls."""
    b, p, eye = np.zeros(BIASES), np.eye(BIASES), np.eye(3)
    x = np.array([300.0, 20.0, -100.0, 1.0, 2.0, 3.0])
    z, variance = np.array([[300.0, 0.1, 0.3]]), np.array([[1.0, 1e-4, 1e-4]])
    position, to_bias, noise = np.zeros((1, 3)), np.zeros((1, 3, BIASES)), np.zeros((1, 3, 3))
    biased_plot(b, x[:3], eye, x + 10.0, 0.1, np.zeros(3), to_bias[0], np.zeros((3, 6)), np.zeros((12, 3)))
    match_plots(
        b, p, 0, np.zeros(3), eye, z, variance, np.zeros(1), np.ones(1, np.bool_), np.zeros(1), x[None],
        np.eye(6)[None], 1.0, 1.0, 1e9, np.zeros(1, np.int64), np.zeros((1, 6)), np.zeros((1, 6, 6)), position, to_bias,
        noise,
    )  # fmt: skip
    pair_distances(p, 0, position[0], to_bias[0], noise[0], -1, position, to_bias, noise, np.zeros(1))
    fuse(
        b, p, x, np.eye(6), False, np.zeros(1, np.int64), np.zeros((1, 3)), eye[None], z, variance, np.zeros(1), 16.0,
        np.zeros(1),
    )  # fmt: skip
    true_pose(b, np.zeros(3), eye, np.zeros((4, 3)))
