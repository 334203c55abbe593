"""Mission items as the autopilot holds them: nothing of an item is lost between download and upload."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from wideberth.links.mavlink.dialect import mavlink

RELATIVE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
TERRAIN_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT})
AMSL_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
_DEGREES_TO_INT = 1e7


@dataclass(frozen=True, slots=True)
class Item:
    """A mission item as on the wire (MISSION_ITEM_INT).

    Attributes
    ----------
    frame, command : int
        MAV_FRAME and MAV_CMD.
    params : tuple of float
        The first four.
    x, y : int
        1e-7 deg in the global frames, 1e-4 m in local ones.
    z : float
        m.
    autocontinue : int
    """

    frame: int
    command: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    autocontinue: int = 1

    @property
    def is_global(self) -> bool:
        """Whether it has a place on the Earth."""
        return self.frame in RELATIVE_FRAMES or self.frame in TERRAIN_FRAMES or self.frame in AMSL_FRAMES


def item_of(message: Any) -> Item:
    """Return the item of a MISSION_ITEM_INT, or of the old MISSION_ITEM with its degrees in floats."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        scale = 1e4 if message.frame in (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_ENU) else _DEGREES_TO_INT
        x, y = (_whole(value * scale) for value in (x, y))
    params = (message.param1, message.param2, message.param3, message.param4)
    return Item(message.frame, message.command, params, x, y, message.z, message.autocontinue)


def item_message(item: Item, seq: int, system: int, component: int, *, as_floats: bool = False) -> Any:
    """Return the MISSION_ITEM_INT (or the old MISSION_ITEM) that carries an item."""
    kind: Any = mavlink.MAVLink_mission_item_int_message
    x: float = item.x
    y: float = item.y
    if as_floats:
        local = item.frame in (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_ENU)
        scale = 1e4 if local else _DEGREES_TO_INT
        kind, x, y = mavlink.MAVLink_mission_item_message, item.x / scale, item.y / scale
    return kind(
        system,
        component,
        seq,
        item.frame,
        item.command,
        0,
        item.autocontinue,
        *item.params,
        x,
        y,
        item.z,
        mavlink.MAV_MISSION_TYPE_MISSION,
    )


def waypoint(latitude: float, longitude: float, altitude: float) -> Item:
    """Return a waypoint at a latitude and longitude (rad) and an altitude above mean sea level (m)."""
    return Item(
        mavlink.MAV_FRAME_GLOBAL_INT,
        mavlink.MAV_CMD_NAV_WAYPOINT,
        # No hold; the autopilot's own acceptance and pass radius; heading as it likes.
        (0.0, 0.0, 0.0, 0.0),
        round(math.degrees(latitude) * _DEGREES_TO_INT),
        round(math.degrees(longitude) * _DEGREES_TO_INT),
        altitude,
    )


def speed_change(speed: float) -> Item:
    """Return the item that changes the ground speed, m/s."""
    params = (1.0, speed, -1.0, 0.0)
    return Item(mavlink.MAV_FRAME_MISSION, mavlink.MAV_CMD_DO_CHANGE_SPEED, params, 0, 0, 0.0)


def inserted(items: Sequence[Item], at: int, new: Sequence[Item]) -> tuple[Item, ...]:
    """Return a mission with new items before item `at`; jumps lead to where they led before."""
    shift = len(new)
    moved = tuple(
        dataclasses.replace(item, params=(item.params[0] + shift, *item.params[1:]))
        if item.command == mavlink.MAV_CMD_DO_JUMP and item.params[0] >= at
        else item
        for item in items
    )
    return (*moved[:at], *new, *moved[at:])


def same_mission(a: Sequence[Item], b: Sequence[Item], *, home_is_item_0: bool) -> bool:
    """Return whether two missions fly alike: what autopilots round or rewrite on storage does not count.

    ArduPilot keeps its own home as item 0, keeps altitudes to the centimetre and some parameters as small integers.
    """
    if len(a) != len(b):
        return False
    first = 1 if home_is_item_0 else 0
    return all(_same_item(x, y) for x, y in zip(a[first:], b[first:], strict=True))


def _same_item(a: Item, b: Item) -> bool:
    if a.command != b.command or abs(a.x - b.x) > 2 or abs(a.y - b.y) > 2:
        return False
    if a.command == mavlink.MAV_CMD_DO_JUMP and round(a.params[0]) != round(b.params[0]):
        return False
    return not (math.isfinite(a.z) and math.isfinite(b.z) and abs(a.z - b.z) > 0.02)


def _whole(value: float) -> int:
    return round(value) if math.isfinite(value) and abs(value) < 2**31 else 0
