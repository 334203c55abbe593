"""From the peaks of a range-compressed frame to plots: range, direction and range rate with their variances.

Each peak's echo is found in the bins around it, less the echoes of stronger peaks already known; those that overlap are
fitted again in turn, each less all others, which converges to the joint maximum of the likelihood (RELAX). Variances
are those of the Fisher information at the estimate, joint for echoes that overlap, and wider where the range rate is
ambiguous or the samples hold more than the model says.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import (
    beam_powers,
    forward_backward,
    mvdr_spectrum,
    spectrum_peaks,
)
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.direction_kernels import DIRECTION
from wideberth.sensors.radar.estimation.direction_pair import direction_pair, single_misfit
from wideberth.sensors.radar.estimation.echo_fit_kernels import beam_towards, fit_in_channels
from wideberth.sensors.radar.estimation.echo_kernels import covariance_along
from wideberth.sensors.radar.estimation.echo_search import (
    HALF_BINS,
    acquire,
    rates_allowed,
    sharpen,
    weighed_fit,
)
from wideberth.sensors.radar.estimation.echoes import Echo, Estimates, part_of_energy
from wideberth.sensors.radar.estimation.frame_samples import MATTERS, FrameSamples
from wideberth.sensors.radar.estimation.measurements import measured, neighbours
from wideberth.sensors.radar.estimation.range_rate_kernels import FIT
from wideberth.sensors.radar.estimation.window import Window

ComplexArray = NDArray[np.complex128]

_PASSES = 25
_SETTLED = 0.0025  # energy, in noise powers, by which other echoes may have changed since an echo was fitted
_CHANCE = 16.0  # log-likelihood that noise reaches among the cells of a window once in ten thousand frames
_LEFT_OVER = 1e-3  # share of another echo's energy that a faulty model of it may leave
_SECOND = 0.1  # of an echo's energy, from which more energy in its bin is a second echo; and with channels calibrated
_SECOND_CALIBRATED = 0.01
_COHERENT_CELLS = 2.0  # of range and Doppler, within which two echoes may be one wave front
_LOADING = 0.3  # of the diagonal of MVDR's covariance, in noise powers, with as many samples as channels
_PEAK = 4.0  # height of MVDR's peaks over noise
_ALIKE = 2.0  # the noise's root mean square of channels, at most


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
    height = [frame.power_at(int(b)) for b in bins]  # over the noise's
    echoes: list[Echo] = []
    for i in np.argsort(-np.array(height), kind="stable"):
        echoes += frame.find(int(i), int(bins[i]), echoes)
    frame.refine(echoes)
    echoes.sort(key=lambda e: (e.peak, e.fit.distance))
    return frame.estimates(echoes)


class _Frame(FrameSamples):
    """What is done with the samples around one echo, and with all of them in turn."""

    def second_share(self) -> float:
        """Return the share of an echo's energy from which on more energy in its bin is a second echo."""
        return _SECOND_CALIBRATED if self.calibrated else _SECOND

    def mirror_energy(self, echo: Echo) -> float:
        """Return the energy that an echo's negative frequency leaves in the bins around the echo, in noise powers."""
        away = max(echo.beat + echo.bin - self.reach, 1.0)
        heard = echo.heard / self.scale(echo.bin)
        energy = len(self.image) * float(np.vdot(heard, heard).real)
        return energy * (2 * self.reach + 1) / (np.pi * away) ** 2 if self.mirrored else 0.0

    def energies_around(self, echoes: list[Echo]) -> FloatArray:
        """Return at most how much energy each echo (column) has in the bins used of each (row), in noise powers."""
        off = np.abs(np.array([e.beat for e in echoes]) - np.array([e.bin for e in echoes])[:, None]) - self.reach
        heard = np.abs(np.array([e.heard for e in echoes])) ** 2
        over = np.array([self.scale(e.bin) for e in echoes]) ** -2.0
        return np.asarray(len(self.image) * (over @ heard.T) * part_of_energy(off))

    def find(self, peak: int, b: int, known: list[Echo]) -> list[Echo]:
        """Return the echoes in a peak; none where those known explain it."""
        heard, removed = self.window(b, peak, known)
        window = heard.freed()
        distance, rate, h = acquire(window.samples, window.first, self.waveform, b, self.rate_max)
        if self.config.processing.beamformer == "mvdr":
            starts = self.mvdr_directions(b, window, distance, rate)
            if len(starts) > 1:
                found = self.separated(peak, b, window, starts)
                return self.parted_in_wave_front(found, window) if self.coherent(found) else found
        start = self.strongest_direction(h, b)
        z = self.beam_towards(start, b, window)
        distance, rate, _ = sharpen(z, window.first, self.waveform, b, rate, self.rate_max)
        echo = self.fitted(peak, b, window, z, distance, rate, start)
        if self.config.processing.beamformer == "mvdr":
            if self.mirror_energy(echo) > MATTERS:
                window, _ = self.window(b, peak, known, echo)
                echo = self.refitted(echo, window)
            pair = self.pair_in_wave_front(echo)
            if pair:
                return self.in_turn(pair, window)
            second = self.hidden(echo, window)
            if second is not None:
                return self.in_turn([echo, second], window)
        explained = removed > 0.0 and echo.fit.likelihood < max(_CHANCE, _LEFT_OVER * removed)
        return [] if explained else [echo]

    def strongest_direction(self, h: ComplexArray, b: int) -> FloatArray:
        """Return the direction cosines of the conventional beam of most power."""
        channels = self.channels(b)
        power = beam_powers(self.config, channels.adjoint @ h) / channels.wave_energy
        down, right = divmod(int(np.argmax(np.where(self.grid.inside, power, -1.0))), power.shape[1])
        return np.array([self.grid.right[right], self.grid.down[down]])

    def mvdr_directions(self, b: int, window: Window, distance: float, rate: float) -> FloatArray:
        """Return the direction cosines of the peaks of MVDR's spectrum, with forward-backward averaging."""
        n, response = self.config.channels, self.channels(b).response
        covariance = np.empty((n, n), dtype=np.complex128)
        samples = covariance_along(window.samples, window.first, self.waveform, distance, rate, 1, covariance)
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

    def separated(self, peak: int, b: int, window: Window, starts: FloatArray) -> list[Echo]:
        """Return the echoes of one bin in several directions, each from a beam that shuts the others out."""
        waves = self.channels(b).response @ np.exp(-2j * np.pi * (self.places @ starts.T))
        beams = np.linalg.pinv(waves)
        beams /= np.linalg.norm(beams, axis=1)[:, None]
        found: list[Echo] = []
        for start, beam in zip(starts, beams, strict=True):
            z = window.beam(beam)
            _, rate, _ = acquire(z[:, None, :], window.first, self.waveform, b, self.rate_max)
            distance, rate, _ = sharpen(z, window.first, self.waveform, b, rate, self.rate_max)
            found.append(self.fitted(peak, b, window, z, distance, rate, start))
        return self.in_turn(found, window)

    def coherent(self, found: list[Echo]) -> bool:
        """Return whether these may be two echoes that keep their phase to each other over the frame."""
        if len(found) != 2:
            return False
        turns = (found[0].fit.rate - found[1].fit.rate) * self.waveform[3] * self.waveform[5]
        cells = abs(turns - round(turns)) * len(self.image)  # which turn it is the weaker one tells badly
        return cells < _COHERENT_CELLS and abs(found[0].beat - found[1].beat) < _COHERENT_CELLS

    def parted_in_wave_front(self, found: list[Echo], window: Window) -> list[Echo]:
        """Return two echoes in the directions that fit the wave front best, where MVDR's, biased, leave more of it."""
        whole = max(found, key=lambda e: e.fit.likelihood)
        start = 0.5 * (found[0].direction + found[1].direction)
        z = self.beam_towards(whole.direction, whole.bin, window)
        both = self.fitted(whole.peak, whole.bin, window, z, whole.fit.distance, whole.fit.rate, start)
        pair = self.in_turn(self.wave_front(both, start)[0], window)
        return min(found, pair, key=lambda echoes: self.left(window, echoes))

    def left(self, window: Window, echoes: list[Echo]) -> float:
        """Return the energy in a window less echoes of its bin."""
        rest = self.without(window, echoes).freed().samples
        return float(np.vdot(rest, rest).real)

    def pair_in_wave_front(self, echo: Echo) -> list[Echo]:
        """Return two echoes that keep their phase to each other, if the wave front of one is none of a wave."""
        scale = self.scale(echo.bin)
        least = max(2.0 * _CHANCE, self.second_share() * echo.fit.likelihood)
        misfit = echo.fit.weight * single_misfit(echo.heard / scale, echo.modelled / scale)
        if misfit < least:
            return []
        pair, left = self.wave_front(echo, echo.direction)
        return pair if misfit - echo.fit.weight * left > least else []

    def wave_front(self, echo: Echo, start: FloatArray) -> tuple[list[Echo], float]:
        """Return the two echoes that make a wave front, and the energy that they leave of it, over the weight."""
        near = self.channels(echo.bin)
        directions, amplitudes, left = direction_pair(self.config, echo.heard / near.scale, near.response, start[:2])
        pair = []
        for cosines, amplitude in zip(directions, amplitudes, strict=True):
            wave = near.response @ np.exp(-2j * np.pi * (self.places @ cosines)) * amplitude * near.scale
            pair.append(replace(echo, direction=np.append(cosines, echo.direction[2:]), heard=wave, modelled=wave))
        return pair, left

    def hidden(self, echo: Echo, window: Window) -> Echo | None:
        """Return a second echo in what the first of a bin leaves, if it is strong enough to be more than faults of it.

        Near the limit of its resolution MVDR's spectrum has one peak for two echoes.
        """
        b = echo.bin
        rest = self.without(window, [echo]).freed()
        _, rate, h = acquire(rest.samples, rest.first, self.waveform, b, self.rate_max)
        start = self.strongest_direction(h, b)
        z = self.beam_towards(start, b, rest)
        distance, rate, likelihood = sharpen(z, rest.first, self.waveform, b, rate, self.rate_max)
        least = max(2.0 * _CHANCE, self.second_share() * echo.fit.likelihood)
        if likelihood < 0.4 * least:
            return None
        second = self.fitted(echo.peak, b, rest, z, distance, rate, start)
        return second if second.fit.likelihood > least else None

    def without(self, window: Window, echoes: list[Echo]) -> Window:
        """Return a window less echoes of its bin, with the amplitudes of waves from their directions."""
        paths = np.array([(e.fit.distance, e.fit.rate) for e in echoes])
        amplitudes: ComplexArray = np.array([e.modelled / self.scale(e.bin) for e in echoes], np.complex128)
        return window.less(paths, amplitudes)

    def in_turn(self, found: list[Echo], window: Window) -> list[Echo]:
        """Return the echoes of one bin fitted to the samples less each other, without those that were none."""
        for _ in range(2):
            for i in range(len(found)):
                found[i] = self.refitted(found[i], self.without(window, found[:i] + found[i + 1 :]))
        greatest = max(e.fit.likelihood for e in found)
        return [e for e in found if e.fit.likelihood > max(_CHANCE, _LEFT_OVER * greatest)]

    def beam_towards(self, cosines: FloatArray, b: int, window: Window) -> ComplexArray:
        """Return the samples of the beam matched to a direction, of noise power 1, shape (sweeps, bins)."""
        z = np.empty((window.samples.shape[0], window.samples.shape[2]), np.complex128)
        terms, response = (window.responses, window.amplitudes), self.channels(b).response
        beam_towards(window.samples, *terms, response, self.places, cosines[0], cosines[1], z.view(np.float64))
        return z

    def refitted(self, echo: Echo, window: Window, *, weighed: bool = True) -> Echo:
        """Return an echo fitted again from where it was; its range rate as it was up to the phases, if not weighed."""
        cosines = echo.direction[:2]
        z = self.beam_towards(cosines, echo.bin, window)
        return self.fitted(echo.peak, echo.bin, window, z, echo.fit.distance, echo.fit.rate, cosines, weighed=weighed)

    def fitted(
        self,
        peak: int,
        b: int,
        window: Window,
        z: ComplexArray,
        distance: float,
        rate: float,
        start: FloatArray,
        *,
        weighed: bool = True,
    ) -> Echo:
        """Return the echo that fits best from a start on, first in a beam's samples `z`, then in all channels."""
        near, channels = self.channels(b), self.config.channels
        rate_max = self.rate_max if weighed else 0.0
        fits, direction = np.empty((rates_allowed(self.waveform, rate_max), FIT)), np.empty(DIRECTION)
        heard, modelled = np.empty(channels, np.complex128), np.empty(channels, np.complex128)
        n = fit_in_channels(
            window.samples,
            z,
            window.first,
            self.waveform,
            window.responses,
            window.amplitudes,
            near.response,
            self.places,
            distance,
            rate,
            start[0],
            start[1],
            rate_max,
            HALF_BINS,
            fits,
            direction,
            heard,
            modelled,
        )
        fit = weighed_fit(fits[:n], len(z), self.waveform, rate_max)
        beat = float(self.waveform[0] * fit.distance + self.waveform[1] * fit.rate)
        return Echo(peak, b, beat, fit, direction, heard * near.scale, modelled * near.scale)

    def refine(self, echoes: list[Echo]) -> None:
        """Fit those echoes again, in turn, that others disturb which were found, or have moved, after them.

        Or their own mirror images: these are taken out here.
        """
        if not echoes:
            return
        # Energy in the bins used that has come since the last fit, noise powers.
        later = np.triu(self.energies_around(echoes), 1)
        mirror = np.array([self.mirror_energy(e) for e in echoes])
        disturbed = np.where(later > MATTERS, later, 0.0).sum(axis=1) + np.where(mirror > MATTERS, mirror, 0.0)
        kept: dict[int, Window] = {}  # samples of those of which the range rates are to be weighed
        for number in range(_PASSES):
            again = np.flatnonzero(disturbed > _SETTLED)
            if not len(again):
                break
            for i in again.tolist():
                old = echoes[i]
                window, _ = self.window(old.bin, old.peak, echoes[:i] + echoes[i + 1 :], old)
                echoes[i] = self.refitted(old, window, weighed=not number)
                disturbed += self.moved(old, echoes[i], echoes)
                disturbed[i] = 0.0
                if number:
                    kept[i] = window
        for i, window in kept.items():
            echoes[i] = self.refitted(echoes[i], window)

    def moved(self, old: Echo, new: Echo, echoes: list[Echo]) -> FloatArray:
        """Return the energy of an echo's change in the bins used of each echo, in noise powers."""
        rate = new.fit.rate - old.fit.rate
        turned = 2.0 * np.pi * self.waveform[3] * self.waveform[5] * len(self.image) * rate
        share = ((np.pi * (new.beat - old.beat)) ** 2 + 0.25 * turned**2) / 3.0
        scale = self.scale(new.bin)
        step, heard = (new.heard - old.heard) / scale, new.heard / scale
        change = np.vdot(step, step).real + share * np.vdot(heard, heard).real
        off = np.abs(np.array([e.bin for e in echoes]) - new.beat) - self.reach
        return np.asarray(change * len(self.image) * part_of_energy(off))

    def estimates(self, echoes: list[Echo]) -> Estimates:
        """Return the plots of echoes."""
        rows = []
        for e in echoes:
            near = neighbours(echoes, e, self.waveform, len(self.image))
            rows.append(measured(self.config, self.waveform, len(self.image), self.channels(e.bin), e, near))
        table = np.array(rows).reshape(len(rows), 9)
        peak = np.array([e.peak for e in echoes], dtype=np.intp)
        return Estimates(table[:, :4], table[:, 4:8], table[:, 8], peak)
