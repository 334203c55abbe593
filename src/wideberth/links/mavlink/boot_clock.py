"""When things were true: an autopilot's time since boot, put onto our time."""

from collections import deque

_KEPT_S = 60.0  # how long an answer to TIMESYNC counts
_ROUND_TRIP_MAX = 2.0  # s
_CLOSE = 0.05  # s that two offsets may differ beyond their round trips
_BACK = 3.0  # s that a message may be older than one before it; more is another clock
_AHEAD = 0.25  # s that a message may come before it was sent by our offset
_AGREEING = 3  # messages that must agree that the clock has jumped
_ENVELOPE_S = 15.0


class BootClock:
    """The offset between an autopilot's time since boot and our time.

    From TIMESYNC where it is answered (the answer with the shortest round trip counts), else from the fastest messages
    of the last half minute. A time is never later than its receipt.

    Attributes
    ----------
    jump : float
        By how much the offset last jumped, s; read and reset by the owner.
    rebooted : bool
        Whether the time since boot has begun anew; read and reset by the owner.
    """

    def __init__(self) -> None:
        self.jump = 0.0
        self.rebooted = False
        self._answers: deque[tuple[float, float, float]] = deque(maxlen=20)
        self._contradictions = 0
        self._latest = -1.0
        self._behind = self._early = 0
        self._envelope: list[tuple[float, float]] = []

    @property
    def in_doubt(self) -> bool:
        """Whether the offset is not sure, so that it should be asked for sooner."""
        return len(self._answers) < 4 or self._contradictions > 0 or self._early > 0

    def answer(self, theirs: float, ours: float, t: float) -> None:
        """Take an answer to TIMESYNC: their time, our time when it was asked for, and now; s."""
        trip = t - ours
        if not 0.0 <= trip <= _ROUND_TRIP_MAX:
            return
        offset = 0.5 * (ours + t) - theirs
        best = self._best(t)
        if best is not None and abs(offset - best[0]) > 0.5 * (trip + best[1]) + _CLOSE:
            self._contradictions += 1
            if self._contradictions < 2:
                return
            self.jump = offset - best[0]
            self._answers.clear()
            self._envelope.clear()
        self._contradictions = 0
        self._answers.append((t, offset, trip))

    def is_late(self, boot: float) -> bool:
        """Return whether a message of time `boot` (s since boot) is older than one that came before it.

        A clock that has begun anew or stepped back is told by several such messages in a row.
        """
        if boot >= self._latest:
            self._latest, self._behind = boot, 0
            return False
        if self._latest - boot < _BACK:
            return True
        self._behind += 1
        if self._behind < _AGREEING:
            return True
        self.rebooted = boot < 60.0 or boot < 0.5 * self._latest
        self._restart(boot)
        return False

    def time_of(self, boot: float, t: float) -> float:
        """Return when (our time, s) a message of time `boot` that came at `t` was true."""
        seen = t - boot
        if self._envelope and self._envelope[-1][0] > t - _ENVELOPE_S:
            start, least = self._envelope[-1]
            self._envelope[-1] = (start, min(least, seen))
        else:
            self._envelope = [*self._envelope[-1:], (t, seen)]
        best = self._best(t)
        offset = min(least for _, least in self._envelope) if best is None else best[0]
        if seen < offset - _AHEAD:
            # It came before it was sent: their clock has jumped ahead, or ours back.
            self._early += 1
            if self._early >= _AGREEING:
                self.jump = seen - offset
                self._answers.clear()
                self._envelope = [(t, seen)]
                self._early = 0
                offset = seen
        else:
            self._early = 0
        return min(boot + offset, t)

    def _best(self, t: float) -> tuple[float, float] | None:
        """Return the offset with the shortest round trip, and that."""
        fresh = [(trip, offset) for when, offset, trip in self._answers if abs(t - when) < _KEPT_S]
        if not fresh:
            return None
        trip, offset = min(fresh)
        return offset, trip

    def _restart(self, boot: float) -> None:
        self._latest, self._behind, self._early = boot, 0, 0
        self._answers.clear()
        self._envelope.clear()
        self._contradictions = 0
