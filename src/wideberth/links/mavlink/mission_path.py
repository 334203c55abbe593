"""The path that a mission's items lead along, in the local frame, and where on it the ownship is."""

import math
from collections.abc import Sequence

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import RELATIVE_FRAMES, TERRAIN_FRAMES, Item
from wideberth.links.mavlink.telemetry import Home
from wideberth.types import FloatArray, Mission

_PLACED = frozenset(
    {
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TURNS,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_VTOL_TAKEOFF,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_VTOL_LAND,
    }
)
_LAST = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND}
)  # nothing is flown after these by itself
_TAKEOFFS = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
_LONGEST = 2000  # waypoints, jumps followed


class MissionPath:
    """A mission's items as a path: waypoints, speeds, and which item each waypoint comes from.

    DO_JUMP is followed as often as it says, as long as the path keeps below 2000 waypoints. Terrain altitudes are taken
    above home, as the ground's height along the way is not known here. A place of zeros is the one before, as
    autopilots take it. A mission that does not begin with a takeoff is begun in the air: its first leg is level.

    Parameters
    ----------
    items : sequence of Item
    frame : LocalFrame
    home : Home
        Relative altitudes count from it; the path starts there.
    speed : float
        Ground speed where the mission sets none, m/s.
    home_is_item_0 : bool

    Attributes
    ----------
    waypoints : ndarray, shape (n, 3)
    speeds : ndarray, shape (n,)
    seqs : list of int
        The item of each waypoint; -1 for the start.
    """

    def __init__(
        self, items: Sequence[Item], frame: LocalFrame, home: Home, speed: float, *, home_is_item_0: bool
    ) -> None:
        self._frame, self._home = frame, home
        start = frame.to_ned(home.latitude, home.longitude, home.altitude)
        points, speeds, self.seqs = [start], [speed], [-1]
        jumps: dict[int, int] = {}
        seq = 1 if home_is_item_0 else 0
        # Each round but the last of an endless jump without waypoints adds one, or moves on.
        for _ in range(4 * _LONGEST):
            if seq >= len(items) or len(points) >= _LONGEST:
                break
            item = items[seq]
            if item.command == mavlink.MAV_CMD_DO_JUMP:
                seq = self._jump(item, seq, len(items), jumps)
                continue
            if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and 0.0 < item.params[1] < 1000.0:
                speed = item.params[1]
            elif item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                points.append(np.array([start[0], start[1], points[-1][2]]))
                speeds.append(speed)
                self.seqs.append(seq)
                break
            elif item.command in _PLACED:
                points.append(self._place(item, points[-1]))
                speeds.append(speed)
                self.seqs.append(seq)
                if item.command in _LAST:
                    break
            seq += 1
        if len(points) > 1 and items[self.seqs[1]].command not in _TAKEOFFS:
            points[0] = np.array([start[0], start[1], points[1][2]])
        self.waypoints, self.speeds = np.array(points), np.array(speeds)

    def __len__(self) -> int:
        return len(self.waypoints)

    def index_of(self, seq: int, near: int) -> int:
        """Return the waypoint that is flown to while item `seq` is current; with jumps the next from `near` on."""
        following = min((s for s in self.seqs[1:] if s >= seq), default=None)
        if following is None:
            return len(self.seqs)
        places = [k for k, s in enumerate(self.seqs) if s == following]
        return next((k for k in places if k >= near), places[0])

    def seq_to_resume(self, index: int) -> int:
        """Return the item with which to go on to waypoint `index`: the first after the waypoint before it.

        So the speed changes and other commands between the two are not left out.
        """
        if index >= len(self.seqs):
            return self.seqs[-1]
        before = self.seqs[index - 1]
        return self.seqs[index] if before < 0 or before >= self.seqs[index] else before + 1

    def mission(self, t_start: float, index: int) -> Mission | None:
        """Return the mission in the local frame; None where it has no waypoint."""
        if len(self.waypoints) < 2:
            return None
        return Mission(self.waypoints, self.speeds, t_start, min(max(index, 1), len(self.waypoints)))

    def passed(self, index: int, before: FloatArray, now: FloatArray, capture: float) -> bool:
        """Return whether waypoint `index` was passed on the way from `before` to `now`, within `capture` (m) abeam."""
        return passed_waypoint(self.waypoints, index, before, now, capture)

    def _jump(self, item: Item, seq: int, count: int, jumps: dict[int, int]) -> int:
        target, times = item.params[0], item.params[1]
        if not (0.0 <= target < count and math.isfinite(times)):
            return seq + 1
        done = jumps.get(seq, 0)
        if times >= 0.0 and done >= times:
            return seq + 1
        jumps[seq] = done + 1
        return int(target)

    def _place(self, item: Item, before: FloatArray) -> FloatArray:
        """Return an item's place; what it leaves open is taken from the one before."""
        z = item.z if math.isfinite(item.z) else 0.0
        if item.frame in RELATIVE_FRAMES or item.frame in TERRAIN_FRAMES:
            z += self._home.altitude
        nowhere = (item.x == 0 and item.y == 0) or abs(item.x) > 900_000_000 or abs(item.y) > 1_800_000_000
        if nowhere or not item.is_global:
            return np.array([before[0], before[1], -z if item.is_global else before[2]])
        return self._frame.to_ned(math.radians(item.x * 1e-7), math.radians(item.y * 1e-7), z)


def passed_waypoint(waypoints: FloatArray, index: int, before: FloatArray, now: FloatArray, capture: float) -> bool:
    """Return whether the plane across the leg at a waypoint was crossed within `capture` (m) of it.

    Parameters
    ----------
    waypoints : ndarray, shape (n, 3)
    index : int
        Of the waypoint.
    before, now : ndarray, shape (3,)
        Two places one after the other, local NED, m.
    capture : float
    """
    here = waypoints[index][:2]
    leg = np.zeros(2)
    for k in range(index - 1, -1, -1):
        leg = here - waypoints[k][:2]
        if float(leg @ leg) > 1.0:
            break
    length = float(np.hypot(leg[0], leg[1]))
    if length <= 1.0:
        return float(np.hypot(*(now[:2] - here))) <= 10.0
    along = float((now[:2] - here) @ leg) / length
    came = float((before[:2] - here) @ leg) / length
    return came < 0.0 <= along and float(np.hypot(*(now[:2] - here))) <= capture
