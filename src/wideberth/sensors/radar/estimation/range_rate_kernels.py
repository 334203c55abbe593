"""Kernels of the search over range and range rate, and of the maximum-likelihood fit that ends it."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit, jit_uncounted
from wideberth.sensors.radar.estimation.echo_kernels import (
    CELLS,
    CORRELATIONS,
    TERMS,
    WAVEFORM,
    correlate,
    echo_of_sweep,
)

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FIT = 11
"""Numbers of a fit: distance, rate, likelihood, amplitude (two), weight, variances (two), covariance, energy, cells."""

_HALVINGS = 4
_REACH = 5.0  # gains that a step promises, as a whole way up
_ITERATIONS, _CONVERGED = 12, 1e-5  # steps, and the gain in log-likelihood that a step must promise
_ROUGH_ITERATIONS, _ROUGHLY = 4, 0.3
_HOPELESS = 14.0  # below the greatest log-likelihood


@jit_uncounted
def half_bin_powers(x: ComplexArray, powers: FloatArray) -> None:
    """Fill `powers` (sweeps, 2 bins - 1): those of bins and of sums of neighbours, over channels, with equal noise."""
    n = x.shape[2]
    for k in range(x.shape[0]):
        for j in range(2 * n - 1):
            powers[k, j] = 0.0
        for c in range(x.shape[1]):
            for b in range(n):
                a = x[k, c, b]
                powers[k, 2 * b] += a.real * a.real + a.imag * a.imag
                if b + 1 < n:
                    a += x[k, c, b + 1]
                    powers[k, 2 * b + 1] += 0.5 * (a.real * a.real + a.imag * a.imag)


@jit_uncounted
def search_lines(
    powers: FloatArray, first: int, waveform: FloatArray, peak: int, rate_max: float, rate_step: float
) -> tuple[float, float, float]:
    """Return beat at the middle of the frame, rate and power of the line of most power that comes near the peak.

    A line is the path of a rate through half bins; `powers` begin with bin `first`.
    """
    sweeps, n = powers.shape
    best, best_beat, best_rate = -1.0, float(peak), 0.0
    steps = math.floor(rate_max / rate_step + 0.5) if sweeps > 1 else 0
    for i in range(-steps, steps + 1):
        rate = i * rate_step
        slope = 2.0 * waveform[0] * rate * waveform[5]
        begin = 2.0 * waveform[0] * rate * waveform[6]
        reach = math.ceil(abs(begin)) + 4
        for j in range(-reach, reach + 1):
            start = 2.0 * (peak - first) + j + begin
            power = 0.0
            for k in range(sweeps):
                at = math.floor(start + slope * k + 0.5)
                if 0 <= at < n:
                    power += powers[k, at]
            if power > best:
                best, best_beat, best_rate = power, peak + 0.5 * j, rate
    return best_beat, best_rate, best


@jit
def search_rates(
    z: ComplexArray, first: int, waveform: FloatArray, peak: int, rate: float, rate_max: float
) -> tuple[float, float, float]:
    """Return beat, rate and power of the best coherent sum of a beam `z` (sweeps, bins) along paths near the peak.

    Tried are the rates with the phase from sweep to sweep of `rate`, on a grid of half bins; sums of neighbouring
    bins stand for what lies between them.
    """
    sweeps, n = z.shape
    span = 1.0 / (waveform[3] * waveform[5])
    rate -= span * math.floor(rate / span + 0.5)
    best, best_beat, best_rate = -1.0, float(peak), rate
    halves = np.empty((sweeps, 4 * n))  # real and imaginary parts in turn
    for k in range(sweeps):
        for b in range(n):
            a = z[k, b]
            halves[k, 4 * b], halves[k, 4 * b + 1] = a.real, a.imag
            if b + 1 < n:
                a = math.sqrt(0.5) * (a + z[k, b + 1])
                halves[k, 4 * b + 2], halves[k, 4 * b + 3] = a.real, a.imag
    most = math.ceil(2.0 * waveform[0] * (rate_max + span) * abs(waveform[6])) + 4
    total = np.empty((2, 2 * most + 1))
    steps = math.floor(rate_max / span + 0.5) if sweeps > 1 else 0
    for i in range(-steps, steps + 1):
        tried = rate + i * span
        middle = (peak - waveform[1] * tried) / waveform[0]
        slope = 2.0 * waveform[0] * tried * waveform[5]
        begin = 2.0 * waveform[0] * tried * waveform[6]
        reach = min(math.ceil(abs(begin)) + 4, most)
        for j in range(2 * reach + 1):
            total[0, j], total[1, j] = 0.0, 0.0
        for k in range(sweeps):
            dt = waveform[6] + k * waveform[5]
            now = middle + tried * dt
            turns = waveform[3] * tried * dt + waveform[4] * (now * now - middle * middle)
            angle = -2.0 * math.pi * (turns - math.floor(turns))
            re, im = math.cos(angle), math.sin(angle)
            # The paths are a half bin apart.
            at = 2 * (peak - first) - reach + math.floor(begin + slope * k + 0.5)
            for j in range(max(-at, 0), min(2 * n - 1 - at, 2 * reach + 1)):
                a, b = halves[k, 2 * (at + j)], halves[k, 2 * (at + j) + 1]
                total[0, j] += a * re - b * im
                total[1, j] += a * im + b * re
        for j in range(2 * reach + 1):
            power = total[0, j] * total[0, j] + total[1, j] * total[1, j]
            if power > best:
                best, best_beat, best_rate = power, peak + 0.5 * (j - reach), tried
    return best_beat, best_rate, best


@jit_uncounted
def _normal_equations(c: FloatArray) -> tuple[float, float, float, float, float, float]:
    """Return the information (rr, vv, rv) without the amplitude's share, the gradient, and the likelihood."""
    e = max(c[10], 1e-300)
    a, b = c[0] / e, c[1] / e  # the amplitude
    power = a * a + b * b
    j_rr = power * (c[11] - (c[6] * c[6] + c[7] * c[7]) / e)
    j_vv = power * (c[12] - (c[8] * c[8] + c[9] * c[9]) / e)
    j_rv = power * (c[13] - (c[6] * c[8] + c[7] * c[9]) / e)
    # <r, z - a m> times the amplitude's conjugate; <r,m> is the conjugate of <m,r>.
    r_re, r_im = c[2] - (c[6] * a + c[7] * b), c[3] - (c[6] * b - c[7] * a)
    v_re, v_im = c[4] - (c[8] * a + c[9] * b), c[5] - (c[8] * b - c[9] * a)
    return j_rr, j_vv, j_rv, a * r_re + b * r_im, a * v_re + b * v_im, power * e


@jit
def fit_echo(
    z: ComplexArray,
    first: int,
    waveform: FloatArray,
    distance: float,
    rate: float,
    half: int,
    iterations: int,
    gain: float,
    least: float,
    fit: FloatArray,
) -> None:
    """Climb from a start to the greatest likelihood of an echo in a beam `z` (sweeps, bins) of unit noise.

    Gauss-Newton steps in distance and rate (in distance alone, of one sweep), halved while the likelihood falls, until
    one promises less than `gain`, which is taken as promised; none where a likelihood of `least` is out of reach.
    `fit` (FIT): the likelihood is the share of the samples' energy; variances are those of the Fisher information of
    the bins used; weight is the model's energy, energy that of the `cells` samples used.
    """
    c, tried = np.empty(CORRELATIONS), np.empty(CORRELATIONS)
    cells, series = np.empty((CELLS, 2 * half + 1)), np.empty((CELLS, TERMS))
    moves = z.shape[0] > 1
    correlate(z, first, waveform, distance, rate, half, cells, series, c)
    last_r, last_v, last = 0.0, 0.0, 0.0
    # A quarter of a resolution cell at most: the likelihood is no parabola beyond.
    most_r = 0.25 / waveform[0]
    most_v = 0.25 / (waveform[3] * waveform[5] * z.shape[0])
    for _ in range(iterations):
        j_rr, j_vv, j_rv, g_r, g_v, likelihood = _normal_equations(c)
        if moves:
            det = max(j_rr * j_vv - j_rv * j_rv, 1e-300)
            step_r, step_v = (j_vv * g_r - j_rv * g_v) / det, (j_rr * g_v - j_rv * g_r) / det
        else:
            step_r, step_v = g_r / max(j_rr, 1e-300), 0.0
        promised = g_r * step_r + g_v * step_v
        if likelihood + _REACH * promised < least:
            break
        if promised < gain:
            last_r, last_v, last = step_r, step_v, promised
            break
        # Where the beat is: the distance's step has the rate's coupling in it.
        beat = step_r + waveform[1] / waveform[0] * step_v
        shrink = max(1.0, abs(beat) / most_r, abs(step_v) / most_v)
        step_r /= shrink
        step_v /= shrink
        better = False
        for _ in range(_HALVINGS):
            correlate(z, first, waveform, distance + step_r, rate + step_v, half, cells, series, tried)
            if (tried[0] * tried[0] + tried[1] * tried[1]) / max(tried[10], 1e-300) >= likelihood:
                better = True
                break
            step_r *= 0.5
            step_v *= 0.5
        if not better:
            break
        distance += step_r
        rate += step_v
        for i in range(CORRELATIONS):
            c[i] = tried[i]
    _finished(z, first, waveform, distance, rate, half, c, fit)
    fit[0] += last_r
    fit[1] += last_v
    fit[2] += last


@jit_uncounted
def _finished(
    z: ComplexArray,
    first: int,
    waveform: FloatArray,
    distance: float,
    rate: float,
    half: int,
    c: FloatArray,
    fit: FloatArray,
) -> None:
    """Fill `fit` from the correlations `c` of its echo."""
    j_rr, j_vv, j_rv, _, _, likelihood = _normal_equations(c)
    fit[0], fit[1], fit[2] = distance, rate, likelihood
    fit[3], fit[4], fit[5] = c[0] / max(c[10], 1e-300), c[1] / max(c[10], 1e-300), c[10]
    if z.shape[0] > 1:
        det = j_rr * j_vv - j_rv * j_rv
        fit[6], fit[7], fit[8] = 0.5 * j_vv / det, 0.5 * j_rr / det, -0.5 * j_rv / det
    else:
        fit[6], fit[7], fit[8] = 0.5 / j_rr, math.inf, 0.0
    energy, cells = 0.0, 0
    for k in range(z.shape[0]):
        beat, _, _, _ = echo_of_sweep(waveform, k, distance, rate)
        middle = round(beat)
        for b in range(max(middle - half, first), min(middle + half + 1, first + z.shape[1])):
            a = z[k, b - first]
            energy += a.real * a.real + a.imag * a.imag
            cells += 1
    fit[9], fit[10] = energy, cells


@jit
def fit_range_rates(
    z: ComplexArray,
    first: int,
    waveform: FloatArray,
    distance: float,
    rate: float,
    rate_max: float,
    half: int,
    fits: FloatArray,
) -> int:
    """Fit an echo, and those that the phases from sweep to sweep allow as well, up to the rate `rate_max`.

    Fill `fits` (m, FIT), the most likely first, and return how many. The others are fitted only well enough to be
    weighed, and left where they are hopeless.
    """
    fit_echo(z, first, waveform, distance, rate, half, _ITERATIONS, _CONVERGED, 0.0, fits[0])
    n = 1
    if z.shape[0] < 2:
        return n
    span = 1.0 / (waveform[3] * waveform[5])
    shift = span * waveform[1] / waveform[0]
    start_r, start_v = fits[0, 0], fits[0, 1]
    best = 0
    for way in range(1, -2, -2):
        for i in range(1, fits.shape[0]):
            to = start_v + way * i * span
            if abs(to) > rate_max or n == fits.shape[0]:
                break
            least = fits[best, 2] - _HOPELESS
            to_r = start_r - way * i * shift
            fit_echo(z, first, waveform, to_r, to, half, _ROUGH_ITERATIONS, _ROUGHLY, least, fits[n])
            n += 1
            if fits[n - 1, 2] < least:
                break
            if fits[n - 1, 2] > fits[best, 2]:
                best = n - 1
    if best:
        row = np.empty(FIT)
        fit_echo(z, first, waveform, fits[best, 0], fits[best, 1], half, _ITERATIONS, _CONVERGED, 0.0, row)
        for j in range(FIT):
            fits[best, j] = fits[0, j]
            fits[0, j] = row[j]
    return n


def warmup() -> None:
    """Compile what Python calls."""
    x, waveform = np.zeros((2, 1, 2), dtype=np.complex128), np.ones(WAVEFORM)
    powers = np.zeros((2, 3))
    half_bin_powers(x, powers)
    search_lines(powers, 0, waveform, 1, 1.0, 0.5)
    z = np.zeros((2, 2), dtype=np.complex128)
    search_rates(z, 0, waveform, 1, 0.0, 1.0)
    fit_echo(z, 0, waveform, 1.0, 0.0, 1, 1, 0.0, 0.0, np.zeros(FIT))
    fit_range_rates(z, 0, waveform, 1.0, 0.0, 1.0, 1, np.zeros((3, FIT)))
