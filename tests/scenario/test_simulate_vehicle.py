"""`wideberth simulate-vehicle`: flown over real loopback UDP, and from each kind of mission file."""

import math
import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.mavlink_loop import COPTER, FRAME, HOME, KINDS, PLANE, items_of, place, sidestep
from wideberth.cli.main import app
from wideberth.errors import InputError
from wideberth.links.mavlink.autopilot import Autopilot
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.live.simulated_vehicle import SimulatedVehicle, parse_peers, serve
from wideberth.live.vehicle_mission import VehicleMission, read_vehicle_mission

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SPEED_UP = 20.0
WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t40.0\t-111.0\t1400.0\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t60.0\t1
2\t0\t3\t178\t1\t9\t-1\t0\t0\t0\t0\t1
3\t0\t3\t16\t0\t0\t0\t0\t40.002\t-111.0\t60.0\t1
4\t0\t3\t16\t0\t0\t0\t0\t40.002\t-110.998\t60.0\t1
"""


def place_of(vehicle):
    return vehicle.autopilot._own.position


def is_over(link) -> bool:
    mission = link.mission()
    return mission is not None and mission.index == len(mission.waypoints)


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: f"{k.family}_{k.airframe}")
def test_our_bodies_fly_the_mission(kind, tmp_path) -> None:
    """Without a link: the simulated autopilot and the body finish what they are given."""
    path = tmp_path / "mission.waypoints"
    path.write_text(WPL)
    vehicle = SimulatedVehicle(kind, read_vehicle_mission(path, 0.0))
    places = []
    for k in range(4000):
        vehicle.advance(1e9 + 0.1 * k)
        places.append(place_of(vehicle))
        if vehicle.is_finished:
            break
    assert vehicle.is_finished
    corner = FRAME.to_ned(math.radians(40.002), math.radians(-111.0), 1460.0)
    assert min(math.dist(p, corner) for p in places) < 61.0
    # Afterwards it stays there: hovering, or on a circle.
    for k in range(4001, 4400):
        vehicle.advance(1e9 + 0.1 * k)
    radius = 120.0 if kind.airframe == "plane" else 5.0
    end = places[-1]
    assert math.dist(place_of(vehicle)[:2], end[:2]) < 2 * radius


@pytest.mark.parametrize("kind", [COPTER, PLANE], ids=["copter", "plane"])
def test_an_avoidance_over_loopback(kind, tmp_path) -> None:
    """Two ends with real sockets: the mission is downloaded, a maneuver flown, the mission resumed and finished."""
    path = tmp_path / "mission.waypoints"
    path.write_text(WPL)
    vehicle = SimulatedVehicle(kind, read_vehicle_mission(path, 0.0))
    link = Autopilot(MavlinkConfig(command=True, cruise_speed_mps=9.0))
    ended = threading.Event()
    log = (tmp_path / "flight.tlog").open("wb")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(0.01)
        thread = threading.Thread(
            target=serve,
            args=(vehicle, [ours.getsockname()]),
            kwargs={"speed_up": SPEED_UP, "until": ended.is_set, "tlog": log},
        )
        thread.start()
        try:
            _fly(link, ours, vehicle)
        finally:
            ended.set()
            thread.join(5.0)
            log.close()
    assert vehicle.is_finished
    modes = [mode for _, mode in vehicle.autopilot.mode_changes]
    assert modes == ["GUIDED", "AUTO"]
    assert is_over(link)
    assert (tmp_path / "flight.tlog").stat().st_size > 10_000


def _fly(link: Autopilot, ours: socket.socket, vehicle: SimulatedVehicle) -> None:
    wanted, begun = None, math.inf
    unix, start, peer = time.time(), time.monotonic(), None
    while time.monotonic() - start < 30.0:
        t = unix + SPEED_UP * (time.monotonic() - start)
        try:
            data, peer = ours.recvfrom(65536)
            link.receive(data, t)
        except TimeoutError:
            pass
        own = link.ownship(t)
        if math.isinf(begun) and link.state == "monitoring" and own is not None and link.mission() is not None:
            wanted, begun = sidestep(t, own, right=40.0, ahead=80.0), t
        if t - begun > 8.0:
            wanted = None
        link.fly(t, wanted)
        data = link.outgoing(t)
        if peer is not None and data:
            ours.sendto(data, peer)
        if vehicle.is_finished and is_over(link):
            return


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (-3.0, 8.0, 0.0)], ids=["still air", "wind"])
def test_jsbsim_flies_the_mission(wind):
    pytest.importorskip("jsbsim", reason="jsbsim is not installed")
    from wideberth.live.jsbsim_body import CRUISE_SPEED, JsbsimBody

    items = tuple(items_of([place(3000, 0, 400), place(3000, 3000, 400)]))
    mission = VehicleMission(FRAME, HOME, items, place(0, 0, 400), None)
    vehicle = SimulatedVehicle(PLANE, mission, CRUISE_SPEED, JsbsimBody(FRAME, np.array(wind)))
    flown = []
    for k in range(1800):
        vehicle.advance(1e9 + 0.1 * k)
        flown.append(vehicle.autopilot._own)
        if vehicle.is_finished:
            break
    assert vehicle.is_finished
    assert all(abs(own.position[2] - place(0, 0, 400)[2]) < 80.0 for own in flown)
    assert all(40.0 < np.linalg.norm(own.velocity) < 60.0 for own in flown)
    assert min(math.dist(own.position[:2], (3000, 0)) for own in flown) < 61.0


def test_mission_files(tmp_path) -> None:
    scenario = read_vehicle_mission(SCENARIOS / "gbr_1.toml", 0.0)
    assert np.allclose(scenario.start, [-400.0, 0.0, -200.0])
    assert [item.command for item in scenario.items] == [178, 16]
    assert scenario.limits.speed_max_mps == 17.0
    table = read_vehicle_mission(SCENARIOS / "real_traffic_mission.csv", 0.0)
    assert len(table.items) >= 2 and table.limits is None
    path = tmp_path / "m.txt"
    path.write_text(WPL)
    plan = read_vehicle_mission(path, 0.0)
    assert plan.home.altitude == 1400.0 and len(plan.items) == 4
    assert plan.start[2] == pytest.approx(-1460.0)
    for wrong, message in (
        ("hello", "begins with"),
        (WPL + "5\t0\n", "line 7"),
        ("QGC WPL 110\n", "first item is home"),
    ):
        path.write_text(wrong)
        with pytest.raises(InputError, match=message):
            read_vehicle_mission(path, 0.0)
    with pytest.raises(InputError, match="cannot read"):
        read_vehicle_mission(tmp_path / "none.txt", 0.0)


def test_the_command_flies_until_it_is_done(tmp_path) -> None:
    path = tmp_path / "m.waypoints"
    path.write_text(WPL)
    command = ["simulate-vehicle", "--mission", str(path), "--speed-up", "50", "--until-done", "--connect"]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        result = CliRunner().invoke(app, [*command, f"udp:127.0.0.1:{ours.getsockname()[1]}"])
        assert result.exit_code == 0, result.output
        assert "mission completed" in result.output
        ours.setblocking(False)
        kinds = {mavlink.MAVLink(None).decode(bytearray(ours.recv(65536))).get_type() for _ in range(20)}
    assert {"HEARTBEAT", "GLOBAL_POSITION_INT", "MISSION_CURRENT"} <= kinds


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--dynamics", "jsbsim", "--vehicle", "copter"], "jsbsim with --vehicle plane"),
        (["--vehicle", "balloon"], "one of plane, copter"),
        (["--autopilot", "human"], "one of ardupilot, px4"),
        (["--speed", "fast"], "--speed"),
        (["--connect", "14550"], "udp:127.0.0.1:14550"),
        (["--mission", "/nowhere.txt"], "cannot read"),
    ],
)
def test_wrong_options_say_what_to_do(options, message, tmp_path) -> None:
    path = tmp_path / "m.waypoints"
    path.write_text(WPL)
    result = CliRunner().invoke(app, ["simulate-vehicle", "--mission", str(path), *options])
    assert result.exit_code == 2
    assert message in result.output
    twice = [[f"{kind}:127.0.0.1:1", f"{kind}:127.0.0.1:2"] for kind in ("tcpin", "udpin")]
    for wrong in (["tcp:127.0.0.1:1"], *twice, ["udp:127.0.0.1:0"]):
        with pytest.raises(InputError, match=f"--connect '{wrong[-1]}': write udp:127.0.0.1:14550"):
            parse_peers(wrong)


def test_ground_stations_connect_by_tcp_go_away_and_come_back() -> None:
    plan = read_vehicle_mission(SCENARIOS / "live_ground_radar.toml", 0.0)
    vehicle = SimulatedVehicle(COPTER, plan)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    peers, listen, answer = parse_peers([f"tcpin:127.0.0.1:{port}"])
    assert peers == [] and listen == ("127.0.0.1", port) and answer is None
    ended: list[int] = []
    thread = threading.Thread(target=serve, args=(vehicle, peers), kwargs={"listen": listen, "until": lambda: ended})
    thread.start()
    try:
        for _ in range(2):
            kinds: set[str] = set()
            with socket.socket() as ours:
                end = time.monotonic() + 60.0
                while ours.connect_ex(("127.0.0.1", port)) and time.monotonic() < end:
                    time.sleep(0.05)
                ours.settimeout(60.0)
                codec = mavlink.MAVLink(None, 250, 1)
                codec.robust_parsing = True
                asked = False
                while not {"HEARTBEAT", "MISSION_COUNT"} <= kinds and time.monotonic() < end:
                    kinds |= {m.get_type() for m in codec.parse_buffer(ours.recv(4096)) or ()}
                    if not asked:
                        ours.sendall(mavlink.MAVLink_mission_request_list_message(1, 1).pack(codec))
                        asked = True
            assert {"HEARTBEAT", "MISSION_COUNT"} <= kinds
    finally:
        ended.append(1)
        thread.join(timeout=60.0)
    assert not thread.is_alive()


@pytest.mark.parametrize("kind", [COPTER, PLANE], ids=["copter", "plane"])
def test_a_vehicle_leans_or_points_into_the_wind_and_finishes_its_mission(kind) -> None:
    plan = read_vehicle_mission(SCENARIOS / "live_ground_radar.toml", 0.0)
    attitudes = []
    for east in (0.0, 5.0):
        vehicle = SimulatedVehicle(kind, plan, wind=np.array([0.0, east, 0.0]))
        for k in range(2000):
            vehicle.advance(1e9 + 0.1 * k)
            assert abs(place_of(vehicle)[1]) < 5.0
            if k == 200:
                own = vehicle.autopilot._own
                assert own is not None
                attitudes.append(own.attitude)
            if vehicle.is_finished:
                break
        assert vehicle.is_finished
    assert np.abs(attitudes[1] - attitudes[0]).max() > 0.05
