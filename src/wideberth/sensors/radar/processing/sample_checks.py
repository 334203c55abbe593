"""Which sweeps and channels of a frame can be used: dead, clipped or broken ones are left out and counted."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.errors import InputError
from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.sample_extremes_kernels import sample_extremes

_EVERY = 7  # samples that are counted: a share of a tenth is had well enough
_GLANCE = 8  # of those, for a first look that tells the usual channel, without clipped samples, from others
_ENOUGH = 1000  # samples for that look


@dataclass(frozen=True, slots=True)
class UsableSamples:
    """What of a frame is used.

    Attributes
    ----------
    sweeps : slice
        The longest run of sweeps without NaN or infinity: range rates need even spacing.
    channels : ndarray of bool, shape (channels,)
    rejects : mapping of str to int
        Channels ``channel_not_finite``, ``channel_constant``, ``channel_clipped``; sweeps ``sweep_not_finite`` and
        ``sweep_outside_run``. Only causes that occur.
    """

    sweeps: slice
    channels: NDArray[np.bool_]
    rejects: Mapping[str, int]


def usable_samples(config: RadarConfig, samples: NDArray[Any]) -> UsableSamples:
    """Return what of a frame can be used.

    A channel that is broken in more than half of the sweeps is left out, and else the sweeps in which one is broken. So
    are channels whose samples are all the same, and those with more than `config.processing.clipped_share` of them at
    their greatest or least value.

    Parameters
    ----------
    config : RadarConfig
    samples : ndarray of float32 or complex64, shape (sweeps, channels, samples_per_sweep)
        As of `range_compression.checked_samples`.

    Returns
    -------
    UsableSamples

    Raises
    ------
    InputError
        If no channel, or no sweep, is left.
    """
    parts = samples.view(np.float32)
    high, low = np.empty(parts.shape[:2], np.float32), np.empty(parts.shape[:2], np.float32)
    sample_extremes(parts.ravel(), high.ravel(), low.ravel())
    finite: NDArray[np.bool_] = np.isfinite(high) & np.isfinite(low)
    broken = 2 * np.count_nonzero(~finite, axis=0) > len(finite)
    top = np.max(high, axis=0, initial=-np.inf, where=finite)
    bottom = np.min(low, axis=0, initial=np.inf, where=finite)
    constant = ~broken & (top == bottom)
    clipped = ~broken & ~constant & _clipped(config, parts, high == top, low == bottom, top, bottom)
    used = ~(broken | constant | clipped)
    whole = np.asarray(finite[:, used].all(axis=1))
    sweeps = _longest_run(whole)
    kept = sweeps.stop - sweeps.start
    rejects = {
        "channel_not_finite": int(broken.sum()),
        "channel_constant": int(constant.sum()),
        "channel_clipped": int(clipped.sum()),
        "sweep_not_finite": int(np.count_nonzero(~whole)),
        "sweep_outside_run": int(np.count_nonzero(whole)) - kept,
    }
    rejects = {cause: n for cause, n in rejects.items() if n}
    if not used.any() or not kept:
        causes = ", ".join(f"{cause} {n}" for cause, n in rejects.items())
        raise InputError(f"nothing of the frame can be used: {causes}; look at the cables and the converters' range")
    return UsableSamples(sweeps, used, rejects)


def _clipped(
    config: RadarConfig,
    parts: NDArray[np.float32],
    at_top: NDArray[np.bool_],
    at_bottom: NDArray[np.bool_],
    top: NDArray[np.float32],
    bottom: NDArray[np.float32],
) -> NDArray[np.bool_]:
    clipped = np.zeros(parts.shape[1], np.bool_)
    share = config.processing.clipped_share
    # Samples are counted only where many sweeps reach the same extreme, and where some do not tell enough.
    often = min(1.0, share) * len(parts)
    suspect = at_top.sum(axis=0) + at_bottom.sum(axis=0) >= max(often, 1.0)
    some = parts[:, :, :: _EVERY * _GLANCE]
    if some.shape[0] * some.shape[2] >= _ENOUGH:
        extreme = (some == top[:, None]) | (some == bottom[:, None])
        suspect &= np.count_nonzero(extreme, axis=(0, 2)) >= 0.5 * share * some.shape[0] * some.shape[2]
    for channel in np.flatnonzero(suspect):
        values = parts[:, channel, ::_EVERY]
        extreme = np.count_nonzero((values == top[channel]) | (values == bottom[channel]))
        clipped[channel] = extreme > share * values.size
    return clipped


def _longest_run(good: NDArray[np.bool_]) -> slice:
    """Return the longest (of equals the first) run of true values; empty where there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return slice(0, 0)
    longest = int(np.argmax(ends - starts))
    return slice(int(starts[longest]), int(ends[longest]))
