"""Our side of the mission and command protocol against an autopilot that is not ours: MAVSDK's servers."""

import math
import os
import time

import numpy as np
import pytest

from tests.mavlink_loop import FRAME, HOME, place, sidestep, square
from wideberth.links.mavlink.autopilot import Autopilot
from wideberth.links.mavlink.commands import Commands
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.mission_items import Item, same_mission
from wideberth.links.mavlink.mission_protocol import MissionUpload
from wideberth.links.mavlink.modes import px4_mode
from wideberth.links.mavlink.wire import Wire

mavsdk = pytest.importorskip("mavsdk", reason="mavsdk 4 is not installed")
pytest.importorskip("mavsdk.plugins.mission_raw_server", reason="this mavsdk has no autopilot's side: 4 or later has")


class Peer:
    """MAVSDK as an autopilot, fed by bytes; telemetry that is not the servers' business we send ourselves."""

    def __init__(self) -> None:
        from mavsdk.plugins.action_server import ActionServer, AllowableFlightModes, FlightMode
        from mavsdk.plugins.mission_raw_server import MissionRawServer
        from mavsdk.plugins.telemetry_server import Heading, Position, TelemetryServer, VelocityNed

        self._kinds = (Position, VelocityNed, Heading)
        self._out: list[bytes] = []
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.AUTOPILOT)
        configuration.system_id = 1
        self._mavsdk = mavsdk.Mavsdk(configuration)
        assert int(self._mavsdk.add_any_connection("raw://")) == 0
        self._mavsdk.subscribe_raw_bytes_to_be_sent(self._out.append)
        component = self._mavsdk.server_component_by_type(mavsdk.ComponentType.AUTOPILOT)
        self.missions: list[list[Item]] = []
        self._server = MissionRawServer(component)
        self._server.subscribe_incoming_mission(self._take_mission)
        self._telemetry = TelemetryServer(component)
        self._action = ActionServer(component)
        self._action.set_allowable_flight_modes(AllowableFlightModes(True, True, True, True, True, True, True))
        self._action.set_armable(True, True)
        self._action.set_armed_state(True)
        self._action.set_flight_mode(FlightMode.MISSION)
        self.modes: list[int] = []
        self._action.subscribe_flight_mode_change(lambda _result, mode, _: self.modes.append(int(mode)))
        self.position = place(0, 0)
        self._t_position = 0.0

    def exchange(self, data: bytes, t: float) -> bytes:
        """Give bytes to it, and return its own."""
        if data:
            self._mavsdk.pass_received_raw_bytes(data)
        if t - self._t_position > 0.1:
            self._t_position = t
            position, velocity, heading = self._kinds
            latitude, longitude, altitude = (float(x) for x in FRAME.to_geodetic(self.position))
            self._telemetry.publish_home(
                position(math.degrees(HOME.latitude), math.degrees(HOME.longitude), HOME.altitude, 0.0)
            )
            self._telemetry.publish_position(
                position(math.degrees(latitude), math.degrees(longitude), altitude, altitude - HOME.altitude),
                velocity(10.0, 0.0, 0.0),
                heading(0.0),
            )
        # A thread of MAVSDK's goes on adding: take one by one, or what comes meanwhile is lost.
        out = b""
        while self._out:
            out += self._out.pop(0)
        return out

    def close(self) -> None:
        self._mavsdk.destroy()

    def _take_mission(self, _result, plan, _data) -> None:
        self.missions.append(
            [
                Item(i.frame, i.command, (i.param1, i.param2, i.param3, i.param4), i.x, i.y, i.z, i.autocontinue)
                for i in plan.mission_items
            ]
        )


@pytest.fixture
def peer():
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        pytest.skip("real time")
    made = Peer()
    yield made
    made.close()


class Station:
    """A ground station that uploads a mission and sends commands."""

    def __init__(self) -> None:
        self.wire, self.t = Wire(255, 190), 0.0
        self.commands = Commands(self.send, 0.5, 5)
        self.uploads: list[MissionUpload] = []
        self.results: list[int | None] = []

    def send(self, message) -> None:
        self.wire.send(message, self.t)

    def upload(self, items) -> MissionUpload:
        from collections import Counter

        upload = MissionUpload(self.send, (1, 1), 0.5, 5, Counter(), items)
        upload.start(self.t)
        self.uploads.append(upload)
        return upload

    def exchange(self, data: bytes, t: float) -> bytes:
        self.t = t
        for message in self.wire.receive(data, t):
            kind = message.get_type()
            if kind == "COMMAND_ACK":
                self.commands.take(message, t)
            elif kind.startswith("MISSION_") and getattr(message, "target_system", 0) == 255:
                for upload in self.uploads:
                    upload.take(message, t)
        self.commands.step(t)
        for upload in self.uploads:
            upload.step(t)
        return self.wire.take()


def run(peer: Peer, ends, seconds: float, until, each=lambda t: None) -> bool:
    start, pending = time.time(), b""
    while (t := time.time()) - start < seconds:
        each(t)
        data, pending = pending + peer.exchange(b"", t), b""
        for end in ends:
            if isinstance(end, Station):
                out = end.exchange(data, t)
            else:
                end.receive(data, t)
                out = end.outgoing(t)
            if out:
                # It may answer at once: that answer is everyone's too.
                pending += peer.exchange(out, t)
        if until():
            return True
        time.sleep(0.01)
    return False


def test_missions_and_commands_with_mavsdk(peer) -> None:
    station, link = Station(), Autopilot(MavlinkConfig(command=True, cruise_speed_mps=10.0, method="mission"))
    first = square()
    upload = station.upload(first)
    assert run(peer, [station], 10.0, lambda: upload.finished), "no answer"
    assert upload.failure is None
    assert same_mission(peer.missions[-1], first, home_is_item_0=False)
    # A mode by command, answered.
    mode = mavlink.MAVLink_command_long_message(
        1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, px4_mode(4, 4) >> 16 & 0xFF, 4, 0, 0, 0, 0
    )
    station.commands.request(
        mode.command, lambda _: mode, time.time(), lambda result, _t: station.results.append(result)
    )
    assert run(peer, [station], 5.0, lambda: bool(station.results))
    assert station.results == [mavlink.MAV_RESULT_ACCEPTED]
    # Our link downloads the mission.
    ready = lambda: link.mission() and link.ownship(0.0) and link.state == "monitoring"  # noqa: E731
    assert run(peer, [station, link], 15.0, ready), (link.state, link.events(), link.counters)
    mission, own = link.mission(), link.ownship(time.time())
    assert mission is not None and own is not None
    assert np.allclose(mission.waypoints[1:], [place(600, 0), place(600, 600), place(0, 600), place(0, 0)], atol=0.05)
    assert np.allclose(own.position, place(0, 0), atol=0.1)
    # A maneuver goes into the mission, and out of it again.
    wanted = sidestep(time.time(), own)
    fly = lambda t: link.fly(t, wanted)  # noqa: E731
    assert run(
        peer, [station, link], 15.0, lambda: "flying the maneuver as part of the mission" in link._events, fly
    ), (
        link.events(),
        link.counters,
    )
    assert len(peer.missions[-1]) == 6
    back = lambda: link.state == "monitoring" and not link._mission.is_altered  # noqa: E731
    assert run(peer, [station, link], 20.0, back, lambda t: link.fly(t, None)), (link.state, link.events())
    assert same_mission(peer.missions[-1], first, home_is_item_0=False)
    assert any("mission restored, resumed at item 0" in e for e in link.events())
