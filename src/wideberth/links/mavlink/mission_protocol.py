"""MAVLink's mission protocol as two state machines: download and upload, each with time-outs, retries and reasons."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, item_message, item_of

_COUNT_MAX = 5000
_INT_TRIES = 3  # requests for an item in the new form before the old one is tried
_MISSION = mavlink.MAV_MISSION_TYPE_MISSION
_NO_LAST_WORD = "the last acknowledgement did not come"
_REASONS = {
    mavlink.MAV_MISSION_ERROR: "error, without a reason",
    mavlink.MAV_MISSION_UNSUPPORTED_FRAME: "a coordinate frame is not supported",
    mavlink.MAV_MISSION_UNSUPPORTED: "a command is not supported",
    mavlink.MAV_MISSION_NO_SPACE: "no space for so many items",
    mavlink.MAV_MISSION_INVALID: "an item has an invalid value",
    mavlink.MAV_MISSION_INVALID_PARAM1: "param1 of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM2: "param2 of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM3: "param3 of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM4: "param4 of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM5_X: "the latitude of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM6_Y: "the longitude of an item is invalid",
    mavlink.MAV_MISSION_INVALID_PARAM7: "the altitude of an item is invalid",
    mavlink.MAV_MISSION_INVALID_SEQUENCE: "an item out of sequence",
    mavlink.MAV_MISSION_DENIED: "this station is not allowed to",
    mavlink.MAV_MISSION_OPERATION_CANCELLED: "cancelled",
}


def reason_in_words(result: int) -> str:
    """Return a MAV_MISSION_RESULT in words."""
    return _REASONS.get(result, f"result {result}")


class _Transfer:
    """What both directions share: whom to talk to, and when to say it again."""

    def __init__(
        self, send: Callable[[Any], None], target: tuple[int, int], retry: float, retries: int, counts: Counter[str]
    ) -> None:
        self._send, self._target = send, target
        self._retry, self._retries = retry, retries
        self._counts = counts
        self._due = 0.0
        self._tries = 0
        self.failure: str | None = None
        self.done = False

    @property
    def finished(self) -> bool:
        """Whether it is over, well or not."""
        return self.done or self.failure is not None

    def cancel(self) -> None:
        """Give up, and tell the autopilot."""
        if not self.finished:
            self._acknowledge(mavlink.MAV_MISSION_OPERATION_CANCELLED)
            self.failure = "cancelled"

    def _acknowledge(self, result: int) -> None:
        self._send(mavlink.MAVLink_mission_ack_message(*self._target, result, _MISSION))

    def _wait(self, t: float, *, again: bool = False) -> None:
        self._tries = self._tries + 1 if again else 0
        self._due = t + self._retry

    def _is_due(self, t: float) -> bool:
        return not self.finished and t >= self._due


class MissionDownload(_Transfer):
    """Gets the mission: list, count, one request for each item, acknowledgement.

    Parameters
    ----------
    send : callable
        Takes a message.
    target : tuple of int
        System and component of the autopilot.
    retry : float
        s to wait for an answer.
    retries : int
        Repetitions of one request before the download fails.
    counts : Counter
        Told of items that were not asked for, and of repetitions.
    has_ints : bool
        Whether the autopilot is known to give MISSION_ITEM_INT. The old MISSION_ITEM is asked for only where it is not:
        its degrees in 32 bits are wrong by up to a metre, and would be so in what is uploaded again.

    Attributes
    ----------
    has_ints : bool
    items : list of Item
    failure : str or None
        Why it failed, in words.
    done : bool
    """

    def __init__(
        self,
        send: Callable[[Any], None],
        target: tuple[int, int],
        retry: float,
        retries: int,
        counts: Counter[str],
        *,
        has_ints: bool = False,
    ) -> None:
        super().__init__(send, target, retry, retries, counts)
        self.items: list[Item] = []
        self.has_ints = has_ints
        self._count = -1

    def start(self, t: float) -> None:
        """Ask for the number of items."""
        self._ask()
        self._wait(t)

    def take(self, message: Any, t: float) -> None:
        """Take a MISSION_COUNT, MISSION_ITEM(_INT) or MISSION_ACK."""
        if self.finished or message.mission_type != _MISSION:
            return
        kind = message.get_type()
        if kind == "MISSION_COUNT" and self._count < 0:
            if message.count > _COUNT_MAX:
                self.failure = f"the autopilot has {message.count} items; {_COUNT_MAX} are the most"
                return
            self._count = message.count
            self._next(t)
        elif kind in ("MISSION_ITEM_INT", "MISSION_ITEM") and self._count >= 0:
            if message.seq != len(self.items):
                self._counts["mission item out of sequence"] += 1
                return
            if kind == "MISSION_ITEM_INT" and not self.has_ints:
                self.has_ints = True
                if self.items:
                    # Those before came as floats although there is something better.
                    self.items.clear()
                    self._next(t)
                    return
            self.items.append(item_of(message))
            self._next(t)
        elif kind == "MISSION_ACK" and message.type not in (
            mavlink.MAV_MISSION_ACCEPTED,
            mavlink.MAV_MISSION_INVALID_SEQUENCE,
        ):
            self.failure = reason_in_words(message.type)

    def step(self, t: float) -> None:
        """Repeat what was not answered."""
        if not self._is_due(t):
            return
        if self._tries >= self._retries:
            what = "the number of items" if self._count < 0 else f"item {len(self.items)} of {self._count}"
            self._acknowledge(mavlink.MAV_MISSION_OPERATION_CANCELLED)
            self.failure = f"{what} was not sent, asked {self._tries + 1} times"
            return
        self._counts["mission requests repeated"] += 1
        self._wait(t, again=True)
        self._ask()

    def _next(self, t: float) -> None:
        if len(self.items) == self._count:
            self.done = True
            self._acknowledge(mavlink.MAV_MISSION_ACCEPTED)
            return
        self._wait(t)
        self._ask()

    def _ask(self) -> None:
        if self._count < 0:
            self._send(mavlink.MAVLink_mission_request_list_message(*self._target, _MISSION))
            return
        old = self._tries >= _INT_TRIES and not self.has_ints
        kind = mavlink.MAVLink_mission_request_message if old else mavlink.MAVLink_mission_request_int_message
        self._send(kind(*self._target, len(self.items), _MISSION))


class MissionUpload(_Transfer):
    """Gives the autopilot a mission: count, the items it asks for, its acknowledgement.

    Parameters
    ----------
    send, target, retry, retries, counts
        As for `MissionDownload`.
    items : sequence of Item

    Attributes
    ----------
    failure : str or None
        Why it failed, in words.
    unsure : bool
        Whether all items were sent, but the last acknowledgement is missing: the autopilot may have the mission.
    done : bool
    """

    def __init__(
        self,
        send: Callable[[Any], None],
        target: tuple[int, int],
        retry: float,
        retries: int,
        counts: Counter[str],
        items: Sequence[Item],
    ) -> None:
        super().__init__(send, target, retry, retries, counts)
        self.items = tuple(items)
        self._asked: set[int] = set()
        self._last: tuple[int, bool] | None = None

    @property
    def unsure(self) -> bool:
        """Whether the autopilot may have the whole mission although it did not say so."""
        return not self.done and len(self._asked) == len(self.items)

    @property
    def touched(self) -> bool:
        """Whether the autopilot has begun to take it, so that its mission may be a mixture."""
        return bool(self._asked)

    def start(self, t: float) -> None:
        """Tell the number of items."""
        self._count()
        self._wait(t)

    def take(self, message: Any, t: float) -> None:
        """Take a MISSION_REQUEST(_INT) or MISSION_ACK."""
        if self.finished or message.mission_type != _MISSION:
            return
        kind = message.get_type()
        if kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            if message.seq >= len(self.items):
                self._counts["mission request out of sequence"] += 1
                return
            self._last = (message.seq, kind == "MISSION_REQUEST")
            self._asked.add(message.seq)
            self._wait(t)
            self._give()
        elif kind == "MISSION_ACK":
            self._answered(message.type)

    def step(self, t: float) -> None:
        """Repeat what was not answered."""
        if not self._is_due(t):
            return
        if self._tries >= self._retries:
            if self.unsure:
                self.failure = _NO_LAST_WORD
            else:
                self._acknowledge(mavlink.MAV_MISSION_OPERATION_CANCELLED)
                asked = "no item was asked for" if not self._asked else f"no more asked for after item {self._last_seq}"
                self.failure = f"{asked}, waited {self._tries + 1} times"
            return
        self._counts["mission items repeated"] += 1
        self._wait(t, again=True)
        if self._last is None:
            self._count()
        else:
            self._give()

    @property
    def _last_seq(self) -> int:
        return -1 if self._last is None else self._last[0]

    def _answered(self, result: int) -> None:
        if result == mavlink.MAV_MISSION_ACCEPTED:
            # One that comes sooner belongs to a transfer before this one.
            if len(self._asked) == len(self.items):
                self.done = True
            else:
                self._counts["mission acknowledgement out of sequence"] += 1
        elif result == mavlink.MAV_MISSION_INVALID_SEQUENCE:
            # ArduPilot says so of an item that came twice, and goes on.
            self._counts["mission item refused as out of sequence"] += 1
        elif result == mavlink.MAV_MISSION_ERROR and self.unsure:
            # ArduPilot's answer to the last item said again: it has them all, and its acknowledgement was lost.
            self.failure = _NO_LAST_WORD
        else:
            self.failure = reason_in_words(result)

    def _count(self) -> None:
        self._send(mavlink.MAVLink_mission_count_message(*self._target, len(self.items), _MISSION))

    def _give(self) -> None:
        if self._last is not None:
            seq, as_floats = self._last
            self._send(item_message(self.items[seq], seq, *self._target, as_floats=as_floats))
