"""Plots of a scan before they meet the tracks: checks, height in two dimensions, positions, and the window."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.radar_kernels import to_position
from wideberth.tracking.rransac.state_kernels import (
    BEYOND_CAP,
    FILLED,
    HEAD,
    HITS,
    NO_ALTITUDE,
    NOT_FINITE,
    NOT_POSITIVE,
    OWN_HITS,
    SCANS,
    ByteArray,
    Clock,
    Scan,
    Settings,
    Tracks,
    Window,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# What becomes of a plot.
BAD, OUTLIER, INLIER = 0, 1, 2


@jit_uncounted
def height_angles(
    attitude: FloatArray, below: float, distance: float, azimuth: float, cone: bool, out: FloatArray
) -> bool:
    """Write azimuth and elevation (2) at which a plot without elevation meets a known altitude; False if nowhere.

    Parameters
    ----------
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    below : float
        How far the altitude lies below the sensor, m.
    distance, azimuth : float
        Of the plot.
    cone : bool
        Whether the azimuth is the angle out of the sensor's vertical plane, as a planar array measures it (thesis
        (5.1)), instead of the angle in its horizontal plane.
    out : ndarray, shape (2,)
    """
    # The line of sight is u + cos(phi) a + sin(phi) b in the sensor's axes, phi the angle sought.
    down = attitude[2]
    if cone:
        constant, a, b = down[1] * math.sin(azimuth), down[0] * math.cos(azimuth), -down[2] * math.cos(azimuth)
    else:
        constant, a, b = 0.0, down[0] * math.cos(azimuth) + down[1] * math.sin(azimuth), -down[2]
    size = math.hypot(a, b)
    wanted = below / distance - constant
    if not abs(wanted) <= size:
        return False
    middle, half = math.atan2(b, a), math.acos(wanted / size)
    # Of two solutions the one nearer to the sensor's horizontal plane.
    low, high = middle - half, middle + half
    low -= 2.0 * math.pi * math.floor((low + math.pi) / (2.0 * math.pi))
    high -= 2.0 * math.pi * math.floor((high + math.pi) / (2.0 * math.pi))
    elevation = low if abs(low) < abs(high) else high
    if cone:
        x, y = math.cos(azimuth) * math.cos(elevation), math.sin(azimuth)
        out[0] = math.atan2(y, x)
        out[1] = math.atan2(math.cos(azimuth) * math.sin(elevation), math.hypot(x, y))
    else:
        out[0], out[1] = azimuth, elevation
    return True


@jit_uncounted
def read_plots(
    s: Settings,
    scan: Scan,
    z: FloatArray,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    counts: IntArray,
) -> None:
    """Write range and angles (k, 3) and position (k, 3) of the good plots of `z` (k, 3 or more); count the others."""
    for i in range(len(z)):
        fate[i] = BAD
        distance, azimuth = z[i, 0], z[i, 1]
        if not (math.isfinite(distance) and math.isfinite(azimuth)):
            counts[NOT_FINITE] += 1
            continue
        if distance <= 0.0:
            counts[NOT_POSITIVE] += 1
            continue
        plots[i, 0], plots[i, 1], plots[i, 2] = distance, azimuth, z[i, 2]
        if s.dimensions == 2:
            below = -s.altitude - scan.sensor[2]
            if not height_angles(scan.attitude, below, distance, azimuth, s.cone_azimuth, plots[i, 1:3]):
                counts[NO_ALTITUDE] += 1
                continue
        elif not math.isfinite(z[i, 2]):
            counts[NOT_FINITE] += 1
            continue
        to_position(scan.sensor, scan.attitude, plots[i, 0], plots[i, 1], plots[i, 2], positions[i])
        fate[i] = OUTLIER


@jit_uncounted
def open_slot(s: Settings, window: Window, clock: Clock, tracks: Tracks, scan: Scan) -> int:
    """Take the slot of the oldest scan for a new one; the tracks lose what they had in it."""
    head: int = (clock.integers[HEAD] + 1) % s.window
    clock.integers[HEAD] = head
    clock.integers[SCANS] += 1
    clock.integers[FILLED] = min(clock.integers[FILLED] + 1, s.window)
    window.t[head] = scan.t
    window.n_plots[head] = 0
    for i in range(3):
        window.sensor[head, i] = scan.sensor[i]
        window.sigma[head, i] = scan.sigma[i]
        for j in range(3):
            window.attitude[head, i, j] = scan.attitude[i, j]
    for i in range(len(tracks.t_update)):
        tracks.integers[i, HITS] -= tracks.hits[i, head]
        tracks.integers[i, OWN_HITS] -= tracks.own_hits[i, head]
        tracks.hits[i, head] = 0
        tracks.own_hits[i, head] = 0
    return head


@jit_uncounted
def farthest_kept(s: Settings, plots: FloatArray, fate: ByteArray) -> float:
    """Return the range up to which the plots of a scan fit into the window."""
    n, longest = 0, 0.0
    for i in range(len(fate)):
        if fate[i] != BAD:
            n += 1
            longest = max(longest, plots[i, 0])
    if n <= s.plots:
        return longest
    low, high = 0.0, longest
    for _ in range(60):
        middle = 0.5 * (low + high)
        n = 0
        for i in range(len(fate)):
            if fate[i] != BAD and plots[i, 0] <= middle:
                n += 1
        if n > s.plots:
            high = middle
        else:
            low = middle
    return low


@jit_uncounted
def fill_slot(
    s: Settings,
    window: Window,
    slot: int,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    counts: IntArray,
) -> None:
    """Put the plots of a scan into the window, where there are too many the nearest."""
    longest = farthest_kept(s, plots, fate)
    n = 0
    for i in range(len(fate)):
        if fate[i] == BAD:
            continue
        if plots[i, 0] > longest or n == s.plots:
            counts[BEYOND_CAP] += 1
            continue
        for j in range(3):
            window.z[slot, n, j] = plots[i, j]
            window.position[slot, n, j] = positions[i, j]
        window.used[slot, n] = fate[i] == INLIER
        n += 1
    window.n_plots[slot] = n


def warmup() -> None:
    """Compile what Python calls."""
    height_angles(np.eye(3), -10.0, 100.0, 0.1, True, np.zeros(2))
