"""Two aircraft in one resolution cell of a radar give one plot: neither's miss then says that it is gone.

Where two confirmed tracks are seen within the radar's resolution of each other, and a plot lies between them, that plot
may be both aircraft at once. A track that gets no plot of its own is then not missed: its probability of detection is
that of being resolved. The plot between them is explained and begins no third track.

How finely a radar resolves follows from how well it measures: it tells a range to a fraction of its bin, and a
direction to a small part of its beam. Koch and van Keuk (1997), Multiple hypothesis track maintenance with possibly
unresolved measurements, give the event and its weight. That a merged plot updates no state, but for what lies in a
track's own gate, is simpler than theirs: merged plots last a few scans.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, Bank, make_bank
from wideberth.tracking.multi_target.buffers_kernels import Scratch, make_scratch
from wideberth.tracking.multi_target.intake_kernels import azimuth_on_cone, first_above, sort_by_key
from wideberth.tracking.multi_target.sighting_kernels import line_of_sight
from wideberth.tracking.multi_target.window_kernels import Window, make_window

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

RANGE_SIGMAS = 5.0
"""Range resolution in standard deviations of a range: a bin and a half, where the least error is 0.3 bins."""

DIRECTION_SIGMAS = 40.0
"""Angular resolution in standard deviations of an angle: a beam of which directions are told to a fortieth."""

WIDEST_RAD = 0.5
"""No beam is taken for wider than this."""

SHORTEST = math.cos(0.5 * WIDEST_RAD)
"""The middle of the straight line between two places at the same range is nearer: by so much at most."""

SPREADS = 3.0
"""So many standard deviations a merged plot may be off the line between two tracks, and these off their places."""

UNRESOLVED = 0.9
"""Probability that two tracks within the resolution, with a plot between them, are that plot."""

OUT, RANGE, AZIMUTH, ELEVATION, RANGE_VARIANCE, CROSS_VARIANCE = 0, 3, 4, 5, 6, 7
"""Columns of `Scratch.aim`."""


@jit_uncounted
def keep_aim(i: int, s: Scratch) -> None:
    """Keep for track `i` how `s.look`, `s.frame` and `s.spread` say that the sensor sees it."""
    aim = s.aim[i]
    for a in range(3):
        aim[OUT + a] = s.frame[0, a]
        aim[RANGE + a] = s.look[a]
    aim[RANGE_VARIANCE] = s.spread[0]
    aim[CROSS_VARIANCE] = max(s.spread[1], s.spread[2])
    s.ranges[i] = s.look[0]


@jit_uncounted
def off_line(a: FloatArray, b: FloatArray, sight: FloatArray) -> float:
    """Return the angle by which a sight (3) lies off the line between the directions of two aims; all near by."""
    along, length = 0.0, 0.0
    for k in range(3):
        d = b[OUT + k] - a[OUT + k]
        along += (sight[k] - a[OUT + k]) * d
        length += d * d
    share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    off = 0.0
    for k in range(3):
        e = sight[k] - a[OUT + k] - share * (b[OUT + k] - a[OUT + k])
        off += e * e
    return math.sqrt(off)


@jit_uncounted
def both_density(a: FloatArray, b: FloatArray, z: FloatArray, variance: FloatArray, sight: FloatArray) -> float:
    """Return the density of a plot that is two aircraft at once, seen as the aims `a` and `b` (8) say; 0: it is not.

    It lies evenly on the line between them, in m of its elements; where powers add up, that is the straight line.

    Parameters
    ----------
    a, b : ndarray, shape (8,)
        Rows of `Scratch.aim`.
    z, variance : ndarray, shape (4,)
        The plot.
    sight : ndarray, shape (3,)
        Unit vector towards it.
    """
    angle = variance[1] if math.isnan(z[2]) else max(variance[1], variance[2])
    sigma = math.sqrt(variance[0])
    cell = RANGE_SIGMAS * sigma
    if abs(a[RANGE] - b[RANGE]) > cell + SPREADS * math.sqrt(a[RANGE_VARIANCE] + b[RANGE_VARIANCE]):
        return 0.0
    cosine = 0.0
    for k in range(3):
        cosine += a[OUT + k] * b[OUT + k]
    if math.acos(min(max(cosine, -1.0), 1.0)) > min(DIRECTION_SIGMAS * math.sqrt(angle), WIDEST_RAD):
        return 0.0
    off = off_line(a, b, sight)
    nearest, farthest = min(a[RANGE], b[RANGE]), max(a[RANGE], b[RANGE])
    nearest *= math.sqrt(0.5 + 0.5 * min(cosine, 1.0))
    spread = math.sqrt(variance[0] + max(a[RANGE_VARIANCE], b[RANGE_VARIANCE]))
    beyond = max(nearest - z[0], z[0] - farthest, 0.0) / spread
    width = a[RANGE] * math.sqrt(angle + max(a[CROSS_VARIANCE], b[CROSS_VARIANCE]) / (a[RANGE] * a[RANGE]))
    off *= a[RANGE] / width
    if beyond > SPREADS or off > SPREADS:
        return 0.0
    root = math.sqrt(2.0 * math.pi)
    length = a[RANGE] * math.sqrt(max(2.0 - 2.0 * cosine, 0.0))
    density: float = math.exp(-0.5 * (off * off + beyond * beyond)) / (root * spread + farthest - nearest)
    density /= root * width + length
    return density if math.isnan(z[2]) else density / (root * width)


@jit_uncounted
def find_unresolved(bank: Bank, window: Window, n: int, cone: bool, s: Scratch) -> int:
    """Write to `s.unresolved` how probably each track shares a plot with another; return how many pairs with a plot.

    They stand in `s.pairs`; of more than there is room for the rest are left out. Two plots between two tracks are one
    of each: the radar does tell them apart. `s.shared` is how much likelier than false such a plot is.

    Parameters
    ----------
    bank : Bank
        Tracks of which `keep_aim` has kept how they are seen.
    window : Window
        Whose newest scan this is.
    n : int
        Plots, in `s`.
    cone : bool
        As in `take_in`.
    s : Scratch
    """
    size, confirmed, pairs, newest = bank.size[0], 0, 0, window.cursor[0]
    widest, noise = 0.0, 0.0
    for i in range(size):
        s.unresolved[i], s.shared[i] = 0.0, 0.0
        if bank.status[i] == CONFIRMED and s.seen[i] > 0.0:
            s.by_range[confirmed] = i
            confirmed += 1
            widest = max(widest, s.aim[i, RANGE_VARIANCE])
    if confirmed < 2 or n == 0:
        return 0
    for q in range(n):
        noise = max(noise, s.variance[s.order[q], 0])
    sort_by_key(s.ranges, s.by_range, confirmed)
    reach = RANGE_SIGMAS * math.sqrt(noise) + SPREADS * math.sqrt(2.0 * widest)
    margin = SPREADS * math.sqrt(noise + widest)
    for first in range(confirmed):
        i = s.by_range[first]
        for second in range(first + 1, confirmed):
            j = s.by_range[second]
            if s.ranges[j] - s.ranges[i] > reach:
                break
            a, b = s.aim[i], s.aim[j]
            both, found, most = -1, 0, 0.0
            q = first_above(s.key, s.order, n, SHORTEST * a[RANGE] - margin)
            while q < n and s.key[s.order[q]] <= b[RANGE] + margin:
                m = s.order[q]
                q += 1
                if math.isnan(s.z[m, 2]):
                    elevation = 0.5 * (a[ELEVATION] + b[ELEVATION])
                    azimuth = azimuth_on_cone(s.z[m, 1], elevation) if cone else s.z[m, 1]
                    line_of_sight(window.attitude[newest], azimuth, elevation, s.sight[m])
                density = both_density(a, b, s.z[m], s.variance[m], s.sight[m])
                if density > 0.0:
                    both, most = m, density
                    found += 1
            if found != 1 or pairs == s.pairs.shape[0]:
                continue
            s.pairs[pairs, 0], s.pairs[pairs, 1], s.pairs[pairs, 2] = i, j, both
            pairs += 1
            false = window.density[newest]
            if math.isnan(s.z[both, 2]):
                false *= 2.0 * a[RANGE] * window.field_of_view[newest, 1]
            for k in (i, j):
                s.unresolved[k], s.shared[k] = UNRESOLVED, max(s.shared[k], most / false)
    return pairs


@jit_uncounted
def claim_merged(pairs: int, mine: FloatArray, s: Scratch) -> None:
    """Add to `mine` (K,), the probability of each plot that some track made it, that it is two aircraft at once.

    It is as far as one of the two has no plot of its own.
    """
    for k in range(pairs):
        i, j, m = s.pairs[k, 0], s.pairs[k, 1], s.pairs[k, 2]
        mine[m] = max(mine[m], UNRESOLVED * max(s.beta[i, 0], s.beta[j, 0]))


def warmup() -> None:
    """Compile what Python calls."""
    bank, s = make_bank(2), make_scratch(2, 1, 2)
    keep_aim(0, s)
    both_density(s.aim[0], s.aim[0], np.ones(4), np.ones(4), np.ones(3))
    window = make_window(2, 1)
    window.cursor[:] = 0, 1
    find_unresolved(bank, window, 0, False, s)
    claim_merged(0, s.claims, s)
