"""Describing functions, and the limit cycles that they predict against flights."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wideberth.analysis.describing_functions import (
    command_response,
    exact_switching_limit_cycle,
    relay_gain,
    saturation_gain,
    saturation_limit_cycle,
    switching_limit_cycle,
    window_gain,
)
from wideberth.analysis.limit_cycle_flights import measured, saturation_flight, switching_flight
from wideberth.analysis.stability import largest_stable_delay

LIMIT = 0.6


def harmonic(outputs: np.ndarray) -> complex:
    """Return the first harmonic of one period, as a gain on a sine of amplitude one."""
    angles = 2 * np.pi * (np.arange(len(outputs)) + 0.5) / len(outputs)
    return complex(2 * np.mean(outputs * np.sin(angles)), 2 * np.mean(outputs * np.cos(angles)))


@given(st.floats(0.2, 20.0), st.floats(0.1, 3.0), st.floats(0.05, 2.0))
def test_gains_are_the_first_harmonic(amplitude: float, level: float, width: float) -> None:
    n = 20000
    x = amplitude * np.sin(2 * np.pi * (np.arange(n) + 0.5) / n)
    assert saturation_gain(amplitude, level) == pytest.approx(
        harmonic(np.clip(x, -level, level)).real / amplitude, abs=1e-3
    )
    window = np.where(np.abs(x) < width, level * np.sign(x), 0.0)
    assert window_gain(amplitude, level, width) == pytest.approx(
        harmonic(window).real / amplitude, abs=2e-3 * level / amplitude
    )
    if amplitude <= width:
        assert relay_gain(amplitude, level, width) == 0.0
        return
    state, out = -level, np.empty(2 * n)
    for k, value in enumerate(np.tile(x, 2)):
        if value > width:
            state = level
        elif value < -width:
            state = -level
        out[k] = state
    got = harmonic(out[n:]) / amplitude
    assert abs(relay_gain(amplitude, level, width) - got) < 2e-2 * level / amplitude


@pytest.mark.parametrize("t_star", [0.5, 1.0, 2.0, 5.0])
def test_the_loop_is_at_its_limit_at_the_largest_stable_delay(t_star: float) -> None:
    delay = float(largest_stable_delay(t_star, 0.4))
    w = math.sqrt(2.0 / (0.4 * t_star))
    assert command_response(w, t_star, 0.4, delay) == pytest.approx(1.0, abs=1e-9)
    assert saturation_limit_cycle(t_star, 0.4, 0.98 * delay, LIMIT) is None
    just = saturation_limit_cycle(t_star, 0.4, 1.02 * delay, LIMIT)
    assert just is not None and just.frequency == pytest.approx(w, rel=0.05)


@pytest.mark.parametrize("t_star", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("share", [1.1, 1.3, 1.6])
def test_limited_commands_end_in_the_cycle_that_is_predicted(t_star: float, share: float) -> None:
    delay = share * float(largest_stable_delay(t_star, 0.4))
    predicted = saturation_limit_cycle(t_star, 0.4, delay, LIMIT)
    flown = measured(*saturation_flight(t_star, 0.4, delay, LIMIT, duration=120.0))
    assert predicted is not None and flown is not None
    assert flown.amplitude == pytest.approx(predicted.amplitude, rel=0.06)
    assert flown.frequency == pytest.approx(predicted.frequency, rel=0.02)


def test_below_the_limit_the_oscillation_dies() -> None:
    delay = 0.8 * float(largest_stable_delay(1.0, 0.4))
    assert measured(*saturation_flight(1.0, 0.4, delay, LIMIT, duration=120.0), 1e-3) is None


@pytest.mark.parametrize(
    ("t_star", "hysteresis", "delay"), [(5, 0.3, 0), (2, 1.2, 0), (5, 0, 0.5), (2, 0.3, 1.0), (0.3, 0.1, 0)]
)
def test_the_switch_ends_in_the_exact_cycle(t_star: float, hysteresis: float, delay: float) -> None:
    exact = exact_switching_limit_cycle(t_star, 0.4, LIMIT, hysteresis, delay)
    flown = measured(*switching_flight(t_star, 0.4, LIMIT, hysteresis, delay))
    assert exact is not None and flown is not None
    assert flown == pytest.approx(exact, rel=0.01)
    first = switching_limit_cycle(t_star, 0.4, LIMIT, hysteresis, delay)
    if delay == 0 and t_star > 0.4:
        assert first is None
    elif first is not None:
        # The first harmonic alone is as good as this, no better.
        assert first.frequency == pytest.approx(exact.frequency, rel=0.2)
        assert first.amplitude == pytest.approx(exact.amplitude, rel=0.25)


def test_what_has_no_cycle_is_said() -> None:
    assert exact_switching_limit_cycle(2.0, 0.4, LIMIT, 0.0, 0.0) is None
    with pytest.raises(ValueError, match="no period"):
        switching_flight(2.0, 0.4, LIMIT, 0.0, 0.0)
    with pytest.raises(ValueError, match="t_star"):
        saturation_limit_cycle(0.0, 0.4, 1.0, LIMIT)
    with pytest.raises(ValueError, match="hysteresis"):
        switching_limit_cycle(2.0, 0.4, LIMIT, -1.0, 0.0)


def test_the_side_switch_settles_on_one_side() -> None:
    # Relay d sgn(miss) about zero: a positive feedback, so that the miss goes to +d or -d and stays.
    d, t_star, tau, dt = 3.66, 5.0, 0.4, 0.01
    for start in (0.01, -0.01):
        z, w = start, 0.0
        for _ in range(6000):
            command = (d * np.sign(z) - z) / t_star
            w += (command - w) / tau * dt
            z += w * dt
        assert z == pytest.approx(math.copysign(d, start), abs=0.01)
