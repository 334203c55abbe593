"""What the tests of the estimator's kernels are run on: a frame's window around one echo, and noise."""

import numpy as np

from tests.made_frames import radar
from wideberth.sensors.radar.estimation.waveform import frame_waveform

COMPLEX = radar(1, 2, sampling="complex")
SWEEPS, FIRST, BINS, HALF = 6, 125, 24, 4
WAVEFORM = frame_waveform(COMPLEX, SWEEPS)
DISTANCE, RATE = 39.13, 21.7


def noise(seed, *shape):
    """Complex noise of power 2."""
    return np.random.default_rng(seed).normal(size=(*shape, 2)).view(np.complex128)[..., 0]
