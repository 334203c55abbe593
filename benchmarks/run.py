"""Run every benchmark, print a table, and keep the numbers in benchmarks/results/latest.json."""

import json
import os
import platform
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks import frames, pairs, steps, tracking

RESULTS = Path(__file__).resolve().parent / "results"
AIMS_MS = {40: 1.0, 200: 5.0}  # mean of a step
Numbers = Mapping[str, float | str]


def machine() -> dict[str, str | int | None]:
    """Return what the numbers depend on."""
    cpu = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        models = [line.split(":")[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        cpu = models[0] if models else cpu
    packages = ("wideberth", "numpy", "numba", "rs1090", "filterpy")
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{name: version(name) for name in packages},
    }


def jobs() -> dict[str, Callable[[], Numbers]]:
    """Return the benchmarks by name."""
    made: dict[str, Callable[[], Numbers]] = {
        "well-clear pairs": pairs.measure,
        "frames": frames.measure,
        "tracking": tracking.measure,
    }
    for aircraft in steps.AIRCRAFT:
        made[f"step with {aircraft} aircraft"] = lambda n=aircraft: steps.measure(n)  # type: ignore[misc]
    return made


def main() -> None:
    """Run everything."""
    console = Console()
    results: dict[str, Numbers] = {}
    with Progress(console=console) as progress:
        todo = jobs()
        task = progress.add_task("benchmarks", total=len(todo))
        for name, measure in todo.items():
            progress.update(task, description=name)
            results[name] = measure()
            progress.advance(task)
    table = Table("benchmark", "number", "value", title="CPU time, one core")
    for name, numbers in results.items():
        for i, (key, value) in enumerate(numbers.items()):
            table.add_row(name if i == 0 else "", key, value if isinstance(value, str) else f"{value:,.4g}")
    console.print(table)
    for aircraft, aim in AIMS_MS.items():
        mean = float(results[f"step with {aircraft} aircraft"]["mean_ms"])
        console.print(
            f"step with {aircraft} aircraft: {mean:.3f} ms, aim {aim:g} ms: {'met' if mean < aim else 'MISSED'}"
        )
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / "latest.json"
    path.write_text(json.dumps({"machine": machine(), "results": results}, indent=2) + "\n")
    console.print(f"kept in {path}", soft_wrap=True)


if __name__ == "__main__":
    main()
