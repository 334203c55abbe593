"""What all inputs of a flight share: packets of a link in, scans out, and how they do."""

import abc
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from wideberth.frames import LocalFrame
from wideberth.live.autopilot import Autopilot
from wideberth.live.packet_queue import Arrivals, PacketQueue
from wideberth.part_config import PartConfig
from wideberth.types import Ownship, Scan, SensorHealth

DRAIN = 64
"""Packets that are read at once between two steps."""

_ARRIVALS_MAX = 4096


@dataclass(frozen=True, slots=True)
class InputLink:
    """Where an input gets its bytes.

    Attributes
    ----------
    queue : PacketQueue
    trouble : callable
        Says in words why nothing can come; empty where it can.
    t_start : float
        When it was opened, s.
    autopilot : Autopilot
        For the receiver that the autopilot has itself.
    """

    queue: PacketQueue
    trouble: Callable[[], str]
    t_start: float
    autopilot: Autopilot


class Input(abc.ABC):
    """An input: reads the packets of a link.

    Parameters
    ----------
    config : PartConfig
        An instance of the class's `Config`.
    name : str
    frame : LocalFrame
    link : InputLink

    Attributes
    ----------
    transport : {"udp", "tcp", ""}
        How its kind speaks where the address does not say; empty where it has no link of its own.
    """

    Config: ClassVar[type[PartConfig]]
    transport: ClassVar[str] = "udp"

    def __init__(self, config: Any, name: str, frame: LocalFrame, link: InputLink) -> None:
        self.name = name
        self._config = config
        self._frame = frame
        self._link = link
        self._messages = Arrivals()
        self._arrivals: list[float] = []

    @abc.abstractmethod
    def read(self, t: float, data: bytes) -> None:
        """Read a packet that arrived at time `t`, s; without bytes the connection broke."""

    @abc.abstractmethod
    def sense(self, t: float, ownship: Ownship) -> list[Scan]:
        """Return the scans of what was read since the last call."""

    @abc.abstractmethod
    def forget(self, t: float) -> None:
        """Forget what was read and not yet sensed."""

    @property
    @abc.abstractmethod
    def counters(self) -> dict[str, int]:
        """What was counted since the start."""

    @property
    @abc.abstractmethod
    def rejects(self) -> dict[str, int]:
        """What was rejected since the start, by cause; packets that the queue dropped are among them."""

    def drain(self, limit: int = DRAIN) -> bool:
        """Read at most `limit` waiting packets; return whether some are left."""
        queue = self._link.queue
        for _ in range(limit):
            packet = queue.take()
            if packet is None:
                return False
            t, data = packet
            if data and len(self._arrivals) < _ARRIVALS_MAX:
                self._arrivals.append(t)
            self.read(t, data)
        return len(queue) > 0

    def take_arrivals(self) -> list[float]:
        """Return when the packets arrived that were read since the last call, s."""
        arrivals, self._arrivals = self._arrivals, []
        return arrivals

    def health(self, t: float) -> SensorHealth:
        """Return age, rate, rejects and state at time `t`, s."""
        return SensorHealth(self._messages.age(t), self._messages.rate(t), self.rejects, self._state(t))

    def _state(self, t: float) -> str:
        if trouble := self._link.trouble():
            return trouble
        age = self._messages.age(t)
        waited = t - self._link.t_start if math.isinf(age) else age
        if waited > self._config.silent_after_s:
            return f"silent for {waited:.0f} s"
        return "nothing heard yet" if math.isinf(age) else "ok"

    def _dropped(self) -> dict[str, int]:
        dropped = self._link.queue.dropped
        return {"packets dropped, the queue was full": dropped} if dropped else {}
