"""Blocks of encounters as rows: flown by the fast tier, and by the full tier where a track asks for it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo import encounter_kernels as ek
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.evaluation.montecarlo.fast_settings import planner_memory, run_settings
from wideberth.evaluation.montecarlo.full_tier import fly_full
from wideberth.evaluation.montecarlo.rows import FLOAT_COLUMNS, SCHEMA
from wideberth.types import FloatArray

AGREEMENT = 1e-6
"""How far the tiers may differ in times (s), separations (m) and scores."""


def prepare(experiment: Experiment) -> None:
    """Compile the fast tier, or load it, so that no block waits for it.

    Raises
    ------
    InputError
        If the fast tier does not have the experiment's parts.
    """
    fly_block(experiment, 0, 1, 0, 0, True)


def fly_block(
    experiment: Experiment, seed: int, intruders: int, first: int, count: int, avoid: bool
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Fly encounters by the fast tier alone.

    Parameters
    ----------
    experiment : Experiment
    seed : int
    intruders : int
        Of each encounter.
    first, count : int
        Encounters ``first`` to ``first + count - 1``.
    avoid : bool

    Returns
    -------
    floats, integers : ndarray, shape (count, intruders, N_FLOAT_COLUMNS), (count, intruders, N_INTEGER_COLUMNS)
    status : ndarray, shape (count,)
        `encounter_kernels.DONE` or why not.

    Raises
    ------
    InputError
        If the fast tier does not have the experiment's parts.
    """
    floats = np.empty((count, intruders, ek.N_FLOAT_COLUMNS))
    integers = np.zeros((count, intruders, ek.N_INTEGER_COLUMNS), np.int64)
    status = np.zeros(count, np.int64)
    ek.fly_encounters(
        seed, intruders, first, avoid, run_settings(experiment), planner_memory(experiment), floats, integers, status
    )
    return floats, integers, status


def run_block(experiment: Experiment, seed: int, intruders: int, first: int, count: int, avoid: bool) -> pa.Table:
    """Fly encounters and return their rows, in the order of encounter and intruder.

    The rows depend on nothing but the arguments, and those of an encounter on none of the others.

    Parameters
    ----------
    experiment, seed, intruders, first, count, avoid
        As for `fly_block`.

    Returns
    -------
    pyarrow.Table
        Of `rows.SCHEMA`.

    Raises
    ------
    InputError
        If an encounter cannot be drawn, or the fast tier does not have the experiment's parts.
    """
    floats, integers, status = fly_block(experiment, seed, intruders, first, count, avoid)
    if (status == ek.NOT_DRAWN).any():
        raise InputError("encounter: no intruder of these speeds can enter the circle at one of its points")
    for n in np.flatnonzero(status == ek.NEEDS_FULL_TIER):
        full = fly_full(experiment, seed, intruders, first + int(n), avoid=avoid)
        floats[n], integers[n] = full.floats, full.integers
    rows = count * intruders
    numbers = floats.reshape(rows, ek.N_FLOAT_COLUMNS)
    counts = integers.reshape(rows, ek.N_INTEGER_COLUMNS).astype(np.int32)
    columns: dict[str, Any] = {
        "intruders": np.full(rows, intruders, np.int16),
        "encounter": np.repeat(np.arange(first, first + count, dtype=np.int64), intruders),
        "intruder": np.tile(np.arange(intruders, dtype=np.int16), count),
        **{name: numbers[:, i].copy() for i, name in enumerate(FLOAT_COLUMNS)},
        "inside_alone": counts[:, ek.INSIDE_ALONE].copy(),
        "inside": counts[:, ek.INSIDE].copy(),
        "maneuvers": counts[:, ek.MANEUVERS].copy(),
        "least_bad": counts[:, ek.LEAST_BAD_COUNT].copy(),
        "full_tier": np.repeat(status == ek.NEEDS_FULL_TIER, intruders),
    }
    return pa.table([pa.array(columns[name]) for name in SCHEMA.names], schema=SCHEMA)


def agree(floats: FloatArray, integers: np.ndarray, full_floats: FloatArray, full_integers: np.ndarray) -> bool:
    """Return whether the rows of an encounter are the same from both tiers, within `AGREEMENT`."""
    return bool(
        np.allclose(floats, full_floats, rtol=0.0, atol=AGREEMENT, equal_nan=True)
        and np.array_equal(integers, full_integers)
    )


def cycle_times(
    experiment: Experiment, seed: int, intruders: int, encounters: Sequence[int], avoid: bool
) -> dict[str, Any]:
    """Fly some encounters through the full pipeline, for the time that a decision cycle takes, and compare the tiers.

    Parameters
    ----------
    experiment, seed, intruders, avoid
        As for `fly_block`.
    encounters : sequence of int

    Returns
    -------
    dict
        ``times_s``, list of float: CPU time of every decision cycle (tracking, detection, avoidance), s;
        ``agreed``, int: how many of the encounters have the same rows from both tiers.
    """
    times: list[float] = []
    agreed = 0
    for encounter in encounters:
        full = fly_full(experiment, seed, intruders, encounter, avoid=avoid)
        times += full.cycle_times
        floats, integers, status = fly_block(experiment, seed, intruders, encounter, 1, avoid)
        # An encounter that the fast tier hands over is the full tier's own.
        agreed += bool(status[0] != ek.DONE) or agree(floats[0], integers[0], full.floats, full.integers)
    return {"times_s": times, "agreed": agreed}
