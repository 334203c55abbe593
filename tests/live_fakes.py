"""Fakes around a flight: an autopilot that speaks JSON, a radar on its wire, clocks that are set by hand."""

import json
import math

import numpy as np

from wideberth.config import ScenarioConfig, build_scenario
from wideberth.frames import LocalFrame
from wideberth.links.radar_udp import encode_radar
from wideberth.part_config import PartConfig
from wideberth.types import Maneuver, Mission, Ownship, SensorHealth

SPEED = 13.0
FRAME = LocalFrame(math.radians(40.25), math.radians(-111.65))


class FakeAutopilotConfig(PartConfig):
    connection: str = "udp:127.0.0.1:0"
    command: bool = False
    needs_frame: bool = False
    signing_key: str | None = None


class FakeAutopilot:
    """Takes lines of JSON: telemetry ("p", "v", "t"), "mission" (waypoints), "index"; sends what is flown as JSON."""

    Config = FakeAutopilotConfig

    def __init__(self, config, frame=None):
        self.config = config
        self.frame = None if config.needs_frame else frame or FRAME
        self.counters = {"messages": 0, "garbage": 0}
        self.released = False
        self.flown: list[tuple[float, Maneuver | None]] = []
        self.reported = 0
        self.traffic: list = []
        self._rest = b""
        self._own = None
        self._mission = None
        self._heard = -math.inf
        self._events: list[str] = []
        self._out: list[bytes] = []
        self._releasing = False

    def receive(self, data, t):
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-4096:]
        for line in lines:
            try:
                said = json.loads(line)
                if "p" in said:
                    self._own = Ownship(float(said["t"]), np.array(said["p"], float), np.array(said["v"], float),
                                        covariance=np.diag([1.0, 1, 1, 0.1, 0.1, 0.1]))  # fmt: skip
                if "mission" in said:
                    points = np.array(said["mission"], float)
                    self._mission = Mission(points, np.full(len(points), SPEED), 0.0, int(said.get("index", 1)))
                    self.frame = self.frame or FRAME
                self.released = self.released or bool(said.get("released"))
                self.counters["messages"] += 1
                self._heard = t
            except (ValueError, TypeError, KeyError):
                self.counters["garbage"] += 1

    def outgoing(self, t):
        out, self._out = b"".join(self._out), []
        return out

    def ownship(self, t):
        return self._own

    def mission(self):
        return self._mission

    def fly(self, t, maneuver):
        self.flown.append((t, maneuver))
        if self.config.command:
            what = None if maneuver is None else maneuver.waypoints.tolist()
            self._out.append(json.dumps({"fly": what}).encode() + b"\n")

    def report(self, t, snapshot):
        self.reported += 1

    def reports(self, t):
        traffic, self.traffic = self.traffic, []
        return traffic

    def events(self):
        events, self._events = tuple(self._events), []
        return events

    def health(self, t):
        return SensorHealth(max(t - self._heard, 0.0), 10.0, {}, "ok" if t - self._heard < 3.0 else "no link")

    def release(self, t):
        self._releasing = True
        self._events.append("control is given back")
        self._out.append(b'{"release": true}\n')
        if not self.config.command:
            self.released = True

    @property
    def state(self):
        return "restoring" if self._releasing else "monitoring" if self.config.command else "advisory"


class HandClock:
    """Two clocks that are set by hand, for `LiveClock(*clock.both)`."""

    def __init__(self, unix=1_700_000_000.0):
        self.steady, self.wall = 1000.0, unix

    @property
    def both(self):
        return (lambda: self.steady), (lambda: self.wall)

    def advance(self, dt):
        self.steady += dt
        self.wall += dt


MISSION = [[-400.0, 0.0, -200.0], [500.0, 0.0, -200.0]]


def telemetry(t, p, v, **more):
    """A line of the fake autopilot."""
    return json.dumps({"t": t, "p": list(p), "v": list(v), **more}).encode() + b"\n"


def radar_datagram(sequence, t, targets, radar_id=7):
    """A datagram of a radar at the origin that looks all around and sees targets (k, 6) without errors."""
    targets = np.asarray(targets, float).reshape(-1, 6)
    p, v = targets[:, :3], targets[:, 3:]
    r = np.linalg.norm(p, axis=1)
    z = np.column_stack([r, np.arctan2(p[:, 1], p[:, 0]), np.arcsin(-p[:, 2] / r), (p * v).sum(axis=1) / r])
    sigma = np.tile([1.0, 0.005, 0.005, 0.5], (len(z), 1))
    return encode_radar(radar_id, sequence, t, z, sigma)


def tables(port=0, **changes):
    """Tables of a flight with the fake autopilot and one radar."""
    return {
        "name": "fake flight",
        "step_s": 0.1,
        "ownship": {
            "kind": "point_mass",
            "speed_min_mps": 9.0,
            "speed_max_mps": 17.0,
            "climb_rate_max_mps": 4.0,
            "sink_rate_max_mps": 4.0,
        },
        "tracker": {"kind": "wideberth"},
        "detection": {
            "well_clear_volume": "nmac",
            "lookahead_s": 30.0,
            "corrective_time_s": 25.0,
            "warning_time_s": 15.0,
        },
        "avoidance": {
            "kind": "local_level",
            "hard_radius_m": 60.0,
            "inner_radius_m": 90.0,
            "outer_radius_m": 120.0,
            "outer_tau_s": 0.0,
            "trigger_lookahead_s": 30.0,
            "trigger_now_s": 20.0,
            "ghost_s": 15.0,
            "altitude_min_m": 60.0,
            "altitude_max_m": 400.0,
        },
        "autopilot": {"kind": "tests.live_fakes:FakeAutopilot", "connection": f"udp:127.0.0.1:{port}"},
        "inputs": [
            {
                "kind": "radar_udp",
                "name": "radar",
                "listen": "0",
                "units": [{"radar_id": 7, "range_max_m": 3000.0, "detection_ranges_m": [0.0, 3000.0],
                           "detection_probabilities": [0.95, 0.95]}],
            }
        ],
        **changes,
    }  # fmt: skip


def scenario(**changes) -> ScenarioConfig:
    return build_scenario(tables(**changes))
