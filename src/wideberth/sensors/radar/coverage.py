"""How far a radar holds confirmed tracks, by direction and by how fast the target closes."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from wideberth.argument_checks import FINITE, POSITIVE, UNSURE, FloatArray, checked
from wideberth.sensors.confirmation import confirmation_range
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.detection import detection_probability, required_snr_db
from wideberth.sensors.radar.link_budget import (
    averaging_gain_db,
    beamforming_gain_db,
    max_range,
    migration_loss_db,
    snr_db,
)
from wideberth.sensors.radar.processing.thresholds import per_cell
from wideberth.sensors.radar.range_cells import bin_shares, cells_searched, group_probability

_TARGETS_AT_ONCE = 200
_RATIOS_DB = np.linspace(-150.0, 250.0, 2001)
_QUANTILES = (np.arange(128) + 0.5) / 128.0  # of a fluctuating cross-section
_OFFSETS = (np.arange(8) + 0.5) / 8.0 - 0.5  # of targets from the middle of their bin


def looks_and_gain_db(config: RadarConfig) -> tuple[int, float]:
    """Return of how many powers the threshold is put to the mean, and the gain of each over one channel and sweep.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    looks : int
    gain_db : float
    """
    looks, gain = 1, 0.0
    if config.averaging == "coherent":
        gain += float(averaging_gain_db(config.averages, "coherent"))
    else:
        looks *= config.averages
    if config.detect_on == "beam":
        gain += float(beamforming_gain_db(config.channels))
    else:
        looks *= config.channels
    return looks, gain


def scan_detection_probability(
    range_m: ArrayLike,
    rcs_m2: ArrayLike,
    closing_speed: ArrayLike,
    config: RadarConfig,
    *,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
) -> FloatArray:
    """Return the probability that one scan detects a target in its range bin.

    Field of view and instrumented range are not asked.

    Parameters
    ----------
    range_m, rcs_m2 : array_like
        Distance, m, and mean cross-section, m2. The arrays broadcast.
    closing_speed : array_like
        m/s; see `link_budget.migration_loss_db`.
    config : RadarConfig
    azimuth, elevation : array_like
        From boresight, rad.

    Returns
    -------
    ndarray
        With `snr_threshold_db` 0 or 1: the ratio after averaging (by the rule) and beamforming reaches it or does not.

    Raises
    ------
    ValueError
        If a range or cross-section is not finite and positive, or another value not finite.
    """
    received = snr_db(range_m, rcs_m2, config, azimuth=azimuth, elevation=elevation)
    received = received - migration_loss_db(closing_speed, config)
    looks, gain = looks_and_gain_db(config)
    if config.snr_threshold_db is not None:
        return np.where(received + gain + averaging_gain_db(looks) >= config.snr_threshold_db, 1.0, 0.0)
    return detection_probability(received + gain, config.false_alarm_probability, config.swerling, looks=looks)


def plot_probability(
    range_m: ArrayLike,
    rcs_m2: ArrayLike,
    range_rate: float,
    config: RadarConfig,
    *,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
    p_fa: ArrayLike | None = None,
    loss_db: float = 0.0,
) -> FloatArray:
    """Return the probability that one scan holds a plot of a target, the mean over its places in a range bin.

    With the window, the adjacent bins that a plot needs and those that the target crosses in the frame
    (`range_cells.bin_shares`), and the cells of each bin. CFAR losses are left out.

    Parameters
    ----------
    range_m, rcs_m2 : array_like
        Distance, m, and mean cross-section, m2. The arrays broadcast.
    range_rate : float
        m/s.
    config : RadarConfig
    azimuth, elevation : array_like
        From boresight, rad.
    p_fa : array_like, optional
        False alarm probabilities of the bins; the radar's where not given.
    loss_db : float
        More loss.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If a range or cross-section is not finite and positive, a probability not inside 0 to 1, or another value not
        finite.
    """
    rate = float(checked("range_rate", range_rate, FINITE))
    received = snr_db(range_m, rcs_m2, config, azimuth=azimuth, elevation=elevation) - loss_db
    if config.snr_threshold_db is not None:
        return np.interp(received, *_plot_curve(config, rate, 0.0))
    alarms = config.false_alarm_probability if p_fa is None else checked("p_fa", p_fa, UNSURE)
    received, of_bin = np.broadcast_arrays(received, alarms)
    found = np.empty(received.shape)
    for p in np.unique(of_bin):
        found[of_bin == p] = np.interp(received[of_bin == p], *_plot_curve(config, rate, float(p)))
    return found


@lru_cache(maxsize=256)
def _plot_curve(config: RadarConfig, range_rate: float, p_fa: float) -> tuple[FloatArray, FloatArray]:
    """Return signal-to-noise ratios of one channel and sweep, dB, and with which probability they make a plot."""
    looks, gain = looks_and_gain_db(config)
    in_bins = (
        _RATIOS_DB[:, None, None] + gain + 10.0 * np.log10(np.maximum(bin_shares(config, _OFFSETS, range_rate), 1e-15))
    )
    if config.snr_threshold_db is not None:
        over = (in_bins + averaging_gain_db(looks) >= config.snr_threshold_db).astype(np.float64)
        return _RATIOS_DB, group_probability(over, config.processing.group_bins).mean(axis=-1)
    of_cell = float(per_cell(p_fa, cells_searched(config, config.averages)))
    steady = np.interp(in_bins, _RATIOS_DB, detection_probability(_RATIOS_DB, of_cell, 0, looks=looks))
    found = group_probability(steady, config.processing.group_bins).mean(axis=-1)
    if config.swerling:
        # All bins have the same cross-section: the mean over it comes last.
        drawn = stats.gamma(1.0 if config.swerling == 1 else 2.0).ppf(_QUANTILES) / (
            1.0 if config.swerling == 1 else 2.0
        )
        found = np.interp(_RATIOS_DB[:, None] + 10.0 * np.log10(drawn), _RATIOS_DB, found).mean(axis=-1)
    return _RATIOS_DB, found


def detection_range(
    rcs_m2: ArrayLike,
    p_d: ArrayLike,
    config: RadarConfig,
    *,
    closing_speed: ArrayLike = 0.0,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
) -> FloatArray:
    """Return the range at which one scan detects a target with a probability, within the limit of the radar's range.

    Parameters
    ----------
    rcs_m2 : array_like
        Mean cross-section, m2. The arrays broadcast.
    p_d : array_like
        The probability; not used with `snr_threshold_db`.
    config : RadarConfig
    closing_speed : array_like
        m/s.
    azimuth, elevation : array_like
        From boresight, rad; the field of view is not asked.

    Returns
    -------
    ndarray
        m.

    Raises
    ------
    ValueError
        If a cross-section is not finite and positive, a probability not between that of a false alarm and 1, or another
        value not finite.
    """
    wanted = checked("p_d", p_d, UNSURE)
    looks, gain = looks_and_gain_db(config)
    if config.snr_threshold_db is not None:
        needed = np.full(wanted.shape, config.snr_threshold_db - averaging_gain_db(looks) - gain)
    else:
        needed = required_snr_db(wanted, config.false_alarm_probability, config.swerling, looks=looks) - gain
    needed = needed + migration_loss_db(closing_speed, config)
    return np.minimum(max_range(rcs_m2, needed, config, azimuth=azimuth, elevation=elevation), config.range_limit)


def confirmed_range(
    rcs_m2: ArrayLike,
    closing_speed: ArrayLike,
    config: RadarConfig,
    *,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
) -> FloatArray:
    """Return how far a closing target is when it has a confirmed track, with `config.confirmation_probability`.

    Detections that noise alone would have given do not count towards the track. The cross-section is drawn anew for
    each scan. The target keeps its direction, as it does on a collision course.

    Parameters
    ----------
    rcs_m2 : array_like
        Mean cross-section, m2. The arrays broadcast.
    closing_speed : array_like
        m/s.
    config : RadarConfig
    azimuth, elevation : array_like
        Direction of the target, clockwise from the nose and up from the horizon, rad. The best of the boresights
        counts.

    Returns
    -------
    ndarray
        m; 0 outside the field of view, and where the track comes too late.

    Raises
    ------
    ValueError
        If a cross-section or speed is not finite and positive, or an angle not finite.
    """
    rcs, speed = checked("rcs_m2", rcs_m2, POSITIVE), checked("closing_speed", closing_speed, POSITIVE)
    off, up, visible = off_boresight(azimuth, elevation, config)
    rcs, speed, off, up, visible = np.broadcast_arrays(rcs, speed, off, up, visible)
    found = np.zeros(visible.shape)
    if not visible.any():
        return found
    # Targets left and right of the nose are alike. Slow ones take many more scans: each group is scanned on its own.
    angles = np.round(np.abs(np.stack([off[visible], up[visible]])), 12)
    cells, where = np.unique(np.stack([speed[visible], rcs[visible], *angles]), axis=1, return_inverse=True)
    groups = np.array_split(cells, max(1, cells.shape[1] // _TARGETS_AT_ONCE), axis=1)
    found[visible] = np.concatenate([_confirmed(v, s, a, e, config) for v, s, a, e in groups])[where.reshape(-1)]
    return found


def _confirmed(speed: FloatArray, rcs: FloatArray, off: FloatArray, up: FloatArray, config: RadarConfig) -> FloatArray:
    """Return the ranges of `confirmed_range`, of targets in the field of view, shape (targets,)."""
    noise = 0.0 if config.snr_threshold_db is not None else config.false_alarm_probability

    def p_target(ranges: FloatArray) -> FloatArray:
        p = scan_detection_probability(ranges, rcs, speed, config, azimuth=off, elevation=up)
        return np.asarray((p - noise) / (1.0 - noise))

    confirmed = confirmation_range(
        p_target,
        speed,
        update_interval=config.update_interval_s,
        range_limit=config.range_limit,
        range_min=config.range_min_m,
        hits=config.confirm_hits,
        window=config.confirm_window,
        confirmed_with=config.confirmation_probability,
    )
    return np.maximum(confirmed - speed * config.confirm_time_s, 0.0)


def off_boresight(
    azimuth: ArrayLike, elevation: ArrayLike, config: RadarConfig
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return a direction from the nearest boresight, and whether it is in the field of view.

    Parameters
    ----------
    azimuth, elevation : array_like
        Clockwise from the nose and up from the horizon, rad.
    config : RadarConfig

    Returns
    -------
    azimuth, elevation : ndarray
        From that boresight, rad.
    visible : ndarray of bool

    Raises
    ------
    ValueError
        If an angle is not finite.
    """
    direction, height = checked("azimuth", azimuth, FINITE), checked("elevation", elevation, FINITE)
    turns = direction[..., None] - np.radians(config.boresight_azimuths_deg)
    turns = np.remainder(turns + np.pi, 2.0 * np.pi) - np.pi
    nearest = np.argmin(np.abs(turns), axis=-1, keepdims=True)
    off = np.take_along_axis(turns, nearest, axis=-1)[..., 0]
    up = height - np.radians(config.boresight_elevation_deg)
    slack = 1e-9
    visible = np.abs(off) <= 0.5 * np.radians(config.azimuth_fov_deg) + slack
    visible = visible & (np.abs(up) <= 0.5 * np.radians(config.elevation_fov_deg) + slack)
    return off, up, visible
