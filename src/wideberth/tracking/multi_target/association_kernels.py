"""Which plot is whose: clusters of tracks that share plots, and joint probabilities with existence (JIPDA).

For each track the caller gives up to a few candidate plots with the ratio of "this plot is mine" to "it is false". In a
cluster whose joint events are few all of them are enumerated; in a larger one each plot is shared out by the sums over
its rows and columns ("cheap JPDA").
"""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@jit_uncounted
def find_root(parent: IntArray, i: int) -> int:
    """Return the first member of the cluster of `i`, shortening the way to it."""
    root = i
    while parent[root] != root:
        root = parent[root]
    while parent[i] != root:
        following = parent[i]
        parent[i] = root
        i = following
    return root


@jit_uncounted
def find_clusters(
    n: int, counts: IntArray, plots: IntArray, owner: IntArray, parent: IntArray, order: IntArray, first: IntArray
) -> int:
    """Put tracks that share plots, directly or over others, into clusters.

    Parameters
    ----------
    n : int
        Tracks.
    counts : ndarray of int64, shape (n,)
        Candidates of each track.
    plots : ndarray of int64, shape (n, c)
        Their plots.
    owner : ndarray of int64, shape (plots,)
        Written over; must hold -1, and is left so.
    parent : ndarray of int64, shape (n,)
        Written over.
    order : ndarray of int64, shape (n,)
        The tracks, cluster by cluster.
    first : ndarray of int64, shape (n + 1,)
        Where in `order` each cluster begins.

    Returns
    -------
    int
        Number of clusters.
    """
    for i in range(n):
        parent[i] = i
    for i in range(n):
        for c in range(counts[i]):
            m = plots[i, c]
            if owner[m] < 0:
                owner[m] = i
            else:
                a, b = find_root(parent, owner[m]), find_root(parent, i)
                # The lower index leads: the result does not depend on the order of candidates.
                if a < b:
                    parent[b] = a
                else:
                    parent[a] = b
    for i in range(n):
        for c in range(counts[i]):
            owner[plots[i, c]] = -1
    # Counting sort by root.
    for i in range(n + 1):
        first[i] = 0
    for i in range(n):
        first[find_root(parent, i) + 1] += 1
    for i in range(n):
        first[i + 1] += first[i]
    for i in range(n):
        root = find_root(parent, i)
        order[first[root]] = i
        first[root] += 1
    # `first` now holds the ends, by root; a root is the least of its cluster, so clusters stand in that order.
    clusters, begin = 0, 0
    for root in range(n):
        if parent[root] == root:
            end = first[root]
            first[clusters] = begin
            begin = end
            clusters += 1
    first[clusters] = n
    return clusters


@jit_uncounted
def event_count(members: IntArray, begin: int, end: int, counts: IntArray, limit: int) -> int:
    """Return an upper bound of the number of joint events of a cluster, or `limit` + 1 where it is more."""
    total = 1
    for k in range(begin, end):
        total *= counts[members[k]] + 1
        if total > limit:
            return limit + 1
    return total


@jit_uncounted
def joint_probabilities(
    members: IntArray,
    begin: int,
    end: int,
    counts: IntArray,
    plots: IntArray,
    ratio: FloatArray,
    none: FloatArray,
    beta: FloatArray,
    taken: IntArray,
    choice: IntArray,
    product: FloatArray,
) -> None:
    """Write the marginal association probabilities of a cluster by enumeration of all joint events.

    Parameters
    ----------
    members : ndarray of int64
        The cluster's tracks are ``members[begin:end]``.
    begin, end : int
    counts : ndarray of int64, shape (n,)
    plots : ndarray of int64, shape (n, c)
    ratio : ndarray, shape (n, c)
        existence x P_D x likelihood / density of false plots, of each candidate.
    none : ndarray, shape (n,)
        1 - existence x P_D.
    beta : ndarray, shape (n, c + 1)
        Column 0: no plot is the track's; column k + 1: candidate k is.
    taken : ndarray of int64, shape (plots,)
        Must hold 0, and is left so.
    choice : ndarray of int64, shape (n,)
    product : ndarray, shape (n + 1,)
        Both written over.
    """
    size = end - begin
    for k in range(size):
        i = members[begin + k]
        choice[k] = -1
        for c in range(counts[i] + 1):
            beta[i, c] = 0.0
    total, depth = 0.0, 0
    product[0] = 1.0
    # Depth-first over the tracks; choice -1: not yet chosen, 0: none, c + 1: candidate c.
    while depth >= 0:
        i = members[begin + depth]
        if choice[depth] > 0:
            taken[plots[i, choice[depth] - 1]] = 0
        c = choice[depth] + 1
        while c > 0 and c <= counts[i] and taken[plots[i, c - 1]] == 1:
            c += 1
        if c > counts[i]:
            choice[depth] = -1
            depth -= 1
            continue
        choice[depth] = c
        factor = none[i] if c == 0 else ratio[i, c - 1]
        product[depth + 1] = product[depth] * factor
        if c > 0:
            taken[plots[i, c - 1]] = 1
        if depth + 1 < size:
            depth += 1
            continue
        weight = product[size]
        total += weight
        for k in range(size):
            beta[members[begin + k], choice[k]] += weight
    for k in range(begin, end):
        i = members[k]
        for c in range(counts[i] + 1):
            if total > 0.0:
                beta[i, c] /= total
            else:
                beta[i, c] = 1.0 if c == 0 else 0.0


@jit_uncounted
def shared_probabilities(
    members: IntArray,
    begin: int,
    end: int,
    counts: IntArray,
    plots: IntArray,
    ratio: FloatArray,
    none: FloatArray,
    beta: FloatArray,
    claims: FloatArray,
) -> None:
    """Write approximate association probabilities of a cluster that is too large to enumerate.

    A candidate's ratio is divided by what else could have happened: another candidate of the track, or another track
    with the plot (Fitzgerald's cheap JPDA, with existence).

    Parameters
    ----------
    members, begin, end, counts, plots, ratio, none, beta
        As in `joint_probabilities`.
    claims : ndarray, shape (plots,)
        Must hold 0, and is left so.
    """
    for k in range(begin, end):
        i = members[k]
        for c in range(counts[i]):
            claims[plots[i, c]] += ratio[i, c] / none[i]
    for k in range(begin, end):
        i = members[k]
        own = 0.0
        for c in range(counts[i]):
            own += ratio[i, c] / none[i]
        rest = 1.0
        for c in range(counts[i]):
            g = ratio[i, c] / none[i]
            beta[i, c + 1] = g / (own + claims[plots[i, c]] - g + 1.0)
            rest -= beta[i, c + 1]
        beta[i, 0] = max(rest, 0.0)
    for k in range(begin, end):
        i = members[k]
        for c in range(counts[i]):
            claims[plots[i, c]] = 0.0


def warmup() -> None:
    """Compile what Python calls."""
    counts, plots = np.array([1, 1]), np.zeros((2, 1), np.int64)
    owner, order, first = np.full(1, -1), np.zeros(2, np.int64), np.zeros(3, np.int64)
    find_clusters(2, counts, plots, owner, np.zeros(2, np.int64), order, first)
    event_count(order, 0, 2, counts, 100)
    ratio, none, beta = np.ones((2, 1)), np.full(2, 0.5), np.zeros((2, 2))
    taken, choice = np.zeros(1, np.int64), np.zeros(2, np.int64)
    joint_probabilities(order, 0, 2, counts, plots, ratio, none, beta, taken, choice, np.zeros(3))
    shared_probabilities(order, 0, 2, counts, plots, ratio, none, beta, np.zeros(1))
