"""The collision avoidance loop of two vehicles: gains by differences, eigenvalues by matrices, delays by simulation."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wideberth.analysis.stability import (
    LAWS,
    eigenvalues,
    encounter_stability,
    full_matrix,
    largest_stable_delay,
    tangent_gains,
    tangent_velocity,
    vertical_matrix,
)

D = 12.0
TAU = 0.4


@pytest.mark.parametrize("x", [40.0, 12.0, 11.9, 3.0, -3.0])
def test_on_the_approach_k_is_minus_one_over_the_time_left(x):
    gains = tangent_gains([x, 0.0, -D], [-5.0, 0.0, 0.0], D)
    if x > 0:
        assert gains.position[2] == pytest.approx(-5.0 / x, rel=1e-9)
    else:
        assert gains.position[2] < 0.0  # on the sphere (5.37)


def test_after_the_sphere_it_is_unstable():
    assert tangent_gains([-30.0, 0.0, -D], [-5.0, 0.0, 0.0], D).position[2] > 0.0


def test_the_commanded_velocity_passes_at_the_distance():
    rng = np.random.default_rng(1)
    for _ in range(200):
        p, v = rng.uniform(-60, 60, 3), rng.uniform(-5, 5, 3)
        v[2] = tangent_velocity(p, v, D)
        if math.isnan(v[2]):
            continue
        miss = np.linalg.norm(p - (p @ v) / (v @ v) * v)
        assert miss == pytest.approx(D, rel=1e-6)


@given(
    st.floats(-10, 10),
    st.floats(8, 40) | st.floats(-40, -8),
    st.floats(0, 40),
    st.sampled_from([-1.0, 1.0]),
    st.floats(0.5, 5),
    st.floats(-math.pi, math.pi),
)
def test_gains_are_the_derivatives(miss, ahead, extra, side, speed, course):
    # Outside the sphere, and passing nearer than its radius in the plane: there a velocity is tangent.
    horizontal = math.hypot(miss, ahead)
    assume(abs(horizontal - D) > 0.5)
    along = np.array([math.cos(course), math.sin(course), 0.0])
    across = np.array([-math.sin(course), math.cos(course), 0.0])
    height = side * (math.sqrt(max(1.2 * D**2 - horizontal**2, 1.0)) + extra)
    p = -ahead * along + miss * across + np.array([0.0, 0.0, height])
    v = speed * along
    gains = tangent_gains(p, v, D)
    h = 1e-5
    for i in range(3):
        step = np.eye(3)[i] * h
        slope = (tangent_velocity(p + step, v, D) - tangent_velocity(p - step, v, D)) / (2 * h)
        assert gains.position[i] == pytest.approx(slope, rel=1e-4, abs=1e-4 * max(1, abs(gains.position).max()))
    for i in range(2):
        step = np.eye(3)[i] * h
        slope = (tangent_velocity(p, v + step, D) - tangent_velocity(p, v - step, D)) / (2 * h)
        assert gains.velocity[i] == pytest.approx(slope, rel=1e-4, abs=1e-4 * max(1, abs(gains.velocity).max()))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("as_printed", [False, True])
@pytest.mark.parametrize("k", [-3.0, -0.2, 0.4])
def test_eigenvalues_are_those_of_the_matrices(law, as_printed, k):
    closed = eigenvalues(k, TAU, law, as_printed=as_printed)
    matrix = vertical_matrix(k, TAU, law, as_printed=as_printed)
    # The double zero is only found to the root of the rounding error.
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(matrix)), closed, atol=1e-6)


def test_the_twelve_states_have_the_same_modes_and_zeros():
    gains = tangent_gains([40.0, 5.0, -math.sqrt(D**2 - 25)], [-5.0, 0.0, 0.0], D)
    matrix = full_matrix(gains, TAU)
    found = np.linalg.eigvals(matrix)
    expected = eigenvalues(gains.position[2], TAU)
    big = expected[np.abs(expected) > 1e-9]
    for value in big:
        assert np.abs(found - value).min() < 1e-6
    assert (np.abs(found) < 1e-3).sum() == 10
    np.testing.assert_array_equal(matrix[0], np.eye(12)[1])


def test_tables_5_1_to_5_3_mended():
    for law, critical, middle in (("full", 2, 1), ("shared", 1, 1), ("non_cooperative", 4, 0.5)):
        # Critically damped; with 1/tau on K the tables' -1/(n tau^2) become -1/(n tau).
        values = eigenvalues(-1 / (critical * TAU), TAU, law)
        assert (np.abs(values + middle / TAU) < 1e-6).sum() == 2


def grows(t_star, tau, delay, law):
    """Whether the difference of the heights grows, by Euler steps of the loop with a delay line."""
    dt = min(delay, tau, t_star) / 400
    n = round(delay / dt)
    a, lag = 1 / t_star, tau
    if law == "shared":
        a /= 2
    follow = 1.0
    if law == "shared_corrected":
        a, follow = a / 2, 0.5
    steps = round(30 * 2 * math.pi / math.sqrt(2 / (tau * t_star)) / dt)
    z, v = np.zeros(steps + 1), np.zeros(steps + 1)
    z[: n + 1] = 1.0
    for k in range(n, steps):
        # z is z1 - z2: the other's part comes late and with the other sign.
        command = -a * (z[k] + z[k - n]) - follow * (v[k] + v[k - n])
        v[k + 1] = v[k] + dt * command / lag
        z[k + 1] = z[k] + dt * v[k + 1]
    # The first of three parts holds what dies away.
    third = (steps - n) // 3
    return np.abs(z[-third:]).max() > np.abs(z[-2 * third : -third]).max()


@pytest.mark.parametrize("law", ["full", "shared", "shared_corrected"])
@pytest.mark.parametrize("t_star", [0.7, 5.0])
def test_the_exact_delay_is_where_the_loop_starts_to_grow(law, t_star):
    limit = largest_stable_delay(t_star, TAU, law)
    assert not grows(t_star, TAU, 0.85 * limit, law)
    assert grows(t_star, TAU, 1.15 * limit, law)


def test_pade_of_order_one_gives_twice_the_time_and_higher_orders_the_exact_delay():
    assert largest_stable_delay(3.0, TAU, pade=1) == pytest.approx(6.0)
    assert largest_stable_delay(3.0, TAU, "shared", pade=1) == pytest.approx(12.0)
    exact = largest_stable_delay(3.0, TAU)
    errors = [abs(largest_stable_delay(3.0, TAU, pade=n) - exact) for n in (1, 2, 3, 5, 8, 12, 20)]
    assert all(a > b for a, b in itertools.pairwise(errors[:6]))
    assert errors[-1] < 1e-6


def test_arrays_and_a_vehicle_that_does_not_avoid():
    delays = largest_stable_delay([[1.0], [2.0]], [0.2, 0.4, 0.8])
    assert delays.shape == (2, 3)
    assert delays[1, 1] == largest_stable_delay(2.0, 0.4)
    assert largest_stable_delay(1.0, 0.4, "non_cooperative") == math.inf


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((0.0, 0.4), "t_star"),
        ((1.0, math.nan), "tau"),
        ((1.0, 0.4, "half"), "law"),
        ((1.0, 0.4, "full", 0), "pade"),
        ((1.0, 0.4, "full", 2.5), "pade"),
    ],
)
def test_wrong_arguments_are_named(arguments, word):
    with pytest.raises(ValueError, match=word):
        largest_stable_delay(*arguments)


def test_no_tangent_inside_the_sphere():
    assert math.isnan(tangent_velocity([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], D))
    with pytest.raises(ValueError, match="tangent"):
        tangent_gains([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], D)
    with pytest.raises(ValueError, match="shape"):
        tangent_gains([1.0, 1.0], [1.0, 0.0, 0.0], D)


@given(
    st.floats(15, 60), st.floats(0.0, 0.99), st.floats(0.3, 5), st.floats(-math.pi, math.pi), st.floats(0.1, 2.0),
    st.floats(-3, 3),
)  # fmt: skip
def test_any_encounter_on_its_approach_is_the_head_on_one(ahead, share, speed, course, tau, climb):
    # Turned about the vertical (after 5.38) and whatever the vertical velocity, only the time left counts.
    along = np.array([math.cos(course), math.sin(course), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    height = D * math.sqrt(1.0 - share**2)
    found = encounter_stability(
        -ahead * along + share * D * across - [0, 0, height], [*(speed * along[:2]), climb], D, tau
    )
    t_star = ahead / speed
    assert found.vertical_velocity == pytest.approx(0.0, abs=1e-5)
    assert found.gains.position[2] == pytest.approx(-1.0 / t_star, rel=1e-5)
    for law in LAWS:
        assert found.largest_stable_delay[law] == pytest.approx(largest_stable_delay(t_star, tau, law), rel=1e-5)
        # Multiple zeros are found badly; the characteristic polynomial is not.
        others = np.concatenate([found.eigenvalues[law], np.zeros(8)])
        np.testing.assert_allclose(np.poly(full_matrix(found.gains, tau, law)), np.poly(others), atol=1e-5 / tau**2)


@given(st.floats(-40, 40), st.floats(-40, 40), st.floats(-40, 40), st.floats(-5, 5), st.floats(0.3, 5))
def test_the_gains_are_those_of_the_miss_and_the_time_left(x, y, z, vx, vy):
    p, v = np.array([x, y, z]), np.array([vx, vy, 0.0])
    v[2] = tangent_velocity(p, v, D)
    assume(math.isfinite(v[2]))
    t_star = -float(p @ v) / float(v @ v)
    miss = p + v * t_star
    assume(abs(miss[2]) > 0.3 and abs(t_star) > 0.05 and abs(math.hypot(x, y) - D) > 0.1)
    gains = tangent_gains(p, v, D)
    np.testing.assert_allclose(gains.position, -miss / (miss[2] * t_star), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(gains.velocity, -miss[:2] / miss[2], rtol=1e-4, atol=1e-6)


def test_beyond_the_sphere_no_delay_is_stable():
    found = encounter_stability([-30.0, 0.0, -D], [-5.0, 0.0, 0.0], D, TAU)
    assert set(found.largest_stable_delay.values()) == {0.0}
