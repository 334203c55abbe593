"""Kernel of the whole fit of an echo: range and range rate in a beam, then the channels, then the direction."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit
from wideberth.sensors.radar.estimation.direction_kernels import DIRECTION, answer, fit_direction
from wideberth.sensors.radar.estimation.echo_kernels import WAVEFORM
from wideberth.sensors.radar.estimation.range_rate_kernels import FIT, fit_range_rates
from wideberth.sensors.radar.estimation.removal_kernels import amplitudes_of_channels, beam_of_rest

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ITERATIONS = 20


@jit
def beam_towards(
    x: ComplexArray,
    responses: ComplexArray,
    amplitudes: ComplexArray,
    response: ComplexArray,
    places: FloatArray,
    right: float,
    down: float,
    z: FloatArray,
) -> None:
    """Fill `z` (sweeps, 2 bins) with the beam of unit noise matched to a direction, real and imaginary parts in turn.

    Samples and terms as in `removal_kernels.take_out`, the channels' answer as in `direction_kernels.fit_direction`.
    """
    weights = np.empty(x.shape[1], dtype=np.complex128)
    answer(response, places, right, down, weights)
    energy = 0.0
    for c in range(weights.shape[0]):
        energy += weights[c].real * weights[c].real + weights[c].imag * weights[c].imag
    for c in range(weights.shape[0]):
        weights[c] = weights[c].conjugate() / math.sqrt(energy)
    beam_of_rest(x, weights, responses, amplitudes, z)


@jit
def fit_in_channels(
    x: ComplexArray,
    z: ComplexArray,
    first: int,
    waveform: FloatArray,
    responses: ComplexArray,
    amplitudes: ComplexArray,
    response: ComplexArray,
    places: FloatArray,
    distance: float,
    rate: float,
    right: float,
    down: float,
    rate_max: float,
    half: int,
    fits: FloatArray,
    direction: FloatArray,
    heard: ComplexArray,
    modelled: ComplexArray,
) -> int:
    """Fit an echo from a start on in a beam `z` (sweeps, bins), then its direction in the channels.

    Samples and terms as in `removal_kernels.take_out`, `fits` as in `range_rate_kernels.fit_range_rates`, of which the
    number of rows is returned; `direction` as in `direction_kernels.fit_direction`. `heard` and `modelled` (channels,)
    are the channels' amplitudes, and those of a wave from the direction.
    """
    n = fit_range_rates(z, first, waveform, distance, rate, rate_max, half, fits)
    amplitudes_of_channels(x, first, waveform, fits[0, 0], fits[0, 1], half, responses, amplitudes, heard)
    for c in range(heard.shape[0]):
        heard[c] *= 1.0 / max(fits[0, 5], 1e-300)
    fit_direction(heard, response, places, right, down, _ITERATIONS, direction, modelled)
    shared, energy = 0j, 0.0
    for c in range(heard.shape[0]):
        a = modelled[c]
        shared += a.conjugate() * heard[c]
        energy += a.real * a.real + a.imag * a.imag
    shared /= energy
    for c in range(heard.shape[0]):
        modelled[c] *= shared
    return n


def warmup() -> None:
    """Compile what Python calls."""
    x, none = np.ones((2, 2, 2), dtype=np.complex128), np.empty((0, 2, 2), dtype=np.complex128)
    few, response = np.empty((0, 2), dtype=np.complex128), np.eye(2, dtype=np.complex128)
    places = np.array([[-0.25, 0.0], [0.25, 0.0]])
    beam_towards(x, none, few, response, places, 0.0, 0.0, np.zeros((2, 4)))
    at, h = (1.0, 0.0, 0.0, 0.0, 1.0, 1), np.ones(2, dtype=np.complex128)
    z = np.ones((2, 2), dtype=np.complex128)
    waveform, fits = np.ones(WAVEFORM), np.zeros((3, FIT))
    fit_in_channels(x, z, 0, waveform, none, few, response, places, *at, fits, np.zeros(DIRECTION), h, h.copy())
