"""What is known of the mission in the autopilot: downloaded, put into the local frame, changed and checked."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, inserted, same_mission
from wideberth.links.mavlink.mission_path import MissionPath
from wideberth.links.mavlink.mission_protocol import MissionDownload, MissionUpload
from wideberth.links.mavlink.modes import VehicleKind
from wideberth.links.mavlink.telemetry import Telemetry
from wideberth.types import FloatArray, Mission

_WITHOUT_HOME_S = 10.0  # how long home is waited for
_PAUSE_S = 3.0  # between a download that failed and the next
_COMPLETE = 5  # MISSION_STATE_COMPLETE
_CURRENT_EVERY_S = 0.7
_CURRENT_TRIES = 12
_RECENT_MAX = 20
_RECENT_S = 30.0  # how long packets of an upload may still come to the autopilot


class MissionCopy:
    """The mission that people gave the autopilot, and what we have made of it there.

    Parameters
    ----------
    send : callable
        Takes a message.
    config : MavlinkConfig
    telemetry : Telemetry
        Gives frame and home.
    counts : Counter
    tell : callable
        Takes an event in words.

    Attributes
    ----------
    items : tuple of Item or None
        The mission without what we inserted; None before the first download.
    path : MissionPath or None
    index : int
        The waypoint of the path that is flown to.
    foreign : bool
        Whether somebody else has changed the mission since the owner last cleared this.
    is_mixed : bool
        Whether the autopilot was found to hold half of an upload of ours.
    cruise_speed : float or None
        What the autopilot flies where the mission says nothing, m/s; None while it is being asked for.
    """

    def __init__(
        self,
        send: Callable[[Any], None],
        config: MavlinkConfig,
        telemetry: Telemetry,
        counts: Counter[str],
        tell: Callable[[str], None],
    ) -> None:
        self._send, self._config, self._telemetry = send, config, telemetry
        self._counts, self._tell = counts, tell
        self.items: tuple[Item, ...] | None = None
        self.path: MissionPath | None = None
        self.index = 1
        self.foreign = self.is_mixed = False
        self.cruise_speed: float | None = None
        self.current = -1
        self.total = -1
        self._kind: VehicleKind | None = None
        self._target = (0, 0)
        self._download: MissionDownload | None = None
        self._upload: MissionUpload | None = None
        self._held: tuple[Item, ...] = ()  # what the autopilot is believed to hold
        self._insertion: tuple[int, int] | None = None  # item and number of what is inserted there
        self._pending: tuple[int, int] | None = None
        self._touched: tuple[Item, ...] | None = None  # an upload whose outcome is not sure
        self._recent: list[tuple[float, tuple[Item, ...]]] = []  # all uploads of late, and when
        self._has_ints = self._recalled = False
        self._t_next = self._t_attached = 0.0
        self._t_path = 0.0
        self._place: FloatArray | None = None
        self._wanted_current: int | None = None
        self._t_current = 0.0
        self._sends_left = 0
        self._on_mission = True
        self._acknowledged = False
        self._reached_last = False

    def attach(self, target: tuple[int, int], kind: VehicleKind, t: float) -> None:
        """Begin with an autopilot."""
        self._target, self._kind, self._t_next, self._t_attached = target, kind, t, t

    def recall(self, items: Sequence[Item], altered: Sequence[Item]) -> None:
        """Begin with what a program before this one knew: the mission of people, and what it had made of it."""
        self.items = tuple(items)
        self._held, self._recalled = tuple(altered), True
        self._recent = [(0.0, self.items), (0.0, tuple(altered))]

    @property
    def held(self) -> tuple[Item, ...]:
        """What the autopilot holds as far as is known, or is being given."""
        return self._held if self._touched is None else self._touched

    def restart(self, t: float) -> None:
        """Begin again after a reboot: transfers are given up, the mission is read again."""
        for transfer in (self._download, self._upload):
            if transfer is not None:
                transfer.cancel()
        if self._upload is not None and self._upload.touched:
            self._touched = self._upload.items
        self._download = self._upload = None
        self._wanted_current = None
        self.current = -1
        self._t_next = t

    @property
    def is_busy(self) -> bool:
        """Whether an upload goes on, or the current item is being set."""
        return self._upload is not None or self._wanted_current is not None

    @property
    def is_altered(self) -> bool:
        """Whether the autopilot holds, or may hold, something else than `items`."""
        return self._insertion is not None or self._touched is not None or self._upload is not None

    @property
    def is_unsure(self) -> bool:
        """Whether an upload failed and what it left has not been looked at yet."""
        return self._touched is not None and not self._acknowledged

    @property
    def is_inserted(self) -> bool:
        """Whether our waypoints are in the autopilot's mission."""
        return self._insertion is not None and self._upload is None

    def mission(self) -> Mission | None:
        """Return the mission in the local frame with its progress; None before it is known."""
        return None if self.path is None else self.path.mission(self._t_path, self.index)

    def insert(self, new: Sequence[Item], t: float) -> bool:
        """Upload the mission with new items before the one flown to; return False where that cannot be."""
        if self.items is None or self.path is None or self.index >= len(self.path):
            return False
        at = self.path.seqs[self.index]
        self._start_upload(inserted(self.items, at, new), (at, len(new)), t)
        return True

    def restore(self, t: float) -> None:
        """Upload the mission as people gave it."""
        if self.items is not None:
            self._start_upload(self.items, None, t)

    def set_current(self, seq: int) -> None:
        """Make an item of what the autopilot holds the current one; repeated until it says so."""
        self._wanted_current, self._t_current = seq, 0.0
        # Where it is current already the answer proves nothing: then it is said twice.
        self._sends_left = 2 if self.current == seq else 1

    @property
    def first_inserted(self) -> int:
        """The first item that we inserted, -1 where there is none."""
        return -1 if self._insertion is None else self._insertion[0]

    def take(self, message: Any, t: float) -> None:
        """Take a message of the autopilot."""
        kind = message.get_type()
        if kind == "MISSION_CURRENT":
            self._take_current(message, t)
        elif kind == "MISSION_ITEM_REACHED" and self.path is not None and self._insertion is None:
            self._reached_last = message.seq >= self.path.seqs[-1]
            if self._reached_last:
                self.index = len(self.path)
        elif kind in ("MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_ACK"):
            if self._download is not None:
                self._download.take(message, t)
            elif self._upload is not None and kind == "MISSION_ACK":
                self._upload.take(message, t)
        elif kind in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            if self._upload is not None:
                self._upload.take(message, t)
            elif message.mission_type == mavlink.MAV_MISSION_TYPE_MISSION:
                self._refuse(t)

    def heard_elsewhere(self, t: float) -> None:
        """Take the news that another station has talked with the autopilot about its mission."""
        if self._upload is None:
            self._t_next = min(self._t_next, t + 0.5)

    def step(self, t: float) -> None:
        """Go on with transfers, and look at the mission again when it is time."""
        if self._upload is not None:
            self._upload.step(t)
            if self._upload.finished:
                self._end_upload(self._upload, t)
        elif self._download is not None:
            self._download.step(t)
            if self._download.finished:
                self._end_download(self._download, t)
        elif self._kind is not None and t >= self._t_next:
            self._download = MissionDownload(
                self._send,
                self._target,
                self._config.retry_s,
                self._config.retries,
                self._counts,
                has_ints=self._has_ints,
            )
            self._download.start(t)
        if self.items is not None and self.path is None:
            self._make_path(t)
        if self._wanted_current is not None and self._upload is None and t >= self._t_current:
            self._t_current = t + _CURRENT_EVERY_S
            self._sends_left -= 1
            if self._sends_left < -_CURRENT_TRIES:
                self._tell(f"item {self._wanted_current} could not be made the current one")
                self._wanted_current = None
                return
            self._send(mavlink.MAVLink_mission_set_current_message(*self._target, self._wanted_current))

    def advance(self, position: FloatArray, *, on_mission: bool) -> None:
        """Follow the progress along the path while a maneuver is flown: what is flown past need not be flown back to.

        Parameters
        ----------
        position : ndarray, shape (3,)
        on_mission : bool
            Whether the autopilot flies the mission itself, and so knows its progress.
        """
        before, self._place = self._place, position
        self._on_mission = on_mission
        if self.path is None or before is None or on_mission:
            return
        while self.index < len(self.path) and self.path.passed(
            self.index, before, position, self._config.waypoint_capture_m
        ):
            self.index += 1

    def seq_to_resume(self) -> int:
        """Return the item to go on with after a maneuver, in the mission without what was inserted."""
        return 0 if self.path is None else self.path.seq_to_resume(self.index)

    def has_current(self, seq: int) -> bool:
        """Return whether the autopilot flies to what comes at or after item `seq` next."""
        if self.path is None:
            return self.current == seq
        if self.index >= len(self.path):
            return False  # ArduPilot would begin a completed mission anew
        return self.current >= seq and self.path.index_of(self.current, 1) == self.path.index_of(seq, 1)

    def _refuse(self, t: float) -> None:
        """Tell the autopilot that nothing is uploaded: it took a repeated or late packet for a new upload."""
        cancelled = mavlink.MAV_MISSION_OPERATION_CANCELLED
        kind = mavlink.MAV_MISSION_TYPE_MISSION
        self._send(mavlink.MAVLink_mission_ack_message(*self._target, cancelled, kind))
        self._counts["uploads begun by late packets"] += 1
        self._t_next = min(self._t_next, t + 0.5)

    def _take_current(self, message: Any, t: float) -> None:
        moved = message.seq != self.current
        self.current = message.seq
        if self._wanted_current is not None and self._sends_left <= 0 and self._is_wanted(message.seq):
            self._wanted_current = None
        if message.total not in (0, 65535):
            changed = self.total >= 0 and message.total != self.total
            self.total = message.total
            if changed and self._upload is None:
                self._t_next = min(self._t_next, t)
        if self.path is None or self._upload is not None or self._wanted_current is not None:
            return
        if not (self._on_mission or moved or self._insertion):
            return  # it stands still meanwhile, while we count what is flown past
        if self._insertion is not None:
            at, count = self._insertion
            if message.seq < at + count:
                return
            self.index = max(self.index, self.path.index_of(message.seq - count, self.index))
        elif message.mission_state == _COMPLETE or (self._reached_last and message.seq >= self.path.seqs[-1]):
            self.index = len(self.path)
        else:
            self._reached_last = False
            self.index = self.path.index_of(message.seq, min(self.index, len(self.path) - 1))

    def _is_wanted(self, seq: int) -> bool:
        wanted = self._wanted_current
        if seq == wanted or wanted is None:
            return True
        # Commands between waypoints are run at once: the next waypoint is current then.
        if self._insertion is not None or self.path is None or seq < wanted:
            return False
        return self.path.index_of(seq, 1) == self.path.index_of(wanted, 1)

    def _start_upload(self, items: tuple[Item, ...], insertion: tuple[int, int] | None, t: float) -> None:
        for transfer in (self._download, self._upload):
            if transfer is not None:
                transfer.cancel()
        self._download = None
        self._wanted_current = None
        self._pending = insertion
        self._touched = items
        self._recent = [*self._recent, (t, self._held), (t, items)][-_RECENT_MAX:]
        self.is_mixed = self._acknowledged = False
        self._upload = MissionUpload(
            self._send, self._target, self._config.retry_s, self._config.retries, self._counts, items
        )
        self._upload.start(t)

    def _end_upload(self, upload: MissionUpload, t: float) -> None:
        self._upload = None
        self._counts["missions uploaded" if upload.done else "uploads failed"] += 1
        self._acknowledged = upload.done
        if upload.done:
            self._held, self._insertion = upload.items, self._pending
            self.total = -1
            self._t_next = t + 1.0  # what it took is looked at soon
            return
        self._tell(f"mission upload failed: {upload.failure}")
        if not upload.touched:
            self._touched = None
        self._t_next = t  # what it holds now is not known

    def _end_download(self, download: MissionDownload, t: float) -> None:
        self._download = None
        self._has_ints |= download.has_ints
        if not download.done:
            self._tell(f"mission download failed: {download.failure}")
            self._t_next = t + _PAUSE_S
            return
        self._t_next = t + self._config.mission_check_s if self._config.mission_check_s > 0 else float("inf")
        self._counts["missions downloaded"] += 1
        self._judge(tuple(download.items), t)

    def _judge(self, found: tuple[Item, ...], t: float) -> None:
        """Find out whose mission the autopilot holds."""
        if self.items is None:
            self._adopt(found)
            self._tell(f"mission of {len(found)} items downloaded")
            return
        if self._recalled:
            # A program before this one was ended in the middle of a maneuver.
            self._recalled = False
            self._touched = None
            if not self._is_same(found, self.items) and _is_mixture(found, [old for _, old in self._recent]):
                self._tell("a maneuver from before the restart is in the mission")
                self.is_mixed = True
                return
        if self._touched is not None and self._is_same(found, self._touched):
            if self._insertion is None and self._pending is not None:
                self._insertion = self._pending  # the acknowledgement was lost, the mission arrived
            elif self._pending is None:
                self._insertion = None
            self._held, self._touched = found, None
        elif self._is_same(found, self._held):
            self._touched = None
        elif self._is_same(found, self.items):
            self._held, self._insertion, self._touched = found, None, None
        elif _is_mixture(found, [old for _, old in self._recent]):
            self._tell("the autopilot holds half of an upload")
            self.is_mixed = True
        else:
            self._tell("another ground station has changed the mission: it is kept")
            self.foreign = True
            self._adopt(found)
        if self._touched is None and not self.is_mixed:
            self._recent = [(when, old) for when, old in self._recent if t - when < _RECENT_S]

    def _is_same(self, a: Sequence[Item], b: Sequence[Item]) -> bool:
        return same_mission(a, b, home_is_item_0=self._kind is not None and self._kind.home_is_item_0)

    def _adopt(self, items: tuple[Item, ...]) -> None:
        self.items = self._held = items
        self._insertion = self._touched = self._pending = None
        self._wanted_current = None
        self.is_mixed = False
        self.path = None
        self.index = 1

    def _make_path(self, t: float) -> None:
        home, frame = self._telemetry.home, self._telemetry.frame
        if home is None and t - self._t_attached > _WITHOUT_HOME_S:
            home = self._telemetry.home_by_height()
        speed = self._config.cruise_speed_mps or self.cruise_speed
        if home is None or frame is None or self.items is None or self._kind is None or speed is None:
            return
        self.path = MissionPath(self.items, frame, home, speed, home_is_item_0=self._kind.home_is_item_0)
        self._t_path = t
        self.index = self.path.index_of(max(self.current, 0), 1) if len(self.path) > 1 else 1


def _is_mixture(found: Sequence[Item], sources: Sequence[Sequence[Item]]) -> bool:
    """Return whether each item is one of ours at its place: a half-written upload."""
    return bool(sources) and all(
        any(k < len(source) and same_mission([item], [source[k]], home_is_item_0=False) for source in sources) or k == 0
        for k, item in enumerate(found)
    )
