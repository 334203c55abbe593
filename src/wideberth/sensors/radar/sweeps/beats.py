"""Beat signals of echoes: phase, frequency and curvature in each sweep, and the factor in each channel."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.array import steering_vector
from wideberth.sensors.radar.config import SPEED_OF_LIGHT, RadarConfig
from wideberth.sensors.radar.link_budget import noise_power, pattern_loss_db, snr_db
from wideberth.sensors.radar.sweeps.paths import Paths, RadarTarget
from wideberth.sensors.radar.sweeps.receiver import channel_response, if_response


def amplitude_at_a_metre(config: RadarConfig) -> float:
    """Return the root of the power that 1 m2 at 1 m on boresight would return to one channel, by the link budget.

    Parameters
    ----------
    config : RadarConfig

    Returns
    -------
    float
        V.
    """
    return float(np.sqrt(noise_power(config) * 10.0 ** (snr_db(1.0, 1.0, config) / 10.0)))


def beat_phases(config: RadarConfig, length: FloatArray, rate: FloatArray, n_sweeps: int) -> FloatArray:
    """Return the phases of beats, transmitted wave times conjugated echo, in all sweeps of a frame.

    An echo is delayed by tau = (length + rate t) / c. The phase in cycles is f0 tau + mu tau t - mu tau^2 / 2, with the
    sweep's first frequency f0, its slope mu and the time t from its start: quadratic in t, exactly.

    Parameters
    ----------
    config : RadarConfig
    length, rate : ndarray, shape (n,)
        There and back, in the middle of the frame, m and m/s.
    n_sweeps : int

    Returns
    -------
    ndarray, shape (n_sweeps, n, 3)
        Cycles at the sweep's first sample, cycles a sample, cycles a sample squared.
    """
    slope = 1e9 * config.bandwidth_mhz / config.sweep_time_ms
    first = 1e9 * config.carrier_frequency_ghz - 0.5e6 * config.bandwidth_mhz
    a = (length + rate * sweep_times(config, n_sweeps)[:, None]) / SPEED_OF_LIGHT
    b = np.broadcast_to(rate / SPEED_OF_LIGHT, a.shape)
    start = first * a - 0.5 * slope * a**2
    frequency = first * b + slope * a * (1.0 - b)
    curvature = slope * b * (1.0 - 0.5 * b)
    step = 1.0 / config.sampling_frequency
    return np.stack([start - np.floor(start), frequency * step, curvature * step**2], axis=-1)


def sweep_times(config: RadarConfig, n_sweeps: int) -> FloatArray:
    """Return when the sweeps of a frame start, s, from its middle: halfway from the first's start to the last's end."""
    middle = 0.5 * ((n_sweeps - 1) * config.sweep_interval + config.sweep_time_ms * 1e-3)
    return np.asarray(config.sweep_interval * np.arange(n_sweeps) - middle)


def beats(
    config: RadarConfig,
    targets: Sequence[RadarTarget],
    paths: Paths,
    fluctuation: NDArray[np.complex128],
    n_sweeps: int,
) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Return the beats of echoes behind coupling and IF filter, and of the transmitter's leakage.

    Within a sweep the factors are constant: those of its middle.

    Parameters
    ----------
    config : RadarConfig
    targets : sequence of RadarTarget
    paths : Paths
        Of their echoes.
    fluctuation : ndarray, shape (targets,)
    n_sweeps : int

    Returns
    -------
    phases : ndarray, shape (n_sweeps, echoes, 3)
        See `beat_phases`. Beats beyond half the sampling frequency are left to fold.
    gains : ndarray, shape (n_sweeps, echoes, channels)
        Roots of received powers, with the phases of the channels.

    Raises
    ------
    ValueError
        If a target passes through the radar within the frame, or is so near that it would return more than is sent.
    """
    times = sweep_times(config, n_sweeps)[:, None] + 0.5e-3 * config.sweep_time_ms
    out, back = (half[:, 0] + times * half[:, 1] for half in (paths.out, paths.back))
    half_frame = -sweep_times(config, n_sweeps)[0]
    if any(np.any(half[:, 0] <= half_frame * np.abs(half[:, 1])) for half in (paths.out, paths.back)):
        raise ValueError("a target passes through the radar within the frame: give it more range, or fewer sweeps")
    rcs = np.array([target.rcs for target in targets])[paths.target]
    loss_db = sum(pattern_loss_db(half[:, 2], half[:, 3], config) for half in (paths.out, paths.back))
    strength = amplitude_at_a_metre(config) * np.sqrt(rcs) * 10.0 ** (-loss_db / 20.0)
    near = strength**2 > config.transmit_power_w * (out * back).min(axis=0) ** 2
    if near.any():
        target = targets[paths.target[np.flatnonzero(near)[0]]]
        raise ValueError(
            f"a target of {target.rcs:g} m2 at {target.range:g} m would return more power than is sent: the link "
            "budget does not hold so near"
        )
    amplitude = strength * paths.factor * fluctuation[paths.target] / (out * back)
    phases = beat_phases(config, paths.out[:, 0] + paths.back[:, 0], paths.out[:, 1] + paths.back[:, 1], n_sweeps)
    azimuth, elevation = (paths.back[:, 2 + i] + times * paths.turn[:, i] for i in range(2))
    gains = amplitude[..., None] * steering_vector(config, azimuth, elevation)
    if config.receiver.leakage_db is not None:
        leaked = np.sqrt(config.transmit_power_w * 10.0 ** (config.receiver.leakage_db / 10.0))
        way = np.array([2.0 * config.receiver.leakage_range_m])
        phases = np.concatenate([phases, beat_phases(config, way, np.zeros(1), n_sweeps)], axis=1)
        gains = np.concatenate([gains, np.full((n_sweeps, 1, config.channels), leaked)], axis=1)
    middle = phases[..., 1] + phases[..., 2] * config.samples_per_sweep
    filtered = if_response(config, middle * config.sampling_frequency)
    return phases, filtered[..., None] * (gains @ channel_response(config).T)
