"""What a Monte Carlo run is asked to do, cut into blocks of encounters that can be run apart."""

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.experiment import Experiment
from wideberth.named_files import find_named

ENCOUNTERS_MAX = 10**9  # for each number of intruders: the names of shards have nine digits
INTRUDERS_MAX = 64
_SHARD = re.compile(r"([0-9]{1,9})/([0-9]{1,9})")


@dataclass(frozen=True, slots=True)
class Block:
    """Encounters `first` to ``first + count - 1`` with one number of intruders: one shard.

    Attributes
    ----------
    index : int
        Position in the plan.
    intruders, first, count : int
    """

    index: int
    intruders: int
    first: int
    count: int

    @property
    def rows(self) -> int:
        """Rows of its shard: one for each intruder of each encounter."""
        return self.intruders * self.count


@dataclass(frozen=True, slots=True)
class Plan:
    """All blocks of a run; they are worked out when asked for, so that a plan of any size takes no memory.

    Attributes
    ----------
    encounters : int
        For each number of intruders.
    intruders : tuple of int
        Numbers of intruders, rising.
    block_rows : int
        Rows of a block at most, so that blocks take about the same time whatever the number of intruders.
    """

    encounters: int
    intruders: tuple[int, ...]
    block_rows: int

    def block_encounters(self, intruders: int) -> int:
        """Return the number of encounters in a full block with this number of intruders."""
        return max(1, self.block_rows // intruders)

    def __len__(self) -> int:
        return sum(-(-self.encounters // self.block_encounters(k)) for k in self.intruders)

    def __iter__(self) -> Iterator[Block]:
        index = 0
        for intruders in self.intruders:
            size = self.block_encounters(intruders)
            for first in range(0, self.encounters, size):
                yield Block(index, intruders, first, min(size, self.encounters - first))
                index += 1


@dataclass(frozen=True, slots=True)
class Part:
    """One of several processes that share a plan: it runs every `of`-th block.

    Attributes
    ----------
    number : int
        From 1.
    of : int
    """

    number: int = 1
    of: int = 1

    def __contains__(self, block: Block) -> bool:
        return block.index % self.of == self.number - 1

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"


def parse_part(text: str) -> Part:
    """Return the part that ``i/N`` names, such as ``3/8``.

    Raises
    ------
    InputError
        If it is not of that form, or i is not from 1 to N.
    """
    match = _SHARD.fullmatch(text.strip())
    if match is None:
        raise InputError(f"--shard {text}: write i/N, such as 3/8 for the third of eight")
    part = Part(int(match[1]), int(match[2]))
    if not 1 <= part.number <= part.of:
        raise InputError(f"--shard {text}: the first number goes from 1 to {max(part.of, 1)}")
    return part


def find_experiment(given: str, folder: Path = Path("experiments")) -> Path:
    """Return the file of an experiment: a path, or the bare name of a file in `folder`.

    Raises
    ------
    InputError
        If there is no such file.
    """
    return find_named(given, folder, "experiment")


def check_request(experiment: Experiment, encounters: int | None, intruders: int | None) -> tuple[int, tuple[int, ...]]:
    """Return how many encounters are to be run, and with which numbers of intruders.

    Parameters
    ----------
    experiment : Experiment
    encounters, intruders : int or None
        As asked for; None: those of the experiment.

    Returns
    -------
    encounters : int
        For each number of intruders.
    intruders : tuple of int
        Rising.

    Raises
    ------
    InputError
        If a number is not positive, or there are more intruders than points for them to start at.
    """
    count = experiment.encounters if encounters is None else encounters
    if count < 1:
        raise InputError(f"--encounters {count}: give at least 1")
    if count > ENCOUNTERS_MAX:
        raise InputError(f"--encounters {count}: at most {ENCOUNTERS_MAX}")
    if intruders is None:
        return count, tuple(sorted(experiment.encounter.intruders))
    if intruders < 1:
        raise InputError(f"--intruders {intruders}: give at least 1")
    points = experiment.encounter.points
    if intruders > points:
        raise InputError(f"--intruders {intruders}: more than the {points} points of {experiment.name} to start at")
    if intruders > INTRUDERS_MAX:
        raise InputError(f"--intruders {intruders}: at most {INTRUDERS_MAX}")
    return count, (intruders,)


def even_sample(encounters: int, wanted: int) -> list[int]:
    """Return up to `wanted` encounter numbers spread evenly over ``range(encounters)``."""
    count = min(encounters, wanted)
    return [i * encounters // count for i in range(count)]


def choose_block_rows(seconds_per_row: float, total_rows: int, block_s: float = 2.0) -> int:
    """Return a block size: about `block_s` of work, but enough blocks for many workers and a smooth progress bar.

    Parameters
    ----------
    seconds_per_row : float
        As measured, CPU s.
    total_rows : int
        Of the whole run.
    block_s : float
        s.

    Returns
    -------
    int
        Rows, 1, 2 or 5 times a power of ten; at most 20,000, which bounds the memory of a block.
    """
    wanted = min(block_s / max(seconds_per_row, 1e-9), total_rows / 32, 20_000.0)
    size = 1
    for step in _rising_sizes():
        if step > wanted:
            break
        size = step
    return size


def _rising_sizes() -> Iterator[int]:
    power = 1
    while True:
        for factor in (1, 2, 5):
            yield factor * power
        power *= 10


def pieces(count: int, parts: int) -> list[tuple[int, int]]:
    """Return `count` things cut into at most `parts` pieces of nearly equal size, as (offset, size)."""
    edges = [i * count // parts for i in range(parts + 1)]
    return [(a, b - a) for a, b in itertools.pairwise(edges) if b > a]
