"""Telemetry logs (tlog), as ground stations write them: each frame after its time."""

import struct


def tlog_record(frame: bytes, t: float) -> bytes:
    """Return the record of a frame: eight bytes of Unix time in microseconds, most significant first, and the frame."""
    return struct.pack(">Q", max(round(t * 1e6), 0)) + frame
