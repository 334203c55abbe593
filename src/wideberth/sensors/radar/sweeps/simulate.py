"""Sweeps of a simulated FMCW phased-array radar, down to the samples of its channels.

Samples are volts across 1 ohm at the receiver's input: an echo of power P is a tone of amplitude sqrt(2 P) in real
samples, sqrt(P) in complex ones, and every level follows the link budget (`link_budget`; thesis 5.2, table 5.1).
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from wideberth.argument_checks import COUNT, FINITE, checked
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.sweeps.beats import beats
from wideberth.sensors.radar.sweeps.fluctuation import draw_fluctuation
from wideberth.sensors.radar.sweeps.ground_clutter import GroundClutter, clutter_samples
from wideberth.sensors.radar.sweeps.paths import Multipath, RadarTarget, echo_paths
from wideberth.sensors.radar.sweeps.receiver import Samples, convert, draw_noise, sample_noise
from wideberth.sensors.radar.sweeps.sweep_kernels import LANES, add_echoes

__all__ = ["GroundClutter", "Multipath", "RadarTarget", "simulate_frames", "simulate_noise", "simulate_sweeps"]

Seed = int | Sequence[int]

_NOISE, _FLUCTUATION = 0, 1


def simulate_sweeps(
    radar: RadarConfig,
    targets: Sequence[RadarTarget],
    n_sweeps: int,
    seed: Seed,
    *,
    start_time: float = 0.0,
    clutter: GroundClutter | None = None,
    multipath: Multipath | None = None,
) -> Samples:
    """Return the samples of one frame.

    Beats have range-Doppler coupling (an opening target seems farther by range rate times carrier frequency times sweep
    time over bandwidth), the Doppler phase from sweep to sweep, and migrate through range bins. Targets beyond the
    instrumented range fold into it, as far as the IF filter lets them pass: the ideal one stops them.

    Parameters
    ----------
    radar : RadarConfig
        Of one unit: directions of targets are in its axes, whatever `boresight_azimuths_deg`.
    targets : sequence of RadarTarget
        Where they are in the middle of the frame: halfway from the start of its first sweep to the end of its last.
    n_sweeps : int
    seed : int or sequence of int
        Not negative. The noise does not depend on the targets, nor a target's fluctuation on those after it.
    start_time : float
        Of the frame, s, for clutter that moves.
    clutter : GroundClutter or None
    multipath : Multipath or None

    Returns
    -------
    ndarray of float32 (sampling "real") or complex64, shape (n_sweeps, channels, samples)
        V.

    Raises
    ------
    ValueError
        If `n_sweeps` is not a whole number of at least 1, the seed negative, a time not finite, a target not above the
        ground that mirrors it, passing through the radar within the frame, or too near for the link budget.
    """
    sweeps = int(checked("n_sweeps", n_sweeps, COUNT))
    start = float(checked("start_time", start_time, FINITE))
    values = draw_noise(radar, sweeps, _generator(seed, _NOISE))
    unit = sample_noise(radar)
    if targets or radar.receiver.leakage_db is not None:
        paths = echo_paths(targets, np.radians(radar.boresight_elevation_deg), multipath)
        fluctuation = draw_fluctuation([target.swerling for target in targets], _generator(seed, _FLUCTUATION))
        phases, gains = beats(radar, targets, paths, fluctuation, sweeps)
        gains *= (np.sqrt(2.0) if radar.sampling == "real" else 1.0) / unit
        room = -(-radar.samples_per_sweep // LANES) * LANES
        real, imag = gains.real.astype(np.float32), gains.imag.astype(np.float32)
        add_echoes(phases, real, imag, np.empty((4, LANES)), np.empty((2, room), np.float32), values)
    if clutter is not None:
        ground = clutter_samples(radar, clutter, start, sweeps) * np.float32(1.0 / unit)
        values += ground.view(np.float32).reshape(*ground.shape, -1)
    return convert(radar, values)


def simulate_noise(radar: RadarConfig, n_sweeps: int, seed: Seed) -> Samples:
    """Return the samples of one frame without any target: receiver noise, and leakage if the receiver has it.

    Parameters
    ----------
    radar : RadarConfig
    n_sweeps : int
    seed : int or sequence of int
        Not negative.

    Returns
    -------
    ndarray of float32 or complex64, shape (n_sweeps, channels, samples)
        V.

    Raises
    ------
    ValueError
        As in `simulate_sweeps`.
    """
    return simulate_sweeps(radar, (), n_sweeps, seed)


def simulate_frames(
    radar: RadarConfig,
    scenes: Iterable[Sequence[RadarTarget]],
    n_sweeps: int,
    seed: Seed,
    *,
    clutter: GroundClutter | None = None,
    multipath: Multipath | None = None,
) -> Iterator[Samples]:
    """Yield frame after frame, `update_interval_s` apart; nothing is kept of those before.

    Parameters
    ----------
    radar : RadarConfig
    scenes : iterable of sequence of RadarTarget
        The targets of each frame; `itertools.repeat((), 400)` makes 400 frames without any.
    n_sweeps : int
    seed : int or sequence of int
        Not negative; frame k is that of `simulate_sweeps` with the seed (seed, k).
    clutter : GroundClutter or None
    multipath : Multipath or None

    Yields
    ------
    ndarray of float32 or complex64, shape (n_sweeps, channels, samples)
        V.

    Raises
    ------
    ValueError
        As in `simulate_sweeps`.
    """
    for k, targets in enumerate(scenes):
        start = k * radar.update_interval_s
        key = (*_words(seed), k)
        yield simulate_sweeps(radar, targets, n_sweeps, key, start_time=start, clutter=clutter, multipath=multipath)


def _words(seed: Seed) -> tuple[int, ...]:
    words = tuple(seed) if isinstance(seed, Sequence) else (seed,)
    if not words or not all(isinstance(word, (int, np.integer)) and word >= 0 for word in words):
        raise ValueError(f"seed must be a whole number of at least 0, or several, got {seed!r}")
    return words


def _generator(seed: Seed, purpose: int) -> np.random.Generator:
    words = _words(seed)
    # The number of words counts: else (5, 0) were the seed 5.
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence((len(words), *words), spawn_key=(purpose,))))
