"""Which track of a ground radar is the ownship: a running chi-square test against telemetry, and the printed rule.

A radar that sees all aircraft sees the ownship as well (thesis 4.2). The printed rule counts how often the telemetry
lies within a gate around a track's position; an intruder that passes close by collects such hits too. Here position and
velocity are tested together, and three things must hold before a track is called the ownship:

1. Telemetry explains the track: the mean over some seconds of d' S^-1 d (d the difference of position and velocity, S
   the sum of both covariances; chi-square with 6 degrees of freedom) is below the quantile of the miss rate. Errors of
   filters and of satellite navigation last longer than those seconds, so the mean counts as *one* look.
2. Telemetry explains it better than other traffic does: log-likelihood of d under N(0, S) minus that under traffic
   spread over a sphere around the ownship. A track too uncertain to tell the two apart fails here.
3. No other track is nearly as good: the same margin to the next best.

A track keeps the name while 1 holds and 2 is not turned round, unless another wins by the margin. So there is at most
one, a track that telemetry does not explain is never it, and two that cannot be told apart are both intruders.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, log_determinant, whitened_square
from wideberth.tracking.radar_kernels import to_plot, to_sensor, wrap
from wideberth.tracking.update_kernels import LOG_2PI

FloatArray = NDArray[np.float64]
ByteArray = NDArray[np.uint8]
IntArray = NDArray[np.int64]

CHI_SQUARE, WEIGHT, EVIDENCE, LAST, FLAG = 0, 1, 2, 3, 4
STATE_WIDTH = 5
"""Numbers kept for each track: decayed integral of the chi-square over time and of time itself (s), evidence for the
ownship against other traffic (log), chi-square of the last look, and 1 for the ownship. All zero: no look yet."""

WORK_ROWS = 14
"""Rows (of 6) of the work buffer."""


class OwnshipTest(NamedTuple):
    """Numbers of the test, from `wideberth.tracking.ownship.ownship_test`.

    Attributes
    ----------
    window_s : float
        Time constant of the running mean.
    settle_s : float
        Seconds of looks before a track can become the ownship.
    mean_limit, look_limit : float
        Largest chi-square of the running mean and of a single look.
    margin : float
        Log of the odds that decide.
    log_density : float
        Log of the density of other traffic in position and velocity around the ownship.
    """

    window_s: float
    settle_s: float
    mean_limit: float
    look_limit: float
    margin: float
    log_density: float


@jit_uncounted
def telemetry_known(telemetry: FloatArray, covariance: FloatArray) -> bool:
    """Return whether position and velocity (6) of the ownship and their variances are all finite."""
    known = True
    for i in range(6):
        known = known and math.isfinite(telemetry[i]) and math.isfinite(covariance[i, i])
    return known


@jit_uncounted
def look(
    dt: float,
    x: FloatArray,
    p: FloatArray,
    telemetry: FloatArray,
    covariance: FloatArray,
    test: OwnshipTest,
    state: FloatArray,
    work: FloatArray,
) -> None:
    """Compare one track with telemetry, and bring its numbers up to date.

    Parameters
    ----------
    dt : float
        Time since the last look, s.
    x : ndarray, shape (6,) or more
        Position and velocity of the track, NED, at the time of the telemetry.
    p : ndarray, shape (6, 6) or more
    telemetry : ndarray, shape (6,)
        Position and velocity of the ownship, NED; finite.
    covariance : ndarray, shape (6, 6)
        Of the telemetry.
    test : OwnshipTest
    state : ndarray, shape (STATE_WIDTH,)
        Of the track, changed in place. A track that is not finite, or whose covariance is none, starts again.
    work : ndarray, shape (WORK_ROWS, 6)
        Written over.
    """
    total, factor, d, whitened = work[0:6], work[6:12], work[12], work[13]
    for i in range(6):
        d[i] = x[i] - telemetry[i]
        for j in range(6):
            total[i, j] = p[i, j] + covariance[i, j]
    square = math.nan
    if cholesky(total, 6, factor):
        square = whitened_square(factor, 6, d, whitened)
    if not math.isfinite(square):
        for i in range(STATE_WIDTH):
            state[i] = 0.0
        return
    decay = math.exp(-dt / test.window_s)
    # One look far off must not be held against a track for long once it is back, as after two tracks swap targets.
    counted = min(square, 2.0 * test.look_limit)
    state[CHI_SQUARE] = decay * state[CHI_SQUARE] + dt * counted
    state[WEIGHT] = decay * state[WEIGHT] + dt
    state[LAST] = square
    mean = state[CHI_SQUARE] / state[WEIGHT] if state[WEIGHT] > 0.0 else counted
    state[EVIDENCE] = -0.5 * (mean + log_determinant(factor, 6) + 6.0 * LOG_2PI) - test.log_density


@jit_uncounted
def forget(dt: float, test: OwnshipTest, state: FloatArray) -> None:
    """Let a track's numbers (STATE_WIDTH,) fade over `dt` without telemetry: nothing is the ownship meanwhile."""
    decay = math.exp(-dt / test.window_s)
    state[CHI_SQUARE] *= decay
    state[WEIGHT] *= decay
    state[FLAG] = 0.0


@jit_uncounted
def explained(test: OwnshipTest, state: FloatArray) -> bool:
    """Return whether telemetry explains a track, by its numbers (STATE_WIDTH,)."""
    weight = state[WEIGHT]
    return bool(weight > 0.0 and state[CHI_SQUARE] <= test.mean_limit * weight and state[LAST] <= test.look_limit)


@jit_uncounted
def choose(n: int, test: OwnshipTest, states: FloatArray) -> int:
    """Decide which of `n` tracks is the ownship.

    Parameters
    ----------
    n : int
    test : OwnshipTest
    states : ndarray, shape (n or more, STATE_WIDTH)
        After `look` at each; the flags are written. Rows of zeros are passed over.

    Returns
    -------
    int
        The track, or -1 for none.
    """
    settled = test.window_s * (1.0 - math.exp(-test.settle_s / test.window_s))
    best, second, held = -1, -1, -1
    for i in range(n):
        if states[i, WEIGHT] <= 0.0:
            continue
        if states[i, FLAG] != 0.0 and explained(test, states[i]) and states[i, EVIDENCE] > 0.0:
            held = i
        states[i, FLAG] = 0.0
        if best < 0 or states[i, EVIDENCE] > states[best, EVIDENCE]:
            best, second = i, best
        elif second < 0 or states[i, EVIDENCE] > states[second, EVIDENCE]:
            second = i
    chosen = held
    if best >= 0 and best != held:
        strong = (
            states[best, WEIGHT] >= settled
            and explained(test, states[best])
            and states[best, EVIDENCE] >= test.margin
            and (second < 0 or states[best, EVIDENCE] - states[second, EVIDENCE] >= test.margin)
        )
        if strong:
            chosen = best
    if chosen >= 0:
        states[chosen, FLAG] = 1.0
    return chosen


@jit_uncounted
def identify(
    n: int,
    dt: float,
    x: FloatArray,
    p: FloatArray,
    telemetry: FloatArray,
    covariance: FloatArray,
    test: OwnshipTest,
    states: FloatArray,
    work: FloatArray,
) -> int:
    """Compare `n` tracks with telemetry and decide which is the ownship: one scan.

    Parameters
    ----------
    n : int
    dt : float
        Time since the last scan, s.
    x : ndarray, shape (n or more, 6 or more)
        Position and velocity of the tracks, NED.
    p : ndarray, shape (n or more, 6 or more, 6 or more)
    telemetry : ndarray, shape (6,)
        Position and velocity of the ownship, NED; anything not finite: no telemetry, and no track is the ownship.
    covariance : ndarray, shape (6, 6)
    test : OwnshipTest
    states : ndarray, shape (n or more, STATE_WIDTH)
        Changed in place. The caller moves rows with their tracks and sets those of new tracks to zero.
    work : ndarray, shape (WORK_ROWS, 6)
        Written over.

    Returns
    -------
    int
        The track, or -1 for none.
    """
    known = telemetry_known(telemetry, covariance)
    for i in range(n):
        if known:
            look(dt, x[i], p[i], telemetry, covariance, test, states[i], work)
        else:
            forget(dt, test, states[i])
    return choose(n, test, states) if known else -1


@jit_uncounted
def inside_plot_gate(
    x: FloatArray,
    telemetry: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    gate: FloatArray,
    work: FloatArray,
) -> bool:
    """Return whether the ownship, as the radar would see it, is an inlier of a track: (3.10), as printed in 4.2.

    Parameters
    ----------
    x, telemetry : ndarray, shape (3,) or more
        Positions of the track and of the ownship, NED.
    sensor : ndarray, shape (3,)
    attitude : ndarray, shape (3, 3)
        C_ned_sensor.
    gate : ndarray, shape (3,)
        Half-widths in range (m), azimuth and elevation (rad): tau_R.
    work : ndarray, shape (3, 3)
        Written over.
    """
    seen, a, b = work[0], work[1], work[2]
    to_sensor(sensor, attitude, x, seen)
    to_plot(seen, a)
    to_sensor(sensor, attitude, telemetry, seen)
    to_plot(seen, b)
    return bool(abs(a[0] - b[0]) < gate[0] and abs(wrap(a[1] - b[1])) < gate[1] and abs(a[2] - b[2]) < gate[2])


@jit_uncounted
def inside_state_gate(x: FloatArray, telemetry: FloatArray, gate: FloatArray) -> bool:
    """Return whether position and velocity (6) of the ownship lie within half-widths (6) of a track's.

    Table 4.5 lists such half-widths for the ownship (20 m, 10 m/s); the text does not say what they are for.
    """
    inside = True
    for i in range(6):
        inside = inside and abs(x[i] - telemetry[i]) < gate[i]
    return inside


@jit_uncounted
def count_inlier(inlier: bool, consensus: ByteArray, counts: IntArray) -> float:
    """Add a look to a track's ownship consensus set, and return its ownship inlier ratio rho_o (thesis 4.2).

    Parameters
    ----------
    inlier : bool
    consensus : ndarray of uint8, shape (N,)
        The last N looks, in a ring.
    counts : ndarray of int64, shape (2,)
        Looks so far and inliers in the ring.

    Returns
    -------
    float
        Inliers over N, as printed: a young track has a small ratio.
    """
    size = len(consensus)
    slot = counts[0] % size
    counts[1] += int(inlier) - int(consensus[slot])
    consensus[slot] = inlier
    counts[0] += 1
    ratio: float = counts[1] / size
    return ratio


def warmup() -> None:
    """Compile what Python calls."""
    test = OwnshipTest(3.0, 0.5, 22.0, 35.0, 9.0, -25.0)
    x, p, states, work = np.zeros((2, 9)), np.tile(np.eye(9), (2, 1, 1)), np.zeros((2, STATE_WIDTH)), np.zeros((14, 6))
    identify(2, 0.1, x, p, np.zeros(6), np.eye(6), test, states, work)
    look(0.1, x[0], p[0], np.zeros(6), np.eye(6), test, states[0], work)
    forget(0.1, test, states[0])
    explained(test, states[0])
    choose(2, test, states)
    zero, eye = np.zeros(3), np.eye(3)
    inside_plot_gate(x[0], np.ones(6), zero, eye, np.ones(3), np.zeros((3, 3)))
    inside_state_gate(x[0], np.ones(6), np.ones(6))
    count_inlier(True, np.zeros(50, np.uint8), np.zeros(2, np.int64))
