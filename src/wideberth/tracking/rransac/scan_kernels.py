"""One scan of R-RANSAC (thesis algorithm 2), and a whole run of scans."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.tracking.motion_kernels import to_kinematics
from wideberth.tracking.radar_kernels import wrap
from wideberth.tracking.rransac.birth_kernels import find_track
from wideberth.tracking.rransac.filter_kernels import (
    gate_distance,
    inside_box,
    is_visible,
    predict_track,
    prepare_gate,
    update_track,
)
from wideberth.tracking.rransac.life_kernels import (
    add_track,
    cull,
    existence,
    find_ownship,
    is_reported,
    judge,
    record_look,
)
from wideberth.tracking.rransac.plot_kernels import BAD, INLIER, fill_slot, open_slot, read_plots
from wideberth.tracking.rransac.state_kernels import (
    ALIVE,
    DIVERGED,
    FILLED,
    ID,
    IS_OWN,
    MAHALANOBIS,
    N_COUNTS,
    NEAREST,
    RESTARTS,
    SCAN_BAD,
    SCAN_LATE,
    SCAN_REPEATED,
    ByteArray,
    Clock,
    Scan,
    Settings,
    Tracks,
    Window,
    Work,
    clear,
    make_clock,
    make_tracks,
    make_window,
    make_work,
    small_settings,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@jit_uncounted
def admit(s: Settings, window: Window, tracks: Tracks, clock: Clock, t: float, again: bool, counts: IntArray) -> bool:
    """Return whether a scan at time `t` is used; one long after or before the last one starts everything anew."""
    last = clock.t[0]
    if not math.isfinite(t):
        counts[SCAN_BAD] += 1
        return False
    if math.isnan(last):
        return True
    if t == last and not again:
        counts[SCAN_REPEATED] += 1
        return False
    if last - s.late <= t < last:
        counts[SCAN_LATE] += 1
        return False
    if t < last or t > last + s.gap:
        counts[RESTARTS] += 1
        clear(window, tracks, clock)
    return True


@jit_uncounted
def _distance(
    s: Settings, i: int, tracks: Tracks, scan: Scan, plot: FloatArray, position: FloatArray, work: Work
) -> float:
    """Return how far a plot is from track `i`, squared; infinity outside its gate."""
    if s.gate == MAHALANOBIS:
        square = gate_distance(s, i, tracks.x[i], position, work)
        return square if square <= s.gate_square else math.inf
    inside, square = inside_box(s, s.gate_box, scan.sigma, plot, work.predicted[i])
    return square if inside else math.inf


@jit_uncounted
def _best_plot(
    s: Settings,
    i: int,
    tracks: Tracks,
    scan: Scan,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    taken: ByteArray,
    work: Work,
) -> float:
    """Write the nearest free plot in the gate of track `i` to `work.best`, -1 for none; return its distance."""
    best, nearest = -1, math.inf
    for k in range(len(fate)):
        if fate[k] == BAD:
            continue
        square = _distance(s, i, tracks, scan, plots[k], positions[k], work)
        if square < math.inf:
            fate[k] = INLIER
            if not taken[k] and square < nearest:
                best, nearest = k, square
    work.best[i] = best
    return nearest


@jit_uncounted
def _update_nearest(
    s: Settings,
    tracks: Tracks,
    scan: Scan,
    slot: int,
    fresh: bool,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    taken: ByteArray,
    work: Work,
) -> None:
    """One plot to one track, the most likely pair first; a track whose plot is taken looks for its next one."""
    n = len(tracks.t_update)
    for k in range(len(taken)):
        taken[k] = 0
    for i in range(n):
        work.best[i] = -1
        if tracks.integers[i, ALIVE]:
            distance = _best_plot(s, i, tracks, scan, plots, positions, fate, taken, work)
            # Wide gates take plots less easily: the likelihood counts, not the distance alone.
            work.score[i] = distance + (work.score[i] if s.gate == MAHALANOBIS else 0.0)
    while True:
        first = -1
        for i in range(n):
            if tracks.integers[i, ALIVE] and work.best[i] >= 0 and (first < 0 or work.score[i] < work.score[first]):
                first = i
        if first < 0:
            break
        k = work.best[first]
        if taken[k]:
            before = _distance(s, first, tracks, scan, plots[k], positions[k], work)
            work.score[first] += _best_plot(s, first, tracks, scan, plots, positions, fate, taken, work) - before
            continue
        taken[k] = 1
        work.best[first] = -2 - k
    for i in range(n):
        if tracks.integers[i, ALIVE]:
            hit = work.best[i] <= -2
            tracks.nis[i] = math.nan
            record_look(s, tracks, i, slot, hit, is_visible(scan, work.predicted[i]), fresh, scan.t)
            if hit:
                k = -2 - work.best[i]
                tracks.nis[i] = update_track(
                    s,
                    s.model,
                    tracks.x[i],
                    tracks.p[i],
                    plots[k],
                    positions[k],
                    scan.sensor,
                    scan.attitude,
                    scan.sigma,
                    work,
                )


@jit_uncounted
def _update_mean(
    s: Settings,
    tracks: Tracks,
    scan: Scan,
    slot: int,
    fresh: bool,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    work: Work,
) -> None:
    """Each track with the mean of all its inliers: w_ij = 1/n, as the weights are not printed."""
    for i in range(len(tracks.t_update)):
        if not tracks.integers[i, ALIVE]:
            continue
        plot, position, expected = work.rows[9, 0:3], work.rows[9, 3:6], work.predicted[i]
        total = 0
        for j in range(3):
            plot[j] = 0.0
            position[j] = 0.0
        for k in range(len(fate)):
            if fate[k] == BAD or _distance(s, i, tracks, scan, plots[k], positions[k], work) == math.inf:
                continue
            fate[k] = INLIER
            total += 1
            for j in range(3):
                difference = plots[k, j] - expected[j]
                plot[j] += wrap(difference) if j == 1 else difference
                position[j] += positions[k, j]
        tracks.nis[i] = math.nan
        record_look(s, tracks, i, slot, total > 0, is_visible(scan, expected), fresh, scan.t)
        if total > 0:
            for j in range(3):
                plot[j] = expected[j] + plot[j] / total
                position[j] /= total
            tracks.nis[i] = update_track(
                s,
                s.model,
                tracks.x[i],
                tracks.p[i],
                plot,
                position,
                scan.sensor,
                scan.attitude,
                scan.sigma,
                work,
            )


@jit_uncounted
def take_scan(
    s: Settings,
    window: Window,
    tracks: Tracks,
    clock: Clock,
    work: Work,
    scan: Scan,
    again: bool,
    z: FloatArray,
    plots: FloatArray,
    positions: FloatArray,
    fate: ByteArray,
    taken: ByteArray,
    counts: IntArray,
) -> bool:
    """Run one scan through the tracker (thesis algorithm 2).

    Parameters
    ----------
    s : Settings
    window : Window
    tracks : Tracks
    clock : Clock
    work : Work
    scan : Scan
    again : bool
        Whether a scan of the same time as the last is another sensor's and no repetition.
    z : ndarray, shape (k, 3) or (k, 4)
        Range, azimuth, elevation.
    plots, positions : ndarray, shape (k, 3)
        Written over.
    fate, taken : ndarray of uint8, shape (k,)
        Written over.
    counts : ndarray of int64, shape (N_COUNTS,)

    Returns
    -------
    bool
        Whether the scan was used.
    """
    if not admit(s, window, tracks, clock, scan.t, again, counts):
        return False
    for a in range(3):
        sound = math.isfinite(scan.sensor[a])
        for b in range(3):
            sound = sound and math.isfinite(scan.attitude[a, b])
        if not sound:
            counts[SCAN_BAD] += 1
            return False
    dt = 0.0 if math.isnan(clock.t[0]) else scan.t - clock.t[0]
    fresh = dt > 0.0
    clock.t[0] = scan.t
    slot = open_slot(s, window, clock, tracks, scan)
    read_plots(s, scan, z, plots, positions, fate, counts)
    for i in range(len(tracks.t_update)):
        if tracks.integers[i, ALIVE]:
            predict_track(s, s.model, dt, tracks.x[i], tracks.p[i], work)
            if not prepare_gate(s, i, tracks.x[i], tracks.p[i], scan, work):
                tracks.integers[i, ALIVE] = 0
                counts[DIVERGED] += 1
    if s.weighting == NEAREST:
        _update_nearest(s, tracks, scan, slot, fresh, plots, positions, fate, taken, work)
    else:
        _update_mean(s, tracks, scan, slot, fresh, plots, positions, fate, work)
    fill_slot(s, window, slot, plots, positions, fate, counts)
    for k in range(window.n_plots[slot]):
        if not window.used[slot, k] and find_track(s, window, clock, k, counts, work) > 0:
            add_track(s, window, tracks, clock, counts, work)
    find_ownship(s, tracks, scan, slot, clock.integers[FILLED], work)
    cull(s, tracks, scan.t, counts)
    judge(s, tracks)
    return True


@jit_uncounted
def write_track(s: Settings, tracks: Tracks, i: int, dt: float, work: Work, x: FloatArray, p: FloatArray) -> None:
    """Write position, velocity and acceleration (9) of track `i` after `dt`, and their covariance (9, 9)."""
    for a in range(9):
        work.x[a] = tracks.x[i, a]
        for b in range(9):
            work.p[a, b] = tracks.p[i, a, b]
    if dt != 0.0:
        predict_track(s, s.model, dt, work.x, work.p, work)
    to_kinematics(s.model, work.x, work.p, x, p, work.f, work.square)
    if s.dimensions == 2:
        p[2, 2] += s.altitude_variance


@jit
def step_scan(
    s: Settings,
    window: Window,
    tracks: Tracks,
    clock: Clock,
    work: Work,
    t: float,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    field_of_view: FloatArray,
    range_max: float,
    ownship: FloatArray,
    again: bool,
    z: FloatArray,
    counts: IntArray,
) -> bool:
    """Run one scan, given as its parts (see `take_scan`), which makes the arrays for its plots."""
    n = len(z)
    scan = Scan(t, sensor, attitude, sigma, field_of_view[0], field_of_view[1], range_max, ownship)
    return take_scan(
        s,
        window,
        tracks,
        clock,
        work,
        scan,
        again,
        z,
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty(n, np.uint8),
        np.empty(n, np.uint8),
        counts,
    )


@jit
def run_scans(
    s: Settings,
    window: Window,
    tracks: Tracks,
    clock: Clock,
    work: Work,
    first: IntArray,
    z: FloatArray,
    t: FloatArray,
    sensor: FloatArray,
    attitude: FloatArray,
    sigma: FloatArray,
    field_of_view: FloatArray,
    range_max: float,
    detection_probability: float,
    ownship: FloatArray,
    counts: IntArray,
    out_scan: IntArray,
    out_id: IntArray,
    out_x: FloatArray,
    out_p: FloatArray,
    out_existence: FloatArray,
    out_own: ByteArray,
    out_nis: FloatArray,
) -> int:
    """Run a file of scans; the arguments are the arrays of `Plots`, and those of a `TrackTable` with enough rows.

    Returns
    -------
    int
        Rows written.
    """
    most = 0
    for k in range(len(t)):
        most = max(most, first[k + 1] - first[k])
    plots, positions = np.empty((most, 3)), np.empty((most, 3))
    fate, taken = np.empty(most, np.uint8), np.empty(most, np.uint8)
    rows = 0
    for k in range(len(t)):
        n = first[k + 1] - first[k]
        scan = Scan(t[k], sensor[k], attitude[k], sigma, field_of_view[0], field_of_view[1], range_max, ownship[k])
        used = take_scan(
            s,
            window,
            tracks,
            clock,
            work,
            scan,
            False,
            z[first[k] : first[k + 1]],
            plots[:n],
            positions[:n],
            fate[:n],
            taken[:n],
            counts,
        )
        if not used:
            continue
        for i in range(len(tracks.t_update)):
            if not is_reported(s, tracks, i):
                continue
            write_track(s, tracks, i, 0.0, work, out_x[rows], out_p[rows])
            out_scan[rows], out_id[rows] = k, tracks.integers[i, ID]
            out_existence[rows] = existence(s, tracks, i, detection_probability)
            out_own[rows] = tracks.integers[i, IS_OWN]
            out_nis[rows] = tracks.nis[i]
            rows += 1
    return rows


def warmup() -> None:
    """Compile what Python calls."""
    window, tracks, clock, work = make_window(4, 2), make_tracks(3, 4), make_clock(), make_work(3, 4, 2)
    s = small_settings()
    eye, z, counts = np.eye(3), np.array([[100.0, 0.1, 0.1, 0.0]]), np.zeros(N_COUNTS, np.int64)
    view, own = np.array([3.0, 1.5]), np.zeros(6)
    step_scan(s, window, tracks, clock, work, 0.0, np.full(3, 4.0), eye, s.sigma, view, 1e3, own, True, z, counts)
    write_track(s, tracks, 0, 0.1, work, np.zeros(9), np.zeros((9, 9)))
    run_scans(
        s, window, tracks, clock, work, np.arange(2), z, np.ones(1), np.ones((1, 3)), np.eye(3)[None].copy(), s.sigma,
        view, 1e3, 0.8, np.zeros((1, 6)), counts, np.zeros(3, np.int64), np.zeros(3, np.int64), np.zeros((3, 9)),
        np.zeros((3, 9, 9)), np.zeros(3), np.zeros(3, np.uint8), np.zeros(3),
    )  # fmt: skip
