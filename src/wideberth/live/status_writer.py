"""Shows a flight's status from a thread of its own: a stopped terminal or a full pipe must not stop the flight."""

import contextlib
import json
import os
import sys
import threading
from collections import deque
from typing import Any, Literal, TextIO

_WAITING_MAX = 60


class StatusWriter:
    """Writes statuses; a context manager.

    Parameters
    ----------
    how : {"json", "screen", "lines"}
        An object on each line, a few lines that are renewed in place, or a line where the state changes.
    stream : file, optional
        By default standard output for JSON, else standard error.

    Attributes
    ----------
    lost : int
        Statuses that nobody read in time.
    """

    def __init__(self, how: Literal["json", "screen", "lines"], stream: TextIO | None = None) -> None:
        self._how = how
        self._stream = stream if stream is not None else sys.stdout if how == "json" else sys.stderr
        self._waiting: deque[dict[str, Any]] = deque()
        self._changed = threading.Condition()
        self._ending = False
        self.lost = 0
        self._thread = threading.Thread(target=self._run, name="status", daemon=True)

    def __enter__(self) -> "StatusWriter":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._ending = True
            self._changed.notify()
        # Not for ever: whoever does not read is left behind.
        self._thread.join(timeout=2.0)

    @property
    def stuck(self) -> bool:
        """Whether it still waits for a reader after its end."""
        return self._ending and self._thread.is_alive()

    def show(self, status: dict[str, Any]) -> None:
        """Take a status to be written; returns at once."""
        with self._changed:
            self._waiting.append(status)
            if len(self._waiting) > _WAITING_MAX:
                self._waiting.popleft()
                self.lost += 1
            self._changed.notify()

    def _next(self) -> dict[str, Any] | None:
        with self._changed:
            while not self._waiting and not self._ending:
                self._changed.wait()
            return self._waiting.popleft() if self._waiting else None

    def _run(self) -> None:
        try:
            {"json": self._write_json, "screen": self._write_screen, "lines": self._write_lines}[self._how]()
        except (OSError, ValueError):
            # The reader has gone; the flight goes on.
            self._discard()
            while self._next() is not None:
                pass

    def _discard(self) -> None:
        """Let what is still buffered go nowhere, or the program's end would fail on it."""
        with contextlib.suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)

    def _write_json(self) -> None:
        while (status := self._next()) is not None:
            self._stream.write(json.dumps(status, allow_nan=False) + "\n")
            self._stream.flush()

    def _write_screen(self) -> None:
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        from wideberth.live.status import markup

        console = Console(file=self._stream, highlight=False)
        with Live(console=console, auto_refresh=False) as live:
            while (status := self._next()) is not None:
                for event in status["events"]:
                    live.console.print(f"{_clock(status['t'])} {event}", markup=False)
                live.update(Text.from_markup(markup(status)), refresh=True)

    def _write_lines(self) -> None:
        from rich.text import Text

        from wideberth.live.status import markup

        last = ""
        while (status := self._next()) is not None:
            for event in status["events"]:
                self._stream.write(f"{_clock(status['t'])} {event}\n")
            head = Text.from_markup(markup(status)).plain.splitlines()
            if f"{status['state']} {status['autopilot']['state']}" != last:
                last = f"{status['state']} {status['autopilot']['state']}"
                self._stream.write(f"{_clock(status['t'])} {head[0]} | {head[1]}\n")
            self._stream.flush()


def _clock(t: float) -> str:
    from datetime import UTC, datetime

    return datetime.fromtimestamp(t, UTC).strftime("%H:%M:%S")
