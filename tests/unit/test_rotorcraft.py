"""The helicopter: exact steps, limits, coupling, waypoints."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive.cas import helicopter
from wideberth.units import FOOT
from wideberth.vehicles import rotorcraft_kernels
from wideberth.vehicles.config import RotorcraftConfig
from wideberth.vehicles.rotorcraft import Rotorcraft

speeds = st.floats(-3, 3)


@given(st.lists(speeds, min_size=6, max_size=6), st.lists(speeds, min_size=3, max_size=3), st.floats(-3, 3))
def test_a_step_solves_the_equations(state: list[float], command: list[float], heading: float) -> None:
    vehicle = Rotorcraft(RotorcraftConfig(coupling=0.1), heading)
    x = np.array(state)
    expected = helicopter(x, np.array(command), heading, vehicle.params, 0.7, 300)
    rotorcraft_kernels.rotorcraft_step(x, np.array(command), heading, vehicle.params, 0.7)
    assert x == pytest.approx(expected, abs=2e-5)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_steps_add_up_and_a_vertical_step_pushes_sideways(ratio: float) -> None:
    config = RotorcraftConfig(level_time_constant_s=0.4 * ratio, coupling=0.1, climb_rate_max_mps=1.0)
    fine, coarse = Rotorcraft(config), Rotorcraft(config)
    lateral = []
    for _ in range(400):
        fine.step([0, 0, -2 * FOOT], 0.01)
        lateral.append(fine.velocity[1])
    for _ in range(4):
        coarse.step([0, 0, -2 * FOOT], 1.0)
    assert max(np.abs(lateral)) / FOOT == pytest.approx(0.2, rel=1e-3)
    assert lateral[-1] == pytest.approx(0.0, abs=0.01)
    assert coarse.state == pytest.approx(fine.state, abs=1e-9)


def test_limits_hold() -> None:
    vehicle = Rotorcraft(RotorcraftConfig())
    vehicle.step([30.0, 40.0, -9.0], 20.0)
    assert math.hypot(*vehicle.velocity[:2]) == pytest.approx(5 * FOOT)
    assert vehicle.velocity[2] == pytest.approx(-2 * FOOT)
    assert vehicle.velocity[1] / vehicle.velocity[0] == pytest.approx(4 / 3)
    assert vehicle.ownship(3.0).t == 3.0


def test_it_hovers_stops_and_lands() -> None:
    vehicle = Rotorcraft(RotorcraftConfig(coupling=0.1))
    vehicle.place([0, 0, -10], [0, 0, 0])
    target = np.array([12.0, -5.0, -14.0])
    for _ in range(1200):
        vehicle.step(vehicle.guide(target, 1.5), 0.05)
    assert vehicle.state[:3] == pytest.approx(target, abs=0.05)
    vehicle.state[3:] = [1.0, 0.5, 0.2]
    for _ in range(200):
        vehicle.step(vehicle.guide(target, 1.5, "stop"), 0.05)
    assert vehicle.velocity == pytest.approx(np.zeros(3), abs=1e-3)
    assert not vehicle.landed
    for _ in range(2000):
        vehicle.step(vehicle.guide([0, 0, 99], 1.5, "land"), 0.05)
        assert vehicle.state[2] <= 1e-9
    assert vehicle.landed
    with pytest.raises(ValueError, match="no mode 'fly'"):
        vehicle.guide(target, 1.0, "fly")
    with pytest.raises(ValueError, match="dt must be positive"):
        vehicle.step([0, 0, 0], 0.0)
