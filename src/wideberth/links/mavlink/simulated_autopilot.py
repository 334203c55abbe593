"""A simulated autopilot: ArduPilot or PX4, plane or copter, behind MAVLink. It decides what to fly; others move it."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import AMSL_FRAMES, RELATIVE_FRAMES, Item, waypoint
from wideberth.links.mavlink.mission_path import MissionPath, passed_waypoint
from wideberth.links.mavlink.mission_server import MissionServer
from wideberth.links.mavlink.modes import VehicleKind, px4_mode
from wideberth.links.mavlink.simulated_telemetry import SimulatedTelemetry
from wideberth.links.mavlink.telemetry import Home
from wideberth.links.mavlink.traffic_reports import text_of
from wideberth.links.mavlink.wire import Wire
from wideberth.types import FloatArray, Ownship

_OFFBOARD_LOST_S = 1.0  # PX4's COM_OF_LOSS_T
_OFFBOARD_BEFORE_S = 0.5  # a set-point must be this young for OFFBOARD
_SET_POINT_LOST_S = 3.0  # ArduCopter stops after this
_COMPLETE, _ACTIVE = 5, 3  # MISSION_STATE
_SPEED_PARAMETERS = {
    ("ardupilot", "plane"): ("AIRSPEED_CRUISE", 1.0),
    ("ardupilot", "copter"): ("WPNAV_SPEED", 100.0),
    ("px4", "plane"): ("FW_AIRSPD_TRIM", 1.0),
    ("px4", "copter"): ("MPC_XY_CRUISE", 1.0),
}


class FlightTarget(NamedTuple):
    """What to fly now, local NED: the line from `start` to `end` (3,) at a ground speed (m/s), or stay at `end`.

    `velocity` (3,), where given, is fed forward towards a moving `end`.
    """

    start: FloatArray
    end: FloatArray
    speed: float
    holds: bool = False
    velocity: FloatArray | None = None


class SimulatedAutopilot:
    """The autopilot of a vehicle that flies its mission, or what it is told.

    Whoever moves it calls `moved` with its state and flies `target`. It is armed and in the mission mode at first.

    Parameters
    ----------
    kind : VehicleKind
    frame : LocalFrame
    home : Home
    items : sequence of Item
        The mission; for ArduPilot home is put before it.
    speed : float
        Cruise speed, m/s.
    capture : float
        A waypoint is reached within this distance, or where the plane across the leg is crossed within it, m.
    system : int
    key : bytes, optional
        Of MAVLink signing.
    """

    def __init__(
        self,
        kind: VehicleKind,
        frame: LocalFrame,
        home: Home,
        items: Sequence[Item],
        speed: float,
        capture: float,
        system: int = 1,
        key: bytes | None = None,
    ) -> None:
        self.kind, self._frame, self._home = kind, frame, home
        self._speed, self._capture = speed, capture
        self.wire = Wire(system, mavlink.MAV_COMP_ID_AUTOPILOT1, key)
        self.telemetry = SimulatedTelemetry(frame, home)
        first = [waypoint(*home)] if kind.home_is_item_0 else []
        self.mission = MissionServer(self._send, [*first, *items], at_once=kind.family == "px4")
        self.mode = kind.mission_mode
        self.armed = True
        self.current = 1 if first else 0
        self.complete = False
        self._t = self._t_boot = math.nan
        self._own: Ownship | None = None
        self._version = -1
        self._path: MissionPath | None = None
        self._index = 1
        self._leg_start: FloatArray | None = None
        self._hold: FloatArray | None = None
        self._set_point: tuple[float, FloatArray, FloatArray | None] | None = None
        self._guided: tuple[FloatArray, FloatArray, float] | None = None
        self.texts: list[str] = []
        self.traffic: dict[int, Any] = {}
        self.threats: dict[int, int] = {}
        self.mode_changes: list[tuple[float, str]] = []

    def moved(self, own: Ownship) -> None:
        """Take the true state at its time."""
        before = self._own
        self._own, self._t = own, own.t
        if math.isnan(self._t_boot):
            self._t_boot = own.t - 60.0
        if self._version != self.mission.version:
            self._reload()
        if self.mode == self.kind.mission_mode and self._path is not None and before is not None:
            self._advance(before.position, own.position)

    def target(self) -> FlightTarget | None:
        """Return what to fly now; None before the first state."""
        own = self._own
        if own is None:
            return None
        if self.mode == self.kind.mission_mode and self._path is not None and self._index < len(self._path):
            start = self._path.waypoints[self._index - 1] if self._leg_start is None else self._leg_start
            end = self._path.waypoints[self._index]
            return FlightTarget(start, end, float(self._path.speeds[self._index]))
        if self.mode == self.kind.guided_mode:
            if self._guided is not None:
                start, end, speed = self._guided
                return FlightTarget(start, end, speed)
            if self._set_point is not None:
                when, place, velocity = self._set_point
                age = own.t - when
                if velocity is None or age > _SET_POINT_LOST_S:
                    return FlightTarget(own.position, place, self._speed, holds=True)
                # The target goes on with its velocity, as the autopilot's own does.
                moving = place + age * velocity
                return FlightTarget(place, moving, float(np.linalg.norm(velocity)), velocity=velocity)
        if self._hold is None:
            self._hold = own.position.copy()
        return FlightTarget(own.position, self._hold, self._speed, holds=True)

    def receive(self, data: bytes, t: float) -> None:
        """Take bytes off the wire."""
        self._t = t
        for message in self.wire.receive(data, t):
            target = getattr(message, "target_system", 0)
            if target in (0, self.wire.system):
                self._take(message, t)

    def outgoing(self, t: float) -> bytes:
        """Return what to send at time `t`."""
        self._t = t
        own = self._own
        if own is None:
            return b""
        self.mission.step(t)
        self._watch_offboard(t)
        if self.telemetry.is_due(mavlink.MAVLINK_MSG_ID_HEARTBEAT, t):
            self._send_heartbeat()
        if self.telemetry.is_due(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, t):
            self._send_current()
        for message in self.telemetry.messages(own, t - self._t_boot):
            self._send(message)
        return self.wire.take()

    def set_mode(self, mode: int) -> None:
        """Change the mode, as the pilot's switch does."""
        if mode == self.mode:
            return
        self.mode = mode
        self.mode_changes.append((self._t, self.kind.mode_name(mode)))
        self._hold = self._guided = None
        self._leg_start = None if self._own is None else self._own.position.copy()
        if mode != self.kind.guided_mode:
            self._set_point = None
        if mode == self.kind.mission_mode and self.complete:
            self._set_current(1 if self.kind.home_is_item_0 else 0)  # a completed mission begins anew
        self._send_heartbeat()

    def reboot(self, t: float) -> None:
        """Begin anew: time since boot, streams, transfers; the mission stays as it is stored."""
        self._t_boot = t
        gps = self.telemetry.has_gps
        self.telemetry = SimulatedTelemetry(self._frame, self._home)
        self.telemetry.has_gps = gps
        self.mission.restart()
        self.current = 1 if self.kind.home_is_item_0 else 0
        self._version = -1
        self.set_mode(self.kind.loiter_mode)

    def _send(self, message: Any) -> None:
        self.wire.send(message, self._t)

    def _send_heartbeat(self) -> None:
        families = {"ardupilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, "px4": mavlink.MAV_AUTOPILOT_PX4}
        plane = self.kind.airframe == "plane"
        flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        self._send(
            mavlink.MAVLink_heartbeat_message(
                mavlink.MAV_TYPE_FIXED_WING if plane else mavlink.MAV_TYPE_QUADROTOR,
                families.get(self.kind.family, mavlink.MAV_AUTOPILOT_GENERIC),
                flags | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0),
                self.mode,
                mavlink.MAV_STATE_ACTIVE,
                3,
            )
        )

    def _send_current(self) -> None:
        state = _COMPLETE if self.complete else _ACTIVE
        self._send(mavlink.MAVLink_mission_current_message(self.current, len(self.mission.items), state, 1))

    def _take(self, message: Any, t: float) -> None:
        kind = message.get_type()
        if kind.startswith("MISSION_"):
            if kind == "MISSION_SET_CURRENT":
                self._set_current(message.seq)
                self._send_current()
            else:
                self.mission.take(message, t)
                if self._version != self.mission.version and not self.mission.is_receiving:
                    self._reload()
        elif kind == "COMMAND_LONG":
            self._take_command(message, message.param5, message.param6, message.param7, t)
        elif kind == "COMMAND_INT":
            self._take_command(message, message.x * 1e-7, message.y * 1e-7, message.z, t)
        elif kind == "SET_MODE":
            self._ask_mode(message.custom_mode)
        elif kind == "SET_POSITION_TARGET_GLOBAL_INT":
            self._take_set_point(message, t)
        elif kind == "TIMESYNC" and message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(round((t - self._t_boot) * 1e9), message.ts1))
        elif kind == "PARAM_REQUEST_READ":
            name, scale = _SPEED_PARAMETERS.get((self.kind.family, self.kind.airframe), ("", 1.0))
            if name and text_of(message.param_id) == name:
                real = mavlink.MAV_PARAM_TYPE_REAL32
                self._send(mavlink.MAVLink_param_value_message(name.encode(), self._speed * scale, real, 1, 0))
        elif kind == "ADSB_VEHICLE":
            self.traffic[message.ICAO_address] = message
        elif kind == "COLLISION":
            self.threats[message.id] = message.threat_level
        elif kind == "STATUSTEXT":
            self.texts.append(text_of(message.text))

    def _take_command(self, message: Any, latitude: float, longitude: float, altitude: float, t: float) -> None:
        result = self._command(message, latitude, longitude, altitude, t)
        source = (message.get_srcSystem(), message.get_srcComponent())
        self._send(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *source))

    def _command(self, message: Any, latitude: float, longitude: float, altitude: float, t: float) -> int:
        command, accepted = message.command, mavlink.MAV_RESULT_ACCEPTED
        if command == mavlink.MAV_CMD_DO_SET_MODE:
            mode = round(message.param2)
            if self.kind.family != "ardupilot":
                mode = px4_mode(mode, round(message.param3))
            return int(accepted if self._ask_mode(mode) else mavlink.MAV_RESULT_DENIED)
        if command == mavlink.MAV_CMD_DO_REPOSITION:
            return self._reposition(message, latitude, longitude, altitude)
        if command == mavlink.MAV_CMD_DO_SET_MISSION_CURRENT:
            self._set_current(round(message.param1))
            self._send_current()
            return int(accepted)
        if command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            known = self.telemetry.set_interval(round(message.param1), message.param2)
            return int(accepted if known else mavlink.MAV_RESULT_DENIED)
        if command in (mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_GET_HOME_POSITION):
            home = command == mavlink.MAV_CMD_GET_HOME_POSITION
            wanted = mavlink.MAVLINK_MSG_ID_HOME_POSITION if home else round(message.param1)
            made = None if self._own is None else self.telemetry.one(wanted, self._own, t - self._t_boot)
            if made is None:
                return int(mavlink.MAV_RESULT_DENIED)
            self._send(made)
            return int(accepted)
        if command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = message.param1 >= 0.5
            return int(accepted)
        return int(mavlink.MAV_RESULT_UNSUPPORTED)

    def _ask_mode(self, mode: int) -> bool:
        if self.kind.family == "px4" and mode == self.kind.guided_mode and not self._is_streamed(_OFFBOARD_BEFORE_S):
            return False
        self.set_mode(mode)
        return True

    def _is_streamed(self, age: float) -> bool:
        return self._set_point is not None and self._t - self._set_point[0] <= age

    def _watch_offboard(self, t: float) -> None:
        offboard = self.kind.family == "px4" and self.mode == self.kind.guided_mode
        if offboard and not self._is_streamed(_OFFBOARD_LOST_S):
            self.set_mode(self.kind.loiter_mode)  # PX4's failsafe

    def _place(self, frame: int, latitude: float, longitude: float, altitude: float) -> FloatArray | None:
        """Return a place (deg, m) in the local frame, None for a frame that is not known."""
        if frame in RELATIVE_FRAMES:
            altitude += self._home.altitude
        elif frame not in AMSL_FRAMES:
            return None
        place = self._frame.to_ned(math.radians(latitude), math.radians(longitude), altitude)
        return place if np.all(np.isfinite(place)) else None

    def _reposition(self, message: Any, latitude: float, longitude: float, altitude: float) -> int:
        change = bool(round(message.param2) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE)
        place = self._place(getattr(message, "frame", 0), latitude, longitude, altitude)
        if self._own is None or place is None or self.kind.family != "ardupilot":
            return int(mavlink.MAV_RESULT_UNSUPPORTED)
        if self.mode != self.kind.guided_mode:
            if not change:
                return int(mavlink.MAV_RESULT_DENIED)
            self.set_mode(self.kind.guided_mode)
        speed = message.param1 if math.isfinite(message.param1) and message.param1 > 0.0 else self._speed
        self._guided = (self._own.position.copy(), place, speed)
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _take_set_point(self, message: Any, t: float) -> None:
        # A plane of ArduPilot takes only altitudes this way.
        if self.kind == VehicleKind("ardupilot", "plane"):
            return
        if self.kind.family == "ardupilot" and self.mode != self.kind.guided_mode:
            return
        place = self._place(message.coordinate_frame, message.lat_int * 1e-7, message.lon_int * 1e-7, message.alt)
        if place is None:
            return
        moves = not message.type_mask & mavlink.POSITION_TARGET_TYPEMASK_VX_IGNORE
        velocity = np.array([message.vx, message.vy, message.vz]) if moves else None
        if velocity is None or np.all(np.isfinite(velocity)):
            self._set_point, self._guided = (t, place, velocity), None

    def _reload(self) -> None:
        """Take the mission as it is now."""
        self._version = self.mission.version
        self._path = MissionPath(
            self.mission.items, self._frame, self._home, self._speed, home_is_item_0=self.kind.home_is_item_0
        )
        self._set_current(self.current)

    def _set_current(self, seq: int) -> None:
        if not 0 <= seq < max(len(self.mission.items), 1) or self._path is None:
            return
        self.complete = False
        self._index = self._path.index_of(seq, 1)
        self._leg_start = None if self._own is None else self._own.position.copy()
        self.current = self._path.seqs[self._index] if self._index < len(self._path) else seq

    def _advance(self, before: FloatArray, now: FloatArray) -> None:
        path = self._path
        if path is None:
            return
        while self._index < len(path):
            off = path.waypoints[self._index] - now
            near = math.hypot(off[0], off[1]) <= self._capture and abs(off[2]) <= max(self._capture, 5.0)
            start = path.waypoints[self._index - 1] if self._leg_start is None else self._leg_start
            leg = np.array([start, path.waypoints[self._index]])
            level = math.hypot(*(leg[1] - leg[0])[:2]) > 1.0  # an upright leg ends at its height only
            if not near and not (level and passed_waypoint(leg, 1, before, now, self._capture)):
                return
            self._send(mavlink.MAVLink_mission_item_reached_message(path.seqs[self._index]))
            self._index += 1
            self._leg_start = None
            if self._index < len(path):
                self.current = path.seqs[self._index]
        if not self.complete:
            self.complete = True
            self._send_current()
            if self.kind.family == "px4":
                self.set_mode(self.kind.loiter_mode)
