"""Framing of GDL90: flags around each message, flags and escapes inside stuffed, a CRC at its end.

Source: Garmin 560-1058-00, 2.2 (framing, CRC-CCITT sent least byte first).
"""

import binascii
from collections import Counter

FLAG, ESCAPE, FLIP = 0x7E, 0x7D, 0x20
_FLAG = bytes([FLAG])
_LONGEST = 2048
"""Bytes between two flags beyond which it is no message (the longest there is has 436)."""


def crc(message: bytes) -> int:
    """Return the 16-bit check of a message (2.2.3)."""
    # The document's loop takes each byte in behind the register: the last two bytes are not yet shifted through it.
    padded = b"\0\0" + message
    return binascii.crc_hqx(padded[:-2], 0) ^ int.from_bytes(padded[-2:], "big")


def frame(message: bytes) -> bytes:
    """Return a message (its number first) with its check, stuffed, between flags."""
    checked = message + crc(message).to_bytes(2, "little")
    stuffed = bytearray()
    for byte in checked:
        stuffed += bytes([ESCAPE, byte ^ FLIP]) if byte in (FLAG, ESCAPE) else bytes([byte])
    return _FLAG + bytes(stuffed) + _FLAG


def coverage(data: bytes) -> float:
    """Return which part of some bytes reads as messages of GDL90, for telling formats apart."""
    read = Deframer(Counter()).feed(data)
    return sum(len(frame(message)) for message in read) / len(data) if data else 0.0


class Deframer:
    """Finds the messages in a stream of bytes, cut anywhere.

    Parameters
    ----------
    rejects : Counter
        Where what is not a message is counted, by cause.
    """

    def __init__(self, rejects: Counter[str]) -> None:
        self._rejects = rejects
        self._rest = b""
        self._inside = False

    def feed(self, data: bytes) -> list[bytes]:
        """Return the messages, without their checks, that more bytes complete."""
        pieces = (self._rest + data).split(_FLAG)
        self._rest = pieces.pop()
        messages = []
        for piece in pieces:
            if not self._inside:
                if piece:
                    self._rejects["bytes outside of a message"] += 1
                self._inside = True
            elif piece:
                message = self._message(piece)
                if message is not None:
                    messages.append(message)
        if len(self._rest) > _LONGEST:
            self._rejects["message too long"] += 1
            self._rest, self._inside = b"", False
        return messages

    def restart(self) -> None:
        """Forget the part of a message that a broken connection left."""
        if self._rest:
            self._rejects["message cut by the end"] += 1
        self._rest, self._inside = b"", False

    def _message(self, piece: bytes) -> bytes | None:
        parts = piece.split(bytes([ESCAPE]))
        if any(not part for part in parts[1:]):
            self._rejects["escape without a byte"] += 1
            return None
        plain = parts[0] + b"".join(bytes([part[0] ^ FLIP]) + part[1:] for part in parts[1:])
        if len(plain) < 3:
            self._rejects["message too short"] += 1
            return None
        if crc(plain[:-2]) != int.from_bytes(plain[-2:], "little"):
            self._rejects["crc failed"] += 1
            return None
        return plain[:-2]
