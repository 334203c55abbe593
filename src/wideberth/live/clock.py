"""Live time: Unix time at the start, carried on by the monotonic clock; other clocks are compared with it."""

import time
from collections import deque
from collections.abc import Callable

from wideberth.types import Scan

HOST_JUMP = 0.5
"""A difference between two looks at the host's clock that counts as a jump, s."""

BEHIND_MAX = 1.0
"""How old a sensor's times may be when they arrive, s."""

_WINDOW = 10


class LiveClock:
    """The time that everything in a flight is in, s: it never jumps, whatever is done to the host's clock.

    Parameters
    ----------
    monotonic, wall : callable
        The two clocks, s.

    Attributes
    ----------
    jumps : int
        How often the host's clock has jumped.
    offset : float
        The host's clock minus live time when it was last looked at, s.
    """

    def __init__(self, monotonic: Callable[[], float] = time.monotonic, wall: Callable[[], float] = time.time) -> None:
        self._monotonic, self._wall = monotonic, wall
        self._difference = wall() - monotonic()
        self.jumps = 0
        self.offset = 0.0

    def now(self) -> float:
        """Return live time, s."""
        return self._monotonic() + self._difference

    def watch(self) -> tuple[str, ...]:
        """Look at the host's clock, and return what it did since the last look, in words."""
        before, self.offset = self.offset, self._wall() - self.now()
        jump = self.offset - before
        if abs(jump) < HOST_JUMP:
            return ()
        self.jumps += 1
        return (f"the host's clock jumped by {jump:+.1f} s: live time goes on as before",)


class SensorClock:
    """A sensor's times against those of their arrival."""

    def __init__(self) -> None:
        self._delays: deque[float] = deque(maxlen=_WINDOW)

    def note(self, scan: Scan) -> None:
        """Take note of a scan."""
        self._delays.append(scan.t_received - scan.t)

    @property
    def delay(self) -> float | None:
        """The least time from a scan's time to its arrival lately, s; None before the first."""
        return min(self._delays, default=None)

    def trouble(self) -> str:
        """Return what is wrong with the sensor's times, in words; empty where nothing is."""
        behind = min(self._delays, default=0.0)
        if behind <= BEHIND_MAX:
            return ""
        return f"its times are {behind:.1f} s old: its clock is behind, or its link slow"
