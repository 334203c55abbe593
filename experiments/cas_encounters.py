"""Random encounters of helicopters that avoid each other: pairs, ten in a cube, who decides, and how fast it runs.

`python -m experiments.cas_encounters` writes docs/results/cas_encounters.md. What is flown is kept in a folder, part by
part: the same command goes on from there.
"""

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from experiments.cas_encounters_page import Found, page_of
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
OUTAGE = {"outage_start_s": 15.0, "outage_duration_s": 15.0}
MANEUVERS = ("horizontal", "speed", "least_deviation", "combined", "roundabout")
PAIRS = ("none", "bang_bang", "continuous", "interval", *MANEUVERS)
CUBES = ("none", "bang_bang", "continuous", "interval", "altitudes", *MANEUVERS)
SPEEDS = ("bang_bang", "continuous", "interval")
PART = 500  # encounters that are flown and kept together


class Kind(NamedTuple):
    """A set of encounters.

    Attributes
    ----------
    n : int
        Vehicles.
    duration : float
        s.
    height : float
        Of the box that they are drawn in, m; of no use for pairs.
    names : tuple of str
        The controllers that fly it.
    """

    n: int
    duration: float
    height: float
    names: tuple[str, ...]


KINDS = {
    "pairs": Kind(2, PAIR_TIME, 0.0, PAIRS),
    "cubes": Kind(10, CUBE_TIME, CUBE, CUBES),
    "layers": Kind(10, CUBE_TIME, LAYER, CUBES),
}
ARCHITECTURES: dict[str, dict[str, Any]] = {
    "distributed": {},
    "distributed, relayed": {"hub": True},
    "centralised": {"architecture": "centralised"},
    "distributed, outage": OUTAGE,
    "distributed, relayed, outage": {"hub": True, **OUTAGE},
    "centralised, outage": {"architecture": "centralised", **OUTAGE},
}


class Part(NamedTuple):
    """Encounters that are flown together: `size` of a kind from number `first` on, with a controller and its radio.

    `label` tells it from others in its file's name.
    """

    kind: str
    label: str
    controller: str
    radio: dict[str, Any]
    seed: int
    first: int
    size: int

    def file(self, folder: Path) -> Path:
        """Return where it is kept."""
        name = self.label.replace(", ", "-").replace(" ", "_")
        return folder / f"{self.seed}-{self.kind}-{name}-{self.first}-{self.size}.npz"


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


def controller(name: str) -> CasConfig:
    """Return the default settings with another controller; the bang-bang one as printed but for its faults."""
    return cas_preset("default", controller=name)


def fleet_of(n: int, name: str, duration: float, seed: int = 1, **radio: Any) -> Fleet:
    """Return a fleet of `n` vehicles with one controller, at 20 Hz; `radio` may name the architecture as well."""
    architecture = radio.pop("architecture", "distributed")
    config = FleetConfig(
        architecture=architecture,
        duration_s=duration,
        step_s=0.05,
        seed=seed,
        vehicles=tuple(FleetVehicleConfig(position_m=(0, 0, 0), velocity_mps=(0, 0, 0)) for _ in range(n)),
        controller=controller(name),
        communication=CommunicationConfig(**{"before_start": "silent", "position_sigma_m": FOOT, **radio}),
    )
    return Fleet(config)


def fly_part(part: Part) -> dict[str, np.ndarray]:
    """Fly a part.

    Returns
    -------
    dict
        ``least``, ``drift`` and ``aside`` (count,), m; ``violated`` (count,), pairs within the sphere; ``counters``
        (8,), sums by `COUNTERS`.
    """
    kind, count = KINDS[part.kind], part.size
    fleet = fleet_of(
        kind.n, part.controller, kind.duration, part.seed, **{"delay_s": DELAY_MAX, "loss": LOSS, **part.radio}
    )
    least, drift, aside, violated = np.empty(count), np.empty(count), np.empty(count), np.zeros(count, int)
    counters = np.zeros(len(COUNTERS), int)
    for row in range(count):
        k = part.first + row
        rng = np.random.default_rng([part.seed, 0xCA5, kind.n, k])
        x = draw_pair(rng) if part.kind == "pairs" else draw_cube(rng, kind.n, kind.height)
        fleet.fly(x, encounter=k, delay=rng.uniform(0.0, DELAY_MAX))
        least[row], drift[row], aside[row] = fleet.separation.min(), fleet.drift.max(), fleet.aside.max()
        violated[row] = np.count_nonzero(np.triu(fleet.separation < SEPARATION, 1))
        counters += fleet.counters.sum(axis=0)
    return {"least": least, "drift": drift, "aside": aside, "violated": violated, "counters": counters}


def parts_of(pairs: int, cubes: int, seed: int) -> Iterator[Part]:
    """Yield all parts of the study."""
    for kind, count in (("pairs", pairs), ("cubes", cubes), ("layers", cubes)):
        for name in KINDS[kind].names:
            yield from _split(kind, name, name, {}, seed, count)
    for kind, count in (("pairs", pairs // 5), ("cubes", cubes // 2), ("layers", cubes // 2)):
        for label, radio in ARCHITECTURES.items():
            yield from _split(kind, label, "interval", radio, seed, count)


def _split(kind: str, label: str, controller_name: str, radio: dict[str, Any], seed: int, count: int) -> Iterator[Part]:
    for first in range(0, count, PART):
        yield Part(kind, label, controller_name, radio, seed, first, min(PART, count - first))


def keep_part(part: Part, folder: Path) -> None:
    """Fly a part, unless it is kept already, and keep it."""
    file = part.file(folder)
    if not file.exists():
        unfinished = file.with_suffix(".tmp.npz")
        np.savez(unfinished, **fly_part(part))  # type: ignore[arg-type]
        unfinished.replace(file)


def found_in(parts: list[Part], folder: Path) -> Found:
    """Return what is kept, by kind and label: the arrays of `fly_part` of all their parts together."""
    found: Found = {}
    for part in parts:
        with np.load(part.file(folder)) as kept:
            one = dict(kept)
        before = found.setdefault(part.kind, {}).get(part.label)
        if before is not None:
            joined = {name: np.concatenate([before[name], one[name]]) for name in one if name != "counters"}
            one = {**joined, "counters": before["counters"] + one["counters"]}
        found[part.kind][part.label] = one
    return found


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


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=10_000)
    parser.add_argument("--cubes", type=int, default=1_000)
    parser.add_argument("--seed", type=int, default=20261129, help="one that was not used for tuning")
    parser.add_argument("--workers", type=int, default=1, help="processes; the results are the same with any number")
    parser.add_argument("--kept", type=Path, default=Path("out/cas_encounters"), help="folder of what is flown")
    parser.add_argument("--out", type=Path, default=Path("docs/results/cas_encounters.md"))
    given = parser.parse_args()
    given.kept.mkdir(parents=True, exist_ok=True)
    parts = list(parts_of(given.pairs, given.cubes, given.seed))
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(keep_part, part, given.kept) for part in parts]:
            done.result()
    speeds = {name: (None if name == "interval" else decision_time(name), real_time_factor(name)) for name in SPEEDS}
    given.out.write_text(page_of(found_in(parts, given.kept), speeds, given.seed), encoding="utf-8")


if __name__ == "__main__":
    main()
