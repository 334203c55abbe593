"""Fleets that avoid each other by messages."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import isotonic_regression

from tests.naive.cas import NaiveVehicle, head_on
from wideberth.avoidance.cas import multi_kernels, pair_kernels
from wideberth.avoidance.cas.config import cas_preset
from wideberth.avoidance.cas.settings import settings
from wideberth.simulation import fleet_decision_kernels
from wideberth.simulation import fleet_message_kernels as kernels
from wideberth.simulation.fleet import Fleet, FleetRun, fly_fleet
from wideberth.simulation.fleet_config import CommunicationConfig, FleetConfig, FleetVehicleConfig
from wideberth.units import FOOT


def pair_config(
    *, offset: float = 1.0, duration: float = 30.0, other: str | None = None, radio: Any = None, **changes: Any
) -> FleetConfig:
    """Head-on at 5 ft/s each from 200 ft."""
    control = cas_preset(changes.pop("preset", "thesis"), **{"delay_compensation": "none", **changes})
    second = None if other is None else cas_preset("thesis", controller=other)
    return FleetConfig(
        duration_s=duration,
        vehicles=(
            FleetVehicleConfig(position_m=(-100 * FOOT, 0, (50 + offset) * FOOT), velocity_mps=(5 * FOOT, 0, 0)),
            FleetVehicleConfig(
                position_m=(100 * FOOT, 0, 50 * FOOT), velocity_mps=(-5 * FOOT, 0, 0), controller=second
            ),
        ),
        controller=control,
        communication=CommunicationConfig(**(radio or {})),
    )


def flown(config: FleetConfig) -> FleetRun:
    return fly_fleet(config, None)


@pytest.mark.parametrize(
    ("changes", "feet"),
    [
        ({}, 12.000),
        ({"other": "none"}, 12.000),
        ({"law": "shared"}, 11.244),
        ({"law": "shared_corrected"}, 12.000),
        ({"controller": "bang_bang"}, 14.194),
    ],
    ids=str,
)
def test_head_on_passes_at_the_known_distances(changes: dict[str, Any], feet: float) -> None:
    assert flown(pair_config(**changes)).least_separation / FOOT == pytest.approx(feet, abs=5e-4)


@pytest.mark.parametrize("controller", ["continuous", "bang_bang"])
@pytest.mark.parametrize("delay", [0.0, 2.0, 6.0])
@pytest.mark.parametrize("compensation", ["none", "estimate"])
def test_a_pair_flies_as_the_naive_twin(controller: str, delay: float, compensation: str) -> None:
    config = pair_config(
        controller=controller,
        delay_compensation=compensation,
        delay_estimate_s=delay,
        hysteresis_m=0.3,
        duration=24.0,
        radio={"delay_s": delay},
    )
    config = config.model_copy(update={"step_s": 0.08})
    fleet = Fleet(config)
    fleet.fly()
    vehicles = [
        NaiveVehicle(x.copy(), float(w), config.controller) for x, w in zip(fleet.start, fleet.wanted, strict=True)
    ]
    least, _ = head_on(vehicles, 300, 0.08, round(delay / 0.08), lambda k, i: False)
    assert fleet.separation.min() == pytest.approx(least, abs=1e-3)  # switches multiply rounding


def test_messages_of_a_link_are_lost_doubled_and_reordered_alike_each_time() -> None:
    radio = {"loss": 0.3, "duplicates": 0.2, "jitter_s": 0.3, "delay_s": 0.5, "position_sigma_m": FOOT}
    fleet = Fleet(pair_config(preset="default", radio=radio))
    fleet.fly()
    first, least = fleet.counters.copy(), fleet.separation.min()
    sent = 1500
    for received, lost, doubled, late in first[:, :4]:
        assert lost / sent == pytest.approx(0.3, abs=0.05)  # 4 sigma
        assert doubled > 5  # those that come after a newer message count as out of order
        assert late > 100
        assert received <= sent - lost
    fleet.fly(encounter=1)
    assert not np.array_equal(fleet.counters, first)
    fleet.fly()
    assert np.array_equal(fleet.counters, first)
    assert fleet.separation.min() == least


def test_absurd_messages_are_counted_and_do_no_harm() -> None:
    run = flown(pair_config(preset="default", radio={"absurd": 0.3}))
    assert (run.counters["absurd"] > 300).all()
    assert run.least_separation > 12 * FOOT
    assert np.isfinite(run.separation[0, 1])


def test_an_outage_makes_messages_stale_and_a_hub_doubles_the_delay() -> None:
    radio = {"outage_start_s": 1.0, "outage_duration_s": 30.0}
    run = flown(pair_config(preset="default", stale_s=2.0, radio=radio))
    assert (run.counters["stale"] > 1000).all()
    direct, hub = (
        flown(pair_config(preset="thesis", radio={"delay_s": delay, "hub": is_hub, "before_start": "silent"}))
        for delay, is_hub in ((2.0, False), (1.0, True))
    )
    assert hub.least_separation == pytest.approx(direct.least_separation, abs=1e-9)


def test_one_vehicle_that_falls_silent_is_avoided_by_what_was_heard() -> None:
    run = flown(
        pair_config(
            preset="default",
            delay_compensation="timestamp",
            stale_s=60.0,
            other="none",
            radio={"outage_start_s": 5.0, "outage_duration_s": 60.0, "outage_vehicle": 1},
        )
    )
    assert run.least_separation > 12 * FOOT
    assert run.counters["lost"][0] > 1000
    assert run.counters["lost"][1] == 0


def test_each_avoidance_is_a_record() -> None:
    run = fly_fleet(pair_config(controller="bang_bang"), 0.5)
    assert [(e.vehicle, e.other, e.reason) for e in run.events] == [
        (0, 1, "current trajectory"),
        (1, 0, "current trajectory"),
    ]
    for event, rate in zip(run.events, (-2 * FOOT, FOOT), strict=True):
        assert 14 < event.start < event.end < 20
        assert event.first_rate == event.largest_rate == pytest.approx(rate)
    assert len(run.time) == len(run.states) == 60
    assert run.avoiding.any()
    assert run.least.min() >= run.least_separation
    assert run.events_unrecorded == 0


def test_avoidances_without_room_are_counted() -> None:
    fleet = Fleet(pair_config(controller="bang_bang"))
    assert fleet.result(fleet.fly() + 200).events_unrecorded == 200 + 2 - 128


def test_a_vehicle_sees_those_that_do_not_avoid_and_the_drift_is_reported() -> None:
    run = flown(pair_config(other="none"))
    assert run.drift[0, 0] / FOOT == pytest.approx(11.06, abs=0.02)
    assert run.drift[1].max() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("controller", ["interval", "altitudes"])
def test_vehicles_that_meet_at_one_place_stay_apart(controller: str) -> None:
    rng = np.random.default_rng(5)
    vehicles = []
    for k in range(6):
        angle, speed = 2 * np.pi * k / 6, rng.uniform(0.8, 1.5)
        place = -speed * 60.0 * np.array([np.cos(angle), np.sin(angle)])
        vehicles.append(
            FleetVehicleConfig(
                position_m=(place[0], place[1], 60.0 + 0.2 * k),
                velocity_mps=(speed * np.cos(angle), speed * np.sin(angle), 0.0),
            )
        )
    config = FleetConfig(
        duration_s=75.0,
        step_s=0.1,
        vehicles=tuple(vehicles),
        controller=cas_preset("default", controller=controller),
    )
    run = flown(config)
    assert run.least_separation > 12 * FOOT
    assert run.drift.max() < 60.0


@given(st.lists(st.integers(0, 40), min_size=1, max_size=8))
def test_levels_are_the_nearest_that_are_apart(heights: list[int]) -> None:
    n, p = len(heights), settings(cas_preset("default"))
    buffers = kernels.make_buffers(n, 2)
    buffers.use[:] = 1.0
    wanted = -30.0 - np.array(heights) / 2
    buffers.views[:, multi_kernels.V_WANTED] = wanted
    gap, order = p[pair_kernels.P_SEPARATION], np.argsort(wanted, kind="stable")
    expected = isotonic_regression(wanted[order] - gap * np.arange(n)).x + gap * np.arange(n)
    for rank, i in enumerate(order):
        level = fleet_decision_kernels.level_of(i, wanted[i], np.zeros(6), p, buffers)
        assert level == pytest.approx(expected[rank], abs=1e-9)


def test_what_does_not_fit_is_refused() -> None:
    config = pair_config()
    with pytest.raises(ValueError, match="no multiple of step_s"):
        FleetConfig(vehicles=config.vehicles, decision_period_s=0.03)
    with pytest.raises(ValueError, match="outage_vehicle 2"):
        FleetConfig(vehicles=config.vehicles, communication=CommunicationConfig(outage_vehicle=2))
    fleet = Fleet(config)
    with pytest.raises(ValueError, match=r"start must be \(2, 6\)"):
        fleet.fly(np.full((2, 6), np.nan))
    with pytest.raises(ValueError, match="delay"):
        fleet.fly(delay=1.0)


def test_messages_arrive_newest_first_and_older_ones_are_out_of_order() -> None:
    buffers, results = kernels.make_buffers(2, 8), kernels.make_results(2, 1, 0)
    kernels.reset(buffers, results)
    kernels.put(buffers, results, 1, 2, 0, 1)
    kernels.put(buffers, results, 0, 3, 0, 1)
    assert buffers.newest[3, 0, 1] == 1
    assert results.counters[0, kernels.OUT_OF_ORDER] == 1
