"""A radar's plots straight from true geometry: what detection, errors, resolution and false alarms make of it.

No signal is made. A target's echo has the signal-to-noise ratio of the link budget with a cross-section drawn for this
look. The mean powers that the thresholds of the bins around it are put to are drawn with what `range_cells.bin_shares`
leaves of it in each, so that detection has the probability of `coverage.plot_probability`; the errors follow from the
whole of it, as the processing uses all bins.

Errors are Cramer-Rao bounds times factors, with floors in squares. With S the ratio after all processing (channels
times averages times that of one channel and sweep), the frequency of a tone over N samples is known to
sqrt(6 / (S (N^2 - 1))) rad a sample (Rife and Boorstyn 1974): sqrt(6) / (2 pi sqrt(S)) range bins over a sweep's
samples, as many Doppler bins over the sweeps, and across C elements at d wavelengths sqrt(6 / (S (C^2 - 1))) / (2 pi d)
of the direction cosine. Losses, factors and floors are `PlotModelConfig`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.config import PlotModelConfig, RadarConfig, SimulatedRadarConfig
from wideberth.sensors.radar.coverage import looks_and_gain_db
from wideberth.sensors.radar.detection import threshold
from wideberth.sensors.radar.link_budget import averaging_gain_db, lobe_loss_db, snr_db
from wideberth.sensors.radar.processing.thresholds import per_cell
from wideberth.sensors.radar.range_cells import (
    BinShares,
    beat_bins,
    cells_searched,
    false_plot_probability,
    group_probability,
)

FloatArray = NDArray[np.float64]

TONE_BINS = math.sqrt(6.0) / (2.0 * math.pi)
"""Standard deviation of a tone's frequency, in bins of its spectrum, at a signal-to-noise ratio of 1 in the bin."""

HALF_POWER_WIDTH = 0.886
"""Half-power beamwidth of an array, in direction cosine, in terms of wavelength over length."""

_RESOLUTION = {"conventional": (1.6, math.inf), "mvdr": (0.5, 0.6)}
"""Range bins and beamwidths within which two aircraft give one plot, fitted (docs/results/plot_model.md)."""

_DOPPLER_RESOLUTION = {"conventional": math.inf, "mvdr": 1.0}
"""Doppler bins within which they do, besides."""

_BLENDED_BEAMWIDTHS = 1.2
"""Half-power beamwidths within which two echoes of one range and range rate turn each other's direction."""

_SHARPNESS = 0.4
"""Part of the resolution by which looks differ, either way."""

_LEAST_RATIO = 1.0
"""Below this ratio after processing errors do not grow: the plot is then anywhere in its cell."""


def plot_sigmas(
    config: RadarConfig, model: PlotModelConfig, azimuth: FloatArray, elevation: FloatArray, total: FloatArray
) -> FloatArray:
    """Return the standard deviations of plots.

    Parameters
    ----------
    config : RadarConfig
    model : PlotModelConfig
    azimuth, elevation : ndarray, shape (k,)
        In the sensor's axes, rad.
    total : ndarray, shape (k,)
        Signal-to-noise ratio after all processing; infinite for the floors alone.

    Returns
    -------
    ndarray, shape (k, 4)
        Range, m; azimuth and elevation, or angle of the cone and NaN, rad; range rate, m/s.
    """
    return PlotErrors(config, model)(azimuth, elevation, total)


class PlotErrors:
    """`plot_sigmas` of one radar, for many plots one after another.

    Parameters
    ----------
    config : RadarConfig
    model : PlotModelConfig
    """

    def __init__(self, config: RadarConfig, model: PlotModelConfig) -> None:
        self._range_bin = config.range_bin
        self._range = model.range_error_factor * TONE_BINS, model.range_floor_bins
        spacing = config.element_spacing_wavelengths
        self._right, self._down = (
            (
                model.direction_error_factor * _cosine_bound(n, spacing),
                model.direction_floor_beamwidths * HALF_POWER_WIDTH / (n * spacing),
            )
            for n in (config.array_columns, config.array_rows)
        )
        self._cone = config.array_rows == 1
        self._least = math.cos(math.radians(model.grazing_limit_deg))
        self._rate = model.range_rate_error_factor * TONE_BINS, model.range_rate_floor_bins
        self._wavelength, self._twice_frame = config.wavelength, 2.0 * config.averages * config.sweep_interval

    def __call__(self, azimuth: FloatArray, elevation: FloatArray, total: FloatArray) -> FloatArray:
        """Return the standard deviations: see `plot_sigmas`."""
        root = 1.0 / np.sqrt(np.maximum(total, _LEAST_RATIO))
        sigma = np.empty((len(azimuth), 4))
        sigma[:, 0] = self._range_bin * _root_of_squares(self._range, root)
        right, level = _root_of_squares(self._right, root), np.cos(elevation)
        if self._cone:
            sideways = level * np.sin(azimuth)
            sigma[:, 1] = right / np.maximum(np.sqrt(1.0 - sideways**2), self._least)
            sigma[:, 2] = math.nan
        else:
            sigma[:, 1] = right / np.maximum(level * np.abs(np.cos(azimuth)), self._least)
            sigma[:, 2] = _root_of_squares(self._down, root) / np.maximum(level, self._least)
        sigma[:, 3] = _root_of_squares(self._rate, root) * self._wavelength / self._twice_frame
        return sigma


def _root_of_squares(parts: tuple[float, float], root: FloatArray) -> FloatArray:
    """Return the error that falls with the ratio's root, and the floor, in squares."""
    return np.asarray(np.hypot(parts[0] * root, parts[1]))


def _cosine_bound(elements: int, spacing: float) -> float:
    """Return the standard deviation of a direction cosine at a ratio of 1; one element alone tells none."""
    return math.sqrt(6.0 / (elements**2 - 1.0)) / (2.0 * math.pi * spacing) if elements > 1 else math.inf


class _Echoes(NamedTuple):
    """Echoes of a look, each array (k,): number of the aircraft (-1: none), place (k, 3), range rate, direction."""

    leader: NDArray[np.int64]
    place: FloatArray
    rate: FloatArray
    distance: FloatArray
    azimuth: FloatArray
    elevation: FloatArray


class PlotModel:
    """The plots of one look of a radar.

    Parameters
    ----------
    config : SimulatedRadarConfig

    Attributes
    ----------
    field_of_view : tuple of float
        Half-widths in azimuth and elevation, rad.
    """

    def __init__(self, config: SimulatedRadarConfig) -> None:
        self._config, self._model = config, config.plot_model
        self.field_of_view = (0.5 * math.radians(config.azimuth_fov_deg), 0.5 * math.radians(config.elevation_fov_deg))
        self._looks, gain_db = looks_and_gain_db(config)
        self._gain = 10.0 ** (gain_db / 10.0)
        self._sums = config.channels * config.averages
        # A whole radar's budget on boresight; distance, cross-section, direction and speed are what changes.
        self._snr_at_a_metre_db = float(snr_db(1.0, 1.0, config))
        self._errors = PlotErrors(config, self._model)
        self._cone = config.array_rows == 1
        self._range_bin = config.range_bin
        self._reach = config.range_min_m, config.range_limit
        self._bias = self._model.range_bias_bins * self._range_bin
        self._shares = BinShares(config)
        self._kept = 10.0 ** (-self._model.processing_loss_db / 10.0)
        first, last = config.range_min_m / config.range_bin, config.range_limit / config.range_bin
        self._bins = np.arange(math.ceil(first), math.floor(last) + 1)
        if config.snr_threshold_db is None:
            self._p_cell = float(per_cell(config.false_alarm_probability, cells_searched(config, config.averages)))
            self._level = float(threshold(self._p_cell, self._looks))
            self._p_fa = min(1.0, false_plot_probability(config) * self._model.false_alarm_factor)
        else:
            self._level = 10.0 ** ((config.snr_threshold_db - float(averaging_gain_db(self._looks))) / 10.0)
            self._p_fa = 0.0
        elements, spacing = (config.array_columns, config.array_rows), config.element_spacing_wavelengths
        # One element alone tells no direction, and separates none.
        self._beamwidths = np.array([HALF_POWER_WIDTH / (n * spacing) if n > 1 else math.inf for n in elements])
        bins, widths = _RESOLUTION[config.processing.beamformer]
        self._resolution = (
            bins if self._model.resolution_bins is None else self._model.resolution_bins,
            widths if self._model.resolution_beamwidths is None else self._model.resolution_beamwidths,
        )
        self._doppler_bin = config.wavelength / (2.0 * config.averages * config.sweep_interval)
        self._rate_resolution = _DOPPLER_RESOLUTION[config.processing.beamformer] * self._doppler_bin
        slope = config.bandwidth_mhz * 1e6 / (config.sweep_time_ms * 1e-3)
        self._coupling = self._model.range_doppler_share * config.carrier_frequency_ghz * 1e9 / slope

    def look(
        self,
        random: np.random.Generator,
        positions: FloatArray,
        range_rates: FloatArray,
        rcs_m2: FloatArray,
        burst: int = 0,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the plots of one look, in no order.

        Parameters
        ----------
        random : numpy.random.Generator
        positions : ndarray, shape (k, 3)
            Of the aircraft in the sensor's axes forward, right, down, m; NaN for those that are not there.
        range_rates : ndarray, shape (k,)
            m/s, positive opening.
        rcs_m2 : ndarray, shape (k,)
            Mean cross-sections.
        burst : int
            So many false plots besides the false alarms.

        Returns
        -------
        z, variance : ndarray, shape (n, 4)
            As in a `Scan` of the radar's kind; the variances by the signal-to-noise ratio of each plot.
        """
        # Drawn for all aircraft, seen or not, so that one does not change the noise of another.
        fluctuation, noise = self._fluctuation(random, len(positions)), random.standard_normal((len(positions), 4))
        distance, azimuth, elevation = polar(positions)
        seen = np.flatnonzero(self._visible(distance, azimuth, elevation))
        echoes = _Echoes(seen, positions[seen], range_rates[seen], distance[seen], azimuth[seen], elevation[seen])
        snr = self._ratio(echoes.distance, echoes.azimuth, echoes.elevation, rcs_m2[seen]) * fluctuation[seen]
        echoes, snr = self._merged(random, echoes, snr)
        hit = np.flatnonzero(self._detected(random, echoes.distance, echoes.rate, snr))
        n, total = len(hit), self._sums * snr[hit]
        plots = _Echoes._make(column[hit] for column in echoes)
        false, false_rate, false_total = self._false_echoes(random, burst, self._p_fa)
        if len(false):
            columns = (np.full(len(false), -1), false, false_rate, *polar(false))
            plots = _Echoes._make(np.concatenate(pair) for pair in zip(plots, columns, strict=True))
            total = np.concatenate([total, false_total])
        z, sigma = self._measured(plots, total)
        error = sigma[:n] * noise[plots.leader[:n]]
        error[:, 0] += self._bias + self._coupling * plots.rate[:n]
        z[:n] += error
        self._fold(z)
        order = random.permutation(len(z))
        return z[order], sigma[order] ** 2

    def burst(self, random: np.random.Generator, n: int) -> tuple[FloatArray, FloatArray]:
        """Return `n` false plots just at the threshold, as `look` gives plots."""
        place, rate, total = self._false_echoes(random, n, 0.0)
        z, sigma = self._measured(_Echoes(np.full(len(place), -1), place, rate, *polar(place)), total)
        return z, sigma**2

    def visible(self, positions: FloatArray) -> NDArray[np.bool_]:
        """Return which aircraft (k, 3), in the sensor's axes, m, are within range and field of view, shape (k,)."""
        return self._visible(*polar(positions))

    def _visible(self, distance: FloatArray, azimuth: FloatArray, elevation: FloatArray) -> NDArray[np.bool_]:
        inside = (distance >= self._reach[0]) & (distance <= self._reach[1])
        return inside & (np.abs(azimuth) <= self.field_of_view[0]) & (np.abs(elevation) <= self.field_of_view[1])

    def ratio(self, positions: FloatArray, rcs_m2: FloatArray) -> FloatArray:
        """Return mean signal-to-noise ratios of echoes in one channel and sweep.

        Parameters
        ----------
        positions : ndarray, shape (k, 3)
            In the sensor's axes, m.
        rcs_m2 : ndarray, shape (k,)

        Returns
        -------
        ndarray, shape (k,)
        """
        return self._ratio(*polar(positions), rcs_m2)

    def _ratio(
        self, distance: FloatArray, azimuth: FloatArray, elevation: FloatArray, rcs_m2: FloatArray
    ) -> FloatArray:
        lost = 2.0 * lobe_loss_db(azimuth, elevation, self._config)
        return np.asarray(10.0 ** ((self._snr_at_a_metre_db - lost) / 10.0) * rcs_m2 / distance**4)

    def sigmas(self, positions: FloatArray, total: FloatArray) -> FloatArray:
        """Return the standard deviations of plots.

        Parameters
        ----------
        positions : ndarray, shape (k, 3)
            Where they are, in the sensor's axes, m.
        total : ndarray, shape (k,)
            Signal-to-noise ratio after all processing.

        Returns
        -------
        ndarray, shape (k, 4)
            Range, m; azimuth and elevation, or angle of the cone and NaN, rad; range rate, m/s, or NaN.
        """
        _, azimuth, elevation = polar(positions)
        return self._sigmas(azimuth, elevation, total)

    def _sigmas(self, azimuth: FloatArray, elevation: FloatArray, total: FloatArray) -> FloatArray:
        sigma = self._errors(azimuth, elevation, total)
        if not self._config.range_rate:
            sigma[:, 3] = np.nan
        return sigma

    def _fluctuation(self, random: np.random.Generator, k: int) -> FloatArray:
        """Draw cross-sections of a look, in terms of their means."""
        if self._config.snr_threshold_db is not None or self._config.swerling == 0:
            return np.ones(k)
        if self._config.swerling == 1:
            return random.standard_exponential(k)
        return 0.5 * random.standard_gamma(2.0, k)

    def _detected(
        self, random: np.random.Generator, distance: FloatArray, rates: FloatArray, snr: FloatArray
    ) -> NDArray[np.bool_]:
        """Draw whether adjacent bins exceed their thresholds; a fixed threshold takes the ratios as they are."""
        if not len(snr):
            return np.zeros(0, np.bool_)
        beat = beat_bins(self._config, distance, rates)
        power = (self._gain * self._kept * snr)[:, None] * self._shares(beat, rates)
        if self._config.snr_threshold_db is None:
            freedom = 2.0 * self._looks
            power = random.noncentral_chisquare(freedom, freedom * power) / freedom
        over = (power >= self._level).astype(np.float64)
        return np.asarray(group_probability(over, self._config.processing.group_bins) > 0.5)

    def _merged(self, random: np.random.Generator, echoes: _Echoes, snr: FloatArray) -> tuple[_Echoes, FloatArray]:
        """Return aircraft with those that one cell holds made one.

        The strongest of them is what the processing finds. Those that neither Doppler nor the beam towards it keeps
        from its echo make one with it: powers added, ranges, directions and rates weighted by them. Others are hidden.
        """
        # Phases and places within bins make one look resolve what another does not.
        blur = 1.0 + _SHARPNESS * (2.0 * random.random() - 1.0)
        apart = self._resolution[0] * blur * self._range_bin
        leader, places, rates, distance, *_ = echoes
        ordered = np.sort(distance)
        if len(leader) < 2 or (ordered[1:] - ordered[:-1]).min() >= apart:
            return echoes, snr
        towards = places / distance[:, None]
        cosines = towards[:, 1:]
        widths = self._resolution[1] * blur * self._beamwidths
        rest = np.argsort(-snr)
        groups = []
        while len(rest):
            near = np.abs(distance[rest] - distance[rest[0]]) < apart
            near &= (np.abs(cosines[rest] - cosines[rest[0]]) < widths).all(axis=1)
            near &= np.abs(rates[rest] - rates[rest[0]]) < self._rate_resolution
            near[0] = True
            groups.append(self._blended(rest[near], cosines, rates))
            rest = rest[~near]
        weights = [snr[g] / snr[g].sum() for g in groups]
        place = np.array([w @ towards[g] for g, w in zip(groups, weights, strict=True)])
        # The mean of two directions is shorter than they are; ranges are measured.
        far = np.array([w @ distance[g] for g, w in zip(groups, weights, strict=True)])
        place *= (far / np.sqrt((place * place).sum(axis=1)))[:, None]
        rate = np.array([w @ rates[g] for g, w in zip(groups, weights, strict=True)])
        merged = _Echoes(np.array([leader[g[0]] for g in groups]), place, rate, *polar(place))
        return merged, np.array([snr[g].sum() for g in groups])

    def _blended(self, group: NDArray[np.int64], cosines: FloatArray, rates: FloatArray) -> NDArray[np.int64]:
        """Return those of a group, the strongest first, that are one echo with the strongest."""
        strongest = group[0]
        one = (np.abs(cosines[group] - cosines[strongest]) < _BLENDED_BEAMWIDTHS * self._beamwidths).all(axis=1)
        one &= np.abs(rates[group] - rates[strongest]) < self._doppler_bin
        return np.asarray(group[one])

    def _measured(self, plots: _Echoes, totals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return plots of places without errors, NaN where not measured, and their standard deviations, (n, 4)."""
        sigma = self._sigmas(plots.azimuth, plots.elevation, totals)
        z = np.empty((len(totals), 4))
        z[:, 0], z[:, 1], z[:, 2], z[:, 3] = plots.distance, plots.azimuth, plots.elevation, plots.rate
        if self._cone:
            # Thesis (5.1): a line of elements measures the direction cosine along itself, and no more.
            z[:, 1] = np.arcsin(np.clip(plots.place[:, 1] / plots.distance, -1.0, 1.0))
        z[np.isnan(sigma)] = np.nan
        return z, sigma

    def _fold(self, z: FloatArray) -> None:
        """Bring ranges and angles that errors took past their ends back, in place."""
        z[:, 0] = np.maximum(z[:, 0], 0.5 * self._range_bin)
        # A cone has no angles beyond a quarter turn: they are mirrored.
        z[:, 1] = np.arcsin(np.sin(z[:, 1])) if self._cone else np.mod(z[:, 1] + math.pi, 2.0 * math.pi) - math.pi

    def _false_echoes(
        self, random: np.random.Generator, burst: int, p_fa: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return places, range rates and ratios after processing of false alarms, one a bin at most, and of a burst."""
        c = self._config
        alarms = self._bins[random.random(len(self._bins)) < p_fa]
        bins = np.concatenate([alarms, random.choice(self._bins, burst)]) if burst else alarms
        n = len(bins)
        if not n:
            return np.empty((0, 3)), np.empty(0), np.empty(0)
        distance = np.maximum(c.range_bin * (bins + random.random(n) - 0.5), 0.5 * c.range_bin)
        # A false alarm's power is that of noise beyond the threshold, a burst's just at it.
        excess = np.full(n, max(self._level - 1.0, 0.0))
        if len(alarms):
            p = self._p_cell * (1.0 - random.random(len(alarms)))
            excess[: len(alarms)] = threshold(p, self._looks) - 1.0
        azimuth, elevation = even_directions(random, n, self.field_of_view)
        level = np.cos(elevation)
        towards = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)], axis=1)
        rates = random.uniform(-c.range_rate_max_mps, c.range_rate_max_mps, n)
        return distance[:, None] * towards, rates, excess / self._gain * self._sums


def polar(positions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distance, azimuth and elevation, each (k,), of places (k, 3) in a sensor's axes forward, right, down."""
    distance = np.sqrt((positions**2).sum(axis=1))
    level = np.hypot(positions[:, 0], positions[:, 1])
    return distance, np.arctan2(positions[:, 1], positions[:, 0]), np.arctan2(-positions[:, 2], level)


def even_directions(
    random: np.random.Generator, n: int, field_of_view: tuple[float, float], lowest: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Draw directions evenly over the solid angle of a field of view.

    Parameters
    ----------
    random : numpy.random.Generator
    n : int
    field_of_view : tuple of float
        Half-widths in azimuth and elevation, rad.
    lowest : float, optional
        Sine of the lowest elevation; that of the field of view where not given.

    Returns
    -------
    azimuth, elevation : ndarray, shape (n,)
    """
    top = math.sin(field_of_view[1])
    azimuth = random.uniform(-field_of_view[0], field_of_view[0], n)
    return azimuth, np.arcsin(random.uniform(-top if lowest is None else lowest, top, n))
