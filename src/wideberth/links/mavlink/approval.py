"""A human's word before a maneuver is flown."""

from collections.abc import Callable

from wideberth.links.mavlink.config import MavlinkConfig


class Approval:
    """Asks for approval, once for each encounter.

    An encounter lasts until no maneuver is wanted any more; a changed maneuver needs no further word.

    Parameters
    ----------
    config : MavlinkConfig
    say : callable
        Takes a text for the ground station.
    """

    def __init__(self, config: MavlinkConfig, say: Callable[[str], None]) -> None:
        self._config, self._say = config, say
        self._asked: float | None = None
        self._answer: bool | None = None

    @property
    def is_open(self) -> bool:
        """Whether an answer is awaited."""
        return self._asked is not None and self._answer is None

    def reset(self) -> None:
        """The encounter is over."""
        self._asked = self._answer = None

    def answer(self, yes: bool) -> bool:
        """Take a human's answer; return whether one was awaited."""
        if self._asked is None:
            return False
        self._answer = yes
        return True

    def given(self, t: float, reason: str) -> bool:
        """Return whether a maneuver may be flown; ask if that is not decided."""
        if self._config.approval == "none":
            return True
        if self._asked is None:
            self._asked = t
            self._say(f"approve within {self._config.approval_window_s:.0f} s: {reason}")
        if self._answer is None and t - self._asked >= self._config.approval_window_s:
            self._answer = self._config.unanswered == "fly"
            self._say(f"no answer: the maneuver is {'flown' if self._answer else 'not flown'}")
        return self._answer is True
