"""Turns advised by TCAS III: against flights in small steps, and two units together."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wideberth.conflict.tcas import Passing, Sense, TcasThreeUnit, TcasUnit, Turn, sensitivity_level
from wideberth.conflict.tcas.alerts import TcasAlert, geometry
from wideberth.conflict.tcas.horizontal import LARGEST_TURN, TURN_RATE, choose_turn, turned_miss

OWN = np.array([0.0, 0, -2000, 100.0, 0, 0])


def flown(own: Any, other: Any, turn: float, delay: float) -> tuple[float, float]:
    """Least horizontal distance of a turn flown in small steps, and on which side the other is then."""
    x, y, course, dt = own[:2].copy(), other[:2].copy(), math.atan2(own[4], own[3]), 0.01
    speed, turned, best = math.hypot(own[3], own[4]), 0.0, (math.inf, 0.0)
    for k in range(9000):
        if k * dt >= delay and turned < LARGEST_TURN:
            turned += TURN_RATE * dt
            course += turn * TURN_RATE * dt
        v = speed * np.array([math.cos(course), math.sin(course)])
        to, relative = y - x, v - other[3:5]
        if np.hypot(*to) < best[0]:
            best = float(np.hypot(*to)), float(relative[0] * to[1] - relative[1] * to[0])
        x, y = x + v * dt, y + other[3:5] * dt
    return best


@pytest.mark.parametrize("turn", list(Turn))
@pytest.mark.parametrize("seed", range(4))
def test_the_turned_miss_is_that_of_the_flight(turn: Turn, seed: int) -> None:
    random = np.random.default_rng(seed)
    course = random.uniform(0, 2 * math.pi)
    other = np.array([3500.0, random.uniform(-900, 900), -2000, 90 * math.cos(course), 90 * math.sin(course), 0.0])
    miss, side = turned_miss(OWN, other, turn, 5.0)
    distance, across = flown(OWN, other, turn, 5.0)
    # Within what two aircraft do in half a step, and the steps of the turn.
    assert miss == pytest.approx(distance, abs=30.0)
    if distance > 200.0 and abs(across) > 0.1 * distance * 100.0:
        assert side == (1 if across > 0 else -1)


def test_head_on_any_turn_does_and_what_was_said_decides() -> None:
    other = np.array([6000.0, 0, -2000, -100.0, 0, 0])
    chosen = choose_turn(OWN, other, 1000.0, 5.0)
    assert chosen is not None and chosen[0] is Turn.RIGHT and chosen[1] is Passing.LEFT
    assert choose_turn(OWN, other, 1000.0, 5.0, Passing.RIGHT) == (Turn.LEFT, Passing.RIGHT)
    # Wide enough already, or too late for a turn to gain anything.
    assert choose_turn(OWN, np.array([6000.0, 1500, -2000, -100, 0, 0]), 1000.0, 5.0) is None
    assert choose_turn(OWN, np.array([900.0, 0, -2000, -100.0, 0, 0]), 1000.0, 5.0) is None


@given(st.floats(0, 2 * math.pi), st.floats(-800, 800), st.floats(25, 60))
def test_an_advised_turn_gains_distance(course: float, aside: float, seconds: float) -> None:
    v = 100 * np.array([math.cos(course), math.sin(course)])
    relative = v - OWN[3:5]
    assume(np.hypot(*relative) > 40)
    place = OWN[:2] - relative * seconds + aside * np.array([-relative[1], relative[0]]) / np.hypot(*relative)
    other = np.array([*place, -2000.0, *v, 0.0])
    chosen = choose_turn(OWN, other, 1000.0, 5.0)
    if chosen is not None:
        straight = geometry(OWN[:3], OWN[3:], other[:3], other[3:]).miss
        assert turned_miss(OWN, other, chosen[0], 5.0)[0] > straight + 40.0


def encounter(units: tuple[TcasThreeUnit, TcasThreeUnit], lag: int) -> Any:
    """Both pilots fly what is advised: the least horizontal distance, and what was said."""
    states = [np.array([0.0, 0, -2000, 100.0, 0, 0.0]), np.array([6500.0, 60.0, -1980, -100.0, 0, 0.0])]
    row, least = sensitivity_level(2000.0), math.inf
    said: list[Any] = []
    for k in range(600):
        t = k * 0.1
        if k % 10 == 0:
            heard = said[-1 - lag] if len(said) > lag else ((None, None), (None, None))
            for i, unit in enumerate(units):
                sense, passing = heard[1 - i]
                unit.step(
                    t, states[i], states[1 - i], row, other_sense=sense, other_passing=passing,
                    other_address=units[1 - i].vertical.address,
                )  # fmt: skip
            said.append(tuple((unit.vertical.sense, unit.passing) for unit in units))
        for state, unit in zip(states, units, strict=True):
            advisory = unit.vertical.advisory
            if advisory is not None and t - advisory.issued >= 5.0:
                missing = advisory.advisory.complied(-state[5]) + state[5]
                state[5] -= np.clip(missing, -0.25, 0.25)
            if unit.turn is not None and t - unit.turn.issued >= 5.0:
                angle = unit.turn.turn * TURN_RATE * 0.1
                v = state[3:5].copy()
                state[3] = v[0] * math.cos(angle) - v[1] * math.sin(angle)
                state[4] = v[0] * math.sin(angle) + v[1] * math.cos(angle)
            state[:3] += state[3:] * 0.1
        least = min(least, float(np.hypot(*(states[0] - states[1])[:2])))
    return least, said


@pytest.mark.parametrize("lag", [0, 2])
@pytest.mark.parametrize("addresses", [(1, 2), (2, 1)])
def test_two_units_turn_to_the_same_side_and_pass_wide(lag: int, addresses: tuple[int, int]) -> None:
    units = TcasThreeUnit(addresses[0]), TcasThreeUnit(addresses[1])
    for unit in units:
        unit.vertical = _Weak(unit.vertical.address)
    least, said = encounter(units, lag)
    turns = [(a[1], b[1]) for a, b in said if a[1] is not None and b[1] is not None]
    assert turns and turns[-1][0] is turns[-1][1]
    assert least > 500.0
    assert all(unit.turn is None and unit.vertical.alert is TcasAlert.NONE for unit in units)


class _Weak(TcasUnit):
    """A unit whose aircraft cannot climb or sink: its advisory is the weakest there is."""

    def step(self, t: float, g: Any, own_rate: float, thresholds: Any, *others: Any) -> Any:
        advisory = super().step(t, g, own_rate, thresholds, *others)
        if advisory is not None:
            weakest = {Sense.UP: "LIMIT_DESCENT_2000", Sense.DOWN: "LIMIT_CLIMB_2000"}[advisory.advisory.sense]
            self.advisory = type(advisory)(type(advisory.advisory)[weakest], advisory.issued)
        return self.advisory


def test_where_climbing_suffices_nobody_is_turned() -> None:
    units = TcasThreeUnit(1), TcasThreeUnit(2)
    _, said = encounter(units, 0)
    assert any(a[0] is not None for a, _ in said)
    assert all(unit.turn_advisories == 0 for unit in units)


def test_states_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="six numbers"):
        TcasThreeUnit().step(0.0, OWN[:3], OWN, sensitivity_level(2000.0))
    with pytest.raises(ValueError, match="intruder must be finite"):
        choose_turn(OWN, OWN * np.nan, 1000.0, 5.0)
