"""The point mass for any state and command: its naive twin, and convergence to the differential equation."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.naive import vehicles as naive
from wideberth.vehicles import kernels
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import parameters

P = parameters(PointMassConfig())
FloatArray = NDArray[np.float64]


def arrays(*bounds: tuple[float, float]) -> st.SearchStrategy[FloatArray]:
    return st.tuples(*(st.floats(a, b) for a, b in bounds)).map(np.array)


STATES = arrays((-9e3, 9e3), (-9e3, 9e3), (-900, 0), (30, 46), (-math.pi, math.pi), (-0.6, 0.6), (-5, 5))
COMMANDS = arrays((20, 60), (-7, 7), (-9, 9))
WINDS = arrays((-12, 12), (-12, 12), (-2, 2))


@given(STATES, COMMANDS, WINDS, st.floats(0.01, 0.5))
def test_step_equals_its_naive_twin(x: FloatArray, u: FloatArray, wind: FloatArray, dt: float) -> None:
    expected = naive.step(x, u, wind, P, dt)
    before = u[1] - kernels.course_over_ground(x, wind)
    kernels.point_mass_step(x, u, wind, P, dt)
    if abs(abs(naive.turned(before)) - math.pi) > 1e-6:  # straight behind, rounding chooses the side
        assert np.allclose(x[[0, 1, 2, 3, 5, 6]], expected[[0, 1, 2, 3, 5, 6]], atol=1e-8)
        assert abs(naive.turned(x[4] - expected[4])) < 1e-9


@settings(max_examples=40, deadline=None)
@given(STATES, COMMANDS, WINDS)
def test_steps_of_a_tenth_are_accurate_and_of_a_half_stable(x: FloatArray, u: FloatArray, wind: FloatArray) -> None:
    # A command nearly straight behind may turn either way.
    if abs(naive.turned(u[1] - kernels.course_over_ground(x, wind))) > 2.9:
        return
    exact, fine, coarse = x.copy(), x.copy(), x.copy()
    for _ in range(1000):
        exact += 0.01 * naive.derivative(exact + 0.005 * naive.derivative(exact, u, wind, P), u, wind, P)
    for _ in range(100):
        kernels.point_mass_step(fine, u, wind, P, 0.1)
    for _ in range(20):
        kernels.point_mass_step(coarse, u, wind, P, 0.5)
    assert np.abs(fine[:3] - exact[:3]).max() < 3.0
    assert abs(naive.turned(fine[4] - exact[4])) < 0.02
    assert np.abs(coarse[:3] - exact[:3]).max() < 15.0
    assert np.abs(fine[[3, 6]] - exact[[3, 6]]).max() < 0.2


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles(angle: float) -> None:
    wrapped = kernels.wrap_angle(angle)
    assert -math.pi - 1e-9 < wrapped <= math.pi + 1e-9
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)
