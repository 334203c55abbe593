"""Cramer-Rao bounds of a target's range, direction and range rate in one frame of an FMCW radar.

For one echo of unknown amplitude and phase, the same in all sweeps and, but for the wave's phases, in all channels; its
carrier phase tells range only modulo half a wavelength, so range is from the beat alone. The total signal-to-noise
ratio is that of a channel and sweep, in a bin that holds the target, times channels and sweeps.
"""

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import COUNT, FINITE, FloatArray, checked
from wideberth.sensors.radar.config import SPEED_OF_LIGHT, RadarConfig
from wideberth.sensors.radar.estimation.beamforming import places_in_wavelengths


def bounds(
    config: RadarConfig,
    snr_db: ArrayLike,
    *,
    azimuth: float = 0.0,
    elevation: float = 0.0,
    sweeps: int | None = None,
    rate_known: bool = False,
) -> FloatArray:
    """Return the least standard deviations that unbiased estimates can have.

    Parameters
    ----------
    config : RadarConfig
    snr_db : array_like
        Of one channel and one sweep, dB.
    azimuth, elevation : float
        Of the target, rad; of an array of one row (or column) its angle from the plane across is bounded.
    sweeps : int, optional
        In the frame; `averages` of the radar by default.
    rate_known : bool
        Whether the range rate need not be estimated. If it must, from one sweep, range is not bounded at all.

    Returns
    -------
    ndarray, shape (..., 4)
        Range (m), azimuth, elevation (rad), range rate (m/s); infinite where it cannot be had. For an array of one
        row the angle is in the place of azimuth; of one column, in that of elevation.

    Raises
    ------
    ValueError
        If a number is not finite, or `sweeps` not whole and at least 1.
    """
    snr = 10.0 ** (checked("snr_db", snr_db, FINITE) / 10.0)
    n = int(checked("sweeps", config.averages if sweeps is None else sweeps, COUNT))
    total = 2.0 * (2.0 * np.pi) ** 2 * snr * n * config.channels
    by_range, by_rate = 1.0 / config.range_bin, 2e-3 * config.carrier_frequency_ghz * 1e9 / SPEED_OF_LIGHT
    by_rate *= config.sweep_time_ms
    spread = config.sweep_interval**2 * (n * n - 1) / 12.0
    in_beat = 1.0 / 12.0  # mean square of a sweep's time around its middle
    carrier = 2.0 / config.wavelength
    information = np.array(
        [
            [by_range**2 * in_beat, by_range * by_rate * in_beat],
            [
                by_range * by_rate * in_beat,
                carrier**2 * spread + (by_rate**2 + by_range**2 * spread) * in_beat,
            ],
        ]
    )
    if rate_known:
        distance, rate = 1.0 / information[0, 0], 0.0
    elif n == 1:
        distance, rate = np.inf, np.inf
    else:
        distance, rate = np.diag(np.linalg.inv(information))
    with np.errstate(divide="ignore"):
        right, down = 1.0 / np.mean(places_in_wavelengths(config) ** 2, axis=0)
    angles = direction_variances(config, azimuth, elevation, right, down)
    return np.asarray(np.sqrt(np.array([distance, *angles, rate]) / total[..., None]))


def direction_variances(
    config: RadarConfig,
    azimuth: ArrayLike,
    elevation: ArrayLike,
    right: ArrayLike,
    down: ArrayLike,
    both: ArrayLike = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Return the variances of azimuth and elevation that follow from those of the direction cosines.

    Parameters
    ----------
    config : RadarConfig
    azimuth, elevation : array_like
        rad. Of an array of one row the azimuth is the angle from the plane across the row; of one column the elevation.
    right, down, both : array_like
        Variances of the direction cosines, and their covariance.

    Returns
    -------
    tuple of ndarray
        rad2; infinite for the angle that an array of one row or column does not measure.
    """
    az, el = np.asarray(azimuth), np.asarray(elevation)
    none = np.full(np.broadcast_shapes(az.shape, np.shape(right)), np.inf)
    if config.array_rows == 1:
        return (none if config.array_columns == 1 else np.asarray(right / np.cos(az) ** 2)), none
    if config.array_columns == 1:
        return none, np.asarray(down / np.cos(el) ** 2)
    # right = cos(el) sin(az), down = -sin(el)
    by_right, by_down = 1.0 / (np.cos(el) * np.cos(az)), -np.tan(az) * np.tan(el) / np.cos(el)
    turned = by_right**2 * right + by_down**2 * down + 2.0 * by_right * by_down * both
    return np.asarray(turned), np.asarray(down / np.cos(el) ** 2)
