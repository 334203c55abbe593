"""The scores of one instant against the definitions of separation and volumes."""

import numpy as np
import pytest

from tests.naive import conflict as naive
from wideberth.conflict.well_clear import PRESETS
from wideberth.evaluation import score_kernels as kernels

VOLUMES = np.array([(v.dthr, v.zthr, v.tthr, v.tcoa) for v in PRESETS.values()])


def scored(own: np.ndarray, states: np.ndarray, miss_filter: bool) -> tuple[int, np.ndarray, np.ndarray]:
    measures, inside = np.empty((len(states), kernels.N_MEASURES)), np.empty((len(states), len(VOLUMES)), np.bool_)
    count = kernels.score_states(
        own[:3].copy(),
        own[3:].copy(),
        states[:, :3].copy(),
        states[:, 3:].copy(),
        150.0,
        30.0,
        VOLUMES,
        miss_filter,
        measures,
        inside,
    )
    return count, measures, inside


@pytest.mark.parametrize("miss_filter", [False, True])
def test_agrees_with_the_definitions(miss_filter: bool) -> None:
    rng = np.random.default_rng(1)
    own = np.array([100.0, -50.0, -200.0, 30.0, 5.0, 1.0])
    states = own + rng.normal(size=(400, 6)) * [1500.0, 1500.0, 120.0, 40.0, 40.0, 3.0]
    states[:100, :3] = own[:3] + 0.1 * (states[:100, :3] - own[:3])
    count, measures, inside = scored(own, states, miss_filter)
    relative = states - own
    horizontal, vertical = np.hypot(relative[:, 0], relative[:, 1]), np.abs(relative[:, 2])
    assert np.allclose(measures[:, kernels.HORIZONTAL], horizontal)
    assert np.allclose(measures[:, kernels.VERTICAL], vertical)
    assert np.allclose(measures[:, kernels.LARGER], np.maximum(horizontal / 150.0, vertical / 30.0))
    assert np.allclose(measures[:, kernels.SMALLER], np.minimum(horizontal / 150.0, vertical / 30.0))
    for j, volume in enumerate(VOLUMES):
        expected = naive.inside(relative[:, :3], relative[:, 3:], tuple(volume), miss_filter)
        assert np.array_equal(inside[:, j], expected)
    assert count == inside.sum()
    assert inside.any(axis=0).all()


def test_states_that_are_not_finite_are_not_measured() -> None:
    own = np.zeros(6)
    states = np.zeros((3, 6))
    states[0, 1], states[1, 5] = np.nan, np.inf
    count, measures, inside = scored(own, states, False)
    assert np.isnan(measures[:2]).all()
    assert np.isfinite(measures[2]).all()
    assert not inside[:2].any()
    assert count == inside[2].sum() == len(VOLUMES)
