"""Clocks that pace a run: steps are told the time, only the wall clock waits for it."""

import time
from typing import Protocol


class Clock(Protocol):
    """What paces a run."""

    def wait_until(self, t: float) -> None:
        """Return when it is time `t` (s, Unix time for the wall clock)."""

    @property
    def now(self) -> float:
        """The time, s."""


class SimClock:
    """Time that passes as fast as the run asks for it.

    Parameters
    ----------
    start : float
        Time at the start, s.
    """

    def __init__(self, start: float) -> None:
        self._now = start

    @property
    def now(self) -> float:
        """The time, s."""
        return self._now

    def wait_until(self, t: float) -> None:
        """Put the time to `t` at once; time never runs back.

        Raises
        ------
        ValueError
            If `t` lies before the time now.
        """
        if not t >= self._now:
            raise ValueError(f"time cannot run back from {self._now:.3f} s to {t:.3f} s")
        self._now = t


class WallClock:
    """Unix time; waiting sleeps."""

    @property
    def now(self) -> float:
        """The time, Unix s."""
        return time.time()

    def wait_until(self, t: float) -> None:
        """Sleep until Unix time `t`; return at once where it has passed."""
        while (delay := t - time.time()) > 0:
            time.sleep(delay)
