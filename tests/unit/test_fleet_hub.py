"""Fleets of which a hub decides for all."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.lockstep import check_flown_alike
from tests.naive.cas import NaiveVehicle, commanded_by_a_hub
from wideberth.avoidance.cas import pair_kernels
from wideberth.avoidance.cas.config import cas_preset
from wideberth.avoidance.cas.settings import settings
from wideberth.live.fleet_processes import fly_as_processes
from wideberth.simulation import fleet_hub_kernels as kernels
from wideberth.simulation.fleet import Fleet, FleetRun, fly_fleet
from wideberth.simulation.fleet_config import CommunicationConfig, FleetConfig, FleetVehicleConfig, load_fleet
from wideberth.simulation.fleet_hub import FleetHub
from wideberth.simulation.fleet_message_kernels import make_buffers
from wideberth.simulation.fleet_messages import TOLD
from wideberth.simulation.fleet_vehicle import FleetVehicle
from wideberth.simulation.fleet_wire import packed_message
from wideberth.units import FOOT
from wideberth.vehicles import rotorcraft_kernels as rotorcraft
from wideberth.vehicles.config import RotorcraftConfig
from wideberth.vehicles.rotorcraft import parameters

compiled = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="flies for minutes without the compiler"
)
SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


def pair_config(controller: Any = None, radio: Any = None, **changes: Any) -> FleetConfig:
    """Head-on at 5 ft/s each from some 200 ft, 1 ft of altitude apart, decided by a hub.

    No step falls on the edge of the protected zone, where the tangent is a limit.
    """
    return FleetConfig(
        **{
            "duration_s": 30.0,
            "step_s": 0.05,
            "architecture": "centralised",
            "vehicles": (
                FleetVehicleConfig(position_m=(-100.3 * FOOT, 0, 51 * FOOT), velocity_mps=(5 * FOOT, 0, 0)),
                FleetVehicleConfig(position_m=(100 * FOOT, 0, 50 * FOOT), velocity_mps=(-5 * FOOT, 0, 0)),
            ),
            "controller": cas_preset("default", **(controller or {})),
            "communication": CommunicationConfig(**{"before_start": "silent", **(radio or {})}),
            **changes,
        }
    )


def flown(config: FleetConfig) -> FleetRun:
    return fly_fleet(config, None)


@compiled
@pytest.mark.parametrize("name", ["interval", "least_deviation", "bang_bang", "continuous", "altitudes"])
def test_without_delay_it_does_not_matter_who_decides(name: str) -> None:
    config = load_fleet(SCENARIOS / "cas_six_to_one_place.toml").model_copy(
        update={
            "controller": cas_preset("default", controller=name, smoothing=1.0),
            "communication": CommunicationConfig(),
            "duration_s": 60.0,
            "step_s": 0.1,
        }
    )
    runs = [
        fly_fleet(config.model_copy(update={"architecture": architecture}), 1.0)
        for architecture in ("distributed", "centralised")
    ]
    # Turns that are held count as a command to the hub and as none on board, where guidance is as good.
    assert runs[1].least_separation == pytest.approx(runs[0].least_separation, abs=1e-9)
    assert runs[1].states == pytest.approx(runs[0].states, abs=1e-9)


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@pytest.mark.parametrize("delay", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("compensation", ["none", "timestamp"])
def test_a_pair_flies_as_the_naive_twin(controller: str, delay: float, compensation: str) -> None:
    control = {"controller": controller, "delay_compensation": compensation, "smoothing": 1.0, "hysteresis_m": 0.3}
    config = pair_config(control, {"delay_s": delay}, step_s=0.1, duration_s=26.0)
    fleet = Fleet(config, 0.1)
    run = fleet.result(fleet.fly())
    vehicles = [
        NaiveVehicle(x.copy(), float(w), config.controller) for x, w in zip(fleet.start, fleet.wanted, strict=True)
    ]
    least, _ = commanded_by_a_hub(vehicles, 260, 0.1, round(delay / 0.1))
    assert run.least_separation == pytest.approx(least, abs=1e-3)  # switches multiply rounding


@given(
    st.lists(st.tuples(st.booleans(), st.floats(-0.6, 0.3)), min_size=1, max_size=12),
    st.floats(0.0, 1.5),
    st.floats(-0.6, 0.3),
)
def test_it_expects_what_its_commands_make_of_a_vehicle(
    sent: list[tuple[bool, float]], horizon: float, rate: float
) -> None:
    period, n = 0.1, len(sent)
    p = settings(cas_preset("default"))
    q = parameters(RotorcraftConfig())
    b, hub = make_buffers(2, 4, 3), kernels.make_hub(2, 32)
    for k, (avoids, command) in enumerate(sent):
        hub.sent[k, 1, 2], hub.sent[k, 1, kernels.C_REASON] = command, float(avoids)
    x = np.array([1.0, 2.0, -20.0, 1.2, -0.3, rate])
    b.views[1, :6] = x
    kernels.expect(1, n, horizon, period, x, -21.0, p, b, hub)
    count = min(int(horizon / period + 0.5), n)
    x[:3] += (horizon - count * period) * x[3:]
    for avoids, command in sent[n - count :]:
        down = command if avoids else pair_kernels.guidance_rate(x[2], -21.0, p)
        rotorcraft.rotorcraft_step(x, np.array([x[3], x[4], down]), 0.0, q, period)
    assert b.views[1, :6] == pytest.approx(x, abs=1e-9)


def test_the_hub_can_be_late_twice_and_keeps_apart_what_it_hears_of() -> None:
    for delay in (1.0, 4.0):
        run = flown(pair_config(radio={"delay_s": delay, "loss": 0.2, "position_sigma_m": FOOT}))
        assert run.least_separation > 12 * FOOT
        assert (run.counters["lost"] > 100).all()
        assert (run.counters["received"] > 500).all()


def test_without_the_hub_all_follow_guidance() -> None:
    outage = {"outage_start_s": 0.0, "outage_duration_s": 60.0}
    run = flown(pair_config(radio=outage))
    assert run.least_separation == pytest.approx(FOOT, abs=0.01)
    assert run.counters["received"].tolist() == [0, 0]
    assert not run.events
    # Later on the last command is obeyed until it is stale; both then fly back into each other.
    outage["outage_start_s"] = 5.0
    run = flown(pair_config({"stale_s": 2.0}, outage))
    assert (run.counters["stale"] > 100).all()
    assert run.least_separation < 12 * FOOT
    assert all(event.end <= 7.2 for event in run.events)


def test_a_vehicle_that_the_hub_does_not_hear_is_not_commanded() -> None:
    radio = {"outage_start_s": 0.0, "outage_duration_s": 60.0, "outage_vehicle": 1}
    run = flown(pair_config(radio=radio))
    assert run.counters["received"][1] == 0 and run.counters["lost"][1] > 500
    assert run.drift.max() < 1e-9


def test_decisions_may_be_rarer_than_steps() -> None:
    run = flown(pair_config(radio={"delay_s": 1.0}, decision_period_s=0.5))
    assert run.least_separation > 12 * FOOT
    assert run.counters["received"].max() <= 600 + 60


def test_others_than_a_known_architecture_are_refused() -> None:
    with pytest.raises(ValueError, match="has a hub already"):
        pair_config(radio={"hub": True})
    with pytest.raises(ValueError, match="architecture"):
        pair_config(architecture="anarchic")


@compiled
@pytest.mark.parametrize("radio", [{}, {"delay_s": 1.0, "jitter_s": 0.5, "loss": 0.2, "duplicates": 0.3}])
def test_hub_and_vehicles_alone_fly_as_the_fleet_does(radio: dict[str, Any]) -> None:
    config = pair_config(radio={**radio, "outage_start_s": 20.0, "outage_duration_s": 6.0})
    check_flown_alike(config, fly_fleet(config, config.step_s))


def test_what_is_not_for_hub_or_vehicle_is_refused_and_counted() -> None:
    config = pair_config()
    hub, vehicles = FleetHub(config), [FleetVehicle(config, k) for k in range(2)]
    messages = [vehicle.message(0) or b"" for vehicle in vehicles]
    for message in messages:
        hub.take(message, 0)
    commands = dict(hub.act(0))
    assert set(commands) == {0, 1}
    hub.take(commands[0], 0)
    hub.take(messages[0], 100_000)
    hub.take(messages[0][:-1], 0)
    hub.take(packed_message(7, 0, range(TOLD)), 0)
    assert hub.refused == {
        "command to a hub": 1, "too old or from the future": 1, "wrong length": 1, "unknown sender": 1
    }  # fmt: skip
    vehicles[0].take(commands[1], 0)
    vehicles[0].take(messages[1], 0)
    assert vehicles[0].refused == {"command to another vehicle": 1, "not for a vehicle of this fleet": 1}


@compiled
def test_a_centralised_fleet_flies_as_processes() -> None:
    config = pair_config(radio={"delay_s": 1.0})
    run, counts = fly_as_processes(config, speed_up=8.0)
    assert run.least_separation == pytest.approx(fly_fleet(config).least_separation, abs=0.15 * FOOT)
    assert run.least_separation > 12 * FOOT and set(counts) == {"steps begun late"}
