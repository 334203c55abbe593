"""A straight flight fitted to plots of the window: weighted least squares with a prior on the velocity.

The fit is a position and a velocity at one time; plots of any other time are taken in by what they say of those, so
their order does not matter.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.sighting_kernels import (
    element_variances,
    frame_at,
    innovation,
    projected,
    sight_rows,
)
from wideberth.tracking.multi_target.window_kernels import Window, make_window
from wideberth.tracking.radar_kernels import range_rate_gradient
from wideberth.tracking.update_kernels import update

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WIDE_M = 1000.0
"""Prior spread of the position where all plots are fitted once more around the first fit."""


class FitScratch(NamedTuple):
    """A fit and its buffers.

    Attributes
    ----------
    x, p : ndarray, shape (6,), (6, 6)
        Position and velocity at the fit's time, NED.
    at : ndarray, shape (6,)
        The same at a scan's time.
    frame, look, spread : ndarray
        How the scan's sensor sees that (`frame_at`), and its variances out, across and up.
    chosen : ndarray of int64, shape (W,)
        Which plot of each scan is used; -1 none.
    e, r, h, cov, work, other_x, other_p, best_x, best : ndarray
        Scratch.
    """

    x: FloatArray
    p: FloatArray
    at: FloatArray
    frame: FloatArray
    look: FloatArray
    spread: FloatArray
    chosen: IntArray
    e: FloatArray
    r: FloatArray
    h: FloatArray
    cov: FloatArray
    work: FloatArray
    other_x: FloatArray
    other_p: FloatArray
    best_x: FloatArray
    best: IntArray


def make_fit_scratch(scans: int) -> FitScratch:
    """Return buffers for a window of so many scans."""
    return FitScratch(
        x=np.zeros(6),
        p=np.zeros((6, 6)),
        at=np.zeros(6),
        frame=np.zeros((3, 3)),
        look=np.zeros(3),
        spread=np.zeros(3),
        chosen=np.zeros(scans, np.int64),
        e=np.zeros(4),
        r=np.zeros(4),
        h=np.zeros((4, 6)),
        cov=np.zeros((3, 3)),
        work=np.zeros((2, 6)),
        other_x=np.zeros(6),
        other_p=np.zeros((6, 6)),
        best_x=np.zeros(6),
        best=np.zeros(scans, np.int64),
    )


@jit_uncounted
def compare(window: Window, k: int, m: int, across: float, up: float, s: FitScratch) -> bool:
    """Write innovation `s.e` and variances `s.r` of a plot against `s.at`; return whether it has a range rate."""
    element_variances(s.look, across, up, window.variance[k, m], s.r)
    innovation(
        window.position[k],
        window.velocity[k],
        s.frame,
        s.look,
        across,
        up,
        s.at,
        window.z[k, m],
        window.sight[k, m],
        s.e,
    )
    return not math.isnan(s.e[3])


@jit_uncounted
def derive(window: Window, k: int, tau: float, rate: bool, s: FitScratch) -> int:
    """Write the derivatives `s.h` of a plot's elements to the fit, `tau` after its time; return how many there are."""
    for i in range(3):
        for j in range(3):
            s.h[i, j] = s.frame[i, j]
            s.h[i, 3 + j] = tau * s.frame[i, j]
    if not rate:
        return 3
    range_rate_gradient(window.position[k], window.velocity[k], s.at, s.h[3])
    for j in range(3):
        s.h[3, 3 + j] += tau * s.h[3, j]
    return 4


@jit_uncounted
def begin_fit(window: Window, k: int, m: int, speed_sigma: float, s: FitScratch) -> None:
    """Start a fit from one plot: its position, and a velocity around zero."""
    for i in range(6):
        s.x[i] = window.place[k, m, i] if i < 3 else 0.0
        for j in range(6):
            s.p[i, j] = 0.0
        if i >= 3:
            s.p[i, i] = speed_sigma * speed_sigma
    frame_at(window.position[k], window.attitude[k], s.x, s.frame, s.look)
    element_variances(s.look, 0.0, 0.0, window.variance[k, m], s.r)
    if math.isnan(window.z[k, m, 2]):
        # Anywhere in the height of the field of view.
        s.r[2] = (s.look[0] * window.field_of_view[k, 1]) ** 2 / 3.0
    for i in range(3):
        for j in range(3):
            total = 0.0
            for a in range(3):
                total += s.frame[a, i] * s.r[a] * s.frame[a, j]
            s.p[i, j] = total
    if window.z[k, m, 3] == window.z[k, m, 3]:
        for i in range(6):
            s.at[i] = s.x[i]
        variance = s.r[2]
        compare(window, k, m, 0.0, 0.0, s)
        s.e[0], s.e[1], s.e[2], s.r[2] = math.nan, math.nan, math.nan, variance
        sight_rows(window.position[k], window.velocity[k], s.frame, s.x, True, s.h)
        update(6, 4, s.x, s.p, s.h, s.e, s.r, s.work)


@jit_uncounted
def look_back(window: Window, k: int, tau: float, s: FitScratch) -> None:
    """Write where the fit was `tau` from its own time, seen by scan `k`: frame, look and the spreads along it."""
    for i in range(3):
        s.at[i] = s.x[i] + tau * s.x[3 + i]
        s.at[3 + i] = s.x[3 + i]
        for j in range(3):
            s.cov[i, j] = s.p[i, j] + tau * (s.p[i, 3 + j] + s.p[3 + i, j] + tau * s.p[3 + i, 3 + j])
    frame_at(window.position[k], window.attitude[k], s.at, s.frame, s.look)
    for i in range(3):
        s.spread[i] = projected(s.frame, s.cov, i)


@jit_uncounted
def gate_square(window: Window, k: int, m: int, s: FitScratch) -> float:
    """Return an estimate of the normalised distance squared of a plot, from the diagonal in the looked-back frame."""
    compare(window, k, m, s.spread[1], s.spread[2], s)
    total = 0.0
    for i in range(3):
        if not math.isnan(s.e[i]):
            total += s.e[i] * s.e[i] / (s.r[i] + s.spread[i])
    return total


@jit_uncounted
def fit_plot(
    window: Window, k: int, m: int, tau: float, x: FloatArray, p: FloatArray, s: FitScratch
) -> tuple[float, float]:
    """Take a plot of scan `k` into a fit (`x`, `p`), `tau` after its time; `look_back` must have been called.

    Returns
    -------
    nis, log_likelihood : float
    """
    rate = compare(window, k, m, s.spread[1], s.spread[2], s)
    elements = derive(window, k, tau, rate, s)
    return update(6, elements, x, p, s.h, s.e, s.r, s.work)


@jit_uncounted
def refit(window: Window, k0: int, speed_sigma: float, s: FitScratch) -> None:
    """Fit all chosen plots once more, along the directions of the first fit (a second step of Gauss-Newton).

    The plot that the first fit began with had its errors along its own direction; here all have those of the fit.

    Parameters
    ----------
    window : Window
    k0 : int
        The scan at whose time the fit is.
    speed_sigma : float
        Prior spread of each component of the velocity, m/s.
    s : FitScratch
        The first fit in `s.x` and `s.chosen`; the new one is left in `s.x` and `s.p`.
    """
    size = window.t.shape[0]
    for i in range(6):
        for j in range(6):
            s.p[i, j], s.other_p[i, j] = 0.0, 0.0
        # The prior of the velocity is centred on zero.
        s.other_x[i] = s.x[i] if i < 3 else 0.0
        s.other_p[i, i] = WIDE_M * WIDE_M if i < 3 else speed_sigma * speed_sigma
    k = k0
    for _ in range(window.cursor[1]):
        m = s.chosen[k]
        if m >= 0:
            tau = window.t[k] - window.t[k0]
            look_back(window, k, tau, s)
            rate = compare(window, k, m, 0.0, 0.0, s)
            elements = derive(window, k, tau, rate, s)
            # Measured minus predicted by the running fit, linear around the first one.
            for a in range(elements):
                for j in range(6):
                    s.e[a] += s.h[a, j] * (s.x[j] - s.other_x[j])
            update(6, elements, s.other_x, s.other_p, s.h, s.e, s.r, s.work)
        k = k - 1 if k > 0 else size - 1
    for i in range(6):
        s.x[i] = s.other_x[i]
        for j in range(6):
            s.p[i, j] = s.other_p[i, j]


def warmup() -> None:
    """Compile what Python calls."""
    window, s = make_window(2, 1), make_fit_scratch(2)
    window.attitude[:], window.z[:], window.variance[:] = np.eye(3), 1.0, 1e-4
    window.cursor[:] = 0, 1
    begin_fit(window, 0, 0, 30.0, s)
    look_back(window, 0, 0.0, s)
    gate_square(window, 0, 0, s)
    fit_plot(window, 0, 0, 0.0, s.x, s.p, s)
    refit(window, 0, 30.0, s)
