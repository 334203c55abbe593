"""Compiled look-up of recorded aircraft: segments of knots, linear in between."""

import numpy as np
from numpy.typing import NDArray

from wideberth._jit import jit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@jit
def states_at(
    t: float,
    offsets: IntArray,
    aircraft: IntArray,
    times: FloatArray,
    states: FloatArray,
    out_states: FloatArray,
    out_aircraft: IntArray,
) -> int:
    """Write the states at time `t` of all aircraft that are present then, and return how many.

    Segment s, of aircraft ``aircraft[s]``, has the knots ``offsets[s]`` to ``offsets[s + 1]`` (exclusive) of `times`
    (rising) and `states` (n, 6). An aircraft is present from the first to the last knot of a segment.
    """
    count = 0
    for s in range(aircraft.shape[0]):
        first, last = offsets[s], offsets[s + 1] - 1
        if t < times[first] or t > times[last]:
            continue
        low, high = first, last  # times[low] <= t <= times[high]
        while high - low > 1:
            middle = (low + high) // 2
            if times[middle] <= t:
                low = middle
            else:
                high = middle
        fraction = (t - times[low]) / (times[high] - times[low])
        for i in range(6):
            out_states[count, i] = states[low, i] + fraction * (states[high, i] - states[low, i])
        out_aircraft[count] = aircraft[s]
        count += 1
    return count


@jit
def states_at_many(
    at: FloatArray, offsets: IntArray, aircraft: IntArray, times: FloatArray, states: FloatArray, out: FloatArray
) -> None:
    """Write the states (m, aircraft, 6) at each time of `at` (rising) into `out`; NaN where an aircraft is absent."""
    out[:] = np.nan
    m = at.shape[0]
    for s in range(aircraft.shape[0]):
        first, last = offsets[s], offsets[s + 1] - 1
        low = first
        k = np.searchsorted(at, times[first])
        while k < m and at[k] <= times[last]:
            while low < last - 1 and times[low + 1] <= at[k]:
                low += 1
            fraction = (at[k] - times[low]) / (times[low + 1] - times[low])
            for i in range(6):
                out[k, aircraft[s], i] = states[low, i] + fraction * (states[low + 1, i] - states[low, i])
            k += 1


def warmup() -> None:
    """Compile every kernel of this module."""
    offsets, aircraft = np.array([0, 2]), np.zeros(1, np.int64)
    times, states = np.array([0.0, 1.0]), np.zeros((2, 6))
    states_at(0.5, offsets, aircraft, times, states, np.empty((1, 6)), np.empty(1, np.int64))
    states_at_many(times, offsets, aircraft, times, states, np.empty((2, 1, 6)))
