"""A note on disk of a maneuver being flown, so that the program after a killed one gives control back."""

import os
import zlib
from pathlib import Path

from wideberth.errors import InputError


def state_folder() -> Path:
    """Return the folder of what outlives a program: ``XDG_STATE_HOME``, else ``~/.local/state``, and `wideberth`."""
    given = os.environ.get("XDG_STATE_HOME")
    return (Path(given) if given else Path.home() / ".local" / "state") / "wideberth"


class HandOverNote:
    """The note of one autopilot's link.

    Parameters
    ----------
    connection : str
        The link; another one has another note.
    folder : Path, optional
        By default `state_folder`.

    Attributes
    ----------
    path : Path
    """

    def __init__(self, connection: str, folder: Path | None = None) -> None:
        name = f"hand_over_{zlib.crc32(connection.encode()):08x}.json"
        self.path = (folder if folder is not None else state_folder()) / name
        self._kept: str | None = None
        self._failed = False

    def left(self) -> str | None:
        """Return what a program before this one has left; None: it had given back control.

        Raises
        ------
        InputError
            If there is a note that cannot be read.
        """
        try:
            self._kept = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            self._kept = None
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self.path}: cannot be read: {error}") from error
        return self._kept

    def keep(self, text: str | None) -> str:
        """Write the note where it has changed, or remove it; return in words what went wrong, once.

        A crash of the program leaves the old note or the new one, never half of one.
        """
        if text == self._kept:
            return ""
        try:
            if text is None:
                self.path.unlink(missing_ok=True)
            else:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                new = self.path.with_suffix(".new")
                new.write_text(text, encoding="utf-8")
                new.replace(self.path)
        except OSError as error:
            told = self._failed
            self._failed = True
            return "" if told else f"{self.path}: not kept for a program after this one: {error.strerror}"
        self._kept = text
        return ""
