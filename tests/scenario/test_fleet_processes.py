"""Fleets flown as one process for each vehicle, by UDP on loopback."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.lockstep import check_flown_alike
from wideberth.cli.main import app
from wideberth.errors import InputError
from wideberth.simulation.fleet import fly_fleet
from wideberth.simulation.fleet_config import FleetConfig, FleetVehicleConfig, load_fleet
from wideberth.simulation.fleet_vehicle import FleetVehicle
from wideberth.simulation.fleet_wire import MESSAGE_BYTES
from wideberth.units import FOOT

compiled = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="flies for minutes without the compiler"
)
SCENARIOS = Path(__file__).parents[2] / "scenarios"


@compiled
@pytest.mark.parametrize("name", ["cas_figure_4_22a", "cas_six_to_one_place", "cas_six_turning"])
def test_vehicles_alone_fly_as_the_fleet_does(name: str) -> None:
    config = load_fleet(SCENARIOS / f"{name}.toml")
    check_flown_alike(config, fly_fleet(config, config.step_s))


@compiled
def test_processes_come_to_the_same_distances(tmp_path: Path) -> None:
    # All is drawn alike; only the computer's own delay comes on top.
    scenario = SCENARIOS / "cas_figure_4_22a.toml"
    expected = fly_fleet(load_fleet(scenario), None).least_separation
    result = CliRunner().invoke(app, ["cas", str(scenario), "--processes", "--speed-up", "4", "--json"])
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout)
    assert summary["least_separation_m"] == pytest.approx(expected, abs=0.15 * FOOT)
    assert all(one["received"] > 1000 for one in summary["vehicles"])
    assert set(summary["processes"]) == {"steps begun late"}


def test_what_is_no_message_is_refused_and_counted() -> None:
    config = load_fleet(SCENARIOS / "cas_figure_4_21.toml")
    one, other = FleetVehicle(config, 0), FleetVehicle(config, 1)
    own, good = one.message(0), other.message(0)
    assert own is not None and good is not None and len(good) == MESSAGE_BYTES
    one.take(b"", 0)
    one.take(good[:-1] + bytes([good[-1] ^ 1]), 0)
    one.take(own, 0)
    one.take(good, 100_000)
    rng = np.random.default_rng(1)
    for _ in range(500):
        one.take(rng.bytes(int(rng.integers(0, 200))), 0)
    one.act(0)
    record = one.record()
    assert record.refused["own number: two vehicles have it"] == 1
    assert record.refused["too old or from the future"] == 1
    assert record.refused["wrong length"] + record.refused["wrong check sum"] == 502
    assert record.counters[0] == 0


def test_too_many_vehicles_for_processes_are_refused() -> None:
    from wideberth.live.fleet_processes import fly_as_processes

    vehicle = FleetVehicleConfig(position_m=(0, 0, 50), velocity_mps=(1, 0, 0))
    with pytest.raises(InputError, match="2 to 10"):
        fly_as_processes(FleetConfig(vehicles=(vehicle,) * 11))
