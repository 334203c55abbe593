"""The one place that decides how kernels are compiled and where the results are cached.

Numba's own cache notices an edit of the file that holds a kernel, but not of a kernel it imports, and then
returns stale machine code. The cache folder is therefore keyed by a hash of every kernel source in the package.
"""

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core.options import DefaultOptions

P = ParamSpec("P")
R = TypeVar("R")

_PACKAGE = Path(__file__).resolve().parent
_KEPT_DAYS = 30.0
_HASH = re.compile(r"[0-9a-f]{16}")


def source_hash(package: Path = _PACKAGE) -> str:
    """Return a short hash over the sources of all kernels (``_jit.py`` and every ``*kernels.py``)."""
    digest = hashlib.sha256()
    for path in sorted([*package.rglob("*kernels.py"), package / "_jit.py"]):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_base() -> Path:
    """Return the folder of all caches: ``WIDEBERTH_CACHE_DIR``, else one in the user's cache folder."""
    given = os.environ.get("WIDEBERTH_CACHE_DIR")
    if given:
        return Path(given)
    cache = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return Path(cache or Path(os.path.expanduser("~")) / ".cache") / "wideberth"


def cache_directory() -> Path:
    """Return the folder for compiled kernels, creating it; a private temporary one where the home is not writable."""
    try:
        return _ready(cache_base() / source_hash())
    except OSError:
        return _ready(_private_temporary_folder() / source_hash())


def _ready(folder: Path) -> Path:
    known = folder.is_dir()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass  # it can be written
    os.utime(folder)
    if not known:
        _prune(folder.parent)
    return folder


def _prune(base: Path) -> None:
    """Remove the caches of sources that nobody has used for long."""
    oldest = time.time() - _KEPT_DAYS * 86400.0
    for folder in base.iterdir():
        with contextlib.suppress(OSError):
            if _HASH.fullmatch(folder.name) and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _private_temporary_folder() -> Path:
    # Numba loads code from this folder: it must not be one that somebody else has put there.
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"wideberth-{user}"
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if not folder.is_symlink() and status.st_uid == user and not status.st_mode & 0o022:
            return folder
    return Path(tempfile.mkdtemp(prefix="wideberth-"))


CACHE_DIRECTORY = cache_directory()


@contextlib.contextmanager
def _our_cache() -> Iterator[None]:
    # Numba asks for the folder when a function is decorated; the setting is put back, as it is the whole process's.
    settings = vars(numba.config)
    before = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(CACHE_DIRECTORY)
    try:
        yield
    finally:
        settings["CACHE_DIR"] = before


_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
# Options that numba keeps for itself: where they have gone, kernels are only slower.
_COUNTED: dict[str, Any] = {"_nrt": True} if hasattr(DefaultOptions, "_nrt") else {}
_UNCOUNTED: dict[str, Any] = {"_nrt": False} if _COUNTED else {}
if hasattr(DefaultOptions, "forceinline"):
    _COUNTED["forceinline"], _UNCOUNTED["forceinline"] = False, True


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel: cached, without the interpreter lock, IEEE division (no exception on x / 0)."""
    # The options are spelled out: else a kernel takes them from the first one that calls it.
    return _compiled(function, _COUNTED)


def jit_uncounted(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel that neither makes nor copies arrays: it becomes a part of the kernels that call it.

    For kernels called at every step. An array is passed on as seven numbers and more, a tuple of arrays as hundreds,
    through memory at every call: where calls are many that is most of the time, so they are inlined. References are
    not counted either, which is two atomic operations wherever an array is passed on, sliced or taken out of a tuple.
    Who calls from Python or from a kernel by `jit` holds the arrays; numba refuses to compile what makes one here (also
    the assignment of one array to a slice of another).
    """
    return _compiled(function, _UNCOUNTED)


def jit_parallel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose outer loop runs in parallel over independent items (use `numba.prange`)."""
    return _compiled(function, {**_COUNTED, "parallel": True})


def _compiled(function: Callable[P, R], options: dict[str, Any]) -> Callable[P, R]:
    with _our_cache():
        kernel: Callable[P, R] = numba.njit(**_OPTIONS, **options)(function)
    return kernel
