"""From the samples of a frame to a scan of plots, step by step (thesis 4.1 and 5.2, article III.A).

Range compression, averaged powers, thresholds, groups of adjacent bins, peaks, and the estimates of what is in them.
Nothing is kept from frame to frame; `radar_processor.RadarProcessor` does that.
"""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.echoes import Estimates
from wideberth.sensors.radar.estimation.plots import estimate_plots
from wideberth.sensors.radar.processing.averaging import detection_power, moving_targets
from wideberth.sensors.radar.processing.detection_level import detection_model, detection_threshold, searched_bins
from wideberth.sensors.radar.processing.frame_powers import frame_image, frame_powers
from wideberth.sensors.radar.processing.noise_statistics import NoiseStatistics, theoretical_noise
from wideberth.sensors.radar.processing.peak_detection import BinGroups, IntArray, adjacent_groups, group_peaks
from wideberth.sensors.radar.processing.printed_estimator import estimate_printed
from wideberth.sensors.radar.processing.range_compression import checked_samples
from wideberth.sensors.radar.processing.sample_checks import usable_samples
from wideberth.sensors.radar.range_cells import window_noise_gain
from wideberth.types import Scan, SensorHealth

_DEAD = 0.1  # of the noise: less is no channel's, whatever its gain did
_TOO_LOUD = 1e7  # times the noise in most bins: more than 14 bits can hold beside noise, so the unit is another
_SOME_BINS = 128  # enough to tell a dead channel
_NOT_HEARD = 1e12  # noise that takes a channel out of estimates, over that of the others


@dataclass(frozen=True, slots=True, eq=False)
class Processed:
    """A frame, step by step.

    Attributes
    ----------
    powers : ndarray, shape (channels, range_bins)
        Averaged, with the window; W.
    power : ndarray, shape (range_bins,)
        What the threshold is put to.
    threshold : ndarray, shape (range_bins,)
        Infinite where nothing is looked for.
    detected : ndarray of bool, shape (range_bins,)
    groups : BinGroups
    peaks : ndarray of int, shape (m,)
        Bins that were given to the estimator, increasing.
    estimates : Estimates
        All of them, with those that make no plot; `peak` is an index into `peaks`.
    kept : ndarray of int, shape (k,)
        The estimates that are plots.
    channels : ndarray of bool, shape (channels,)
        Those that were used.
    looks : float
        Sweeps that count in each of `powers`.
    time_offset : float
        Middle of the sweeps used, from the middle of the frame, s.
    rejects : mapping of str to int
        What was left out, by cause.
    """

    powers: FloatArray
    power: FloatArray
    threshold: FloatArray
    detected: NDArray[np.bool_]
    groups: BinGroups
    peaks: IntArray
    estimates: Estimates
    kept: IntArray
    channels: NDArray[np.bool_]
    looks: float
    time_offset: float
    rejects: Mapping[str, int]


def process_frame(
    radar: RadarConfig,
    samples: NDArray[Any],
    noise: NoiseStatistics | None = None,
    *,
    calibration: ArrayCalibration | None = None,
) -> Processed:
    """Return all steps from the samples of a frame to its plots.

    Channels and sweeps that cannot be used are left out and counted (`sample_checks.usable_samples`; also
    ``channel_dead``, with less than a tenth of its noise, ``channel_too_loud``, with ten million times it in most bins,
    as of samples in another unit than volts, and ``channel_without_noise``). Further counts: groups of too few bins
    (``group_too_small``), peaks and plots beyond `max_plots` (``beyond_max_plots``), peaks that a stronger
    echo explains (``peak_explained``), and plots outside the limits of range (``outside_range``).

    Parameters
    ----------
    radar : RadarConfig
    samples : ndarray, shape (sweeps, channels, samples_per_sweep)
        V, real or complex as the radar's sampling.
    noise : NoiseStatistics or None
        As well known as it is at the frame's time (`NoiseStatistics.aged`). None: the link budget's, taken as known.
    calibration : ArrayCalibration or None
        Of the channels.

    Returns
    -------
    Processed

    Raises
    ------
    ValueError
        If the shape or kind of the samples is not the radar's, the noise is of another radar, or the settings do not go
        together.
    InputError
        If none of the samples can be used.
    """
    values = checked_samples(radar, samples)
    statistics = _theoretical(radar) if noise is None else noise
    if noise is not None:
        noise.check(radar)
    usable = usable_samples(radar, values)
    image = frame_image(radar, values[usable.sweeps])
    powers, looks = frame_powers(radar, image)
    searched = searched_bins(radar)
    rejects = Counter(usable.rejects)
    channels = _alive(powers, statistics.power, searched, usable.channels, rejects)
    if radar.processing.clutter_filter == "moving_target":
        image = moving_targets(image)
    found = detection_power(radar, image, powers, channels)
    threshold = detection_threshold(radar, found, powers, looks, statistics, channels)
    detected = found.power > threshold
    groups = adjacent_groups(detected, radar.processing.group_bins)
    rejects["group_too_small"] = groups.too_small
    peaks = group_peaks(found.power, groups)
    most = radar.processing.max_plots
    if len(peaks) > most:
        rejects["beyond_max_plots"] = len(peaks) - most
        strength = found.power[peaks] / threshold[peaks]
        peaks = np.sort(peaks[np.argsort(-strength, kind="stable")[:most]])
    estimates = _estimated(radar, image, found.power, peaks, statistics.power, channels, calibration)
    rejects["peak_explained"] = len(peaks) - len(np.unique(estimates.peak))
    kept = _plots(radar, estimates, rejects)
    start, stop = usable.sweeps.start, usable.sweeps.stop
    offset = 0.5 * (start + stop - len(values)) * radar.sweep_interval
    causes = {cause: n for cause, n in rejects.items() if n}
    return Processed(
        powers, found.power, threshold, detected, groups, peaks, estimates, kept, channels, looks, offset, causes
    )


@lru_cache(maxsize=8)
def _theoretical(radar: RadarConfig) -> NoiseStatistics:
    return theoretical_noise(radar)


def _alive(
    powers: FloatArray, noise: FloatArray, searched: slice, usable: NDArray[np.bool_], rejects: Counter[str]
) -> NDArray[np.bool_]:
    """Return the usable channels that hear noise at all, and of which the noise is known."""
    known = noise[:, searched].min(axis=1) > 0.0
    some = slice(searched.start, searched.stop, max((searched.stop - searched.start) // _SOME_BINS, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.median(powers[:, some] / noise[:, some], axis=1)
    rejects["channel_without_noise"] = int(np.count_nonzero(usable & ~known))
    rejects["channel_dead"] = int(np.count_nonzero(usable & known & (level < _DEAD)))
    rejects["channel_too_loud"] = int(np.count_nonzero(usable & known & (level > _TOO_LOUD)))
    alive = usable & known & (level >= _DEAD) & (level <= _TOO_LOUD)
    if not alive.any():
        causes = ", ".join(f"{cause} {n}" for cause, n in rejects.items() if n)
        raise InputError(
            f"no channel of the frame can be used: {causes}; look at the cables, and at whether the samples are "
            "volts at the receiver's input"
        )
    return np.asarray(alive)


def _estimated(
    radar: RadarConfig,
    image: NDArray[np.complex64],
    power: FloatArray,
    peaks: IntArray,
    noise: FloatArray,
    channels: NDArray[np.bool_],
    calibration: ArrayCalibration | None,
) -> Estimates:
    of_image = noise / window_noise_gain(radar.processing.window)
    if not channels.all():
        image = np.where(channels[:, None], image, np.complex64(0.0))
        of_image = np.where(channels[:, None], of_image, _NOT_HEARD * of_image[channels].mean())
    of_image = np.maximum(of_image, np.finfo(np.float64).tiny)
    if radar.processing.estimator == "maximum_likelihood":
        return estimate_plots(radar, image, peaks, of_image, calibration)
    of_image = np.where(channels[:, None], of_image, of_image[channels].mean(axis=0))
    return estimate_printed(radar, image, power, peaks, of_image, calibration)


def _plots(radar: RadarConfig, estimates: Estimates, rejects: Counter[str]) -> IntArray:
    """Return which estimates are plots, in order of range."""
    distance = estimates.z[:, 0]
    inside = (distance >= radar.range_min_m) & (distance <= radar.range_limit)
    rejects["outside_range"] = int(np.count_nonzero(~inside))
    kept = np.flatnonzero(inside)
    beyond = len(kept) - radar.processing.max_plots
    if beyond > 0:
        rejects["beyond_max_plots"] += beyond
        kept = kept[np.argsort(-estimates.snr_db[kept], kind="stable")[:-beyond]]
    return kept[np.argsort(distance[kept], kind="stable")]


def process(
    radar: RadarConfig,
    samples: NDArray[Any],
    noise: NoiseStatistics | None = None,
    *,
    t: float = 0.0,
    sensor: str = "radar",
    position: FloatArray | None = None,
    attitude: FloatArray | None = None,
    calibration: ArrayCalibration | None = None,
) -> Scan:
    """Return the plots of a frame.

    Parameters
    ----------
    radar : RadarConfig
    samples : ndarray, shape (sweeps, channels, samples_per_sweep)
        V.
    noise : NoiseStatistics or None
        It is aged to `t` here. None: the link budget's, taken as known.
    t : float
        Middle of the frame, s.
    sensor : str
        Name of the radar.
    position : ndarray, shape (3,), optional
        Local NED, m; the origin by default.
    attitude : ndarray, shape (3, 3), optional
        Rotation from the array's axes (forward, right, down) to local NED; as they are by default.
    calibration : ArrayCalibration or None

    Returns
    -------
    Scan
        Of the kind ``"radar"``, or ``"radar_cone"`` for an array of one row or column: its angle is that from the plane
        across the array, asin(right / distance) in the place of azimuth or asin(up / distance) in that of elevation.

    Raises
    ------
    ValueError
        As in `process_frame`, if the time is not finite, or the noise is of a later time.
    """
    when = float(checked("t", t, FINITE))
    aged = None if noise is None else noise.aged(when, radar.processing.noise_drift_db_per_sqrt_hour)
    done = process_frame(radar, samples, aged, calibration=calibration)
    return scan_of(
        radar,
        done,
        t=when,
        sensor=sensor,
        position=np.zeros(3) if position is None else checked("position", position, FINITE),
        attitude=np.eye(3) if attitude is None else checked("attitude", attitude, FINITE),
    )


def scan_of(
    radar: RadarConfig,
    done: Processed,
    *,
    t: float,
    sensor: str,
    position: FloatArray,
    attitude: FloatArray,
    rejects: Mapping[str, int] | None = None,
) -> Scan:
    """Return the scan of a processed frame.

    Parameters
    ----------
    radar : RadarConfig
    done : Processed
    t : float
        Middle of the frame, s.
    sensor, position, attitude
        As in `process`.
    rejects : mapping of str to int, optional
        Counts to give out instead of this frame's.

    Returns
    -------
    Scan
    """
    z, variance = done.estimates.z[done.kept], done.estimates.variance[done.kept]
    covariance = np.zeros((len(z), 4, 4))
    covariance[:, range(4), range(4)] = np.where(np.isnan(z), np.nan, variance)
    used = int(done.channels.sum())
    state = "ok" if used == radar.channels else f"degraded: {used} of {radar.channels} channels"
    when = t + done.time_offset
    return Scan(
        t=when,
        t_received=t,
        sensor=sensor,
        kind="radar" if min(radar.array_rows, radar.array_columns) > 1 else "radar_cone",
        z=z,
        R=covariance,
        t_valid=np.full(len(z), when),
        sensor_position=position,
        sensor_attitude=attitude,
        field_of_view=(math.radians(0.5 * radar.azimuth_fov_deg), math.radians(0.5 * radar.elevation_fov_deg)),
        detection=detection_model(radar),
        health=SensorHealth(0.0, 1.0 / radar.update_interval_s, done.rejects if rejects is None else rejects, state),
    )
