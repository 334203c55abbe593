"""What all tests share."""

import os
from types import ModuleType

import pytest
from hypothesis import HealthCheck, settings

# Reproducible examples and no timing: machines differ. Without the compiler every example is slow.
settings.register_profile(
    "wideberth",
    deadline=None,
    derandomize=True,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
    max_examples=20 if os.environ.get("NUMBA_DISABLE_JIT") == "1" else 100,
)
settings.load_profile("wideberth")


def _uses_kernels(module: ModuleType) -> bool:
    origins = {v.__name__ if isinstance(v, ModuleType) else getattr(v, "__module__", "") for v in vars(module).values()}
    return any(
        isinstance(o, str) and ((o.startswith("wideberth.") and o.endswith("kernels")) or o.startswith("tests.naive"))
        for o in origins
    )


_LONGEST = {"test_no_flip_flop.py", "test_montecarlo_tiers.py", "test_flight_on_loopback.py", "test_fly_command.py"}
_COMPILED = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="takes long without the compiler")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        module = getattr(item, "module", None)
        if isinstance(module, ModuleType) and _uses_kernels(module):
            item.add_marker("kernels")
        if item.get_closest_marker("compiled") is not None:
            item.add_marker(_COMPILED)
    # The longest first, or one worker waits for the other at the end.
    items.sort(key=lambda item: item.path.name not in _LONGEST)
