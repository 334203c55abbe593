"""The signal processing of the thesis's gate array, in whole numbers (5.2): 12, 16, 32 and 37 bits.

Where a word overflows it stays at its limit. The transform itself is exact and rounded once at its output; rounding
between its stages is not printed and not modelled.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.processing.config import FixedPointConfig
from wideberth.sensors.radar.processing.range_compression import ComplexImage

_ADC_BITS = 12  # of the board in the thesis


def _words(config: RadarConfig) -> tuple[FixedPointConfig, float]:
    """Return the word lengths, and a step of the spectrum's words in units of the image, sqrt(W)."""
    words = config.processing.fixed_point
    if words is None:
        raise ValueError("the radar has no fixed_point words")
    n = config.samples_per_sweep
    gain = (math.sqrt(2.0) if config.sampling == "real" else 1.0) / n
    return words, converter_step(config) * 2.0**words.fft_shift_bits * gain


def converter_step(config: RadarConfig) -> float:
    """Return a step of the A/D converter, V: receiver noise has `receiver.noise_rms_lsb` of them."""
    return math.sqrt(0.5 * noise_power(config) * config.samples_per_sweep) / config.receiver.noise_rms_lsb


def fixed_point_image(config: RadarConfig, samples: NDArray[Any]) -> ComplexImage:
    """Return the range-compressed image as the gate array has it, in the units of `range_compression.range_compress`.

    Parameters
    ----------
    config : RadarConfig
        With `processing.fixed_point`. The converter has `receiver.adc_bits`, or 12.
    samples : ndarray, shape (sweeps, channels, samples_per_sweep)
        V.

    Returns
    -------
    ndarray of complex64, shape (sweeps, channels, range_bins)

    Raises
    ------
    ValueError
        If the radar has no fixed_point words.
    """
    words, step = _words(config)
    half = 2 ** ((config.receiver.adc_bits or _ADC_BITS) - 1)
    parts = np.ascontiguousarray(samples).view(np.float32) / converter_step(config)
    counts = np.clip(np.rint(parts), -half, half - 1).astype(np.float64)
    if config.sampling == "complex":
        spectrum = fft.fft(counts.view(np.complex128), axis=2, workers=1)
    else:
        spectrum = fft.rfft(counts, axis=2, workers=1)[..., : config.range_bins]
    limit = 2.0 ** (words.fft_bits - 1)
    rounded = np.rint(np.ascontiguousarray(spectrum).view(np.float64) * 2.0**-words.fft_shift_bits)
    return np.asarray((np.clip(rounded, -limit, limit - 1) * step).astype(np.float32).view(np.complex64))


def fixed_point_powers(config: RadarConfig, image: ComplexImage) -> FloatArray:
    """Return the averaged powers as the gate array has them.

    The Hann window is put to the spectrum's words as a quarter of twice each less its neighbours, rounded to a word.

    Parameters
    ----------
    config : RadarConfig
        With `processing.fixed_point`.
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
        Of `fixed_point_image`.

    Returns
    -------
    ndarray, shape (channels, range_bins)
        W, of single precision.

    Raises
    ------
    ValueError
        If the radar has no fixed_point words.
    """
    words, step = _words(config)
    sums = np.zeros(image.shape[1:], np.int64)
    scale = step
    for sweep in image:
        word = np.rint(sweep.view(np.float32).reshape(*sweep.shape, 2).astype(np.float64) / step).astype(np.int64)
        if config.processing.window == "hann":
            word, scale = _hann(config, word), 2.0 * step
        product = np.minimum(np.square(word).sum(axis=2), 2 ** (words.product_bits - 1) - 1)
        sums = np.minimum(sums + product, 2 ** (words.sum_bits - 1) - 1)
    dropped = max(words.sum_bits - words.output_bits, 0)
    output = np.left_shift(np.right_shift(sums, dropped), dropped).astype(np.float32)
    return output.astype(np.float64) * (scale**2 / len(image))


def _hann(config: RadarConfig, word: NDArray[np.int64]) -> NDArray[np.int64]:
    out = 2 * word
    out[:, 1:] -= word[:, :-1]
    out[:, :-1] -= word[:, 1:]
    if config.sampling == "complex":
        out[:, 0] -= word[:, -1]
        out[:, -1] -= word[:, 0]
    else:
        out[:, 0] -= word[:, 1] * np.array([1, -1])
    return np.right_shift(out + 2, 2)
