"""What all readers of a stream share: bytes in, reports out, and counters."""

from collections import Counter
from typing import Protocol

from wideberth.sensors.adsb.report import AdsbReport

_BLANK = " \t\r\n\f\v\0"  # zeros are what a power cut leaves at the end of a log


class Reader(Protocol):
    """Turns a stream of bytes, cut anywhere, into reports."""

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the reports that more bytes complete.

        Parameters
        ----------
        data : bytes
        t : float, optional
            Time of receipt, s, of a live stream; without it the times in the stream count.
        """

    def finish(self) -> list[AdsbReport]:
        """Return what is left at the end of the stream."""

    def restart(self) -> None:
        """Forget the part of a message that a broken connection left."""

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results, and of rejections by cause."""

    @property
    def understood(self) -> int:
        """How many messages made sense; what noise can pass for does not count."""

    @property
    def rejects(self) -> dict[str, int]:
        """The rejections among the counters."""

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses heard."""


def nonzero(*counts: "Counter[str]") -> dict[str, int]:
    """Return one dict of all counts that are not zero."""
    return {name: count for counter in counts for name, count in counter.items() if count}


class LineSplitter:
    """Splits a stream of bytes into lines; overlong ones (a binary stream) are cut so that memory stays bounded."""

    MAX_LINE = 65536

    def __init__(self) -> None:
        self._rest = b""

    def split(self, data: bytes) -> list[str]:
        """Return the complete lines, without their ends and without empty ones."""
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        if len(self._rest) > self.MAX_LINE:
            lines.append(self._rest)
            self._rest = b""
        return [text for line in lines if (text := line.decode("latin-1").strip(_BLANK))]

    def rest(self) -> list[str]:
        """Return the last line, which has no end, and forget it."""
        rest, self._rest = self._rest.decode("latin-1").strip(_BLANK), b""
        return [rest] if rest else []
