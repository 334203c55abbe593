"""When steps start: on a fixed grid of the monotonic clock; those that were missed are counted, and not caught up."""

import math


class Pacer:
    """The grid of starts.

    Parameters
    ----------
    start : float
        Of the first step, s.
    step : float
        Between two starts, s.

    Attributes
    ----------
    next_start : float
        When the next step is due, s.
    missed : int
        Starts that passed by while an earlier step ran, or while nobody ran at all.
    """

    def __init__(self, start: float, step: float) -> None:
        self._start, self._step = start, step
        self._number = 0
        self.next_start = start
        self.missed = 0

    def finish(self, now: float) -> None:
        """Choose the next start after a step that ended at `now`, s: one that is late by less than half a step."""
        number = max(self._number + 1, math.ceil((now - self._start) / self._step - 0.5))
        self.missed += number - self._number - 1
        self._number = number
        self.next_start = self._start + number * self._step
