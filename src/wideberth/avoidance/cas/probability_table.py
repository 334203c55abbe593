"""A look-up table of conflict probabilities from Monte Carlo runs (CAS thesis, 4.1.3, after its [15]).

With a spherical zone and errors that are alike on all axes, an encounter is told by the time to the closest point of
its mean course, the miss distance there, and the relative speed. A table holds for one set of errors only.
"""

import dataclasses
import hashlib
import json
import multiprocessing
import os
import zipfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import COUNT, NOT_NEGATIVE, POSITIVE, UNSURE, FloatArray, checked
from wideberth.avoidance.cas import probability_table_kernels as kernels
from wideberth.errors import InputError

_FORMAT = "wideberth conflict table 1"


@dataclass(frozen=True, slots=True)
class TableModel:
    """What a table is made for, and how fine.

    Attributes
    ----------
    separation_m : float
        Radius of the protected zone.
    position_sigma_m, velocity_sigma_mps : float
        Of the relative state on each axis.
    acceleration_density_m2ps3 : float
        White acceleration of the pair.
    time_max_s, miss_max_m, speed_max_mps : float
        Ends of the axes, which begin at 0.
    times, misses, speeds : int
        Nodes of each axis, at least 2.
    tail_s : float
        For how long after the closest point a violation counts.
    steps : int
        Of the motion in a run with white acceleration.
    samples : int
        Runs for each time and speed.
    seed : int
    """

    separation_m: float
    position_sigma_m: float
    velocity_sigma_mps: float
    acceleration_density_m2ps3: float = 0.0
    time_max_s: float = 30.0
    miss_max_m: float = 20.0
    speed_max_mps: float = 4.0
    times: int = 16
    misses: int = 33
    speeds: int = 8
    tail_s: float = 5.0
    steps: int = 16
    samples: int = 10_000
    seed: int = 1

    def __post_init__(self) -> None:
        for name in ("separation_m", "time_max_s", "miss_max_m", "speed_max_mps"):
            checked(name, getattr(self, name), POSITIVE)
        for name in ("position_sigma_m", "velocity_sigma_mps", "acceleration_density_m2ps3", "tail_s", "seed"):
            checked(name, getattr(self, name), NOT_NEGATIVE)
        for name in ("times", "misses", "speeds", "steps", "samples"):
            checked(name, getattr(self, name), COUNT)
        if min(self.times, self.misses, self.speeds) < 2:
            raise ValueError("times, misses and speeds must be at least 2")

    def axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the nodes of time, miss distance and speed."""
        return (
            np.linspace(0.0, self.time_max_s, self.times),
            np.linspace(0.0, self.miss_max_m, self.misses),
            np.linspace(0.0, self.speed_max_mps, self.speeds),
        )


@dataclass(frozen=True, slots=True)
class ConflictTable:
    """Probabilities that the protected zone is violated.

    Attributes
    ----------
    model : TableModel
    values : ndarray, shape (times, misses, speeds)
    """

    model: TableModel
    values: FloatArray

    def probability(self, t_star: ArrayLike, miss: ArrayLike, speed: ArrayLike) -> FloatArray:
        """Return interpolated probabilities (linear on each axis; beyond the axes their ends hold).

        Parameters
        ----------
        t_star, miss, speed : array_like
            Of the mean course, s, m and m/s; they go together as numpy's do.

        Raises
        ------
        ValueError
            If one is negative or not finite.
        """
        names = ("t_star", "miss", "speed")
        asked = [checked(name, x, NOT_NEGATIVE) for name, x in zip(names, (t_star, miss, speed), strict=True)]
        result = np.zeros(np.broadcast_shapes(*(x.shape for x in asked)))
        places = []
        for x, axis in zip(asked, self.model.axes(), strict=True):
            at = np.clip(x / axis[-1], 0.0, 1.0) * (len(axis) - 1)
            low = np.minimum(at.astype(np.int64), len(axis) - 2)
            places.append((low, at - low))
        for corner in np.ndindex(2, 2, 2):
            weight: FloatArray = np.ones(())
            for (_, share), upper in zip(places, corner, strict=True):
                weight = weight * (share if upper else 1.0 - share)
            index = tuple(low + upper for (low, _), upper in zip(places, corner, strict=True))
            result += weight * self.values[index]
        return result

    def alert_distances(self, probability: float) -> FloatArray:
        """Return the largest miss distance (times, speeds) at which a conflict is as probable as that, m.

        0 where it is less probable even head-on.

        Raises
        ------
        ValueError
            If the probability is not between 0 and 1, or the table ends before conflicts get less probable.
        """
        limit = float(checked("probability", probability, UNSURE))
        _, misses, _ = self.model.axes()
        above = self.values >= limit
        if above[:, -1, :].any():
            raise ValueError(
                f"at miss_max_m {self.model.miss_max_m:g} a conflict is still as probable as {limit:g}: "
                "make a table with larger miss distances"
            )
        last = above.shape[1] - 1 - np.argmax(above[:, ::-1, :], axis=1)
        result = np.zeros(last.shape)
        for i, j in np.argwhere(above.any(axis=1)):
            k = last[i, j]
            p, after = self.values[i, k, j], self.values[i, k + 1, j]
            result[i, j] = misses[k] + (misses[k + 1] - misses[k]) * (p - limit) / (p - after)
        return result

    def save(self, path: Path) -> None:
        """Write the table, with a digest of its parameters and numbers."""
        text = json.dumps({"format": _FORMAT, **dataclasses.asdict(self.model)}, sort_keys=True)
        temporary = path.with_name(path.name + ".part")
        with temporary.open("wb") as file:
            np.savez_compressed(
                file, model=np.array(text), values=self.values, digest=np.array(_digest(text, self.values))
            )
        os.replace(temporary, path)


def build_table(model: TableModel, workers: int = 1) -> ConflictTable:
    """Make a table; it does not depend on the number of workers.

    Parameters
    ----------
    model : TableModel
    workers : int
        Processes.

    Raises
    ------
    ValueError
        If the number of workers is not a whole number of at least 1.
    """
    checked("workers", workers, COUNT)
    rows = range(model.times)
    if workers == 1:
        values = [_row(model, row) for row in rows]
    else:
        # Spawned, as a fork would copy the locks of numba's and numpy's threads.
        with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
            values = list(pool.map(_row, [model] * model.times, rows))
    return ConflictTable(model, np.array(values))


def load_table(path: Path, model: TableModel | None = None) -> ConflictTable:
    """Read a table.

    Parameters
    ----------
    path : Path
    model : TableModel, optional
        What it has to be made for.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, holds something else, or was made for another model.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            text, values, digest = str(file["model"][()]), file["values"], str(file["digest"][()])
        table = json.loads(text)
        if table.pop("format") != _FORMAT:
            raise ValueError("another format")
        found = TableModel(**table)
    except (
        OSError,
        EOFError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        IndexError,
        zipfile.BadZipFile,
    ) as error:
        raise InputError(f"{path}: cannot be read as a conflict table ({error}); make it anew") from error
    fits = values.dtype == np.float64 and values.shape == (found.times, found.misses, found.speeds)
    if not fits or digest != _digest(text, values):
        raise InputError(f"{path}: the conflict table is damaged; make it anew")
    if model is not None and found != model:
        fields = [f.name for f in dataclasses.fields(model) if getattr(model, f.name) != getattr(found, f.name)]
        raise InputError(f"{path}: the conflict table was made for other values of {', '.join(fields)}; make it anew")
    return ConflictTable(found, values)


def _row(model: TableModel, row: int) -> FloatArray:
    """Return the probabilities (misses, speeds) of one time."""
    times, misses, speeds = model.axes()
    out = np.empty((model.misses, model.speeds))
    counts = np.empty(model.misses)
    until = times[row] + model.tail_s
    steps = model.steps if model.acceleration_density_m2ps3 > 0.0 else 1
    for j, speed in enumerate(speeds):
        kernels.violations(
            times[row], speed, misses, until, steps, model.position_sigma_m, model.velocity_sigma_mps,
            model.acceleration_density_m2ps3, model.separation_m, model.seed, row * model.speeds + j, model.samples,
            counts,
        )  # fmt: skip
        out[:, j] = counts / model.samples
    return out


def _digest(text: str, values: FloatArray) -> str:
    return hashlib.sha256(text.encode() + np.ascontiguousarray(values).tobytes()).hexdigest()
