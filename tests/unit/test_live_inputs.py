"""Inputs of a flight and the live world: bytes in, scans out, nothing made up."""

import dataclasses
import io
import json
import threading

import numpy as np
import pytest

from tests import adsb_frames as encoder
from tests.live_fakes import FRAME, FakeAutopilot, FakeAutopilotConfig, radar_datagram, telemetry
from wideberth.live.config import ReceiverInputConfig
from wideberth.live.inputs import InputLink
from wideberth.live.live_world import LiveWorld, changed
from wideberth.live.packet_queue import PacketQueue
from wideberth.live.radar_input import RadarUdpInput, RadarUdpInputConfig
from wideberth.live.status_writer import StatusWriter
from wideberth.live.traffic_input import AutopilotInput, AvrInput, BeastInput, Gdl90Input, SbsInput, UatInput
from wideberth.sensors.adsb.config import AdsbReceiverConfig
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Maneuver, Mission, Ownship

T = 1_700_000_000.0
OWN = Ownship(T, np.array([0.0, 0.0, -300.0]), np.array([10.0, 0.0, 0.0]))


class Trouble:
    words = ""

    def __call__(self):
        return self.words


@pytest.fixture
def autopilot():
    return FakeAutopilot(FakeAutopilotConfig())


@pytest.fixture
def link(autopilot):
    return InputLink(PacketQueue(packets_max=8), Trouble(), T, autopilot)


def avr(k):
    place = encoder.airborne_position(40.26, -111.64, 3000, k % 2)
    return f"*{encoder.squitter(0x393322, place).hex()};\n".encode()


def test_a_receivers_bytes_become_one_scan_a_step(link):
    each = AvrInput(ReceiverInputConfig(connect="a:1"), "adsb", FRAME, link)
    assert each.health(T).state == "nothing heard yet"
    assert each.health(T + 11.0).state == "silent for 11 s"
    whole = avr(0) + avr(1)
    for part in (whole[:20], whole[20:]):
        link.queue.put(T + 0.5, part)
    assert each.drain() is False
    (scan,) = each.sense(T + 0.6, OWN)
    assert scan.sensor == "adsb" and scan.kind == "adsb" and set(scan.source_ids) == {"393322"}
    assert np.hypot(*scan.z[-1, :2]) == pytest.approx(1400.0, rel=0.1)
    assert each.health(T + 0.6).state == "ok" and scan.health.state == "ok"
    (empty,) = each.sense(T + 0.7, OWN)
    assert len(empty.z) == 0
    assert each.health(T + 20.0).state == "silent for 20 s"
    link.trouble.words = "reconnecting in 2 s (connection refused)"
    assert each.health(T + 0.8).state == "reconnecting in 2 s (connection refused)"


@pytest.mark.parametrize("kind", [AvrInput, BeastInput, SbsInput, UatInput, Gdl90Input])
def test_noise_is_not_being_heard(link, kind):
    """Whatever bytes come: who understands none of them is not well, and says so."""
    each = kind(ReceiverInputConfig(connect="a:1"), "adsb", FRAME, link)
    rng = np.random.default_rng(4)
    for k in range(200):
        noise = rng.bytes(500)
        # What looks like a message at first: of a radio's noise, or of another format.
        lures = (
            b"\x1a3" + bytes(21),
            b"*8d" + b"00" * 13 + b";\n",
            b"MSG,3,,,4840D6,,,x\n",
            b"\x7e\x14" + bytes(29) + b"\x7e",
        )
        link.queue.put(T + 0.1 * k, noise + lures[k % 4])
        each.drain()
    assert each.health(T + 20.0).state == "nothing understood for 20 s"
    assert sum(each.rejects.values()) > 100
    assert each.health(T + 40.0).state == "silent for 40 s"


def test_a_break_in_the_connection_forgets_half_a_message(link):
    each = AvrInput(ReceiverInputConfig(connect="a:1"), "adsb", FRAME, link)
    for data in (avr(0)[:-6], b"", avr(0), avr(1)):
        link.queue.put(T, data)
    each.drain()
    assert each.counters["messages"] == 2 and len(each.take_arrivals()) == 3


def test_what_a_full_queue_dropped_is_among_the_rejects(link):
    each = AvrInput(ReceiverInputConfig(connect="a:1"), "adsb", FRAME, link)
    for k in range(20):
        link.queue.put(T, avr(k))
    each.drain()
    assert each.rejects["packets dropped, the queue was full"] == 12
    assert each.health(T).rejects == each.rejects


def test_packets_are_read_in_portions(link):
    each = AvrInput(ReceiverInputConfig(connect="a:1"), "adsb", FRAME, link)
    for k in range(5):
        link.queue.put(T, avr(k))
    assert each.drain(2) is True and each.drain(2) is True and each.drain(2) is False


def test_the_autopilots_own_receiver_is_well_while_its_link_is(autopilot, link):
    each = AutopilotInput(AdsbReceiverConfig(), "autopilot", FRAME, link)
    assert each.health(T).state == "no link"
    autopilot.receive(telemetry(T, (0, 0, -300), (10, 0, 0)), T)
    assert each.health(T + 1.0).state == "ok"  # and nobody there
    lat, lon = FRAME.latitude + 1e-4, FRAME.longitude
    autopilot.traffic.append(AdsbReport(T, "abc123", lat, lon, geometric_altitude=400.0))
    (scan,) = each.sense(T + 1.0, OWN)
    assert scan.source_ids == ("abc123",) and scan.z[0, 2] == pytest.approx(-400.0)
    assert each.counters == {"reports": 1}


def radar(link, **changes):
    return RadarUdpInput(RadarUdpInputConfig(listen="0", units=({"radar_id": 7},), **changes), "north", FRAME, link)


def test_a_radars_scans_keep_their_own_times_and_its_units_the_inputs_name(link):
    each = radar(link)
    target = (800.0, 0.0, -300.0, -20.0, 0.0, 0.0)
    for k, delay in enumerate((0.05, 0.4, 0.02)):
        link.queue.put(T + 0.1 * k + delay, radar_datagram(k, T + 0.1 * k, [target]))
    each.drain()
    scans = each.sense(T + 1.0, OWN)
    assert [round(scan.t - T, 3) for scan in scans] == [0.0, 0.1, 0.2]
    assert {scan.sensor for scan in scans} == {"north"} and each.sense(T + 1.1, OWN) == []
    assert scans[0].health.state == "ok"


def test_a_radar_whose_times_are_old_is_not_well(link):
    each = radar(link)
    for k in range(10):
        link.queue.put(T + 0.1 * k + 1.5, radar_datagram(k, T + 0.1 * k, []))
        each.drain()
    scans = each.sense(T + 2.5, OWN)
    assert "1.5 s old" in scans[-1].health.state and "1.5 s old" in each.health(T + 2.5).state


def test_the_world_waits_for_telemetry_and_mission_and_then_keeps_the_last(autopilot, link):
    world = LiveWorld(autopilot, [radar(link)])
    assert world.missing(T) == "waiting for telemetry and the mission" and not world.done
    with pytest.raises(ValueError, match="no mission yet"):
        _ = world.mission
    with pytest.raises(ValueError, match="no telemetry yet"):
        world.sense(T)
    link.queue.put(T, radar_datagram(0, T, [(800.0, 0.0, -300.0, 0.0, 0.0, 0.0)]))
    world.discard(T)
    assert world.counters == {"packets before the first step": 1}
    autopilot.receive(telemetry(T, (0, 0, -300), (10, 0, 0), mission=[[0, 0, -300], [900, 0, -300]], index=1), T)
    assert world.missing(T + 0.1) == ""
    ownship, scans = world.sense(T + 0.1)
    assert ownship.t == T and scans == []
    with pytest.raises(ValueError, match="cannot run back"):
        world.sense(T + 0.1)
    autopilot._own = autopilot._mission = None  # it started anew
    ownship, _ = world.sense(T + 0.2)
    assert ownship.t == T and world.mission.index == 1
    autopilot.receive(telemetry(T + 1, (0, 0, -300), (10, 0, 0), mission=[[0, 0, -300], [900, 0, -300]], index=2), T)
    world.sense(T + 1.0)
    assert world.done


def test_a_maneuver_is_flown_while_it_is_valid_and_not_after(autopilot, link):
    world = LiveWorld(autopilot, [])
    maneuver = Maneuver(T, np.zeros((1, 3)), np.array([T + 5.0]), "left", T + 10.0)
    for t in (T, T + 9.9, T + 10.0):
        world.actuate(t, maneuver)
    world.actuate(T + 11.0, None)
    assert [m is maneuver for _, m in autopilot.flown] == [True, True, False, False]


def test_progress_is_no_change_of_the_mission():
    mission = Mission(np.zeros((2, 3)), np.ones(2), 0.0)
    assert changed(None, mission)
    assert not changed(mission, dataclasses.replace(mission, index=2, waypoints=np.zeros((2, 3))))
    assert changed(mission, dataclasses.replace(mission, waypoints=np.zeros((3, 3)), speeds=np.ones(3)))
    assert changed(mission, dataclasses.replace(mission, speeds=np.array([1.0, 2.0])))


STATUS = {
    "t": T,
    "state": "warning",
    "why": "",
    "threat": {"label": "N12[3]", "level": "warning", "distance_m": 900, "above_m": -30, "t_cpa_s": 12.0,
               "horizontal_miss_m": 40.0, "time_to_loss_s": 8.0},
    "tracks": 3,
    "maneuver": {"t": T, "reason": "turn left", "least_bad": False},
    "mission": {"index": 1, "waypoints": 3},
    "ownship": None,
    "autopilot": {"state": "avoiding", "link": "ok"},
    "inputs": {"radar": {"state": "silent for 4 s", "age_s": None, "rate_hz": 0.0, "rejects": {"crc failed": 7}}},
    "loop": {"command": True, "missed_steps": 2, "step_ms": {"p50": 3.0, "p99": 9.0}},
    "events": ["track 1 confirmed"],
}  # fmt: skip


def test_a_status_is_written_for_programs_and_for_people():
    out = io.StringIO()
    with StatusWriter("json", out) as writer:
        writer.show(STATUS)
    assert json.loads(out.getvalue()) == STATUS and not writer.stuck
    for how in ("screen", "lines"):
        out = io.StringIO()
        with StatusWriter(how, out) as writer:
            writer.show(STATUS)
        text = out.getvalue()
        for part in ("WARNING", "N12[3] 0.9 km, -30 m", "avoiding", "turn left", "track 1 confirmed", "missed 2"):
            assert part in text, text
    assert "lines" in how and "p99 9.0" in text


class Stuck(io.StringIO):
    def __init__(self):
        super().__init__()
        self.free = threading.Event()

    def write(self, text):
        self.free.wait(30.0)
        return super().write(text)


def test_a_reader_that_does_not_read_holds_up_nobody():
    out = Stuck()
    with StatusWriter("json", out) as writer:
        for _ in range(200):
            writer.show(STATUS)  # returns at once
    assert writer.stuck and writer.lost > 100
    out.free.set()
