"""The rigid body of the fixed wings against its twin, closed forms and classical approximations."""

import cmath
import dataclasses
import math

import numpy as np
import pytest

from tests.naive import fixed_wing as naive
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.aircraft import AIR_DENSITY, AIRCRAFT, ZAGI, BlownDisc
from wideberth.vehicles.trim import modes, quaternion, trim

STILL = np.zeros(3)
NAMES = ["aerosonde", "zagi"]


def flown(name: str, x: np.ndarray, d: np.ndarray, seconds: float, dt: float = 0.01) -> np.ndarray:
    a, work, x = AIRCRAFT[name].array(), np.empty((3, fk.N_BODY)), x.copy()
    for _ in range(round(seconds / dt)):
        fk.fixed_wing_step(x, d, STILL, a, dt, work)
    return x


@pytest.mark.parametrize("name", NAMES)
def test_derivative_is_that_of_the_twin(name: str) -> None:
    random = np.random.default_rng(3)
    out = np.empty(fk.N_BODY)
    for _ in range(100):
        x = random.normal(size=fk.N_BODY)
        x[3:6] = [random.uniform(8, 35), 4 * random.normal(), 6 * random.normal()]
        x[6:10] /= np.linalg.norm(x[6:10])
        d = np.append(random.uniform(-0.5, 0.5, 3), random.uniform(0, 1))
        wind = 3 * random.normal(size=3)
        fk.fixed_wing_derivative(x, d, wind, AIRCRAFT[name].array(), out)
        assert out == pytest.approx(naive.derivative(x, d, wind, AIRCRAFT[name]), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("climb", [-0.05, 0.0, 0.05])
@pytest.mark.parametrize("radius", [math.inf, 150.0, -150.0])
def test_trim_holds(name: str, climb: float, radius: float) -> None:
    speed = AIRCRAFT[name].design_speed
    flight = trim(AIRCRAFT[name].array(), speed, climb, radius)
    assert flight.residual < 1e-10
    # The coordinated turn: V^2 cos(climb)^2 / (g tan(bank)); climbing, pitch tilts the bank's axis.
    if math.isfinite(radius):
        coordinated = (speed * math.cos(climb)) ** 2 / (9.81 * math.tan(flight.roll))
        assert coordinated == pytest.approx(radius, rel=0.02 if climb == 0.0 else 0.03)
    x = flown(name, flight.state, flight.controls, 2.0)
    assert fk.air_data(x, STILL)[0] == pytest.approx(speed, abs=1e-6)
    assert -x[2] == pytest.approx(2.0 * speed * math.sin(climb), abs=1e-5)


def test_trim_refuses_what_cannot_fly() -> None:
    a = AIRCRAFT["zagi"].array()
    for arguments in ((4.0, 0.0, math.inf), (13.0, 0.0, 5.0)):
        with pytest.raises(ValueError, match="no steady flight"):
            trim(a, *arguments)
    for arguments in ((0.0, 0.0, 1.0), (math.nan, 0.0, 1.0), (13.0, 2.0, 1.0), (13.0, 0.0, 0.0)):
        with pytest.raises(ValueError, match="must be"):
            trim(a, *arguments)


def test_aerosonde_is_trimmed_as_in_its_book() -> None:
    flight = trim(AIRCRAFT["aerosonde"].array(), 25.0)
    assert flight.controls[fk.ELEVATOR] == pytest.approx(-0.124, abs=0.003)


@pytest.mark.parametrize("name", NAMES)
def test_modes_have_the_signs_order_and_size_of_the_classical_ones(name: str) -> None:
    c, a, speed = AIRCRAFT[name], AIRCRAFT[name].array(), AIRCRAFT[name].design_speed
    found = modes(a, trim(a, speed))
    assert found.short_period.real < 0 and found.phugoid.real < 0 and found.dutch_roll.real < 0 and found.roll < 0
    assert abs(found.short_period) > 5 * abs(found.phugoid)
    assert abs(found.roll) > 20 * abs(found.spiral)
    # Lanchester's phugoid is sqrt(2) g / V without damping; this one's frequency with damping lies near it.
    assert abs(found.phugoid) == pytest.approx(math.sqrt(2.0) * 9.81 / speed, rel=0.25)
    # Short period: pitch stiffness and damping with those of the heave.
    q = 0.5 * AIR_DENSITY * speed**2 * c.area
    heave = q * c.lift[1] / (c.mass * speed)
    damping = -q * c.chord * c.pitch[2] / c.inertia[1] * c.chord / (2 * speed)
    stiffness = -q * c.chord * c.pitch[1] / c.inertia[1]
    total, product = heave + damping, stiffness + heave * damping
    expected = -total / 2 + cmath.sqrt(total**2 / 4 - product)
    assert found.short_period == pytest.approx(complex(expected.real, abs(expected.imag)), rel=0.12)
    roll = -q * c.span * -c.roll[1] * c.span / (2 * speed) / c.inertia[0]
    assert found.roll == pytest.approx(roll, rel=0.2)


def test_the_printed_zagi_cannot_hold_a_bank_by_its_ailerons() -> None:
    def lateral_control_departure(yaw_beta: float) -> float:
        return yaw_beta - ZAGI.roll[0] * ZAGI.yaw[3] / ZAGI.roll[3]

    assert lateral_control_departure(0.0004) < 0 < lateral_control_departure(ZAGI.yaw[0])


@pytest.mark.parametrize("name", NAMES)
def test_energy_is_kept_without_drag_and_thrust(name: str) -> None:
    # Lift and side force-free flight with rates that nothing damps: translation and rotation each keep their energy.
    c = dataclasses.replace(
        AIRCRAFT[name],
        drag=(0.0, 0.0, 0.0),
        oswald=1e30,
        pitch=(0.0,) * 4,
        side=(0.0,) * 5,
        roll=(0.0,) * 5,
        yaw=(0.0,) * 5,
        lift=(0.3, 4.0, 0.0, 0.0),
        propulsion=BlownDisc(0.0, 0.0),
    )
    x, work = np.zeros(fk.N_BODY), np.empty((3, fk.N_BODY))
    x[3:6], x[6:10], x[10:] = [20.0, 0.5, 1.0], quaternion(0.2, 0.05, 0.4), [0.3, 0.05, -0.2]
    jx, jy, jz, jxz = c.inertia
    inertia = np.array([[jx, 0, -jxz], [0, jy, 0], [-jxz, 0, jz]])

    def energies() -> tuple[float, float]:
        return 0.5 * float(x[3:6] @ x[3:6]) - 9.81 * x[2], 0.5 * float(x[10:] @ inertia @ x[10:])

    before = energies()
    for _ in range(200):
        fk.fixed_wing_step(x, np.zeros(4), STILL, c.array(), 0.005, work)
    assert energies() == pytest.approx(before, rel=1e-5)


def test_steps_converge_with_the_fourth_power() -> None:
    flight = trim(AIRCRAFT["aerosonde"].array(), 25.0)
    x, d = flight.state.copy(), flight.controls.copy()
    x[10:] = [0.4, 0.3, -0.2]
    exact = flown("aerosonde", x, d, 1.0, 0.0005)
    coarse, fine = (np.abs(flown("aerosonde", x, d, 1.0, dt) - exact).max() for dt in (0.02, 0.01))
    assert 12.0 < coarse / fine < 22.0


def test_stall_blends_into_a_flat_plate() -> None:
    a = AIRCRAFT["aerosonde"].array()
    assert fk.stall_share(0.0, a) < 1e-9
    assert fk.stall_share(AIRCRAFT["aerosonde"].stall_angle, a) == pytest.approx(0.5, abs=1e-6)
    for alpha in np.linspace(-3.1, 3.1, 200):
        lift, drag = fk.lift_and_drag(float(alpha), a)
        assert abs(lift) < 3.0 and 0.0 < drag < 2.1
    assert fk.lift_and_drag(1.2, a)[0] == pytest.approx(2 * math.sin(1.2) ** 2 * math.cos(1.2), rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_thrust_rises_with_the_throttle_and_falls_with_speed(name: str) -> None:
    a = AIRCRAFT[name].array()
    by_throttle = [fk.thrust_and_torque(15.0, t, a)[0] for t in np.linspace(0.15, 1, 20)]
    by_speed = [fk.thrust_and_torque(v, 0.8, a)[0] for v in np.linspace(0, 40, 20)]
    by_speed = [thrust for thrust in by_speed if thrust > 0.0]  # beyond, a propeller windmills
    assert len(by_speed) > 5
    assert np.all(np.diff(by_throttle) >= 0) and np.all(np.diff(by_speed) < 0)
