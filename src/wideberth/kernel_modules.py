"""The modules that hold compiled kernels, and their warm-up.

Each has a plain function ``warmup()`` that calls what Python calls of it, with small arguments.
"""

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

_PACKAGE = Path(__file__).resolve().parent


def names() -> list[str]:
    """Return the full names of all modules of kernels."""
    paths = (p.relative_to(_PACKAGE.parent).with_suffix("") for p in _PACKAGE.rglob("*kernels.py"))
    return sorted(".".join(p.parts) for p in paths)


def loaded() -> list[str]:
    """Return those that are imported: a scenario's, once it is built, and not those of parts that it has not."""
    return [name for name in names() if name in sys.modules]


def kernels_of(module: ModuleType) -> list[Any]:
    """Return the compiled kernels that a module defines."""
    return [
        value
        for value in vars(module).values()
        if hasattr(value, "signatures") and hasattr(value, "stats") and value.__module__ == module.__name__
    ]


def warm_up(name: str) -> list[Any] | None:
    """Compile the kernels of a module, and return them; None if the module has no function ``warmup``."""
    module = importlib.import_module(name)
    if not hasattr(module, "warmup"):
        return None
    module.warmup()
    return kernels_of(module)
