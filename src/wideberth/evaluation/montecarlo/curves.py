"""The curve of a detector, P_cd against P_fa over all thresholds, from scores that are counted, not kept."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.evaluation.montecarlo import intervals
from wideberth.evaluation.montecarlo.intervals import Interval

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class ScoreHistogram:
    """Scores of events and of all others, fine enough to draw a detector's curve from.

    A detector raises an alarm where the score is below its threshold.
    """

    STEP, LOW, HIGH = 1e-3, -20.0, 80.0

    def __init__(self) -> None:
        size = round((self.HIGH - self.LOW) / self.STEP)
        # The last bin is for scores that no threshold reaches.
        self.events: IntArray = np.zeros(size + 1, np.int64)
        self.others: IntArray = np.zeros(size + 1, np.int64)

    def add(self, scores: ArrayLike, is_event: ArrayLike) -> None:
        """Count scores.

        Parameters
        ----------
        scores : array_like
            inf or NaN: never an alarm.
        is_event : array_like of bool
            Of the same shape.
        """
        flat = np.clip(np.nan_to_num(np.ravel(np.asarray(scores, float)), nan=np.inf), self.LOW, self.HIGH)
        event = np.ravel(np.asarray(is_event, bool))
        last = len(self.events) - 1
        # The tiny shift keeps scores that lie on an edge, but for rounding, in the bin above it.
        index = np.floor((flat - self.LOW) / self.STEP + 1e-6).astype(np.int64)
        self.events += np.bincount(index[event], minlength=last + 1)
        self.others += np.bincount(index[~event], minlength=last + 1)

    def merge(self, other: Self) -> None:
        """Add other scores."""
        self.events += other.events
        self.others += other.others

    def curve(self) -> "DetectorCurve":
        """Return the curve of the detector over all thresholds."""
        thresholds: FloatArray = self.LOW + self.STEP * np.arange(1.0, len(self.events))
        return DetectorCurve(
            thresholds,
            np.cumsum(self.events[:-1]),
            np.cumsum(self.others[:-1]),
            int(self.events.sum()),
            int(self.others.sum()),
        )


@dataclass(frozen=True, slots=True)
class DetectorCurve:
    """Correct detections and false alarms of a detector against its threshold.

    Attributes
    ----------
    thresholds : ndarray, shape (n,)
        Increasing.
    correct, false : ndarray, shape (n,)
        Alarms on events and on others with each threshold.
    events, others : int
        How many of either there are.
    """

    thresholds: FloatArray
    correct: IntArray
    false: IntArray
    events: int
    others: int

    def _at(self, p_cd: float) -> int | None:
        """Return the index of the least threshold that detects the fraction `p_cd` of the events."""
        if not self.events:
            return None
        index = int(np.searchsorted(self.correct, p_cd * self.events - 1e-9))
        return index if index < len(self.correct) else None

    def p_fa_at(self, p_cd: float) -> float | None:
        """Return P_fa of the least threshold with at least this P_cd; None where no threshold reaches it.

        Parameters
        ----------
        p_cd : float
        """
        index = self._at(p_cd)
        return None if index is None or not self.others else float(self.false[index] / self.others)

    def p_fa_interval_at(self, p_cd: float) -> Interval | None:
        """Return the Wilson interval of `p_fa_at`, the threshold taken as given."""
        index = self._at(p_cd)
        return None if index is None else intervals.wilson(int(self.false[index]), self.others)

    def points(self, count: int = 60) -> list[dict[str, float]]:
        """Return at most `count` points of the curve, evenly spread where it is drawn.

        That is in the logarithms of P_fa and of 1 - P_cd.

        Parameters
        ----------
        count : int
        """
        if not self.events or not self.others:
            return []
        log_false = np.log10(np.maximum(self.false, 0.5) / self.others)
        log_missed = np.log10(np.maximum(self.events - self.correct, 0.5) / self.events)
        # The length along the drawn curve; only thresholds at which something changes count.
        length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(log_false), np.diff(log_missed)))])
        wanted = np.linspace(0.0, length[-1], count)
        index = np.unique(np.searchsorted(length, wanted - 1e-12))
        return [
            {
                "threshold": round(float(self.thresholds[i]), 6),
                "p_fa": float(self.false[i] / self.others),
                "p_cd": float(self.correct[i] / self.events),
            }
            for i in index.tolist()
        ]
