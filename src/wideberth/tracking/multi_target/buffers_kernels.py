"""What the kernels of the multi-target tracker share: rules, buffers, and the codes of counters and events."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import MotionScratch, make_motion_scratch
from wideberth.tracking.multi_target.fit_kernels import FitScratch, make_fit_scratch
from wideberth.tracking.multi_target.heard_kernels import RIVALS
from wideberth.tracking.multi_target.imm_kernels import HYPOTHESES

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CANDIDATES = 8
"""Plots that a track may choose from; of more, those that lie best are taken."""

PLOTS_NOT_FINITE, PLOTS_OUT_OF_RANGE, PLOTS_SHED, BIRTHS_DEFERRED, LARGE_CLUSTERS = 0, 1, 2, 3, 4
COUNTS = 5
"""Places in the array of counts."""

CONFIRMED_NOW, LOST, LEFT_VIEW, MERGED, TOO_UNCERTAIN, NOT_SCANNED = 0, 1, 2, 3, 4, 5
"""What happened to a track."""


class Rules(NamedTuple):
    """Numbers of association, birth and life.

    Attributes
    ----------
    gate : float
        Largest normalised distance squared of a plot.
    event_limit : int
        Clusters with more joint events than this are shared out instead of enumerated.
    birth_per_scan : float
        New aircraft expected in a scan.
    pair_scans : int
        How many scans back the second plot of a pair may be.
    speed_max, speed_sigma : float
        Fastest aircraft, and prior spread of each velocity component, m/s.
    least_hits, confirm_hits : int
        Plots that a tentative and a confirmed track need.
    tentative_odds, confirm_odds, drop_tentative, drop_confirmed : float
        Log of the odds of existence at which a track begins, is confirmed, and is dropped.
    existence_max : float
        No track is surer than this.
    outside_s, silent_s : float
        How long a confirmed track is kept outside every field of view, and without any scan.
    spread_max : float
        m; a track less certain than this is dropped.
    merge_gate : float
        Tracks that share plots and are nearer than this normalised distance squared are one.
    clutter_scans : float
        Scans over which the number of false plots is averaged.
    consensus_budget : int
        Pairs that are fitted in a scan at most.
    known_down, known_sigma : float
        NED down coordinate and its spread, m, that stand in for a missing elevation; NaN: not known.
    """

    gate: float
    event_limit: int
    birth_per_scan: float
    pair_scans: int
    speed_max: float
    speed_sigma: float
    least_hits: int
    confirm_hits: int
    tentative_odds: float
    confirm_odds: float
    drop_tentative: float
    drop_confirmed: float
    existence_max: float
    outside_s: float
    silent_s: float
    spread_max: float
    merge_gate: float
    clutter_scans: float
    consensus_budget: int
    known_down: float
    known_sigma: float


class Scratch(NamedTuple):
    """Buffers for N tracks and K plots of a scan.

    Attributes
    ----------
    z, variance : ndarray, shape (K, 4)
        Plots that can be right, by their place in the scan.
    sight : ndarray, shape (K, 3)
        Unit vectors towards them.
    order, key : ndarray, shape (K,)
        Their places by ascending range, and the ranges.
    counts, plots : ndarray of int64, shape (N,), (N, CANDIDATES)
        Candidates of each track.
    square, ratio : ndarray, shape (N, CANDIDATES)
        Their distance, and how much likelier than false they are.
    likelihood : ndarray, shape (N, CANDIDATES, HYPOTHESES)
        Log-likelihoods, then shares.
    cx, cp : ndarray, shape (N, CANDIDATES, HYPOTHESES, 9), (..., 9, 9)
        The updated states.
    none, missed, seen : ndarray, shape (N,)
        Probability of no plot of its own, of that and existence, and of detection.
    beta : ndarray, shape (N, CANDIDATES + 1)
        Association probabilities, first that of no plot.
    owner, taken, claims : ndarray, shape (K,)
        Scratch of the association, left at -1, 0 and 0.
    parent, members, first, choice, product : ndarray
        Scratch of the clusters.
    frame, look, spread, x, p, x2, p2, e, r, h0, h1, f, work : ndarray
        Small scratch.
    motion, birth
        Scratch of those parts.
    events : ndarray of int64, shape (4 N, 3)
        Code, track, and another track or -1.
    event_count : ndarray of int64, shape (1,)
    own_work : ndarray, shape (14, 6)
        Scratch of the ownship test.
    told, near : ndarray, shape (RIVALS,), (N,)
        Of `rival_kernels`: scores of one report, and which tracks may be its.
    aim : ndarray, shape (N, 8)
        Of `unresolved_kernels`: unit vector to where each track is seen (NED), range, azimuth, elevation, and its
        variances in range and across (the larger of both), m2.
    said : ndarray, shape (N,)
        Probability of detection that the sensor says, where the track counts for how well it sees; else 0.
    unresolved, shared : ndarray, shape (N,)
        Probability that what the sensor sees of a track is one plot together with another's, and how much likelier than
        false that plot is.
    by_range, ranges : ndarray, shape (N,)
        Tracks by ascending range, and the ranges.
    pairs : ndarray of int64, shape (4 N, 3)
        Two tracks and the plot that may be both.
    nis : ndarray, shape (N, CANDIDATES, HYPOTHESES)
        Normalised innovation squared of each candidate.
    """

    z: FloatArray
    variance: FloatArray
    sight: FloatArray
    order: IntArray
    key: FloatArray
    counts: IntArray
    plots: IntArray
    square: FloatArray
    ratio: FloatArray
    likelihood: FloatArray
    cx: FloatArray
    cp: FloatArray
    none: FloatArray
    seen: FloatArray
    beta: FloatArray
    owner: IntArray
    taken: IntArray
    claims: FloatArray
    parent: IntArray
    members: IntArray
    first: IntArray
    choice: IntArray
    product: FloatArray
    frame: FloatArray
    look: FloatArray
    spread: FloatArray
    x: FloatArray
    p: FloatArray
    x2: FloatArray
    p2: FloatArray
    e: FloatArray
    r: FloatArray
    h0: FloatArray
    h1: FloatArray
    f: FloatArray
    work: FloatArray
    motion: MotionScratch
    birth: FitScratch
    events: IntArray
    event_count: IntArray
    own_work: FloatArray
    told: FloatArray
    near: IntArray
    aim: FloatArray
    said: FloatArray
    missed: FloatArray
    unresolved: FloatArray
    shared: FloatArray
    by_range: IntArray
    ranges: FloatArray
    pairs: IntArray
    nis: FloatArray


def make_scratch(tracks: int, plots: int, window_scans: int) -> Scratch:
    """Return buffers for so many tracks, plots, and scans in the window."""
    c, n = CANDIDATES, HYPOTHESES
    return Scratch(
        z=np.zeros((plots, 4)),
        variance=np.zeros((plots, 4)),
        sight=np.zeros((plots, 3)),
        order=np.zeros(plots, np.int64),
        key=np.zeros(plots),
        counts=np.zeros(tracks, np.int64),
        plots=np.zeros((tracks, c), np.int64),
        square=np.zeros((tracks, c)),
        ratio=np.zeros((tracks, c)),
        likelihood=np.zeros((tracks, c, n)),
        cx=np.zeros((tracks, c, n, 9)),
        cp=np.zeros((tracks, c, n, 9, 9)),
        none=np.zeros(tracks),
        seen=np.zeros(tracks),
        beta=np.zeros((tracks, c + 1)),
        owner=np.full(plots, -1, np.int64),
        taken=np.zeros(plots, np.int64),
        claims=np.zeros(plots),
        parent=np.zeros(tracks, np.int64),
        members=np.zeros(tracks, np.int64),
        first=np.zeros(tracks + 1, np.int64),
        choice=np.zeros(tracks, np.int64),
        product=np.zeros(tracks + 1),
        frame=np.zeros((3, 3)),
        look=np.zeros(3),
        spread=np.zeros(3),
        x=np.zeros(9),
        p=np.zeros((9, 9)),
        x2=np.zeros(9),
        p2=np.zeros((9, 9)),
        e=np.zeros(4),
        r=np.zeros(4),
        h0=np.zeros((4, 6)),
        h1=np.zeros((4, 9)),
        f=np.zeros((9, 9)),
        work=np.zeros((9, 9)),
        motion=make_motion_scratch(),
        birth=make_fit_scratch(window_scans),
        events=np.zeros((4 * tracks, 3), np.int64),
        event_count=np.zeros(1, np.int64),
        own_work=np.zeros((14, 6)),
        told=np.zeros(RIVALS),
        near=np.zeros(tracks, np.int64),
        aim=np.zeros((tracks, 8)),
        said=np.zeros(tracks),
        missed=np.zeros(tracks),
        unresolved=np.zeros(tracks),
        shared=np.zeros(tracks),
        by_range=np.zeros(tracks, np.int64),
        ranges=np.zeros(tracks),
        pairs=np.zeros((4 * tracks, 3), np.int64),
        nis=np.zeros((tracks, c, n)),
    )


@jit_uncounted
def tell(s: Scratch, code: int, identity: int, other: int) -> None:
    """Note an event of a track, and of another (-1: none); where there is no more room it is left out."""
    n = s.event_count[0]
    if n < s.events.shape[0]:
        s.events[n, 0], s.events[n, 1], s.events[n, 2] = code, identity, other
        s.event_count[0] = n + 1


@jit_uncounted
def log_odds(probability: float) -> float:
    """Return the logarithm of the odds of a probability, finite also at 0 and 1."""
    return math.log(max(probability, 1e-12)) - math.log(max(1.0 - probability, 1e-12))


def warmup() -> None:
    """Compile what Python calls."""
    tell(make_scratch(1, 1, 2), LOST, 1, -1)
    log_odds(0.5)
