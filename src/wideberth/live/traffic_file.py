"""The traffic of a file, for senders."""

from collections.abc import Iterator

from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.sources import FileSource

_POLL = 0.1
"""s of a file of traffic that are read at once."""

_GAP = 30.0
"""Longer gaps of a file, s, are left out."""


def reports_of_file(name: str, fmt: str = "auto") -> Iterator[tuple[float, list[AdsbReport]]]:
    """Return the reports of a file of traffic, by tenths of a second.

    Raises
    ------
    InputError
        As `FileSource`.
    """
    source = FileSource(name, fmt)

    def read() -> Iterator[tuple[float, list[AdsbReport]]]:
        skipped = 0.0
        t = source.t_first or 0.0
        while not source.exhausted:
            first = source.t_first
            if first is not None and first > t + _GAP:
                skipped += first - t
                t = first
            reports = source.poll(t)
            if reports:
                yield t - skipped, reports
            t += _POLL
        source.close()

    return read()
