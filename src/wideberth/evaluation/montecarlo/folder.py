"""The folder of a Monte Carlo run: its manifest, and one Parquet shard for each block.

A shard appears in one piece or not at all, and says itself what it belongs to. So a run can go on however it ended, and
nothing that is not of this run is ever counted or overwritten.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.atomic_files import cannot_write, is_temporary, left_over, replacing
from wideberth.evaluation.montecarlo.manifest import MANIFEST, Manifest, create_manifest, read_manifest
from wideberth.evaluation.montecarlo.plan import Block, Part
from wideberth.evaluation.montecarlo.rows import SCHEMA

SUMMARY = "summary.json"
_KEY = b"wideberth.montecarlo"
_KEPT = "what is done is kept: go on with --resume"


def shard_name(block: Block) -> str:
    """Return the file name of a block's shard; names sort as blocks do."""
    return f"rows_{block.intruders:02d}_{block.first:09d}.parquet"


class RunFolder:
    """A run's folder that has been found fit to be written into (see `open_folder`).

    Parameters
    ----------
    path : Path
    manifest : Manifest
    """

    def __init__(self, path: Path, manifest: Manifest) -> None:
        self.path = path
        self.manifest = manifest
        self.plan = manifest.plan
        self._left_over = left_over(path)

    def shard(self, block: Block) -> Path:
        """Return the path of a block's shard."""
        return self.path / shard_name(block)

    def present(self) -> set[str]:
        """Return the names of the shards that are there.

        Raises
        ------
        InputError
            If there is one that does not belong to this run.
        """
        found = {name for name in os.listdir(self.path) if name.endswith(".parquet")}
        foreign = found.difference(shard_name(block) for block in self.plan) if found else found
        if foreign:
            raise InputError(f"{self.path / min(foreign)}: not a shard of this run; move it away")
        return found

    def read(self, block: Block) -> pa.Table:
        """Return the rows of a block, after checking that its shard is whole and belongs here.

        Raises
        ------
        InputError
            If it is damaged, or of another run.
        """
        path = self.shard(block)
        advice = "move it away and go on with --resume"
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                metadata = (file.schema_arrow.metadata or {}).get(_KEY)
                said = None if metadata is None else json.loads(metadata)
                table = file.read().replace_schema_metadata(None)
        except FileNotFoundError:
            raise InputError(f"{path}: has gone; go on with --resume") from None
        except (pa.ArrowException, OSError, ValueError):
            raise InputError(f"{path}: damaged; {advice}") from None
        if not isinstance(said, dict):
            raise InputError(f"{path}: not a shard of this run; {advice}")
        expected = self.manifest.shard_metadata(block)
        odd = [key for key, value in expected.items() if said.get(key) != value]
        if odd:
            raise InputError(f"{path}: a shard of another run (its {' and '.join(odd)} differ); {advice}")
        if not _fits(table, block):
            raise InputError(f"{path}: its rows are not those of its block; {advice}")
        return table

    def write(self, block: Block, table: pa.Table) -> None:
        """Write the shard of a block.

        Raises
        ------
        InputError
            If it cannot be written, because the disk is full for one; nothing is left of it then.
        ValueError
            If the rows are not those of the block.
        """
        if not _fits(table, block):
            raise ValueError(f"{block}: other rows than its own came back")
        metadata = json.dumps(self.manifest.shard_metadata(block), sort_keys=True)
        path = self.shard(block)
        with replacing(path, _KEPT) as file:
            described = table.replace_schema_metadata({_KEY: metadata.encode()})
            pq.write_table(described, file, compression="zstd", write_page_checksum=True)
        self._tidy(path.name)

    def tables(self) -> Iterator[pa.Table]:
        """Yield the rows of each block in order: sorted by (intruders, encounter, intruder), one block at a time."""
        for block in self.plan:
            yield self.read(block)

    def write_summary(self, summary: Mapping[str, Any]) -> Path:
        """Write summary.json, and return its path.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        path = self.path / SUMMARY
        text = json.dumps(summary, indent=2, allow_nan=False) + "\n"
        with replacing(path, _KEPT) as file:
            file.write(text.encode())
        return path

    def tidy(self, present: set[str]) -> None:
        """Remove what killed runs have left of shards that are there in full."""
        for name in present:
            self._tidy(name)

    def _tidy(self, name: str) -> None:
        for path in self._left_over.pop(name, ()):
            path.unlink(missing_ok=True)


def existing_manifest(path: Path, resume: bool, shared: bool) -> Manifest | None:
    """Look at a folder before a run, without writing.

    Parameters
    ----------
    path : Path
        It need not exist.
    resume : bool
        Whether a run that is there is to go on.
    shared : bool
        Whether other processes may have started the same run there.

    Returns
    -------
    Manifest or None
        Of the run that is there; None if there is none.

    Raises
    ------
    InputError
        If the folder is a file, holds something else, or holds a run that is not to go on.
    """
    if not path.exists():
        return None
    if not path.is_dir():
        raise InputError(f"{path} is a file: give a folder for --out")
    names = [name for name in os.listdir(path) if not is_temporary(name)]
    if not names:
        return None
    if not (path / MANIFEST).exists():  # asked after the listing: another process may have begun just now
        raise InputError(f"{path} is not empty and holds no {MANIFEST}: give another folder")
    if not (resume or shared):
        raise InputError(f"{path} holds a run already: go on with it by --resume, or give another folder")
    return read_manifest(path)


def open_folder(path: Path, wanted: Manifest, part: Part, resume: bool) -> RunFolder:
    """Make a folder ready for a run to begin or to go on.

    Parameters
    ----------
    path : Path
        Made if it does not exist.
    wanted : Manifest
        What the run is asked to be; where the folder has a block size already, that one holds.
    part : Part
    resume : bool

    Returns
    -------
    RunFolder

    Raises
    ------
    InputError
        If the folder holds something else, a run with other settings or by other code, shards that are not of this run,
        or (without `resume`) blocks of this part.
    """
    shared = part.of > 1
    found = existing_manifest(path, resume, shared)
    if found is None:
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(path, error) from error
        if not create_manifest(path, wanted):
            found = existing_manifest(path, resume, shared)
    found = found or wanted
    found.check_same(wanted, path)
    folder = RunFolder(path, found)
    present = folder.present()
    if not resume and any(block in part and shard_name(block) in present for block in folder.plan):
        raise InputError(f"{path} holds blocks of part {part}: go on with it by --resume, or give another folder")
    folder.tidy(present)
    return folder


def read_rows(out: Path) -> pa.Table:
    """Return all rows of a run so far, sorted by (intruders, encounter, intruder).

    Parameters
    ----------
    out : Path
        Folder of the run.

    Returns
    -------
    pyarrow.Table
        With the columns of `rows.SCHEMA`; all at once, so not for runs that do not fit into memory.

    Raises
    ------
    InputError
        If the folder holds no run, or a shard is damaged or foreign.
    """
    folder = RunFolder(out, read_manifest(out))
    present = folder.present()
    tables = [folder.read(block) for block in folder.plan if shard_name(block) in present]
    return pa.concat_tables(tables) if tables else SCHEMA.empty_table()


def _fits(table: pa.Table, block: Block) -> bool:
    """Return whether a table has exactly the rows of a block, in order."""
    if not table.schema.equals(SCHEMA) or table.num_rows != block.rows:
        return False
    encounters = np.repeat(np.arange(block.first, block.first + block.count), block.intruders)
    intruder = table.column("intruder").to_numpy().reshape(block.count, block.intruders)
    return bool(
        np.array_equal(table.column("encounter").to_numpy(), encounters)
        and np.all(table.column("intruders").to_numpy() == block.intruders)
        and np.all(intruder == intruder[0, 0] + np.arange(block.intruders))  # numbered without gaps
    )
