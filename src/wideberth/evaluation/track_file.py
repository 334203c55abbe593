"""Tracks of radar plots as a Parquet file: one row for each confirmed track and scan."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wideberth.evaluation.montecarlo.atomic_files import replacing
from wideberth.evaluation.plot_run import SeedRun
from wideberth.sensors.radar.plot_file import PlotFile

# Name, type, unit, meaning of each column.
COLUMNS = (
    ("seed", pa.int64(), "", "run, as in the file of plots"),
    ("scan", pa.int32(), "", "scan, as in the file of plots, from 0"),
    ("time", pa.float64(), "s", "time of the scan"),
    ("track_id", pa.int64(), "", "the same number for the same track of a run"),
    ("north_m", pa.float64(), "m", "position"),
    ("east_m", pa.float64(), "m", "position"),
    ("up_m", pa.float64(), "m", "position"),
    ("vnorth_mps", pa.float64(), "m/s", "velocity"),
    ("veast_mps", pa.float64(), "m/s", "velocity"),
    ("vup_mps", pa.float64(), "m/s", "velocity"),
    ("var_north_m2", pa.float64(), "m2", "variance of the position"),
    ("var_east_m2", pa.float64(), "m2", "variance of the position"),
    ("var_up_m2", pa.float64(), "m2", "variance of the position"),
    ("is_ownship", pa.bool_(), "", "whether the track is taken for the ownship's"),
)
_NED_NEU = np.array([1.0, 1.0, -1.0])


def write_tracks(path: Path, file: PlotFile, runs: Sequence[SeedRun]) -> int:
    """Write the tracks of some runs, whole or not at all.

    Parameters
    ----------
    path : Path
    file : PlotFile
        That they were made from.
    runs : sequence of SeedRun

    Returns
    -------
    int
        How many rows there are.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    fields = [pa.field(name, kind, metadata={"unit": unit, "meaning": what}) for name, kind, unit, what in COLUMNS]
    schema = pa.schema(fields, metadata={"content": "one row per confirmed track and scan, by wideberth track"})
    rows = 0
    with replacing(path) as out, pq.ParquetWriter(out, schema) as writer:
        for run in runs:
            table = run.table
            position, velocity = table.x[:, :3] * _NED_NEU, table.x[:, 3:6] * _NED_NEU
            variance = np.diagonal(table.P, axis1=1, axis2=2)[:, :3]
            numbers = np.concatenate([position, velocity, variance], axis=1)
            columns = [
                np.full(len(table), run.seed),
                table.scan,
                file.t[table.scan],
                table.track_id,
                *numbers.T,
                table.is_ownship,
            ]
            writer.write_table(
                pa.table([pa.array(c, kind) for c, (_, kind, _, _) in zip(columns, COLUMNS, strict=True)], schema)
            )
            rows += len(table)
    return rows
