"""The head-on of `scenarios/live_head_on.toml`: well clear is kept by one maneuver, and the mission goes on.

Simulated, and through the bytes of a flight with time set by hand. In real time with links and processes:
experiments/live_head_on.py.
"""

import os

import numpy as np
import pytest

from experiments.live_head_on import Case, tables_of, well_clear_ratio
from tests.live_fakes import HandClock
from wideberth.config import build_scenario
from wideberth.links.mavlink.modes import VehicleKind
from wideberth.live.clock import LiveClock
from wideberth.live.flight_steps import FlightSteps
from wideberth.live.sender_sources import reports_of_scans, scans_of
from wideberth.live.senders import TrafficPackets
from wideberth.live.simulated_vehicle import SimulatedVehicle
from wideberth.live.vehicle_mission import read_vehicle_mission
from wideberth.run import run_scenario
from wideberth.toml_text import to_toml

pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="takes minutes without the compiler")


@pytest.mark.parametrize("case", [Case("copter", 0.0, 1), Case("plane", 300.0, 1)], ids=lambda case: case.vehicle)
def test_well_clear_is_kept_by_one_maneuver_and_the_mission_is_finished(case):
    states = []
    summary = run_scenario(
        build_scenario(tables_of(case)), None, lambda _t, _planned, s: states.append((s.t, s.maneuver)), report=False
    )
    assert summary["nmac_count"] == 0 and summary["loss_of_well_clear_count"] == 0
    assert summary["reversals"] == 0 and summary["least_bad_maneuvers"] == 0
    assert summary["mission_completed"]
    avoided = np.array([maneuver is not None for _, maneuver in states])
    assert (np.diff(avoided.astype(int)) == 1).sum() == 1, "the mission is left once"
    assert summary["maneuvers"] == 1


@pytest.mark.parametrize("case", [Case("copter", 300.0, 4), Case("plane", 0.0, 2)], ids=lambda case: case.vehicle)
def test_one_path_is_flown_through_mavlink_and_gdl90(case, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    tables = tables_of(case)
    file = tmp_path / "head_on.toml"
    file.write_text(to_toml(tables))
    tables["autopilot"]["command"] = True
    vehicle = SimulatedVehicle(VehicleKind("ardupilot", case.vehicle), read_vehicle_mission(file, 0.0))
    hand, sent = HandClock(), []
    clock = LiveClock(*hand.both)
    steps = FlightSteps(build_scenario(tables), tmp_path, lambda data: sent.append(data) is None, clock)
    packets, reports, coming, start = TrafficPackets("gdl90"), reports_of_scans(*scans_of(file)), None, np.inf
    chosen, left = set(), [False]
    for k in range(6000):
        hand.advance(0.05)
        t = clock.now()
        vehicle.advance(t)
        for data in sent:
            vehicle.autopilot.receive(data, t)
        sent.clear()
        steps.queue.put(t, vehicle.autopilot.outgoing(t))
        steps.link.pump()
        if k % 2:
            continue
        steps.place({})
        if coming is not None:
            while coming[1] and start + coming[0] <= t:
                for data in packets.encode(coming[1], start + coming[0]):
                    steps.queues["adsb"].put(start + coming[0], data)
                coming = next(reports, (np.inf, []))
        snapshot = steps.step(t)
        if snapshot is None:
            continue
        if coming is None:
            coming, start = next(reports), t + 0.77
        if snapshot.maneuver is not None:
            chosen.add(snapshot.maneuver.t)
        left.append(snapshot.maneuver is not None)
        if vehicle.is_finished:
            break
    steps.close(None)
    assert vehicle.is_finished
    assert len(chosen) == 1 and np.diff(np.array(left, int)).tolist().count(1) == 1


def test_without_avoidance_well_clear_is_lost():
    tables = tables_of(Case("copter", 0.0, 1)) | {"avoid": False}
    summary = run_scenario(build_scenario(tables), None, report=False)
    assert summary["nmac_count"] == 1 and summary["loss_of_well_clear_count"] == 1


def test_the_ratio_is_one_at_the_edge_of_the_volume():
    ratio = well_clear_ratio(np.array([609.6, 0.0, 2000.0]), np.array([0.0, 76.2, 5.0]))
    assert ratio == pytest.approx([1.0, 1.0, 2000.0 / 609.6])
