"""What differs from run to run of a scenario: its seed, and the keys that its table `montecarlo` draws."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wideberth.config import apply_override, value_at
from wideberth.errors import InputError
from wideberth.simulation.config import VariationConfig


@dataclass(frozen=True, slots=True)
class Draw:
    """One run.

    Attributes
    ----------
    run : int
        From 0.
    seed : int
        Of the scenario, from which all noise comes.
    values : mapping of str to object
        By key.
    """

    run: int
    seed: int
    values: Mapping[str, Any]

    def overrides(self) -> list[str]:
        """Return what ``wideberth run --set`` takes to fly this run, numbers with every digit."""
        return [
            f"{key}={value!r}" if isinstance(value, float) else f"{key}={value}" for key, value in self.values.items()
        ]


def draw(tables: Mapping[str, Any], vary: tuple[VariationConfig, ...], seed: int, run: int) -> Draw:
    """Draw one run; each key has a stream of its own, so that another key more changes none of the others.

    Parameters
    ----------
    tables : mapping
        The scenario's.
    vary : tuple of VariationConfig
    seed : int
        Of the whole study.
    run : int

    Raises
    ------
    InputError
        If a number is to be added to something that is no number.
    """
    own = np.random.SeedSequence([seed, run])
    values: dict[str, Any] = {}
    for place, variation in enumerate(vary):
        value = _value(variation, np.random.default_rng([seed, run, 1 + place]))
        if variation.add:
            before = value_at(tables, variation.key)
            if isinstance(before, bool) or not isinstance(before, int | float):
                raise InputError(f"montecarlo.vary.{place}: {variation.key} is {before!r:.40}, no number to add to")
            value = float(before) + value
        values[variation.key] = value
    return Draw(run, int(own.generate_state(1, np.uint64)[0]) >> 1, values)


def _value(variation: VariationConfig, rng: np.random.Generator) -> Any:
    if variation.distribution == "choice":
        return variation.values[int(rng.integers(len(variation.values)))]
    if variation.distribution == "uniform":
        assert variation.low is not None and variation.high is not None
        return float(rng.uniform(variation.low, variation.high))
    assert variation.sigma is not None
    return float(rng.normal(variation.mean, variation.sigma))


def drawn_tables(tables: Mapping[str, Any], drawn: Draw, *, avoid: bool) -> dict[str, Any]:
    """Return the tables of one run.

    Raises
    ------
    InputError
        If a key leads nowhere.
    """
    own = copy.deepcopy(dict(tables))
    for override in drawn.overrides():
        apply_override(own, override)
    own["seed"], own["avoid"] = drawn.seed, avoid
    return own
