"""What is given out of a fitted echo: range, direction and range rate, with the variances that they have."""

from collections.abc import Sequence

import numpy as np

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.estimation.beamforming import places_in_wavelengths
from wideberth.sensors.radar.estimation.cramer_rao import direction_variances
from wideberth.sensors.radar.estimation.echo_search import HALF_BINS
from wideberth.sensors.radar.estimation.echoes import Channels, Echo
from wideberth.sensors.radar.estimation.joint_information import variance_ratios

_NEAR_BINS = 2 * HALF_BINS + 1
_MOST_SHARED = 0.5  # of the misfit that may pull in the direction of a parameter
_DOUBTFUL = 0.1  # misfit, as a share of the echo's energy, that makes its range rate doubtful


def neighbours(echoes: Sequence[Echo], echo: Echo, waveform: FloatArray, sweeps: int) -> list[Echo]:
    """Return the echoes of which the bins used overlap with those of one, at some time of the frame."""
    moved = waveform[0] * waveform[5] * sweeps * 0.5
    return [
        e
        for e in echoes
        if e is not echo and abs(e.beat - echo.beat) <= _NEAR_BINS + moved * abs(e.fit.rate - echo.fit.rate)
    ]


def measured(
    config: RadarConfig,
    waveform: FloatArray,
    sweeps: int,
    channels: Channels,
    echo: Echo,
    near: Sequence[Echo],
) -> list[float]:
    """Return the measurements of an echo.

    Parameters
    ----------
    config : RadarConfig
    waveform : ndarray
        `waveform.frame_waveform`.
    sweeps : int
    channels : Channels
        What the channels are near the echo's bin.
    echo : Echo
    near : sequence of Echo
        Those that overlap with it: variances are joint ones.

    Returns
    -------
    list of float
        Nine: as of `echoes.Estimates` range, azimuth, elevation, range rate, their variances, and the signal-to-noise
        ratio.
    """
    fit, direction = echo.fit, echo.direction
    widened = np.ones(4)
    if near:
        widened = variance_ratios(
            waveform,
            sweeps,
            places_in_wavelengths(config),
            channels.response,
            [(e.fit.distance, e.fit.rate, *e.direction[:2], e.fit.amplitude) for e in (echo, *near)],
        )
    widened *= 1.0 + _MOST_SHARED * fit.misfit
    info = direction[3:6] * fit.weight
    right, down = direction[0], direction[1]
    both = 0.0
    if config.array_rows > 1 and config.array_columns > 1:
        det = info[0] * info[1] - info[2] ** 2
        var_right, var_down, both = info[1] / det, info[0] / det, -info[2] / det
    else:
        with np.errstate(divide="ignore"):
            var_right, var_down = 1.0 / info[:2]
    az, el = np.nan, np.nan
    if config.array_rows > 1:
        el = -np.arcsin(down)
    if config.array_columns > 1:
        az = np.arctan2(right, np.sqrt(max(1.0 - right**2 - (down**2 if config.array_rows > 1 else 0.0), 0.0)))
    mean = np.sqrt(widened[2] * widened[3])
    var_az, var_el = direction_variances(config, az, el, var_right * widened[2], var_down * widened[3], both * mean)
    distance, rate = (fit.distance, fit.rate) if fit.resolved else (fit.mean_distance, np.nan)
    var_distance, var_rate = fit.variance_distance * widened[0], fit.variance_rate * widened[1]
    if near and fit.misfit > _DOUBTFUL * fit.likelihood:
        # The fit may rest on a wrong turn of phase from sweep to sweep.
        span = 1.0 / (waveform[3] * waveform[5])
        rate, var_rate = np.nan, var_rate + span**2
        var_distance += (span * waveform[1] / waveform[0]) ** 2
    power = float(np.mean(np.abs(echo.modelled / channels.scale) ** 2))
    # The amplitude has noise of its own.
    snr = max(power - 1.0 / (fit.weight * config.channels), 0.1 * power)
    return [
        distance,
        az,
        el,
        rate,
        var_distance,
        float(var_az),
        float(var_el),
        var_rate,
        10.0 * np.log10(snr),
    ]
