"""What a radar's noise is like: from a run without targets, kept in a file, aged, and its level tracked afterwards.

Thesis 4.1 and 5.4, article eq. 3. A threshold a tenth of a decibel too low doubles the false alarms of many averaged
powers, hence the tracking of the level.
"""

import hashlib
import json
import math
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy import special

from wideberth.argument_checks import FINITE, POSITIVE, FloatArray, checked
from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.processing.frame_powers import frame_image, frame_powers
from wideberth.sensors.radar.processing.range_compression import checked_samples
from wideberth.sensors.radar.processing.sample_checks import usable_samples
from wideberth.sensors.radar.range_cells import HANN_POWER_CORRELATION, window_noise_gain

FILE_VERSION = 1
_ARRAYS = ("version", "power", "samples", "fingerprint", "created", "level_time", "level_variance")
_SETTINGS = (
    "carrier_frequency_ghz",
    "bandwidth_mhz",
    "sweep_time_ms",
    "if_bandwidth_mhz",
    "noise_figure_db",
    "channels",
    "array_rows",
    "sampling",
)
_PART_OF_A_DB = math.log(10.0) / 10.0
_MEDIAN_VARIANCE = math.pi / 2.0  # of a median, over that of a mean
_LEAST_BINS = 32


def fingerprint(config: RadarConfig) -> str:
    """Return a short hash of all settings on which the noise of a bin depends.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    processing = config.processing
    settings: dict[str, Any] = {key: getattr(config, key) for key in _SETTINGS}
    settings["receiver"] = config.receiver.model_dump()
    settings["window"] = processing.window
    settings["moving_target"] = processing.clutter_filter == "moving_target"
    settings["fixed_point"] = None if processing.fixed_point is None else processing.fixed_point.model_dump()
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]


@dataclass(frozen=True, slots=True, eq=False)
class NoiseStatistics:
    """Mean noise of each channel and bin, and how well it is known.

    Attributes
    ----------
    power : ndarray, shape (channels, range_bins)
        Mean of `averaging.channel_powers`, W; 0 for a channel that was broken in the run.
    samples : float
        Sweeps behind it (less one a frame with a moving-target filter); infinite: the theoretical level.
    fingerprint : str
        Of the radar's settings.
    created : float
        End of the run, s.
    level_time : float
        Up to when the level is accounted for, s.
    level_variance : float
        Relative variance of the common level that has come since, by ageing less tracking.
    """

    power: FloatArray
    samples: float
    fingerprint: str
    created: float = 0.0
    level_time: float = 0.0
    level_variance: float = 0.0

    def __post_init__(self) -> None:
        if self.power.ndim != 2 or not np.all(np.isfinite(self.power) & (self.power >= 0.0)):
            raise ValueError("noise power must be finite, not negative, with the shape (channels, range_bins)")
        if not (self.samples >= 1.0 and self.level_variance >= 0.0):
            raise ValueError("noise statistics need samples, and a level_variance that is not negative")
        checked("created and level_time", [self.created, self.level_time], FINITE)

    def check(self, config: RadarConfig) -> None:
        """Check that the statistics are those of a radar.

        Raises
        ------
        ValueError
            If they are of another radar, or of other settings.
        """
        if self.power.shape != (config.channels, config.range_bins) or self.fingerprint != fingerprint(config):
            raise ValueError(
                f"the noise statistics, {self.power.shape[0]} channels of {self.power.shape[1]} bins, fingerprint "
                f"{self.fingerprint}, are of another radar or of other settings: this one's are {config.channels} of "
                f"{config.range_bins}, {fingerprint(config)}; make a noise run with it"
            )

    def aged(self, t: float, drift_db_per_sqrt_hour: float) -> Self:
        """Return the statistics as well as they are known later: the level has wandered randomly since.

        Parameters
        ----------
        t : float
            s.
        drift_db_per_sqrt_hour : float

        Returns
        -------
        NoiseStatistics

        Raises
        ------
        ValueError
            If the time is before that of the statistics.
        """
        age = float(checked("t", t, FINITE)) - self.level_time
        if age < 0.0:
            raise ValueError(f"the noise statistics are of {self.level_time:g} s, after the frame at {t:g} s")
        grown = (drift_db_per_sqrt_hour * _PART_OF_A_DB) ** 2 * age / 3600.0
        return replace(self, level_time=t, level_variance=self.level_variance + grown)

    def dated(self, t: float) -> Self:
        """Return the statistics as made at `t`, s, at the latest: those made later or by another clock count as new."""
        return replace(self, created=min(self.created, t), level_time=t) if self.level_time > t else self

    def looks(self, channels: int) -> float:
        """Return of how many powers the mean over so many channels is worth: relative variances add."""
        variance = 1.0 / (self.samples * channels) + self.level_variance
        return 1.0 / variance if variance > 0.0 else math.inf

    def updated(
        self,
        powers: FloatArray,
        detected: NDArray[np.bool_],
        searched: slice,
        channels: NDArray[np.bool_],
        sweeps: float,
        p_fa: float,
    ) -> Self:
        """Return the statistics with the level as a frame has it, in the bins away from detections.

        The median over the bins is compared with that of the powers' distribution, cut off where detections begin; the
        step taken is that of a Kalman filter with `level_variance` as the level's variance.

        Parameters
        ----------
        powers : ndarray, shape (channels, range_bins)
            Of `averaging.channel_powers`.
        detected : ndarray of bool, shape (range_bins,)
            Over the threshold.
        searched : slice
            Bins that count.
        channels : ndarray of bool, shape (channels,)
            Those that are used.
        sweeps : float
            Independent powers in each.
        p_fa : float
            False alarm probability of a bin.

        Returns
        -------
        NoiseStatistics
            Itself if fewer than 32 bins are left.
        """
        near = detected.copy()
        for shift in (1, 2):
            near[shift:] |= detected[:-shift]
            near[:-shift] |= detected[shift:]
        quiet = np.flatnonzero(~near[searched]) + searched.start
        if len(quiet) < _LEAST_BINS:
            return self
        now, then = powers[np.ix_(channels, quiet)], self.power[np.ix_(channels, quiet)]
        looks = sweeps * len(now)
        middle = special.gammaincinv(looks, 0.5 * (1.0 - p_fa)) / looks
        common = float(np.median(now.mean(axis=0) / then.mean(axis=0))) / middle
        each = np.median(now / then, axis=1)
        level = common * each / each.mean()
        correlated = 1.0 + 2.0 * sum(HANN_POWER_CORRELATION)
        noise = _MEDIAN_VARIANCE * correlated / (len(quiet) * looks)
        gain = self.level_variance / (self.level_variance + noise)
        power = self.power.copy()
        power[channels] *= level[:, None] ** gain
        return replace(self, power=power, level_variance=(1.0 - gain) * self.level_variance)

    def save(self, path: Path) -> None:
        """Write the statistics to an NPZ file: `version` (1), and the attributes by their names."""
        values = {name: getattr(self, name) for name in _ARRAYS if name != "version"}
        with path.open("wb") as file:
            np.savez_compressed(file, version=FILE_VERSION, **values)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read the statistics from a file that `save` wrote.

        Raises
        ------
        InputError
            If the file cannot be read, is of another version, or holds something else.
        """
        if not path.is_file():
            raise InputError(f"{path}: no such file")
        if not zipfile.is_zipfile(path):
            raise InputError(f"{path}: not a file of noise statistics (NPZ): make one with `wideberth radar noise`")
        try:
            with np.load(path, allow_pickle=False) as file:
                found = {name: file[name] for name in _ARRAYS}
            if int(found.pop("version")) != FILE_VERSION:
                raise InputError(f"{path}: noise statistics of another version than {FILE_VERSION}")
            power = np.asarray(found.pop("power"), dtype=np.float64)
            print_of = str(found.pop("fingerprint"))
            return cls(power, fingerprint=print_of, **{name: float(value) for name, value in found.items()})
        except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{path}: no noise statistics can be read from it ({error})") from error


def theoretical_noise(config: RadarConfig, t: float = 0.0) -> NoiseStatistics:
    """Return the statistics of the link budget's receiver noise, taken as known: the same in all bins and channels."""
    level = noise_power(config) * window_noise_gain(config.processing.window)
    power = np.full((config.channels, config.range_bins), level)
    return NoiseStatistics(power, math.inf, fingerprint(config), t, t)


def noise_statistics(config: RadarConfig, frames: Iterable[NDArray[Any]], created: float = 0.0) -> NoiseStatistics:
    """Return the statistics of a run without targets.

    The mean is over all sweeps (errata, "Radar": not divided by one less). A channel that cannot be used in some frame
    has the power 0.

    Parameters
    ----------
    config : RadarConfig
    frames : iterable of ndarray, shape (sweeps, channels, samples_per_sweep)
        V.
    created : float
        End of the run, s.

    Returns
    -------
    NoiseStatistics

    Raises
    ------
    ValueError
        If there is no frame, or one cannot be used.
    """
    power = np.zeros((config.channels, config.range_bins))
    good = np.ones(config.channels, np.bool_)
    total = 0.0
    for k, samples in enumerate(frames):
        values = checked_samples(config, samples)
        try:
            usable = usable_samples(config, values)
        except InputError as error:
            raise InputError(f"frame {k} of the noise run: {error}") from None
        powers, looks = frame_powers(config, frame_image(config, values[usable.sweeps]))
        good &= usable.channels
        power[good] += looks * powers[good]
        total += looks
    checked("number of noise frames and their sweeps", total, POSITIVE)
    power[~good] = 0.0
    return NoiseStatistics(power / total, total, fingerprint(config), created, created)
