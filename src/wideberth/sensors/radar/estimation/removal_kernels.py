"""Kernels that take known echoes out of the samples around another: of all channels, or only of what is made of them.

An echo to be taken out is a path (distance, range rate) with the amplitudes of the channels: a term. Its responses in
the bins of interest are had once; beams and correlations of the samples are then freed of it at one channel's cost.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.sensors.radar.estimation.echo_kernels import (
    CELLS,
    TERMS,
    WAVEFORM,
    bin_responses,
    correlated_cells,
    echo_of_sweep,
    middle_series,
    used_responses,
)

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_FAR = 12.0  # bins, from which on only the ends of the sweep count
_ROUND = 0.02  # of the angle of Dirichlet's kernel, up to which it is the sinc


@jit
def whiten(image: NDArray[np.complex64], phases: ComplexArray, scale: FloatArray, x: ComplexArray) -> bool:
    """Fill `x` (sweeps, channels, bins) with an image of that shape times `phases` (bins,) over `scale` (channels,).

    Return whether all of it is finite.
    """
    finite = True
    for c in range(image.shape[1]):
        over = 1.0 / scale[c]
        for k in range(image.shape[0]):
            size = 0.0
            for b in range(image.shape[2]):
                value = image[k, c, b] * (phases[b] * over)
                x[k, c, b] = value
                size += abs(value.real) + abs(value.imag)
            finite = finite and size < math.inf
    return finite


@jit_uncounted
def terms_of_others(
    at: int,
    reach: int,
    first: int,
    bins: int,
    sweeps: int,
    waveform: FloatArray,
    paths: FloatArray,
    heard: ComplexArray,
    modelled: ComplexArray,
    kinds: NDArray[np.int64],
    scale: FloatArray,
    mirrored: bool,
    least: float,
    terms: FloatArray,
    amplitudes: ComplexArray,
) -> tuple[int, float]:
    """Choose what known echoes have to be taken out around bin `at`: where they leave an energy of `least` there.

    Parameters
    ----------
    at, reach : int
        The bins of interest are those within `reach` of `at`.
    first, bins, sweeps : int
        Of the samples.
    waveform : ndarray
    paths : ndarray, shape (n, 2)
        Distances and range rates.
    heard, modelled : ndarray of complex, shape (n, channels)
        Amplitudes as measured, and those of a wave from the echo's direction.
    kinds : ndarray of int, shape (n,)
        0: take out the amplitudes that were heard. 1: those that are modelled. 2: this is the echo at `at` itself, of
        which only the mirror image goes.
    scale : ndarray, shape (channels,)
        By which the samples were divided.
    mirrored : bool
        Samples are real: the conjugate, that is of negative distance and rate, is there too.
    least : float
    terms : ndarray, shape (2 n, 2)
        Set to the paths of what goes.
    amplitudes : ndarray of complex, shape (2 n, channels)
        Set to its amplitudes, over `scale`.

    Returns
    -------
    tuple of int, float
        How many terms, and the energy of those of echoes within `reach`, less with the square of the bins between.
    """
    m = scale.shape[0]
    removed, n = 0.0, 0
    for e in range(paths.shape[0]):
        distance, rate = paths[e, 0], paths[e, 1]
        energy = 0.0
        for c in range(m):
            a = heard[e, c] / scale[c]
            amplitudes[n, c] = a.conjugate()
            energy += a.real * a.real + a.imag * a.imag
        energy *= sweeps
        beat = waveform[0] * distance + waveform[1] * rate
        if mirrored and energy * bins > least * (math.pi * max(beat + first, 1.0)) ** 2:
            terms[n, 0], terms[n, 1] = -distance, -rate
            n += 1
        if kinds[e] == 2 or energy * part_of_energy(abs(beat - at) - reach, bins) <= least:
            continue
        energy = 0.0
        for c in range(m):
            a = (modelled[e, c] if kinds[e] == 1 else heard[e, c]) / scale[c]
            amplitudes[n, c] = a
            energy += a.real * a.real + a.imag * a.imag
        terms[n, 0], terms[n, 1] = distance, rate
        n += 1
        if abs(beat - at) <= reach:
            # What a fault of the model leaves falls off with the distance from the bins that the echo crosses.
            crossed = waveform[0] * abs(rate) * sweeps * waveform[5]
            removed += energy * sweeps / max(abs(beat - at) - 0.5 * crossed - 1.0, 1.0) ** 2
    return n, removed


@jit_uncounted
def part_of_energy(off: float, bins: int) -> float:
    """Return at most which part of an echo's energy is in so many bins that begin `off` bins from it."""
    return 1.0 if off < 1.0 else min(bins / (math.pi * off) ** 2, 1.0)


@jit
def responses_of_terms(first: int, waveform: FloatArray, terms: FloatArray, responses: ComplexArray) -> None:
    """Fill `responses` (n, sweeps, bins from `first` on) with those of paths of amplitude 1, `terms` (n, 2)."""
    bins = responses.shape[2]
    cells, turns = np.empty((CELLS, bins)), np.empty((2, bins))
    for j in range(bins):
        turns[0, j], turns[1, j] = math.cos(j * math.pi / waveform[8]), math.sin(j * math.pi / waveform[8])
    # Far off, bins know that a sweep has a number of samples: Dirichlet's kernel, not the sinc.
    angle = math.pi / waveform[8]
    for e in range(terms.shape[0]):
        distance, rate = terms[e, 0], terms[e, 1]
        q = waveform[2] * rate
        for k in range(responses.shape[1]):
            beat, _, _, phasor = echo_of_sweep(waveform, k, distance, rate)
            middle = round(beat)
            sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
            sign = 1.0 - 2.0 * (abs(first - middle) % 2)
            sine *= sign
            cosine *= sign
            delta = beat - first
            if min(abs(delta), abs(delta - bins + 1)) > _FAR + abs(q) and delta * (delta - bins + 1) > 0.0:
                phasor *= complex(math.cos(0.5 * math.pi * q), math.sin(0.5 * math.pi * q))
                _far_responses(delta, sine, cosine, q, angle, turns, cells)
            else:
                bin_responses(delta, sine, cosine, q, bins, cells)
                for j in range(bins):
                    y = angle * (delta - j)
                    if abs(y) > _ROUND:
                        cells[0, j] *= y / math.sin(y)
                        cells[1, j] *= y / math.sin(y)
            for j in range(bins):
                responses[e, k, j] = complex(
                    cells[0, j] * phasor.real - cells[1, j] * phasor.imag,
                    cells[0, j] * phasor.imag + cells[1, j] * phasor.real,
                )


@jit_uncounted
def _far_responses(
    delta: float, sine: float, cosine: float, q: float, angle: float, turns: FloatArray, parts: FloatArray
) -> None:
    """Fill `parts` (2 or more, n) with the responses of bins so far off that only the two ends of the sweep count.

    They are exp(i pi q / 2) / (pi (delta^2 - q^2)) times (sin(pi delta) delta, cos(pi delta) q), of which the first
    factor is left to the caller. `turns` (2, n) are cosines and sines of `angle` times 0, 1, ...
    """
    start_sine, start_cosine = math.sin(angle * delta), math.cos(angle * delta)
    for j in range(turns.shape[1]):
        at = delta - j
        sign = 1.0 - 2.0 * (j % 2)
        # angle at / sin(angle at) takes the sinc to Dirichlet's kernel.
        scale = sign * angle * at / ((start_sine * turns[0, j] - start_cosine * turns[1, j]) * math.pi)
        scale /= at * at - q * q
        parts[0, j] = scale * sine * at
        parts[1, j] = scale * cosine * q


@jit
def take_out(rows: FloatArray, responses: ComplexArray, amplitudes: ComplexArray) -> None:
    """Subtract terms of `responses` (n, sweeps, bins) and `amplitudes` (n, channels) from samples.

    `rows` (sweeps, channels, 2 bins) are the samples, real and imaginary parts in turn.
    """
    terms, bins = responses.shape[0], responses.shape[2]
    # A term times an amplitude is real part times `straight` plus imaginary part times `turned`.
    straight, turned = np.empty((terms, 2 * bins)), np.empty((terms, 2 * bins))
    for k in range(rows.shape[0]):
        for e in range(terms):
            for j in range(bins):
                r = responses[e, k, j]
                straight[e, 2 * j], straight[e, 2 * j + 1] = r.real, r.imag
                turned[e, 2 * j], turned[e, 2 * j + 1] = -r.imag, r.real
        for c in range(rows.shape[1]):
            for e in range(terms):
                re, im = amplitudes[e, c].real, amplitudes[e, c].imag
                for j in range(2 * bins):
                    rows[k, c, j] -= re * straight[e, j] + im * turned[e, j]


@jit
def beam_of_rest(
    x: ComplexArray, weights: ComplexArray, responses: ComplexArray, amplitudes: ComplexArray, z: FloatArray
) -> None:
    """Sum the channels of samples `x` (sweeps, channels, bins) less terms, with weights.

    `z` (sweeps, 2 bins): real and imaginary parts in turn. Terms as in `take_out`.
    """
    terms, bins = responses.shape[0], responses.shape[2]
    shares = np.zeros(terms, dtype=np.complex128)
    for e in range(terms):
        for c in range(weights.shape[0]):
            shares[e] += amplitudes[e, c] * weights[c]
    for k in range(x.shape[0]):
        for j in range(2 * bins):
            z[k, j] = 0.0
        for c in range(weights.shape[0]):
            _add_product(weights[c], x[k, c], z[k])
        for e in range(terms):
            _add_product(-shares[e], responses[e, k], z[k])


@jit_uncounted
def _add_product(factor: complex, values: ComplexArray, total: FloatArray) -> None:
    re, im = factor.real, factor.imag
    for j in range(values.shape[0]):
        v = values[j]
        total[2 * j] += re * v.real - im * v.imag
        total[2 * j + 1] += re * v.imag + im * v.real


@jit
def amplitudes_of_channels(
    x: ComplexArray,
    first: int,
    waveform: FloatArray,
    distance: float,
    rate: float,
    half: int,
    responses: ComplexArray,
    amplitudes: ComplexArray,
    h: ComplexArray,
) -> None:
    """Correlate the channels of samples less terms with an echo: `h` (channels,).

    `x` is (sweeps, channels, bins from `first` on); terms as in `take_out`.
    """
    terms, channels = responses.shape[0], x.shape[1]
    cells, series = np.empty((CELLS, 2 * half + 1)), np.empty((CELLS, TERMS))
    middle_series(waveform[2] * rate, series)
    shares = np.zeros(terms, dtype=np.complex128)
    for c in range(channels):
        h[c] = 0.0
    for k in range(x.shape[0]):
        beat, _, _, phasor = echo_of_sweep(waveform, k, distance, rate)
        at = used_responses(beat, waveform[2] * rate, half, series, cells) - first
        for c in range(channels):
            h[c] += phasor.conjugate() * correlated_cells(x[k, c], at, half, cells)
        for e in range(terms):
            shares[e] += phasor.conjugate() * correlated_cells(responses[e, k], at, half, cells)
    for e in range(terms):
        for c in range(channels):
            h[c] -= shares[e] * amplitudes[e, c]


def warmup() -> None:
    """Compile what Python calls."""
    waveform, one = np.ones(WAVEFORM), np.ones((1, 1), dtype=np.complex128)
    kinds, scale = np.zeros(1, dtype=np.int64), np.ones(1)
    terms_of_others(
        0,
        1,
        0,
        1,
        1,
        waveform,
        np.ones((1, 2)),
        one,
        one,
        kinds,
        scale,
        True,
        1.0,
        np.zeros((2, 2)),
        np.ones((2, 1), dtype=np.complex128),
    )
    x = np.zeros((1, 1, 1), dtype=np.complex128)
    whiten(np.zeros((2, 1, 2), dtype=np.complex64)[:1, :, :1], one[0], scale, x)
    responses_of_terms(0, waveform, np.ones((1, 2)), x)
    take_out(np.zeros((1, 1, 2)), x, one)
    beam_of_rest(x, one[0], x, one, np.zeros((1, 2)))
    amplitudes_of_channels(x, 0, waveform, 1.0, 0.0, 1, x, one, one[0])
