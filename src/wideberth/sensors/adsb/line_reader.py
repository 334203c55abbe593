"""What readers of lines of text share: lines put together, their times, and a stream that breaks off."""

from abc import abstractmethod
from typing import Generic, TypeVar

from wideberth.sensors.adsb.clock_guard import ClockGuard
from wideberth.sensors.adsb.frame_readers import NOMINAL_INTERVAL
from wideberth.sensors.adsb.geodetic_reader import GeodeticReader
from wideberth.sensors.adsb.readers import LineSplitter, nonzero
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.stratux_log import StratuxLog

Content = TypeVar("Content")


class LineReader(GeodeticReader, Generic[Content]):
    """The part that readers of decoded positions in lines share; `Content` is what they make of a line.

    A line without a time of its own has that of its Stratux counter, else it is taken to come `NOMINAL_INTERVAL` s
    after the one before.
    """

    def __init__(self) -> None:
        super().__init__()
        self._clock: ClockGuard[Content] = ClockGuard()
        self._lines = LineSplitter()
        self._log = StratuxLog()
        self._nominal = 0.0

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results, and of rejections by cause."""
        return super().counters | nonzero(self._clock.results)

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the reports that more bytes complete."""
        return self._read(self._lines.split(data), t)

    def finish(self) -> list[AdsbReport]:
        """Return what is left at the end of the stream."""
        reports = self._read(self._lines.rest(), None)
        return reports + self._reports(self._clock.finish())

    def restart(self) -> None:
        """Forget the part of a line that a broken connection left."""
        self._lines.rest()

    def _left_out(self) -> dict[str, int]:
        return nonzero(self._rejects, self._clock.rejects)

    def _counted(self, counter: float | None) -> float:
        """Return the time of a line that says none: that of its counter, else the next nominal one."""
        if counter is not None:
            return counter
        self._nominal += NOMINAL_INTERVAL
        return self._nominal

    @abstractmethod
    def _read(self, lines: list[str], t: float | None) -> list[AdsbReport]:
        """Return the reports of whole lines that came at time `t`, s; None: their own times count."""

    @abstractmethod
    def _reports(self, contents: list[tuple[float, Content]]) -> list[AdsbReport]:
        """Return the reports of what came at a time each, s."""
