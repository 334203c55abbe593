"""Where the noise of simulated broadcasts comes from: a stream for each aircraft, or counters of an encounter."""

import hashlib
from collections import Counter
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from wideberth.sensors.adsb import kernels
from wideberth.types import FloatArray

_BLOCK = 64
"""Broadcasts for which a stream is drawn at once."""

ROW_UNIFORMS = kernels.UNIFORMS + 1
"""Uniform numbers of a broadcast: those of the error model, and the jitter of its time."""


class BroadcastNoise(Protocol):
    """The noise of n aircraft's broadcasts."""

    def start(self, aircraft: int) -> tuple[float, FloatArray]:
        """Return the phase (uniform) and three standard normal numbers for the errors at the start; called once."""

    def row(self, aircraft: int, broadcast: int) -> tuple[FloatArray, FloatArray]:
        """Return the standard normal (NORMALS,) and uniform (ROW_UNIFORMS,) numbers of a broadcast, counted from 0.

        Broadcasts are asked for in order; the latest may be asked for again.
        """


def noise_stream(seed: int, consumer: str) -> np.random.Generator:
    """Return the noise stream of one consumer: depends on nothing but the seed and the consumer's name.

    Parameters
    ----------
    seed : int
    consumer : str
        For an aircraft, its address.
    """
    digest = hashlib.sha256(f"{seed}/{consumer}".encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))


class StreamNoise:
    """A stream for each aircraft, named after its address.

    Parameters
    ----------
    seed : int
    addresses : sequence of str
    """

    def __init__(self, seed: int, addresses: Sequence[str]) -> None:
        seen: Counter[str] = Counter()
        self._streams = []
        for address in addresses:
            self._streams.append(noise_stream(seed, f"adsb/{address}/{seen[address]}"))
            seen[address] += 1
        n = len(self._streams)
        self._block = [-1] * n
        self._normals = np.empty((n, _BLOCK, kernels.NORMALS))
        self._uniforms = np.empty((n, _BLOCK, ROW_UNIFORMS))

    def start(self, aircraft: int) -> tuple[float, FloatArray]:
        """See `BroadcastNoise`."""
        stream = self._streams[aircraft]
        return stream.random(), stream.standard_normal(3)

    def row(self, aircraft: int, broadcast: int) -> tuple[FloatArray, FloatArray]:
        """See `BroadcastNoise`."""
        block, row = divmod(broadcast, _BLOCK)
        if block != self._block[aircraft]:
            stream = self._streams[aircraft]
            self._normals[aircraft] = stream.standard_normal((_BLOCK, kernels.NORMALS))
            self._uniforms[aircraft] = stream.random((_BLOCK, ROW_UNIFORMS))
            self._block[aircraft] = block
        return self._normals[aircraft, row], self._uniforms[aircraft, row]


class CounterNoise:
    """The noise of one encounter of a Monte Carlo set, as the fast tier draws it.

    Parameters
    ----------
    seed : int
    intruders, encounter : int
        Which encounter.
    """

    def __init__(self, seed: int, intruders: int, encounter: int) -> None:
        self._key = (seed, intruders, encounter)

    def start(self, aircraft: int) -> tuple[float, FloatArray]:
        """See `BroadcastNoise`."""
        numbers = np.empty(kernels.START_NUMBERS)
        kernels.draw_start(*self._key, aircraft, numbers)
        return float(numbers[0]), numbers[1:]

    def row(self, aircraft: int, broadcast: int) -> tuple[FloatArray, FloatArray]:
        """See `BroadcastNoise`."""
        normals, uniforms = np.empty(kernels.NORMALS), np.empty(ROW_UNIFORMS)
        kernels.draw_broadcast(*self._key, aircraft, broadcast, normals, uniforms)
        return normals, uniforms
