"""Each module of kernels has a warmup(); tests/scenario/test_warmup.py shows that it compiles what runs need."""

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
def test_warmup_compiles_kernels(name: str) -> None:
    kernels = kernel_modules.warm_up(name)
    assert kernels is not None, f"{name} has no warmup()"
    assert any(k.signatures for k in kernels)


@pytest.mark.parametrize("name", NAMES)
def test_every_module_of_kernels_has_kernels_and_a_warmup(name: str) -> None:
    module: Any = importlib.import_module(name)
    assert callable(module.warmup)
    if not vars(numba.config)["DISABLE_JIT"]:
        assert kernel_modules.kernels_of(module)
