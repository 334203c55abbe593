"""The 24-bit parity of Mode S frames, for many frames at once (ICAO Annex 10 Volume IV, 3.1.2.3.3)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

GENERATOR = 0x1FFF409
SHORT_BYTES, LONG_BYTES = 7, 14


def _contributions() -> NDArray[np.uint32]:
    """Return the remainder (position, byte value) that a byte leaves, positions counted from the end of the frame."""
    table = np.zeros((LONG_BYTES, 256), np.uint32)
    table[:3] = np.arange(256, dtype=np.uint32)[None, :] << np.array([0, 8, 16], np.uint32)[:, None]
    for position in range(3, LONG_BYTES):
        for value in range(256):
            remainder = int(table[position - 1, value])
            for _ in range(8):
                remainder <<= 1
                if remainder & 0x1000000:
                    remainder ^= GENERATOR
            table[position, value] = remainder
    return table


_CONTRIBUTIONS = _contributions()


def syndromes(frames: Sequence[bytes]) -> list[int]:
    """Return the parity syndrome of each frame.

    Parameters
    ----------
    frames : sequence of bytes
        Frames of 7 or 14 bytes, their parity field included.

    Returns
    -------
    list of int
        0 for an undamaged DF17/18; the interrogator code for DF11; the aircraft's address where the address is
        overlaid on the parity (DF0, 4, 5, 16, 20, 21).

    Raises
    ------
    ValueError
        If a frame is neither 7 nor 14 bytes long.
    """
    result = np.zeros(len(frames), np.uint32)
    for size in (SHORT_BYTES, LONG_BYTES):
        rows = [k for k, frame in enumerate(frames) if len(frame) == size]
        if not rows:
            continue
        data = np.frombuffer(b"".join([frames[k] for k in rows]), np.uint8).reshape(-1, size)
        positions = np.arange(size - 1, -1, -1)
        result[rows] = np.bitwise_xor.reduce(_CONTRIBUTIONS[positions, data], axis=1)
    for frame in frames:
        if len(frame) not in (SHORT_BYTES, LONG_BYTES):
            raise ValueError(f"a Mode S frame has 7 or 14 bytes, not {len(frame)}")
    values: list[int] = result.tolist()
    return values
