"""Traffic by one name: a file, standard input, or a live receiver."""

import math
from collections import deque

from wideberth.errors import InputError
from wideberth.sensors.adsb.byte_input import ByteInput
from wideberth.sensors.adsb.formats import LISTENING, READERS, detect, names
from wideberth.sensors.adsb.live import LiveSource, parse_address
from wideberth.sensors.adsb.readers import Reader
from wideberth.sensors.adsb.report import AdsbReport, TrafficSource
from wideberth.types import SensorHealth

SILENT_AFTER = 10.0  # s without a message after which a source is called silent
RATE_WINDOW = 10.0  # s over which the rate of reports is counted


def open_traffic(spec: str, fmt: str = "auto") -> TrafficSource:
    """Open traffic.

    Parameters
    ----------
    spec : str
        Path of a file (gzip or not), ``"-"`` for standard input, or ``beast://host:port``, ``sbs://host:port``,
        ``avr://host:port``, ``uat://host:port`` for a live receiver that is connected to, ``gdl90://host:port`` for
        one whose datagrams are listened for there.
    fmt : str
        One of the names of `formats.READERS`, or ``"auto"`` to tell it by the content.

    Returns
    -------
    TrafficSource
        A `FileSource` or a `LiveSource`.

    Raises
    ------
    InputError
        If there is no such file, format or address, or nothing in the file can be used; the message says why.
    """
    if fmt != "auto" and fmt not in READERS:
        raise InputError(f"unknown traffic format '{fmt}': use one of {names()}")
    if "://" in spec:
        scheme, host, port = parse_address(spec)
        if fmt not in ("auto", scheme):
            raise InputError(f"traffic '{spec}' is live {scheme}: its format cannot be '{fmt}'")
        return LiveSource(spec, READERS[scheme](), host, port, listen=scheme in LISTENING)
    return FileSource(spec, fmt)


class FileSource:
    """Traffic from a file or standard input, read as far as the reports asked for.

    Parameters
    ----------
    name : str
        Path, or ``"-"``.
    fmt : str
        As for `open_traffic`.

    Raises
    ------
    InputError
        If it cannot be opened, its format is not known, or it holds no report at all.
    """

    live = False

    def __init__(self, name: str, fmt: str = "auto") -> None:
        self.name = "standard input" if name == "-" else name
        self._input = ByteInput(name)
        self._reports: deque[AdsbReport] = deque()
        self._ended = False
        self._given: deque[tuple[float, int]] = deque()
        self._t_last = -math.inf
        try:
            head = self._input.read()
            if not head and self._input.damage:
                raise InputError(f"traffic '{self.name}' holds nothing that can be read: {self._input.damage}")
            self.format = detect(head, self.name) if fmt == "auto" else fmt
            self._reader: Reader = READERS[self.format]()
            self._reports.extend(self._reader.feed(head))
            if not head:
                self._finish()
            while not self._reports and not self._ended:
                self._read_on()
            if not self._reports:
                raise InputError(f"nothing in traffic '{self.name}' can be used ({describe(self.counters)})")
        except BaseException:
            self._input.close()
            raise

    @property
    def t_first(self) -> float | None:
        """Time of the next report to be given, s; None at the end."""
        return self._reports[0].t if self._reports else None

    @property
    def exhausted(self) -> bool:
        """Whether nothing will ever come again."""
        return self._ended and not self._reports

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results and of rejections by cause, of what has been read so far."""
        return self._reader.counters | self._damage()

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses heard so far, of aircraft without a position too."""
        return self._reader.addresses

    def _damage(self) -> dict[str, int]:
        return {self._input.damage: 1} if self._input.damage else {}

    def poll(self, t: float) -> list[AdsbReport]:
        """Return all reports up to time `t` (s) and not returned before, in the order of receipt."""
        reports: list[AdsbReport] = []
        while True:
            while self._reports and self._reports[0].t <= t:
                reports.append(self._reports.popleft())
            if self._reports or self._ended:
                break
            self._read_on()
        if reports:
            self._t_last = max(self._t_last, max(report.t for report in reports))
            self._given.append((t, len(reports)))
        return reports

    def health(self, t: float) -> SensorHealth:
        """Return age, rate, rejects and state ("ok", "silent for 12 s", "recording ended") at time `t`."""
        while self._given and self._given[0][0] < t - RATE_WINDOW:
            self._given.popleft()
        age = max(t - self._t_last, 0.0)
        if self.exhausted and age > 1.0:
            state = "recording ended"
        elif age > SILENT_AFTER:
            state = "no report yet" if math.isinf(age) else f"silent for {age:.0f} s"
        else:
            state = "ok"
        rate = sum(count for _, count in self._given) / RATE_WINDOW
        return SensorHealth(age, rate, self._reader.rejects | self._damage(), state)

    def close(self) -> None:
        """Close the file; what was not read is given up."""
        self._reports.clear()
        self._ended = True
        self._input.close()

    def _read_on(self) -> None:
        data = self._input.read()
        if data:
            self._reports.extend(self._reader.feed(data))
        else:
            self._finish()

    def _finish(self) -> None:
        self._reports.extend(self._reader.finish())
        self._ended = True
        self._input.close()


def describe(counters: dict[str, int]) -> str:
    """Return counters in one line of words."""
    return ", ".join(f"{name} {count}" for name, count in counters.items())
