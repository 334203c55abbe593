"""Commands that are sent until they are answered."""

from collections.abc import Callable
from typing import Any

from wideberth.links.mavlink.dialect import mavlink

_WORDS = {
    mavlink.MAV_RESULT_ACCEPTED: "accepted",
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "temporarily rejected",
    mavlink.MAV_RESULT_DENIED: "denied",
    mavlink.MAV_RESULT_UNSUPPORTED: "unsupported",
    mavlink.MAV_RESULT_FAILED: "failed",
}
_PROGRESS_S = 5.0  # how long a command in progress may take

Send = Callable[[Any], None]
Result = Callable[[int | None, float], None]


def result_in_words(result: int | None) -> str:
    """Return a MAV_RESULT in words; None means that no answer came."""
    return "not answered" if result is None else _WORDS.get(result, f"answered by {result}")


class Commands:
    """Sends commands, repeats them until they are acknowledged, and tells how it went.

    Parameters
    ----------
    send : callable
        Takes a message.
    retry : float
        s between repetitions.
    retries : int
    """

    def __init__(self, send: Send, retry: float, retries: int) -> None:
        self._send, self._retry, self._retries = send, retry, retries
        self._waiting: dict[int, tuple[Callable[[int], Any], Result, float, int]] = {}

    def __contains__(self, command: int) -> bool:
        return command in self._waiting

    def request(self, command: int, make: Callable[[int], Any], t: float, on_result: Result) -> None:
        """Send a command until it is answered; one before it with the same number is given up.

        Parameters
        ----------
        command : int
            MAV_CMD.
        make : callable
            Makes the message from the number of the repetition.
        t : float
            Now, s.
        on_result : callable
            Told the MAV_RESULT (None: never answered) and the time.
        """
        self._waiting[command] = (make, on_result, t + self._retry, 1)
        self._send(make(0))

    def take(self, ack: Any, t: float) -> None:
        """Take a COMMAND_ACK."""
        if ack.command not in self._waiting:
            return
        if ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            make, on_result, _, tries = self._waiting[ack.command]
            self._waiting[ack.command] = (make, on_result, t + _PROGRESS_S, tries)
            return
        self._waiting.pop(ack.command)[1](ack.result, t)

    def step(self, t: float) -> None:
        """Repeat what is not answered, and give up what was repeated often enough."""
        for command, (make, on_result, due, tries) in list(self._waiting.items()):
            if t < due:
                continue
            if tries > self._retries:
                del self._waiting[command]
                on_result(None, t)
                continue
            self._waiting[command] = (make, on_result, t + self._retry, tries + 1)
            self._send(make(tries))

    def drop(self, command: int | None = None) -> None:
        """Forget a command, or all."""
        if command is None:
            self._waiting.clear()
        else:
            self._waiting.pop(command, None)
