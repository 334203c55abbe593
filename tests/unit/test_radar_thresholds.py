"""Thresholds have the false alarm probability that is set: by their formulas, and drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tests.naive import radar_processing as naive
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.detection import threshold
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.processing.thresholds import (
    cell_averaging_level,
    exponential_multiplier,
    false_alarm_probabilities,
    gamma_multiplier,
    ordered_false_alarm_probability,
    ordered_level,
    ordered_multiplier,
    per_cell,
    reference_cells,
)

CELLS = 1_000_000


def agrees(exceeded: np.ndarray, p: float) -> bool:
    """Within 4 sigma of what so many independent cells have; below 10 % at a thousandth of a million."""
    return bool(abs(exceeded.mean() - p) < 4.0 * np.sqrt(p / exceeded.size))


@pytest.mark.parametrize("p", [1e-2, 1e-3])
def test_printed_threshold_holds_for_one_exponential_cell(p: float) -> None:
    rng = np.random.default_rng(1)
    power = rng.exponential(3.0, CELLS)
    known = rng.exponential(3.0, 100_000).mean()
    assert agrees(power > 3.0 * exponential_multiplier(p), p)
    assert agrees(power > known * exponential_multiplier(p, 100_000), p)


@pytest.mark.parametrize("p", [1e-2, 1e-3])
@pytest.mark.parametrize("looks", [4, 128])
def test_gamma_threshold_holds_for_averaged_cells_where_the_printed_one_finds_nothing(p: float, looks: int) -> None:
    rng = np.random.default_rng(2)
    power = rng.gamma(looks, 1.0 / looks, CELLS)
    assert agrees(power > gamma_multiplier(p, looks), p)
    assert np.mean(power > exponential_multiplier(p)) < 0.01 * p


@pytest.mark.parametrize("looks", [1, 128])
def test_thresholds_of_a_short_noise_run_are_exact_over_many_runs(looks: int) -> None:
    rng, m = np.random.default_rng(3), 30
    power = rng.gamma(looks, 1.0 / looks, CELLS)
    noise = rng.gamma(m, 1.0 / m, CELLS)
    assert agrees(power > noise * gamma_multiplier(1e-2, looks, m), 1e-2)
    assert np.mean(power > noise * gamma_multiplier(1e-2, looks)) > 1.2e-2
    if looks == 1:
        assert agrees(power > noise * exponential_multiplier(1e-2, m), 1e-2)


def test_formulas_agree_where_they_mean_the_same() -> None:
    p = np.array([0.1, 1e-2, 1e-6])
    np.testing.assert_allclose(gamma_multiplier(p, 1), exponential_multiplier(p), rtol=1e-9)
    np.testing.assert_allclose(gamma_multiplier(p, 1, 20), exponential_multiplier(p, 20), rtol=1e-9)
    np.testing.assert_allclose(gamma_multiplier(p, 128), threshold(p, 128), rtol=1e-12)
    np.testing.assert_allclose(gamma_multiplier(p, 128, 1e9), gamma_multiplier(p, 128), rtol=1e-5)
    assert per_cell(0.19, 2) == pytest.approx(0.1)
    np.testing.assert_allclose(1.0 - (1.0 - per_cell(p, 640)) ** 640, p, rtol=1e-7)


def test_a_tenth_of_a_decibel_doubles_the_false_alarms() -> None:
    level = 10.0**0.01
    exceeded = stats.gamma.sf(gamma_multiplier(1e-2, 128) / level * 128, 128)
    assert exceeded == pytest.approx(2e-2, rel=0.05)


@pytest.mark.parametrize(("cells", "rank"), [(32, 24), (8, 8), (16, 1)])
@pytest.mark.parametrize("multiplier", [0.5, 3.0, 20.0])
def test_ordered_statistic_of_single_powers_is_rohlings_product(cells: int, rank: int, multiplier: float) -> None:
    i = np.arange(rank)
    expected = np.prod((cells - i) / (cells - i + multiplier))
    assert ordered_false_alarm_probability(multiplier, 1, 1, cells, rank) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(("looks", "cell_looks"), [(1.0, 1.0), (4.0, 4.0), (128.0, 128.0), (4.0, 32.0)])
@pytest.mark.parametrize("p", [1e-1, 1e-3, 1e-8])
def test_ordered_multiplier_inverts(looks: float, cell_looks: float, p: float) -> None:
    multiplier = ordered_multiplier(p, looks, cell_looks, 32, 24)
    assert ordered_false_alarm_probability(multiplier, looks, cell_looks, 32, 24) == pytest.approx(p, rel=1e-5)


def test_cfar_thresholds_hold_for_averaged_cells() -> None:
    rng, looks = np.random.default_rng(4), 16
    power = rng.gamma(looks, 5.0 / looks, 200_000)
    around = np.arange(0, len(power) - 40)[:, None] + np.r_[0:16, 23:39]
    tested = power[19 : 19 + len(around)]
    averaged = cell_averaging_level(power, around) * gamma_multiplier(1e-2, looks, 32 * looks)
    ordered = ordered_level(power, around, 24) * ordered_multiplier(1e-2, looks, looks, 32, 24)
    # Cells share those around them, which spreads the rate over what independent ones have.
    assert np.mean(tested > averaged) == pytest.approx(1e-2, rel=0.1)
    assert np.mean(tested > ordered) == pytest.approx(1e-2, rel=0.1)


@given(
    first=st.integers(0, 5),
    extra=st.integers(0, 30),
    cells=st.integers(1, 8),
    guard=st.integers(0, 4),
    step=st.integers(1, 2),
)
def test_reference_cells_are_those_of_the_naive_twin(first: int, extra: int, cells: int, guard: int, step: int) -> None:
    last = first + 2 * guard + 1 + (2 * cells + 1) * step + extra
    found = reference_cells(first, last, cells, guard, step)
    assert found.shape == (last - first, 2 * cells)
    for row, i in zip(found, range(first, last), strict=True):
        assert sorted(row) == sorted(naive.cfar_cells(i, first, last, cells, guard, step))
        assert row.min() >= first and row.max() < last and np.abs(row - i).min() > guard


def test_too_few_bins_for_a_cfar_are_refused() -> None:
    with pytest.raises(ValueError, match="too few"):
        reference_cells(0, 20, 16, 2, 1)


def test_quadratic_law_runs_from_near_to_far() -> None:
    law = ProcessingConfig(false_alarm_probability_near=0.03, false_alarm_probability_far=0.15)
    p = false_alarm_probabilities(RadarConfig(processing=law))
    assert p[0] == pytest.approx(0.03) and p[-1] == pytest.approx(0.15)
    assert np.all(np.diff(p) > 0.0) and np.all(np.diff(p, 2) < 0.0)
    assert p[1024] == pytest.approx(0.15 - 0.12 * (1023 / 2047) ** 2)
    assert np.all(false_alarm_probabilities(RadarConfig()) == 0.01)
    with pytest.raises(ValueError, match="need each other"):
        ProcessingConfig(false_alarm_probability_near=0.03)


@pytest.mark.parametrize(
    "call",
    [
        lambda: gamma_multiplier(0.0, 4),
        lambda: gamma_multiplier(0.1, 0),
        lambda: gamma_multiplier(np.nan, 4),
        lambda: exponential_multiplier(1.0),
        lambda: exponential_multiplier(0.1, -1.0),
        lambda: ordered_multiplier(0.1, 1.0, 1.0, 8, 9),
        lambda: ordered_multiplier(0.1, 0.0, 1.0, 8, 2),
        lambda: per_cell(2.0, 2),
    ],
)
def test_impossible_arguments_are_refused(call) -> None:
    with pytest.raises(ValueError):
        call()
