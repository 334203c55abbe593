"""Who the autopilot is, and what its heartbeats say: mode, armed, alive."""

import math
from typing import Any

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.modes import VehicleKind, kind_of

_AGREEING = 3  # messages far behind that agree that the numbers went on without us
_REORDERED = 64  # messages that others may overtake
_NOT_VEHICLES = {
    mavlink.MAV_TYPE_GCS,
    mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
    mavlink.MAV_TYPE_GIMBAL,
    mavlink.MAV_TYPE_ADSB,
    mavlink.MAV_TYPE_CAMERA,
    mavlink.MAV_TYPE_ANTENNA_TRACKER,
}


class Vehicle:
    """The autopilot that the link is with: the first heard, or the one of the configured system.

    Attributes
    ----------
    target : tuple of int or None
        System and component; None until one is heard.
    kind : VehicleKind or None
    mode : int
        `custom_mode` of the last heartbeat, in order; -1 before.
    armed : bool
    t_heartbeat : float
        When the last one came, s.
    """

    def __init__(self, system: int | None) -> None:
        self._system = system
        self.target: tuple[int, int] | None = None
        self.kind: VehicleKind | None = None
        self.mode = -1
        self.armed = False
        self.t_heartbeat = -math.inf
        self._latest = self._number = -1
        self._behind = 0

    def is_from(self, message: Any) -> bool:
        """Return whether a message is the autopilot's."""
        return (message.get_srcSystem(), message.get_srcComponent()) == self.target

    def number(self, message: Any) -> int:
        """Return a message's place among all that the autopilot sent; call it once for each.

        Its eight bits are continued. A message far behind may be new after a long gap: three in a row are.
        """
        if self._latest < 0:
            self._latest = int(message.get_seq())
            return self._latest
        ahead = (int(message.get_seq()) - self._latest + 128) % 256 - 128
        if ahead < -_REORDERED:
            self._behind += 1
            if self._behind >= _AGREEING:
                ahead += 256
        if ahead > 0:
            self._latest += ahead
            self._behind = 0
        return self._latest + min(ahead, 0)

    def take(self, message: Any, t: float) -> None:
        """Take a HEARTBEAT; the first that can be an autopilot's decides who it is.

        One that was overtaken by another tells that the link lives, but not the mode.
        """
        if self.target is None:
            source = (message.get_srcSystem(), message.get_srcComponent())
            known = self._system is None or source[0] == self._system
            if not known or message.autopilot == mavlink.MAV_AUTOPILOT_INVALID or message.type in _NOT_VEHICLES:
                return
            self.target, self.kind = source, kind_of(message.autopilot, message.type)
        if not self.is_from(message):
            return
        number = self.number(message)
        self.t_heartbeat = t
        if number <= self._number:
            return
        self._number = number
        self.mode = message.custom_mode
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    @property
    def mode_name(self) -> str:
        """The mode in words."""
        return "unknown" if self.kind is None or self.mode < 0 else self.kind.mode_name(self.mode)

    @property
    def flies_mission(self) -> bool:
        """Whether the mission is being flown."""
        return self.kind is not None and self.mode == self.kind.mission_mode
