"""Text logs of Stratux: a nanosecond counter in front of each line, and START lines that say when it was zero."""

import re
from datetime import datetime


class StratuxLog:
    """The clock of a log: the time of the last START line plus the counter of a line."""

    def __init__(self) -> None:
        self._start = 0.0

    def begin(self, line: str) -> bool:
        """Take the time of a START line; return whether it could be read."""
        try:
            stamp = re.sub(r"\s+UTC\b", "", line.split(",", 1)[1])
            self._start = datetime.strptime(stamp, "%a %b %d %H:%M:%S %z %Y").timestamp()
        except (IndexError, ValueError, OverflowError):
            return False
        return True

    def time(self, text: str) -> float | None:
        """Return the time, s, that the first field of a line stands for; None where it is no counter."""
        return self._start + int(text) * 1e-9 if text.isdecimal() and len(text) < 25 else None
