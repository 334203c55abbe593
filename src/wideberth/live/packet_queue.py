"""Between a socket and its reader: a queue that is never longer than it may be, and what has arrived lately."""

import math
from collections import deque
from collections.abc import Callable

PACKETS_MAX = 1024
BYTES_MAX = 1 << 20
RATE_WINDOW = 10.0
"""Over which rates are counted, s."""


class PacketQueue:
    """Packets with their times of arrival; the oldest are dropped where nobody takes them fast enough.

    Parameters
    ----------
    packets_max, bytes_max : int
        What it holds at most.

    Attributes
    ----------
    dropped : int
        Packets that were dropped.
    on_arrival : callable or None
        Called after each packet.
    """

    def __init__(self, packets_max: int = PACKETS_MAX, bytes_max: int = BYTES_MAX) -> None:
        self._limits = packets_max, bytes_max
        self._packets: deque[tuple[float, bytes]] = deque()
        self._bytes = 0
        self.dropped = 0
        self.on_arrival: Callable[[], None] | None = None

    def __len__(self) -> int:
        return len(self._packets)

    def put(self, t: float, data: bytes) -> None:
        """Add a packet that arrived at time `t`, s; without bytes: the connection broke there."""
        self._packets.append((t, data))
        self._bytes += len(data)
        while len(self._packets) > self._limits[0] or (self._bytes > self._limits[1] and len(self._packets) > 1):
            self._bytes -= len(self._packets.popleft()[1])
            self.dropped += 1
        if self.on_arrival is not None:
            self.on_arrival()

    def take(self) -> tuple[float, bytes] | None:
        """Return the oldest packet and forget it; None where there is none."""
        if not self._packets:
            return None
        packet = self._packets.popleft()
        self._bytes -= len(packet[1])
        return packet


class Arrivals:
    """When something last arrived, and how often lately.

    Attributes
    ----------
    count : int
        Since the start.
    """

    def __init__(self) -> None:
        self._recent: deque[tuple[float, int]] = deque()
        self._last = -math.inf
        self.count = 0

    def note(self, t: float, count: int = 1) -> None:
        """Take note of arrivals at time `t`, s."""
        self._last = max(self._last, t)
        self.count += count
        # By tenths of seconds, so that a flood takes no memory.
        if self._recent and t - self._recent[-1][0] < 0.1:
            self._recent[-1] = (self._recent[-1][0], self._recent[-1][1] + count)
        else:
            self._recent.append((t, count))
            while self._recent[0][0] < t - RATE_WINDOW:
                self._recent.popleft()

    def age(self, t: float) -> float:
        """Return the time since the last, s; infinite if nothing ever came."""
        return max(t - self._last, 0.0)

    def rate(self, t: float) -> float:
        """Return how many came a second over the last `RATE_WINDOW` seconds."""
        while self._recent and self._recent[0][0] < t - RATE_WINDOW:
            self._recent.popleft()
        return sum(count for _, count in self._recent) / RATE_WINDOW
