"""What a flight needs of an autopilot, and its link: bytes to it and from it."""

from collections.abc import Callable
from typing import Protocol

from wideberth.frames import LocalFrame
from wideberth.live.packet_queue import PacketQueue
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Maneuver, Mission, Ownship, SensorHealth, Snapshot

DATAGRAM_MAX = 1400
"""Bytes of a datagram to the autopilot, so that none is cut into fragments on the way."""

_SIGNED, _SIGNATURE = 0x01, 13


class Autopilot(Protocol):
    """An autopilot on the other side of bytes; see `links.mavlink.autopilot.Autopilot`."""

    frame: LocalFrame | None
    released: bool
    counters: dict[str, int]
    state: str

    def receive(self, data: bytes, t: float) -> None:
        """Take bytes off the wire."""

    def outgoing(self, t: float) -> bytes:
        """Return all bytes to send now."""

    def ownship(self, t: float) -> Ownship | None:
        """Return the latest telemetry."""

    def mission(self) -> Mission | None:
        """Return the mission with its progress."""

    def fly(self, t: float, maneuver: Maneuver | None) -> None:
        """Say what to fly now."""

    def report(self, t: float, snapshot: Snapshot) -> None:
        """Tell the autopilot and its ground station what was seen."""

    def reports(self, t: float) -> list[AdsbReport]:
        """Return what the autopilot heard of the traffic since the last call."""

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, in words."""

    def health(self, t: float) -> SensorHealth:
        """Return how the link does."""

    def release(self, t: float) -> None:
        """Give back control."""


class AutopilotLink:
    """Carries bytes between an autopilot and its end of the link.

    Parameters
    ----------
    autopilot : Autopilot
    queue : PacketQueue
        What comes.
    send : callable
        Hands bytes to the system, and returns whether it took them.
    now : callable
        Live time, s.
    before_sending : callable
        Called when it is known what is to be sent, and nothing of it has been.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        queue: PacketQueue,
        send: Callable[[bytes], bool],
        now: Callable[[], float],
        before_sending: Callable[[], None],
    ) -> None:
        self.autopilot = autopilot
        self._queue = queue
        self._send = send
        self._now = now
        self._before_sending = before_sending

    def take(self) -> None:
        """Hand all that came to the autopilot."""
        while (packet := self._queue.take()) is not None:
            t, data = packet
            if data:
                self.autopilot.receive(data, t)

    def pump(self) -> bool:
        """Hand over all that came, and all that is to be sent; return whether something was sent."""
        self.take()
        data, sent = self.autopilot.outgoing(self._now()), False
        self._before_sending()
        for part in datagrams(data):
            sent = self._send(part) or sent
        return sent


def datagrams(data: bytes) -> list[bytes]:
    """Return whole MAVLink messages joined to pieces of at most `DATAGRAM_MAX` bytes; other bytes stay together."""
    if len(data) <= DATAGRAM_MAX:
        return [data] if data else []
    pieces: list[bytes] = []
    start = end = 0
    while end < len(data):
        following = end + _message_length(data[end : end + 3], len(data) - end)
        if following - start > DATAGRAM_MAX and end > start:
            pieces.append(data[start:end])
            start = end
        end = following
    pieces.append(data[start:])
    return pieces


def _message_length(head: bytes, rest: int) -> int:
    """Return the length of the MAVLink message that begins with these bytes; `rest` where none does."""
    if len(head) == 3 and head[0] == 0xFD:
        return min(head[1] + 12 + (_SIGNATURE if head[2] & _SIGNED else 0), rest)
    if len(head) == 3 and head[0] == 0xFE:
        return min(head[1] + 8, rest)
    return rest
