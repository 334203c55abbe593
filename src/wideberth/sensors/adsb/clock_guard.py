"""Times of receipt that jump: a wrong one must not hide what follows, a clock that was set must not end a recording."""

import math
from collections import Counter
from typing import Generic, TypeVar

T = TypeVar("T")


class ClockGuard(Generic[T]):
    """Lets messages through whose times run on; holds those that jump until it is clear which clock is right.

    Messages up to `LATE` s older than the newest are late, not wrong, and pass. A jump is believed when `CONFIRMATIONS`
    messages in a row agree on it; otherwise they are left out and counted. Where a clock was set back, the later times
    are moved on so that time runs on: the first of them comes `PAUSE` s after the last before.
    """

    LATE = 10.0
    AHEAD = 600.0
    CONFIRMATIONS = 5
    PAUSE = 60.0

    def __init__(self) -> None:
        self.rejects: Counter[str] = Counter()
        self.results: Counter[str] = Counter()
        self._newest = -math.inf
        self._offset = 0.0
        self._held: list[tuple[float, T]] = []

    def check(self, t: float, message: T) -> list[tuple[float, T]]:
        """Return the messages that may go on, with their times: none, this one, or this one with those held before."""
        if not math.isfinite(t):
            self.rejects["time not a number"] += 1
            return []
        t += self._offset
        newest = self._newest
        if newest - self.LATE <= t <= newest + self.AHEAD or newest == -math.inf:
            if self._held:
                self._drop()
            self._newest = max(t, newest)
            return [(t, message)]
        if self._held and not -self.LATE <= t - self._held[-1][0] <= self.AHEAD:
            self._drop()
        self._held.append((t, message))
        if len(self._held) < self.CONFIRMATIONS:
            return []
        if t > newest:
            self.results["gaps in the recording"] += 1
        else:
            self.results["clock set back (later times moved on)"] += 1
            shift = newest + self.PAUSE - self._held[0][0]
            self._offset += shift
            self._held = [(time + shift, held) for time, held in self._held]
        return self._release()

    def finish(self) -> list[tuple[float, T]]:
        """Return the messages held at the end of the stream: those after a gap; those from the past are left out."""
        if self._held and self._held[0][0] > self._newest:
            return self._release()
        self._drop()
        return []

    def _release(self) -> list[tuple[float, T]]:
        held, self._held = self._held, []
        self._newest = max(t for t, _ in held)
        return held

    def _drop(self) -> None:
        for t, _ in self._held:
            self.rejects["time jumps back" if t < self._newest else "time jumps ahead"] += 1
        self._held = []
