"""What the quality indicators of an ADS-B report promise, and the measurement covariance that follows.

Source: RTCA DO-260B (and 14 CFR 91.227): NACp bounds the estimated position uncertainty, the radius that holds 95 % of
the horizontal errors; NACv bounds the horizontal velocity error at 95 %; NIC bounds the containment radius R_c that is
left with the probability of the SIL. ADS-B paper, section "Error Characterization": with independent, equal normal
errors north and east the radius is Rayleigh distributed, so that ``sigma^2 = -NAC^2 / (2 ln 0.05)`` (124 ft and 8 kt
for the least accuracy that the FAA accepts, NACp 8 and NACv 1).
"""

import math
from collections.abc import Sequence

import numpy as np

from wideberth.sensors.adsb.config import AdsbNoiseConfig
from wideberth.sensors.kernels import CONTAINMENT_RADIUS, EPU, RAYLEIGH_95, VELOCITY_BOUND
from wideberth.types import FloatArray, SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE

NORMAL_95_ONE_SIDED = 1.645
"""Divisor that the ADS-B paper uses for 95 % bounds of one axis (a two-sided bound would give 1.96)."""

SIL_PROBABILITY: tuple[float, ...] = (1.0, 1e-3, 1e-5, 1e-7)
"""Probability (per hour or per sample) of an error beyond R_c without an alert, of SIL 0 to 3."""

SDA_PROBABILITY: tuple[float, ...] = (1.0, 1e-3, 1e-5, 1e-7)
"""Probability per flight hour that a fault makes the system transmit false data, of SDA 0 to 3."""


_DIAGONAL = np.arange(6)


def effective(reported: int | None, count: int, assumed: int) -> int:
    """Return a reported category, or the assumed one where none, or a reserved one, was reported.

    Parameters
    ----------
    reported : int or None
    count : int
        How many categories exist, from 0.
    assumed : int
    """
    return assumed if reported is None or not 0 <= reported < count else reported


def _lookup(table: tuple[float, ...], value: int, name: str) -> float:
    if not 0 <= value < len(table):
        raise ValueError(f"{name} {value} does not exist: give 0 to {len(table) - 1}")
    return table[value]


def position_sigma(nacp: int) -> float:
    """Return the standard deviation of the position error of one horizontal axis, m.

    Parameters
    ----------
    nacp : int
        Navigation accuracy category for position, 0 to 11.

    Raises
    ------
    ValueError
        If there is no such category.
    """
    return _lookup(EPU, nacp, "NACp") / RAYLEIGH_95


def velocity_sigma(nacv: int) -> float:
    """Return the standard deviation of the velocity error of one horizontal axis, m/s.

    Parameters
    ----------
    nacv : int
        Navigation accuracy category for velocity, 0 to 4.

    Raises
    ------
    ValueError
        If there is no such category.
    """
    return _lookup(VELOCITY_BOUND, nacv, "NACv") / RAYLEIGH_95


def nacp_of_sigma(sigma: float) -> int:
    """Return the best NACp that promises no more than a standard deviation of one horizontal axis, m."""
    return _category(EPU, sigma)


def nacv_of_sigma(sigma: float) -> int:
    """Return the best NACv that promises no more than a standard deviation of one horizontal axis, m/s."""
    return _category(VELOCITY_BOUND, sigma)


def _category(bounds: tuple[float, ...], sigma: float) -> int:
    # A standard deviation that comes from a category is to give it back.
    least = sigma * RAYLEIGH_95 * (1.0 - 1e-9)
    return max(k for k, bound in enumerate(bounds) if k == 0 or bound >= least)


def nic_bound(nic: int) -> float:
    """Return the containment radius R_c, m; infinite for NIC 0 (unknown).

    Parameters
    ----------
    nic : int
        Navigation integrity category, 0 to 11.

    Raises
    ------
    ValueError
        If there is no such category.
    """
    return _lookup(CONTAINMENT_RADIUS, nic, "NIC")


def gross_error_rate(sil: int, sda: int) -> float:
    """Return the rate of errors beyond the NIC bound, 1/h: what SIL allows without a fault plus what SDA allows with.

    Parameters
    ----------
    sil, sda : int
        Source integrity level and system design assurance, 0 to 3.

    Raises
    ------
    ValueError
        If there is no such level.
    """
    return _lookup(SIL_PROBABILITY, sil, "SIL") + _lookup(SDA_PROBABILITY, sda, "SDA")


def measurement_covariance(
    infos: Sequence[SourceInfo],
    config: AdsbNoiseConfig,
    climb_rates: FloatArray | None = None,
) -> FloatArray:
    """Return the white part of the covariance of reports, in the order of `Scan.z` of kind ``"adsb"``.

    The slowly varying part of the position error (see `position_sigma`) is not in it: a filter would average it away.
    Where the reported NACp promises less than the configured white error, the promise holds.

    Parameters
    ----------
    infos : sequence of SourceInfo
        What each of the k aircraft says of itself; the assumed values stand for what it has not said, and for reserved
        values that have no meaning.
    config : AdsbNoiseConfig
    climb_rates : ndarray, shape (k,), optional
        m/s, either sign, NaN where not reported: beyond the regime of nearly level flight the error grows with it.

    Returns
    -------
    ndarray, shape (k, 6, 6)
        Diagonal; north, east, down (m2), velocity north, east, down (m2/s2).
    """
    altitude = (config.altitude_white_sigma_ft**2 + config.altitude_resolution_ft**2 / 12.0) * FOOT**2
    resolution = config.position_resolution_m**2 / 12.0
    level = climb_rate_sigma(0.0, config) ** 2
    regime = config.climb_rate_regime_ft_per_min * FOOT_PER_MINUTE
    variances = np.empty((len(infos), 6))
    for i, info in enumerate(infos):
        nacp = effective(info.nacp, len(EPU), config.assumed_nacp)
        nacv = effective(info.nacv, len(VELOCITY_BOUND), config.assumed_nacv)
        white = min(config.position_white_sigma_m, EPU[nacp] / RAYLEIGH_95)
        horizontal = white * white + resolution
        velocity = (VELOCITY_BOUND[nacv] / RAYLEIGH_95) ** 2
        climb = level
        if climb_rates is not None and abs(climb_rates[i]) > regime:
            climb = climb_rate_sigma(float(climb_rates[i]), config) ** 2
        variances[i] = (horizontal, horizontal, altitude, velocity, velocity, climb)
    result = np.zeros((len(infos), 6, 6))
    result[:, _DIAGONAL, _DIAGONAL] = variances
    return result


def climb_rate_sigma(climb_rate: float, config: AdsbNoiseConfig) -> float:
    """Return the standard deviation of the climb-rate error, m/s.

    ADS-B paper, "Error Characterization": 27.96 ft/min (46 ft/min at 95 %, divided by 1.645) within +-500 ft/min, 5 %
    of the climb rate divided by 1.645 beyond; the resolution's part is added.

    Parameters
    ----------
    climb_rate : float
        m/s, either sign.
    config : AdsbNoiseConfig
    """
    level = config.climb_rate_sigma_ft_per_min * FOOT_PER_MINUTE
    if abs(climb_rate) > config.climb_rate_regime_ft_per_min * FOOT_PER_MINUTE:
        level = config.climb_rate_fraction_95 * abs(climb_rate) / NORMAL_95_ONE_SIDED
    return math.hypot(
        level,
        config.climb_rate_resolution_ft_per_min * FOOT_PER_MINUTE / math.sqrt(12.0),
    )
