"""Bytes of a file or of standard input, unpacked on the way where they are gzip."""

import sys
import zlib
from pathlib import Path
from typing import BinaryIO

from wideberth.errors import InputError

_GZIP = b"\x1f\x8b"
_PIECE = 1 << 18
_STEP = 512  # bytes unpacked at once: what a damaged step would have given is lost


class ByteInput:
    """A file or standard input (`-`), read in pieces.

    Parameters
    ----------
    name : str
        Path of a file, or ``"-"``.

    Raises
    ------
    InputError
        If the file is missing or cannot be opened.

    Attributes
    ----------
    damage : str
        What broke the stream off, in words, empty if nothing did; what was read up to there has been given out.
    """

    def __init__(self, name: str) -> None:
        self.damage = ""
        self._stream: BinaryIO
        self._owned = name != "-"
        if name == "-":
            self._stream = sys.stdin.buffer
        else:
            path = Path(name)
            if path.is_dir():
                raise InputError(f"traffic '{name}' is a folder: give a file")
            try:
                self._stream = path.open("rb")
            except FileNotFoundError:
                raise InputError(f"traffic file '{name}' does not exist") from None
            except (OSError, ValueError) as error:
                raise InputError(f"traffic file '{name}' cannot be opened: {error}") from None
        self._first = self._piece()
        self._gzip = zlib.decompressobj(wbits=31) if self._first.startswith(_GZIP) else None

    def read(self) -> bytes:
        """Return the next piece; empty at the end."""
        while True:
            data, self._first = self._first or self._piece(), b""
            if self._gzip is None:
                return data
            unpacked = self._unpack(data)
            if unpacked or not data or self.damage:
                return unpacked

    def _piece(self) -> bytes:
        if self.damage:
            return b""
        try:
            # One read of what is there: a pipe must not wait until a whole piece is full.
            return self._stream.read1(_PIECE)  # type: ignore[attr-defined,no-any-return]
        except OSError as error:
            self.damage = f"cannot be read on ({error})"
            return b""

    def _unpack(self, data: bytes) -> bytes:
        assert self._gzip is not None
        if not data:
            if not self._gzip.eof and not self.damage:
                self.damage = "truncated gzip"
            return b""
        unpacked = bytearray()
        try:
            for start in range(0, len(data), _STEP):
                packed = data[start : start + _STEP]
                while packed:
                    if self._gzip.eof:
                        if not packed.strip(b"\0"):
                            break
                        self._gzip = zlib.decompressobj(wbits=31)
                    unpacked += self._gzip.decompress(packed)
                    packed = self._gzip.unused_data
        except zlib.error:
            self.damage = "damaged gzip"
        return bytes(unpacked)

    def close(self) -> None:
        """Close the file (standard input stays open)."""
        if self._owned:
            self._stream.close()
