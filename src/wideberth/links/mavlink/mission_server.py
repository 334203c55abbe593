"""The autopilot's side of the mission protocol, as ArduPilot and PX4 behave; for the simulated autopilot."""

from collections.abc import Callable, Sequence
from typing import Any

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, item_message, item_of

_MISSION = mavlink.MAV_MISSION_TYPE_MISSION
_REPEAT_S, _GIVE_UP_S = 1.0, 8.0


class MissionServer:
    """Holds a mission, gives it to whoever asks, and takes a new one.

    ArduPilot writes each item as it comes, so that an upload broken off leaves a mixture, and refuses an item that it
    did not ask for with an acknowledgement. PX4 takes the new mission only when it is whole, and asks again.

    Parameters
    ----------
    send : callable
        Takes a message.
    items : sequence of Item
    at_once : bool
        PX4: the mission changes only when all items are there.
    most : int
        Items that fit.

    Attributes
    ----------
    items : list of Item
    version : int
        Raised with each change.
    """

    def __init__(self, send: Callable[[Any], None], items: Sequence[Item], *, at_once: bool, most: int = 700) -> None:
        self._send, self._at_once, self._most = send, at_once, most
        self.items = list(items)
        self.version = 0
        self.refuse_with: int | None = None
        self._peer: tuple[int, int] | None = None
        self._incoming: list[Item] = []
        self._count = 0
        self._t_due = self._t_last = 0.0
        self._as_floats = False

    @property
    def is_receiving(self) -> bool:
        """Whether an upload goes on."""
        return self._peer is not None

    def take(self, message: Any, t: float) -> None:
        """Take a message of the mission protocol."""
        if message.mission_type != _MISSION:
            return
        source = (message.get_srcSystem(), message.get_srcComponent())
        kind = message.get_type()
        if kind == "MISSION_REQUEST_LIST":
            self._send(mavlink.MAVLink_mission_count_message(*source, len(self.items), _MISSION))
        elif kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            if message.seq < len(self.items):
                as_floats = kind == "MISSION_REQUEST"
                self._send(item_message(self.items[message.seq], message.seq, *source, as_floats=as_floats))
            else:
                self._acknowledge(source, mavlink.MAV_MISSION_INVALID_SEQUENCE)
        elif kind == "MISSION_COUNT":
            self._begin(source, message.count, t)
        elif kind in ("MISSION_ITEM_INT", "MISSION_ITEM"):
            self._take_item(source, message, t)
        elif kind == "MISSION_CLEAR_ALL":
            self.items.clear()
            self.version += 1
            self._acknowledge(source, mavlink.MAV_MISSION_ACCEPTED)
        elif kind == "MISSION_ACK" and (source, message.type) == (self._peer, mavlink.MAV_MISSION_OPERATION_CANCELLED):
            self._peer = None

    def step(self, t: float) -> None:
        """Ask again for an item that did not come."""
        if self._peer is None:
            return
        if t - self._t_last > _GIVE_UP_S:
            self._acknowledge(self._peer, mavlink.MAV_MISSION_OPERATION_CANCELLED)
            self._peer = None
        elif t >= self._t_due:
            self._ask(t)

    def restart(self) -> None:
        """Forget the upload that a reboot broke off."""
        self._peer = None

    def _begin(self, source: tuple[int, int], count: int, t: float) -> None:
        if self._peer is not None and self._peer != source:
            self._acknowledge(source, mavlink.MAV_MISSION_DENIED)
            return
        if self.refuse_with is not None:
            self._acknowledge(source, self.refuse_with)
            return
        if count > self._most:
            self._acknowledge(source, mavlink.MAV_MISSION_NO_SPACE)
            return
        self._incoming, self._count = [], count
        if not self._at_once:
            del self.items[count:]
            self.version += 1
        if count == 0:
            self._finish(source)
            return
        self._peer, self._t_last = source, t
        self._ask(t)

    def _take_item(self, source: tuple[int, int], message: Any, t: float) -> None:
        if self._peer is None:
            self._acknowledge(source, mavlink.MAV_MISSION_ERROR)
            return
        if source != self._peer:
            self._acknowledge(source, mavlink.MAV_MISSION_DENIED)
            return
        seq = len(self._incoming)
        if message.seq != seq:
            if self._at_once:
                self._ask(t)
            else:
                self._acknowledge(source, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return
        item = item_of(message)
        self._incoming.append(item)
        self._t_last = t
        if not self._at_once:
            self.items[seq : seq + 1] = [item]
            self.version += 1
        if len(self._incoming) == self._count:
            self._finish(source)
        else:
            self._ask(t)

    def _finish(self, source: tuple[int, int]) -> None:
        self.items[:] = self._incoming
        self.version += 1
        self._peer = None
        self._acknowledge(source, mavlink.MAV_MISSION_ACCEPTED)

    def _ask(self, t: float) -> None:
        assert self._peer is not None
        self._t_due = t + _REPEAT_S
        self._send(mavlink.MAVLink_mission_request_int_message(*self._peer, len(self._incoming), _MISSION))

    def _acknowledge(self, target: tuple[int, int], result: int) -> None:
        self._send(mavlink.MAVLink_mission_ack_message(*target, result, _MISSION))
