"""What echoes that overlap take from each other: Fisher information of all of them together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.estimation.echo_kernels import echo_slopes

ComplexArray = NDArray[np.complex128]

_BEYOND = 8  # bins on either side of the echoes

# A parameter's column is an echo's samples or their slope (0, by distance, by rate) times a wave or its slope (0, by
# right, by down): both parts of the amplitude, distance, rate, right, down.
_SAMPLES = np.array([0, 0, 1, 2, 0, 0])
_WAVE = np.array([0, 0, 0, 0, 1, 2])
_FACTORS = np.array([1.0, 1j, 1.0, 1.0, 1.0, 1.0])
_OWN = np.array([2, 3, 4, 5])


def variance_ratios(
    waveform: FloatArray,
    sweeps: int,
    places: FloatArray,
    response: ComplexArray,
    echoes: Sequence[tuple[float, float, float, float, complex]],
) -> FloatArray:
    """Return by how much the variances of the first echo grow as the others must be estimated, too.

    Parameters
    ----------
    waveform : ndarray
        `waveform.frame_waveform`.
    sweeps : int
    places : ndarray, shape (channels, 2)
        `beamforming.places_in_wavelengths`.
    response : ndarray of complex, shape (channels, channels)
        Samples of noise power 1 for a wave's phases.
    echoes : sequence of tuple
        Distance (m), range rate (m/s), direction cosines right and down, amplitude.

    Returns
    -------
    ndarray, shape (4,)
        1 or more for distance, rate, right, down.
    """
    beats = [waveform[0] * (e[0] + e[1] * t) for e in echoes for t in (waveform[6], -waveform[6])]
    first = int(np.floor(min(beats))) - _BEYOND
    bins = int(np.ceil(max(beats))) + _BEYOND + 1 - first
    n = len(echoes)
    slopes = np.empty((n, 3, sweeps, bins), dtype=np.complex128)
    waves, factors = np.empty((n, 3, len(places)), dtype=np.complex128), np.empty((n, 6), dtype=np.complex128)
    for k, (distance, rate, right, down, amplitude) in enumerate(echoes):
        echo_slopes(first, waveform, distance, rate, slopes[k])
        wave = np.exp(-2j * np.pi * (places @ (right, down)))
        waves[k, 0], waves[k, 1:] = wave, -2j * np.pi * places.T * wave
        factors[k] = amplitude * _FACTORS
    s, w, f = slopes.reshape(3 * n, -1), (waves @ response.T).reshape(3 * n, -1), factors.ravel()
    at = 3 * np.arange(n)[:, None]
    i, j = (at + _SAMPLES).ravel(), (at + _WAVE).ravel()
    gram = (s.conj() @ s.T)[i[:, None], i] * (w.conj() @ w.T)[j[:, None], j] * (f.conj()[:, None] * f)
    information = gram.real
    size = np.sqrt(information.diagonal())
    # What an array or a single sweep cannot tell has no information.
    kept = np.flatnonzero(size > 1e-9 * size.max())
    scaled = information[kept[:, None], kept] / (size[kept, None] * size[kept])
    own = int(np.searchsorted(kept, 6))
    ratios = np.ones(6)
    ratios[kept[:own]] = _inverse_diagonal(scaled)[:own] / _inverse_diagonal(scaled[:own, :own])
    return np.asarray(np.maximum(ratios[_OWN], 1.0))


def _inverse_diagonal(matrix: FloatArray) -> FloatArray:
    """Return the diagonal of the pseudo-inverse of a symmetric matrix."""
    value, vector = np.linalg.eigh(matrix)
    inverse = np.where(value > 1e-15 * value[-1], 1.0 / np.where(value > 0.0, value, 1.0), 0.0)
    return np.asarray(vector**2 @ inverse)
