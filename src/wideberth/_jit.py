"""The one place that decides how kernels are compiled and where the results are cached.

Numba's own cache notices an edit of the file that holds a kernel, but not of a kernel it imports, and then
returns stale machine code. The cache folder is therefore keyed by a hash of every kernel source in the package.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")

_PACKAGE = Path(__file__).resolve().parent


def source_hash(package: Path = _PACKAGE) -> str:
    """Return a short hash over the sources of all kernels (``_jit.py`` and every ``*kernels.py``)."""
    digest = hashlib.sha256()
    for path in sorted([*package.rglob("*kernels.py"), package / "_jit.py"]):
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Return the folder for compiled kernels, creating it; a temporary one where the home is not writable."""
    base = os.environ.get("WIDEBERTH_CACHE_DIR") or os.path.join(
        os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache"), "wideberth"
    )
    folder = Path(base) / source_hash()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"wideberth-{os.getuid()}" / source_hash()
        folder.mkdir(parents=True, exist_ok=True)
        return folder


numba.config.CACHE_DIR = str(cache_directory())


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel: cached, without the interpreter lock, IEEE division (no exception on x / 0)."""
    return numba.njit(cache=True, nogil=True, error_model="numpy")(function)  # type: ignore[no-any-return]


def jit_parallel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel whose outer loop runs in parallel over independent items (use `numba.prange`)."""
    return numba.njit(cache=True, nogil=True, error_model="numpy", parallel=True)(function)  # type: ignore[no-any-return]
