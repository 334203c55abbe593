"""When a track is confirmed: by so many detections in so many scans, of a target that comes nearer meanwhile."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.argument_checks import NOT_NEGATIVE, POSITIVE, PROBABILITY, UNSURE, FloatArray, checked, choice

WINDOW_MAX = 12
_SCANS_AT_ONCE = 128
_SCANS_MAX = 20_000
_NEGLIGIBLE = 1e-9


class _Histories:
    """How likely each history of the last scans is, for the targets that are not confirmed yet.

    A history is a number whose bits are the detections of the last `window - 1` scans, the newest in the lowest bit.
    """

    def __init__(self, hits: int, window: int, targets: int) -> None:
        self._size = 1 << (window - 1)
        detections = np.array([h.bit_count() for h in range(self._size)])
        self._one_short = detections == hits - 1
        self._likely = np.zeros((self._size, targets))
        self._likely[0] = 1.0
        self.confirmed = np.zeros(targets)

    def scan(self, p: FloatArray) -> None:
        """Take in a scan that detects each target with probability `p`."""
        hit = self._likely * p
        miss = self._likely - hit
        self.confirmed += hit[self._one_short].sum(axis=0)
        hit[self._one_short] = 0.0
        if self._size == 1:
            self._likely = hit + miss
            return
        # The oldest scan, the highest bit, leaves the window.
        half = self._size // 2
        self._likely[0::2] = miss[:half] + miss[half:]
        self._likely[1::2] = hit[:half] + hit[half:]

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Drop the other targets."""
        self._likely = self._likely[:, which]
        self.confirmed = self.confirmed[which]


def _check_rule(hits: int, window: int) -> None:
    choice("window", window, tuple(range(1, WINDOW_MAX + 1)))
    choice("hits", hits, tuple(range(1, window + 1)))


def confirmation_probability(p_detection: ArrayLike, hits: int, window: int) -> FloatArray:
    """Return the probability that a track has been confirmed by each scan.

    Parameters
    ----------
    p_detection : array_like, shape (scans, ...)
        Probability of detection in each scan; scans are independent.
    hits, window : int
        Confirmed once `hits` of the last `window` scans have detected the target.

    Returns
    -------
    ndarray, shape (scans, ...)

    Raises
    ------
    ValueError
        If a probability is not between 0 and 1, there is no axis of scans, or the rule makes no sense.
    """
    _check_rule(hits, window)
    p = checked("p_detection", p_detection, PROBABILITY)
    if p.ndim == 0:
        raise ValueError("p_detection must have an axis of scans")
    histories = _Histories(hits, window, math.prod(p.shape[1:]))
    found = np.empty((len(p), math.prod(p.shape[1:])))
    for k, row in enumerate(p.reshape(found.shape)):
        histories.scan(row)
        found[k] = histories.confirmed
    return np.minimum(found, 1.0).reshape(p.shape)


def confirmation_range(
    p_detection: Callable[[FloatArray], FloatArray],
    closing_speed: ArrayLike,
    *,
    update_interval: float,
    range_limit: float,
    range_min: float,
    hits: int,
    window: int,
    confirmed_with: float,
) -> FloatArray:
    """Return how far a closing target is when its track has been confirmed with a probability.

    The target comes from beyond the limit at constant speed; a scan has just missed it there. Its range is that at the
    scan which confirms. Scans are at least 1/20000 of the limit apart, so that a target which hardly closes is looked
    at less often than it would be: the range is rather too short there.

    Parameters
    ----------
    p_detection : callable
        Probability of detection in a scan, of ranges with the shape (scans, *shape of `closing_speed`).
    closing_speed : array_like
        m/s.
    update_interval : float
        s.
    range_limit, range_min : float
        A scan sees a target between these, m.
    hits, window : int
        Confirmed once `hits` of the last `window` scans have detected the target.
    confirmed_with : float
        The probability.

    Returns
    -------
    ndarray
        m; 0 where the target comes nearer than `range_min` before that.

    Raises
    ------
    ValueError
        If a speed, interval or range is not positive, the ranges are in the wrong order, a probability is not inside 0
        to 1, or the rule makes no sense.
    """
    speed = checked("closing_speed", closing_speed, POSITIVE)
    interval = float(checked("update_interval", update_interval, POSITIVE))
    far = float(checked("range_limit", range_limit, POSITIVE))
    near = float(checked("range_min", range_min, NOT_NEGATIVE))
    wanted = float(checked("confirmed_with", confirmed_with, UNSURE))
    _check_rule(hits, window)
    if near >= far:
        raise ValueError("range_min must be less than range_limit")
    step = np.maximum(speed * interval, far / _SCANS_MAX)
    found = np.zeros(speed.size)
    histories = _Histories(hits, window, speed.size)
    left = np.arange(speed.size)
    started = False
    # Scans before any that matters: even all of them together would confirm nothing.
    nothing = (_NEGLIGIBLE / (math.comb(window, hits) * _SCANS_MAX)) ** (1.0 / hits)
    for first in range(1, _SCANS_MAX + 1, _SCANS_AT_ONCE):
        numbers = np.arange(first, first + _SCANS_AT_ONCE).reshape(-1, *(1,) * speed.ndim)
        ranges = far - numbers * step
        seen = ranges >= near
        p = np.where(seen, p_detection(np.where(seen, ranges, max(near, far / _SCANS_MAX))), 0.0)
        p = p.reshape(len(numbers), -1)
        ranges = ranges.reshape(len(numbers), -1)
        started = started or bool((p > nothing).any())
        if started:
            for k in range(len(numbers)):
                histories.scan(p[k, left])
                reached = histories.confirmed >= wanted
                if reached.any():
                    found[left[reached]] = ranges[k, left[reached]]
                    histories.keep(~reached)
                    left = left[~reached]
        coming = seen[-1].reshape(-1)[left]
        histories.keep(coming)
        left = left[coming]
        if left.size == 0:
            break
    return found.reshape(speed.shape)
