"""Averaged powers of a frame as one would first write them: the window in the time domain, one spectrum at a time."""

import numpy as np
from numpy.typing import NDArray


def channel_powers(
    samples: NDArray[np.floating] | NDArray[np.complexfloating], bins: int, hann: bool, moving_target: bool
) -> NDArray[np.float64]:
    """Mean power (channels, bins), scaled to a target in the middle of a bin; samples (sweeps, channels, n)."""
    sweeps, channels, n = samples.shape
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(n) / n) if hann else np.ones(n)
    scale = (1.0 if np.iscomplexobj(samples) else np.sqrt(2.0)) / n
    power = np.zeros((channels, bins))
    for channel in range(channels):
        spectra = [scale * np.fft.fft(window * samples[sweep, channel])[:bins] for sweep in range(sweeps)]
        mean = sum(spectra) / sweeps if moving_target else 0.0
        for spectrum in spectra:
            power[channel] += np.abs(spectrum - mean) ** 2 / (sweeps - moving_target)
    return power


def groups(detected: list[bool], minimum: int) -> list[tuple[int, int]]:
    """First and last bin of runs of at least so many."""
    found, start = [], None
    for i, over in enumerate([*detected, False]):
        if over and start is None:
            start = i
        if not over and start is not None:
            if i - start >= minimum:
                found.append((start, i - 1))
            start = None
    return found


def peaks(power: list[float], found: list[tuple[int, int]]) -> list[int]:
    """Bins of the groups that are greater than the one before and not less than the one after."""
    result = []
    for first, last in found:
        for i in range(first, last + 1):
            before = power[i - 1] if i > 0 else -np.inf
            after = power[i + 1] if i + 1 < len(power) else -np.inf
            if power[i] > before and power[i] >= after:
                result.append(i)
    return result


def cfar_cells(i: int, first: int, last: int, cells: int, guard: int, step: int) -> list[int]:
    """Cells on both sides in order of distance; where one side has too few, more from the other."""
    left = [i - guard - 1 - step * k for k in range(2 * cells) if i - guard - 1 - step * k >= first]
    right = [i + guard + 1 + step * k for k in range(2 * cells) if i + guard + 1 + step * k < last]
    n = min(max(cells, 2 * cells - len(right)), len(left))
    return left[:n] + right[: 2 * cells - n]


def clutter_map(
    powers: NDArray[np.float64], used: NDArray[np.bool_], frames: float, most: float
) -> NDArray[np.float64]:
    """Return the forgetting mean of each channel and bin over frames, bin by bin."""
    found = np.zeros(powers.shape[1:])
    for channel in range(powers.shape[1]):
        for b in range(powers.shape[2]):
            level, n = 0.0, 0
            for k in range(len(powers)):
                if used[k, channel]:
                    n += 1
                    now = powers[k, channel, b] if n == 1 else min(powers[k, channel, b], most * level)
                    share = max(1.0 / n, 1.0 / frames)
                    level = (1.0 - share) * level + share * now
            found[channel, b] = level
    return found
