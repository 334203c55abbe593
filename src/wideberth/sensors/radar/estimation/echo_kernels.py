"""Kernels of one echo in the range bins of a frame: its model, its correlation with samples, its removal.

An echo of range R and range rate v (at the middle of the frame) is, in bin b of sweep k, of which the middle is dt from
the middle of the frame, exp(i phase) D(beta - b; q): the phase of R + v dt, and the Dirichlet kernel, for thousands of
samples a sinc, of the beat beta in bins, with the chirp q that a target moving within the sweep leaves in its beat.
The linear phase over bins of a transform that starts at the first sample is taken out of the samples beforehand.

A waveform is an array of WAVEFORM numbers: bins per m, bins per m/s, chirp per m/s, cycles per m, cycles per m2, from
one sweep to the next (s), middle of the first sweep after the middle of the frame (s), 2/c, samples in a sweep.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WAVEFORM = 9
CORRELATIONS = 14

_ORDERS = 10
_TERMS = 10


def _series() -> FloatArray:
    # Derivative n of sin(x)/x by powers of x^2, without the factor x that odd ones have.
    table = np.zeros((_ORDERS, _TERMS))
    for n in range(_ORDERS):
        for j in range(_TERMS):
            power = 2 * j + n + n % 2  # of x in sin(x)/x, from which the derivative leaves power - n
            sign = -1.0 if (power // 2) % 2 else 1.0
            table[n, j] = sign * math.perm(power, n) / math.factorial(power + 1)
    return table


_SERIES = _series()


@jit_uncounted
def _horner(n: int, y: float) -> float:
    value = 0.0
    for j in range(_TERMS - 1, -1, -1):
        value = value * y + _SERIES[n, j]
    return value


@jit_uncounted
def bin_response(delta: float, sine: float, cosine: float, q: float) -> tuple[complex, complex]:
    """Return D(delta; q), the integral of exp(2 pi i (delta s + q s^2)) over s from -1/2 to 1/2, and its slope.

    `sine` and `cosine` are those of pi delta. A chirp takes derivatives of sin(x)/x, two for each order of q; to the
    fourth order, D is right to 4e-5 for q up to 0.35 (51 m/s with table 5.1), and to 1e-3 for twice that.
    """
    x = math.pi * delta
    if abs(x) < 2.0:
        y = x * x
        f0, f2, f4, f6, f8 = _horner(0, y), _horner(2, y), _horner(4, y), _horner(6, y), _horner(8, y)
        f1, f3, f5 = x * _horner(1, y), x * _horner(3, y), x * _horner(5, y)
        f7, f9 = x * _horner(7, y), x * _horner(9, y)
    else:
        # x f(n+2) + (n+2) f(n+1) + x f(n) + n f(n-1) = 0
        r = 1.0 / x
        f0 = sine * r
        f1 = (cosine - f0) * r
        f2 = -f0 - 2.0 * f1 * r
        f3 = -f1 - (3.0 * f2 + f0) * r
        f4 = -f2 - (4.0 * f3 + 2.0 * f1) * r
        f5 = -f3 - (5.0 * f4 + 3.0 * f2) * r
        f6 = -f4 - (6.0 * f5 + 4.0 * f3) * r
        f7 = -f5 - (7.0 * f6 + 5.0 * f4) * r
        f8 = -f6 - (8.0 * f7 + 6.0 * f5) * r
        f9 = -f7 - (9.0 * f8 + 7.0 * f6) * r
    t = 0.5 * math.pi * q
    t2, t3, t4 = t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0
    value = complex(f0 - t2 * f4 + t4 * f8, t3 * f6 - t * f2)
    slope = complex(math.pi * (f1 - t2 * f5 + t4 * f9), math.pi * (t3 * f7 - t * f3))
    return value, slope


@jit_uncounted
def echo_of_sweep(waveform: FloatArray, k: int, distance: float, rate: float) -> tuple[float, float, float, complex]:
    """Return the beat in bins, the cycles that the phase gains by each m/s, the time, and the phasor of a sweep.

    The phasor's magnitude is that of an echo that comes nearer or goes away, 1 in the middle of the frame.
    """
    dt = waveform[6] + k * waveform[5]
    now = distance + rate * dt
    beat = waveform[0] * now * (1.0 - waveform[7] * rate) + waveform[1] * rate
    turns = waveform[3] * rate * dt + waveform[4] * (now * now - distance * distance)
    angle = 2.0 * math.pi * (turns - math.floor(turns))
    by_rate = (waveform[3] + 2.0 * waveform[4] * now) * dt
    # Free space: 3 % a metre at 60 m.
    gain = distance / now if abs(now - distance) < 0.2 * abs(distance) else 1.0
    gain *= gain
    return beat, by_rate, dt, complex(gain * math.cos(angle), gain * math.sin(angle))


@jit_uncounted
def sums_of_channels(
    x: ComplexArray, first: int, waveform: FloatArray, distance: float, rate: float, half: int, sums: ComplexArray
) -> None:
    """Correlate each sweep and channel of `x` (sweeps, channels, bins from `first` on) with an echo: `sums` (K, C)."""
    n = x.shape[2]
    q = waveform[2] * rate
    for k in range(x.shape[0]):
        beat, _, _, phasor = echo_of_sweep(waveform, k, distance, rate)
        for c in range(x.shape[1]):
            sums[k, c] = 0.0
        middle = round(beat)
        sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
        for b in range(max(middle - half, first), min(middle + half + 1, first + n)):
            sign = 1.0 - 2.0 * (abs(b - middle) % 2)
            value, _ = bin_response(beat - b, sign * sine, sign * cosine, q)
            weight = (value * phasor).conjugate()
            for c in range(x.shape[1]):
                sums[k, c] += weight * x[k, c, b - first]


@jit_uncounted
def remove_echo(
    x: ComplexArray, first: int, waveform: FloatArray, distance: float, rate: float, channels: ComplexArray
) -> None:
    """Subtract an echo with these amplitudes of the channels from all bins of `x` (sweeps, channels, bins)."""
    q = waveform[2] * rate
    for k in range(x.shape[0]):
        beat, _, _, phasor = echo_of_sweep(waveform, k, distance, rate)
        middle = round(beat)
        sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
        for j in range(x.shape[2]):
            sign = 1.0 - 2.0 * (abs(first + j - middle) % 2)
            value, _ = bin_response(beat - first - j, sign * sine, sign * cosine, q)
            value *= phasor
            # Far off, bins know that a sweep has a number of samples: Dirichlet's kernel, not the sinc.
            y = math.pi * (beat - first - j) / waveform[8]
            if abs(y) > 0.02:
                value *= y / math.sin(y)
            for c in range(x.shape[1]):
                x[k, c, j] -= value * channels[c]


@jit_uncounted
def covariance_along(
    x: ComplexArray, first: int, waveform: FloatArray, distance: float, rate: float, half: int, r: ComplexArray
) -> int:
    """Average channels' outer products over sweeps and the bins around an echo: `r` (C, C); return how many."""
    count = 0
    m = x.shape[1]
    for i in range(m):
        for j in range(m):
            r[i, j] = 0.0
    for k in range(x.shape[0]):
        beat, _, _, _ = echo_of_sweep(waveform, k, distance, rate)
        middle = round(beat)
        for b in range(max(middle - half, first), min(middle + half + 1, first + x.shape[2])):
            count += 1
            for i in range(m):
                for j in range(i + 1):
                    r[i, j] += x[k, i, b - first] * x[k, j, b - first].conjugate()
    scale = 1.0 / max(count, 1)
    for i in range(m):
        for j in range(i + 1):
            r[i, j] *= scale
            r[j, i] = r[i, j].conjugate()
    return count


@jit_uncounted
def correlate(
    z: ComplexArray, first: int, waveform: FloatArray, distance: float, rate: float, half: int, out: FloatArray
) -> None:
    """Correlate a beam's samples `z` (sweeps, bins) with an echo m and its slopes by distance (r) and rate (v).

    `out` (CORRELATIONS): real and imaginary parts of <m,z>, <r,z>, <v,z>, <m,r>, <m,v>, then <m,m>, <r,r>, <v,v>,
    the real part of <r,v>; <a,b> sums conj(a) b over the bins within `half` of the echo.
    """
    s0, s1, s2, g01, g02 = 0j, 0j, 0j, 0j, 0j
    g00, g11, g22, g12 = 0.0, 0.0, 0.0, 0.0
    q = waveform[2] * rate
    for k in range(z.shape[0]):
        beat, by_rate, dt, phasor = echo_of_sweep(waveform, k, distance, rate)
        turn = complex(0.0, 2.0 * math.pi * by_rate)
        moved = waveform[0] * dt + waveform[1]
        middle = round(beat)
        sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
        for b in range(max(middle - half, first), min(middle + half + 1, first + z.shape[1])):
            sign = 1.0 - 2.0 * (abs(b - middle) % 2)
            m, slope = bin_response(beat - b, sign * sine, sign * cosine, q)
            r = waveform[0] * slope
            v = moved * slope + turn * m
            sample = z[k, b - first]
            m *= phasor
            r *= phasor
            v *= phasor
            s0 += m.conjugate() * sample
            s1 += r.conjugate() * sample
            s2 += v.conjugate() * sample
            g01 += m.conjugate() * r
            g02 += m.conjugate() * v
            g00 += m.real * m.real + m.imag * m.imag
            g11 += r.real * r.real + r.imag * r.imag
            g22 += v.real * v.real + v.imag * v.imag
            g12 += r.real * v.real + r.imag * v.imag
    out[0], out[1], out[2], out[3], out[4], out[5] = s0.real, s0.imag, s1.real, s1.imag, s2.real, s2.imag
    out[6], out[7], out[8], out[9] = g01.real, g01.imag, g02.real, g02.imag
    out[10], out[11], out[12], out[13] = g00, g11, g22, g12


@jit_uncounted
def echo_slopes(first: int, waveform: FloatArray, distance: float, rate: float, slopes: ComplexArray) -> None:
    """Fill `slopes` (3, sweeps, bins from `first` on) with an echo and its slopes by distance and rate."""
    q = waveform[2] * rate
    for k in range(slopes.shape[1]):
        beat, by_rate, dt, phasor = echo_of_sweep(waveform, k, distance, rate)
        turn = complex(0.0, 2.0 * math.pi * by_rate)
        middle = round(beat)
        sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
        for j in range(slopes.shape[2]):
            sign = 1.0 - 2.0 * (abs(first + j - middle) % 2)
            m, slope = bin_response(beat - first - j, sign * sine, sign * cosine, q)
            slopes[0, k, j] = phasor * m
            slopes[1, k, j] = phasor * slope * waveform[0]
            slopes[2, k, j] = phasor * (slope * (waveform[0] * dt + waveform[1]) + turn * m)


def warmup() -> None:
    """Compile what Python calls."""
    x, sums = np.zeros((1, 1, 1), dtype=np.complex128), np.zeros((1, 1), dtype=np.complex128)
    waveform = np.ones(WAVEFORM)
    sums_of_channels(x, 0, waveform, 1.0, 0.0, 1, sums)
    remove_echo(x, 0, waveform, 1.0, 0.0, sums[0])
    covariance_along(x, 0, waveform, 1.0, 0.0, 1, sums)
    correlate(sums, 0, waveform, 1.0, 0.0, 1, np.zeros(CORRELATIONS))
    echo_slopes(0, waveform, 1.0, 0.0, np.zeros((3, 1, 1), dtype=np.complex128))
