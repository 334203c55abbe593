"""The life of R-RANSAC's tracks: birth, support, merging, pruning, death, and which one is the ownship."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.matrix_kernels import cholesky, whitened_square
from wideberth.tracking.motion_kernels import TURNING, state_count, to_kinematics
from wideberth.tracking.radar_kernels import wrap
from wideberth.tracking.rransac.consensus_kernels import slot_back
from wideberth.tracking.rransac.filter_kernels import expected_plot, inside_box
from wideberth.tracking.rransac.state_kernels import (
    AGE,
    ALIVE,
    BORN,
    DIVERGED,
    FILLED,
    GOOD,
    HEAD,
    HITS,
    ID,
    IS_OWN,
    KILLED,
    MERGED,
    MISSES,
    OWN_CHI_SQUARE,
    OWN_HITS,
    OWN_LOOKS,
    OWN_POLAR,
    PRUNED,
    SEEN,
    SPAN,
    TRACKS,
    Clock,
    Scan,
    Settings,
    Tracks,
    Window,
    Work,
    make_tracks,
    small_settings,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_OWN_MEMORY = 20
_OWN_LOOKS = 3
_LOST_M2 = 1e8  # a position this uncertain is none


@jit_uncounted
def add_track(s: Settings, window: Window, tracks: Tracks, clock: Clock, counts: IntArray, work: Work) -> None:
    """Store the track that RANSAC has found; where all slots are taken, instead of the one with the least support."""
    head, filled = clock.integers[HEAD], clock.integers[FILLED]
    place, least = -1, 1 << 30
    for i in range(len(tracks.t_update)):
        if not tracks.integers[i, ALIVE]:
            place = i
            break
        if tracks.integers[i, HITS] < least:
            place, least = i, tracks.integers[i, HITS]
    if tracks.integers[place, ALIVE]:
        counts[PRUNED] += 1
    for j in range(len(tracks.integers[place])):
        tracks.integers[place, j] = 0
    for k in range(s.window):
        tracks.hits[place, k] = 0
        tracks.own_hits[place, k] = 0
    for back in range(filled):
        k = slot_back(head, back, s.window)
        if work.best_hit[k] >= 0:
            tracks.hits[place, k] = 1
            tracks.integers[place, HITS] += 1
            tracks.integers[place, SPAN] = back + 1
            window.used[k, work.best_hit[k]] = 1
    for i in range(state_count(s.model)):
        tracks.x[place, i] = work.best_x[i]
        for j in range(state_count(s.model)):
            tracks.p[place, i, j] = work.best_p[i, j]
    tracks.own_statistic[place] = 0.0
    tracks.nis[place] = math.nan
    tracks.integers[place, ALIVE] = 1
    tracks.integers[place, SEEN] = 1
    tracks.integers[place, ID] = clock.integers[TRACKS]
    clock.integers[TRACKS] += 1
    tracks.t_update[place] = window.t[head]
    counts[BORN] += 1


@jit_uncounted
def record_look(
    s: Settings, tracks: Tracks, i: int, slot: int, hit: bool, visible: bool, fresh: bool, t: float
) -> None:
    """Write into track `i` whether the scan in `slot` supported it; `fresh`: the first scan of its time."""
    tracks.integers[i, AGE] += 1
    tracks.integers[i, SPAN] = min(tracks.integers[i, SPAN] + 1, s.window)
    tracks.integers[i, SEEN] = visible or (not fresh and tracks.integers[i, SEEN] > 0)
    if hit:
        tracks.hits[i, slot] = 1
        tracks.integers[i, HITS] += 1
        tracks.integers[i, MISSES] = 0
        tracks.t_update[i] = t
    elif visible or not s.visible_only:
        tracks.integers[i, MISSES] += 1


@jit_uncounted
def _same(s: Settings, model: int, a: FloatArray, b: FloatArray) -> bool:
    for i in range(state_count(model)):
        difference = a[i] - b[i]
        if model == TURNING and i == 4:
            difference = wrap(difference)
        if not abs(difference) < s.merge[i]:
            return False
    return True


@jit_uncounted
def _better(tracks: Tracks, i: int, j: int) -> bool:
    """Return whether track `i` is kept rather than `j`: a good one, with more support, that is older."""
    a, b = tracks.integers[i], tracks.integers[j]
    if a[GOOD] != b[GOOD]:
        return bool(a[GOOD] > b[GOOD])
    if a[HITS] != b[HITS]:
        return bool(a[HITS] > b[HITS])
    return bool(a[ID] < b[ID])


@jit_uncounted
def cull(s: Settings, tracks: Tracks, t: float, counts: IntArray) -> None:
    """Kill, merge and prune (thesis algorithm 2, lines 13 and 14).

    A track dies after `misses` looks in a row without an inlier: the fixed rule of table 4.5 (CMD) in place of the
    random one of line 13, with which the same plots would not give the same tracks. Two tracks whose states differ by
    less than the merge thresholds are one; the better is kept. A track without plots for the longest gap dies too: one
    out of sight may have no misses.
    """
    n = len(tracks.t_update)
    states = state_count(s.model)
    for i in range(n):
        if not tracks.integers[i, ALIVE]:
            continue
        if tracks.integers[i, MISSES] >= s.misses or t > tracks.t_update[i] + s.gap:
            tracks.integers[i, ALIVE] = 0
            counts[KILLED] += 1
            continue
        sound = True
        for j in range(states):
            sound = sound and math.isfinite(tracks.x[i, j]) and tracks.p[i, j, j] >= 0.0
        if not (sound and tracks.p[i, 0, 0] + tracks.p[i, 1, 1] < _LOST_M2):
            tracks.integers[i, ALIVE] = 0
            counts[DIVERGED] += 1
    for i in range(n):
        for j in range(i):
            if tracks.integers[i, ALIVE] and tracks.integers[j, ALIVE] and _same(s, s.model, tracks.x[i], tracks.x[j]):
                worse = j if _better(tracks, i, j) else i
                tracks.integers[worse, ALIVE] = 0
                counts[MERGED] += 1
    while True:
        alive, worst = 0, -1
        for i in range(n):
            if tracks.integers[i, ALIVE]:
                alive += 1
                if worst < 0 or _better(tracks, worst, i):
                    worst = i
        if alive <= s.tracks:
            break
        tracks.integers[worst, ALIVE] = 0
        counts[PRUNED] += 1


@jit_uncounted
def judge(s: Settings, tracks: Tracks) -> None:
    """Tell the good tracks by support and lifetime, with one threshold to begin and a lower one to end (3.2.4)."""
    for i in range(len(tracks.t_update)):
        support = tracks.integers[i, HITS]
        if tracks.integers[i, GOOD]:
            tracks.integers[i, GOOD] = support >= s.end
        else:
            tracks.integers[i, GOOD] = support >= s.begin and tracks.integers[i, AGE] > s.lifetime


@jit_uncounted
def find_ownship(s: Settings, tracks: Tracks, scan: Scan, slot: int, filled: int, work: Work) -> None:
    """Tell which tracks are the ownship's from its telemetry (thesis 4.2); nothing changes without telemetry.

    As printed, each scan in which the telemetry is an inlier of the track counts, and a track whose ratio is above the
    limit is the ownship's. With the chi-square, at most one: the one whose position and velocity stay nearest to the
    telemetry in terms of their covariance, if that is near enough.
    """
    own = scan.ownship
    for i in range(6):
        if not math.isfinite(own[i]):
            return
    kinematic, covariance = work.rows[10], work.p
    seen, expected = work.rows[0, 0:3], work.rows[1, 0:3]
    expected_plot(own, scan.sensor, scan.attitude, seen, expected)
    nearest, least = -1, math.inf
    for i in range(len(tracks.t_update)):
        if not tracks.integers[i, ALIVE]:
            continue
        x, p = tracks.x[i], tracks.p[i]
        if s.own_test == OWN_POLAR:
            state = work.rows[2, 0:3]
            expected_plot(x, scan.sensor, scan.attitude, seen, state)
            hit, _ = inside_box(s, s.gate_box, scan.sigma, expected, state)
        else:
            to_kinematics(s.model, x, p, kinematic, covariance, work.f, work.h)
            hit = True
            for k in range(6):
                kinematic[k] = own[k] - kinematic[k]
                if s.dimensions == 2 and k % 3 == 2:
                    continue
                hit = hit and abs(kinematic[k]) < s.own_box[k]
            if s.own_test == OWN_CHI_SQUARE:
                for k in range(6):
                    covariance[k, k] += s.own_variance[k // 3]
                if not cholesky(covariance, 6, work.square):
                    continue
                square = whitened_square(work.square, 6, kinematic, work.rows[11])
                looks = min(tracks.integers[i, OWN_LOOKS] + 1, _OWN_MEMORY)
                tracks.integers[i, OWN_LOOKS] = looks
                tracks.own_statistic[i] += (square / 6.0 - tracks.own_statistic[i]) / looks
                tracks.integers[i, IS_OWN] = 0
                if looks >= _OWN_LOOKS and tracks.own_statistic[i] < min(least, s.own_limit):
                    nearest, least = i, tracks.own_statistic[i]
                continue
        if hit:
            tracks.own_hits[i, slot] = 1
            tracks.integers[i, OWN_HITS] += 1
        tracks.integers[i, IS_OWN] = tracks.integers[i, OWN_HITS] > s.own_limit * s.window
    if s.own_test == OWN_CHI_SQUARE and nearest >= 0:
        tracks.integers[nearest, IS_OWN] = 1


@jit_uncounted
def existence(s: Settings, tracks: Tracks, i: int, detection_probability: float) -> float:
    """Return the support of a track as a share of what an aircraft would have had since the track's first plot."""
    span = max(tracks.integers[i, SPAN], 1)
    return float(min(1.0, tracks.integers[i, HITS] / (detection_probability * span)))


@jit_uncounted
def is_reported(s: Settings, tracks: Tracks, i: int) -> bool:
    """Return whether a track is answered: alive, good, and where it is asked for, in sight."""
    row = tracks.integers[i]
    return bool(row[ALIVE] and row[GOOD] and (row[SEEN] or not s.visible_only))


def warmup() -> None:
    """Compile a part: the rest is called by `scan_kernels` alone, and compiled with it."""
    judge(small_settings(), make_tracks(3, 4))
