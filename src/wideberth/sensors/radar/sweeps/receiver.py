"""The receiver of a simulated radar: coupling of its channels, their gains and phases, IF filter, noise, A/D converter.

Samples are volts across 1 ohm at the receiver's input. Noise comes in behind the coupling and before the filter.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.sensors.radar.array import element_positions
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.link_budget import noise_power
from wideberth.sensors.radar.sweeps.sweep_kernels import digitize

Samples = NDArray[np.float32 | np.complex64]

_IMAGES = 8  # bands to each side whose noise folds into the sampled one


def coupling_matrix(config: RadarConfig) -> NDArray[np.complex128]:
    """Return what channels receive of one another: the samples are this matrix times those without coupling.

    Coupling is lossless and reciprocal, hence the matrix unitary and symmetric, and the mean power of the channels that
    of the link budget; it falls with the square of the elements' distance.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    ndarray, shape (channels, channels)
    """
    places = element_positions(config)
    level = config.receiver.channel_coupling_db
    if level is None or config.channels == 1:
        return np.eye(config.channels, dtype=np.complex128)
    distance = np.linalg.norm(places[:, None] - places, axis=-1)
    np.fill_diagonal(distance, np.inf)
    exchange = np.arcsin(10.0 ** (level / 20.0)) * (distance.min() / distance) ** 2
    values, vectors = np.linalg.eigh(exchange)
    return np.asarray((vectors * np.exp(-1j * values)) @ vectors.T)


def channel_response(config: RadarConfig) -> NDArray[np.complex128]:
    """Return what the channels make of a wave: coupling, and then gains and phases that are not equal.

    The mean power of the channels stays that of the link budget.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    ndarray of complex, shape (channels, channels)
        The samples are this matrix times those of equal channels without coupling.
    """
    receiver = config.receiver
    draws = np.random.default_rng([receiver.channel_seed, config.channels]).standard_normal((2, config.channels))
    gains = 10.0 ** (receiver.channel_gain_spread_db * draws[0] / 20.0)
    gains /= np.sqrt(np.mean(gains**2))
    turned = gains * np.exp(1j * np.radians(receiver.channel_phase_spread_deg) * draws[1])
    return np.asarray(turned[:, None] * coupling_matrix(config))


def if_response(config: RadarConfig, frequency: ArrayLike) -> FloatArray:
    """Return the gain of the IF filter; its phase, the same in all channels, is left out.

    Parameters
    ----------
    config : RadarConfig
    frequency : array_like
        Of a beat, Hz. Where sampling is real its sign does not matter, where it is complex the band is from 0 to the IF
        bandwidth.

    Returns
    -------
    ndarray
        Factor of the amplitude, 1 inside the band of an ideal filter and 0 outside.

    Raises
    ------
    ValueError
        If a frequency is not finite.
    """
    f = checked("frequency", frequency, FINITE)
    receiver, band = config.receiver, 1e6 * config.if_bandwidth_mhz
    cutoff = band if receiver.if_filter_cutoff_mhz is None else 1e6 * receiver.if_filter_cutoff_mhz
    # The low-pass filter of complex samples lies around the middle of their band.
    off = np.abs(f) / cutoff if config.sampling == "real" else np.abs(f - 0.5 * band) / (0.5 * cutoff)
    if receiver.if_filter_order is None:
        gain = (off <= 1.0).astype(np.float64)
    else:
        gain = 1.0 / np.sqrt(1.0 + off ** (2 * receiver.if_filter_order))
    if receiver.high_pass_khz is not None:
        ratio = np.abs(f) / (1e3 * receiver.high_pass_khz)
        gain = gain * ratio / np.hypot(1.0, ratio)
    return np.asarray(gain)


def sample_noise(config: RadarConfig) -> float:
    """Return the standard deviation of receiver noise in a sample, of each part if it is complex, V.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    float
        sqrt(k T0 F f_s / 2).
    """
    density = noise_power(config) * config.sweep_time_ms * 1e-3
    return float(np.sqrt(0.5 * density * config.sampling_frequency))


def draw_noise(config: RadarConfig, n_sweeps: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return receiver noise behind the IF filter, in units of `sample_noise`.

    With an ideal filter it is white. Of another one it has the spectrum, with what folds in from beyond the band.

    Parameters
    ----------
    config : RadarConfig
    n_sweeps : int
    rng : numpy.random.Generator

    Returns
    -------
    ndarray, shape (n_sweeps, channels, samples, parts)
        Parts are one for real samples, two for complex ones.
    """
    samples, parts = config.samples_per_sweep, 1 if config.sampling == "real" else 2
    noise = np.empty((n_sweeps, config.channels, samples, parts), dtype=np.float32)
    rng.standard_normal(out=noise, dtype=np.float32)
    if config.receiver.if_filter_order is None and config.receiver.high_pass_khz is None:
        return noise
    rate = config.sampling_frequency
    images = rate * np.arange(-_IMAGES, _IMAGES + 1)[:, None]
    if parts == 1:
        f = fft.rfftfreq(samples, 1.0 / rate)
    else:
        f = rate * np.arange(samples) / samples  # the band is from 0 up
    shape = np.sqrt((if_response(config, f + images) ** 2).sum(axis=0)).astype(np.float32)
    for sweep in noise:  # one at a time: the spectra of all would take several times the room
        if parts == 1:
            sweep[..., 0] = fft.irfft(fft.rfft(sweep[..., 0]) * shape, samples)
        else:
            sweep.view(np.complex64)[..., 0] = fft.ifft(fft.fft(sweep.view(np.complex64)[..., 0]) * shape)
    return noise


def convert(config: RadarConfig, values: NDArray[np.float32]) -> Samples:
    """Return the samples, V: what the A/D converter makes of signals in units of `sample_noise`.

    Parameters
    ----------
    config : RadarConfig
    values : ndarray, shape (sweeps, channels, samples, parts)
        Taken over: its memory becomes that of the result.

    Returns
    -------
    ndarray of float32 or complex64, shape (sweeps, channels, samples)
    """
    receiver, unit = config.receiver, sample_noise(config)
    if receiver.adc_bits is None:
        values *= np.float32(unit)
    else:
        half = 2.0 ** (receiver.adc_bits - 1)
        gain = receiver.noise_rms_lsb
        digitize(values.reshape(-1), gain, receiver.adc_offset_lsb, -half, half - 1.0, unit / gain)
    if config.sampling == "real":
        return values[..., 0]
    return values.view(np.complex64)[..., 0]


def saturated(config: RadarConfig, samples: Samples) -> NDArray[np.intp]:
    """Return how many samples of each sweep and channel are at an end of the A/D converter's range.

    Parameters
    ----------
    config : RadarConfig
    samples : ndarray, shape (..., samples)
        V.

    Returns
    -------
    ndarray, shape (...)
        0 where no converter is modelled.
    """
    receiver = config.receiver
    if receiver.adc_bits is None:
        return np.zeros(samples.shape[:-1], dtype=np.intp)
    steps = 2.0 ** (receiver.adc_bits - 1)
    unit = sample_noise(config) / receiver.noise_rms_lsb
    low, high = np.float32((0.5 - steps) * unit), np.float32((steps - 1.5) * unit)
    full = (samples.real >= high) | (samples.real <= low)
    if np.iscomplexobj(samples):
        full |= (samples.imag >= high) | (samples.imag <= low)
    return np.asarray(np.count_nonzero(full, axis=-1))
