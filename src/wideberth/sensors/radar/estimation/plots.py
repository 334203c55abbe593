"""From the peaks of a range-compressed frame to plots: range, direction and range rate with their variances.

Each peak's echo is found in the bins around it, less the echoes of stronger peaks already known; those that overlap are
fitted again in turn, each less all others, which converges to the joint maximum of the likelihood (RELAX). Variances
are those of the Fisher information at the estimate, joint for echoes that overlap, and wider where the range rate is
ambiguous or the samples hold more than the model says.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import POSITIVE, FloatArray, checked
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import (
    beam_powers,
    direction_grid,
    forward_backward,
    mvdr_spectrum,
    places_in_wavelengths,
    quadratic_spectrum,
    spectrum_peaks,
)
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.cramer_rao import direction_variances
from wideberth.sensors.radar.estimation.direction_kernels import DIRECTION, answer, fit_direction
from wideberth.sensors.radar.estimation.echo_kernels import (
    covariance_along,
    remove_echoes,
    remove_others,
    sums_of_channels,
)
from wideberth.sensors.radar.estimation.echo_search import (
    HALF_BINS,
    acquire,
    fit_range_rate,
    sharpen,
    window_reach,
)
from wideberth.sensors.radar.estimation.echoes import Channels, Echo, Estimates, part_of_energy
from wideberth.sensors.radar.estimation.joint_information import variance_ratios
from wideberth.sensors.radar.estimation.waveform import bin_phases, frame_waveform

ComplexArray = NDArray[np.complex128]

_PASSES = 25
_SETTLED = 0.0025  # energy, in noise powers, by which other echoes may have changed since an echo was fitted
_ITERATIONS = 20
_NEAR_BINS = 2 * HALF_BINS + 1
_MATTERS = 0.1  # energy of another echo in the window, in noise powers
_CHANCE = 16.0  # log-likelihood that noise reaches among the cells of a window once in ten thousand frames
_LEFT_OVER = 1e-3  # share of another echo's energy that a faulty model of it may leave
_SECOND = 0.1  # of an echo's energy, from which more energy in its bin is a second echo
_LOADING = 0.3  # of the diagonal of MVDR's covariance, in noise powers, with as many samples as channels
_PEAK = 4.0  # height of MVDR's peaks over noise
_ALIKE = 2.0  # the noise's root mean square of channels, at most
_MOST_SHARED = 0.5  # of the misfit that may pull in the direction of a parameter
_DOUBTFUL = 0.1  # misfit, as a share of the echo's energy, that makes its range rate doubtful


def estimate_plots(
    config: RadarConfig,
    image: NDArray[np.complexfloating],
    peaks: NDArray[np.integer],
    noise_power: ArrayLike,
    calibration: ArrayCalibration | None = None,
) -> Estimates:
    """Estimate range, direction and range rate of the echoes in the peaks of a frame.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex, shape (sweeps, channels, range_bins)
        From `range_compression.range_compress`, rectangular window.
    peaks : ndarray of int, shape (m,)
        Bins.
    noise_power : array_like, shape (channels,) or (channels, range_bins)
        Mean of the noise's squared magnitude.
    calibration : ArrayCalibration, optional
        Without it the channels are taken as equal and not coupled.

    Returns
    -------
    Estimates

    Raises
    ------
    ValueError
        If shapes do not fit, a peak is no bin, samples near a peak are not finite, or a noise power not positive.
    """
    frame = _Frame(config, image, noise_power, calibration)
    bins = np.asarray(peaks)
    if bins.ndim != 1 or (bins.size and not np.issubdtype(bins.dtype, np.integer)):
        raise ValueError(
            f"peaks must be whole numbers of bins in one dimension, got {bins.dtype} of shape {bins.shape}"
        )
    if bins.size and not (bins.min() >= 0 and bins.max() < config.range_bins):
        raise ValueError(f"peaks must be bins from 0 to {config.range_bins - 1}, got {bins.min()} to {bins.max()}")
    height = [frame.power_at(int(b)) for b in bins]
    echoes: list[Echo] = []
    for i in np.argsort(-np.array(height), kind="stable"):
        echoes += frame.find(int(i), int(bins[i]), echoes)
    frame.refine(echoes)
    echoes.sort(key=lambda e: (e.peak, e.fit.distance))
    return frame.estimates(echoes)


class _Frame:
    """The samples of a frame, and what is done with those around one echo."""

    def __init__(
        self,
        config: RadarConfig,
        image: NDArray[np.complexfloating],
        noise_power: ArrayLike,
        calibration: ArrayCalibration | None,
    ) -> None:
        shape = (config.channels, config.range_bins)
        if image.ndim != 3 or image.shape[1:] != shape or not len(image):
            raise ValueError(f"image must have the shape (sweeps, {shape[0]}, {shape[1]}), got {image.shape}")
        noise = checked("noise_power", noise_power, POSITIVE)
        if noise.shape not in (shape, shape[:1]):
            raise ValueError(f"noise_power must have the shape {shape[:1]} or {shape}, got {noise.shape}")
        response = ArrayCalibration.ideal(config.channels).response if calibration is None else calibration.response
        if len(response) != config.channels:
            raise ValueError(f"the calibration is of {len(response)} channels, the radar has {config.channels}")
        self.config, self.image, self.noise, self.response = config, image, noise, response
        self.waveform = frame_waveform(config, len(image))
        self.phases, self.places = bin_phases(config), places_in_wavelengths(config)
        self.grid = direction_grid(config)
        self._near: dict[int, Channels] = {}
        self._scaled: dict[int, ComplexArray] = {}
        self.rate_max = config.processing.range_rate_max_mps
        self.mirrored = config.sampling == "real"
        self.reach = window_reach(self.waveform, len(image), self.rate_max)

    def power_at(self, b: int) -> float:
        """Return the mean power in a bin."""
        return float(np.mean(np.abs(self.image[:, :, b]) ** 2))

    def channels(self, b: int) -> Channels:
        """Return what the channels are near a bin."""
        found = self._near.get(b)
        if found is None:
            noise = self.noise if self.noise.ndim == 1 else self.noise[:, b]
            found = next((c for c in self._near.values() if np.array_equal(c.noise, noise)), None)
            if found is None:
                scale = np.sqrt(noise)
                response = self.response / scale[:, None]
                energy = quadratic_spectrum(self.config, response.conj().T @ response)
                found = Channels(noise, scale, response, self.response.conj().T / scale, energy)
            self._near[b] = found
        return found

    def scale(self, b: int) -> FloatArray:
        """Return the noise's root mean square of the channels near a bin."""
        return self.channels(b).scale

    def window(self, b: int, peak: int, others: list[Echo], own: Echo | None = None) -> tuple[ComplexArray, int, float]:
        """Return the samples around a bin, of noise power 1, less other echoes; the first bin; the energy taken out.

        Of the echo's `own` only what the negative frequency of real samples leaves is taken out.
        """
        first, end = max(b - self.reach, 0), min(b + self.reach + 1, self.config.range_bins)
        scale = self.scale(b)
        if b not in self._scaled:
            self._scaled[b] = self.image[:, :, first:end] * (self.phases[first:end] / scale[:, None])
            if not np.isfinite(self._scaled[b]).all():
                raise ValueError(f"the samples around range bin {b} are not finite: leave the frame out")
        x = self._scaled[b].copy()
        known = others if own is None else [*others, own]
        if not known:
            return x, first, 0.0
        # Two echoes of one bin are told apart by direction alone if their range rates agree.
        kinds = np.array([2 if e is own else int(e.peak == peak) for e in known])
        paths = np.array([(e.fit.distance, e.fit.rate) for e in known])
        heard, modelled = np.array([e.heard for e in known]), np.array([e.modelled for e in known])
        removed = remove_others(
            x, first, b, self.reach, self.waveform, paths, heard, modelled, kinds, scale, self.mirrored, _MATTERS
        )
        return x, first, removed

    def remove(self, x: ComplexArray, first: int, echoes: list[Echo], channels: list[ComplexArray]) -> None:
        """Subtract echoes with these amplitudes of the channels."""
        if echoes:
            paths = np.array([(e.fit.distance, e.fit.rate) for e in echoes])
            remove_echoes(x, first, self.waveform, paths, np.array(channels))

    def mirror_energy(self, echo: Echo) -> float:
        """Return the energy that an echo's negative frequency leaves in the bins around the echo, in noise powers."""
        away = max(echo.beat + echo.bin - self.reach, 1.0)
        energy = float(self.energies([echo], self.scale(echo.bin))[0])
        return energy * (2 * self.reach + 1) / (np.pi * away) ** 2 if self.mirrored else 0.0

    def energies(self, echoes: list[Echo], scale: FloatArray) -> FloatArray:
        """Return the energies of echoes in all bins, in noise powers, shape (n,)."""
        heard = np.array([e.heard for e in echoes]) / scale
        return np.asarray(np.square(heard.view(np.float64)).sum(axis=1) * len(self.image))

    def energies_at(self, echoes: list[Echo], b: int) -> FloatArray:
        """Return at most how much energy echoes have in the bins used around a bin, in noise powers, shape (n,)."""
        off = np.abs(np.array([e.beat for e in echoes]) - b) - self.reach
        return np.asarray(self.energies(echoes, self.scale(b)) * part_of_energy(off))

    def find(self, peak: int, b: int, known: list[Echo]) -> list[Echo]:
        """Return the echoes in a peak; none where those known explain it."""
        x, first, removed = self.window(b, peak, known)
        distance, rate, h = acquire(x, first, self.waveform, b, self.rate_max)
        if self.config.processing.beamformer == "mvdr":
            response = self.channels(b).response
            starts = self.mvdr_directions(b, x, first, distance, rate, response)
            if len(starts) > 1:
                return self.separated(peak, b, x, first, starts, response)
        start = self.strongest_direction(h, b)
        z = self.beam_towards(start, b) @ x
        distance, rate, _ = sharpen(z, first, self.waveform, b, rate, self.rate_max)
        echo = self.fitted(peak, b, x, first, z, distance, rate, start)
        if self.config.processing.beamformer == "mvdr":
            if self.mirror_energy(echo) > _MATTERS:
                x, first, _ = self.window(b, peak, known, echo)
                echo = self.refitted(echo, x, first)
            second = self.hidden(echo, x, first)
            if second is not None:
                return self.in_turn([echo, second], x, first)
        explained = removed > 0.0 and echo.fit.likelihood < max(_CHANCE, _LEFT_OVER * removed)
        return [] if explained else [echo]

    def strongest_direction(self, h: ComplexArray, b: int) -> FloatArray:
        """Return the direction cosines of the conventional beam of most power."""
        channels = self.channels(b)
        power = beam_powers(self.config, channels.adjoint @ h) / channels.wave_energy
        down, right = divmod(int(np.argmax(np.where(self.grid.seen, power, -1.0))), power.shape[1])
        return np.array([self.grid.right[right], self.grid.down[down]])

    def mvdr_directions(
        self, b: int, x: ComplexArray, first: int, distance: float, rate: float, response: ComplexArray
    ) -> FloatArray:
        """Return the direction cosines of the peaks of MVDR's spectrum, with forward-backward averaging."""
        n = self.config.channels
        covariance = np.empty((n, n), dtype=np.complex128)
        samples = covariance_along(x, first, self.waveform, distance, rate, 1, covariance)
        loading = _LOADING * n / samples
        least = _PEAK * (1.0 + loading)
        scale = self.scale(b)
        if scale.max() > _ALIKE * scale.min():
            # Channels that hear little cannot stand in for their mirror images.
            spectrum = mvdr_spectrum(self.config, covariance, response, loading=loading)
            return spectrum_peaks(self.config, spectrum * self.channels(b).wave_energy, least)[: n - 1]
        undo = np.linalg.inv(response)
        noise = float(np.sum(np.abs(undo) ** 2)) / n
        even = forward_backward(undo @ covariance @ undo.conj().T)
        spectrum = mvdr_spectrum(self.config, even, loading=loading * noise)
        return spectrum_peaks(self.config, spectrum, least * noise / n)[: n - 1]

    def separated(
        self, peak: int, b: int, x: ComplexArray, first: int, starts: FloatArray, response: ComplexArray
    ) -> list[Echo]:
        """Return the echoes of one bin in several directions, each from a beam that shuts the others out."""
        waves = response @ np.exp(-2j * np.pi * (self.places @ starts.T))
        beams = np.linalg.pinv(waves)
        beams /= np.linalg.norm(beams, axis=1)[:, None]
        found: list[Echo] = []
        for start, beam in zip(starts, beams, strict=True):
            z = beam @ x
            _, rate, _ = acquire(z[:, None, :], first, self.waveform, b, self.rate_max)
            distance, rate, _ = sharpen(z, first, self.waveform, b, rate, self.rate_max)
            found.append(self.fitted(peak, b, x, first, z, distance, rate, start))
        return self.in_turn(found, x, first)

    def hidden(self, echo: Echo, x: ComplexArray, first: int) -> Echo | None:
        """Return a second echo in what the first of a bin leaves, if it is strong enough to be more than faults of it.

        Near the limit of its resolution MVDR's spectrum has one peak for two echoes.
        """
        rest, b, scale = x.copy(), echo.bin, self.scale(echo.bin)
        self.remove(rest, first, [echo], [echo.modelled / scale])
        _, rate, h = acquire(rest, first, self.waveform, b, self.rate_max)
        start = self.strongest_direction(h, b)
        z = self.beam_towards(start, b) @ rest
        distance, rate, likelihood = sharpen(z, first, self.waveform, b, rate, self.rate_max)
        least = max(2.0 * _CHANCE, _SECOND * echo.fit.likelihood)
        if likelihood < 0.4 * least:
            return None
        second = self.fitted(echo.peak, b, rest, first, z, distance, rate, start)
        return second if second.fit.likelihood > least else None

    def in_turn(self, found: list[Echo], x: ComplexArray, first: int) -> list[Echo]:
        """Return the echoes of one bin fitted to the samples less each other, without those that were none."""
        scale = self.scale(found[0].bin)
        for _ in range(2):
            for i in range(len(found)):
                rest = x.copy()
                others = found[:i] + found[i + 1 :]
                self.remove(rest, first, others, [e.modelled / scale for e in others])
                found[i] = self.refitted(found[i], rest, first)
        greatest = max(e.fit.likelihood for e in found)
        return [e for e in found if e.fit.likelihood > max(_CHANCE, _LEFT_OVER * greatest)]

    def beam_towards(self, cosines: FloatArray, b: int) -> ComplexArray:
        """Return the weights of unit length of the beam matched to a direction."""
        wave = np.empty(self.config.channels, dtype=np.complex128)
        answer(self.channels(b).response, self.places, cosines[0], cosines[1], wave)
        return np.asarray(wave.conj() / np.sqrt(np.vdot(wave, wave).real))

    def refitted(self, echo: Echo, x: ComplexArray, first: int, *, weighed: bool = True) -> Echo:
        """Return an echo fitted again from where it was; its range rate as it was up to the phases, if not weighed."""
        cosines = echo.direction[:2]
        z = self.beam_towards(cosines, echo.bin) @ x
        return self.fitted(echo.peak, echo.bin, x, first, z, echo.fit.distance, echo.fit.rate, cosines, weighed=weighed)

    def fitted(
        self,
        peak: int,
        b: int,
        x: ComplexArray,
        first: int,
        z: ComplexArray,
        distance: float,
        rate: float,
        start: FloatArray,
        *,
        weighed: bool = True,
    ) -> Echo:
        """Return the echo that fits best from a start on, first in a beam's samples `z`, then in all channels' `x`."""
        near = self.channels(b)
        fit = fit_range_rate(z, first, self.waveform, distance, rate, self.rate_max if weighed else 0.0)
        sums = np.empty(x.shape[:2], dtype=np.complex128)
        sums_of_channels(x, first, self.waveform, fit.distance, fit.rate, HALF_BINS, sums)
        h = sums.sum(axis=0) / fit.weight
        direction, wave = np.empty(DIRECTION), np.empty(len(h), dtype=np.complex128)
        fit_direction(h, near.response, self.places, start[0], start[1], _ITERATIONS, direction, wave)
        amplitude = np.vdot(wave, h) / np.vdot(wave, wave).real
        beat = float(self.waveform[0] * fit.distance + self.waveform[1] * fit.rate)
        return Echo(peak, b, beat, fit, direction, h * near.scale, amplitude * wave * near.scale)

    def refine(self, echoes: list[Echo]) -> None:
        """Fit those echoes again, in turn, that others disturb which were found, or have moved, after them.

        Or their own mirror images: these are taken out here.
        """
        disturbed = np.zeros(len(echoes))  # energy in the bins used that has come since the last fit, noise powers
        for i, e in enumerate(echoes):
            later = self.energies_at(echoes[i + 1 :], e.bin) if i + 1 < len(echoes) else np.zeros(0)
            mirror = self.mirror_energy(e)
            disturbed[i] = later[later > _MATTERS].sum() + (mirror if mirror > _MATTERS else 0.0)
        kept: dict[int, tuple[ComplexArray, int]] = {}  # samples of those of which the range rates are to be weighed
        for number in range(_PASSES):
            again = np.flatnonzero(disturbed > _SETTLED)
            if not len(again):
                break
            for i in again.tolist():
                old = echoes[i]
                x, first, _ = self.window(old.bin, old.peak, echoes[:i] + echoes[i + 1 :], old)
                echoes[i] = self.refitted(old, x, first, weighed=not number)
                disturbed += self.moved(old, echoes[i], echoes)
                disturbed[i] = 0.0
                if number:
                    kept[i] = (x, first)
        for i, (x, first) in kept.items():
            echoes[i] = self.refitted(echoes[i], x, first)

    def moved(self, old: Echo, new: Echo, echoes: list[Echo]) -> FloatArray:
        """Return the energy of an echo's change in the bins used of each echo, in noise powers."""
        rate = new.fit.rate - old.fit.rate
        turned = 2.0 * np.pi * self.waveform[3] * self.waveform[5] * len(self.image) * rate
        share = ((np.pi * (new.beat - old.beat)) ** 2 + 0.25 * turned**2) / 3.0
        scale = self.scale(new.bin)
        change = np.sum(np.abs((new.heard - old.heard) / scale) ** 2) + share * np.sum(np.abs(new.heard / scale) ** 2)
        off = np.abs(np.array([e.bin for e in echoes]) - new.beat) - self.reach
        return np.asarray(change * len(self.image) * part_of_energy(off))

    def neighbours(self, echoes: list[Echo], i: int) -> list[Echo]:
        """Return the echoes of which the bins used overlap with those of one."""
        moved = self.waveform[0] * self.waveform[5] * len(self.image) * 0.5
        near = []
        for j, e in enumerate(echoes):
            apart = abs(e.beat - echoes[i].beat)
            if j != i and apart <= _NEAR_BINS + moved * abs(e.fit.rate - echoes[i].fit.rate):
                near.append(e)
        return near

    def estimates(self, echoes: list[Echo]) -> Estimates:
        """Return the plots of echoes."""
        rows = [self.plot(e, self.neighbours(echoes, i)) for i, e in enumerate(echoes)]
        table = np.array(rows).reshape(len(rows), 9)
        peak = np.array([e.peak for e in echoes], dtype=np.intp)
        return Estimates(table[:, :4], table[:, 4:8], table[:, 8], peak)

    def plot(self, echo: Echo, near: list[Echo]) -> list[float]:
        """Return the four measurements of an echo, their variances, and its signal-to-noise ratio."""
        config, fit, direction = self.config, echo.fit, echo.direction
        widened = np.ones(4)
        if near:
            widened = variance_ratios(
                self.waveform,
                len(self.image),
                self.places,
                self.channels(echo.bin).response,
                [(e.fit.distance, e.fit.rate, *e.direction[:2], e.fit.amplitude) for e in (echo, *near)],
            )
        widened *= 1.0 + _MOST_SHARED * fit.misfit
        info = direction[3:6] * fit.weight
        right, down = direction[0], direction[1]
        both = 0.0
        if config.array_rows > 1 and config.array_columns > 1:
            det = info[0] * info[1] - info[2] ** 2
            var_right, var_down, both = info[1] / det, info[0] / det, -info[2] / det
        else:
            with np.errstate(divide="ignore"):
                var_right, var_down = 1.0 / info[:2]
        az, el = np.nan, np.nan
        if config.array_rows > 1:
            el = -np.arcsin(down)
        if config.array_columns > 1:
            az = np.arctan2(right, np.sqrt(max(1.0 - right**2 - (down**2 if config.array_rows > 1 else 0.0), 0.0)))
        mean = np.sqrt(widened[2] * widened[3])
        var_az, var_el = direction_variances(config, az, el, var_right * widened[2], var_down * widened[3], both * mean)
        distance, rate = (fit.distance, fit.rate) if fit.resolved else (fit.mean_distance, np.nan)
        var_distance, var_rate = fit.variance_distance * widened[0], fit.variance_rate * widened[1]
        if near and fit.misfit > _DOUBTFUL * fit.likelihood:
            # The fit may rest on a wrong turn of phase from sweep to sweep.
            span = 1.0 / (self.waveform[3] * self.waveform[5])
            rate, var_rate = np.nan, var_rate + span**2
            var_distance += (span * self.waveform[1] / self.waveform[0]) ** 2
        power = float(np.mean(np.abs(echo.modelled / self.scale(echo.bin)) ** 2))
        # The amplitude has noise of its own.
        snr = max(power - 1.0 / (fit.weight * config.channels), 0.1 * power)
        return [
            distance,
            az,
            el,
            rate,
            var_distance,
            float(var_az),
            float(var_el),
            var_rate,
            10.0 * np.log10(snr),
        ]
