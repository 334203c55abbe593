"""Naive twins of the kernels that estimate echoes: whole sweeps, sums written out, searches over everything."""

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.radar.config import SPEED_OF_LIGHT, RadarConfig

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def bin_response(delta: float, q: float) -> complex:
    """Return the integral of exp(2 pi i (delta s + q s^2)) over a sweep, by Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    s = 0.5 * nodes
    return complex(0.5 * weights @ np.exp(2j * np.pi * (delta * s + q * s * s)))


def echo(config: RadarConfig, sweeps: int, distance: float, rate: float) -> ComplexArray:
    """Return an echo's spectrum (sweeps, bins) from its samples, without its phase in the middle of the frame."""
    n = config.samples_per_sweep
    within = np.arange(n) / config.sampling_frequency
    slope = config.bandwidth_mhz * 1e6 / (1e-3 * config.sweep_time_ms)
    start = 1e9 * config.carrier_frequency_ghz - 0.5e6 * config.bandwidth_mhz
    middle = 0.5 * ((sweeps - 1) * config.sweep_interval + 1e-3 * config.sweep_time_ms)

    def cycles(place: FloatArray | float, t: FloatArray | float) -> FloatArray:
        delay = 2.0 * np.asarray(place) / SPEED_OF_LIGHT
        return np.asarray(start * delay + slope * delay * t - 0.5 * slope * delay**2)

    out = np.empty((sweeps, config.range_bins), dtype=np.complex128)
    phase = cycles(distance, 0.5 * (n - 1) / config.sampling_frequency)
    for k in range(sweeps):
        place = distance + rate * (k * config.sweep_interval + within - middle)
        beat = np.exp(2j * np.pi * (cycles(place, within) - phase))
        at_middle = distance + rate * (k * config.sweep_interval + 0.5 * (n - 1) / config.sampling_frequency - middle)
        out[k] = (distance / at_middle) ** 2 * np.fft.fft(beat)[: config.range_bins] / n
    # A transform that starts at the first sample turns bins against each other.
    return np.asarray(out * np.exp(1j * np.pi * np.arange(config.range_bins) * (n - 1) / n))


def best_line(
    powers: FloatArray, first: int, bins_per_m: float, times: FloatArray, peak: int, rates: FloatArray
) -> tuple[float, float, float]:
    """Return beat, rate and power of the best path through half bins."""
    best = (-1.0, 0.0, 0.0)
    for rate in rates:
        path = 2.0 * bins_per_m * rate * times
        reach = int(np.ceil(abs(path[0]))) + 4
        for j in range(-reach, reach + 1):
            at = np.floor(2.0 * (peak - first) + j + path + 0.5).astype(int)
            inside = (at >= 0) & (at < powers.shape[1])
            power = float(sum(powers[k, at[k]] for k in np.flatnonzero(inside)))
            if power > best[0]:
                best = (power, peak + 0.5 * j, rate)
    return best[1], best[2], best[0]


def likelihood(z: ComplexArray, model: ComplexArray) -> float:
    """Return the share of the samples' energy that an echo explains."""
    return float(abs(np.vdot(model, z)) ** 2 / np.vdot(model, model).real)
