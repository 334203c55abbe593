"""The vertical planners against intruders in straight flight: clear, on one side, between floor and ceiling."""

from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.made_vertical_runs import encounter, fly
from wideberth.avoidance.vertical.planner import BangBangPlanner, ContinuousPlanner

BOTH = pytest.mark.parametrize("kind", [BangBangPlanner, ContinuousPlanner])
EXAMPLES = 1 if vars(numba.config)["DISABLE_JIT"] else 6


@BOTH
@settings(max_examples=EXAMPLES)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["head_on", "crossing", "overtaking"]),
    st.sampled_from(["all_at_once", "most_critical"]),
    st.sampled_from([{}, {"altitude_min_m": 190.0}, {"altitude_max_m": 215.0}, {"zone": "sphere", "separation_m": 50}]),
)
def test_one_intruder_is_passed_on_one_side_with_one_maneuver(
    kind: Any, seed: int, encounter_kind: str, several: str, limits: dict[str, Any]
) -> None:
    start, velocity = encounter(np.random.default_rng(seed), encounter_kind)
    flown = fly(kind, [(start, velocity)], several=several, **limits)
    assert flown.done
    assert flown.least >= 1.0
    assert len(flown.maneuvers) <= 1 and flown.counters["reversed"] == 0
    assert flown.lowest >= limits.get("altitude_min_m", 50.0)
    assert flown.highest <= limits.get("altitude_max_m", 3000.0)
    # It leaves the mission's altitude to one side only, but for the last metre of the return.
    assert flown.lowest > 198.5 or flown.highest < 201.5
    assert abs(flown.places[-1, 2] + 200.0) < 2.0


@BOTH
@settings(max_examples=EXAMPLES // 2 + 1)
@given(st.integers(0, 2**32 - 1), st.integers(2, 3))
def test_several_are_passed_all_at_once(kind: Any, seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    intruders = [encounter(rng, str(rng.choice(["head_on", "crossing"]))) for _ in range(n)]
    flown = fly(kind, intruders)
    assert flown.least >= 1.0 or flown.counters["least_bad"] > 0
    assert len(flown.maneuvers) <= 4 and flown.done
