"""What the range bins of a frame make of an echo: window, place in the bin, bins crossed, and adjacent ones needed.

A detection is a group of adjacent bins over their thresholds (thesis 5.2). How much of an echo's power each of them
holds follows from where the echo is within its bin, and where it goes during the frame.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from wideberth.sensors.radar import range_cells_kernels
from wideberth.sensors.radar.config import RadarConfig

FloatArray = NDArray[np.float64]

_SWEEPS = 16  # of a frame, that stand for all
_WHOLLY = 5  # adjacent bins whose joint probability is computed; more of them follow in proportion

HANN_POWER_CORRELATION = (4.0 / 9.0, 1.0 / 36.0)
"""Squares of the correlation of noise in bins 1 and 2 apart; beyond there is none."""


def window_noise_gain(window: str) -> float:
    """Return the noise power of a windowed bin over that of a rectangular one, a target's gain being 1.

    1.5 (1.76 dB) with the Hann window.
    """
    return 1.5 if window == "hann" else 1.0


def beat_bins(config: RadarConfig, distance: ArrayLike, range_rate: ArrayLike) -> FloatArray:
    """Return where in the spectrum an echo is in the middle of the frame, in bins: range and Doppler are coupled.

    Parameters
    ----------
    config : RadarConfig
    distance, range_rate : array_like
        m, m/s (positive opening).
    """
    seconds = config.carrier_frequency_ghz * 1e9 * config.sweep_time_ms * 1e-3 / (config.bandwidth_mhz * 1e6)
    return (np.asarray(distance) + seconds * np.asarray(range_rate)) / config.range_bin


def bin_shares(config: RadarConfig, beat: ArrayLike, range_rate: ArrayLike) -> FloatArray:
    """Return which share of an echo's signal-to-noise ratio is left in each of the bins around it.

    Parameters
    ----------
    config : RadarConfig
    beat : array_like
        Of the echo in the middle of the frame, in bins (`beat_bins`). The arrays broadcast.
    range_rate : array_like
        m/s. Where the radar follows migration it counts for nothing.

    Returns
    -------
    ndarray, shape (..., bins)
        Adjacent bins, all those in which there is something. At rest, with the Hann window, 0.67 in the bin of an echo
        in its middle and 0.17 in those beside it.
    """
    return BinShares(config)(beat, range_rate)


class BinShares:
    """`bin_shares` of one radar, for many echoes one after another.

    Parameters
    ----------
    config : RadarConfig
    """

    def __init__(self, config: RadarConfig) -> None:
        sweeps = min(config.averages, _SWEEPS)
        self._times = (np.arange(sweeps) + 0.5 - 0.5 * sweeps) / sweeps * config.averages * config.sweep_interval
        self._latest = float(np.abs(self._times).max())
        self._range_bin = config.range_bin
        self._group = config.processing.group_bins
        self._at_rest = config.migration_corrected
        self._hann = config.processing.window == "hann"
        # The sum of amplitudes counts where they add up, in phase.
        self._in_phase = config.averaging == "coherent"
        self._noise_gain = window_noise_gain(config.processing.window)

    def __call__(self, beat: ArrayLike, range_rate: ArrayLike) -> FloatArray:
        """Return the shares: see `bin_shares`."""
        at, rate = np.asarray(beat, dtype=np.float64), np.asarray(range_rate, dtype=np.float64)
        if at.shape != rate.shape:
            at, rate = np.broadcast_arrays(at, rate)
        if self._at_rest:
            rate = np.zeros(rate.shape)
        rate = rate / self._range_bin
        fastest = float(np.abs(rate).max(initial=0.0)) * self._latest
        reach = self._group + math.ceil(fastest)
        power = np.empty((at.size, 2 * reach + 1))
        range_cells_kernels.spread_power(
            (at - np.rint(at)).ravel(),
            np.ascontiguousarray(rate).ravel(),
            self._times,
            self._hann,
            self._in_phase,
            self._noise_gain,
            power,
        )
        return power.reshape(*at.shape, 2 * reach + 1)


def group_probability(p: ArrayLike, group: int) -> FloatArray:
    """Return the probability that so many adjacent bins are over their thresholds.

    Parameters
    ----------
    p : array_like, shape (..., bins)
        Of each bin, independent of the others: noise that neighbours have in common through the window is left out.
    group : int

    Returns
    -------
    ndarray, shape (...)
    """
    each = np.ascontiguousarray(p, dtype=np.float64)
    found = np.empty(each.size // each.shape[-1])
    range_cells_kernels.group_probabilities(each.reshape(len(found), -1), group, found)
    return found.reshape(each.shape[:-1])


@lru_cache(maxsize=16)
def migration_paths(config: RadarConfig, sweeps: int) -> NDArray[np.intp]:
    """Return the paths through range bins that detection looks along, in bins from those in the middle of the frame.

    Parameters
    ----------
    config : RadarConfig
    sweeps : int
        In the frame.

    Returns
    -------
    ndarray of int, shape (paths, sweeps)
        Of range rates up to `processing.range_rate_max_mps` either way, a bin apart over the frame. One path, of a
        target at rest, if the radar does not follow migration.
    """
    times = (np.arange(sweeps) - 0.5 * (sweeps - 1)) * config.sweep_interval
    length = sweeps * config.sweep_interval / config.range_bin
    most = math.ceil(config.processing.range_rate_max_mps * length) if config.migration_corrected else 0
    rates = np.arange(-most, most + 1) / max(length, 1e-300)
    return np.round(rates[:, None] * times / config.range_bin).astype(np.intp)


def cells_searched(config: RadarConfig, sweeps: int) -> int:
    """Return how many cells a range bin has, of which the greatest counts: Doppler cells, beams, and paths.

    Parameters
    ----------
    config : RadarConfig
    sweeps : int
        In the frame.
    """
    doppler = sweeps - (config.processing.clutter_filter == "moving_target") if config.averaging == "coherent" else 1
    beams = config.channels if config.detect_on == "beam" else 1
    return doppler * beams * len(migration_paths(config, sweeps))


@lru_cache(maxsize=64)
def false_plot_probability(config: RadarConfig) -> float:
    """Return how probably a group of bins with nothing but noise over their thresholds begins in a bin.

    Neighbours are correlated by the window; as many powers are averaged, their joint probability is taken as that of
    normal numbers.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    float
    """
    group = config.processing.group_bins
    return _run_probability(config, group) - _run_probability(config, group + 1)


def _run_probability(config: RadarConfig, bins: int) -> float:
    """Return how probably so many adjacent bins are all over their thresholds."""
    few = min(bins, _WHOLLY)
    correlation = np.zeros(few)
    known = (1.0, *HANN_POWER_CORRELATION)[: few if config.processing.window == "hann" else 1]
    correlation[: len(known)] = known
    matrix = correlation[np.abs(np.subtract.outer(np.arange(few), np.arange(few)))]
    level = float(stats.norm.isf(config.false_alarm_probability))
    normal = stats.multivariate_normal(np.zeros(few), matrix, allow_singular=True, seed=1, abseps=1e-12, releps=1e-4)
    p = float(normal.cdf(np.full(few, -level)))
    if bins > few:
        fewer = stats.multivariate_normal(np.zeros(few - 1), matrix[1:, 1:], seed=1, abseps=1e-12, releps=1e-4)
        p *= (p / float(fewer.cdf(np.full(few - 1, -level)))) ** (bins - few)
    return p
