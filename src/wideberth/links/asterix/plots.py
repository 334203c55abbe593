"""Plots of radars: category 048 (EUROCONTROL-SPEC-0149-4)."""

import math
from typing import Any

from wideberth.links.asterix import blocks as b
from wideberth.links.config import AsterixConfig, RadarUnitConfig
from wideberth.units import DEGREE, FOOT, NAUTICAL_MILE

RANGE_STEP = NAUTICAL_MILE / 256.0
ANGLE_STEP = 2.0 * math.pi / 65536.0
HEIGHT_STEP = 25.0 * FOOT
SPEED_STEP = 1.0
_UNIFORM = 1.0 / math.sqrt(12.0)
"""Standard deviation of rounding, in steps."""


def decode_plot(record: Any, unit: RadarUnitConfig, config: AsterixConfig) -> tuple[list[float], list[float]] | str:
    """Return a plot and its standard deviations, each of 4 as in `Scan`; or why it is left out, in words.

    Parameters
    ----------
    record : Record
    unit : RadarUnitConfig
        The radar: azimuths are given from its boresight, elevations from its height.
    config : AsterixConfig

    Notes
    -----
    The elevation follows from the height over the radar of a 3-D radar (I048/110), without the Earth's curvature, as
    *down* in the local frame is minus the altitude. What steps of range (7.2 m), height and speed add is in the noise.
    """
    if not config.accept_test_targets and is_test_target(record):
        return "test target"
    if b.code(record, "020", "TYP") == 0:
        return "no detection"
    distance = b.number(record, "040", "RHO") * NAUTICAL_MILE
    bearing = b.number(record, "040", "THETA") * DEGREE
    if math.isnan(distance):
        return "plot without range or angle"
    if distance <= 0.0:
        return "range not positive"
    elevation = sigma_elevation = math.nan
    height = b.number(record, "110", "3DH") * FOOT if config.elevation == "height" else math.nan
    if not math.isnan(height):
        sine = (height - unit.altitude_m) / distance
        if abs(sine) > 1.0:
            return "height does not fit its range"
        elevation = math.asin(sine)
        across = HEIGHT_STEP * _UNIFORM / (distance * max(math.cos(elevation), 0.05))
        sigma_elevation = math.hypot(unit.elevation_sigma_deg * DEGREE, across)
    rate = math.nan
    if not b.flag(record, "120", "CAL", "D"):
        rate = config.doppler_sign * b.number(record, "120", "CAL", "CAL")
    azimuth = bearing - unit.boresight_azimuth_deg * DEGREE
    z = [distance, math.remainder(azimuth, 2.0 * math.pi), elevation, rate]
    sigma = [
        math.hypot(unit.range_sigma_m, RANGE_STEP * _UNIFORM),
        math.hypot(unit.azimuth_sigma_deg * DEGREE, ANGLE_STEP * _UNIFORM),
        sigma_elevation,
        math.hypot(unit.range_rate_sigma_mps, SPEED_STEP * _UNIFORM),
    ]
    return z, sigma


def is_test_target(record: Any) -> bool:
    """Return whether a plot is of a simulated or test target, or of a field monitor."""
    return any(b.flag(record, "020", name) for name in ("SIM", "RAB", "TST"))
