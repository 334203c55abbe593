"""A traffic source over reports that are already in memory."""

import math
from collections import deque
from collections.abc import Mapping, Sequence

from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SensorHealth

_RATE_WINDOW = 10.0  # s
_SILENT_AFTER = 10.0  # s


class ReportList:
    """Reports of a recording, given as if they were received now.

    Parameters
    ----------
    name : str
    reports : sequence of AdsbReport
        In the order of receipt.
    counters : mapping of str to int
        What was counted when they were read.
    rejects : mapping of str to int
        The rejections among them.
    """

    live = False

    def __init__(
        self, name: str, reports: Sequence[AdsbReport], counters: Mapping[str, int], rejects: Mapping[str, int]
    ) -> None:
        self.name = name
        self._reports = deque(reports)
        self._counters = dict(counters)
        self._rejects = dict(rejects)
        self._given: deque[tuple[float, int]] = deque()
        self._t_last = -math.inf

    @property
    def exhausted(self) -> bool:
        """Whether nothing will ever come again."""
        return not self._reports

    @property
    def counters(self) -> dict[str, int]:
        """What was counted when the reports were read."""
        return dict(self._counters)

    def poll(self, t: float) -> list[AdsbReport]:
        """Return all reports up to time `t` (s) and not returned before."""
        out = []
        while self._reports and self._reports[0].t <= t:
            out.append(self._reports.popleft())
        if out:
            self._t_last = max(self._t_last, out[-1].t)
            self._given.append((t, len(out)))
        return out

    def health(self, t: float) -> SensorHealth:
        """Return age, rate, rejects and state ("ok", "silent for 12 s", "recording ended") at time `t`."""
        while self._given and self._given[0][0] < t - _RATE_WINDOW:
            self._given.popleft()
        age = max(t - self._t_last, 0.0)
        if not self._reports and age > 1.0:
            state = "recording ended"
        elif age > _SILENT_AFTER:
            state = "no report yet" if math.isinf(age) else f"silent for {age:.0f} s"
        else:
            state = "ok"
        return SensorHealth(age, sum(n for _, n in self._given) / _RATE_WINDOW, self._rejects, state)

    def close(self) -> None:
        """Give up what was not read."""
        self._reports.clear()
