"""Counter-based noise: any number of a stream can be had at once, without those before it.

Philox 4x32-10 (Salmon, Moraes, Dror, Shaw: "Parallel random numbers: as easy as 1, 2, 3", 2011), keyed by the seed and
counted by (encounter set, encounter, consumer, block): results depend on nothing that runs beside them.
"""

import math

import numpy as np

from wideberth._jit import jit_uncounted

_MASK = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_SET = np.uint64(16)
_SCALE = 1.0 / 4294967296.0

PER_BLOCK = 4
"""Numbers that one block of the generator gives."""

# What a stream is for. Each aircraft has its own consumers: GEOMETRY is the encounter's.
GEOMETRY, START, NORMALS, UNIFORMS = 0, 1, 2, 3
CONSUMERS = 4


@jit_uncounted
def philox(
    c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64, k0: np.uint64, k1: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return four random words of 32 bits from a counter of four and a key of two such words."""
    for _ in range(10):
        p0 = _M0 * c0
        p1 = _M1 * c2
        c0, c1, c2, c3 = (p1 >> _HALF) ^ c1 ^ k0, p1 & _MASK, (p0 >> _HALF) ^ c3 ^ k1, p0 & _MASK
        k0 = (k0 + _W0) & _MASK
        k1 = (k1 + _W1) & _MASK
    return c0, c1, c2, c3


@jit_uncounted
def block_of(
    seed: int, intruders: int, encounter: int, consumer: int, block: int
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return one block of words of a stream."""
    key, number = np.uint64(seed), np.uint64(encounter)
    return philox(
        np.uint64(block) & _MASK,
        np.uint64(consumer) & _MASK,
        number & _MASK,
        ((np.uint64(intruders) << _SET) | (number >> _HALF)) & _MASK,
        key & _MASK,
        key >> _HALF,
    )


@jit_uncounted
def fill_uniforms(seed: int, intruders: int, encounter: int, consumer: int, first_block: int, out: np.ndarray) -> None:
    """Fill `out` (n,) with uniform numbers in (0, 1) of a stream, from a block on."""
    n = out.shape[0]
    for block in range((n + PER_BLOCK - 1) // PER_BLOCK):
        words = block_of(seed, intruders, encounter, consumer, first_block + block)
        for j in range(min(PER_BLOCK, n - PER_BLOCK * block)):
            out[PER_BLOCK * block + j] = (float(words[j]) + 0.5) * _SCALE


@jit_uncounted
def fill_normals(seed: int, intruders: int, encounter: int, consumer: int, first_block: int, out: np.ndarray) -> None:
    """Fill `out` (n,) with standard normal numbers of a stream, from a block on (Box and Muller)."""
    n = out.shape[0]
    for block in range((n + PER_BLOCK - 1) // PER_BLOCK):
        words = block_of(seed, intruders, encounter, consumer, first_block + block)
        for pair in range(2):
            j = PER_BLOCK * block + 2 * pair
            if j >= n:
                break
            radius = math.sqrt(-2.0 * math.log((float(words[2 * pair]) + 0.5) * _SCALE))
            angle = 2.0 * math.pi * (float(words[2 * pair + 1]) + 0.5) * _SCALE
            out[j] = radius * math.cos(angle)
            if j + 1 < n:
                out[j + 1] = radius * math.sin(angle)


@jit_uncounted
def aircraft_consumer(aircraft: int, purpose: int) -> int:
    """Return the number of an aircraft's stream; `purpose` is `START`, `NORMALS` or `UNIFORMS`."""
    return CONSUMERS * (aircraft + 1) + purpose


def warmup() -> None:
    """Compile every kernel of this module for the types it is used with."""
    out = np.empty(6)
    word = np.uint64(1)
    philox(word, word, word, word, word, word)
    fill_uniforms(1, 1, 1, 1, 0, out)
    fill_normals(1, 1, 1, 1, 0, out)
    aircraft_consumer(0, START)
    block_of(1, 1, 1, 1, 1)
