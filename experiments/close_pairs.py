"""Two aircraft in one resolution cell, on runs that nothing was set with: do both tracks outlive the plots they share?

Aircraft at 400 m whose ranges cross after 10 s give one plot between them while they are within a range cell.

    python -m experiments.close_pairs [RUNS]
"""

import dataclasses
import sys

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.simulation.radar_plots import SIGMA, radar_plots
from wideberth.tracking.multi_target.tracker import MultiTargetTracker

FloatArray = NDArray[np.float64]

SCANS, CELL_M = 200, 2.0
FIRST = 5000
CASES = ((2.0, 2.0), (6.0, 1.0), (10.0, 2.0), (15.0, 1.0))
"""Degrees apart, and m/s by which the ranges cross."""


def merging(seed: int, apart_deg: float, rate: float) -> tuple[Plots, FloatArray]:
    """Return plots and places (SCANS, 2, 3) of two aircraft whose ranges cross after 10 s.

    Parameters
    ----------
    seed : int
    apart_deg : float
        Between their directions.
    rate : float
        By which their ranges cross, m/s.
    """
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(SCANS)
    azimuth, elevation = np.radians([0.5 * apart_deg, -0.5 * apart_deg]), np.radians(25.0)
    distance = 400.0 + np.stack([0.5 * rate * (t - 10.0), -0.5 * rate * (t - 10.0)], axis=1)
    level = distance * np.cos(elevation)
    place = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), -distance * np.sin(elevation)], axis=2)
    base, _ = radar_plots(rng, place, np.gradient(place, 0.1, axis=0))
    rows, first = [], np.zeros(SCANS + 1, np.int64)
    for k in range(SCANS):
        echoes = place[k]
        if abs(distance[k, 0] - distance[k, 1]) < CELL_M:
            share = rng.uniform(0.3, 0.7)
            echoes = (share * place[k, 0] + (1.0 - share) * place[k, 1])[None]
        echoes = echoes[rng.random(len(echoes)) < 0.8]
        r = np.linalg.norm(echoes, axis=1)
        true = np.stack([r, np.arctan2(echoes[:, 1], echoes[:, 0]), np.arcsin(-echoes[:, 2] / r)], axis=1)
        m = int(rng.integers(4))
        false = np.stack(
            [600.0 * rng.random(m) ** (1 / 3), rng.uniform(-np.pi, np.pi, m), np.arcsin(rng.random(m))], axis=1
        )
        rows.append(np.concatenate([true + rng.normal(size=true.shape) * SIGMA, false]))
        first[k + 1] = first[k] + len(rows[-1])
    z = np.concatenate(rows)
    return dataclasses.replace(base, first=first, z=np.column_stack([z, np.full(len(z), np.nan)])), place


def kept(plots: Plots, place: FloatArray) -> bool:
    """Return whether both aircraft have the numbers at the end that they had after 5 s, and no third one was given."""
    table = MultiTargetTracker(MultiTargetTracker.Config()).run(plots)
    numbers = []
    for k in (50, SCANS - 1):
        at = table.scan == k
        x, ids = table.x[at, :3], table.track_id[at]
        numbers.append([int(ids[np.argmin(np.linalg.norm(x - p, axis=1))]) for p in place[k]] if len(ids) else [])
    return numbers[0] == numbers[1] and len(set(numbers[0])) == 2 and len(np.unique(table.track_id)) == 2


def main(runs: int) -> None:
    """Print the rows of the table."""
    for apart, rate in CASES:
        good = sum(kept(*merging(FIRST + k, apart, rate)) for k in range(runs))
        print(f"| {400.0 * np.radians(apart):.0f} m | {2.0 * CELL_M / rate:.0f} s | {good} of {runs} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
