"""From samples to the range-compressed image: the spectrum of each sweep and channel (thesis 4.1, article III.A)."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from wideberth.sensors.radar.config import RadarConfig

ComplexImage = NDArray[np.complex64]


def checked_samples(config: RadarConfig, samples: NDArray[Any]) -> NDArray[Any]:
    """Return samples in single precision, after a look at their shape and kind.

    Parameters
    ----------
    config : RadarConfig
    samples : ndarray, shape (sweeps, channels, samples_per_sweep)
        V. Real or complex as `config.sampling` says.

    Returns
    -------
    ndarray of float32 or complex64, C-contiguous

    Raises
    ------
    ValueError
        If the shape or the kind of numbers is not that of the radar.
    """
    values = np.asarray(samples)
    wanted = (config.channels, config.samples_per_sweep)
    if values.ndim != 3 or values.shape[1:] != wanted or not len(values):
        raise ValueError(
            f"samples must have the shape (sweeps, {wanted[0]}, {wanted[1]}), of this radar's channels and samples a "
            f"sweep, got {values.shape}"
        )
    if values.dtype.kind not in ("iuf" if config.sampling == "real" else "c"):
        raise ValueError(f"samples of a radar with {config.sampling} sampling cannot be {values.dtype}")
    return np.ascontiguousarray(values, dtype=np.float32 if config.sampling == "real" else np.complex64)


def range_compress(config: RadarConfig, samples: NDArray[Any]) -> ComplexImage:
    """Return the range-compressed image: bin i stands for the range i times `config.range_bin`.

    The window is rectangular. A target of received power P in the middle of a bin has the squared magnitude P there,
    and receiver noise has the mean squared magnitude `link_budget.noise_power`: the real samples of such a target have
    the amplitude sqrt(2 P), complex ones sqrt(P). Bin 0 of real samples is real.

    Parameters
    ----------
    config : RadarConfig
    samples : ndarray, shape (sweeps, channels, samples_per_sweep)
        V, at 1 ohm.

    Returns
    -------
    ndarray of complex64, shape (sweeps, channels, range_bins)
        sqrt(W). Where a sweep of a channel holds NaN or infinity, so does all of its spectrum.

    Raises
    ------
    ValueError
        If the shape or the kind of numbers is not that of the radar.
    """
    values = checked_samples(config, samples)
    if config.sampling == "complex":
        return np.asarray(fft.fft(values, axis=2, norm="forward", workers=1), dtype=np.complex64)
    spectrum = fft.rfft(values, axis=2, workers=1)
    parts = spectrum.view(np.float32)  # real numbers scale faster than complex ones
    parts *= np.float32(math.sqrt(2.0) / config.samples_per_sweep)
    return np.asarray(spectrum[..., : config.range_bins])  # the highest frequency is no bin of a range
