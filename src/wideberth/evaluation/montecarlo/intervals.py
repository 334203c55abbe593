"""Confidence intervals of what a Monte Carlo counts; all two-sided, 95 % unless another level is given.

Proportions: Wilson (1927), which holds its level for few events and none. Ratios of two proportions: from independent
sets by the method of variance estimates recovery (Donner and Zou, 2012), of pairs by Bonett and Price (2006). Intruders
of one encounter share the ownship and what it does, so they are no independent trials: a design effect above 1 shrinks
the number of trials, as in the analysis of cluster samples.
"""

import math

import numpy as np
from scipy.special import bdtr, ndtri

Interval = tuple[float, float]

LEVEL = 0.95


def _normal_quantile(level: float) -> float:
    if not 0.0 < level < 1.0:
        raise ValueError(f"level must lie between 0 and 1, got {level}")
    return float(ndtri(0.5 + level / 2))


def wilson(successes: float, trials: float, *, level: float = LEVEL, design_effect: float = 1.0) -> Interval | None:
    """Return the Wilson score interval of a proportion.

    Parameters
    ----------
    successes, trials : float
    level : float
    design_effect : float
        By how much the variance exceeds that of independent trials; below 1 counts as 1.

    Returns
    -------
    (float, float) or None
        Both within [0, 1]; None without trials.

    Raises
    ------
    ValueError
        If the successes are negative or more than the trials, or the level is not between 0 and 1.
    """
    if not 0 <= successes <= trials:
        raise ValueError(f"{successes} successes in {trials} trials: give 0 <= successes <= trials")
    z = _normal_quantile(level)
    if trials == 0:
        return None
    effective = trials / max(design_effect, 1.0)
    return _wilson(successes / trials, effective, z)


def _wilson(proportion: float, trials: float, z: float) -> Interval:
    z2 = z * z
    centre = proportion + z2 / (2 * trials)
    half = z * math.sqrt(proportion * (1 - proportion) / trials + z2 / (4 * trials * trials))
    scale = 1 + z2 / trials
    # At the ends the bound is the end itself; rounding must not say otherwise.
    low = 0.0 if proportion == 0.0 else max((centre - half) / scale, 0.0)
    high = 1.0 if proportion == 1.0 else min((centre + half) / scale, 1.0)
    return low, high


def ratio_of_proportions(
    numerator: float, numerator_interval: Interval, denominator: float, denominator_interval: Interval
) -> Interval | None:
    """Return the interval of the ratio of two proportions from independent sets, from the interval of each.

    Donner and Zou, "Closed-form confidence intervals for functions of the normal mean and standard deviation",
    Statistical Methods in Medical Research 21 (2012), the method of variance estimates recovery for ratios.

    Parameters
    ----------
    numerator, denominator : float
        Estimates, not negative.
    numerator_interval, denominator_interval : (float, float)
        Of each, of the level that the result is to have.

    Returns
    -------
    (float, float) or None
        None where the denominator may be zero.
    """
    l1, u1 = numerator_interval
    l2, u2 = denominator_interval
    if l2 <= 0.0:
        return None
    product = numerator * denominator
    low = product - math.sqrt(max(product**2 - l1 * u2 * (2 * numerator - l1) * (2 * denominator - u2), 0.0))
    high = product + math.sqrt(max(product**2 - u1 * l2 * (2 * numerator - u1) * (2 * denominator - l2), 0.0))
    # Where the upper bound is twice the estimate, a bound is a limit that need not be finite.
    below, above = u2 * (2 * denominator - u2), l2 * (2 * denominator - l2)
    return (max(low / below, 0.0) if below > 0.0 else 0.0), high / above


def paired_ratio(
    both: int, first_only: int, second_only: int, *, level: float = LEVEL, design_effect: float = 1.0
) -> Interval | None:
    """Return the interval of the ratio of two proportions counted on the same pairs, such as a risk ratio.

    Bonett and Price, "Confidence intervals for a ratio of binomial proportions based on paired data", Statistics in
    Medicine 25 (2006): Wilson intervals of both, at an adjusted level. It needs no event in both.

    Parameters
    ----------
    both : int
        Trials with the event both times.
    first_only, second_only : int
        Trials with the event only in the numerator, only in the denominator.
    level : float
    design_effect : float
        By how much the variance exceeds that of independent pairs; below 1 counts as 1.

    Returns
    -------
    (float, float) or None
        None where the denominator has no event.

    Raises
    ------
    ValueError
        If a count is negative, or the level is not between 0 and 1.
    """
    if min(both, first_only, second_only) < 0:
        raise ValueError(f"counts must not be negative, got {both}, {first_only}, {second_only}")
    z = _normal_quantile(level) * math.sqrt(max(design_effect, 1.0))
    first, second, trials = both + first_only, both + second_only, both + first_only + second_only
    if second == 0:
        return None
    spread = math.sqrt((first_only + second_only + 2) / ((first + 1) * (second + 1)))
    sides = math.sqrt((1 - (first + 1) / (trials + 2)) / (first + 1)) + math.sqrt(
        (1 - (second + 1) / (trials + 2)) / (second + 1)
    )
    z *= spread / sides
    l1, u1 = _wilson(first / trials, trials, z)
    l2, u2 = _wilson(second / trials, trials, z)
    return l1 / u2, u1 / l2


def mean(average: float, deviation: float, count: int, *, level: float = LEVEL) -> Interval | None:
    """Return the normal interval of a mean of many values; None for fewer than two.

    Parameters
    ----------
    average, deviation : float
        Mean and standard deviation of the values.
    count : int
    level : float
    """
    if count < 2:
        return None
    half = _normal_quantile(level) * deviation / math.sqrt(count)
    return average - half, average + half


def quantile_ranks(count: int, q: float, *, level: float = LEVEL) -> tuple[int, int] | None:
    """Return the ranks (from 1) of the ordered values that enclose a quantile: no assumption on the distribution.

    Parameters
    ----------
    count : int
        Number of values.
    q : float
        Between 0 and 1.
    level : float
        At least this is reached.

    Returns
    -------
    (int, int) or None
        None where so few values cannot enclose it.
    """
    _normal_quantile(level)
    tail = (1 - level) / 2
    if count < 1:
        return None
    # The quantile is at least the value of rank r where at least r values lie below it: a binomial count.
    spread = 10 * math.sqrt(count * q * (1 - q)) + 10
    ranks = np.arange(max(0, int(count * q - spread)), min(count, int(count * q + spread) + 1) + 1)
    below = bdtr(ranks, count, q)  # P(count of values below the quantile <= rank)
    fits_low = ranks[np.concatenate([[0.0 if ranks[0] == 0 else np.nan], below[:-1]]) <= tail]
    fits_high = ranks[below >= 1 - tail] + 1
    low = int(fits_low[-1]) if fits_low.size else 0
    high = int(fits_high[0]) if fits_high.size else count + 1
    return (low, high) if low >= 1 and high <= count else None


def design_effect(clusters: int, y: float, x: float, yy: float, yx: float, xx: float) -> float:
    """Return by how much clusters widen the variance of a proportion.

    Parameters
    ----------
    clusters : int
    y, x, yy, yx, xx : float
        Sums over the clusters: of events, of trials, and of their squares and product.

    Returns
    -------
    float
        1 where all or no trials are events, or there are fewer than two clusters.
    """
    if clusters < 2 or x <= 0 or not 0 < y < x:
        return 1.0
    p = y / x
    # The variance of a ratio of totals, linearised; x p (1 - p) is that of as many independent trials.
    clustered = (yy - 2 * p * yx + p * p * xx) * clusters / (clusters - 1)
    return clustered / (x * p * (1 - p))
