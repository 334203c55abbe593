"""A maneuver by set-points in the guided mode: GUIDED of ArduPilot, OFFBOARD of PX4."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from wideberth.links.mavlink.commands import Commands, Send, result_in_words
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.flight import Phase, turn_radius
from wideberth.links.mavlink.guided_path import GuidedPath, with_floor
from wideberth.links.mavlink.mission_copy import MissionCopy
from wideberth.links.mavlink.telemetry import Telemetry
from wideberth.links.mavlink.vehicle import Vehicle
from wideberth.types import FloatArray

_STREAM_S = 0.1  # between set-points; PX4 leaves OFFBOARD below 2 Hz
_REPOSITION_S = 0.5  # between a plane's targets
_BEFORE_OFFBOARD_S = 0.5  # PX4 wants a stream before it takes the mode
_TAKE_S = 8.0  # how long it may take to get the mode
_GRACE_S = 1.5  # after a mode is acknowledged, how long the heartbeat may still tell the old one
_CURRENT_S = 4.0  # how long to wait for the current item before the mode is given back all the same
_PLANE_LEAD_S, _PLANE_LEAD_M = 8.0, 200.0  # a plane circles at its target: it is kept well ahead
_COPTER_LEAD_S = 0.2
_BLIND_S = 2.5  # without a heartbeat for so long no mode is asked for
_POSITION_AND_VELOCITY = (
    mavlink.POSITION_TARGET_TYPEMASK_AX_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_AY_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_AZ_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE
)


class GuidedFlight:
    """Takes the guided mode, sends set-points, and gives the mission mode back.

    Planes of ArduPilot get targets by DO_REPOSITION, all others positions with velocities by
    SET_POSITION_TARGET_GLOBAL_INT. Altitudes are above mean sea level.

    Parameters
    ----------
    send : callable
        Takes a message.
    commands : Commands
    vehicle : Vehicle
    telemetry : Telemetry
    mission : MissionCopy
    floor : float
        Height above the ground below which no point is commanded, m.
    tell : callable
        Takes an event in words.
    """

    def __init__(
        self,
        send: Send,
        commands: Commands,
        vehicle: Vehicle,
        telemetry: Telemetry,
        mission: MissionCopy,
        floor: float,
        tell: Callable[[str], None],
    ) -> None:
        self._send, self._commands, self._floor = send, commands, floor
        self._vehicle, self._telemetry, self._mission = vehicle, telemetry, mission
        self._tell = tell
        self.phase = Phase.IDLE
        self.lost = self.failed = ""
        self._path: GuidedPath | None = None
        self._t_begin = 0.0
        self._t_stream = self._t_mode = -math.inf
        self._acknowledged = -math.inf
        self._refusal = ""
        self._recalled: int | None = None

    def fly(self, waypoints: FloatArray, times: FloatArray, t: float) -> None:
        """Fly a path (n, 3) in the local frame from now on, instead of the mission or the path before."""
        own = self._telemetry.ownship(t)
        if own is None or self._vehicle.kind is None:
            return
        start = own.position + max(t - own.t, 0.0) * own.velocity
        speed = math.hypot(own.velocity[0], own.velocity[1])
        self._path = GuidedPath(start, waypoints, times, t, turn_radius(self._vehicle.kind.airframe, speed))
        self._t_stream = -math.inf
        if self.phase in (Phase.IDLE, Phase.RESTORING):
            self._commands.drop(mavlink.MAV_CMD_DO_SET_MODE)
            self.lost = self.failed = self._refusal = ""
            self.phase = Phase.TAKING
            self._t_begin, self._t_mode, self._acknowledged = t, t, -math.inf
            if self._vehicle.kind.family == "px4":
                self._t_mode = t + _BEFORE_OFFBOARD_S

    def end(self, t: float) -> None:
        """Give back the mode and the mission from before, and go on with the mission where it is."""
        if self.phase not in (Phase.TAKING, Phase.FLYING):
            return
        self._drop_commands()
        if self.phase is Phase.TAKING and self._vehicle.flies_mission and math.isinf(self._t_stream):
            self.phase = Phase.IDLE  # nothing was sent yet
            return
        self._begin_restoring(self._mission.seq_to_resume(), t)

    def _begin_restoring(self, seq: int, t: float) -> None:
        self.phase = Phase.RESTORING
        self._t_begin, self._t_mode, self._acknowledged = t, -math.inf, -math.inf
        if self._mission.items and not self._mission.has_current(seq):
            self._mission.set_current(seq)

    def recall(self, seq: int) -> None:
        """Give back control that a program before this one took; `seq` is the item to resume the mission with."""
        self.phase, self._recalled = Phase.RESTORING, seq

    def let_go(self, t: float) -> None:
        """Command nothing more: somebody else flies."""
        self._drop_commands()
        self._path = None
        self.phase = Phase.IDLE

    def step(self, t: float) -> None:
        """Send what is due."""
        kind = self._vehicle.kind
        if self.phase is Phase.IDLE or kind is None:
            return
        mode = self._vehicle.mode
        if t - self._vehicle.t_heartbeat > _BLIND_S:
            self._drop_commands()
        graced = mode == kind.mission_mode and t - self._acknowledged < _GRACE_S
        if self.phase is Phase.RESTORING:
            if self._recalled is not None:
                if self._mission.path is None or mode < 0:
                    return  # the mission is being read, or the mode not told yet
                self._begin_restoring(self._recalled, t)
                self._recalled = None
            self._restore(t, mode)
            return
        if self.phase is Phase.TAKING:
            if mode == kind.guided_mode or self._acknowledged > -math.inf:
                self.phase = Phase.FLYING
                self._commands.drop(mavlink.MAV_CMD_DO_REPOSITION)
                self._tell(f"flying the maneuver in {kind.mode_name(kind.guided_mode)}")
            elif mode != kind.mission_mode:
                self._lose(t)
                return
            elif t - self._t_begin > _TAKE_S:
                reason = self._refusal or "no answer"
                self.failed = f"{kind.mode_name(kind.guided_mode)} was not taken: {reason}"
                self.let_go(t)
                return
        elif mode != kind.guided_mode and not graced:
            self._lose(t)
            return
        if kind.family == "ardupilot" and kind.airframe == "plane":
            self._reposition(t)
        else:
            self._stream(t)
            if self.phase is Phase.TAKING:
                self._ask_for_mode(kind.guided_mode, t)

    def _restore(self, t: float, mode: int) -> None:
        kind = self._vehicle.kind
        assert kind is not None
        if mode == kind.mission_mode and (self._t_mode > -math.inf or self._vehicle.t_heartbeat > self._t_begin):
            self.let_go(t)
            self._tell(f"mission resumed at item {self._mission.seq_to_resume()} in {self._vehicle.mode_name}")
        elif mode not in (kind.guided_mode, kind.mission_mode):
            self._lose(t)
        else:
            if kind.family == "px4":
                self._stream(t)  # OFFBOARD without set-points would be a failsafe
            if not self._mission.is_busy or t - self._t_begin > _CURRENT_S:
                self._ask_for_mode(kind.mission_mode, t)

    def _lose(self, t: float) -> None:
        self.lost = f"mode changed to {self._vehicle.mode_name} by somebody else"
        self.let_go(t)

    def _drop_commands(self) -> None:
        self._commands.drop(mavlink.MAV_CMD_DO_SET_MODE)
        self._commands.drop(mavlink.MAV_CMD_DO_REPOSITION)

    def _ask_for_mode(self, mode: int, t: float) -> None:
        kind, target = self._vehicle.kind, self._vehicle.target
        if mavlink.MAV_CMD_DO_SET_MODE in self._commands or t < self._t_mode or target is None or kind is None:
            return
        if t - self._vehicle.t_heartbeat > _BLIND_S:
            return  # somebody may have changed the mode meanwhile
        self._t_mode = t + 0.5
        main, sub = (mode, 0) if kind.family == "ardupilot" else (mode >> 16 & 0xFF, mode >> 24 & 0xFF)

        def make(tries: int) -> Any:
            return mavlink.MAVLink_command_long_message(
                *target,
                mavlink.MAV_CMD_DO_SET_MODE,
                tries,
                mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
                main,
                sub,
                0,
                0,
                0,
                0,
            )

        self._commands.request(mavlink.MAV_CMD_DO_SET_MODE, make, t, self._answered)

    def _answered(self, result: int | None, t: float) -> None:
        if result == mavlink.MAV_RESULT_ACCEPTED:
            if self.phase is Phase.TAKING:
                self._acknowledged = t
        else:
            self._refusal = result_in_words(result)

    def _set_point(self, t: float, lead: float) -> tuple[FloatArray, FloatArray] | None:
        own = self._telemetry.ownship(t)
        if own is None or self._path is None:
            return None
        # Where it is now, not where it was when it said so; a silent link leaves it where it leads to for a while.
        position = own.position + min(max(t - own.t, 0.0), 2.0) * own.velocity
        place, velocity = self._path.set_point(t, position, lead)
        raised = with_floor(place, self._telemetry.ground, self._floor)
        if raised[2] < place[2]:
            velocity[2] = min(velocity[2], 0.0)
        return raised, velocity

    def _stream(self, t: float) -> None:
        """Send a position with a velocity."""
        own = self._telemetry.ownship(t)
        if own is None or t < self._t_stream + _STREAM_S - 1e-6:
            return
        speed = float(np.linalg.norm(own.velocity))
        kind = self._vehicle.kind
        lead = max(_PLANE_LEAD_S * speed, 50.0) if kind and kind.airframe == "plane" else _COPTER_LEAD_S * speed
        found = self._set_point(t, lead)
        frame, target = self._telemetry.frame, self._vehicle.target
        if found is None or frame is None or target is None:
            return
        self._t_stream = t
        place, velocity = found
        latitude, longitude, altitude = frame.to_geodetic(place)
        there = frame.velocity_from_ned(latitude, longitude, velocity)
        self._send(
            mavlink.MAVLink_set_position_target_global_int_message(
                int(t * 1e3) % 2**32,
                *target,
                mavlink.MAV_FRAME_GLOBAL_INT,
                _POSITION_AND_VELOCITY,
                round(math.degrees(latitude) * 1e7),
                round(math.degrees(longitude) * 1e7),
                float(altitude),
                *(float(v) for v in there),
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            )
        )

    def _reposition(self, t: float) -> None:
        """Send a target; the first ones take the guided mode with them, so that a pilot's mode is never overruled."""
        taking = self.phase is Phase.TAKING
        waits = mavlink.MAV_CMD_DO_REPOSITION in self._commands
        if (taking and waits) or t < self._t_stream + _REPOSITION_S - 1e-6:
            return
        own = self._telemetry.ownship(t)
        speed = 0.0 if own is None else math.hypot(own.velocity[0], own.velocity[1])
        found = self._set_point(t, max(_PLANE_LEAD_S * speed, _PLANE_LEAD_M))
        frame, target = self._telemetry.frame, self._vehicle.target
        if found is None or frame is None or target is None:
            return
        self._t_stream = t
        place, velocity = found
        latitude, longitude, altitude = frame.to_geodetic(place)
        message = mavlink.MAVLink_command_int_message(
            *target,
            mavlink.MAV_FRAME_GLOBAL,
            mavlink.MAV_CMD_DO_REPOSITION,
            0,
            0,
            float(np.linalg.norm(velocity[:2])),
            float(mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE if taking else 0),
            0.0,
            math.nan,
            round(math.degrees(latitude) * 1e7),
            round(math.degrees(longitude) * 1e7),
            float(altitude),
        )
        if taking:
            self._commands.request(mavlink.MAV_CMD_DO_REPOSITION, lambda _tries: message, t, self._answered)
        else:
            self._send(message)
