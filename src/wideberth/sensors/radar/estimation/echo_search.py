"""One echo in the bins around a peak: where it is found, fitted, and how sure its range rate is.

Range rate is told by the phase from sweep to sweep only modulo a span of speeds (7.1 m/s with table 5.1), and a rate
wrong by one span shifts the range by c / (2 bandwidth) times sweep interval over sweep time: a range bin. Which of them
it is follows from the migration through bins over the frame. All of them are weighed by their likelihood.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.estimation.echo_kernels import sums_of_channels
from wideberth.sensors.radar.estimation.range_rate_kernels import half_bin_powers, search_lines, search_rates

ComplexArray = NDArray[np.complex128]

HALF_BINS = 4
"""Bins used on either side of an echo: they hold 0.87 of the information on range."""

RESOLVED = 0.999
"""Probability from which one range rate is taken to be the true one."""

_SEARCH_BINS = 2


@dataclass(frozen=True, slots=True)
class EchoFit:
    """Range and range rate of an echo.

    Attributes
    ----------
    distance, rate : float
        m and m/s at the middle of the frame: the most likely pair.
    mean_distance : float
        Over all range rates by their probability; the one to give out if these are several.
    variance_distance, variance_rate : float
        Around `distance` and `rate` if resolved, else around the means; m2, m2/s2.
    resolved : bool
        Whether the range rate is known.
    likelihood : float
        Energy of the echo in the beam, of noise power 1 in a bin.
    amplitude : complex
        In the beam.
    weight : float
        Energy of an echo of amplitude 1 in the bins used.
    misfit : float
        Energy in these bins that neither the echo nor noise explains, where it is more than chance.
    """

    distance: float
    rate: float
    mean_distance: float
    variance_distance: float
    variance_rate: float
    resolved: bool
    likelihood: float
    amplitude: complex
    weight: float
    misfit: float


def window_reach(waveform: FloatArray, sweeps: int, rate_max: float) -> int:
    """Return how many bins on either side of a peak an echo in it can reach within a frame."""
    return HALF_BINS + 2 + math.ceil(float(waveform[0]) * rate_max * sweeps * float(waveform[5]) / 2.0)


def acquire(
    x: ComplexArray, first: int, waveform: FloatArray, peak: int, rate_max: float
) -> tuple[float, float, ComplexArray]:
    """Find an echo near a peak: first the path through the bins with most power, then the phase from sweep to sweep.

    Parameters
    ----------
    x : ndarray of complex, shape (sweeps, channels or beams, bins)
        Noise power 1, without the phase over bins.
    first : int
        Bin of the first column.
    waveform : ndarray
        `waveform.frame_waveform`.
    peak : int
    rate_max : float
        Greatest range rate looked for, m/s.

    Returns
    -------
    tuple of float, float, ndarray of complex
        Distance (m), range rate (m/s), amplitudes of the channels.
    """
    sweeps, channels, bins = x.shape
    powers = np.empty((sweeps, 2 * bins - 1))
    half_bin_powers(x, powers)
    step = 0.5 / (waveform[0] * sweeps * waveform[5])
    beat, rate, _ = search_lines(powers, first, waveform, peak, rate_max, step)
    distance = _distance(waveform, beat, rate)
    sums = np.empty((sweeps, channels), dtype=np.complex128)
    sums_of_channels(x, first, waveform, distance, rate, _SEARCH_BINS, sums)
    if sweeps == 1:
        return distance, rate, sums[0]
    n = 2 * sweeps
    doppler = np.fft.fft(sums, n, axis=0)
    best = int(np.argmax(np.sum(doppler.real**2 + doppler.imag**2, axis=1)))
    turns = (best if best <= sweeps else best - n) / n
    rate += turns / (waveform[3] * waveform[5])
    return _distance(waveform, beat, rate), rate, doppler[best]


def sharpen(
    z: ComplexArray, first: int, waveform: FloatArray, peak: int, rate: float, rate_max: float
) -> tuple[float, float, float]:
    """Find an echo again in the beam towards it, now with the phases: among the range rates that they allow.

    Parameters
    ----------
    z : ndarray of complex, shape (sweeps, bins)
        A beam's samples, noise power 1, without the phase over bins.
    first, waveform, peak, rate_max
        As for `acquire`.
    rate : float
        From `acquire`, m/s.

    Returns
    -------
    tuple of float
        Distance (m), range rate (m/s), and log-likelihood: a fit's is up to 2.5 times as great.
    """
    beat, rate, power = search_rates(z, first, waveform, peak, rate, rate_max)
    return _distance(waveform, beat, rate), rate, power / len(z)


def rates_allowed(waveform: FloatArray, rate_max: float) -> int:
    """Return at most how many range rates the phases allow, up to the greatest."""
    return math.floor(2.0 * rate_max * float(waveform[3] * waveform[5])) + 2


def weighed_fit(table: FloatArray, sweeps: int, waveform: FloatArray, rate_max: float) -> EchoFit:
    """Return the fit of an echo from those at the range rates that the phases allow, weighed by their likelihood.

    Parameters
    ----------
    table : ndarray, shape (n, range_rate_kernels.FIT)
        The most likely first.
    sweeps : int
        In the frame.
    waveform, rate_max
        As for `acquire`.

    Returns
    -------
    EchoFit
    """
    rows: list[list[float]] = table.tolist()
    best = rows[0]
    mean, share, variance, variance_rate = best[0], 1.0, best[6], best[7]
    if len(rows) > 1:  # too few of them for numpy
        weight = [math.exp(min(row[2] - best[2], 0.0)) for row in rows]
        total = sum(weight)
        weight = [w / total for w in weight]
        each = list(zip(weight, rows, strict=True))
        mean, share = sum(w * row[0] for w, row in each), weight[0]
        around = (best[0], best[1]) if share >= RESOLVED else (mean, sum(w * row[1] for w, row in each))
        variance = sum(w * (row[6] + (row[0] - around[0]) ** 2) for w, row in each)
        variance_rate = sum(w * (row[7] + (row[1] - around[1]) ** 2) for w, row in each)
    if sweeps == 1:  # any range rate up to the greatest
        variance += (waveform[1] / waveform[0] * rate_max) ** 2 / 3.0
        variance_rate = rate_max**2 / 3.0
    excess = best[9] - best[2] - best[10]
    return EchoFit(
        distance=best[0],
        rate=best[1],
        mean_distance=mean,
        variance_distance=variance,
        variance_rate=variance_rate,
        resolved=sweeps > 1 and share >= RESOLVED,
        likelihood=best[2],
        amplitude=complex(best[3], best[4]),
        weight=best[5],
        misfit=max(0.0, excess - 5.0 * math.sqrt(best[10])),
    )


def _distance(waveform: FloatArray, beat: float, rate: float) -> float:
    return float((beat - waveform[1] * rate) / (waveform[0] * (1.0 - waveform[7] * rate)))
