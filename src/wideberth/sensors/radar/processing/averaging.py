"""From the range-compressed image to averaged powers and correlation matrices (thesis 4.2-4.3, article eqs. 2-3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.averaged_power_kernels import add_powers
from wideberth.sensors.radar.processing.range_compression import ComplexImage

# Squares of the correlation of noise in bins 1 and 2 apart; beyond there is none.
HANN_POWER_CORRELATION = (4.0 / 9.0, 1.0 / 36.0)


def window_noise_gain(window: str) -> float:
    """Return the noise power of a windowed bin over that of a rectangular one, a target's gain being 1.

    1.5 (1.76 dB) with the Hann window.
    """
    return 1.5 if window == "hann" else 1.0


def _edges(config: RadarConfig, image: ComplexImage) -> tuple[ComplexImage, ComplexImage]:
    """Return what stands before the first and after the last bin."""
    if config.sampling == "complex":
        return image[..., -1], image[..., 0]
    # The bin of the highest frequency is not kept: the last bin is not searched.
    return image[..., 1].conj(), np.zeros_like(image[..., 0])


def windowed(config: RadarConfig, image: ComplexImage) -> ComplexImage:
    """Return the image with `config.processing.window` put to the sweeps, as a convolution of their spectra.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
        With the rectangular window.

    Returns
    -------
    ndarray of complex64, of the same shape
        With the gain 1 for a target in the middle of a bin.
    """
    if config.processing.window == "rectangular":
        return image
    out = image.copy()
    half = np.float32(0.5)
    out[..., 1:] -= half * image[..., :-1]
    out[..., :-1] -= half * image[..., 1:]
    before, after = _edges(config, image)
    out[..., 0] -= half * before
    out[..., -1] -= half * after
    return out


def channel_powers(config: RadarConfig, image: ComplexImage, *, moving_target: bool = False) -> FloatArray:
    """Return the averaged power of each channel and bin: the diagonals of the averaged correlation matrices.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
        With the rectangular window; `config.processing.window` is put to it here.
    moving_target : bool
        Take out the mean over the sweeps, and with it what stands still; the mean of noise is kept.

    Returns
    -------
    ndarray, shape (channels, range_bins)
        W.

    Raises
    ------
    ValueError
        If the mean is to be taken out of a single sweep.
    """
    sweeps, channels, bins = image.shape
    if moving_target and sweeps < 2:
        raise ValueError("a moving-target filter needs 2 or more sweeps in a frame")
    before, after = _edges(config, image)
    power = np.empty((channels, bins))
    mean = np.empty((channels, 2 * bins if moving_target else 0))
    adjacent = image if image.strides[2] == image.itemsize else np.ascontiguousarray(image)
    rows = adjacent.view(np.float32)
    hann = config.processing.window == "hann"
    for channel in range(channels):
        left, right = (np.stack([e[:, channel].real, e[:, channel].imag], axis=1) for e in (before, after))
        add_powers(
            rows[:, channel], hann, left.astype(np.float64), right.astype(np.float64), power[channel], mean[channel]
        )
    if not moving_target:
        return np.asarray(power / sweeps)
    still = (mean**2).reshape(channels, bins, 2).sum(axis=2) / sweeps
    return np.asarray(np.maximum(power - still, 0.0) / (sweeps - 1))


def moving_targets(image: ComplexImage) -> ComplexImage:
    """Return the image without its mean over the sweeps: what stands still is gone, whatever its power.

    Parameters
    ----------
    image : ndarray of complex64, shape (sweeps, channels, range_bins)

    Returns
    -------
    ndarray of complex64, of the same shape
    """
    return np.asarray(image - image.mean(axis=0, dtype=np.complex128), dtype=np.complex64)


def correlation_matrices(image: ComplexImage, bins: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Return the averaged correlation matrices of some range bins (4.2).

    Parameters
    ----------
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
    bins : ndarray of int, shape (m,)

    Returns
    -------
    ndarray of complex, shape (m, channels, channels)
        W. Element (j, k) is the mean over the sweeps of channel j times the conjugate of channel k.
    """
    values = image[:, :, bins].transpose(2, 1, 0).astype(np.complex128)
    return np.asarray(values @ values.conj().swapaxes(1, 2)) / len(image)


@dataclass(frozen=True, slots=True)
class DetectionPower:
    """What the threshold is put to.

    Attributes
    ----------
    power : ndarray, shape (range_bins,)
        W; the mean of `looks` powers, or the greatest of `cells` such means.
    looks : float
        Independent powers in a mean.
    cells : int
        Doppler cells and beams that are looked into.
    """

    power: FloatArray
    looks: float
    cells: int


def detection_power(
    config: RadarConfig, image: ComplexImage, powers: FloatArray, channels: NDArray[np.bool_]
) -> DetectionPower:
    """Return what the threshold is put to, as `config.averaging` and `config.detect_on` say.

    Noncoherent averaging on channels is the mean power of the channels (4.3). Coherent averaging looks at all Doppler
    cells of the frame, as a target's range rate is not known, and detection on beams at as many beams as there are
    channels, at right angles to each other: the greatest counts.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
        With the rectangular window; without what stands still if that is taken out.
    powers : ndarray, shape (channels, range_bins)
        Of `channel_powers`.
    channels : ndarray of bool, shape (channels,)
        Those that are used.

    Returns
    -------
    DetectionPower
    """
    used, sweeps = int(channels.sum()), len(image)
    still_gone = config.processing.clutter_filter == "moving_target"
    if config.averaging == "noncoherent" and config.detect_on == "channels":
        return DetectionPower(powers[channels].mean(axis=0), float(used * (sweeps - still_gone)), 1)
    values = windowed(config, image)
    looks, cells = 1.0, 1
    if config.detect_on == "beam":
        # Channels left out are empty.
        grid = np.where(channels[:, None], values, 0).reshape(sweeps, config.array_rows, config.array_columns, -1)
        gain = np.float32(np.sqrt(config.channels / used))
        values = gain * fft.fft2(grid, axes=(1, 2), norm="ortho", workers=1).reshape(values.shape)
        cells *= config.channels
    else:
        values = values[:, channels]
        looks *= used
    if config.averaging == "coherent":
        values = fft.fft(values, axis=0, norm="ortho", workers=1)[1 if still_gone else 0 :]
        cells *= len(values)
    else:
        looks *= sweeps - still_gone
    power = np.square(values.real) + np.square(values.imag)
    if config.averaging == "noncoherent":
        power = power.sum(axis=0, keepdims=True) / (sweeps - still_gone)
    if config.detect_on == "channels":
        power = power.mean(axis=1, keepdims=True)
    return DetectionPower(power.max(axis=(0, 1)).astype(np.float64), looks, cells)
