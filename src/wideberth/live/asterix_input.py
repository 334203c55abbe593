"""ASTERIX as an input of a flight: plots of radars become scans, reports and system tracks those of a receiver."""

from collections.abc import Mapping
from typing import Literal

from wideberth.frames import LocalFrame
from wideberth.links.asterix.reader import AsterixReader
from wideberth.links.config import AsterixConfig
from wideberth.live.config import LinkConfig
from wideberth.live.inputs import InputLink
from wideberth.live.radar_input import RadarInput, named_units
from wideberth.sensors.adsb.config import AdsbReceiverConfig
from wideberth.sensors.adsb.receiver import AdsbReceiver
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Ownship, Scan

_REPORTS = "/reports"


class AsterixInputConfig(LinkConfig, AsterixConfig):
    """What speaks ASTERIX, and where.

    Attributes
    ----------
    carries : {"plots", "reports", "both"}
        What is taken: plots of radars (category 048), reports and system tracks (021, 062), or both. Radars whose plots
        are taken are missed where none come.
    receiver : AdsbReceiverConfig
        What is taken of reports and system tracks.
    """

    carries: Literal["plots", "reports", "both"] = "plots"
    receiver: AdsbReceiverConfig = AdsbReceiverConfig()

    @property
    def scan_kinds(self) -> frozenset[str]:
        """Kinds of their scans."""
        kinds = {"plots": {"radar"}, "reports": {"adsb"}, "both": {"radar", "adsb"}}
        return frozenset(kinds[self.carries])

    def unit_names(self, name: str) -> tuple[str, ...]:
        """Return what the sensors of an input are called."""
        return (*self.unit_intervals(name), *((name + _REPORTS,) if "adsb" in self.scan_kinds else ()))

    def unit_intervals(self, name: str) -> Mapping[str, float]:
        """Return how often each radar looks, s."""
        if "radar" not in self.scan_kinds:
            return {}
        return {unit.name: unit.update_interval_s for unit in named_units(self.units, name)}


class AsterixInput(RadarInput):
    """Radars and receivers that send ASTERIX in UDP datagrams."""

    Config = AsterixInputConfig
    make_reader = AsterixReader
    live = True
    exhausted = False
    _reader: AsterixReader

    def __init__(self, config: AsterixInputConfig, name: str, frame: LocalFrame, link: InputLink) -> None:
        super().__init__(config, name, frame, link)
        self._kinds = config.scan_kinds
        self._receiver = AdsbReceiver(config.receiver, self, frame, name + _REPORTS)

    def poll(self, t: float) -> list[AdsbReport]:
        """Return the reports since the last call."""
        return self._reader.reports()

    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return the scans since the last call, and one with the reports."""
        # Without north marks a turn of an antenna ends with time.
        self.take(self._reader.feed(b"", t), t)
        scans = super().sense(t, ownship) if "radar" in self._kinds else []
        return [*scans, self._receiver.sense(t, ownship.position)] if "adsb" in self._kinds else scans

    def read(self, t: float, data: bytes) -> None:
        """Read a datagram."""
        if data and "radar" not in self._kinds:
            self._messages.note(t)
        super().read(t, data)

    def forget(self, t: float) -> None:
        """Forget what was not yet taken."""
        super().forget(t)
        self._reader.reports()

    def _state(self, t: float) -> str:
        # Where no plots are taken the radars' silence says nothing.
        return super()._state(t) if "radar" in self._kinds else super(RadarInput, self)._state(t)

    def close(self) -> None:
        """Do nothing: the link is closed by who opened it."""
