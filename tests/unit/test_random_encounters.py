"""Flights in legs against numerical integration, and random intruders that come as near as they are to."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wideberth.assembly import build_traffic
from wideberth.config import build_scenario
from wideberth.errors import InputError
from wideberth.frames import LocalFrame
from wideberth.simulation.config import RandomTrafficConfig, SimulatedTrafficConfig
from wideberth.simulation.legs import Leg, LegFlight
from wideberth.simulation.random_encounters import draw_intruders, planned_state
from wideberth.simulation.simulated import SimulatedTraffic
from wideberth.types import Mission

MISSION = Mission(
    np.array([[0.0, 0.0, -150.0], [300.0, 0.0, -150.0], [300.0, 400.0, -200.0]]), np.array([13.0, 13.0, 10.0]), 5.0
)
FRAME = LocalFrame(0.7, 0.2)


def test_legs_are_integrated():
    legs = [Leg(7.0, 0.3, 0.2, 0.0), Leg(4.0, -0.5, -0.1, 0.03), Leg(5.0, 0.0, 0.0, -0.02)]
    flight = LegFlight([1.0, 2.0, -3.0], 15.0, 0.4, 0.05, legs)

    def rates(t, x):
        end = 0.0
        for leg in legs:
            end += leg.duration
            if t < end:
                break
        else:
            leg = Leg(0.0, 0.0, 0.0, 0.0)
        v, chi, gamma = x[3:]
        return [
            v * math.cos(chi) * math.cos(gamma), v * math.sin(chi) * math.cos(gamma), -v * math.sin(gamma), *leg[1:],
        ]  # fmt: skip

    for t in (0.1, 6.9, 9.3, 14.0, 16.0, 40.0):
        expected = solve_ivp(rates, (0.0, t), [1.0, 2.0, -3.0, 15.0, 0.4, 0.05], max_step=0.02, rtol=1e-8, atol=1e-8).y[
            :, -1
        ]
        np.testing.assert_allclose(flight.state(t)[:3], expected[:3], atol=2e-3)
    before = flight.state(-3.0)
    np.testing.assert_allclose(before[:3] + 3.0 * before[3:], flight.state(0.0)[:3])
    # Velocity is the derivative of the position, also across the joints.
    for t in np.linspace(0.0, 20.0, 137):
        slope = (flight.state(t + 1e-4)[:3] - flight.state(t - 1e-4)[:3]) / 2e-4
        np.testing.assert_allclose(flight.state(t)[3:], slope, atol=1e-3)


def test_legs_neither_stop_nor_loop():
    flight = LegFlight([0.0, 0.0, 0.0], 5.0, 0.0, 0.0, [Leg(60.0, -0.5, 0.0, 0.0), Leg(60.0, 0.0, 0.0, 0.1)], 2.0)
    speeds = [np.linalg.norm(flight.state(t)[3:]) for t in range(121)]
    assert min(speeds) >= 2.0 - 1e-9
    assert abs(math.atan2(-flight.state(120.0)[5], math.hypot(*flight.state(120.0)[3:5]))) <= math.radians(80.0)


def test_the_plan_of_a_mission():
    position, velocity = planned_state(MISSION, 10.0)
    np.testing.assert_allclose(position, [130.0, 0.0, -150.0])
    np.testing.assert_allclose(velocity, [13.0, 0.0, 0.0])
    position, velocity = planned_state(MISSION, 300 / 13 + 60.0)
    np.testing.assert_allclose(position, [300.0, 600.0, -225.0])
    np.testing.assert_allclose(velocity, [0.0, 10.0, -1.25])
    still = Mission(np.zeros((2, 3)), np.ones(2), 0.0)
    with pytest.raises(InputError, match="one place"):
        planned_state(still, 1.0)


@pytest.mark.parametrize("maneuvering", [False, True])
def test_intruders_pass_as_near_as_they_are_to(maneuvering):
    config = RandomTrafficConfig(maneuvering=maneuvering, miss_max_m=60.0, height_max_m=15.0)
    counts, misses = [], []
    for seed in range(60):
        intruders = draw_intruders(config, MISSION, seed)
        counts.append(len(intruders))
        traffic = SimulatedTraffic(SimulatedTrafficConfig(intruders=intruders), FRAME)
        times = np.arange(0.0, 60.0, 0.05)
        own = np.array([planned_state(MISSION, t)[0] for t in times])
        there = np.array([traffic.truth(t).positions for t in times])
        apart = there - own[:, None]
        assert np.linalg.norm(apart[0], axis=1).min() >= config.start_distance_min_m - 1e-6
        flat = np.hypot(apart[..., 0], apart[..., 1])
        for k in range(len(intruders)):
            inside = (flat[:, k] < 60.5) & (np.abs(apart[:, k, 2]) < 15.5) & (times > 19.9) & (times < 45.1)
            assert inside.any()
            misses.append(flat[:, k].min())
    assert set(counts) == {1, 2, 3, 4}
    if not maneuvering:
        # Uniform from 0 to 60 m but for those that turn with the mission: the mean within five standard deviations.
        assert abs(np.mean(misses) - 30.0) < 5 * 60 / 12**0.5 / len(misses) ** 0.5 + 3.0


def test_draws_are_the_seeds():
    config = RandomTrafficConfig(maneuvering=True)
    assert draw_intruders(config, MISSION, 3) == draw_intruders(config, MISSION, 3)
    assert draw_intruders(config, MISSION, 3) != draw_intruders(config, MISSION, 4)
    with pytest.raises(InputError, match="start_distance_min_m"):
        draw_intruders(RandomTrafficConfig(start_distance_min_m=1e5), MISSION, 1)


def test_a_scenario_flies_among_them():
    tables = {
        "origin": {"lat_deg": 40.0, "lon_deg": 10.0},
        "mission": {
            "speed_mps": 13.0,
            "waypoints": [
                {"north_m": 0.0, "east_m": 0.0, "altitude_m": 150.0},
                {"north_m": 800.0, "east_m": 0.0, "altitude_m": 150.0},
            ],
        },
        "traffic": {"kind": "random", "intruders_min": 3, "intruders_max": 3},
        "seed": 8,
    }
    scenario = build_scenario(tables)
    assert build_scenario(scenario.resolved()).traffic == scenario.traffic
    mission = scenario.mission.mission(scenario.frame())
    traffic = build_traffic(scenario, mission, scenario.frame(), 100.0)
    assert traffic.truth.truth(0.0).ids == ("a00000", "a00001", "a00002")


@pytest.mark.parametrize(
    "wrong", [{"intruders_min": 5}, {"time_min_s": 60.0}, {"speed_min_mps": 30.0}, {"leg_min_s": 30.0}]
)
def test_ranges_the_wrong_way_round(wrong):
    with pytest.raises(ValueError, match="above"):
        RandomTrafficConfig(**wrong)


def test_legs_go_without_waypoints():
    points = [{"north_m": 0.0, "east_m": 0.0, "altitude_m": 0.0}, {"north_m": 9.0, "east_m": 0.0, "altitude_m": 0.0}]
    with pytest.raises(ValueError, match="legs"):
        SimulatedTrafficConfig(
            intruders=[{"address": "a00000", "waypoints": points, "speed_mps": 9.0, "legs": [{"duration_s": 1.0}]}]
        )
