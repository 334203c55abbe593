"""How far a sensor reaches: a radar by cross-section, ADS-B by the class of the intruder's transmitter."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wideberth.analysis.sensor_sizing import available_range
from wideberth.analysis.sizing_config import AdsbSizingConfig
from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.coverage import confirmed_range, detection_range, looks_and_gain_db
from wideberth.sensors.radar.detection import required_snr_db
from wideberth.sensors.radar.link_budget import averaging_gain_db, snr_db
from wideberth.units import DEGREE, NAUTICAL_MILE

SECTIONS = (0.01, 0.1, 1.0, 10.0)
"""Cross-sections, m2."""

CLOSING_SPEEDS = (25.0, 50.0, 100.0)
"""m/s."""

CLASSES = ("A0", "A1", "A2", "A3")


@dataclass(frozen=True, slots=True)
class RadarReach:
    """How far a radar reaches on boresight, by cross-section (first axis).

    Attributes
    ----------
    sections : ndarray, shape (c,)
        m2.
    ranges : ndarray, shape (r,)
        A quarter, half and all of the greatest range that is looked at, m.
    snr : ndarray, shape (c, r)
        Signal-to-noise ratio there, one channel and one sweep, dB.
    detection_probability : float
        With which a scan detects the target at `detection`.
    detection : ndarray, shape (c,)
        m.
    closing_speeds : ndarray, shape (v,)
        m/s.
    confirmed : ndarray, shape (c, v)
        Range of a confirmed track, m; 0 where it comes too late.
    """

    sections: FloatArray
    ranges: FloatArray
    snr: FloatArray
    detection_probability: float
    detection: FloatArray
    closing_speeds: FloatArray
    confirmed: FloatArray

    @property
    def lost(self) -> FloatArray:
        """What confirming a track costs of the range, shape (c, v), m."""
        return np.asarray(self.detection[:, None] - self.confirmed)


def radar_reach(
    radar: RadarConfig, *, sections: Sequence[float] = SECTIONS, closing_speeds: Sequence[float] = CLOSING_SPEEDS
) -> RadarReach:
    """Return how far a radar reaches on boresight.

    Parameters
    ----------
    radar : RadarConfig
    sections : sequence of float
        Cross-sections, m2.
    closing_speeds : sequence of float
        m/s.

    Returns
    -------
    RadarReach

    Raises
    ------
    ValueError
        If a cross-section or speed is not finite and positive.
    """
    rcs, closing = np.array(sections, np.float64), np.array(closing_speeds, np.float64)
    ranges = radar.range_limit * np.array([0.25, 0.5, 1.0])
    wanted = radar.confirmation_probability
    azimuth, elevation = radar.boresight_azimuths_deg[0] * DEGREE, radar.boresight_elevation_deg * DEGREE
    return RadarReach(
        rcs,
        ranges,
        snr_db(ranges, rcs[:, None], radar),
        wanted,
        detection_range(rcs, wanted, radar),
        closing,
        confirmed_range(rcs[:, None], closing, radar, azimuth=azimuth, elevation=elevation),
    )


def needed_snr_db(radar: RadarConfig, probability: float) -> float:
    """Return the signal-to-noise ratio of one channel and sweep with which a scan detects a target.

    Parameters
    ----------
    radar : RadarConfig
    probability : float
        Not used where the radar has a threshold on the ratio.

    Returns
    -------
    float
        dB.
    """
    looks, gain = looks_and_gain_db(radar)
    if radar.snr_threshold_db is not None:
        return float(radar.snr_threshold_db - averaging_gain_db(looks) - gain)
    return float(required_snr_db(probability, radar.false_alarm_probability, radar.swerling, looks=looks) - gain)


def adsb_reach(sensor: AdsbSizingConfig, *, closing_speeds: Sequence[float] = CLOSING_SPEEDS) -> dict[str, Any]:
    """Return how far ADS-B reaches, by the class of the transmitter.

    Parameters
    ----------
    sensor : AdsbSizingConfig
    closing_speeds : sequence of float
        m/s.

    Returns
    -------
    dict of str to (float, list of float)
        The class: its range, and the ranges of a confirmed track at each closing speed, m.
    """
    found: dict[str, Any] = {}
    for name in CLASSES:
        one = sensor.model_copy(update={"power_class": name})
        found[name] = (one.range_nmi * NAUTICAL_MILE, available_range(one, 0.0, list(closing_speeds)).tolist())
    return found
