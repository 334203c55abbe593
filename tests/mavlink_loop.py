"""An autopilot's link and a simulated autopilot joined in memory, over a channel with faults, on a made-up clock."""

import heapq
import math
import random

import numpy as np

from wideberth.frames import LocalFrame, rotation_ned_body
from wideberth.links.mavlink.autopilot import Autopilot
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.mission_items import Item, waypoint
from wideberth.links.mavlink.modes import VehicleKind
from wideberth.links.mavlink.simulated_autopilot import SimulatedAutopilot
from wideberth.links.mavlink.telemetry import Home
from wideberth.types import Maneuver, Mission, Ownship

FRAME = LocalFrame(math.radians(40.0), math.radians(-111.0))
HOME = Home(math.radians(40.0), math.radians(-111.0), 1400.0)
T0 = 1_700_000_000.0
HEIGHT = 100.0  # above home

COPTER, PLANE = VehicleKind("ardupilot", "copter"), VehicleKind("ardupilot", "plane")
PX4_COPTER, PX4_PLANE = VehicleKind("px4", "copter"), VehicleKind("px4", "plane")
KINDS = [COPTER, PLANE, PX4_COPTER, PX4_PLANE]


def place(north: float, east: float, height: float = HEIGHT) -> np.ndarray:
    return np.array([north, east, -(HOME.altitude + height)])


def items_of(points) -> list[Item]:
    latitude, longitude, altitude = FRAME.to_geodetic(np.array(points, float))
    return [waypoint(*x) for x in zip(latitude, longitude, altitude, strict=True)]


def square(side: float = 600.0) -> list[Item]:
    return items_of([place(side, 0), place(side, side), place(0, side), place(0, 0)])


def sidestep(t: float, own: Ownship, right: float = 80.0, ahead: float = 200.0, height: float = 0.0) -> Maneuver:
    """A way round something ahead."""
    course = math.atan2(own.velocity[1], own.velocity[0])
    u = np.array([math.cos(course), math.sin(course), 0.0])
    v = np.array([-u[1], u[0], 0.0])
    up = np.array([0.0, 0.0, -height])
    speed = max(float(np.hypot(*own.velocity[:2])), 1.0)
    points = np.array(
        [own.position + 0.5 * ahead * u + right * v + up, own.position + 1.5 * ahead * u + right * v + up]
    )
    first = math.dist(own.position, points[0])
    times = t + np.array([first, first + math.dist(points[0], points[1])]) / speed
    return Maneuver(t, points, times, "intruder N123 30 s ahead: turn right", float(times[-1]) + 60.0, ("n123",))


class Channel:
    """Carries bytes one way; each packet may be lost, repeated, late."""

    def __init__(self, seed: int, loss: float = 0.0, repeats: float = 0.0, delay: float = 0.02, jitter: float = 0.0):
        self._random = random.Random(seed)
        self.loss, self.repeats, self.delay, self.jitter = loss, repeats, delay, jitter
        self.cut = False
        self.log: list[bytes] | None = None
        self._queue: list[tuple[float, int, bytes]] = []
        self._n = 0

    def put(self, data: bytes, t: float) -> None:
        if self.log is not None:
            self.log.append(data)
        for frame in frames(data):
            if self.cut or self._random.random() < self.loss:
                continue
            for _ in range(2 if self._random.random() < self.repeats else 1):
                self._n += 1
                when = t + self.delay + self._random.random() * self.jitter
                heapq.heappush(self._queue, (when, self._n, frame))

    def get(self, t: float):
        while self._queue and self._queue[0][0] <= t:
            yield heapq.heappop(self._queue)[2]


def frames(data: bytes):
    """MAVLink 2 frames are packets on UDP."""
    at = 0
    while at < len(data):
        n = 12 + data[at + 1] + (13 if data[at + 2] & 1 else 0)
        yield data[at : at + n]
        at += n


class Loop:
    """Both ends, a body that flies at once as it is told, and the clock."""

    def __init__(self, kind: VehicleKind = COPTER, config: dict | None = None, items=None, seed: int = 0, **channel):
        self.kind = kind
        self.speed = 20.0 if kind.airframe == "plane" else 10.0
        self.t = T0
        self.config = MavlinkConfig(command=True, **(config or {}))
        self.link = Autopilot(self.config)
        key = None
        if self.config.signing_key:
            from wideberth.links.mavlink.wire import signing_key

            key = signing_key(self.config.signing_key)
        capture = 30.0 if kind.airframe == "plane" else 5.0
        self.vehicle = SimulatedAutopilot(
            kind, FRAME, HOME, square() if items is None else items, self.speed, capture, key=key
        )
        self.down, self.up = Channel(seed, **channel), Channel(seed + 1, **channel)
        self.position, self.velocity = place(0, 0), np.array([self.speed, 0.0, 0.0])
        self.events: list[str] = []
        self.track: list[np.ndarray] = []
        self.wanted: Maneuver | None = None
        self.offset = 0.0  # of the link's clock

    def fly_body(self, dt: float) -> None:
        target = self.vehicle.target()
        if target is None:
            return
        if target.velocity is not None:
            wanted = target.velocity + 0.5 * (target.end - self.position)
        else:
            to = target.end - self.position
            distance = float(np.linalg.norm(to))
            speed = min(target.speed, distance / dt, 1.0 * distance if target.holds else math.inf)
            wanted = to / max(distance, 1e-9) * speed
        most = 1.5 * self.speed
        size = float(np.linalg.norm(wanted))
        self.velocity = wanted if size <= most else wanted * most / size
        self.position = self.position + self.velocity * dt

    def own(self) -> Ownship:
        yaw = math.atan2(self.velocity[1], self.velocity[0])
        return Ownship(self.t, self.position.copy(), self.velocity.copy(), rotation_ned_body(0, 0, yaw))

    def step(self, dt: float = 0.05) -> None:
        self.fly_body(dt)
        self.t += dt
        self.track.append(self.position.copy())
        t = self.t
        self.vehicle.moved(self.own())
        for data in self.up.get(t):
            self.vehicle.receive(data, t)
        self.down.put(self.vehicle.outgoing(t), t)
        for data in self.down.get(t):
            self.link.receive(data, t + self.offset)
        self.link.fly(t + self.offset, self.wanted)
        self.up.put(self.link.outgoing(t + self.offset), t)
        self.events += self.link.events()

    def seen(self) -> Ownship:
        """What the link says of the ownship."""
        own = self.link.ownship(self.t + self.offset)
        assert own is not None
        return own

    def plan(self) -> Mission:
        """What the link says of the mission."""
        mission = self.link.mission()
        assert mission is not None
        return mission

    def run(self, seconds: float, until=None) -> bool:
        end = self.t + seconds
        while self.t < end:
            self.step()
            if until is not None and until(self):
                return True
        return until is None
