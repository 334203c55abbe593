"""CPU time of a call: the median of several, each long enough to be measured."""

import statistics
import time
from collections.abc import Callable


def cpu_seconds(call: Callable[[], object], repeats: int = 7, shortest: float = 0.1) -> float:
    """Return the CPU seconds of one call: the median over `repeats` runs of at least `shortest` seconds each."""
    call()
    n = 1
    while (spent := _run(call, n)) < shortest:
        n = max(2 * n, int(n * shortest / max(spent, 1e-6)))
    return statistics.median(_run(call, n) / n for _ in range(repeats))


def _run(call: Callable[[], object], n: int) -> float:
    start = time.process_time()
    for _ in range(n):
        call()
    return time.process_time() - start
