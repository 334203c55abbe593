"""How long each block of a Monte Carlo run took: files of their own, so that shards hold nothing that varies."""

import json
import os
from pathlib import Path
from typing import Any, BinaryIO

from wideberth.evaluation.montecarlo.atomic_files import cannot_write
from wideberth.evaluation.montecarlo.plan import Block, Part


class TimingsFile:
    """A line of JSON for each block, only ever appended to; one file for each part of a run.

    Parameters
    ----------
    folder : Path
    part : Part
    """

    def __init__(self, folder: Path, part: Part) -> None:
        self.path = folder / (f"timings_{part.number}_of_{part.of}.jsonl" if part.of > 1 else "timings.jsonl")

    def append(self, block: Block, cpu_s: float, wall_s: float, worker: str) -> None:
        """Add the line of a block.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        entry = {
            "intruders": block.intruders,
            "first": block.first,
            "count": block.count,
            "cpu_s": round(cpu_s, 6),
            "wall_s": round(wall_s, 6),
            "worker": worker,
        }
        line = json.dumps(entry).encode() + b"\n"
        try:
            with self.path.open("ab+") as file:
                if _is_torn(file):
                    line = b"\n" + line
                file.write(line)
        except OSError as error:
            raise cannot_write(self.path, error, "go on with --resume") from error


def read_timings(folder: Path) -> dict[int, dict[str, float]]:
    """Return how long a run took, over all its parts.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    dict
        For each number of intruders the encounters with a timing (one that was killed between shard and timing has
        none) as ``encounters``, their ``cpu_s`` and the ``wall_s`` summed over workers. Torn lines are passed over, and
        of a block that was run twice the last counts.
    """
    blocks: dict[tuple[int, int], tuple[int, float, float]] = {}
    for path in sorted(folder.glob("timings*.jsonl")):
        with path.open("rb") as file:
            for line in file:
                try:
                    entry: Any = json.loads(line)
                    blocks[int(entry["intruders"]), int(entry["first"])] = (
                        int(entry["count"]),
                        float(entry["cpu_s"]),
                        float(entry["wall_s"]),
                    )
                except (ValueError, TypeError, KeyError):
                    continue
    totals: dict[int, dict[str, float]] = {}
    for (intruders, _), (count, cpu_s, wall_s) in sorted(blocks.items()):
        total = totals.setdefault(intruders, {"encounters": 0, "cpu_s": 0.0, "wall_s": 0.0})
        total["encounters"] += count
        total["cpu_s"] += cpu_s
        total["wall_s"] += wall_s
    return totals


def _is_torn(file: BinaryIO) -> bool:
    """Return whether the last line has no end, because its process was killed."""
    if file.seek(0, os.SEEK_END) == 0:
        return False
    file.seek(-1, os.SEEK_END)
    return file.read(1) != b"\n"
