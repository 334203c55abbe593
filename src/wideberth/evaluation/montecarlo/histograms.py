"""What a stream of rows is counted into: memory does not grow with the rows, and the order of blocks does not matter.

Everything is whole numbers, so that sums do not depend on how the rows were cut into blocks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.evaluation.montecarlo import intervals
from wideberth.evaluation.montecarlo.intervals import Interval

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class ExactHistogram:
    """Values on a grid, each with how often it came: exact for times, which are multiples of the step.

    Parameters
    ----------
    step : float
        Spacing of the grid; values are put at the nearest point.
    """

    def __init__(self, step: float) -> None:
        self.step = step
        self._counts: dict[int, int] = {}

    def add(self, values: ArrayLike) -> None:
        """Count finite values.

        Parameters
        ----------
        values : array_like
        """
        keys, counts = np.unique(np.rint(np.ravel(np.asarray(values, float)) / self.step), return_counts=True)
        for key, count in zip(keys.astype(np.int64).tolist(), counts.tolist(), strict=True):
            self._counts[key] = self._counts.get(key, 0) + count

    def not_negative(self) -> Self:
        """Return the same with negative values counted as 0."""
        other = type(self)(self.step)
        for key, count in self._counts.items():
            other._counts[max(key, 0)] = other._counts.get(max(key, 0), 0) + count
        return other

    def merge(self, other: Self) -> None:
        """Add another histogram with the same step."""
        for key, count in other._counts.items():
            self._counts[key] = self._counts.get(key, 0) + count

    @property
    def count(self) -> int:
        """How many values there are."""
        return sum(self._counts.values())

    def table(self) -> tuple[IntArray, IntArray]:
        """Return the grid points that occur, in steps and increasing, and how often each does."""
        keys = np.array(sorted(self._counts), np.int64)
        return keys, np.array([self._counts[k] for k in keys.tolist()], np.int64)

    def mean(self) -> float | None:
        """Return the mean; None of nothing."""
        n = self.count
        return self.step * sum(k * c for k, c in self._counts.items()) / n if n else None

    def mean_interval(self) -> Interval | None:
        """Return the normal interval of the mean; None for fewer than two values."""
        n, average = self.count, self.mean()
        if average is None or n < 2:
            return None
        first = sum(k * c for k, c in self._counts.items())
        second = sum(k * k * c for k, c in self._counts.items())
        return intervals.mean(average, self.step * math.sqrt((second - first * first / n) / (n - 1)), n)

    def quantile(self, q: float) -> float | None:
        """Return the least value that at least the fraction `q` of the values does not exceed; None of nothing."""
        n = self.count
        return self._ranked(max(1, math.ceil(q * n - 1e-9))) if n else None

    def quantile_interval(self, q: float) -> Interval | None:
        """Return the interval of a quantile between two ordered values; None where they are too few."""
        ranks = intervals.quantile_ranks(self.count, q)
        return None if ranks is None else (self._ranked(ranks[0]), self._ranked(ranks[1]))

    def _ranked(self, rank: int) -> float:
        keys, counts = self.table()
        return self._value(int(keys[int(np.searchsorted(np.cumsum(counts), rank))]))

    def _value(self, key: int) -> float:
        # 3 steps of 0.1 are 0.3, not 0.30000000000000004.
        return round(self.step * key, 9)

    def extremes(self) -> tuple[float | None, float | None]:
        """Return the least and the greatest value."""
        if not self._counts:
            return None, None
        return self._value(min(self._counts)), self._value(max(self._counts))


class BinnedHistogram:
    """Counts between given edges; what lies outside counts in the first or the last bin.

    Parameters
    ----------
    edges : sequence of float
        Increasing, at least two.
    """

    def __init__(self, edges: Sequence[float] | FloatArray) -> None:
        self.edges: FloatArray = np.asarray(edges, float)
        self.counts: IntArray = np.zeros(len(self.edges) - 1, np.int64)

    def add(self, values: ArrayLike) -> None:
        """Count values; a bin holds its lower edge. NaN counts as far away.

        Parameters
        ----------
        values : array_like
        """
        flat = np.nan_to_num(np.ravel(np.asarray(values, float)), nan=np.inf)
        index = np.clip(np.searchsorted(self.edges, flat, side="right") - 1, 0, len(self.counts) - 1)
        self.counts += np.bincount(index, minlength=len(self.counts))

    def merge(self, other: Self) -> None:
        """Add another histogram with the same edges."""
        self.counts += other.counts


@dataclass
class RatioTally:
    """Totals of events and trials over encounters, with the squares that tell how alike those of one encounter are."""

    clusters: int = 0
    y: int = 0
    x: int = 0
    yy: int = 0
    yx: int = 0
    xx: int = 0

    def add(self, events: NDArray[np.bool_] | IntArray, trials: NDArray[np.bool_] | IntArray) -> None:
        """Add encounters.

        Parameters
        ----------
        events, trials : ndarray, shape (n,) or (n, k)
            Of each encounter, or of its k intruders.
        """
        y, x = (a.reshape(len(a), -1).sum(axis=1, dtype=np.int64) for a in (events, trials))
        self.clusters += len(y)
        self.y += int(y.sum())
        self.x += int(x.sum())
        self.yy += int(y @ y)
        self.yx += int(y @ x)
        self.xx += int(x @ x)

    def merge(self, other: Self) -> None:
        """Add other encounters."""
        for name in ("clusters", "y", "x", "yy", "yx", "xx"):
            setattr(self, name, getattr(self, name) + getattr(other, name))

    @property
    def ratio(self) -> float | None:
        """Events per trial; None without trials."""
        return self.y / self.x if self.x else None

    def wilson(self) -> Interval | None:
        """Return the interval of the proportion as if all trials were independent."""
        return intervals.wilson(self.y, self.x)

    def clustered(self) -> Interval | None:
        """Return the interval of the proportion with encounters, not trials, as what is independent."""
        effect = intervals.design_effect(self.clusters, self.y, self.x, self.yy, self.yx, self.xx)
        return intervals.wilson(self.y, self.x, design_effect=effect)


@dataclass
class PairedTally:
    """Events of the same trials in two runs, with and without something."""

    trials: int = 0
    both: int = 0
    first_only: int = 0
    second_only: int = 0
    sums: RatioTally = field(default_factory=RatioTally)

    def add(self, first: NDArray[np.bool_], second: NDArray[np.bool_]) -> None:
        """Add encounters; arrays of shape (n, k)."""
        self.trials += first.size
        self.both += int((first & second).sum())
        self.first_only += int((first & ~second).sum())
        self.second_only += int((second & ~first).sum())
        self.sums.add(first, second)

    def merge(self, other: Self) -> None:
        """Add other encounters."""
        self.trials += other.trials
        self.both += other.both
        self.first_only += other.first_only
        self.second_only += other.second_only
        self.sums.merge(other.sums)

    @property
    def first(self) -> int:
        """Events in the first run."""
        return self.both + self.first_only

    @property
    def second(self) -> int:
        """Events in the second run."""
        return self.both + self.second_only

    @property
    def ratio(self) -> float | None:
        """Events in the first run for each in the second; None where that has none."""
        return self.first / self.second if self.second else None

    def interval(self) -> Interval | None:
        """Return the interval of the ratio, widened where the intruders of an encounter are alike."""
        effect, s = 1.0, self.sums
        pairs = (self.first_only + self.second_only) / (self.first * self.second) if self.first and self.second else 0.0
        if pairs > 0.0 and s.clusters > 1:
            # The variance of the logarithm of the ratio, of encounters and of independent pairs.
            clusters = s.yy / s.y**2 - 2 * s.yx / (s.y * s.x) + s.xx / s.x**2
            effect = clusters * s.clusters / (s.clusters - 1) / pairs
        return intervals.paired_ratio(self.both, self.first_only, self.second_only, design_effect=effect)
