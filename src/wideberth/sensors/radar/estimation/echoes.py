"""An echo of a frame as it is fitted, and what all of them are given out as."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import FloatArray
from wideberth.sensors.radar.estimation.echo_search import HALF_BINS, EchoFit

ComplexArray = NDArray[np.complex128]

_BINS = 2 * HALF_BINS + 1


@dataclass(frozen=True, slots=True)
class Estimates:
    """What a frame's peaks turn out to be, at the middle of the frame.

    Attributes
    ----------
    z : ndarray, shape (n, 4)
        Range m, azimuth rad, elevation rad, range rate m/s (positive opening). NaN where not measured: the range rate
        where it is ambiguous, and an angle that an array of one row or column does not have. Of one row, azimuth is
        the angle asin(right / distance) from the plane across the row; of one column, elevation is asin(up / distance).
    variance : ndarray, shape (n, 4)
        Of each; infinite for angles not measured, and as wide as what is not known of the range rate. An ambiguous
        range rate is in the variance of range, too, as one shifts the other.
    snr_db : ndarray, shape (n,)
        Of one channel and one sweep, the mean over channels.
    peak : ndarray of int, shape (n,)
        Which of the peaks each is from. With the beamformer "mvdr" several may be from one; a peak that stronger
        echoes explain has none.
    """

    z: FloatArray
    variance: FloatArray
    snr_db: FloatArray
    peak: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Echo:
    """An echo, as fitted; `peak` is the peak that it is from, `bin` the bin of that."""

    peak: int
    bin: int
    beat: float  # its bin at the middle of the frame
    fit: EchoFit
    direction: FloatArray
    heard: ComplexArray  # amplitudes of the channels, in the samples' units
    modelled: ComplexArray  # those of a wave from its direction


@dataclass(frozen=True, slots=True)
class Channels:
    """What the channels are near a range bin."""

    scale: FloatArray  # root of the noise
    response: ComplexArray  # over the scale
    adjoint: ComplexArray
    wave_energy: FloatArray  # of a wave's samples, of noise power 1, over the grid of directions


def part_of_energy(off: FloatArray) -> FloatArray:
    """Return at most which part of an echo's energy is in the bins used around a bin so many bins out of its reach."""
    return np.asarray(np.where(off < 1.0, 1.0, _BINS / (np.pi * np.maximum(off, 1.0)) ** 2))
