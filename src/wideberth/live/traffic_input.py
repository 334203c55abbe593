"""Receivers of ADS-B as inputs of a flight: bytes become reports, and those one scan a step."""

import math
from collections import deque
from typing import ClassVar

from wideberth.frames import LocalFrame
from wideberth.live.config import ReceiverInputConfig
from wideberth.live.inputs import Input, InputLink
from wideberth.sensors.adsb.config import AdsbReceiverConfig
from wideberth.sensors.adsb.formats import READERS
from wideberth.sensors.adsb.receiver import AdsbReceiver
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Ownship, Scan

_REPORTS_MAX = 20_000


class TrafficInput(Input):
    """A receiver whose bytes a `Reader` understands.

    It is the `TrafficSource` of its own `AdsbReceiver`. Subclasses name the reader.
    """

    Config = ReceiverInputConfig
    reader_name: ClassVar[str]
    live = True
    exhausted = False

    def __init__(self, config: ReceiverInputConfig, name: str, frame: LocalFrame, link: InputLink) -> None:
        super().__init__(config, name, frame, link)
        self._reader = READERS[self.reader_name]()
        self._reports: deque[AdsbReport] = deque()
        self._lost = 0
        self._t_bytes = -math.inf
        self._receiver = AdsbReceiver(config, self, frame, name)

    @property
    def counters(self) -> dict[str, int]:
        """What was counted since the start."""
        return self._reader.counters | ({"reports nobody took": self._lost} if self._lost else {})

    @property
    def rejects(self) -> dict[str, int]:
        """What was rejected since the start, by cause."""
        return {**self._reader.rejects, **self._dropped()}

    def read(self, t: float, data: bytes) -> None:
        """Read a packet."""
        if not data:
            self._reader.restart()
            return
        self._t_bytes = t
        before = self._reader.understood
        self._reports.extend(self._reader.feed(data, t))
        count = self._reader.understood - before
        if count:
            self._messages.note(t, count)
        while len(self._reports) > _REPORTS_MAX:
            self._reports.popleft()
            self._lost += 1

    def poll(self, t: float) -> list[AdsbReport]:
        """Return the reports that were read and not returned before."""
        reports = list(self._reports)
        self._reports.clear()
        return reports

    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return one scan with the reports since the last call, empty where there are none."""
        return [self._receiver.sense(t, ownship.position)]

    def forget(self, t: float) -> None:
        """Forget the reports that were not yet taken."""
        self._reports.clear()

    def _state(self, t: float) -> str:
        state = super()._state(t)
        if state.startswith("silent") and t - self._t_bytes <= self._config.silent_after_s:
            return state.replace("silent", "nothing understood")
        return state

    def close(self) -> None:
        """Do nothing: the link is closed by who opened it."""


class BeastInput(TrafficInput):
    """A receiver that speaks Beast, such as dump1090 on port 30005."""

    transport = "tcp"
    reader_name = "beast"


class SbsInput(TrafficInput):
    """A receiver that speaks SBS-1 (BaseStation), such as dump1090 on port 30003."""

    transport = "tcp"
    reader_name = "sbs"


class AvrInput(TrafficInput):
    """A receiver that sends frames as AVR text, such as dump1090 on port 30002."""

    transport = "tcp"
    reader_name = "avr"


class UatInput(TrafficInput):
    """A receiver of 978 MHz that sends raw frames as text, such as dump978 on port 30978."""

    transport = "tcp"
    reader_name = "uat"


class Gdl90Input(TrafficInput):
    """A receiver that sends GDL90 datagrams, most of them to port 4000."""

    reader_name = "gdl90"


class AutopilotInput(Input):
    """The autopilot's own receiver, and Remote ID that it hears.

    The autopilot passes on what it hears and says nothing of an empty sky: it is well as long as its link is.
    """

    Config = AdsbReceiverConfig
    transport = ""
    live = True
    exhausted = False

    def __init__(self, config: AdsbReceiverConfig, name: str, frame: LocalFrame, link: InputLink) -> None:
        super().__init__(config, name, frame, link)
        self._receiver = AdsbReceiver(config, self, frame, name)

    @property
    def counters(self) -> dict[str, int]:
        """What was counted since the start."""
        return {"reports": self._messages.count}

    @property
    def rejects(self) -> dict[str, int]:
        """Nothing: the autopilot's link counts what it rejects."""
        return {}

    def read(self, t: float, data: bytes) -> None:
        """Do nothing: it has no link of its own."""

    def poll(self, t: float) -> list[AdsbReport]:
        """Return the autopilot's reports since the last call."""
        reports = self._link.autopilot.reports(t)
        if reports:
            self._messages.note(t, len(reports))
        return reports

    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return one scan with the reports since the last call, empty where there are none."""
        return [self._receiver.sense(t, ownship.position)]

    def forget(self, t: float) -> None:
        """Forget the autopilot's reports up to now."""
        self.poll(t)

    def _state(self, t: float) -> str:
        return self._link.autopilot.health(t).state

    def close(self) -> None:
        """Do nothing."""
