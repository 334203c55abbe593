"""How long steps take and how old packets are, counted in bins so that any number of them takes the same memory."""

import math

import numpy as np

_BIN = 1e-4
_BINS = 100_000


class Histogram:
    """Durations in bins of 0.1 ms, up to 10 s; longer ones are in the last, and the longest is kept."""

    def __init__(self) -> None:
        self._counts = np.zeros(_BINS, np.int64)
        self._total = 0.0
        self._longest = math.nan

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self._counts.sum())

    def add(self, seconds: float) -> None:
        """Add a duration, s; one below zero is zero."""
        self._counts[min(max(int(seconds / _BIN), 0), _BINS - 1)] += 1
        self._total += seconds
        self._longest = seconds if math.isnan(self._longest) else max(self._longest, seconds)

    def percentile(self, share: float) -> float:
        """Return the duration that `share` of all do not exceed, s, to 0.1 ms upwards; NaN without any."""
        cumulative = np.cumsum(self._counts)
        if not cumulative[-1]:
            return math.nan
        place = int(np.searchsorted(cumulative, max(share * cumulative[-1], 1)))
        return min((place + 1) * _BIN, self._longest)

    def milliseconds(self) -> dict[str, float | int | None]:
        """Return count, mean, p50, p95, p99 and the longest, ms; None without any."""
        count = self.count
        if not count:
            return {"count": 0, "mean": None, "p50": None, "p95": None, "p99": None, "max": None}
        shares = {f"p{round(100 * s)}": round(1e3 * self.percentile(s), 3) for s in (0.5, 0.95, 0.99)}
        mean, longest = 1e3 * self._total / count, 1e3 * self._longest
        return {"count": count, "mean": round(mean, 3), **shares, "max": round(longest, 3)}
