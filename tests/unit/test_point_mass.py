"""The point mass against closed forms."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from wideberth.vehicles import PARTS, kernels
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass, parameters


def vehicle(**changes: float) -> PointMass:
    v = PointMass(PointMassConfig(**changes))
    v.place(np.array([0.0, 0.0, -300.0]), np.array([41.0, 0.0, 0.0]))
    return v


def test_coordinated_turn_has_its_radius() -> None:
    v = vehicle()
    command = np.array([41.0, 0.0, 0.0])
    points = []
    for k in range(1000):
        command[1] = v.state[kernels.HEADING] + 2.0  # keep the bank at its limit
        v.step(command, 0.05)
        if k > 200:
            points.append(v.state[:2].copy())
    centre = np.mean([np.max(points, axis=0), np.min(points, axis=0)], axis=0)
    radii = np.hypot(*(np.array(points) - centre).T)
    assert np.allclose(radii, 41.0**2 / (9.81 * math.tan(math.radians(35.0))), rtol=2e-3)


@pytest.mark.parametrize(
    ("element", "index", "tau", "change"),
    [(kernels.AIRSPEED, 0, 3.0, 2.0), (kernels.CLIMB, 2, 1.0, 1.5)],
)
@pytest.mark.parametrize("dt", [0.01, 0.1, 0.5])
def test_lags_are_first_order(element: int, index: int, tau: float, change: float, dt: float) -> None:
    v = vehicle()
    command = np.array([41.0, 0.0, 0.0])
    start = v.state[element]
    command[index] += change
    for _ in range(round(3.0 / dt)):
        v.step(command, dt)
    assert v.state[element] - start == pytest.approx(change * (1 - math.exp(-3.0 / tau)), abs=1e-9)


def test_limits_are_kept() -> None:
    v = vehicle()
    before = v.state.copy()
    for k in range(3000):
        u = np.array([200.0 if k % 700 < 350 else 0.0, 3.0 * math.sin(k / 40), 50.0 if k % 300 < 150 else -50.0])
        v.step(u, 0.1)
        rates = np.abs(v.state - before) / 0.1
        assert rates[kernels.AIRSPEED] <= 1.5 + 1e-9
        assert rates[kernels.BANK] <= math.radians(30.0) + 1e-9
        assert rates[kernels.CLIMB] <= 3.0 + 1e-9
        assert 30.0 - 1e-9 <= v.state[kernels.AIRSPEED] <= 46.0 + 1e-9
        assert abs(v.state[kernels.BANK]) <= math.radians(35.0) + 1e-9
        assert abs(v.state[kernels.CLIMB]) <= 5.0 + 1e-9
        before = v.state.copy()


def test_course_over_ground_is_held_in_a_cross_wind() -> None:
    wind = np.array([0.0, 15.0, 1.0])
    v = PointMass(PointMassConfig(), wind)
    v.place(np.zeros(3), np.array([41.0, 0.0, 0.0]))
    command = np.array([41.0, math.radians(60.0), 0.0])
    for _ in range(600):
        v.step(command, 0.1)
    velocity = v.velocity
    assert math.atan2(velocity[1], velocity[0]) == pytest.approx(math.radians(60.0), abs=1e-6)
    # The wind from the west blows to the right of a course of 60 deg: cos(60 deg) of it across.
    drift = math.asin(15.0 * math.cos(math.radians(60.0)) / 41.0)
    assert v.state[kernels.HEADING] == pytest.approx(math.radians(60.0) - drift, abs=1e-6)
    assert velocity[2] == pytest.approx(1.0)


def test_standing_still_over_ground_is_no_nan() -> None:
    v = PointMass(PointMassConfig(), np.array([-41.0, 0.0, 0.0]))
    v.place(np.zeros(3), np.zeros(3))
    for _ in range(50):
        v.step(np.array([41.0, 1.0, 0.0]), 0.1)
        assert np.all(np.isfinite(v.state))
    v.state[kernels.AIRSPEED] = 0.0
    v.step(np.array([0.0, 1.0, 0.0]), 0.1)
    assert np.all(np.isfinite(v.state))


def test_place_gives_the_velocity_asked_for() -> None:
    v = PointMass(PointMassConfig(), np.array([5.0, -3.0, 0.5]))
    velocity = np.array([30.0, 20.0, -2.0])
    v.place(np.array([1.0, 2.0, 3.0]), velocity)
    assert np.allclose(v.velocity, velocity)
    own = v.ownship(12.0)
    assert own.t == 12.0 and np.allclose(own.velocity, velocity) and np.allclose(own.position, [1, 2, 3])
    # The body's forward axis points where the aircraft moves through the air.
    air = velocity - v.wind
    assert np.allclose(own.attitude[:, 0], air / np.linalg.norm(air))


def test_parameters_are_si() -> None:
    p = parameters(PointMassConfig(bank_max_deg=30.0, sink_rate_max_mps=7.0))
    assert len(p) == kernels.N_PARAMS and np.all(np.isfinite(p))
    assert p[kernels.P_BANK_MAX] == pytest.approx(math.pi / 6) and p[kernels.P_SINK_MAX] == 7.0


def test_bad_limits_are_refused() -> None:
    with pytest.raises(ValidationError, match="swap them"):
        PointMassConfig(speed_min_mps=50.0, speed_max_mps=40.0)
    with pytest.raises(ValidationError, match="not below speed_min_mps"):
        PointMassConfig(climb_rate_max_mps=40.0)
    with pytest.raises(ValidationError):
        PointMassConfig(bank_max_deg=90.0)


def test_listed_by_name() -> None:
    assert PARTS["point_mass"] == f"{PointMass.__module__}:{PointMass.__name__}"
    assert PointMass.Config is PointMassConfig
