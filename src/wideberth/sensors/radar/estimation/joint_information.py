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
    samples, waves, factors = [], [], []
    for distance, rate, right, down, amplitude in echoes:
        slopes = np.empty((3, sweeps, bins), dtype=np.complex128)
        echo_slopes(first, waveform, distance, rate, slopes)
        samples.append(slopes.reshape(3, -1))
        wave = np.exp(-2j * np.pi * (places @ (right, down)))
        waves.append(
            np.stack([wave, -2j * np.pi * places[:, 0] * wave, -2j * np.pi * places[:, 1] * wave]) @ response.T
        )
        factors.append(amplitude * np.array([1.0, 1j, 1.0, 1.0, 1.0, 1.0]))
    s, w, f = np.concatenate(samples), np.concatenate(waves), np.concatenate(factors)
    at = 3 * np.arange(len(echoes)).repeat(6)
    i, j = at + np.tile(_SAMPLES, len(echoes)), at + np.tile(_WAVE, len(echoes))
    gram = (s.conj() @ s.T)[np.ix_(i, i)] * (w.conj() @ w.T)[np.ix_(j, j)] * np.outer(f.conj(), f)
    information = gram.real
    size = np.sqrt(np.diag(information))
    # What an array or a single sweep cannot tell has no information.
    kept = np.flatnonzero(size > 1e-9 * size.max())
    scaled = information[np.ix_(kept, kept)] / np.outer(size[kept], size[kept])
    own = kept < 6
    joint = np.diag(np.linalg.pinv(scaled, hermitian=True))[own]
    alone = np.diag(np.linalg.pinv(scaled[np.ix_(own, own)], hermitian=True))
    ratios = np.ones(6)
    ratios[kept[own]] = joint / alone
    return np.asarray(np.maximum(ratios[_OWN], 1.0))
