"""Random encounters of helicopters that avoid each other: pairs, ten in a cube, and how fast it runs.

`python -m experiments.cas_encounters` writes docs/results/cas_encounters.md.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from experiments.mission_results import wilson
from wideberth.avoidance.cas import pair_kernels
from wideberth.avoidance.cas.config import CasConfig, cas_preset
from wideberth.avoidance.cas.settings import settings
from wideberth.simulation.fleet import COUNTERS, Fleet
from wideberth.simulation.fleet_config import CommunicationConfig, FleetConfig, FleetVehicleConfig
from wideberth.types import FloatArray
from wideberth.units import FOOT

SEPARATION = 12 * FOOT
FASTEST = 5 * FOOT
ALTITUDE = 200 * FOOT
PAIR_TIME, CUBE_TIME = 75.0, 90.0
DELAY_MAX, LOSS = 4.0, 0.2
CUBE = 300 * FOOT
LAYER = 40 * FOOT
FIRST_TIME, FIRST_DISTANCE = 20.0, 16 * FOOT
MANEUVERS = ("horizontal", "speed", "least_deviation", "combined", "roundabout")
PAIRS = ("none", "bang_bang", "continuous", "interval", *MANEUVERS)
CUBES = ("none", "bang_bang", "continuous", "interval", "altitudes", *MANEUVERS)


def draw_pair(rng: np.random.Generator) -> FloatArray:
    """Return the states (2, 6), NED, of a pair that would pass within the sphere 20 to 40 s later."""
    while True:
        speeds, courses = rng.uniform(0.2, 1.0, 2) * FASTEST, rng.uniform(-np.pi, np.pi, 2)
        v = speeds[:, None] * np.stack([np.cos(courses), np.sin(courses)], axis=1)
        t = rng.uniform(20.0, 40.0)
        miss, height = rng.uniform(-SEPARATION, SEPARATION, 2)
        relative = v[1] - v[0]
        speed = float(np.hypot(*relative))
        if miss * miss + height * height >= SEPARATION**2 or speed * t < 2 * SEPARATION:
            continue
        x = np.zeros((2, 6))
        x[:, 2] = -ALTITUDE
        x[1, 2] += height
        x[:, 3:5] = v
        x[1, :2] = -relative * t + miss * np.array([-relative[1], relative[0]]) / speed
        return x


def draw_cube(rng: np.random.Generator, n: int = 10, height: float = CUBE) -> FloatArray:
    """Return the states (n, 6), NED, of vehicles in a cube, or a layer of it, that fly level to random places of it.

    No pair comes near another in the first 20 s.
    """
    while True:
        place = rng.uniform(-0.5, 0.5, (n, 3)) * [CUBE, CUBE, height]
        to = rng.uniform(-0.5, 0.5, (n, 2)) * CUBE - place[:, :2]
        speed = rng.uniform(0.2, 1.0, n) * FASTEST
        v = to / np.hypot(to[:, 0], to[:, 1])[:, None] * speed[:, None]
        x = np.column_stack([place[:, :2], place[:, 2] - ALTITUDE, v, np.zeros(n)])
        if all(_far_at_first(x[i], x[j]) for i in range(n) for j in range(i)):
            return x


def _far_at_first(a: FloatArray, b: FloatArray) -> bool:
    p, v = a[:3] - b[:3], a[3:] - b[3:]
    t = min(max(-float(p @ v) / max(float(v @ v), 1e-9), 0.0), FIRST_TIME)
    return float(np.linalg.norm(p + v * t)) >= FIRST_DISTANCE


def draw_layer(rng: np.random.Generator) -> FloatArray:
    """Return ten vehicles in a layer of 40 ft, where nearly all paths conflict."""
    return draw_cube(rng, height=LAYER)


def controller(name: str) -> CasConfig:
    """Return the default settings with another controller; the bang-bang one as printed but for its faults."""
    return cas_preset("default", controller=name)


def fleet_of(n: int, name: str, duration: float, seed: int = 1, **radio: Any) -> Fleet:
    """Return a fleet of `n` vehicles with one controller, at 20 Hz."""
    config = FleetConfig(
        duration_s=duration,
        step_s=0.05,
        seed=seed,
        vehicles=tuple(FleetVehicleConfig(position_m=(0, 0, 0), velocity_mps=(0, 0, 0)) for _ in range(n)),
        controller=controller(name),
        communication=CommunicationConfig(**{"before_start": "silent", "position_sigma_m": FOOT, **radio}),
    )
    return Fleet(config)


def fly_all(
    name: str, n: int, count: int, draw: Callable[[np.random.Generator], FloatArray], duration: float, seed: int = 1
) -> dict[str, Any]:
    """Fly encounters with one controller.

    Returns
    -------
    dict
        ``least``, ``drift`` and ``aside`` (count,), m; ``violated`` (count,), pairs within the sphere; ``switches`` and
        ``counters``, sums.
    """
    fleet = fleet_of(n, name, duration, seed, delay_s=DELAY_MAX, loss=LOSS)
    least, drift, aside, violated = np.empty(count), np.empty(count), np.empty(count), np.zeros(count, int)
    counters = np.zeros(len(COUNTERS), int)
    for k in range(count):
        rng = np.random.default_rng([seed, 0xCA5, n, k])
        x, delay = draw(rng), rng.uniform(0.0, DELAY_MAX)
        fleet.fly(x, encounter=k, delay=delay)
        least[k], drift[k], aside[k] = fleet.separation.min(), fleet.drift.max(), fleet.aside.max()
        violated[k] = np.count_nonzero(np.triu(fleet.separation < SEPARATION, 1))
        counters += fleet.counters.sum(axis=0)
    return {
        "least": least,
        "drift": drift,
        "aside": aside,
        "violated": violated,
        "counters": dict(zip(COUNTERS, counters, strict=True)),
    }


def rows_of(found: dict[str, dict[str, Any]]) -> list[str]:
    """Return the rows of a table of results by controller."""
    lines = [
        "| controller | encounters with a violation | per 1,000 (95 %) | pairs | least, ft |"
        " drift median / largest, ft | aside median / largest, ft | switches per encounter |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, one in found.items():
        n, bad = len(one["least"]), int(np.count_nonzero(one["violated"]))
        low, high = (1000 * x for x in wilson(bad, n))
        drift, aside = one["drift"] / FOOT, one["aside"] / FOOT
        lines.append(
            f"| {name} | {bad} | {1000 * bad / n:.1f} ({low:.1f} to {high:.1f}) | {one['violated'].sum()} |"
            f" {one['least'].min() / FOOT:.1f} | {np.median(drift):.1f} / {drift.max():.1f} |"
            f" {np.median(aside):.1f} / {aside.max():.1f} |"
            f" {one['counters']['switches'] / n:.1f} |"
        )
    return lines


def decision_time(name: str, n: int = 100_000) -> float:
    """Return the CPU seconds of one decision about a pair in conflict."""
    rng = np.random.default_rng(1)
    drawn = np.array([draw_pair(rng) for _ in range(200)])
    own, other = (np.ascontiguousarray(np.resize(drawn[:, k], (n, 6))) for k in range(2))
    work = (own, other, own[:, 2].copy(), np.ones(n), settings(cas_preset("thesis", controller=name)))
    reasons, commands, closest = np.zeros(n, np.int64), np.zeros(n), np.empty((n, 2))
    pair_kernels.decide_pairs(*work, reasons, commands, closest)
    start = time.process_time()
    for _ in range(5):
        reasons[:] = 0
        pair_kernels.decide_pairs(*work, reasons, commands, closest)
    return (time.process_time() - start) / (5 * n)


def real_time_factor(name: str, n: int = 100) -> float:
    """Return how many times faster than real time `n` vehicles fly at 20 Hz, all pairs, on one core."""
    fleet = fleet_of(n, name, 20.0, delay_s=1.0, jitter_s=0.1, loss=LOSS)
    x = draw_cube(np.random.default_rng(1), 10)
    crowd = np.array([x[k % 10] + [0, 0, 8.0 * (k // 10), 0, 0, 0] for k in range(n)])
    fleet.fly(crowd)
    start = time.process_time()
    fleet.fly(crowd)
    return 20.0 / (time.process_time() - start)


def page_of(found: dict[str, dict[str, dict[str, Any]]], seed: int) -> str:
    """Return the page of results."""
    pairs, cubes = found["pairs"], found["cubes"]
    lines = [
        "# Cooperative avoidance in random encounters",
        "",
        f"Made by `python -m experiments.cas_encounters` (seed {seed}). Default settings (docs/cas.md) with each"
        " controller, 20 Hz, the same messages for all: 0 to 4 s late (drawn for each encounter), 20 % lost,"
        " positions noisy by 1 ft per"
        " axis, nothing known before the first message. Speeds 1 to 5 ft/s. A violation is a distance below 12 ft."
        " Drift is the largest distance from the altitude wanted, aside that from the straight track. 95 %"
        " intervals are Wilson's.",
        "",
        f"## {len(pairs['none']['least']):,} pairs that would meet 20 to 40 s after the start",
        "",
        *rows_of(pairs),
        "",
    ]
    for name in ("continuous", "interval"):
        worse = np.count_nonzero((pairs[name]["violated"] > 0) & (pairs["bang_bang"]["violated"] == 0))
        lines.append(f"- `{name}` violates in {worse} of the pairs that `bang_bang` keeps apart.")
    for title, one in (("in a cube of 300 ft", cubes), ("in a layer of 300 by 300 by 40 ft", found["layers"])):
        lines += ["", f"## {len(one['none']['least']):,} encounters of ten vehicles {title}", "", *rows_of(one)]
    lines += [
        "",
        "## Speed, one core",
        "",
        "| controller | one decision about a pair, us | 100 vehicles, all pairs at 20 Hz, times real time |",
        "|---|---|---|",
    ]
    for name in ("bang_bang", "continuous", "interval"):
        pair = "" if name == "interval" else f"{decision_time(name) * 1e6:.3f}"
        lines.append(f"| {name} | {pair} | {real_time_factor(name):.0f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=10_000)
    parser.add_argument("--cubes", type=int, default=1_000)
    parser.add_argument("--seed", type=int, default=20261129, help="one that was not used for tuning")
    parser.add_argument("--out", type=Path, default=Path("docs/results/cas_encounters.md"))
    given = parser.parse_args()
    found = {
        "pairs": {name: fly_all(name, 2, given.pairs, draw_pair, PAIR_TIME, given.seed) for name in PAIRS},
        "cubes": {name: fly_all(name, 10, given.cubes, draw_cube, CUBE_TIME, given.seed) for name in CUBES},
        "layers": {name: fly_all(name, 10, given.cubes, draw_layer, CUBE_TIME, given.seed) for name in CUBES},
    }
    given.out.write_text(page_of(found, given.seed), encoding="utf-8")


if __name__ == "__main__":
    main()
