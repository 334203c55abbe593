"""Decisions of the cooperative controllers for pairs that are about to meet, by controller and threshold."""

from typing import Any

import numpy as np

from benchmarks.timing import cpu_seconds
from wideberth.avoidance.cas import pair_kernels as kernels
from wideberth.avoidance.cas.config import CasConfig
from wideberth.avoidance.cas.settings import settings

PAIRS = 20_000
_KINDS: dict[str, dict[str, Any]] = {
    "continuous": {"controller": "continuous"},
    "bang_bang": {"controller": "bang_bang"},
    "probability": {"controller": "continuous", "threshold": {"kind": "probability"}},
    "hypothesis_test": {"controller": "bang_bang", "threshold": {"start": "hypothesis_test"}},
    "guaranteed": {"controller": "continuous", "threshold": {"kind": "guaranteed"}},
}


def measure() -> dict[str, float]:
    """Return nanoseconds of CPU for each decision, and the share of pairs that avoid."""
    random = np.random.default_rng(1)
    own, other = random.normal(size=(2, PAIRS, 6)) * (20, 20, 2, 1, 1, 0.3) - (0, 0, 30, 0, 0, 0)
    # Most of them come close within 5 to 20 s.
    other[:, 3:5] = own[:, 3:5] + (own[:, :2] - other[:, :2]) / random.uniform(5, 20, (PAIRS, 1))
    wanted, first = own[:, 2].copy(), np.ones(PAIRS)
    reasons, commands, closest = np.zeros(PAIRS, np.int64), np.zeros(PAIRS), np.empty((PAIRS, 2))
    numbers = {}
    for name, keys in _KINDS.items():
        p = settings(CasConfig(**keys))

        def decide(p: Any = p) -> None:
            reasons[:] = kernels.NO_REASON
            kernels.decide_pairs(own, other, wanted, first, p, reasons, commands, closest)

        numbers[f"{name}_nanoseconds"] = cpu_seconds(decide) / PAIRS * 1e9
        numbers[f"{name}_avoiding"] = float((reasons != kernels.NO_REASON).mean())
    return numbers
