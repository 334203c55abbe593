"""An autopilot over MAVLink: bytes and times in, ownship, mission and traffic out, and maneuvers flown."""

import math
from collections import Counter, deque
from typing import Any

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.mavlink.approval import Approval
from wideberth.links.mavlink.commands import Commands
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.cruise_speed import DEFAULT_SPEED, CruiseSpeed
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.flight import Flight, Phase, same_path
from wideberth.links.mavlink.guided_flight import GuidedFlight
from wideberth.links.mavlink.hand_over import HandOver
from wideberth.links.mavlink.inserted_flight import InsertedFlight
from wideberth.links.mavlink.mission_copy import MissionCopy
from wideberth.links.mavlink.streams import Streams
from wideberth.links.mavlink.telemetry import Telemetry
from wideberth.links.mavlink.traffic_messages import TrafficMessages
from wideberth.links.mavlink.traffic_reports import TrafficReports
from wideberth.links.mavlink.vehicle import Vehicle
from wideberth.links.mavlink.wire import Wire, signing_key
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import FloatArray, Maneuver, Mission, Ownship, SensorHealth, Snapshot

_EVENTS_MAX = 200
NOT_UNDERSTOOD = "not understood"
_UTC_ERROR_S = 1.0
_MISSION_ANSWERS = ("MISSION_ACK", "MISSION_COUNT")
_BACK_OFF_S = 5.0  # after a maneuver that could not be flown


class Autopilot:
    """The link to one autopilot. No socket and no clock: whoever runs it gives bytes and times.

    The pilot always wins: a mode that somebody else sets ends the maneuver, and nothing is commanded until the mission
    mode is given back (docs/mavlink.md).

    Parameters
    ----------
    config : MavlinkConfig
    frame : LocalFrame, optional
        By default made about home or the first global position.

    Attributes
    ----------
    counters : dict
        What was counted, in words.
    """

    Config = MavlinkConfig

    def __init__(self, config: MavlinkConfig, frame: LocalFrame | None = None) -> None:
        self._config = config
        key = None if config.signing_key is None else signing_key(config.signing_key)
        self._wire = Wire(
            config.system_id,
            config.component_id,
            key,
            config.signing_link_id,
            allow_unsigned=config.allow_unsigned,
        )
        self._counts: Counter[str] = Counter()
        self._events: deque[str] = deque(maxlen=_EVENTS_MAX)
        self._t = -math.inf
        self._telemetry = Telemetry(config, frame)
        self._vehicle = Vehicle(config.target_system)
        self._commands = Commands(self._send, config.retry_s, config.retries)
        self._mission = MissionCopy(self._send, config, self._telemetry, self._counts, self._tell)
        self._streams = Streams(self._send, config, self._telemetry)
        self._cruise = CruiseSpeed(self._send)
        self._reports = TrafficReports(self._counts)
        self._traffic = TrafficMessages()
        self._approval = Approval(config, lambda text: self._traffic.say(text, 4))
        floor = config.floor_agl_m
        self._guided = GuidedFlight(
            self._send, self._commands, self._vehicle, self._telemetry, self._mission, floor, self._tell
        )
        self._inserted = InsertedFlight(self._vehicle, self._telemetry, self._mission, floor, self._tell)
        self._flight: Flight = self._guided
        self._wanted: Maneuver | None = None
        self._flown: tuple[FloatArray, FloatArray] | None = None
        self._pilot = False  # control was lost to somebody else
        self._gave_mission = False  # ... who set the mission mode himself
        self._number_of_current = -1
        self._t_failed = -math.inf
        self._guided_refused = False
        self._releasing = False
        self._linked = False
        self._position_state = "ok"
        self._utc_told = False
        self._recalled: str | None = None

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame; None before the first global position."""
        return self._telemetry.frame

    @property
    def counters(self) -> dict[str, int]:
        """What was counted, in words."""
        counts = self._wire.counts + self._counts + self._telemetry.counts
        return {name: count for name, count in counts.items() if count}

    @property
    def state(self) -> str:
        """One word or two for the status line."""
        if not self._linked:
            return "no link"
        if not self._config.command:
            return "advisory"
        if self._flight.phase in (Phase.TAKING, Phase.FLYING):
            return "avoiding"
        if self._pilot:
            return "pilot"
        if self._flight.phase is Phase.RESTORING or self._inserted.phase is not Phase.IDLE:
            return "restoring"
        if not self._vehicle.flies_mission:
            return "pilot"
        return "approval" if self._approval.is_open else "monitoring"

    @property
    def released(self) -> bool:
        """Whether control was given back, and nothing remains to be restored."""
        idle = self._guided.phase is Phase.IDLE and self._inserted.phase is Phase.IDLE
        return self._releasing and idle and not self._mission.is_altered

    @property
    def mode(self) -> str:
        """The autopilot's mode in words."""
        return self._vehicle.mode_name

    @property
    def height_above_ground(self) -> float:
        """Height above the ground (terrain where it is told, else home), m; NaN while it is not known."""
        return self._telemetry.height_above_ground

    def receive(self, data: bytes, t: float) -> None:
        """Take bytes off the wire, cut anywhere; garbage is counted.

        Parameters
        ----------
        data : bytes
        t : float
            Time of receipt, Unix s.
        """
        self._t = t
        for message in self._wire.receive(data, t):
            try:
                self._take(message, t)
            except (ValueError, OverflowError, ZeroDivisionError, TypeError):
                # A message that passes its checksum but says nonsense: seen, counted, left out.
                self._counts[f"{message.get_type()} {NOT_UNDERSTOOD}"] += 1

    def outgoing(self, t: float) -> bytes:
        """Return all bytes to send now; to be called at 20 Hz or faster."""
        self._t = t
        self._watch_link(t)
        self._streams.step(self._vehicle.target, t)
        target, kind = self._vehicle.target, self._vehicle.kind
        if target is not None and kind is not None and self._linked:
            self._cruise.step(target, kind, t)
            if self._cruise.is_over:
                self._mission.cruise_speed = self._cruise.value or DEFAULT_SPEED[kind.airframe]
            self._mission.step(t)
            self._commands.step(t)
            own = self._telemetry.ownship(t)
            if own is not None:
                self._mission.advance(own.position, on_mission=self._flight.phase is Phase.IDLE)
        self._decide(t)
        for flight in (self._guided, self._inserted):
            if self._config.command:
                flight.step(t)
            self._hear(flight, t)
        for text in self._traffic.texts(t):
            self._send(text)
        return self._wire.take()

    def ownship(self, t: float) -> Ownship | None:
        """Return the latest state; None before the first. Its `t` is when it was true, its `state` what is wrong."""
        return self._telemetry.ownship(t)

    def mission(self) -> Mission | None:
        """Return the mission with its progress; None before it is downloaded and home is known."""
        return self._mission.mission()

    def fly(self, t: float, maneuver: Maneuver | None) -> None:
        """Say what to fly now, at each step; None: the mission.

        Nothing is commanded unless the configuration's `command` is set, and a human approves where he is asked.
        """
        self._wanted = None if self._releasing else maneuver
        self._t = t

    def report(self, t: float, snapshot: Snapshot) -> None:
        """Tell the autopilot and ground stations of tracks and threats."""
        if self._telemetry.frame is None:
            return
        messages = self._traffic.of_snapshot(t, snapshot, self._telemetry.frame, traffic=self._config.send_traffic)
        for address, message in messages:
            if address is not None:
                self._reports.tell(address, t)
            self._send(message)

    def reports(self, t: float) -> list[AdsbReport]:
        """Return the traffic that the autopilot told of since the last call."""
        return self._reports.drain()

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, in words."""
        events = tuple(self._events)
        self._events.clear()
        return events

    def health(self, t: float) -> SensorHealth:
        """Return how telemetry does."""
        state = self._telemetry.state(t) if self._linked else "no link"
        age = max(t - self._telemetry.t_received, 0.0)
        told = self._counts.items()
        rejects = {
            **self._wire.rejects,
            **self._telemetry.counts,
            **{name: count for name, count in told if name.endswith(NOT_UNDERSTOOD)},
        }
        return SensorHealth(age, self._telemetry.rate(t), rejects, state)

    def release(self, t: float) -> None:
        """Give back control: mode and mission from before are restored by what `outgoing` returns from now on."""
        self._releasing = True
        self._wanted = None
        self._t = t

    @property
    def hand_over(self) -> str | None:
        """What a program after this one needs to give back control, as text for `recall`; None: there is nothing.

        To be kept somewhere safe whenever it changes.
        """
        mission, guided = self._mission, self._guided.phase is not Phase.IDLE
        if not (guided or mission.is_altered):
            return None
        if mission.items is None:
            return self._recalled  # not even read yet
        return HandOver(guided, mission.seq_to_resume(), mission.items, mission.held).to_json()

    def recall(self, hand_over: str) -> None:
        """Give back what a program before this one had taken when it was ended; before the first `receive`.

        Raises
        ------
        InputError
            If the text is not one of `hand_over`.
        """
        left = HandOver.from_json(hand_over)
        self._recalled = hand_over
        self._mission.recall(left.items, left.altered)
        if left.guided:
            self._guided.recall(left.seq)

    def _send(self, message: Any) -> None:
        self._wire.send(message, self._t)

    def _tell(self, event: str) -> None:
        self._events.append(event)

    def _take(self, message: Any, t: float) -> None:
        kind = message.get_type()
        if kind == "COMMAND_LONG" or kind == "COMMAND_INT":
            self._take_command(message)
            return
        if kind == "TIMESYNC" and message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(round(t * 1e9), message.ts1))
            return
        if kind == "HEARTBEAT":
            self._take_heartbeat(message, t)
            return
        if kind in ("ADSB_VEHICLE", "OPEN_DRONE_ID_BASIC_ID", "OPEN_DRONE_ID_LOCATION"):
            self._reports.take(message, t)
            return
        if not self._vehicle.is_from(message):
            return
        number = self._vehicle.number(message)
        if getattr(message, "target_system", 0) not in (0, self._config.system_id):
            if kind in _MISSION_ANSWERS and message.mission_type == mavlink.MAV_MISSION_TYPE_MISSION:
                self._mission.heard_elsewhere(t)
            return
        if kind == "TIMESYNC":
            self._telemetry.clock.answer(message.tc1 * 1e-9, message.ts1 * 1e-9, t)
        elif kind == "COMMAND_ACK":
            self._commands.take(message, t)
        elif kind == "PARAM_VALUE" and self._vehicle.kind is not None:
            self._cruise.take(message, self._vehicle.kind)
        elif kind.startswith("MISSION_"):
            if kind == "MISSION_CURRENT":
                if number <= self._number_of_current:
                    return
                self._number_of_current = number
            self._mission.take(message, t)
        else:
            self._telemetry.take(message, t)
            self._watch_clock(t)

    def _take_heartbeat(self, message: Any, t: float) -> None:
        known = self._vehicle.target is not None
        self._vehicle.take(message, t)
        if not known and self._vehicle.target is not None and self._vehicle.kind is not None:
            self._mission.attach(self._vehicle.target, self._vehicle.kind, t)

    def _take_command(self, message: Any) -> None:
        """Take a human's answer to the question for approval."""
        ours = message.target_system == self._config.system_id
        if not ours or message.command != mavlink.MAV_CMD_USER_1:
            return
        yes = message.param1 == 1.0
        awaited = self._approval.answer(yes)
        result = mavlink.MAV_RESULT_ACCEPTED if awaited else mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        if awaited:
            self._tell("maneuver approved" if yes else "maneuver refused by a human")
        source = (message.get_srcSystem(), message.get_srcComponent())
        self._send(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *source))

    def _watch_clock(self, t: float) -> None:
        clock = self._telemetry.clock
        if clock.rebooted:
            clock.rebooted = False
            self._tell("the autopilot has rebooted")
            self._counts["reboots"] += 1
            self._telemetry.restart()
            self._commands.drop()
            self._mission.restart(t)
            self._streams.restart()
            if self._flight.phase is not Phase.IDLE:
                self._lose("control is let go after the reboot", t)
        elif abs(clock.jump) > 0.0:
            self._tell(f"the clocks' offset jumped by {clock.jump:.1f} s")
            self._counts["clock jumps"] += 1
            clock.jump = 0.0
        if abs(self._telemetry.utc_error) > _UTC_ERROR_S and not self._utc_told:
            self._utc_told = True
            self._tell(f"this machine's clock is {self._telemetry.utc_error:+.1f} s off the autopilot's GPS time")
        state = self._telemetry.state(t)
        if state != self._position_state:
            self._position_state = state
            self._tell(f"position: {state}")

    def _watch_link(self, t: float) -> None:
        alive = t - self._vehicle.t_heartbeat <= self._config.link_lost_s
        if alive and not self._linked:
            kind = self._vehicle.kind
            what = f"{kind.family} {kind.airframe}" if kind else "autopilot"
            self._tell(f"link to {what}, mode {self._vehicle.mode_name}")
        elif self._linked and not alive:
            self._tell(f"link lost: no heartbeat for {self._config.link_lost_s:.0f} s")
            self._counts["links lost"] += 1
        self._linked = alive

    def _decide(self, t: float) -> None:
        """Begin, change or end a maneuver."""
        wanted = self._wanted
        if wanted is not None and t > wanted.valid_until:
            wanted = None
        if wanted is None:
            self._approval.reset()
        self._give_back_control(wanted)
        flight = self._flight
        if flight.phase in (Phase.TAKING, Phase.FLYING):
            if wanted is None:
                flight.end(t)
                self._flown = None
            else:
                self._fly(wanted, t)
        elif wanted is not None and self._may_command(t) and self._approval.given(t, wanted.reason):
            if flight.phase is Phase.IDLE:
                self._flight = self._guided if self._is_guided() else self._inserted
            self._fly(wanted, t)

    def _fly(self, maneuver: Maneuver, t: float) -> None:
        waypoints, times = np.asarray(maneuver.waypoints, float), np.asarray(maneuver.times, float)
        shaped = waypoints.ndim == 2 and waypoints.shape[1] == 3 and times.shape == (len(waypoints),) and len(times) > 0
        if not (shaped and np.all(np.isfinite(waypoints)) and np.all(np.isfinite(times))):
            self._counts["maneuvers without finite waypoints"] += 1
            return
        if self._flight.phase is not Phase.RESTORING and same_path(self._flown, waypoints, times):
            return
        self._flown = (waypoints, times)
        self._traffic.say(maneuver.reason, 4)
        self._flight.fly(waypoints, times, t)

    def _is_guided(self) -> bool:
        if self._config.method == "auto":
            able = self._vehicle.kind is not None and self._vehicle.kind.family in ("ardupilot", "px4")
            return able and not self._guided_refused
        return self._config.method == "guided"

    def _may_command(self, t: float) -> bool:
        own = self._telemetry.ownship(t)
        return (
            self._config.command
            and not self._releasing
            and self._linked
            and not self._pilot
            and self._vehicle.armed
            and (self._vehicle.flies_mission or self._flight.phase is Phase.RESTORING)
            and own is not None
            and own.state == "ok"
            and t - own.t < self._config.link_lost_s
            and t - self._t_failed > _BACK_OFF_S
        )

    def _give_back_control(self, wanted: Maneuver | None) -> None:
        """Find out whether a pilot who took over has given the mission mode back."""
        if not self._pilot:
            return
        if not self._vehicle.flies_mission:
            self._gave_mission = False
        elif wanted is None or not self._gave_mission:
            # He who sets the mission mode in the middle of a maneuver does not want this one.
            self._pilot = False
            self._tell("the mission mode was given back")

    def _hear(self, flight: Flight, t: float) -> None:
        if flight.lost:
            self._lose(flight.lost, t)
            flight.lost = ""
        if flight.failed:
            self._tell(f"the maneuver is not flown: {flight.failed}")
            self._counts["maneuvers failed"] += 1
            self._t_failed, self._flown = t, None
            if flight is self._guided and self._config.method == "auto" and not self._guided_refused:
                self._guided_refused, self._t_failed = True, -math.inf  # the other way is tried at once
            flight.failed = ""
        if self._mission.foreign and self._inserted.phase is Phase.IDLE:
            self._mission.foreign = False

    def _lose(self, reason: str, t: float) -> None:
        self._tell(f"{reason}: avoidance is advisory")
        self._traffic.say(f"avoidance advisory: {reason}", 4)
        self._counts["control lost"] += 1
        self._pilot = True
        self._gave_mission = self._vehicle.flies_mission
        self._flown = None
        if self._flight.phase is not Phase.RESTORING:
            self._flight.let_go(t)
