"""The numbers of a frame of sweeps that the kernels of echoes take."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import SPEED_OF_LIGHT, RadarConfig


@lru_cache(maxsize=16)
def frame_waveform(config: RadarConfig, sweeps: int) -> FloatArray:
    """Return the waveform of a frame as `echo_kernels` wants it.

    The phase of a beat is 2 pi (f0 tau + mu tau t - mu tau^2 / 2) at the time t of the sweep, with tau = 2 R(t) / c.

    Parameters
    ----------
    config : RadarConfig
    sweeps : int
        In the frame.

    Returns
    -------
    ndarray, shape (echo_kernels.WAVEFORM,)
    """
    slope = config.bandwidth_mhz * 1e6 / (config.sweep_time_ms * 1e-3)
    samples = config.samples_per_sweep
    length = samples / config.sampling_frequency
    middle = 0.5 * (samples - 1) / config.sampling_frequency
    by_way = 2.0 / SPEED_OF_LIGHT
    carrier = config.carrier_frequency_ghz * 1e9 - 0.5 * config.bandwidth_mhz * 1e6 + slope * middle
    frame_middle = 0.5 * ((sweeps - 1) * config.sweep_interval + config.sweep_time_ms * 1e-3)
    waveform = np.array(
        [
            slope * length * by_way,
            carrier * length * by_way,
            slope * length**2 * by_way,
            carrier * by_way,
            -0.5 * slope * by_way**2,
            config.sweep_interval,
            middle - frame_middle,
            by_way,
            samples,
        ]
    )
    waveform.flags.writeable = False
    return waveform


@lru_cache(maxsize=16)
def bin_phases(config: RadarConfig) -> NDArray[np.complex128]:
    """Return what takes the phase over bins out of a transform that starts at the first sample, shape (range_bins,)."""
    samples = config.samples_per_sweep
    return np.asarray(np.exp(1j * np.pi * np.arange(config.range_bins) * (samples - 1) / samples))
