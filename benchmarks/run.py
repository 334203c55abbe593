"""Run every benchmark, print a table, and keep the numbers in benchmarks/results/latest.json."""

import json
import os
import platform
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks import (
    bluesky_encounters,
    cas_pairs,
    detection_range,
    encounters,
    frames,
    missions,
    pairs,
    radar_samples,
    radar_trackers,
    steps,
    tracking,
)

RESULTS = Path(__file__).resolve().parent / "results"
Numbers = Mapping[str, float | str]


class Aim(NamedTuple):
    """What a number should reach, or stay below."""

    benchmark: str
    key: str
    value: float
    at_least: bool


AIMS = (
    Aim("step with 40 aircraft", "mean_ms", 1.0, at_least=False),
    Aim("step with 200 aircraft", "mean_ms", 5.0, at_least=False),
    Aim("detection range", "tgvv_microseconds", 20.0, at_least=False),
    Aim("detection range", "gvv_microseconds", 0.3, at_least=False),
    Aim("cooperative pairs", "continuous_nanoseconds", 400.0, at_least=False),
    Aim("cooperative pairs", "bang_bang_nanoseconds", 400.0, at_least=False),
    Aim("radar trackers", "ratio_to_stone_soup_gnn", 200.0, at_least=True),
    Aim("radar trackers", "ratio_to_stone_soup_jpda", 200.0, at_least=True),
    Aim("radar trackers", "ospa_over_stone_soup_gnn", 1.0, at_least=False),
    Aim("radar trackers", "ospa_over_stone_soup_jpda", 1.0, at_least=False),
    Aim("radar samples", "simulate_ms", 30.0, at_least=False),
    Aim("radar samples", "process_ms", 10.0, at_least=False),
    Aim("encounters", "encounters_with_1_per_cpu_second", 2000.0, at_least=True),
    Aim("encounters", "encounters_with_5_per_cpu_second", 400.0, at_least=True),
    Aim("encounters", "ratio_to_bluesky_1_s", 150.0, at_least=True),
    Aim("encounters", "ratio_to_bluesky_50_ms", 1000.0, at_least=True),
    Aim("encounters", "ratio_to_bluesky_1_s_to_180_s", 150.0, at_least=True),
    Aim("encounters", "ratio_to_bluesky_50_ms_to_180_s", 1000.0, at_least=True),
    Aim("missions", "gbr_1_times_real_time", 100.0, at_least=True),
    Aim("missions", "gbr_2_times_real_time", 100.0, at_least=True),
    Aim("missions", "gbr_1_cycle_ms_mean", 2.0, at_least=False),
    Aim("missions", "gbr_2_cycle_ms_mean", 2.0, at_least=False),
    Aim("missions", "gbr_1_cycle_ms_worst", 15.0, at_least=False),
    Aim("missions", "gbr_2_cycle_ms_worst", 15.0, at_least=False),
)


def machine() -> dict[str, str | int | None]:
    """Return what the numbers depend on."""
    cpu = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        models = [line.split(":")[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        cpu = models[0] if models else cpu
    packages = ("wideberth", "numpy", "numba", "rs1090", "filterpy", "stonesoup")
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        **{name: version(name) for name in packages},
        bluesky_encounters.PACKAGE: bluesky_encounters.installed_version(),
    }


def jobs() -> dict[str, Callable[[], Numbers]]:
    """Return the benchmarks by name."""
    made: dict[str, Callable[[], Numbers]] = {
        "well-clear pairs": pairs.measure,
        "cooperative pairs": cas_pairs.measure,
        "frames": frames.measure,
        "tracking": tracking.measure,
        "radar trackers": radar_trackers.measure,
        "radar samples": radar_samples.measure,
        "detection range": detection_range.measure,
        "encounters": encounters.measure,
    }
    for aircraft in steps.AIRCRAFT:
        made[f"step with {aircraft} aircraft"] = lambda n=aircraft: steps.measure(n)  # type: ignore[misc]
    # Last: what so many flights leave behind would be collected in the steps.
    return made | {"missions": missions.measure}


def verdict(aim: Aim, number: float | str | None) -> str:
    """Return a line that says whether an aim is met."""
    wanted = f"aim {'at least' if aim.at_least else 'below'} {aim.value:g}"
    if not isinstance(number, float):
        return f"{aim.benchmark}, {aim.key}: not measured, {wanted}"
    met = number >= aim.value if aim.at_least else number < aim.value
    return f"{aim.benchmark}, {aim.key}: {number:,.4g}, {wanted}: {'met' if met else 'MISSED'}"


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
    for aim in AIMS:
        console.print(verdict(aim, results[aim.benchmark].get(aim.key)), soft_wrap=True)
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / "latest.json"
    path.write_text(json.dumps({"machine": machine(), "results": results}, indent=2) + "\n")
    console.print(f"kept in {path}", soft_wrap=True)


if __name__ == "__main__":
    main()
