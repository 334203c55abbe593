"""The one place that decides how kernels are compiled and where the results are cached.

Numba's own cache notices an edit of the file that holds a kernel, but not of a kernel it imports, and then
returns stale machine code. Each module of kernels is therefore kept in a folder named by a hash of its source and of
all that it imports from the package: an edit compiles anew what rests on it, and nothing else.
"""

import contextlib
import functools
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
# Imports by full name, the only ones there are among kernels (the linter sees to that).
_IMPORT = re.compile(r"^\s*(?:from|import)\s+([\w.]+)(?:\s+import\s+(\([^)]*\)|[^\n]*))?", re.MULTILINE)
_NAME = re.compile(r"\w+")


def source_hash(source: Path, package: Path = _PACKAGE) -> str:
    """Return a short hash over a module of kernels, ``_jit.py`` and all modules of the package that it rests on."""
    found: set[Path] = set()
    waiting = [source, package / "_jit.py"]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _read(path, package)[1]
    digest = hashlib.sha256()
    for path in sorted(found):
        digest.update(path.name.encode())
        digest.update(_read(path, package)[0])
    return digest.hexdigest()[:16]


@functools.cache
def _read(path: Path, package: Path) -> tuple[bytes, tuple[Path, ...]]:
    """Return a digest of a source, and the files of the package that it imports."""
    source = path.read_bytes()
    files = []
    for module, names in _IMPORT.findall(source.decode()):
        head, *rest = module.split(".")
        if head == package.name:
            folder = package.joinpath(*rest)
            # What is imported is a module, or a name in one.
            candidates = [folder, *(folder / name for name in _NAME.findall(names))]
            files += [file for c in candidates if (file := c.with_suffix(".py")).is_file()]
    return hashlib.sha256(source).digest(), tuple(files)


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
        return _ready(cache_base())
    except OSError:
        return _ready(_private_temporary_folder())


def _ready(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass  # it can be written
    return folder


@functools.cache
def _folder_of(source: Path) -> Path:
    """Return the folder for the kernels of a module, and mark it as used."""
    folder = CACHE_DIRECTORY / source_hash(source)
    known = folder.is_dir()
    folder.mkdir(exist_ok=True)
    os.utime(folder)
    if not known:
        _prune(CACHE_DIRECTORY)
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
def _our_cache(source: Path) -> Iterator[None]:
    # Numba asks for the folder when a function is decorated; the setting is put back, as it is the whole process's.
    settings = vars(numba.config)
    before = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(_folder_of(source))
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
    with _our_cache(Path(function.__code__.co_filename)):
        kernel: Callable[P, R] = numba.njit(**_OPTIONS, **options)(function)
    return kernel
