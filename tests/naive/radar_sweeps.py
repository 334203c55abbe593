"""Naive twins of simulated sweeps: the radar equation, and the phase of the beat at every sample."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.sweeps.paths import RadarTarget

C = 299_792_458.0


def received_power(radar: RadarConfig, distance: float, target: RadarTarget) -> float:
    """Return what one channel receives, W."""
    wavelength = C / (radar.carrier_frequency_ghz * 1e9)
    gain = 10 ** ((radar.transmit_gain_dbi + radar.receive_gain_dbi - radar.losses_db) / 10)
    for angle, width in (
        (target.azimuth, radar.azimuth_beamwidth_deg),
        (target.elevation, radar.elevation_beamwidth_deg),
    ):
        if width is not None:
            gain *= 0.5 ** (2 * (angle / np.radians(width / 2)) ** 2)
    return radar.transmit_power_w * gain * wavelength**2 * target.rcs / ((4 * np.pi) ** 3 * distance**4)


def frame(radar: RadarConfig, targets: Sequence[RadarTarget], n_sweeps: int) -> NDArray[np.complex128]:
    """Return the echoes (sweeps, channels, samples), each of magnitude sqrt(power), without noise."""
    sweep_time, interval = radar.sweep_time_ms * 1e-3, radar.sweep_interval
    slope = radar.bandwidth_mhz * 1e6 / sweep_time
    first = radar.carrier_frequency_ghz * 1e9 - radar.bandwidth_mhz * 1e6 / 2
    wavelength = C / (radar.carrier_frequency_ghz * 1e9)
    middle = ((n_sweeps - 1) * interval + sweep_time) / 2
    t = np.arange(radar.samples_per_sweep) / radar.sampling_frequency
    out = np.zeros((n_sweeps, radar.channels, len(t)), dtype=np.complex128)
    for target in targets:
        for s in range(n_sweeps):
            tau = 2 * (target.range + target.range_rate * (s * interval + t - middle)) / C
            beat = np.exp(2j * np.pi * (first * tau + slope * tau * t - slope * tau**2 / 2))
            now = s * interval + sweep_time / 2 - middle
            amplitude = received_power(radar, target.range + target.range_rate * now, target) ** 0.5
            az, el = target.azimuth + target.azimuth_rate * now, target.elevation + target.elevation_rate * now
            for channel in range(radar.channels):
                row, column = divmod(channel, radar.array_columns)
                right = radar.element_spacing_wavelengths * (column - (radar.array_columns - 1) / 2) * wavelength
                down = radar.element_spacing_wavelengths * (row - (radar.array_rows - 1) / 2) * wavelength
                nearer = right * np.cos(el) * np.sin(az) - down * np.sin(el)
                out[s, channel] += amplitude * beat * np.exp(-2j * np.pi * nearer / wavelength)
    return out


def chirp(start: float, frequency: float, curvature: float, n: int) -> NDArray[np.complex128]:
    i = np.arange(n)
    return np.exp(2j * np.pi * (start + frequency * i + curvature * i**2))


def digitized(values: Sequence[float], gain: float, offset: float, low: float, high: float, step: float) -> list[float]:
    return [min(max(round(gain * value + offset), low), high) * step for value in values]
