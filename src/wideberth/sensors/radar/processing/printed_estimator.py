"""Range and direction of peaks as printed: the parabola with its correction, and the beam of greatest power (5.2)."""

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import conventional_spectrum, direction_grid, mvdr_spectrum
from wideberth.sensors.radar.estimation.calibration import ArrayCalibration
from wideberth.sensors.radar.estimation.cramer_rao import bounds
from wideberth.sensors.radar.estimation.echoes import Estimates
from wideberth.sensors.radar.processing.averaging import correlation_matrices, windowed
from wideberth.sensors.radar.processing.peak_interpolation import RangeSpread, parabola_offset
from wideberth.sensors.radar.processing.range_compression import ComplexImage
from wideberth.sensors.radar.range_cells import window_noise_gain

_BIN_ERROR = 0.1  # of the corrected parabola, bins
_LEAST_SNR = 0.1


def estimate_printed(
    config: RadarConfig,
    image: ComplexImage,
    power: FloatArray,
    peaks: NDArray[np.intp],
    noise_power: FloatArray,
    calibration: ArrayCalibration | None = None,
) -> Estimates:
    """Return range and direction of peaks; range rate is not measured.

    The range is that of the beat, as printed: an opening target seems farther by its range rate times f_c T_c / B. The
    variances are the Cramer-Rao bounds, and for the range that of the coupling (range rates even up to
    `range_rate_max_mps`) and of the correction, a tenth of a bin.

    Parameters
    ----------
    config : RadarConfig
    image : ndarray of complex64, shape (sweeps, channels, range_bins)
        With the rectangular window.
    power : ndarray, shape (range_bins,)
        Averaged power, in which the peaks were found, W.
    peaks : ndarray of int, shape (m,)
        Not the first nor the last bin.
    noise_power : ndarray, shape (channels, range_bins)
        Of the image, W.
    calibration : ArrayCalibration, optional

    Returns
    -------
    Estimates
        One for each peak.
    """
    processing, sweeps = config.processing, len(image)
    magnitude = np.sqrt(power)
    offset = parabola_offset(magnitude[peaks - 1], magnitude[peaks], magnitude[peaks + 1])
    if processing.range_spread is not None:
        offset = RangeSpread(*processing.range_spread)(offset)
    # What the window lets in beside the bin is not of the target's channel.
    bins = np.unique(np.clip(peaks[:, None] + np.arange(-1, 2), 0, config.range_bins - 1))
    around = np.zeros((sweeps, config.channels, config.range_bins), np.complex64)
    wide = np.unique(np.clip(bins[:, None] + np.arange(-1, 2), 0, config.range_bins - 1))
    around[:, :, wide] = image[:, :, wide]
    matrices = correlation_matrices(windowed(config, around), peaks)
    gain = window_noise_gain(processing.window)
    response = None if calibration is None else calibration.response
    grid = direction_grid(config)
    z = np.full((len(peaks), 4), np.nan)
    variance = np.full((len(peaks), 4), np.inf)
    snr_db = np.empty(len(peaks))
    coupling = config.carrier_frequency_ghz * config.sweep_time_ms / config.bandwidth_mhz  # s
    for i, (b, matrix) in enumerate(zip(peaks, matrices, strict=True)):
        noise = gain * float(noise_power[:, b].mean())
        if processing.beamformer == "mvdr":
            spectrum = mvdr_spectrum(config, matrix, response, loading=noise)
        else:
            spectrum = conventional_spectrum(config, matrix, response)
        row, column = np.unravel_index(np.argmax(np.where(grid.seen, spectrum, -np.inf)), spectrum.shape)
        right = _interpolated(grid.right, spectrum[row], int(column))
        down = _interpolated(grid.down, spectrum[:, column], int(row))
        snr = max(float(matrix.diagonal().real.mean()) / noise - 1.0, _LEAST_SNR) * gain
        snr_db[i] = 10.0 * np.log10(snr)
        az = el = np.nan
        if config.array_rows > 1:
            el = -np.arcsin(np.clip(down, -1.0, 1.0))
        if config.array_columns > 1:
            across = 1.0 - right**2 - (down**2 if config.array_rows > 1 else 0.0)
            az = np.arctan2(right, np.sqrt(max(across, 0.0)))
        z[i, :3] = (b + offset[i]) * config.range_bin, az, el
        least = bounds(
            config, snr_db[i], azimuth=np.nan_to_num(az), elevation=np.nan_to_num(el), sweeps=sweeps, rate_known=True
        )
        variance[i, :3] = least[:3] ** 2
        variance[i, 0] += (_BIN_ERROR * config.range_bin) ** 2 + (coupling * processing.range_rate_max_mps) ** 2 / 3.0
    variance[:, 3] = processing.range_rate_max_mps**2 / 3.0
    return Estimates(z, variance, snr_db, np.arange(len(peaks)))


def _interpolated(axis: FloatArray, values: FloatArray, i: int) -> float:
    """Return the place of a peak on an even grid, with the parabola through its neighbours (5.6)."""
    if not 0 < i < len(axis) - 1:
        return float(axis[i])
    return float(axis[i] + parabola_offset(*values[i - 1 : i + 2]) * (axis[1] - axis[0]))
