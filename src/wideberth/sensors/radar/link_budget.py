"""The link budget of an FMCW radar: signal and noise in a range bin, and what processing gains.

Thesis 5.2, table 5.1. A bin of a sweep's spectrum is as wide as the sweep is short: its noise is k T0 F / T_c.
Signal-to-noise ratios are those of one channel and one sweep unless a gain is added.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import COUNT, FINITE, POSITIVE, FloatArray, checked, choice
from wideberth.sensors.radar.config import RadarConfig

_HALF_POWER_DB = 10.0 * math.log10(2.0)

BOLTZMANN = 1.380649e-23
NOISE_TEMPERATURE = 290.0  # K, to which noise figures refer

AVERAGINGS = ("noncoherent", "coherent")


def noise_power(config: RadarConfig) -> float:
    """Return the noise power in one range bin of one channel and sweep, referred to the receiver's input.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    float
        W.
    """
    bandwidth = 1.0 / (config.sweep_time_ms * 1e-3)
    return float(BOLTZMANN * NOISE_TEMPERATURE * bandwidth * 10.0 ** (config.noise_figure_db / 10.0))


def snr_db(
    range_m: ArrayLike, rcs_m2: ArrayLike, config: RadarConfig, *, azimuth: ArrayLike = 0.0, elevation: ArrayLike = 0.0
) -> FloatArray:
    """Return the signal-to-noise ratio of a target in one channel and one sweep.

    Add `beamforming_gain_db` and `averaging_gain_db` for what comes after. Whether the target is within the field of
    view and the instrumented range is not asked.

    Parameters
    ----------
    range_m : array_like
        Distance of the target, m. The arrays broadcast.
    rcs_m2 : array_like
        Its (mean) radar cross-section, m2.
    config : RadarConfig
    azimuth, elevation : array_like
        Direction of the target from boresight, rad.

    Returns
    -------
    ndarray
        dB.

    Raises
    ------
    ValueError
        If a range or cross-section is not finite and positive, or an angle not finite.
    """
    distance = checked("range_m", range_m, POSITIVE)
    return _snr_at_a_metre(rcs_m2, config, azimuth, elevation) - 40.0 * np.log10(distance)


def max_range(
    rcs_m2: ArrayLike,
    required_snr_db: ArrayLike,
    config: RadarConfig,
    *,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
) -> FloatArray:
    """Return the range at which `snr_db` has fallen to a value; what power allows, whatever the instrumented range.

    Parameters
    ----------
    rcs_m2 : array_like
        Radar cross-section, m2. The arrays broadcast.
    required_snr_db : array_like
        In one channel and one sweep, dB: less than what is required after processing, by the gains.
    config : RadarConfig
    azimuth, elevation : array_like
        Direction of the target from boresight, rad.

    Returns
    -------
    ndarray
        m.

    Raises
    ------
    ValueError
        If a cross-section is not finite and positive, or another value not finite.
    """
    required = checked("required_snr_db", required_snr_db, FINITE)
    return np.asarray(10.0 ** ((_snr_at_a_metre(rcs_m2, config, azimuth, elevation) - required) / 40.0))


def _snr_at_a_metre(rcs_m2: ArrayLike, config: RadarConfig, azimuth: ArrayLike, elevation: ArrayLike) -> FloatArray:
    rcs = checked("rcs_m2", rcs_m2, POSITIVE)
    constant = config.transmit_power_w * config.wavelength**2 / ((4.0 * np.pi) ** 3 * noise_power(config))
    gains = config.transmit_gain_dbi + config.receive_gain_dbi - config.losses_db
    on_boresight = 10.0 * np.log10(constant) + 10.0 * np.log10(rcs) + gains
    # The transmitting antenna and a receiving element have the same pattern.
    return np.asarray(on_boresight - 2.0 * pattern_loss_db(azimuth, elevation, config))


def pattern_loss_db(azimuth: ArrayLike, elevation: ArrayLike, config: RadarConfig) -> FloatArray:
    """Return how much less an element's gain is in a direction than on boresight, one way.

    The main lobe is taken as Gaussian, 3 dB down at half of the beamwidth: a lobe is all that the table describes.

    Parameters
    ----------
    azimuth, elevation : array_like
        From boresight, rad. They broadcast.
    config : RadarConfig

    Returns
    -------
    ndarray
        dB, 0 or more.

    Raises
    ------
    ValueError
        If an angle is not finite.
    """
    return lobe_loss_db(checked("azimuth", azimuth, FINITE), checked("elevation", elevation, FINITE), config)


def lobe_loss_db(azimuth: FloatArray, elevation: FloatArray, config: RadarConfig) -> FloatArray:
    """Return `pattern_loss_db` of angles that are known to be finite."""
    loss = np.zeros(())
    for off, width in ((azimuth, config.azimuth_beamwidth_deg), (elevation, config.elevation_beamwidth_deg)):
        loss = loss + (0.0 * off if width is None else _HALF_POWER_DB * (2.0 * off / math.radians(width)) ** 2)
    return np.asarray(loss)


def beamforming_gain_db(channels: ArrayLike) -> FloatArray:
    """Return what coherent summation of channels, steered to the target, gains: 10 log10.

    Parameters
    ----------
    channels : array_like
        Number of channels.

    Returns
    -------
    ndarray
        dB.

    Raises
    ------
    ValueError
        If a number is not whole and at least 1.
    """
    return np.asarray(10.0 * np.log10(checked("channels", channels, COUNT)))


def averaging_gain_db(averages: ArrayLike, averaging: str = "noncoherent") -> FloatArray:
    """Return what averaging sweeps gains: 10 log10 of their number if coherent; for powers, the rule of 5 log10.

    The rule states the effect on the spread of the noise. `detection.detection_probability` does without it.

    Parameters
    ----------
    averages : array_like
        Number of sweeps.
    averaging : {"noncoherent", "coherent"}

    Returns
    -------
    ndarray
        dB.

    Raises
    ------
    ValueError
        If a number is not whole and at least 1, or `averaging` another word.
    """
    choice("averaging", averaging, AVERAGINGS)
    return np.asarray((10.0 if averaging == "coherent" else 5.0) * np.log10(checked("averages", averages, COUNT)))


def migration_loss_db(closing_speed: ArrayLike, config: RadarConfig) -> FloatArray:
    """Return what a target loses in the average because it crosses range bins while sweeps are averaged.

    In the averaged spectrum a bin holds the target's power in those sweeps only during which it was in that bin, and
    noise in all of them. Taken as zero where the radar corrects for it.

    Parameters
    ----------
    closing_speed : array_like
        m/s, of either sign.
    config : RadarConfig

    Returns
    -------
    ndarray
        dB, 0 or more; for powers the share of sweeps, for coherent averages its square.

    Raises
    ------
    ValueError
        If a speed is not finite.
    """
    speed = np.abs(checked("closing_speed", closing_speed, FINITE))
    if config.migration_corrected:
        return np.zeros(speed.shape)
    crossed = speed * config.averages * config.sweep_time_ms * 1e-3 / config.range_bin
    return np.asarray((20.0 if config.averaging == "coherent" else 10.0) * np.log10(np.maximum(crossed, 1.0)))
