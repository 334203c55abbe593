"""Scans that come late: the state of a moment ago is taken up again, and what followed is run once more in order."""

import bisect
from collections.abc import Callable

from wideberth.tracking.multi_target.intake import ReadyScan
from wideberth.tracking.multi_target.reports import ReadyReports
from wideberth.tracking.multi_target.state import Snapshot, TrackerState

Item = ReadyScan | ReadyReports


class History:
    """The last scans and reports, and copies of the state between them.

    Parameters
    ----------
    span_s : float
        How late a scan may be, s.
    """

    def __init__(self, span_s: float) -> None:
        self._span = span_s
        self._snapshots: list[tuple[Snapshot, int]] = []
        self._scans: list[Item] = []
        self._dropped = 0

    def before(self, state: TrackerState, scan: Item) -> None:
        """Note a scan that is about to be processed in order, and copy the state now and then.

        Parameters
        ----------
        state : TrackerState
        scan : ReadyScan or ReadyReports
        """
        if self._span <= 0.0:
            return
        if not self._snapshots or scan.t - self._snapshots[-1][0].t >= 0.5 * self._span:
            self._snapshots.append((state.snapshot(), self._dropped + len(self._scans)))
            # The oldest copy that is still needed lies before everything that may come.
            while len(self._snapshots) > 1 and self._snapshots[1][0].t < scan.t - self._span:
                del self._snapshots[0]
            used = self._snapshots[0][1] - self._dropped
            del self._scans[:used]
            self._dropped += used
        self._scans.append(scan)

    def insert(self, state: TrackerState, scan: Item, process: Callable[[Item], None]) -> bool:
        """Put a late scan in its place and run again what followed; return False where it is too late for that.

        Parameters
        ----------
        state : TrackerState
        scan : ReadyScan or ReadyReports
        process : callable
            Processes one scan in order.
        """
        while self._snapshots and not self._snapshots[-1][0].t < scan.t:
            if len(self._snapshots) == 1:
                return False
            del self._snapshots[-1]
        if not self._snapshots:
            return False
        snapshot, first = self._snapshots[-1]
        state.restore(snapshot)
        begin = first - self._dropped
        again = self._scans[begin:]
        bisect.insort(again, scan, key=lambda s: s.t)
        self._scans[begin:] = again
        for each in again:
            process(each)
        return True
