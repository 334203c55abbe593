"""What R-RANSAC and ER-RANSAC remember: their settings, the window of scans, the stored tracks, and work space."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.unscented_kernels import POINT_ROWS, WORK_ROWS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ByteArray = NDArray[np.uint8]

# How a plot is found to belong to a track: thresholds for each element (thesis (3.10)), or the innovation covariance.
BOX, MAHALANOBIS = 0, 1
# How a plot updates a track: EKF on range and angles (thesis (3.6)-(3.9)), pseudo-measurements with a fixed R (thesis
# (4.9)-(4.13)), pseudo-measurements with the plot's own covariance along and across the line of sight, or an unscented
# filter on range and angles.
POLAR, PSEUDO, TANGENT, UNSCENTED = 0, 1, 2, 3
# Weights w_ij: the mean of all inliers of a track, or one plot to one track, the best pairs first.
MEAN, NEAREST = 0, 1
# How the ownship is told: inlier ratio of telemetry in range and angles, in states, or a running chi-square.
OWN_POLAR, OWN_STATES, OWN_CHI_SQUARE = 0, 1, 2
# What RANSAC fits: the turning model by Gauss-Newton, constant acceleration, or constant velocity.
FIT_TURNING, FIT_ACCELERATION, FIT_VELOCITY = 0, 1, 2

# Columns of `Tracks.integers`.
ALIVE, ID, AGE, MISSES, GOOD, HITS, OWN_HITS, IS_OWN, SPAN, SEEN, OWN_LOOKS = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
N_INTEGERS = 11

# Columns of `counts`.
NOT_FINITE, NOT_POSITIVE, BEYOND_CAP, NO_ALTITUDE, SCAN_REPEATED, SCAN_LATE, SCAN_BAD, RESTARTS, BORN, KILLED = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
)
MERGED, PRUNED, DIVERGED, FITS, FITS_FAILED = 10, 11, 12, 13, 14
N_COUNTS = 15

# Entries of `Clock.integers`: the last scan's slot in the window, slots filled, scans so far, tracks so far.
HEAD, FILLED, SCANS, TRACKS = 0, 1, 2, 3


class Settings(NamedTuple):
    """The settings, SI; see `config.RransacConfig` for what they mean."""

    model: int
    fit: int
    dimensions: int
    altitude: float
    altitude_variance: float
    cone_azimuth: bool
    seed: int
    window: int
    tracks: int
    plots: int
    sigma: FloatArray  # (3,) where the sensor does not say
    gate: int
    gate_box: FloatArray  # (3,) in standard deviations
    gate_square: float
    update: int
    scaling: FloatArray  # (3,) of the sigma points
    weighting: int
    fixed_variance: FloatArray  # (3,)
    process_per_s: FloatArray  # (9,)
    spectral: FloatArray  # (3,)
    iterations: int
    birth_box: FloatArray  # (3,) in standard deviations
    enough: int
    consensus: int
    unassociated: bool
    speed_max: float
    inflation: float
    begin: int
    end: int
    lifetime: int
    misses: int
    merge: FloatArray  # (9,)
    own_test: int
    own_box: FloatArray  # (6,)
    own_limit: float
    own_variance: FloatArray  # (2,)
    visible_only: bool
    gn_limits: FloatArray  # (9,)
    gn_prior: FloatArray  # (9,)
    gn_tolerance: float
    gn_iterations: int
    late: float
    gap: float


class Window(NamedTuple):
    """The last scans in a ring of slots, with the pose of the sensor in each."""

    t: FloatArray  # (N,)
    n_plots: IntArray  # (N,)
    z: FloatArray  # (N, cap, 3)
    position: FloatArray  # (N, cap, 3) NED
    used: ByteArray  # (N, cap)
    sensor: FloatArray  # (N, 3)
    attitude: FloatArray  # (N, 3, 3)
    sigma: FloatArray  # (N, 3)


class Tracks(NamedTuple):
    """Stored tracks, more slots than `Settings.tracks` as births come before pruning."""

    x: FloatArray  # (C, 9)
    p: FloatArray  # (C, 9, 9)
    integers: IntArray  # (C, N_INTEGERS)
    hits: ByteArray  # (C, N) inlier in each slot of the window
    own_hits: ByteArray  # (C, N)
    own_statistic: FloatArray  # (C,)
    t_update: FloatArray  # (C,)
    nis: FloatArray  # (C,) normalised innovation squared of the last scan's update, NaN without one


class Clock(NamedTuple):
    """Time of the last scan (1,), and counters (4,)."""

    t: FloatArray
    integers: IntArray


class Scan(NamedTuple):
    """One scan: when, from where, how good, and what the sensor can see."""

    t: float
    sensor: FloatArray  # (3,)
    attitude: FloatArray  # (3, 3)
    sigma: FloatArray  # (3,)
    azimuth_half: float
    elevation_half: float
    range_max: float
    ownship: FloatArray  # (6,)


class Work(NamedTuple):
    """Small arrays that kernels write into."""

    f: FloatArray  # (9, 9)
    square: FloatArray  # (9, 9)
    h: FloatArray  # (9, 9)
    rows: FloatArray  # (12, 9)
    predicted: FloatArray  # (C, 3) range and angles of each track
    axes: FloatArray  # (C, 3, 3) line of sight and two across
    factor: FloatArray  # (C, 3, 3) of the innovation covariance
    variance: FloatArray  # (C, 3)
    score: FloatArray  # (C,)
    best: IntArray  # (C,)
    uniform: FloatArray  # (4,)
    candidates: IntArray  # (N * cap, 2) slot, plot
    hit: IntArray  # (N,) plot of the consensus set in each slot, -1 none
    best_hit: IntArray  # (N,)
    subset: IntArray  # (3, 2)
    best_subset: IntArray  # (3, 2)
    x: FloatArray  # (9,)
    best_x: FloatArray  # (9,)
    p: FloatArray  # (9, 9)
    best_p: FloatArray  # (9, 9)
    fit_plots: FloatArray  # (3, 3)
    fit_times: FloatArray  # (3,)
    fit_sensor: FloatArray  # (3, 3)
    fit_attitude: FloatArray  # (3, 3, 3)
    start: FloatArray  # (9,)
    fit: FloatArray  # (30, 9)
    points: FloatArray  # (POINT_ROWS, 9) of the unscented filter
    seen: FloatArray  # (POINT_ROWS, 4)
    unscented: FloatArray  # (WORK_ROWS, 9)


@jit_uncounted
def clear(window: Window, tracks: Tracks, clock: Clock) -> None:
    """Forget scans and tracks, but neither the numbers of scans nor the names of tracks."""
    for slot in range(len(window.n_plots)):
        window.n_plots[slot] = 0
    for i in range(len(tracks.t_update)):
        tracks.integers[i, ALIVE] = 0
    clock.t[0] = math.nan
    clock.integers[HEAD] = 0
    clock.integers[FILLED] = 0


def small_settings() -> Settings:
    """Return settings with which kernels can be compiled: a window of 4 scans of 2 plots, 2 tracks."""
    three, nine = np.full(3, 4.0), np.full(9, 4.0)
    return Settings(
        0, 2, 3, 0.0, 0.0, False, 0, 4, 2, 2, np.full(3, 0.1), 0, three, 16.0, 0, three, 0, three, nine, three,
        5, three, 4, 2, False, 0.0, 1.0, 2, 1, 0, 3, nine, 0, np.full(6, 4.0), 0.5, np.ones(2), False,
        nine, nine, 1e-9, 5, 1.0, 5.0,
    )  # fmt: skip


def make_window(scans: int, plots: int) -> Window:
    """Return an empty window of `scans` scans of up to `plots` plots."""
    return Window(
        t=np.zeros(scans),
        n_plots=np.zeros(scans, np.int64),
        z=np.zeros((scans, plots, 3)),
        position=np.zeros((scans, plots, 3)),
        used=np.zeros((scans, plots), np.uint8),
        sensor=np.zeros((scans, 3)),
        attitude=np.zeros((scans, 3, 3)),
        sigma=np.zeros((scans, 3)),
    )


def make_tracks(capacity: int, scans: int) -> Tracks:
    """Return room for `capacity` tracks."""
    return Tracks(
        x=np.zeros((capacity, 9)),
        p=np.zeros((capacity, 9, 9)),
        integers=np.zeros((capacity, N_INTEGERS), np.int64),
        hits=np.zeros((capacity, scans), np.uint8),
        own_hits=np.zeros((capacity, scans), np.uint8),
        own_statistic=np.zeros(capacity),
        t_update=np.zeros(capacity),
        nis=np.full(capacity, math.nan),
    )


def make_clock() -> Clock:
    """Return a clock before the first scan."""
    return Clock(np.full(1, math.nan), np.zeros(4, np.int64))


def make_work(capacity: int, scans: int, plots: int) -> Work:
    """Return work space for so many tracks and such a window."""
    return Work(
        f=np.zeros((9, 9)),
        square=np.zeros((9, 9)),
        h=np.zeros((9, 9)),
        rows=np.zeros((12, 9)),
        predicted=np.zeros((capacity, 3)),
        axes=np.zeros((capacity, 3, 3)),
        factor=np.zeros((capacity, 3, 3)),
        variance=np.zeros((capacity, 3)),
        score=np.zeros(capacity),
        best=np.zeros(capacity, np.int64),
        uniform=np.zeros(4),
        candidates=np.zeros((scans * plots, 2), np.int64),
        hit=np.zeros(scans, np.int64),
        best_hit=np.zeros(scans, np.int64),
        subset=np.zeros((3, 2), np.int64),
        best_subset=np.zeros((3, 2), np.int64),
        x=np.zeros(9),
        best_x=np.zeros(9),
        p=np.zeros((9, 9)),
        best_p=np.zeros((9, 9)),
        fit_plots=np.zeros((3, 3)),
        fit_times=np.zeros(3),
        fit_sensor=np.zeros((3, 3)),
        fit_attitude=np.zeros((3, 3, 3)),
        start=np.zeros(9),
        fit=np.zeros((30, 9)),
        points=np.zeros((POINT_ROWS, 9)),
        seen=np.zeros((POINT_ROWS, 4)),
        unscented=np.zeros((WORK_ROWS, 9)),
    )


def warmup() -> None:
    """Compile what Python calls."""
    clear(make_window(1, 1), make_tracks(1, 1), make_clock())
