"""Grouping, peak picking, the parabola and the printed range correction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.naive import radar_processing as naive
from wideberth.sensors.radar.processing.peak_detection import adjacent_groups, group_peaks
from wideberth.sensors.radar.processing.peak_interpolation import RangeSpread, fit_range_spread, parabola_offset


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 4)), min_size=1, max_size=40), st.integers(1, 4))
def test_groups_and_peaks_are_those_of_the_naive_twin(bins: list[tuple[bool, int]], minimum: int) -> None:
    detected = np.array([over for over, _ in bins])
    power = np.array([float(value) for _, value in bins])
    groups = adjacent_groups(detected, minimum)
    expected = naive.groups(list(detected), minimum)
    assert list(zip(groups.first, groups.last, strict=True)) == expected
    assert groups.too_small == len(naive.groups(list(detected), 1)) - len(expected)
    assert list(group_peaks(power, groups)) == naive.peaks(list(power), expected)


def test_two_targets_near_each_other_are_two_peaks_and_a_single_bin_is_none() -> None:
    power = np.array([0.0, 9.0, 0.0, 4.0, 8.0, 3.0, 6.0, 5.0, 0.0])
    groups = adjacent_groups(power > 2.0, 2)
    assert groups.first == [3] and groups.last == [7] and groups.too_small == 1
    assert list(group_peaks(power, groups)) == [4, 6]


@given(st.floats(-0.5, 0.5), st.floats(0.1, 1e3), st.floats(-1e3, 1e3))
def test_parabola_finds_its_top(top: float, bend: float, height: float) -> None:
    left, center, right = (height - bend * (x - top) ** 2 for x in (-1.0, 0.0, 1.0))
    assert parabola_offset(left, center, right) == pytest.approx(top, abs=1e-9)


def test_parabola_of_a_line_or_of_no_peak_stays_at_the_bin() -> None:
    np.testing.assert_array_equal(parabola_offset([1.0, 1.0, 3.0], [1.0, 2.0, 1.0], [1.0, 3.0, 3.0]), 0.0)
    with pytest.raises(ValueError, match="right must be finite"):
        parabola_offset(1.0, 2.0, np.nan)


@given(st.floats(-0.5, 0.5), st.floats(0.1, 30.0), st.floats(0.2, 3.0))
def test_correction_keeps_sign_order_and_the_bin(offset: float, rate: float, alpha: float) -> None:
    spread = RangeSpread(rate, alpha, alpha)
    found = float(spread(offset))
    assert abs(found) <= 0.5 and found * offset >= 0.0
    assert float(spread(-offset)) == -found
    assert abs(float(spread(0.9 * offset))) <= abs(found)


def test_printed_correction_spreads_the_printed_distribution_evenly() -> None:
    rng = np.random.default_rng(1)
    beta = rng.beta(0.6, 0.6, 20_000)
    offsets = -np.log1p(-beta) / 9.18 * rng.choice([-1.0, 1.0], 20_000)
    corrected = np.sort(RangeSpread()(offsets))
    even = (np.arange(20_000) + 0.5) / 20_000 - 0.5
    assert np.abs(corrected - even).max() < 1.63 / np.sqrt(20_000)  # Kolmogorov and Smirnov, 1 %


def test_parameters_are_fitted_to_offsets_of_an_even_motion() -> None:
    true = np.random.default_rng(2).uniform(-0.5, 0.5, 1300)
    magnitude = [np.abs(np.sinc(shift - true)) for shift in (-1.0, 0.0, 1.0)]
    offsets = parabola_offset(*magnitude)
    fitted = fit_range_spread(offsets)
    before, after = np.std(offsets - true), np.std(fitted(offsets) - true)
    assert after < 0.5 * before
    assert np.mean(np.abs(fitted(offsets)) > 0.25) == pytest.approx(0.5, abs=0.08)


@pytest.mark.parametrize(("offsets", "words"), [(np.ones(20), "50 or more"), (np.zeros(60), "nothing to fit")])
def test_too_little_to_fit_is_refused(offsets: np.ndarray, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        fit_range_spread(offsets)


def test_impossible_corrections_are_refused() -> None:
    with pytest.raises(ValueError, match="rate, alpha and beta"):
        RangeSpread(rate=0.0)
