"""Groups of adjacent range bins over their thresholds, and the peaks in them (thesis 5.2, figure 5.4)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray

IntArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class BinGroups:
    """Runs of adjacent bins.

    Attributes
    ----------
    first, last : ndarray of int, shape (n,)
        Both belong to the group.
    too_small : int
        Groups that were dropped as they have too few bins.
    """

    first: IntArray
    last: IntArray
    too_small: int


def adjacent_groups(detected: NDArray[np.bool_], minimum: int) -> BinGroups:
    """Return the groups of adjacent bins that are over their thresholds.

    Parameters
    ----------
    detected : ndarray of bool, shape (range_bins,)
    minimum : int
        Bins that a group has at least: with two, the single bins of harmonics and of noise are dropped (5.2).

    Returns
    -------
    BinGroups
    """
    edges = np.flatnonzero(np.diff(detected, prepend=False, append=False))
    first, last = edges[::2], edges[1::2] - 1
    kept = last - first + 1 >= minimum
    return BinGroups(first[kept], last[kept], int(np.count_nonzero(~kept)))


def group_peaks(power: FloatArray, groups: BinGroups) -> IntArray:
    """Return the bins of groups whose power is greater than that of both bins beside them.

    Of equal neighbours the first counts. Bins beside a group, under their own thresholds, may be greater than those in
    it: such a group has no peak at that end.

    Parameters
    ----------
    power : ndarray, shape (range_bins,)
    groups : BinGroups

    Returns
    -------
    ndarray of int, shape (m,)
        Increasing.
    """
    padded = np.concatenate([[-np.inf], power, [-np.inf]])
    greatest = (power > padded[:-2]) & (power >= padded[2:])
    inside = np.zeros(len(power) + 1, np.intp)
    inside[groups.first] += 1
    inside[groups.last + 1] -= 1
    return np.flatnonzero(greatest & (np.cumsum(inside)[:-1] > 0))
