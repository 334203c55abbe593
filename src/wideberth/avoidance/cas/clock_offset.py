"""By how much another vehicle's clock is ahead of ours, from the times of messages."""

from collections import deque

_WINDOW = 30  # messages
_BORNE_OUT = 3  # early messages after which the clock is taken to have been set anew


class ClockOffset:
    """Compares two clocks by the least transit times of the last messages.

    A message that seems to come from the future shows a clock that is ahead. One that seems old may as well be late:
    only with messages both ways (an echo) are delay and offset told apart, where the quickest ways there and back are
    taken to last equally long. Without an echo a slow clock looks like a delay.

    Parameters
    ----------
    tolerance : float
        A message may come so much earlier than any before, s.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self._down: deque[float] = deque(maxlen=_WINDOW)
        self._up: deque[float] = deque(maxlen=_WINDOW)
        self._early = 0

    def take(self, arrived: float, sent: float, echo_time: float | None, echo_received: float | None) -> bool:
        """Take the times of one message; False where it comes from the future, and others do not bear that out yet.

        Parameters
        ----------
        arrived : float
            By our clock, s.
        sent : float
            By the other's.
        echo_time, echo_received : float or None
            When we sent the newest message it has, by our clock, and when that reached it, by its clock.
        """
        transit = arrived - sent
        if transit < min((0.0, *self._down)) - self._tolerance:  # the very first may be wrong as well
            self._early += 1
            if self._early < _BORNE_OUT:
                return False
            self._down.clear()
            self._up.clear()
        self._early = 0
        self._down.append(transit)
        if echo_time is not None and echo_received is not None:
            self._up.append(echo_received - echo_time)
        return True

    @property
    def value(self) -> float:
        """By how much the other's clock is ahead, s; 0 where nothing shows a difference."""
        if not self._down:
            return 0.0
        if self._up:
            return 0.5 * (min(self._up) - min(self._down))
        return max(-min(self._down), 0.0)
