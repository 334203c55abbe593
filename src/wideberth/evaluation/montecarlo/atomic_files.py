"""Files that appear in one piece or not at all, whenever the process ends and however full the disk is."""

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from wideberth.errors import InputError

_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)


@contextlib.contextmanager
def replacing(path: Path, advice: str = "") -> Iterator[BinaryIO]:
    """Give a file to write, which becomes `path` in one step once it is on the disk, or leaves nothing.

    Parameters
    ----------
    path : Path
    advice : str
        What to do if it cannot be written.

    Raises
    ------
    InputError
        If it cannot be written, because the disk is full for one.
    """
    try:
        with _temporary_file(path) as (temporary, file):
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        raise cannot_write(path, error, advice) from error


def create(path: Path, content: bytes) -> bool:
    """Write a file where there is none; return False, and write nothing, where there is one.

    Of several processes that try at once one succeeds, and the others see its whole content.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        with _temporary_file(path) as (temporary, file):
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
            # A link, unlike a rename, fails where the name is taken.
            try:
                os.link(temporary, path)
            except OSError as error:
                if error.errno not in _NO_LINKS:
                    raise
                with path.open("xb") as direct:  # the next best: a reader may come a moment too early
                    direct.write(content)
        _sync_folder(path.parent)
    except FileExistsError:
        return False
    except OSError as error:
        raise cannot_write(path, error) from error
    return True


def is_temporary(name: str) -> bool:
    """Return whether a file name is that of a file still being written, or left by a killed process."""
    return name.startswith(".") and name.endswith(".tmp")


def left_over(folder: Path) -> dict[str, list[Path]]:
    """Return the temporary files in a folder by the name of the file that each was to become."""
    paths: dict[str, list[Path]] = {}
    for name in os.listdir(folder):
        if is_temporary(name):
            target = name.removeprefix(".").removesuffix(".tmp").rpartition(".")[0]
            paths.setdefault(target, []).append(folder / name)
    return paths


def cannot_write(path: Path, error: OSError, advice: str = "") -> InputError:
    """Return the one line for a file that cannot be written."""
    reason = error.strerror or (str(error).splitlines() or [type(error).__name__])[0]
    return InputError(f"{path}: cannot be written: {reason}" + (f"; {advice}" if advice else ""))


@contextlib.contextmanager
def _temporary_file(path: Path) -> Iterator[tuple[Path, BinaryIO]]:
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        with temporary.open("xb") as file:
            yield temporary, file
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _sync_folder(path: Path) -> None:
    """See that a new name is on the disk too, where the system has a way to."""
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
