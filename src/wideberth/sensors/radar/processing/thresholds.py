"""Detection thresholds on averaged powers, as multiples of an estimate of the noise (thesis 4.4, 5.5).

With a known noise power the mean of K powers is Gamma distributed over it; over an estimate from M powers it has
Fisher's F distribution with 2 K and 2 M degrees of freedom. The printed threshold is that of K = 1.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from wideberth.argument_checks import COUNT, POSITIVE, POSITIVE_OR_INFINITE, UNSURE, FloatArray, checked
from wideberth.sensors.radar.config import RadarConfig

_NODES = 400


def false_alarm_probabilities(config: RadarConfig) -> FloatArray:
    """Return the false alarm probability that is set for each range bin (5.5).

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    ndarray, shape (range_bins,)
        `false_alarm_probability`, or the quadratic law from the near to the far one of `config.processing`.
    """
    near = config.processing.false_alarm_probability_near
    far = config.processing.false_alarm_probability_far
    bins = np.arange(config.range_bins, dtype=np.float64)
    if near is None or far is None:
        return np.full(len(bins), config.false_alarm_probability)
    return np.asarray(far - (far - near) * (bins / bins[-1] - 1.0) ** 2)


def per_cell(p_fa: ArrayLike, cells: int) -> FloatArray:
    """Return the false alarm probability of each of several cells for one of all of them together.

    Raises
    ------
    ValueError
        If a probability is not inside 0 to 1.
    """
    return np.asarray(-np.expm1(np.log1p(-checked("p_fa", p_fa, UNSURE)) / cells))


def gamma_multiplier(p_fa: ArrayLike, looks: ArrayLike, noise_samples: ArrayLike = np.inf) -> FloatArray:
    """Return the threshold on the mean of powers over the noise's mean.

    Parameters
    ----------
    p_fa : array_like
        Probability that noise alone exceeds it. The arrays broadcast.
    looks : array_like
        Independent powers in the mean under test (need not be whole).
    noise_samples : array_like
        Independent powers in the noise's mean; infinite: it is known. The false alarm probability is then that over
        many noise runs, exactly.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If a probability is not inside 0 to 1, or a number of powers not positive.
    """
    p = checked("p_fa", p_fa, UNSURE)
    k = checked("looks", looks, POSITIVE)
    m = checked("noise_samples", noise_samples, POSITIVE_OR_INFINITE)
    known = np.isinf(m)
    with_known = special.gammainccinv(k, p) / k
    return np.asarray(np.where(known, with_known, stats.f.isf(p, 2.0 * k, 2.0 * np.where(known, 1.0, m))))


def exponential_multiplier(p_fa: ArrayLike, noise_samples: ArrayLike = np.inf) -> FloatArray:
    """Return the printed threshold over the noise's mean: ln(1/P_FA) (4.4), right for a single power.

    Parameters
    ----------
    p_fa : array_like
    noise_samples : array_like
        Powers in the noise's mean: with M of them the exact threshold of a single power, M (P_FA^(-1/M) - 1). Infinite:
        as printed.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If a probability is not inside 0 to 1, or a number of powers not positive.
    """
    p = checked("p_fa", p_fa, UNSURE)
    m = checked("noise_samples", noise_samples, POSITIVE_OR_INFINITE)
    known = np.isinf(m)
    finite = np.where(known, 1.0, m)
    return np.asarray(np.where(known, -np.log(p), finite * np.expm1(-np.log(p) / finite)))


def ordered_false_alarm_probability(multiplier: float, looks: float, cell_looks: float, cells: int, rank: int) -> float:
    """Return the false alarm probability of a threshold on one of the powers around, in order.

    For single powers it is Rohling's product; for means of several the integral over the ordered power is had by
    quadrature, to 1e-9 or better.

    Parameters
    ----------
    multiplier : float
        Threshold over the ordered power.
    looks, cell_looks : float
        Independent powers in the mean under test, and in each of those around.
    cells, rank : int
        Number of powers around, and which of them, from 1, the least.

    Returns
    -------
    float
    """
    # Evenly over the logarithm of the ordered power, far into both tails, where sums converge fast.
    low = special.gammaincinv(cell_looks, special.betaincinv(rank, cells - rank + 1, 1e-18))
    high = special.gammainccinv(cell_looks, special.betaincinv(cells - rank + 1, rank, 1e-18))
    log_y, spacing = np.linspace(np.log(low), np.log(high), _NODES, retstep=True)
    y = np.exp(log_y)
    below, above = special.gammainc(cell_looks, y), special.gammaincc(cell_looks, y)
    log_density = (
        special.xlogy(rank - 1, below)
        + special.xlogy(cells - rank, above)
        - special.betaln(rank, cells - rank + 1)
        + cell_looks * log_y
        - y
        - special.gammaln(cell_looks)
    )
    exceeded = special.gammaincc(looks, multiplier * y * looks / cell_looks)
    return float(spacing * np.sum(np.exp(log_density) * exceeded))


@lru_cache(maxsize=4096)
def ordered_multiplier(p_fa: float, looks: float, cell_looks: float, cells: int, rank: int) -> float:
    """Return the threshold over one of the powers around, in order (ordered-statistic CFAR).

    Parameters
    ----------
    p_fa : float
    looks, cell_looks, cells, rank
        As for `ordered_false_alarm_probability`.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        If the probability is not inside 0 to 1, a number of powers not positive, or there is no such rank.
    """
    wanted = np.log(float(checked("p_fa", p_fa, UNSURE)))
    checked("looks", [looks, cell_looks], POSITIVE)
    if not 1 <= int(checked("rank", rank, COUNT)) <= cells:
        raise ValueError(f"rank must be from 1 to the number of cells, {cells}, got {rank}")

    def excess(log_multiplier: float) -> float:
        p = ordered_false_alarm_probability(float(np.exp(log_multiplier)), looks, cell_looks, cells, rank)
        return float(np.log(max(p, 1e-300)) - wanted)

    return float(np.exp(optimize.brentq(excess, -20.0, 40.0, xtol=1e-10)))


@lru_cache(maxsize=16)
def reference_cells(first: int, last: int, cells: int, guard: int, step: int) -> NDArray[np.intp]:
    """Return which bins each bin's CFAR threshold is formed of.

    Parameters
    ----------
    first, last : int
        Bins that are searched: `first` and those after it up to `last`, without it.
    cells, guard : int
        On each side; near an end, where there are fewer, more are taken from the other side.
    step : int
        From one to the next: 2 with the Hann window, where neighbours are correlated.

    Returns
    -------
    ndarray of int, shape (last - first, 2 cells)

    Raises
    ------
    ValueError
        If there are not enough bins.
    """
    if last - first < 2 * guard + 1 + (2 * cells + 1) * step:
        raise ValueError(f"{last - first} bins are too few for a CFAR of 2 x {cells} cells, {step} apart")
    bin_ = np.arange(first, last)
    room_left = np.maximum(bin_ - guard - 1 - first + step, 0) // step
    room_right = np.maximum(last - 1 - bin_ - guard - 1 + step, 0) // step
    left = np.minimum(np.maximum(cells, 2 * cells - room_right), room_left)
    right = 2 * cells - left
    number = np.arange(2 * cells)
    on_left = number < left[:, None]
    reach = guard + 1 + step * np.where(on_left, number, number - left[:, None])
    if np.any(right > room_right):
        raise ValueError(f"{last - first} bins are too few for a CFAR of 2 x {cells} cells, {step} apart")
    return np.asarray(bin_[:, None] + np.where(on_left, -reach, reach))


def cell_averaging_level(power: FloatArray, cells: NDArray[np.intp]) -> FloatArray:
    """Return the mean of the powers around each bin.

    Parameters
    ----------
    power : ndarray, shape (range_bins,)
    cells : ndarray of int, shape (m, n)
        Of `reference_cells`.

    Returns
    -------
    ndarray, shape (m,)
    """
    return np.asarray(power[cells].mean(axis=1))


def ordered_level(power: FloatArray, cells: NDArray[np.intp], rank: int) -> FloatArray:
    """Return the power around each bin that is the `rank`-th in order, from 1, the least.

    Parameters
    ----------
    power : ndarray, shape (range_bins,)
    cells : ndarray of int, shape (m, n)
    rank : int

    Returns
    -------
    ndarray, shape (m,)
    """
    return np.asarray(np.partition(power[cells], rank - 1, axis=1)[:, rank - 1])
