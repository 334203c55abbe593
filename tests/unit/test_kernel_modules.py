"""Every kernel is compiled by its module's warmup()."""

import importlib
from typing import Any

import numba
import pytest

from wideberth import kernel_modules

NAMES = kernel_modules.names()


def test_modules_are_found() -> None:
    assert "wideberth.conflict.kernels" in NAMES


@pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="runs without the compiler")
@pytest.mark.parametrize("name", NAMES)
def test_warmup_compiles_every_kernel(name: str) -> None:
    kernels = kernel_modules.warm_up(name)
    assert kernels is not None, f"{name} has no warmup()"
    assert [k.__name__ for k in kernels if not k.signatures] == []


@pytest.mark.parametrize("name", NAMES)
def test_every_module_of_kernels_has_kernels_and_a_warmup(name: str) -> None:
    module: Any = importlib.import_module(name)
    assert callable(module.warmup)
    if not vars(numba.config)["DISABLE_JIT"]:
        assert kernel_modules.kernels_of(module)
