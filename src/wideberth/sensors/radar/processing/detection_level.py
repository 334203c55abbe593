"""The threshold of each range bin of a frame, and how probably it lets a target through."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import plot_probability
from wideberth.sensors.radar.link_budget import averaging_gain_db
from wideberth.sensors.radar.processing.averaging import DetectionPower
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics
from wideberth.sensors.radar.processing.thresholds import (
    cell_averaging_level,
    exponential_multiplier,
    false_alarm_probabilities,
    gamma_multiplier,
    ordered_level,
    ordered_multiplier,
    per_cell,
    reference_cells,
)
from wideberth.types import DetectionModel

_MODEL_POINTS = 40


def searched_bins(config: RadarConfig) -> slice:
    """Return the range bins in which targets are looked for, from `range_min_m` to `range_limit`.

    The first and the last bin never are: half of their neighbours is missing.
    """
    first = max(math.ceil(config.range_min_m / config.range_bin - 1e-9), 1)
    last = min(math.floor(config.range_limit / config.range_bin + 1e-9), config.range_bins - 2)
    if last < first:
        raise ValueError("there is no range bin between range_min_m and range_max_m")
    return slice(first, last + 1)


def detection_threshold(
    config: RadarConfig,
    found: DetectionPower,
    powers: FloatArray,
    looks: float,
    noise: NoiseStatistics,
    channels: NDArray[np.bool_],
) -> FloatArray:
    """Return the threshold of each range bin, as `config.processing` wants it.

    Where channels are not equally strong, their mean is taken as that of so many fewer equal ones as have the same
    variance.

    Parameters
    ----------
    config : RadarConfig
    found : DetectionPower
        What the threshold is put to.
    powers : ndarray, shape (channels, range_bins)
        The averaged powers, of which CFAR levels are formed.
    looks : float
        Independent powers in each of them.
    noise : NoiseStatistics
        As well known as it is now.
    channels : ndarray of bool, shape (channels,)
        Those that are used.

    Returns
    -------
    ndarray, shape (range_bins,)
        W; infinite where nothing is looked for.

    Raises
    ------
    ValueError
        If there are too few bins for a CFAR.
    """
    searched, processing = searched_bins(config), config.processing
    threshold = np.full(config.range_bins, np.inf)
    level = noise.power[channels][:, searched]
    used = len(level)
    mean = level.mean(axis=0)
    per_channel = level.mean(axis=1)
    alike = float(per_channel.sum() ** 2 / (used * np.square(per_channel).sum()))
    in_test = _rounded(found.looks * (alike if config.detect_on == "channels" else 1.0))
    in_cell = _rounded(looks * used * alike)
    known = _rounded(noise.looks(used) * alike) if processing.finite_noise_run else math.inf
    if processing.threshold in ("ca_cfar", "os_cfar") and config.snr_threshold_db is None:
        step = 2 if processing.window == "hann" else 1
        around = reference_cells(
            searched.start, searched.stop, processing.cfar_cells, processing.cfar_guard_cells, step
        )
        around_power = powers[channels].mean(axis=0)
        if processing.threshold == "ca_cfar":
            mean = cell_averaging_level(around_power, around)
        else:
            mean = ordered_level(around_power, around, _rank(config))
    threshold[searched] = mean * _multipliers(config, in_test, in_cell, known, found.cells)
    return threshold


def _rounded(looks: float) -> float:
    """Return a number of powers to four digits: thresholds are kept for it, and do not depend on more."""
    return float(f"{looks:.4g}")


def _rank(config: RadarConfig) -> int:
    cells = 2 * config.processing.cfar_cells
    return min(max(round(config.processing.cfar_rank * cells), 1), cells)


@lru_cache(maxsize=64)
def _multipliers(config: RadarConfig, looks: float, cell_looks: float, noise_looks: float, cells: int) -> FloatArray:
    """Return the threshold of each searched bin over the level of the noise."""
    processing = config.processing
    if config.snr_threshold_db is not None:
        required = config.snr_threshold_db - float(averaging_gain_db(max(round(looks), 1)))
        return np.asarray(1.0 + 10.0 ** (required / 10.0))
    wanted = per_cell(false_alarm_probabilities(config)[searched_bins(config)], cells)
    p, where = np.unique(wanted, return_inverse=True)
    around = 2 * processing.cfar_cells
    if processing.threshold == "gamma":
        found = gamma_multiplier(p, looks, noise_looks)
    elif processing.threshold == "exponential":
        found = exponential_multiplier(p, noise_looks)
    elif processing.threshold == "ca_cfar":
        found = gamma_multiplier(p, looks, cell_looks * around)
    else:
        found = _ordered(p, looks, cell_looks, around, _rank(config))
    return np.asarray(found[where])


def _ordered(p: FloatArray, looks: float, cell_looks: float, around: int, rank: int) -> FloatArray:
    # A smooth function of the logarithm: of many probabilities some are computed and the rest interpolated.
    log_p = np.log(p)
    nodes = log_p if len(p) <= 16 else np.linspace(log_p[0], log_p[-1], 16)
    values = [ordered_multiplier(float(np.exp(x)), looks, cell_looks, around, rank) for x in nodes]
    return np.interp(log_p, nodes, values)


@lru_cache(maxsize=16)
def detection_model(config: RadarConfig) -> DetectionModel:
    """Return how probably a scan holds a plot of a target on boresight, of `config.processing.reference_rcs_m2`.

    With the window's noise, and the least strong of the bins that the rule of adjacent bins asks for, over all places
    of the target in its bin. Migration through bins and CFAR losses are left out.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    DetectionModel
    """
    ranges = np.linspace(config.range_min_m, config.range_limit, _MODEL_POINTS)
    p_fa = np.interp(ranges / config.range_bin, np.arange(config.range_bins), false_alarm_probabilities(config))
    probability = plot_probability(ranges, config.processing.reference_rcs_m2, 0.0, config, p_fa=p_fa)
    return DetectionModel(ranges, np.clip(probability, 0.0, 1.0))
