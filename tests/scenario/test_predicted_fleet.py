"""Fleets that predict: the messages and the motion of the compiled loop, and what filters and intent gain."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.lockstep import check_flown_alike
from wideberth.avoidance.cas.config import CasConfig, PredictionConfig, ThresholdConfig
from wideberth.cli.main import app
from wideberth.errors import InputError
from wideberth.live.fleet_processes import fly_as_processes
from wideberth.simulation.fleet import Fleet, FleetRun, fly_fleet
from wideberth.simulation.fleet_config import CommunicationConfig, FleetConfig, FleetVehicleConfig, load_fleet
from wideberth.units import FOOT

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "cas_kalman.toml"
NOISY = {"delay_s": 1.0, "loss": 0.2, "position_sigma_m": FOOT}
# Accelerations that do not last: the default's courses, but flown by the loop that predicts.
AS_DEFAULT = PredictionConfig(kind="constant_acceleration", acceleration_hold_s=1e-12, lookahead_s=1e4)


def meeting(n: int, radio: dict[str, Any], **changes: Any) -> FleetConfig:
    """Some that meet at one place after 30 s."""
    vehicles = []
    for k in range(n):
        angle, speed = 2 * math.pi * k / n + 0.1, (3 + 0.5 * k) * FOOT
        north, east = speed * math.cos(angle), speed * math.sin(angle)
        vehicles.append(
            FleetVehicleConfig(position_m=(-30 * north, -30 * east, 30 + 0.3 * k), velocity_mps=(north, east, 0.0))
        )
    return FleetConfig(
        duration_s=50.0,
        step_s=0.1,
        decision_period_s=0.5,
        vehicles=tuple(vehicles),
        controller=CasConfig(**changes),
        communication=CommunicationConfig(**{"period_s": 0.5, **radio}),
    )


def flown(config: FleetConfig) -> FleetRun:
    return fly_fleet(config, 0.5)


@pytest.mark.parametrize("controller", ["interval", "bang_bang", "continuous"])
@pytest.mark.parametrize(
    "radio",
    [
        {},
        {**NOISY, "jitter_s": 0.5, "duplicates": 0.3, "before_start": "silent"},
        {**NOISY, "hub": True, "outage_start_s": 15.0, "outage_duration_s": 8.0, "before_start": "silent"},
    ],
    ids=["ideal", "noisy", "hub"],
)
def test_the_default_course_is_flown_as_by_the_compiled_loop(controller: str, radio: Any) -> None:
    compiled = flown(meeting(4, radio, controller=controller, stale_s=5.0))
    stepped = flown(meeting(4, radio, controller=controller, stale_s=5.0, prediction=AS_DEFAULT))
    # Micrometres: rounding alone differs.
    np.testing.assert_allclose(stepped.states, compiled.states, rtol=0, atol=1e-6)
    np.testing.assert_allclose(stepped.separation, compiled.separation, rtol=0, atol=1e-6)
    np.testing.assert_allclose(stepped.drift, compiled.drift, rtol=0, atol=1e-6)
    np.testing.assert_allclose(stepped.least, compiled.least, rtol=0, atol=1e-6)
    assert np.array_equal(stepped.avoiding, compiled.avoiding) and stepped.avoiding.any()
    for name, counts in compiled.counters.items():
        assert np.array_equal(stepped.counters[name], counts), name
    assert [(e.vehicle, e.other, e.reason, e.start) for e in stepped.events] == [
        (e.vehicle, e.other, e.reason, e.start) for e in compiled.events
    ]
    np.testing.assert_allclose([e[3:] for e in map(as_row, stepped.events)],
                               [e[3:] for e in map(as_row, compiled.events)], atol=1e-6)  # fmt: skip


def as_row(event: Any) -> tuple[Any, ...]:
    return event.vehicle, event.other, event.reason, event.start, event.end, event.first_rate, event.largest_rate


def least_of(config: FleetConfig, encounters: int = 8) -> float:
    """Return the least distance in some encounters, ft."""
    fleet, found = Fleet(config), []
    for encounter in range(encounters):
        fleet.fly(encounter=encounter)
        found.append(fleet.separation.min() / FOOT)
    return float(min(found))


def test_a_filter_keeps_the_distance_by_positions_alone_and_raw_positions_do_not() -> None:
    radio = {**NOISY, "velocities": False}
    assert least_of(meeting(2, radio)) < 12.0
    assert least_of(meeting(2, radio, prediction=PredictionConfig(kind="kalman"))) > 12.0


@pytest.mark.parametrize("kind", ["constant_acceleration", "kalman", "kalman_acceleration"])
@pytest.mark.parametrize("intent", [False, True])
def test_every_prediction_avoids_with_velocities(kind: Any, intent: bool) -> None:
    config = meeting(2, NOISY, prediction=PredictionConfig(kind=kind, intent=intent))
    assert least_of(config, 4) > 12.0
    assert flown(config.model_copy(update={"seed": 2})).drift.max() < 40 * FOOT


def test_intent_spares_the_avoidance_of_one_that_levels_off() -> None:
    level = FleetVehicleConfig(position_m=(-30.0, 0.0, 40.0), velocity_mps=(1.0, 0.0, 0.0))
    climbing = FleetVehicleConfig(
        position_m=(30.0, 0.0, 22.0), velocity_mps=(-1.0, 0.0, 0.6), altitude_wanted_m=32.0,
        controller=CasConfig(controller="none"),
    )  # fmt: skip
    avoided = []
    for intent in (False, True):
        control = CasConfig(prediction=PredictionConfig(intent=intent))
        config = meeting(2, {}).model_copy(update={"vehicles": (level, climbing), "controller": control})
        run = flown(config)
        assert run.least_separation > 12 * FOOT
        avoided.append(run.avoiding[:, 0].sum())
    assert avoided[0] > 0 and avoided[1] == 0


def test_one_whose_health_is_bad_is_passed_wider() -> None:
    least = []
    for health in ("nominal", "degraded", "failed"):
        config = meeting(
            2,
            {**NOISY, "velocities": False},
            margin_m=0.0,
            prediction=PredictionConfig(kind="kalman"),
            threshold=ThresholdConfig(kind="probability"),
        )
        vehicles = tuple(v.model_copy(update={"health": health}) for v in config.vehicles)
        least.append(least_of(config.model_copy(update={"vehicles": vehicles})))
    assert 12.0 < least[0] < least[1] < least[2]


def test_health_needs_no_prediction_to_be_heard() -> None:
    config = meeting(2, {}, controller="continuous", law="shared")
    vehicles = tuple(v.model_copy(update={"health": "failed"}) for v in config.vehicles)
    # One that has failed is taken not to do its half.
    alone = flown(config.model_copy(update={"vehicles": vehicles}))
    assert alone.least_separation > flown(config).least_separation


def test_a_run_depends_on_its_seed_and_encounter_only() -> None:
    fleet = Fleet(meeting(3, NOISY, prediction=PredictionConfig(kind="kalman")))
    fleet.fly()
    first = fleet.separation.copy()
    fleet.fly(encounter=1, delay=0.5)
    assert not np.array_equal(fleet.separation, first)
    fleet.fly()
    assert np.array_equal(fleet.separation, first)


@pytest.mark.parametrize(
    "radio",
    [{}, {**NOISY, "velocities": False, "duplicates": 0.3}, {**NOISY, "hub": True, "before_start": "silent"}],
    ids=["ideal", "positions alone", "hub"],
)
def test_vehicles_alone_fly_as_the_fleet_does(radio: Any) -> None:
    # Everything that the others know of a vehicle has gone through the bytes of its messages.
    config = meeting(3, radio, prediction=PredictionConfig(kind="kalman", intent=True))
    sick = (config.vehicles[0].model_copy(update={"health": "degraded"}), *config.vehicles[1:])
    config = config.model_copy(update={"vehicles": sick})
    check_flown_alike(config, fly_fleet(config, config.step_s), 1e-9)


def test_absurd_and_stale_messages_are_counted_and_do_no_harm() -> None:
    kalman = PredictionConfig(kind="kalman")
    run = flown(meeting(2, {"absurd": 0.3}, prediction=kalman))
    assert (run.counters["absurd"] > 10).all() and run.least_separation > 12 * FOOT
    out = {"outage_start_s": 1.0, "outage_duration_s": 60.0}
    assert (flown(meeting(2, out, stale_s=5.0, prediction=kalman)).counters["stale"] > 10).all()


def test_those_that_never_avoid_and_those_that_predict_nothing_fly_along() -> None:
    config = meeting(3, {}, prediction=PredictionConfig(kind="kalman"))
    others = (None, CasConfig(controller="none"), CasConfig(controller="least_deviation"))
    vehicles = tuple(v.model_copy(update={"controller": c}) for v, c in zip(config.vehicles, others, strict=True))
    run = flown(config.model_copy(update={"vehicles": vehicles}))
    assert run.least_separation > 12 * FOOT
    assert {e.vehicle for e in run.events} == {0, 2}
    disabled = config.model_copy(update={"controller": config.controller.model_copy(update={"disable": True})})
    assert not flown(disabled).events


def test_what_does_not_go_with_a_prediction_is_refused_in_words() -> None:
    kalman = PredictionConfig(kind="kalman")
    for changes, radio, words in (
        ({"controller": "horizontal", "prediction": kalman}, {}, "vehicle 0: controller 'horizontal'"),
        ({"controller": "horizontal"}, {"velocities": False}, "communication.velocities"),
        ({"delay_compensation": "none", "prediction": kalman}, {}, "use 'timestamp'"),
    ):
        with pytest.raises(InputError, match=words):
            Fleet(meeting(2, radio, **changes))
    config = meeting(2, {}, prediction=kalman)
    with pytest.raises(InputError, match="distributed"):
        Fleet(config.model_copy(update={"architecture": "centralised"}))
    with pytest.raises(InputError, match="vehicle 0: controller 'horizontal'"):
        fly_as_processes(meeting(2, {}, controller="horizontal", prediction=kalman))


def test_run_flies_the_scenario_and_the_filter_decides_it(tmp_path: Path) -> None:
    command = ["run", str(SCENARIO), "--out", str(tmp_path), "--no-report"]
    assert (result := CliRunner().invoke(app, command)).exit_code == 0, result.output
    assert "are kept" in result.stdout
    config = load_fleet(SCENARIO)
    assert least_of(config, 2) > 12.0
    raw = config.controller.model_copy(update={"prediction": PredictionConfig()})
    assert least_of(config.model_copy(update={"controller": raw}), 1) < 12.0
