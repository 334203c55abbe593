"""The last scans with the plots that no track explained: a ring that new tracks are found in."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TABLE_NODES = 16
"""Nodes of a scan's table of detection probability against range."""


class Window(NamedTuple):
    """The last scans and those of their plots that no track explained: a ring of W scans with room for B plots each.

    Attributes
    ----------
    t : ndarray, shape (W,)
    position, velocity : ndarray, shape (W, 3)
        Of the sensor, NED.
    attitude : ndarray, shape (W, 3, 3)
    field_of_view : ndarray, shape (W, 2)
    ranges, probabilities : ndarray, shape (W, TABLE_NODES)
        Probability of detection against range.
    density : ndarray, shape (W,)
        Of false plots, per m3.
    filled : ndarray of int64, shape (W,)
    z, variance : ndarray, shape (W, B, 4)
    sight, place : ndarray, shape (W, B, 3)
        Unit vector towards the plot, and its position in NED.
    used : ndarray of bool, shape (W, B)
        Whether a track was made of it.
    cursor : ndarray of int64, shape (2,)
        The newest scan's place in the ring, and how many there are.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray
    field_of_view: FloatArray
    ranges: FloatArray
    probabilities: FloatArray
    density: FloatArray
    filled: IntArray
    z: FloatArray
    variance: FloatArray
    sight: FloatArray
    place: FloatArray
    used: NDArray[np.bool_]
    cursor: IntArray


def make_window(scans: int, plots: int) -> Window:
    """Return an empty window of so many scans with room for so many plots each."""
    return Window(
        t=np.full(scans, -np.inf),
        position=np.zeros((scans, 3)),
        velocity=np.zeros((scans, 3)),
        attitude=np.zeros((scans, 3, 3)),
        field_of_view=np.zeros((scans, 2)),
        ranges=np.zeros((scans, TABLE_NODES)),
        probabilities=np.zeros((scans, TABLE_NODES)),
        density=np.ones(scans),
        filled=np.zeros(scans, np.int64),
        z=np.zeros((scans, plots, 4)),
        variance=np.zeros((scans, plots, 4)),
        sight=np.zeros((scans, plots, 3)),
        place=np.zeros((scans, plots, 3)),
        used=np.zeros((scans, plots), np.bool_),
        cursor=np.array([-1, 0], np.int64),
    )


@jit_uncounted
def open_window(
    window: Window,
    t: float,
    position: FloatArray,
    velocity: FloatArray,
    attitude: FloatArray,
    field_of_view: FloatArray,
    ranges: FloatArray,
    probabilities: FloatArray,
    density: float,
) -> int:
    """Put a scan without plots into the ring; return its place."""
    k: int = (window.cursor[0] + 1) % window.t.shape[0]
    window.cursor[0] = k
    window.cursor[1] = min(window.cursor[1] + 1, window.t.shape[0])
    window.t[k], window.density[k], window.filled[k] = t, density, 0
    for a in range(3):
        window.position[k, a], window.velocity[k, a] = position[a], velocity[a]
        for b in range(3):
            window.attitude[k, a, b] = attitude[a, b]
    for a in range(2):
        window.field_of_view[k, a] = field_of_view[a]
    for a in range(TABLE_NODES):
        window.ranges[k, a], window.probabilities[k, a] = ranges[a], probabilities[a]
    return k


@jit_uncounted
def keep_plots(
    window: Window,
    z: FloatArray,
    variance: FloatArray,
    sight: FloatArray,
    order: IntArray,
    n: int,
    mine: FloatArray,
) -> tuple[float, int]:
    """Put the plots of the newest scan that no track explains into the window.

    Where there are more than there is room for, every so many-th in order of range is kept and the others are shed.

    Parameters
    ----------
    window : Window
    z, variance : ndarray, shape (K, 4)
    sight : ndarray, shape (K, 3)
    order : ndarray of int64, shape (K,)
        Places of the `n` plots, by ascending range.
    n : int
    mine : ndarray, shape (K,)
        Probability of each plot that some track made it.

    Returns
    -------
    expected : float
        How many plots no track made.
    shed : int
    """
    k, room = window.cursor[0], window.z.shape[1]
    free, expected = 0, 0.0
    for q in range(n):
        expected += 1.0 - min(mine[order[q]], 1.0)
        if mine[order[q]] < 0.5:
            free += 1
    number = 0
    for q in range(n):
        m = order[q]
        if mine[m] >= 0.5:
            continue
        number += 1
        # Plot number j is kept where j * room / free passes a whole number.
        if free > room and (number * room) // free == ((number - 1) * room) // free:
            continue
        c = window.filled[k]
        for a in range(4):
            window.z[k, c, a], window.variance[k, c, a] = z[m, a], variance[m, a]
        for a in range(3):
            window.sight[k, c, a] = sight[m, a]
            window.place[k, c, a] = window.position[k, a] + z[m, 0] * sight[m, a]
        window.used[k, c] = False
        window.filled[k] = c + 1
    return expected, max(free - room, 0)


def warmup() -> None:
    """Compile what Python calls."""
    window, zero, eye = make_window(2, 1), np.zeros(3), np.eye(3)
    table = np.ones(TABLE_NODES)
    open_window(window, 0.0, zero, zero, eye, np.ones(2), table, table, 1e-9)
    z, sight = np.ones((1, 4)), np.ones((1, 3))
    keep_plots(window, z, z, sight, np.zeros(1, np.int64), 1, np.zeros(1))
