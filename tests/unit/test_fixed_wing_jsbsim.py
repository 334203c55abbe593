"""Our fixed wings against JSBSim with the same coefficients: accelerations, trim, modes.

JSBSim's gravity over its turning earth is 9.78 m/s2 on the equator, ours 9.81: what differs is that.
"""

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from tests.jsbsim_twin import JsbsimTwin
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.aircraft import AIRCRAFT
from wideberth.vehicles.trim import Trim, modes, quaternion, trim

pytest.importorskip("jsbsim")
GRAVITY = 0.035  # m/s2, that the two differ by
LONGITUDINAL = [0, 2, 4]


@pytest.fixture(params=["aerosonde", "zagi"])
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[JsbsimTwin, Trim]:
    aircraft = AIRCRAFT[request.param]
    twin = JsbsimTwin(aircraft, tmp_path_factory.mktemp("jsbsim"))
    return twin, trim(twin.array, aircraft.design_speed)


def level(speed: float, alpha: float) -> np.ndarray:
    x = np.zeros(fk.N_BODY)
    x[fk.U], x[fk.W] = speed * math.cos(alpha), speed * math.sin(alpha)
    x[fk.E0 : fk.E3 + 1] = quaternion(0.0, alpha, 0.0)
    return x


def test_accelerations_are_those_of_jsbsim(case: tuple[JsbsimTwin, Trim]) -> None:
    twin, flight = case
    random = np.random.default_rng(1)
    out = np.empty(fk.N_BODY)
    for _ in range(30):
        x, d = flight.state.copy(), flight.controls.copy()
        x[fk.U : fk.W + 1] += random.normal(size=3)
        x[fk.P : fk.R + 1] = 0.5 * random.normal(size=3)
        x[fk.E0 : fk.E3 + 1] = quaternion(*(0.3 * random.normal(size=3)))
        d[: fk.RUDDER + 1] += 0.1 * random.normal(size=3)
        fk.fixed_wing_derivative(x, d, np.zeros(3), twin.array, out)
        theirs = twin.accelerations(x, d)
        assert out[fk.U : fk.W + 1] == pytest.approx(theirs[:3], abs=GRAVITY)
        assert out[fk.P : fk.R + 1] == pytest.approx(theirs[3:], rel=1e-3, abs=1e-3)


def test_trim_is_that_of_jsbsim(case: tuple[JsbsimTwin, Trim]) -> None:
    twin, flight = case
    speed, ours = fk.air_data(flight.state, np.zeros(3))[:2]

    def residual(unknown: np.ndarray) -> np.ndarray:
        alpha, elevator, throttle = unknown
        return twin.accelerations(level(speed, alpha), np.array([elevator, 0.0, 0.0, throttle]))[LONGITUDINAL]

    theirs = fsolve(residual, [0.05, -0.05, 0.7])
    assert np.abs(residual(theirs)).max() < 1e-6
    elevator, throttle = flight.controls[fk.ELEVATOR], flight.controls[fk.THROTTLE]
    assert [ours, elevator, throttle] == pytest.approx(theirs.tolist(), rel=0.01)


def test_phugoid_and_short_period_are_those_of_jsbsim(case: tuple[JsbsimTwin, Trim]) -> None:
    twin, flight = case
    _, pitch, _ = fk.euler_angles(flight.state)

    def rates(u: float, w: float, q: float, theta: float) -> np.ndarray:
        x = np.zeros(fk.N_BODY)
        x[fk.U], x[fk.W], x[fk.Q] = u, w, q
        x[fk.E0 : fk.E3 + 1] = quaternion(0.0, theta, 0.0)
        return np.append(twin.accelerations(x, flight.controls)[LONGITUDINAL], q)

    at, small = np.array([flight.state[fk.U], flight.state[fk.W], 0.0, pitch]), np.array([1e-2, 1e-2, 1e-3, 1e-3])
    matrix = np.stack(
        [(rates(*(at + step)) - rates(*(at - step))) / (2 * step.sum()) for step in np.diag(small)], axis=1
    )
    found = sorted((z for z in np.linalg.eigvals(matrix) if z.imag > 0), key=abs)
    ours = modes(twin.array, flight)
    assert ours.phugoid == pytest.approx(found[0], rel=0.01)
    assert ours.short_period == pytest.approx(found[1], rel=0.01)
