"""Readers of raw Mode S frames: lines of JSON, AVR text."""

import json
import re
from collections import Counter
from collections.abc import Sequence

from wideberth.sensors.adsb.clock_guard import ClockGuard
from wideberth.sensors.adsb.decoder import ModeSDecoder
from wideberth.sensors.adsb.readers import LineSplitter, nonzero
from wideberth.sensors.adsb.report import AdsbReport

TICKS = 12e6  # 1/s, of the receivers' counters
NOMINAL_INTERVAL = 0.02  # s between messages where nothing tells their times


class FrameReader:
    """The part that all readers of frames share: checks of time, decoding, counters.

    Parameters
    ----------
    timed : bool
        False where the stream carries no times.
    """

    def __init__(self, *, timed: bool = True) -> None:
        self.decoder = ModeSDecoder(timed=timed)
        self.clock: ClockGuard[bytes] = ClockGuard()
        self.malformed: Counter[str] = Counter()

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind, of results, and of rejections by cause."""
        total = self.decoder.messages + sum(self.malformed.values()) + sum(self.clock.rejects.values())
        return {"messages": total} | nonzero(
            self.decoder.kinds,
            self.decoder.results,
            self.clock.results,
            self.malformed,
            self.clock.rejects,
            self.decoder.rejects,
        )

    @property
    def understood(self) -> int:
        """How many frames had a parity that fits, of aircraft in the air or not."""
        decoder = self.decoder
        return sum(decoder.kinds.values()) + decoder.rejects["surface"] + decoder.rejects["TIS-B not used"]

    @property
    def rejects(self) -> dict[str, int]:
        """Rejections by cause; positions that jump are among them though their messages count as understood."""
        jumps = Counter({"position jumps": self.decoder.results["position jumps"]})
        return nonzero(self.malformed, self.clock.rejects, self.decoder.rejects, jumps)

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses heard."""
        return self.decoder.addresses

    def decode(self, frames: Sequence[bytes], times: Sequence[float], t: float | None) -> list[AdsbReport]:
        """Return the reports of frames with their times in the stream, or all at the time of receipt `t`."""
        if t is not None:
            return self.decoder.decode(frames, [t] * len(frames))
        passed = [item for frame, time in zip(frames, times, strict=True) for item in self.clock.check(time, frame)]
        return self.decoder.decode([frame for _, frame in passed], [time for time, _ in passed])

    def drain(self) -> list[AdsbReport]:
        """Return the reports of the frames that the check of times still holds."""
        held = self.clock.finish()
        return self.decoder.decode([frame for _, frame in held], [time for time, _ in held])


class JsonFrameReader(FrameReader):
    """Lines of JSON with `timestamp` (Unix s) and `frame` (hexadecimal); other keys are ignored."""

    def __init__(self) -> None:
        super().__init__()
        self._lines = LineSplitter()

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the reports that more bytes complete."""
        return self._read(self._lines.split(data), t)

    def finish(self) -> list[AdsbReport]:
        """Return what is left at the end of the stream."""
        return self._read(self._lines.rest(), None) + self.drain()

    def restart(self) -> None:
        """Forget the part of a line that a broken connection left."""
        self._lines.rest()

    def _read(self, lines: list[str], t: float | None) -> list[AdsbReport]:
        frames, times = [], []
        for line in lines:
            try:
                row = json.loads(line)
                frame, time = bytes.fromhex(row["frame"]), float(row["timestamp"])
            except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
                self.malformed["line not understood"] += 1
                continue
            frames.append(frame)
            times.append(time)
        return self.decode(frames, times, t)


class AvrReader(FrameReader):
    """AVR text: ``*frame;``, ``:frame;``, ``@ticks frame;``, ``%ticks frame;``, ``<ticks signal frame;``.

    The ticks are of 12 MHz; time 0 is the first of them, and a counter that starts anew goes on from the last time.
    Where there are none, messages are taken to come every `NOMINAL_INTERVAL` s; speeds between positions are then not
    judged.
    """

    _PATTERN = re.compile(r"(?:[*:]|[@%]([0-9A-Fa-f]{12})|<([0-9A-Fa-f]{12})[0-9A-Fa-f]{2})((?:[0-9A-Fa-f]{2})+);")

    def __init__(self, *, timed: bool = True) -> None:
        super().__init__(timed=timed)
        self._lines = LineSplitter()
        self._time = CounterTime()

    def feed(self, data: bytes, t: float | None = None) -> list[AdsbReport]:
        """Return the reports that more bytes complete."""
        return self._read(self._lines.split(data), t)

    def finish(self) -> list[AdsbReport]:
        """Return what is left at the end of the stream."""
        return self._read(self._lines.rest(), None) + self.drain()

    def restart(self) -> None:
        """Forget the part of a line that a broken connection left."""
        self._lines.rest()

    def _read(self, lines: list[str], t: float | None) -> list[AdsbReport]:
        frames, times = [], []
        for line in lines:
            match = self._PATTERN.fullmatch(line)
            if match is None:
                self.malformed["line not understood"] += 1
                continue
            if len(match[3]) == 4:
                self.malformed["Mode A/C"] += 1
                continue
            ticks = match[1] or match[2]
            times.append(self._time.of_ticks(int(ticks, 16)) if ticks else self._time.nominal())
            frames.append(bytes.fromhex(match[3]))
        return self.decode(frames, times, t)


class CounterTime:
    """Seconds from a receiver's counter, from 0 at the first message on."""

    BACK = 10.0  # s that a counter may run back (late messages) before it has been started anew
    RELAYED = 0xFF004D4C4154  # mark of positions computed by others ("MLAT"): no time

    def __init__(self, unit: float = 1 / TICKS) -> None:
        self._unit = unit
        self._offset: float | None = None
        self._last = 0.0

    def of_ticks(self, ticks: int) -> float:
        """Return the time of a counter value; the last time where the value says nothing."""
        return self._last if ticks in (0, self.RELAYED) else self.of_seconds(ticks * self._unit)

    def of_seconds(self, seconds: float) -> float:
        """Return the time of a receiver's own seconds."""
        if self._offset is None:
            self._offset = -seconds
        t = seconds + self._offset
        if t < self._last - self.BACK:
            self._offset += self._last - t
            t = self._last
        self._last = max(t, self._last)
        return t

    def nominal(self) -> float:
        """Return the next time of messages that carry none."""
        self._last += NOMINAL_INTERVAL
        return self._last
