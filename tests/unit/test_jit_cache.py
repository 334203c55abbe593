"""Compiled kernels are kept between runs, and an edit anywhere among the kernels is seen."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import wideberth._jit as jit_module
from wideberth._jit import source_hash

JIT_SOURCE = Path(jit_module.__file__)
INNER = "from mini._jit import jit\n\n\n@jit\ndef scale(x: float) -> float:\n    return {factor} * x\n"
OUTER = """from mini._jit import jit
from mini.inner_kernels import scale


@jit
def twice(x: float) -> float:
    return scale(x) + scale(x)
"""
RUN = (
    "from mini.outer_kernels import twice; "
    "print(twice(1.0), sum(twice.stats.cache_hits.values()), sum(twice.stats.cache_misses.values()))"
)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "mini"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "_jit.py").write_bytes(JIT_SOURCE.read_bytes())
    (folder / "inner_kernels.py").write_text(INNER.format(factor=2.0))
    (folder / "outer_kernels.py").write_text(OUTER)
    return folder


def run(package: Path, cache: Path, code: str = RUN, **environment: str) -> str:
    env = {k: v for k, v in os.environ.items() if k not in {"NUMBA_DISABLE_JIT", "NUMBA_CACHE_DIR"}}
    env |= {"WIDEBERTH_CACHE_DIR": str(cache), "PYTHONPATH": str(package.parent), **environment}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, cwd=package.parent, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_edit_of_an_imported_kernel_is_seen_and_unchanged_sources_reuse_the_cache(
    package: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    assert run(package, cache) == "4.0 0 1"  # compiled
    assert run(package, cache) == "4.0 1 0"  # taken from the cache
    inner = package / "inner_kernels.py"
    inner.write_text(INNER.format(factor=5.0))
    assert run(package, cache) == "10.0 0 1"
    assert run(package, cache) == "10.0 1 0"
    # A folder for each module and source: the old ones are still there, so going back costs nothing.
    assert len([f for f in cache.iterdir() if re.fullmatch(r"[0-9a-f]{16}", f.name)]) == 4
    inner.write_text(INNER.format(factor=2.0))
    assert run(package, cache) == "4.0 1 0"
    (package / "other_kernels.py").write_text(INNER.format(factor=3.0))
    assert run(package, cache) == "4.0 1 0"


def test_folders_that_nobody_used_for_long_are_removed(package: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    old, young, other = cache / ("0" * 16), cache / ("1" * 16), cache / "mine"
    for folder in (old, young, other):
        folder.mkdir(parents=True)
    month_ago = time.time() - 31 * 86400
    for folder in (old, other):
        os.utime(folder, (month_ago, month_ago))
    run(package, cache, "import mini.outer_kernels")
    assert not old.exists()
    assert young.exists()
    assert other.exists()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs a file system with owners")
def test_unusable_cache_folder_falls_back_to_a_private_one(package: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    code = "from mini._jit import CACHE_DIRECTORY; print(CACHE_DIRECTORY)"
    expected = temporary / f"wideberth-{os.getuid()}"
    assert Path(run(package, blocked, code, TMPDIR=str(temporary))) == expected
    assert expected.stat().st_mode & 0o077 == 0
    expected.chmod(0o777)  # now others could have planted code in it
    assert Path(run(package, blocked, code, TMPDIR=str(temporary))) != expected


def test_hash_follows_what_a_module_rests_on_and_nothing_else(package: Path) -> None:
    def hash_now(name: str) -> str:
        jit_module._read.cache_clear()
        return source_hash(package / name, package)

    (package / "deep_kernels.py").write_text("DEPTH = 1.0\n")
    (package / "inner_kernels.py").write_text("from mini import (\n    deep_kernels,\n)\n" + INNER.format(factor=2.0))
    outer, inner = hash_now("outer_kernels.py"), hash_now("inner_kernels.py")
    assert outer != inner
    (package / "reader.py").write_text("x = 1\n")
    (package / "other_kernels.py").write_text(INNER.format(factor=4.0))
    assert (hash_now("outer_kernels.py"), hash_now("inner_kernels.py")) == (outer, inner)
    (package / "outer_kernels.py").write_text(OUTER + "\n")
    assert hash_now("outer_kernels.py") != outer
    assert hash_now("inner_kernels.py") == inner
    for name in ("deep_kernels.py", "_jit.py"):
        outer, inner = hash_now("outer_kernels.py"), hash_now("inner_kernels.py")
        (package / name).write_text((package / name).read_text() + "\nX = 2\n")
        assert hash_now("outer_kernels.py") != outer
        assert hash_now("inner_kernels.py") != inner


def test_the_cache_setting_of_other_users_of_numba_is_left_alone(package: Path, tmp_path: Path) -> None:
    code = "import numba, mini.outer_kernels; print(repr(vars(numba.config)['CACHE_DIR']))"
    assert run(package, tmp_path / "cache", code, NUMBA_CACHE_DIR="/elsewhere") == "'/elsewhere'"


UNCOUNTED = """import numpy as np
from mini._jit import jit, jit_uncounted


@jit
def allocates(x):
    y = np.zeros(3)
    y[0] = x[0]
    return y[0]


@jit_uncounted
def passes_on(pair, n):
    for i in range(n):
        if pair[1][i] < 0.0:
            return pair[0][:2][0]
    return allocates(pair[0][1:]) + pair[1][0]


@jit_uncounted
def makes(n):
    return np.zeros(n)[0]
"""


def test_kernels_that_do_not_count_neither_lose_nor_keep_references(package: Path, tmp_path: Path) -> None:
    """What they are given lives on, is let go in the end, and they may call kernels that count."""
    (package / "outer_kernels.py").write_text(UNCOUNTED)
    code = (
        "import sys, numpy as np, mini.outer_kernels as k\n"
        "a, b = np.arange(3.0), np.ones(3)\n"
        "before = sys.getrefcount(a), sys.getrefcount(b)\n"
        "sums = {k.passes_on((a, b), i % 3) for i in range(1000)}\n"
        "print(sums, before == (sys.getrefcount(a), sys.getrefcount(b)), a.tolist())\n"
        "try: k.makes(3)\n"
        "except Exception: print('refused')"
    )
    assert run(package, tmp_path / "cache", code).splitlines() == ["{2.0} True [0.0, 1.0, 2.0]", "refused"]


def test_kernels_that_do_not_count_are_inlined(package: Path, tmp_path: Path) -> None:
    """Else all would only be slower, and nobody would notice."""
    body = "".join(f"    x += math.sin(x / {n})\n" for n in range(1, 60))  # too long to be inlined unasked
    code = (
        "import re, mini.outer_kernels as k; k.twice(1.0); llvm = k.twice.inspect_llvm(k.twice.signatures[0])\n"
        "print(re.search(r'call .*inner_kernels.*scale', llvm) is None)"
    )
    for decorator, inlined in (("jit", "False"), ("jit_uncounted", "True")):
        (package / "inner_kernels.py").write_text(
            f"import math\nfrom mini._jit import {decorator}\n\n\n@{decorator}\ndef scale(x):\n{body}    return x\n"
        )
        assert run(package, tmp_path / "cache", code) == inlined
