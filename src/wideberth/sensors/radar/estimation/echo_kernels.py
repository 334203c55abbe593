"""Kernels of one echo in the range bins of a frame: its model, and its correlation with samples.

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

from wideberth._jit import jit, jit_uncounted

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WAVEFORM = 9
CORRELATIONS = 14

CELLS = 4
"""Numbers of a cell of a sweep: a bin's response and its slope, real and imaginary parts."""

_ORDERS = 10
TERMS = 10
_NEAR = 2.0  # of pi delta, below which the series stand and beyond which the recurrence does


def _series() -> FloatArray:
    # Derivative n of sin(x)/x by powers of x^2, without the factor x that odd ones have.
    table = np.zeros((_ORDERS, TERMS))
    for n in range(_ORDERS):
        for j in range(TERMS):
            power = 2 * j + n + n % 2  # of x in sin(x)/x, from which the derivative leaves power - n
            sign = -1.0 if (power // 2) % 2 else 1.0
            table[n, j] = sign * math.perm(power, n) / math.factorial(power + 1)
    return table


_SERIES = _series()


@jit_uncounted
def _horner(n: int, y: float) -> float:
    value = 0.0
    for j in range(TERMS - 1, -1, -1):
        value = value * y + _SERIES[n, j]
    return value


@jit_uncounted
def _with_chirp(
    f0: float,
    f1: float,
    f2: float,
    f3: float,
    f4: float,
    f5: float,
    f6: float,
    f7: float,
    f8: float,
    f9: float,
    t: float,
) -> tuple[float, float, float, float]:
    t2, t3, t4 = t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0
    return (
        f0 - t2 * f4 + t4 * f8,
        t3 * f6 - t * f2,
        math.pi * (f1 - t2 * f5 + t4 * f9),
        math.pi * (t3 * f7 - t * f3),
    )


@jit_uncounted
def _near_response(x: float, t: float) -> tuple[float, float, float, float]:
    y = x * x
    f0, f2, f4, f6, f8 = _horner(0, y), _horner(2, y), _horner(4, y), _horner(6, y), _horner(8, y)
    f1, f3, f5 = x * _horner(1, y), x * _horner(3, y), x * _horner(5, y)
    f7, f9 = x * _horner(7, y), x * _horner(9, y)
    return _with_chirp(f0, f1, f2, f3, f4, f5, f6, f7, f8, f9, t)


@jit_uncounted
def _middling_response(x: float, sine: float, cosine: float, t: float) -> tuple[float, float, float, float]:
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
    return _with_chirp(f0, f1, f2, f3, f4, f5, f6, f7, f8, f9, t)


@jit_uncounted
def bin_responses(delta: float, sine: float, cosine: float, q: float, n: int, cells: FloatArray) -> None:
    """Fill the first `n` of `cells` (CELLS, n or more) with the responses of bins one after the other, from `delta` on.

    A response is D(delta; q), the integral of exp(2 pi i (delta s + q s^2)) over s from -1/2 to 1/2, and its slope;
    `sine` and `cosine` are those of pi delta. A chirp takes derivatives of sin(x)/x, two for each order of q; to the
    fourth order, D is right to 4e-5 for q up to 0.35 (51 m/s with table 5.1), and to 1e-3 for twice that. It is a plain
    loop, for the compiler to take several bins at once.
    """
    t = 0.5 * math.pi * q
    for i in range(n):
        sign = 1.0 - 2.0 * (i % 2)
        x = math.pi * (delta - i)
        cells[0, i], cells[1, i], cells[2, i], cells[3, i] = _middling_response(
            x if x != 0.0 else 1.0, sign * sine, sign * cosine, t
        )
    for i in range(max(math.ceil(delta - _NEAR / math.pi), 0), min(math.floor(delta + _NEAR / math.pi) + 1, n)):
        cells[0, i], cells[1, i], cells[2, i], cells[3, i] = _near_response(math.pi * (delta - i), t)


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
def middle_series(q: float, series: FloatArray) -> None:
    """Fill `series` (CELLS, TERMS): the powers of (pi delta)^2 in the response, of chirp `q`, of the bin next to it.

    Those of the slope lack a factor pi delta.
    """
    t = 0.5 * math.pi * q
    t2, t3, t4 = t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0
    for j in range(TERMS):
        series[0, j] = _SERIES[0, j] - t2 * _SERIES[4, j] + t4 * _SERIES[8, j]
        series[1, j] = t3 * _SERIES[6, j] - t * _SERIES[2, j]
        series[2, j] = math.pi * (_SERIES[1, j] - t2 * _SERIES[5, j] + t4 * _SERIES[9, j])
        series[3, j] = math.pi * (t3 * _SERIES[7, j] - t * _SERIES[3, j])


@jit_uncounted
def used_responses(beat: float, q: float, half: int, series: FloatArray, cells: FloatArray) -> int:
    """Fill `cells` (CELLS, 2 half + 1) with the responses of the bins within `half` of a beat; return the nearest bin.

    That one, by `middle_series`, is the last column; the others are in order. Eight at a time are no more than one.
    """
    middle = round(beat)
    delta, t = beat - middle, 0.5 * math.pi * q
    first = 1.0 - 2.0 * (half % 2)
    sine, cosine = first * math.sin(math.pi * delta), first * math.cos(math.pi * delta)
    for j in range(2 * half):
        skip = 1.0 if j >= half else 0.0
        sign = (1.0 - 2.0 * (j % 2)) * (1.0 - 2.0 * skip)
        cells[0, j], cells[1, j], cells[2, j], cells[3, j] = _middling_response(
            math.pi * (delta + half - j - skip), sign * sine, sign * cosine, t
        )
    x = math.pi * delta
    y = x * x
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for j in range(TERMS - 1, -1, -1):
        a, b = a * y + series[0, j], b * y + series[1, j]
        c, d = c * y + series[2, j], d * y + series[3, j]
    cells[0, 2 * half], cells[1, 2 * half], cells[2, 2 * half], cells[3, 2 * half] = a, b, x * c, x * d
    return middle


@jit_uncounted
def used_bin(j: int, half: int) -> int:
    """Return the bin of a column of `used_responses`, from the nearest."""
    return 0 if j == 2 * half else j - half + (1 if j >= half else 0)


@jit
def sums_of_channels(
    x: ComplexArray, first: int, waveform: FloatArray, distance: float, rate: float, half: int, sums: ComplexArray
) -> None:
    """Correlate each sweep and channel of `x` (sweeps, channels, bins from `first` on) with an echo: `sums` (K, C)."""
    cells, series = np.empty((CELLS, 2 * half + 1)), np.empty((CELLS, TERMS))
    middle_series(waveform[2] * rate, series)
    for k in range(x.shape[0]):
        beat, _, _, phasor = echo_of_sweep(waveform, k, distance, rate)
        at = used_responses(beat, waveform[2] * rate, half, series, cells) - first
        for c in range(x.shape[1]):
            sums[k, c] = phasor.conjugate() * correlated_cells(x[k, c], at, half, cells)


@jit_uncounted
def correlated_cells(row: ComplexArray, at: int, half: int, cells: FloatArray) -> complex:
    """Return the correlation of a sweep's samples with the responses of the bins around its column `at`."""
    re, im = 0.0, 0.0
    for j in range(2 * half + 1):
        b = at + used_bin(j, half)
        if 0 <= b < row.shape[0]:
            re += cells[0, j] * row[b].real + cells[1, j] * row[b].imag
            im += cells[0, j] * row[b].imag - cells[1, j] * row[b].real
    return complex(re, im)


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
    z: ComplexArray,
    first: int,
    waveform: FloatArray,
    distance: float,
    rate: float,
    half: int,
    cells: FloatArray,
    series: FloatArray,
    out: FloatArray,
) -> None:
    """Correlate a beam's samples `z` (sweeps, bins) with an echo m and its slopes by distance (r) and rate (v).

    `out` (CORRELATIONS): real and imaginary parts of <m,z>, <r,z>, <v,z>, <m,r>, <m,v>, then <m,m>, <r,r>, <v,v>,
    the real part of <r,v>; <a,b> sums conj(a) b over the bins within `half` of the echo. `cells` (CELLS, 2 half + 1)
    and `series` (CELLS, TERMS) are room to work in.
    """
    s0, s1, s2, g01, g02 = 0j, 0j, 0j, 0j, 0j
    g00, g11, g22, g12 = 0.0, 0.0, 0.0, 0.0
    q = waveform[2] * rate
    middle_series(q, series)
    for k in range(z.shape[0]):
        beat, by_rate, dt, phasor = echo_of_sweep(waveform, k, distance, rate)
        turn = 2.0 * math.pi * by_rate
        moved = waveform[0] * dt + waveform[1]
        at = used_responses(beat, q, half, series, cells) - first
        # Of this sweep: response and slope with the samples, their energies, and with each other.
        mz_re, mz_im, dz_re, dz_im, mm, dd, md_re, md_im = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(2 * half + 1):
            b = at + used_bin(i, half)
            if b < 0 or b >= z.shape[1]:
                continue
            sample = z[k, b]
            m_re, m_im, d_re, d_im = cells[0, i], cells[1, i], cells[2, i], cells[3, i]
            mz_re += m_re * sample.real + m_im * sample.imag
            mz_im += m_re * sample.imag - m_im * sample.real
            dz_re += d_re * sample.real + d_im * sample.imag
            dz_im += d_re * sample.imag - d_im * sample.real
            mm += m_re * m_re + m_im * m_im
            dd += d_re * d_re + d_im * d_im
            md_re += m_re * d_re + m_im * d_im
            md_im += m_re * d_im - m_im * d_re
        back = phasor.conjugate()
        mz, dz = back * complex(mz_re, mz_im), back * complex(dz_re, dz_im)
        power = phasor.real * phasor.real + phasor.imag * phasor.imag
        # v is (moved d + i turn m): of two with themselves only what is not at right angles counts.
        s0 += mz
        s1 += waveform[0] * dz
        s2 += moved * dz - complex(0.0, turn) * mz
        g01 += power * waveform[0] * complex(md_re, md_im)
        g02 += power * complex(moved * md_re, moved * md_im + turn * mm)
        g00 += power * mm
        g11 += power * waveform[0] * waveform[0] * dd
        g22 += power * (moved * moved * dd + turn * turn * mm + 2.0 * moved * turn * md_im)
        g12 += power * waveform[0] * (moved * dd + turn * md_im)
    out[0], out[1], out[2], out[3], out[4], out[5] = s0.real, s0.imag, s1.real, s1.imag, s2.real, s2.imag
    out[6], out[7], out[8], out[9] = g01.real, g01.imag, g02.real, g02.imag
    out[10], out[11], out[12], out[13] = g00, g11, g22, g12


@jit
def echo_slopes(first: int, waveform: FloatArray, distance: float, rate: float, slopes: ComplexArray) -> None:
    """Fill `slopes` (3, sweeps, bins from `first` on) with an echo and its slopes by distance and rate."""
    cells = np.empty((CELLS, slopes.shape[2]))
    q = waveform[2] * rate
    for k in range(slopes.shape[1]):
        beat, by_rate, dt, phasor = echo_of_sweep(waveform, k, distance, rate)
        turn = complex(0.0, 2.0 * math.pi * by_rate)
        middle = round(beat)
        sine, cosine = math.sin(math.pi * (beat - middle)), math.cos(math.pi * (beat - middle))
        sign = 1.0 - 2.0 * (abs(first - middle) % 2)
        bin_responses(beat - first, sign * sine, sign * cosine, q, slopes.shape[2], cells)
        for j in range(slopes.shape[2]):
            m, slope = complex(cells[0, j], cells[1, j]), complex(cells[2, j], cells[3, j])
            slopes[0, k, j] = phasor * m
            slopes[1, k, j] = phasor * slope * waveform[0]
            slopes[2, k, j] = phasor * (slope * (waveform[0] * dt + waveform[1]) + turn * m)


def warmup() -> None:
    """Compile what Python calls."""
    x, sums = np.zeros((1, 1, 1), dtype=np.complex128), np.zeros((1, 1), dtype=np.complex128)
    waveform = np.ones(WAVEFORM)
    sums_of_channels(x, 0, waveform, 1.0, 0.0, 1, sums)
    covariance_along(x, 0, waveform, 1.0, 0.0, 1, sums)
    correlate(sums, 0, waveform, 1.0, 0.0, 1, np.zeros((CELLS, 3)), np.zeros((CELLS, TERMS)), np.zeros(CORRELATIONS))
    echo_slopes(0, waveform, 1.0, 0.0, np.zeros((3, 1, 1), dtype=np.complex128))
