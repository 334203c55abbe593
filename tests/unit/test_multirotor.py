"""The multirotor: hover, steps, wind, limits, refusals."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.vehicles import kernels
from wideberth.vehicles import multirotor_kernels as mk
from wideberth.vehicles.config import MultirotorConfig
from wideberth.vehicles.multirotor import Multirotor
from wideberth.vehicles.path_manager import PathManager
from wideberth.vehicles.path_segments import fillet_segments


def rotor(wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Multirotor:
    vehicle = Multirotor(MultirotorConfig(), np.array(wind))
    vehicle.place(np.array([0.0, 0.0, -50.0]), np.zeros(3))
    return vehicle


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (3.0, -4.0, 0.0)])
def test_hovers_where_it_is_told(wind: tuple[float, float, float]) -> None:
    vehicle, goal = rotor(wind), np.array([10.0, 5.0, -52.0])
    for _ in range(400):
        vehicle.hover(goal, 0.1)
    assert vehicle.body[:3] == pytest.approx(goal, abs=0.05)
    assert vehicle.velocity == pytest.approx(np.zeros(3), abs=0.02)
    # It leans into the wind: g tan(tilt) is the drag.
    drag = 0.2 * math.hypot(wind[0], wind[1])
    tilt = math.acos(math.cos(vehicle.body[mk.ROLL]) * math.cos(vehicle.body[mk.PITCH]))
    assert 9.81 * math.tan(tilt) == pytest.approx(drag, abs=0.02)


@pytest.mark.parametrize("speed", [1.0, 5.0, 15.0])
def test_a_velocity_is_reached_and_kept(speed: float) -> None:
    vehicle = rotor()
    top = 0.0
    for _ in range(200):
        vehicle.fly_velocity(np.array([0.0, speed, -0.5]), math.pi / 2, 0.1)
        top = max(top, float(vehicle.velocity[1]))
    assert vehicle.velocity == pytest.approx([0.0, speed, -0.5], abs=0.05)
    assert top < 1.15 * speed


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (2.0, 3.0, 0.0)])
def test_follows_waypoints_as_a_point_mass_does(wind: tuple[float, float, float]) -> None:
    points = np.array([[0.0, 0.0, -50.0], [200.0, 0.0, -50.0], [200.0, 200.0, -60.0], [0.0, 200.0, -50.0]])
    manager = PathManager(fillet_segments(points, np.full(4, 8.0), 30.0))
    vehicle = rotor(wind)
    errors: list[float] = []
    vehicle.place(points[0], np.array([8.0, 0.0, 0.0]))
    while not manager.done and len(errors) < 2000:
        vehicle.step(manager.command(vehicle), 0.1)
        errors.append(manager.cross_track(vehicle.state[:3]))
    assert manager.done
    assert np.abs(errors).max() < 5.0


def test_absurd_commands_are_limited_and_bad_ones_refused() -> None:
    vehicle = rotor()
    for command in ([1e9, 1e6, -1e9], [-1e9, -1e6, 1e9]):
        for _ in range(100):
            vehicle.step(np.array(command), 0.1)
            assert np.all(np.isfinite(vehicle.body))
            assert vehicle.state[kernels.AIRSPEED] < 16.5
            assert abs(vehicle.body[5]) < 2.5
            assert np.abs(vehicle.body[mk.ROLL : mk.PITCH + 1]).max() < math.radians(36.0)
    for command in ([math.nan, 0.0, 0.0], [5.0, 0.0]):
        with pytest.raises(ValueError, match="all finite"):
            vehicle.step(np.array(command), 0.1)
    with pytest.raises(ValueError, match="finite"):
        vehicle.fly_velocity(np.zeros(3), math.nan, 0.1)
    with pytest.raises(ValueError, match="finite"):
        vehicle.place(np.zeros(3), np.full(3, math.inf))
    with pytest.raises(ValidationError):
        MultirotorConfig(speed_min_mps=9.0, speed_max_mps=5.0)


def test_falls_freely_and_stops_by_drag() -> None:
    # Without thrust and drag it falls by g t^2 / 2; with drag alone the speed decays exponentially.
    q = np.ones(mk.N_ROTOR_PARAMS)
    q[mk.Q_DRAG] = 0.0
    x = np.zeros(mk.N_ROTOR)
    for _ in range(100):
        mk.multirotor_step(x, np.zeros(4), np.zeros(3), q, 0.01)
    assert x[2] == pytest.approx(0.5 * 9.81, rel=1e-9)
    q[mk.Q_DRAG] = 0.5
    x = np.zeros(mk.N_ROTOR)
    x[3] = 10.0
    for _ in range(100):
        mk.multirotor_step(x, np.zeros(4), np.zeros(3), q, 0.01)
    assert x[3] == pytest.approx(10.0 * math.exp(-0.5), rel=1e-5)
