"""From the range-compressed image to averaged powers and correlation matrices (thesis 4.2-4.3, article eqs. 2-3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.waveform import bin_phases
from wideberth.sensors.radar.processing.averaged_power_kernels import add_powers
from wideberth.sensors.radar.processing.range_compression import ComplexImage
from wideberth.sensors.radar.range_cells import cells_searched, migration_paths


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
    left, right = (np.stack([e.T.real, e.T.imag], axis=2).astype(np.float64) for e in _edges(config, image))
    power = np.empty((channels, bins))
    mean = np.empty((channels, 2 * bins if moving_target else 0))
    values, by_sweep, by_channel = _in_one_dimension(image)
    hann = config.processing.window == "hann"
    for c in range(channels):
        add_powers(values[c * by_channel :], by_sweep, hann, left[c], right[c], power[c], mean[c])
    if not moving_target:
        return np.asarray(power / sweeps)
    still = (mean**2).reshape(channels, bins, 2).sum(axis=2) / sweeps
    return np.asarray(np.maximum(power - still, 0.0) / (sweeps - 1))


def _in_one_dimension(image: ComplexImage) -> tuple[NDArray[np.float32], int, int]:
    """Return the memory of an image as real numbers, and how many of them are from sweep to sweep and channel."""
    if image.strides[2] != image.itemsize or min(image.strides) < 0:
        image = np.ascontiguousarray(image)
    sweeps, channels, bins = image.shape
    by_sweep, by_channel = (stride // image.itemsize for stride in image.strides[:2])
    held = (sweeps - 1) * by_sweep + (channels - 1) * by_channel + bins
    values = np.lib.stride_tricks.as_strided(image, (held,), (image.itemsize,), writeable=False)
    return values.view(np.float32), 2 * by_sweep, 2 * by_channel


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
        Doppler cells, beams and paths that are looked into.
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
    channels, at right angles to each other: the greatest counts. So it does of the paths through range bins
    (`range_cells.migration_paths`) if `config.migration_corrected`, each averaged along itself.

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
    paths = migration_paths(config, sweeps)
    simple = config.averaging == "noncoherent" and config.detect_on == "channels"
    if simple and len(paths) == 1:
        return DetectionPower(powers[channels].mean(axis=0), float(used * (sweeps - still_gone)), 1)
    values = windowed(config, image)
    looks = 1.0
    if config.detect_on == "beam":
        # Channels left out are empty.
        grid = np.where(channels[:, None], values, 0).reshape(sweeps, config.array_rows, config.array_columns, -1)
        gain = np.float32(np.sqrt(config.channels / used))
        values = gain * fft.fft2(grid, axes=(1, 2), norm="ortho", workers=1).reshape(values.shape)
    else:
        values = values[:, channels]
        looks *= used
    if config.averaging == "noncoherent":
        looks *= sweeps - still_gone
    if simple:
        values = (np.square(values.real) + np.square(values.imag)).mean(axis=1, keepdims=True)
    elif len(paths) > 1:
        values = values * bin_phases(config).astype(np.complex64)
    bins = np.arange(values.shape[2])
    power = np.zeros(len(bins))
    for path in paths:
        along = values
        if path.any():
            # Beyond the ends of the image it is mirrored: noise as good as any.
            at = np.abs(bins + path[:, None])
            at = np.minimum(at, 2 * (len(bins) - 1) - at)
            along = np.take_along_axis(values, at[:, None], axis=2)
        np.maximum(power, _greatest_power(config, along, still_gone, powers=simple), out=power)
    return DetectionPower(power, looks, cells_searched(config, sweeps))


def _greatest_power(config: RadarConfig, values: NDArray[Any], still_gone: bool, *, powers: bool) -> FloatArray:
    """Return the averaged power of each bin in the cell that has most; `values` are powers of sweeps, or amplitudes."""
    if config.averaging == "coherent":
        values = fft.fft(values, axis=0, norm="ortho", workers=1)[1 if still_gone else 0 :]
    power = values if powers else np.square(values.real) + np.square(values.imag)
    if config.averaging == "noncoherent":
        power = power.sum(axis=0, keepdims=True) / (len(values) - still_gone)
    if config.detect_on == "channels":
        power = power.mean(axis=1, keepdims=True)
    return np.asarray(power.max(axis=(0, 1)), dtype=np.float64)
