"""MAVLink frames in a stream of bytes: found, checked, signed, counted."""

import hashlib
from collections import Counter
from typing import Any

from wideberth.links.mavlink.dialect import mavlink

_SIGNING_EPOCH = 1420070400.0  # 2015-01-01 in Unix seconds; signatures count 10 us from then
_REJECTS = ("not a frame", "unknown message", "signature refused", "lost", "repeated", "out of order")
_MARKERS = (mavlink.PROTOCOL_MARKER_V1, mavlink.PROTOCOL_MARKER_V2)


def signing_key(text: str) -> bytes:
    """Return the 32 bytes of a key: 64 hexadecimal digits, or the SHA-256 of a pass phrase."""
    if len(text) == 64:
        try:
            return bytes.fromhex(text)
        except ValueError:
            pass
    return hashlib.sha256(text.encode()).digest()


class Wire:
    """One end of a link: bytes in, messages out, and the other way round.

    A wrong frame costs only itself: the next is looked for from its second byte on.

    Parameters
    ----------
    system, component : int
        Who sends.
    key : bytes, optional
        Of 32 bytes: frames are signed, and unsigned or wrongly signed ones refused.
    link_id : int
        Of the signature.
    allow_unsigned : bool
    """

    def __init__(
        self, system: int, component: int, key: bytes | None = None, link_id: int = 0, *, allow_unsigned: bool = False
    ) -> None:
        self.system = system
        self._codec = mavlink.MAVLink(None, system, component)
        signing = self._codec.signing
        signing.secret_key, signing.link_id, signing.sign_outgoing = key, link_id, key is not None
        signing.allow_unsigned_callback = lambda _codec, _id: allow_unsigned
        self._rest = b""
        self._out: list[bytes] = []
        self._last: dict[tuple[int, int], int] = {}
        self.counts: Counter[str] = Counter()

    @property
    def rejects(self) -> dict[str, int]:
        """What was not taken as it came, of the counts."""
        return {name: self.counts[name] for name in _REJECTS if self.counts[name]}

    def receive(self, data: bytes, t: float) -> list[Any]:
        """Return the messages that more bytes complete; `t` (Unix s) ages signatures."""
        self._stamp(t)
        buffer = self._rest + data
        messages: list[Any] = []
        at, waiting = 0, -1
        while True:
            start = _next_marker(buffer, at)
            if start < 0:
                at = len(buffer)
                break
            length = _frame_length(buffer, start)
            if length < 0 or start + length > len(buffer):
                # Not complete, or garbage that only looks like the begin of a frame: a later whole frame decides.
                if waiting < 0:
                    waiting = start
                at = start + 1
                continue
            message = self._decode(buffer[start : start + length])
            if message is None:
                at = start + 1
                continue
            messages.append(message)
            at, waiting = start + length, -1
            self._count_lost(message)
        # Never longer than a frame: only what is too short for one waits.
        self._rest = buffer[waiting:] if waiting >= 0 else buffer[at:]
        self.counts["bytes"] += len(data)
        return messages

    def send(self, message: Any, t: float) -> None:
        """Queue a message; what does not fit its fields is refused and counted."""
        self._stamp(t)
        try:
            frame = message.pack(self._codec)
        except Exception:  # struct.error, and what pymavlink makes of wrong types
            self.counts["could not be packed"] += 1
            return
        self._codec.seq = (self._codec.seq + 1) % 256
        self._out.append(bytes(frame))
        self.counts["sent"] += 1

    def take(self) -> bytes:
        """Return and forget all bytes queued."""
        data = b"".join(self._out)
        self._out.clear()
        return data

    def _stamp(self, t: float) -> None:
        signing = self._codec.signing
        if signing.secret_key is not None:
            signing.timestamp = max(signing.timestamp, int(max(t - _SIGNING_EPOCH, 0.0) * 1e5))

    def _decode(self, frame: bytes) -> Any | None:
        signing = self._codec.signing
        unsigned = signing.reject_count + signing.badsig_count
        try:
            message = self._codec.decode(bytearray(frame))
        except Exception:  # MAVError for a wrong checksum; hostile fields raise others
            refused = signing.reject_count + signing.badsig_count > unsigned
            self.counts["signature refused" if refused else "not a frame"] += 1
            return None
        if message.get_type().startswith("UNKNOWN"):
            self.counts["unknown message"] += 1
            return None
        self.counts["messages"] += 1
        return message

    def _count_lost(self, message: Any) -> None:
        source = (message.get_srcSystem(), message.get_srcComponent())
        last, now = self._last.get(source), message.get_seq()
        if last is not None:
            ahead = (now - last) % 256
            if ahead == 0:
                self.counts["repeated"] += 1
                return
            if ahead >= 128:
                self.counts["out of order"] += 1
                return
            self.counts["lost"] += ahead - 1
        if len(self._last) < 512 or source in self._last:
            self._last[source] = now


def split_frames(data: bytes) -> list[bytes]:
    """Return the frames of bytes that consist of whole frames, as `Wire.take` gives them; the rest is left out."""
    found, at = [], 0
    while at < len(data) and data[at] in _MARKERS:
        length = _frame_length(data, at)
        if length < 0 or at + length > len(data):
            break
        found.append(data[at : at + length])
        at += length
    return found


def _next_marker(buffer: bytes, at: int) -> int:
    found = [k for marker in _MARKERS if (k := buffer.find(marker, at)) >= 0]
    return min(found, default=-1)


def _frame_length(buffer: bytes, start: int) -> int:
    """Return the length of the frame that begins at `start`, -1 where too little of it is there to tell."""
    if len(buffer) < start + 3:
        return -1
    payload, flags = buffer[start + 1], buffer[start + 2]
    if buffer[start] == mavlink.PROTOCOL_MARKER_V1:
        return int(mavlink.HEADER_LEN_V1) + payload + 2
    signature = mavlink.MAVLINK_SIGNATURE_BLOCK_LEN if flags & mavlink.MAVLINK_IFLAG_SIGNED else 0
    return int(mavlink.HEADER_LEN_V2) + payload + 2 + int(signature)
