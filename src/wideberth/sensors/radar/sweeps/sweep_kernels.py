"""Kernels of simulated sweeps: sampled echoes with a quadratic phase, and the A/D converter."""

import math

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit_uncounted

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]

LANES = 64
"""Samples that are advanced at once; buffers of samples are as long as a multiple of it."""


@jit_uncounted
def chirp_samples(
    start: float, frequency: float, curvature: float, lanes: FloatArray, real: SingleArray, imag: SingleArray
) -> None:
    """Write exp(2 pi i (start + frequency n + curvature n^2)) for all n.

    Each lane takes every 64th sample: a sample times a step is the next one, and a step times a constant the next step.

    Parameters
    ----------
    start, frequency, curvature : float
        Cycles, cycles a sample, cycles a sample squared.
    lanes : ndarray, shape (4, LANES)
        Room to work in.
    real, imag : ndarray of float32, shape (n,)
        Written; n is a multiple of LANES.
    """
    turn = 2.0 * math.pi
    for j in range(LANES):
        phase = turn * (start + frequency * j + curvature * j * j)
        step = turn * (frequency * LANES + curvature * LANES * (2.0 * j + LANES))
        lanes[0, j], lanes[1, j] = math.cos(phase), math.sin(phase)
        lanes[2, j], lanes[3, j] = math.cos(step), math.sin(step)
    bend = turn * 2.0 * curvature * LANES * LANES
    bend_re, bend_im = math.cos(bend), math.sin(bend)
    for first in range(0, real.shape[0], LANES):
        for j in range(LANES):
            z_re, z_im, w_re, w_im = lanes[0, j], lanes[1, j], lanes[2, j], lanes[3, j]
            real[first + j] = z_re
            imag[first + j] = z_im
            lanes[0, j] = z_re * w_re - z_im * w_im
            lanes[1, j] = z_re * w_im + z_im * w_re
            lanes[2, j] = w_re * bend_re - w_im * bend_im
            lanes[3, j] = w_re * bend_im + w_im * bend_re


@jit_uncounted
def add_echoes(
    phases: FloatArray,
    gain_re: SingleArray,
    gain_im: SingleArray,
    lanes: FloatArray,
    tone: SingleArray,
    out: SingleArray,
) -> None:
    """Add echoes to the samples of all sweeps and channels.

    Parameters
    ----------
    phases : ndarray, shape (sweeps, echoes, 3)
        Start, frequency and curvature of `chirp_samples`.
    gain_re, gain_im : ndarray of float32, shape (sweeps, echoes, channels)
        Factor of the echo in a channel. An echo whose factors are all zero costs nothing.
    lanes : ndarray, shape (4, LANES)
    tone : ndarray of float32, shape (2, m)
        Room to work in; m is a multiple of LANES and at least the number of samples.
    out : ndarray of float32, shape (sweeps, channels, samples, parts)
        Added to: the real part alone (parts = 1) or both.
    """
    sweeps, channels, samples, parts = out.shape
    re, im = tone[0], tone[1]
    for s in range(sweeps):
        for k in range(phases.shape[1]):
            heard = False
            for c in range(channels):
                heard = heard or gain_re[s, k, c] != 0.0 or gain_im[s, k, c] != 0.0
            if not heard:
                continue
            chirp_samples(phases[s, k, 0], phases[s, k, 1], phases[s, k, 2], lanes, re, im)
            for c in range(channels):
                row = out[s, c]
                a, b = gain_re[s, k, c], gain_im[s, k, c]
                if parts == 1:
                    for n in range(samples):
                        row[n, 0] += a * re[n] - b * im[n]
                else:
                    for n in range(samples):
                        row[n, 0] += a * re[n] - b * im[n]
                        row[n, 1] += a * im[n] + b * re[n]


@jit_uncounted
def digitize(values: SingleArray, gain: float, offset: float, low: float, high: float, step: float) -> None:
    """Replace values by what an A/D converter makes of them: rounded to whole steps, and clipped.

    Parameters
    ----------
    values : ndarray of float32, shape (n,)
        Changed.
    gain : float
        Steps for a value of 1.
    offset, low, high : float
        Constant error, least and greatest result, in steps.
    step : float
        What a step stands for in the result.
    """
    g, shift, lowest, highest, unit = (
        np.float32(gain),
        np.float32(offset),
        np.float32(low),
        np.float32(high),
        np.float32(step),
    )
    for n in range(values.shape[0]):
        values[n] = min(max(np.rint(values[n] * g + shift), lowest), highest) * unit


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    lanes, tone = np.empty((4, LANES)), np.empty((2, LANES), np.float32)
    gain = np.ones((1, 1, 1), np.float32)
    chirp_samples(0.0, 0.1, 0.0, lanes, tone[0], tone[1])
    out = np.zeros((1, 1, 8, 1), np.float32)
    add_echoes(np.zeros((1, 1, 3)), gain, gain, lanes, tone, out)
    digitize(out.reshape(-1), 1.0, 0.0, -8.0, 7.0, 1.0)
