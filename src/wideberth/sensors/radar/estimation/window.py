"""The samples around a range bin, with the echoes that are to be taken out of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.estimation.removal_kernels import (
    beam_of_rest,
    responses_of_terms,
    take_out,
)

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Window:
    """Samples around a bin, of noise power 1, and terms that count as taken out of them.

    Attributes
    ----------
    samples : ndarray of complex, shape (sweeps, channels, bins)
        As they were heard, without the phase over bins.
    first : int
        Bin of the first column.
    waveform : ndarray
        `waveform.frame_waveform`.
    responses : ndarray of complex, shape (terms, sweeps, bins)
        Of echoes of amplitude 1.
    amplitudes : ndarray of complex, shape (terms, channels)
    """

    samples: ComplexArray
    first: int
    waveform: FloatArray
    responses: ComplexArray
    amplitudes: ComplexArray

    @classmethod
    def of(cls, samples: ComplexArray, first: int, waveform: FloatArray) -> "Window":
        """Return samples of which nothing is taken out."""
        sweeps, channels, bins = samples.shape
        nothing = np.empty((0, sweeps, bins), np.complex128), np.empty((0, channels), np.complex128)
        return cls(samples, first, waveform, *nothing)

    def less(self, paths: FloatArray, amplitudes: ComplexArray) -> "Window":
        """Return the window less echoes of these distances and range rates, (n, 2), and amplitudes, (n, channels)."""
        if not len(paths):
            return self
        responses = np.empty((len(paths), len(self.samples), self.samples.shape[2]), np.complex128)
        responses_of_terms(self.first, self.waveform, paths, responses)
        if len(self.responses):
            responses = np.concatenate([self.responses, responses])
            amplitudes = np.concatenate([self.amplitudes, amplitudes])
        return Window(self.samples, self.first, self.waveform, responses, amplitudes)

    def freed(self) -> "Window":
        """Return the same with the terms taken out of the samples."""
        if not len(self.responses):
            return self
        left = self.samples.copy()
        take_out(left.view(np.float64), self.responses, self.amplitudes)
        return Window.of(left, self.first, self.waveform)

    def beam(self, weights: ComplexArray) -> ComplexArray:
        """Return the sum of the channels with weights, shape (sweeps, bins)."""
        sweeps, _, bins = self.samples.shape
        z = np.empty((sweeps, bins), np.complex128)
        beam_of_rest(self.samples, weights, self.responses, self.amplitudes, z.view(np.float64))
        return z
