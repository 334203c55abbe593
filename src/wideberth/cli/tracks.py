"""`wideberth tracks`: what the tracker makes of a recording, as a table of one row per track and second."""

import math
import os
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from wideberth.frames import LocalFrame
    from wideberth.sensors.adsb.report import AdsbReport
    from wideberth.sensors.adsb.sources import FileSource
    from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
    from wideberth.types import Track

# Name, type, unit, meaning of each column.
COLUMNS = (
    ("time_s", "float64", "s", "Unix time; from 0 where the recording has only a counter"),
    ("icao", "string", "", "address; '#2' marks a second aircraft with the same, '~' one that is not an ICAO address"),
    ("callsign", "string", "", "as broadcast, null where unknown"),
    ("lat_deg", "float64", "deg", "WGS84 latitude"),
    ("lon_deg", "float64", "deg", "WGS84 longitude"),
    (
        "altitude_m",
        "float64",
        "m",
        "pressure altitude; geometric where the aircraft gives no other; null where unknown",
    ),
    ("vnorth_mps", "float64", "m/s", "velocity over ground towards true north at the aircraft"),
    ("veast_mps", "float64", "m/s", "velocity over ground towards east at the aircraft"),
    ("vup_mps", "float64", "m/s", "climb rate; null where unknown"),
    ("sigma_h_m", "float64", "m", "standard deviation of a horizontal axis (root mean square of both)"),
    ("sigma_v_m", "float64", "m", "standard deviation of the altitude"),
    ("status", "string", "", "tentative, confirmed, or coasting (no recent measurement)"),
)
_ROWS_AT_ONCE = 20_000
_EVERYWHERE = 2.1e7  # m, half round the Earth


def tracks(
    source: Annotated[str, typer.Argument(help="File with recorded traffic (gzip or not), or - for standard input.")],
    format_: Annotated[
        str,
        typer.Option(
            "--format",
            help="Format: trajectories, frames, beast, beast-gps, beast-12mhz, avr, avr-untimed, sbs, uat, gdl90.",
        ),
    ] = "auto",
    out: Annotated[Path, typer.Option(help="Parquet file to write.")] = Path("tracks.parquet"),
) -> None:
    """Track the aircraft of a recording of traffic (ADS-B, UAT, GDL90) and write one row per track and second.

    For files of radar plots there is `wideberth track`.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from wideberth.errors import InputError
    from wideberth.sensors.adsb.sources import FileSource, describe, open_traffic
    from wideberth.tracking.adsb_kalman import AdsbKalmanTracker

    if not out.parent.is_dir():
        raise InputError(f"folder '{out.parent}' does not exist: create it, or give another --out")
    if out.is_dir():
        raise InputError(f"--out '{out}' is a folder: give a file name")
    if "://" in source:
        raise InputError(f"'{source}' is a live receiver: tracks reads recordings; use run for live traffic")
    console = Console()
    bars = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*bars, console=console, transient=True) as progress:
        task = progress.add_task("reading", total=None)
        traffic = open_traffic(source, format_)
        assert isinstance(traffic, FileSource)
        reports = sorted(traffic.poll(math.inf), key=lambda report: report.t)
        located = [report for report in reports if not math.isnan(report.latitude)]
        if not located:
            raise InputError(f"no aircraft in '{source}' gives a position ({describe(traffic.counters)})")
        frame = _frame(located)
        tracker = AdsbKalmanTracker(AdsbKalmanTracker.Config())
        end = reports[-1].t
        progress.update(task, description="tracking", total=end - reports[0].t, completed=0)
        partial = out.with_name(out.name + ".partial")
        seen: set[str] = set()
        rows = 0
        try:
            with _Writer(partial, frame) as writer:
                for t, found in _tracked(reports, frame, tracker):
                    rows += len(found)
                    seen.update(track.id for track in found)
                    writer.write(found)
                    progress.update(task, completed=min(t, end) - reports[0].t)
            os.replace(partial, out)
        finally:
            partial.unlink(missing_ok=True)
    results = {
        "aircraft heard": len(traffic.addresses),
        "aircraft with positions": len({report.address for report in located}),
        "positions given to the tracker": len(located),
        "tracks": len(seen),
        "rows written": rows,
    }
    console.print(_table(traffic, results, tracker.counters, traffic.health(end).rejects))
    console.print(f"{rows} rows written to {out}", highlight=False, markup=False)


def _frame(located: "Sequence[AdsbReport]") -> "LocalFrame":
    """Return the local frame about the middle of the traffic, in longitude across the date line too."""
    import numpy as np

    from wideberth.frames import LocalFrame

    latitudes = np.array([report.latitude for report in located])
    longitudes = np.array([report.longitude for report in located])
    middle = float(np.arctan2(np.sin(longitudes).mean(), np.cos(longitudes).mean()))
    return LocalFrame(float(np.median(latitudes)), middle)


def _tracked(
    reports: "Sequence[AdsbReport]", frame: "LocalFrame", tracker: "AdsbKalmanTracker"
) -> "Iterator[tuple[float, tuple[Track, ...]]]":
    """Yield each whole second and the tracks then; stretches without any aircraft are skipped."""
    from wideberth.sensors.adsb.receiver import AdsbReceiver
    from wideberth.sensors.adsb.report_list import ReportList

    source = ReportList("recording", reports, {}, {})
    receiver = AdsbReceiver(AdsbReceiver.Config(range_max_m=_EVERYWHERE), source, frame)
    times = [report.t for report in reports]
    t = float(math.ceil(times[0]))
    while True:
        found, _ = tracker.step(t, [receiver.sense(t)])
        if found:
            yield t, found
        if source.exhausted:
            return
        t += 1.0
        if not found:
            t = max(t, float(math.ceil(times[bisect_right(times, t - 1.0)])))


def _columns(found: "Sequence[Track]", frame: "LocalFrame") -> dict[str, list[Any]]:
    import numpy as np

    positions = np.array([track.position for track in found])
    latitudes, longitudes, altitudes = frame.to_geodetic(positions)
    velocities = frame.velocity_from_ned(latitudes, longitudes, np.array([track.velocity for track in found]))
    variances = np.array([np.diag(track.covariance)[:3] for track in found])
    numbers: dict[str, Any] = {
        "lat_deg": np.degrees(latitudes),
        "lon_deg": np.degrees(longitudes),
        "altitude_m": altitudes,
        "vnorth_mps": velocities[:, 0],
        "veast_mps": velocities[:, 1],
        "vup_mps": -velocities[:, 2],
        "sigma_h_m": np.sqrt((variances[:, 0] + variances[:, 1]) / 2),
        "sigma_v_m": np.sqrt(variances[:, 2]),
    }
    columns: dict[str, list[Any]] = {
        "time_s": [track.t for track in found],
        "icao": [track.id for track in found],
        "callsign": [track.info.callsign for track in found],
        "status": [track.status.name.lower() for track in found],
    }
    for name, values in numbers.items():
        columns[name] = [value if math.isfinite(value) else None for value in values.tolist()]
    return columns


class _Writer:
    """Parquet file written in row groups; unit and meaning of each column stand in the column's metadata."""

    def __init__(self, path: Path, frame: "LocalFrame") -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = [
            pa.field(
                name, pa.string() if kind == "string" else pa.float64(), metadata={"unit": unit, "meaning": meaning}
            )
            for name, kind, unit, meaning in COLUMNS
        ]
        self._schema = pa.schema(fields, metadata={"content": "one row per track and second, by wideberth tracks"})
        self._writer = pq.ParquetWriter(path, self._schema)
        self._frame = frame
        self._waiting: list[Track] = []

    def __enter__(self) -> "_Writer":
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        self._writer.close()

    def write(self, found: "Sequence[Track]") -> None:
        self._waiting += found
        if len(self._waiting) >= _ROWS_AT_ONCE:
            self._flush()

    def _flush(self) -> None:
        import pyarrow as pa

        if self._waiting:
            self._writer.write_table(pa.table(_columns(self._waiting, self._frame), schema=self._schema))
            self._waiting = []


def _table(
    traffic: "FileSource", results: Mapping[str, int], tracker: Mapping[str, int], rejects: Mapping[str, int]
) -> "Table":
    from rich.table import Table

    table = Table(title=f"{traffic.name} ({traffic.format})", title_justify="left")
    table.add_column("what")
    table.add_column("count", justify="right")
    for name, count in traffic.counters.items():
        if name not in rejects:
            table.add_row(name, str(count))
    table.add_section()
    for name, count in results.items():
        table.add_row(name, str(count))
    table.add_section()
    for name, count in tracker.items():
        table.add_row(f"tracker: {name}", str(count))
    table.add_section()
    for name, count in (rejects or {"nothing": 0}).items():
        table.add_row(f"left out: {name}", str(count))
    return table
