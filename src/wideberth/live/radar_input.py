"""Radars as inputs of a flight: datagrams become scans."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Protocol

from wideberth.frames import LocalFrame
from wideberth.links.config import RadarUdpConfig, RadarUnitConfig
from wideberth.links.radar_udp import RadarUdpReader
from wideberth.live.clock import SensorClock
from wideberth.live.config import LinkConfig
from wideberth.live.inputs import Input, InputLink
from wideberth.types import Ownship, Scan, SensorHealth

_SCANS_MAX = 1000
_UNNAMED = RadarUnitConfig().name


class RadarReader(Protocol):
    """Turns datagrams into scans."""

    def feed(self, data: bytes, t: float) -> list[Scan]:
        """Return the scans of one datagram."""

    def health(self, t: float) -> SensorHealth:
        """Return how the radars do."""

    @property
    def counters(self) -> dict[str, int]:
        """What was counted since the start."""

    @property
    def rejects(self) -> dict[str, int]:
        """What was rejected since the start, by cause."""


def named_units(units: tuple[RadarUnitConfig, ...], name: str) -> tuple[RadarUnitConfig, ...]:
    """Return the units of an input; a single one without a name of its own is called as the input is."""
    if len(units) == 1 and units[0].name == _UNNAMED:
        return (units[0].model_copy(update={"name": name}),)
    return units


class RadarUdpInputConfig(LinkConfig, RadarUdpConfig):
    """Radars that send plots in UDP datagrams, and where."""

    @property
    def scan_kind(self) -> str:
        """Kind of their scans."""
        return "radar_cone" if self.packet == "thesis" and self.thesis.angle == "cone" else "radar"

    def unit_names(self, name: str) -> tuple[str, ...]:
        """Return what the units of an input are called."""
        return tuple(unit.name for unit in named_units(self.units, name))

    def unit_intervals(self, name: str) -> Mapping[str, float]:
        """Return how often each unit looks, s."""
        return {unit.name: unit.update_interval_s for unit in named_units(self.units, name)}


class RadarInput(Input):
    """Radars whose datagrams a reader understands; subclasses name the reader."""

    make_reader: ClassVar[Callable[..., RadarReader]]

    def __init__(self, config: Any, name: str, frame: LocalFrame, link: InputLink) -> None:
        super().__init__(config, name, frame, link)
        self._reader = type(self).make_reader(
            config.model_copy(update={"units": named_units(config.units, name)}), frame, link.autopilot.ownship
        )
        self._scans: deque[Scan] = deque()
        self._clocks: dict[str, SensorClock] = {}
        self._lost = 0

    @property
    def counters(self) -> dict[str, int]:
        """What was counted since the start."""
        return self._reader.counters | ({"scans nobody took": self._lost} if self._lost else {})

    @property
    def rejects(self) -> dict[str, int]:
        """What was rejected since the start, by cause."""
        return {**self._reader.rejects, **self._dropped()}

    def read(self, t: float, data: bytes) -> None:
        """Read a datagram."""
        if data:
            self.take(self._reader.feed(data, t), t)

    def take(self, scans: Iterable[Scan], t: float) -> None:
        """Keep scans that were completed at time `t`, s."""
        for scan in scans:
            self._messages.note(t)
            self._clocks.setdefault(scan.sensor, SensorClock()).note(scan)
            self._scans.append(scan)
        while len(self._scans) > _SCANS_MAX:
            self._scans.popleft()
            self._lost += 1

    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return the scans since the last call, each with its own time."""
        scans = [self._judged(scan) for scan in self._scans]
        self._scans.clear()
        return scans

    def _judged(self, scan: Scan) -> Scan:
        """Return a scan whose health also says what its reader cannot know."""
        trouble, dropped = self._clocks[scan.sensor].trouble(), self._dropped()
        if scan.health is None or not (trouble or dropped):
            return scan
        state = trouble if scan.health.state == "ok" and trouble else scan.health.state
        return replace(scan, health=replace(scan.health, state=state, rejects={**scan.health.rejects, **dropped}))

    def forget(self, t: float) -> None:
        """Forget the scans that were not yet taken."""
        self._scans.clear()

    def _state(self, t: float) -> str:
        troubles = [trouble for clock in self._clocks.values() if (trouble := clock.trouble())]
        return self._link.trouble() or next(iter(troubles), "") or self._reader.health(t).state


class RadarUdpInput(RadarInput):
    """Radars that send plots in UDP datagrams."""

    Config = RadarUdpInputConfig
    make_reader = RadarUdpReader
