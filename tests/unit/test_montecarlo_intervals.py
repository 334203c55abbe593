"""Intervals: equal to an independent implementation, and they hold what they promise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from wideberth.evaluation.montecarlo import intervals
from wideberth.evaluation.montecarlo.histograms import PairedTally, RatioTally

counts = st.integers(0, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(counts, st.sampled_from([0.8, 0.95, 0.99]))
def test_wilson_is_scipys(count, level):
    successes, trials = count
    if trials == 0:
        assert intervals.wilson(0, 0, level=level) is None
        return
    found = intervals.wilson(successes, trials, level=level)
    expected = stats.binomtest(successes, trials).proportion_ci(confidence_level=level, method="wilson")
    assert found == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert 0.0 <= found[0] <= successes / trials <= found[1] <= 1.0


def test_a_design_effect_is_that_many_fewer_trials():
    assert intervals.wilson(30, 400, design_effect=4.0) == pytest.approx(intervals.wilson(7.5, 100))
    assert intervals.wilson(30, 400, design_effect=0.2) == intervals.wilson(30, 400)


@pytest.mark.parametrize(("successes", "trials"), [(-1, 10), (11, 10)])
def test_wilson_refuses_impossible_counts(successes, trials):
    with pytest.raises(ValueError, match="0 <= successes <= trials"):
        intervals.wilson(successes, trials)


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, math.nan])
def test_levels_lie_between_0_and_1(level):
    for call in (
        lambda: intervals.wilson(1, 2, level=level),
        lambda: intervals.paired_ratio(1, 1, 1, level=level),
        lambda: intervals.quantile_ranks(9, 0.5, level=level),
    ):
        with pytest.raises(ValueError, match="level"):
            call()


def bonett_price(both, first_only, second_only, z):
    """The same interval by the quadratic that Wilson's bounds solve."""
    n, first, second = both + first_only + second_only, both + first_only, both + second_only
    a = math.sqrt((first_only + second_only + 2) / ((first + 1) * (second + 1)))
    b = math.sqrt((1 - (first + 1) / (n + 2)) / (first + 1))
    c = math.sqrt((1 - (second + 1) / (n + 2)) / (second + 1))
    z *= a / (b + c)

    def roots(x):
        return sorted(np.roots([n + z * z, -(2 * x + z * z), x * x / n]).real)

    (l1, u1), (l2, u2) = roots(first), roots(second)
    return l1 / u2, u1 / l2


@given(st.integers(0, 40), st.integers(0, 40), st.integers(0, 40))
def test_paired_ratio_solves_its_equations(both, first_only, second_only):
    found = intervals.paired_ratio(both, first_only, second_only)
    if both + second_only == 0:
        assert found is None
        return
    expected = bonett_price(both, first_only, second_only, stats.norm.ppf(0.975))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-7)
    ratio = (both + first_only) / (both + second_only)
    assert found[0] <= ratio <= found[1]
    # Without any event in the numerator there is an upper bound, and it is finite.
    if both + first_only == 0:
        assert found[0] == 0.0 and 0.0 < found[1] < math.inf
    elif both + first_only > 0:
        other = intervals.paired_ratio(both, second_only, first_only)
        assert other == pytest.approx((1 / found[1], 1 / found[0] if found[0] else math.inf), rel=1e-9)


def test_paired_ratio_of_a_worked_example():
    # Airway hyper-responsiveness before and after transplantation: 1, 1, 7 of 21 (Bentur et al., 2009).
    assert intervals.paired_ratio(1, 1, 7) == pytest.approx((0.0677, 0.9227), abs=1e-4)


def test_paired_ratio_refuses_negative_counts():
    with pytest.raises(ValueError, match="negative"):
        intervals.paired_ratio(1, -1, 1)


def test_paired_ratio_covers_the_truth():
    # Risk 0.02 without, a tenth of it with, and half of those in common: 95 % intervals of 2000 runs of 20,000 pairs.
    rng = np.random.default_rng(3)
    both, first_only, second_only = 0.001, 0.001, 0.019
    draws = rng.multinomial(20_000, [both, first_only, second_only, 1 - both - first_only - second_only], 2000)
    covered = 0
    for a, b, c, _ in draws.tolist():
        low, high = intervals.paired_ratio(a, b, c)
        covered += low <= 0.1 <= high
    # Nominal 1900; a test at 1e-6 that the coverage is at least 93.5 %.
    assert stats.binomtest(covered, 2000, 0.935, alternative="less").pvalue > 1e-6
    assert covered < 1990


@given(counts, counts)
def test_ratio_of_proportions_contains_the_ratio(first, second):
    (a, n), (b, m) = first, second
    if n == 0 or m == 0 or b == 0:
        return
    p, q = a / n, b / m
    found = intervals.ratio_of_proportions(p, intervals.wilson(a, n), q, intervals.wilson(b, m))
    assert found[0] <= p / q * (1 + 1e-12) and p / q <= found[1] * (1 + 1e-12)


def test_ratio_of_proportions_at_its_ends():
    # A denominator that is known leaves the interval of the numerator.
    assert intervals.ratio_of_proportions(0.1, (0.05, 0.2), 1.0, (1.0, 1.0)) == pytest.approx((0.05, 0.2))
    assert intervals.ratio_of_proportions(0.1, (0.05, 0.2), 0.01, (0.0, 0.05)) is None
    low, high = intervals.ratio_of_proportions(0.0, (0.0, 0.004), 0.98, (0.979, 0.981))
    assert low == 0.0 and 0.004 < high < 0.0042


def test_ratio_of_proportions_covers_the_truth():
    rng = np.random.default_rng(5)
    truth, n, m = 0.005 / 0.975, 1800, 30_000
    covered = 0
    for a, b in zip(rng.binomial(n, 0.005, 2000).tolist(), rng.binomial(m, 0.975, 2000).tolist(), strict=True):
        found = intervals.ratio_of_proportions(a / n, intervals.wilson(a, n), b / m, intervals.wilson(b, m))
        covered += found[0] <= truth <= found[1]
    assert stats.binomtest(covered, 2000, 0.935, alternative="less").pvalue > 1e-6
    assert covered < 1990


@pytest.mark.parametrize("q", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("count", [1, 10, 59, 73, 100, 1000, 250_000])
def test_quantile_ranks_enclose_with_the_level_and_no_wider(count, q):
    ranks = intervals.quantile_ranks(count, q)
    law = stats.binom(count, q)
    if ranks is None:
        # Not even the extremes leave at most 2.5 % on either side.
        assert law.pmf(0) > 0.025 or law.pmf(count) > 0.025
        return
    low, high = ranks
    assert law.cdf(low - 1) <= 0.025 < law.cdf(low)
    assert law.sf(high - 1) <= 0.025 < law.sf(high - 2)


def test_no_values_have_no_quantile_and_no_mean():
    assert intervals.quantile_ranks(0, 0.5) is None
    assert intervals.mean(1.0, 0.0, 1) is None
    assert intervals.mean(1.0, 2.0, 400) == pytest.approx((1 - 0.196, 1 + 0.196), abs=1e-4)


def test_clusters_that_are_all_alike_count_once():
    rng = np.random.default_rng(1)
    one = rng.random(4000) < 0.1
    tally = RatioTally()
    tally.add(np.repeat(one[:, None], 5, axis=1), np.ones((4000, 5), bool))
    s = tally
    effect = intervals.design_effect(s.clusters, s.y, s.x, s.yy, s.yx, s.xx)
    assert effect == pytest.approx(5.0, rel=1e-3)
    assert tally.clustered() == pytest.approx(intervals.wilson(one.sum(), 4000), rel=1e-3)


def test_the_clustered_variance_is_that_of_resampled_encounters():
    # Intruders of an encounter are alike; the design effect must agree with a bootstrap over encounters.
    rng = np.random.default_rng(2)
    p = rng.beta(0.5, 4.5, 1500)
    events = rng.random((1500, 3)) < p[:, None]
    trials = rng.random((1500, 3)) < 0.7
    events &= trials
    tally = RatioTally()
    tally.add(events, trials)
    effect = intervals.design_effect(tally.clusters, tally.y, tally.x, tally.yy, tally.yx, tally.xx)
    pick = rng.integers(0, 1500, (2000, 1500))
    y, x = events.sum(axis=1)[pick].sum(axis=1), trials.sum(axis=1)[pick].sum(axis=1)
    ratio = tally.ratio
    bootstrap = np.var(y / x) / (ratio * (1 - ratio) / tally.x)
    # The bootstrap's variance of 2000 resamples has a standard error of 3 %.
    assert effect == pytest.approx(bootstrap, rel=0.15)
    # Correlation 1 / 6 between intruders, 1.4 others in the mean: about 1.23.
    assert 1.1 < effect < 1.4


def test_no_or_all_events_have_no_design_effect():
    assert intervals.design_effect(10, 0, 30, 0, 0, 90) == 1.0
    assert intervals.design_effect(10, 30, 30, 90, 90, 90) == 1.0
    assert intervals.design_effect(1, 1, 3, 1, 3, 9) == 1.0


def test_a_risk_ratio_widens_where_the_intruders_of_an_encounter_are_alike():
    rng = np.random.default_rng(4)
    without = rng.random(3000) < 0.2
    avoided = without & (rng.random(3000) < 0.3)
    once, fivefold = PairedTally(), PairedTally()
    once.add(avoided[:, None], without[:, None])
    fivefold.add(np.repeat(avoided[:, None], 5, axis=1), np.repeat(without[:, None], 5, axis=1))
    assert fivefold.ratio == once.ratio
    # Five copies tell no more than one.
    assert fivefold.interval() == pytest.approx(once.interval(), rel=0.03)
    assert fivefold.trials == 5 * once.trials
