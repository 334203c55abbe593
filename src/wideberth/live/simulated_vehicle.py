"""A vehicle to try things with, without hardware: our dynamics behind MAVLink, in real time or faster."""

import math
import time
from collections.abc import Callable, Sequence
from typing import BinaryIO, NamedTuple

import numpy as np

from wideberth.errors import InputError
from wideberth.links.mavlink.modes import VehicleKind
from wideberth.links.mavlink.simulated_autopilot import FlightTarget, SimulatedAutopilot
from wideberth.links.mavlink.telemetry_log import tlog_record
from wideberth.links.mavlink.wire import split_frames
from wideberth.live.vehicle_body import Body, CopterBody, PlaneBody
from wideberth.live.vehicle_links import Place, VehicleLinks
from wideberth.live.vehicle_mission import VehicleMission
from wideberth.types import FloatArray
from wideberth.vehicles.config import MultirotorConfig, PointMassConfig

_STEP_S = 0.02
_CAPTURE_M = {"plane": 60.0, "copter": 4.0}
_SPEED_MPS = {"plane": 22.0, "copter": 8.0}
_PLANE = PointMassConfig(speed_min_mps=15.0, speed_max_mps=30.0, climb_rate_max_mps=4.0, sink_rate_max_mps=4.0)
_BEHIND_S = 1.0  # of simulated time that it may fall behind before it gives up catching up


class SimulatedVehicle:
    """An autopilot and its body, flown in small steps; no socket and no clock.

    Parameters
    ----------
    kind : VehicleKind
    mission : VehicleMission
    speed : float, optional
        Cruise speed, m/s; by default that of the mission, else 22 m/s (plane) or 8 m/s.
    body : Body, optional
        By default our model of the airframe, with the limits of a scenario's ownship where they fit.
    key : bytes, optional
        Of MAVLink signing.
    wind : ndarray, shape (3,), optional
        Velocity of the air, local NED, m/s, for our models; by default that of the mission.

    Attributes
    ----------
    autopilot : SimulatedAutopilot
    """

    def __init__(
        self,
        kind: VehicleKind,
        mission: VehicleMission,
        speed: float | None = None,
        body: Body | None = None,
        key: bytes | None = None,
        wind: FloatArray | None = None,
    ) -> None:
        cruise = speed or mission.speed or _SPEED_MPS[kind.airframe]
        self._body = body if body is not None else _body(kind, mission, cruise, mission.wind if wind is None else wind)
        self.autopilot = SimulatedAutopilot(
            kind, mission.frame, mission.home, mission.items, cruise, _CAPTURE_M[kind.airframe], key=key
        )
        self._t = math.nan
        self._place(mission, cruise)
        # Compiles what flies it, before any clock runs.
        self._body.fly(FlightTarget(mission.start, mission.start + 1.0, cruise), 1e-3)
        self._place(mission, cruise)

    @property
    def is_finished(self) -> bool:
        """Whether the mission is completed."""
        return self.autopilot.complete

    def advance(self, t: float) -> None:
        """Fly up to time `t`, Unix s."""
        if math.isnan(self._t):
            self._t = t
            self.autopilot.moved(self._body.ownship(t))
        while self._t < t - 1e-9:
            dt = min(_STEP_S, t - self._t)
            target = self.autopilot.target()
            if target is not None:
                self._body.fly(target, dt)
            self._t += dt
            self.autopilot.moved(self._body.ownship(self._t))

    def skip(self, t: float) -> None:
        """Stand still up to time `t`: the machine was too slow."""
        self._t = t

    def _place(self, mission: VehicleMission, speed: float) -> None:
        placed = [item for item in mission.items if item.is_global and (item.x or item.y)]
        course = 0.0
        if placed:
            first = mission.frame.to_ned(math.radians(placed[0].x * 1e-7), math.radians(placed[0].y * 1e-7), 0.0)
            course = math.atan2(first[1] - mission.start[1], first[0] - mission.start[0])
        self._body.place(mission.start, speed * np.array([math.cos(course), math.sin(course), 0.0]))


def _body(kind: VehicleKind, mission: VehicleMission, speed: float, wind: FloatArray) -> Body:
    limits = mission.limits
    if kind.airframe == "copter":
        fits = isinstance(limits, MultirotorConfig)
        return CopterBody(limits if fits else MultirotorConfig(speed_max_mps=max(15.0, 1.3 * speed)), wind)
    return PlaneBody.of(limits if isinstance(limits, PointMassConfig) else _PLANE, wind)


class VehicleAddresses(NamedTuple):
    """Where a simulated vehicle can be spoken with.

    Attributes
    ----------
    peers : list of tuple
        Hosts and ports to send datagrams to.
    listen : tuple or None
        Host and port where ground stations may connect by TCP.
    answer : tuple or None
        Host and port where datagrams are taken from anybody, who is answered.
    """

    peers: list[Place]
    listen: Place | None
    answer: Place | None


def parse_peers(texts: Sequence[str]) -> VehicleAddresses:
    """Return the addresses of ``udp:host:port`` (to send to), ``udpin:host:port`` and ``tcpin:host:port`` (to listen).

    Raises
    ------
    InputError
        If one is something else, or there are two of a kind to listen on.
    """
    peers: list[Place] = []
    places: dict[str, Place] = {}
    for text in texts:
        scheme, _, rest = text.partition(":")
        host, _, port = rest.rpartition(":")
        known = scheme in ("udp", "udpout", "udpin", "tcpin") and host and port.isdecimal() and 0 < int(port) < 65536
        if not known or scheme in places:
            raise InputError(
                f"--connect '{text}': write udp:127.0.0.1:14550, or to be connected to, once each,"
                " udpin:127.0.0.1:14550 and tcpin:127.0.0.1:5760"
            )
        if scheme in ("udpin", "tcpin"):
            places[scheme] = host, int(port)
        else:
            peers.append((host, int(port)))
    return VehicleAddresses(peers, places.get("tcpin"), places.get("udpin"))


def serve(
    vehicle: SimulatedVehicle,
    peers: list[Place],
    *,
    listen: Place | None = None,
    answer: Place | None = None,
    speed_up: float = 1.0,
    until: Callable[[], bool] = lambda: False,
    tlog: BinaryIO | None = None,
    observe: Callable[[SimulatedVehicle, float], None] = lambda _vehicle, _t: None,
    tell: Callable[[str], None] = lambda _text: None,
) -> None:
    """Fly a vehicle in real time, with its links served, until `until` is true.

    Parameters
    ----------
    vehicle : SimulatedVehicle
    peers, listen, answer
        As in `VehicleAddresses`.
    speed_up : float
        Simulated seconds for each real one.
    until : callable
    tlog : file, optional
        All frames sent and received are written there, as ground stations log them.
    observe : callable
        Told the vehicle and the time after each step.
    tell : callable
        Told in words which link fails, and when it works again.

    Raises
    ------
    InputError
        If it cannot be listened there.
    """
    start_unix, start = time.time(), time.monotonic()
    link = vehicle.autopilot
    with VehicleLinks(peers, listen, answer, tell) as links:
        previous = start_unix
        while not until():
            t = start_unix + (time.monotonic() - start) * speed_up
            if t - previous > _BEHIND_S * speed_up:
                vehicle.skip(t)
            previous = t
            vehicle.advance(t)
            for data in links.receive():
                link.receive(data, t)
                _log(tlog, data, t)
            for frame in split_frames(link.outgoing(t)):
                _log(tlog, frame, t)
                links.send(frame)
            observe(vehicle, t)
            links.wait(_STEP_S / speed_up)


def _log(tlog: BinaryIO | None, data: bytes, t: float) -> None:
    if tlog is not None:
        tlog.writelines(tlog_record(frame, t) for frame in split_frames(data))
