"""Beast binary: ``1a``, type, six bytes of time, one of signal level, the frame; every ``1a`` inside is doubled."""

import re

from wideberth.sensors.adsb.frame_readers import CounterTime, FrameReader
from wideberth.sensors.adsb.parity import SHORT_BYTES
from wideberth.sensors.adsb.report import AdsbReport

_BYTE = rb"(?:[^\x1a]|\x1a\x1a)"
_MESSAGE = re.compile(
    rb"\x1a(?:1(%b{9})|2(%b{14})|3(%b{21})|4(%b{21}))" % (_BYTE, _BYTE, _BYTE, _BYTE),
    re.DOTALL,
)
_BEGINNING = re.compile(rb"\x1a(?:[1-4]%b*\x1a?)?\Z" % _BYTE, re.DOTALL)
_LONGEST = 2 + 2 * 21
_NANOSECONDS = 1 << 30


class BeastReader(FrameReader):
    """Reader of a Beast stream that finds its way back after garbage, counting what it left out.

    Parameters
    ----------
    gps_time : bool or None
        Whether the six bytes are GPS time (18 bits of seconds of the day, 30 bits of nanoseconds) instead of a 12 MHz
        counter; None: decide it from the first piece fed.

    Notes
    -----
    Time 0 is the first message. A 12 MHz counter fills all values of its lower 30 bits, nanoseconds stop at 10^9: where
    at least 200 messages over three or more values of the upper bits never pass 10^9, the time is taken to be GPS time
    (a counter would do that with a probability of 10^-6).
    """

    def __init__(self, *, gps_time: bool | None = None) -> None:
        super().__init__()
        self._rest = b""
        self._gps_time = gps_time
        self._time = CounterTime()
        self._days = 0.0
        self._second_of_day = 0

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the reports that more bytes complete."""
        stream = self._rest + data
        frames: list[bytes] = []
        stamps: list[int] = []
        end = 0
        for match in _MESSAGE.finditer(stream):
            if match.start() > end:
                self.malformed["Beast garbage skipped"] += 1
            end = match.end()
            kind = match.lastindex
            body = match[kind or 0].replace(b"\x1a\x1a", b"\x1a")
            if kind in (2, 3):
                frames.append(body[7:])
                stamps.append(int.from_bytes(body[:6], "big"))
            else:
                self.malformed["Mode A/C" if kind == 1 else "receiver status"] += 1
        rest = stream[end:]
        beginning = _BEGINNING.search(rest, max(0, len(rest) - _LONGEST))
        cut = beginning.start() if beginning else len(rest)
        if cut > 0:
            self.malformed["Beast garbage skipped"] += 1
        self._rest = rest[cut:]
        if t is not None:
            return self.decode(frames, [t] * len(frames), t)
        if self._gps_time is None and stamps:
            self._gps_time = looks_like_gps_time(stamps)
        time = self._gps_seconds if self._gps_time else self._time.of_ticks
        return self.decode(frames, [time(stamp) for stamp in stamps], None)

    def finish(self) -> list[AdsbReport]:
        """Count a message that the end of the stream cut, and return what is left."""
        if self._rest:
            self.malformed["message cut by the end"] += 1
        self._rest = b""
        return self.drain()

    def restart(self) -> None:
        """Forget the part of a message that a broken connection left."""
        if self._rest:
            self.malformed["message cut by the end"] += 1
        self._rest = b""

    def _gps_seconds(self, stamp: int) -> float:
        second, nanoseconds = divmod(stamp, _NANOSECONDS)
        if second < self._second_of_day - 43200:
            self._days += 86400.0
        self._second_of_day = second
        return self._time.of_seconds(self._days + second + nanoseconds * 1e-9)


def encode(frame: bytes, ticks: int) -> bytes:
    """Return the Beast message of a Mode S frame of 7 or 14 bytes at a count of the 12 MHz clock."""
    kind = b"2" if len(frame) == SHORT_BYTES else b"3"
    body = (ticks % (1 << 48)).to_bytes(6, "big") + b"\xff" + frame
    return b"\x1a" + kind + body.replace(b"\x1a", b"\x1a\x1a")


def looks_like_gps_time(stamps: list[int]) -> bool:
    """Return whether the time stamps of a stream can hardly be anything but GPS time (see `BeastReader`)."""
    split = [divmod(stamp, _NANOSECONDS) for stamp in stamps]
    plausible = all(second < 86400 and nanoseconds < 1_000_000_000 for second, nanoseconds in split)
    return plausible and len(split) >= 200 and len({second for second, _ in split}) >= 3


def coverage(data: bytes) -> float:
    """Return which part of some bytes reads as Beast messages, for telling formats apart."""
    return sum(match.end() - match.start() for match in _MESSAGE.finditer(data)) / len(data) if data else 0.0
