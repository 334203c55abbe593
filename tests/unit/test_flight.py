"""A flight in real time, in this process: it ends when it is to, and gives control back whatever happened."""

import asyncio
import gc
import json
import socket
import time

import pytest

from tests.live_fakes import MISSION, SPEED, radar_datagram, scenario, telemetry
from wideberth.live.addresses import Address
from wideberth.live.fly import AUTOPILOT, Flight
from wideberth.live.transports import UdpEndpoint
from wideberth.recording import read_recording


class Sky:
    """Sends telemetry and radar plots to a flight from inside its own loop."""

    def __init__(self, flight):
        self.flight = flight
        self.vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.radar = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.start = time.time()
        self.sequence = 0

    async def send(self):
        while True:
            ends = self.flight.endpoints
            if AUTOPILOT in ends and ends[AUTOPILOT].trouble() == "":
                t = time.time()
                e = t - self.start
                line = telemetry(t, (-400.0 + SPEED * e, 0.0, -200.0), (SPEED, 0.0, 0.0), mission=MISSION)
                self.vehicle.sendto(line, ("127.0.0.1", ends[AUTOPILOT].port))
                plots = radar_datagram(self.sequence, t, [(2500.0, 0.0, -200.0, 10.0, 0.0, 0.0)])
                self.radar.sendto(plots, ("127.0.0.1", ends["radar"].port))
                self.sequence += 1
            await asyncio.sleep(0.05)


def fly(flight, duration=None, also=None):
    async def scene():
        sky = Sky(flight)
        tasks = [asyncio.create_task(sky.send())]
        if also is not None:
            tasks.append(asyncio.create_task(also()))
        try:
            return await flight.run(duration)
        finally:
            for task in tasks:
                task.cancel()
            sky.vehicle.close()
            sky.radar.close()

    return asyncio.run(scene())


def test_it_ends_when_its_time_is_up_and_leaves_recording_and_summary(tmp_path):
    statuses = []
    flight = Flight(scenario(), tmp_path, statuses.append)
    summary = fly(flight, 1.5)
    live = summary["live"]
    assert live["step_ms"]["count"] + live["missed_steps"] <= 16 and live["step_ms"]["count"] >= 1
    assert live["released"] and statuses[-1]["autopilot"]["state"] == "restoring"
    assert json.loads((tmp_path / "summary.json").read_text()) == json.loads(json.dumps(summary))
    recorded = read_recording(tmp_path / "recording.mcap")
    assert recorded.complete and recorded.step_count == live["step_ms"]["count"]
    assert all(endpoint.trouble() == "closed" for endpoint in flight.endpoints.values())
    assert gc.isenabled() and gc.get_freeze_count() == 0


def test_it_ends_when_it_is_asked_to(tmp_path):
    statuses = []
    flight = Flight(scenario(), tmp_path, statuses.append)

    async def ask():
        await asyncio.sleep(0.3)
        flight.stop("enough")
        flight.stop("enough again")

    fly(flight, None, ask)
    told = [event for status in statuses for event in status["events"]]
    assert told.count("enough") == 1 and "enough again" not in told and "control is given back" in told


def test_a_fault_of_ours_gives_control_back_before_it_is_reported(tmp_path, monkeypatch):
    flight = Flight(scenario(), tmp_path)
    count = 0
    take = flight.steps.step

    def faulty(t):
        nonlocal count
        count += 1
        if count == 8:
            raise ZeroDivisionError("a fault")
        return take(t)

    monkeypatch.setattr(flight.steps, "step", faulty)
    with pytest.raises(ZeroDivisionError, match="a fault"):
        fly(flight)
    assert flight.steps.autopilot.released
    assert read_recording(tmp_path / "recording.mcap").complete


def test_a_flight_whose_port_is_taken_does_not_begin(tmp_path):
    async def scene():
        other = UdpEndpoint(Address("udp", "127.0.0.1", 0), None, time.time)
        await other.open()
        made = scenario(
            autopilot={"kind": "tests.live_fakes:FakeAutopilot", "connection": f"udp:127.0.0.1:{other.port}"}
        )
        try:
            with pytest.raises(ValueError, match="cannot listen there"):
                await Flight(made, tmp_path).run()
        finally:
            other.close()

    asyncio.run(scene())
