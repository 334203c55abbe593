"""The samples of a frame around range bins, put to noise of power 1 and freed of the echoes that are known."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import POSITIVE, FloatArray, checked
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import direction_grid, places_in_wavelengths, quadratic_spectrum
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.echo_search import window_reach
from wideberth.sensors.radar.estimation.echoes import Channels, Echo
from wideberth.sensors.radar.estimation.removal_kernels import terms_of_others, whiten
from wideberth.sensors.radar.estimation.waveform import bin_phases, frame_waveform
from wideberth.sensors.radar.estimation.window import Window

MATTERS = 0.1
"""Energy of another echo in the bins around one, in noise powers, from which on it is taken out."""


class FrameSamples:
    """The samples of a frame around its peaks, and how they are cut out and freed of known echoes.

    Parameters
    ----------
    config, image, noise_power, calibration
        As for `plots.estimate_plots`.
    """

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
        self._alike: dict[bytes, Channels] = {}  # by the noise: mostly that of all bins is the same
        self._windows: dict[int, Window] = {}
        self.calibrated = calibration is not None
        self.rate_max = config.processing.range_rate_max_mps
        self.mirrored = config.sampling == "real"
        self.reach = window_reach(self.waveform, len(image), self.rate_max)

    def power_at(self, b: int) -> float:
        """Return the mean power in a bin, over the noise's."""
        heard = self.raw(b)
        x = heard.samples[:, :, b - heard.first]
        return float(np.mean(np.square(x.real) + np.square(x.imag)))

    def channels(self, b: int) -> Channels:
        """Return what the channels are near a bin."""
        found = self._near.get(b)
        if found is None:
            noise = self.noise if self.noise.ndim == 1 else self.noise[:, b]
            found = self._alike.get(noise.tobytes())
            if found is None:
                scale = np.sqrt(noise)
                response = self.response / scale[:, None]
                energy = quadratic_spectrum(self.config, response.conj().T @ response)
                found = Channels(scale, response, self.response.conj().T / scale, energy)
                self._alike[noise.tobytes()] = found
            self._near[b] = found
        return found

    def scale(self, b: int) -> FloatArray:
        """Return the noise's root mean square of the channels near a bin."""
        return self.channels(b).scale

    def raw(self, b: int) -> Window:
        """Return the samples around a bin."""
        window = self._windows.get(b)
        if window is None:
            # Read but once: sweeps and channels are far apart.
            scale = self.scale(b)
            first, end = max(b - self.reach, 0), min(b + self.reach + 1, self.config.range_bins)
            samples = np.empty((len(self.image), len(scale), end - first), np.complex128)
            if not whiten(self.image[:, :, first:end], self.phases[first:end], scale, samples):
                raise ValueError(f"the samples around range bin {b} are not finite: leave the frame out")
            window = self._windows[b] = Window.of(samples, first, self.waveform)
        return window

    def window(self, b: int, peak: int, others: list[Echo], own: Echo | None = None) -> tuple[Window, float]:
        """Return the samples around a bin, less other echoes, and the energy of those near it.

        Of the echo's `own` only what the negative frequency of real samples leaves is taken out.
        """
        scale, window = self.scale(b), self.raw(b)
        known = others if own is None else [*others, own]
        if not known:
            return window, 0.0
        # Two echoes of one bin are told apart by direction alone if their range rates agree.
        kinds = np.array([2 if e is own else int(e.peak == peak) for e in known])
        paths = np.array([(e.fit.distance, e.fit.rate) for e in known])
        heard, modelled = np.array([e.heard for e in known]), np.array([e.modelled for e in known])
        terms, amplitudes = np.empty((2 * len(known), 2)), np.empty((2 * len(known), len(scale)), np.complex128)
        sweeps, _, bins = window.samples.shape
        n, near = terms_of_others(
            b,
            self.reach,
            window.first,
            bins,
            sweeps,
            self.waveform,
            paths,
            heard,
            modelled,
            kinds,
            scale,
            self.mirrored,
            MATTERS,
            terms,
            amplitudes,
        )
        return window.less(terms[:n], amplitudes[:n]), near
