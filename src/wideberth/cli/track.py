"""`wideberth track`: a multi-target tracker over a file of radar plots, scored where the file has the truth."""

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console
    from rich.table import Table

_BAR_AFTER_S = 2.0


def track(
    plots: Annotated[
        Path | None, typer.Argument(help="File of radar plots (NPZ), with or without the truth.", show_default=False)
    ] = None,
    tracker: Annotated[
        str, typer.Option(help="Name of the tracker (see --list), or package.module:Class.")
    ] = "wideberth",
    seed: Annotated[int | None, typer.Option(help="One run of the file, instead of all.")] = None,
    out: Annotated[Path, typer.Option(help="Parquet file to write.")] = Path("tracks.parquet"),
    report: Annotated[
        Path | None, typer.Option(help="Folder for report.html and its pictures.", show_default=False)
    ] = None,
    elevation_half_width: Annotated[
        str | None,
        typer.Option(
            help="How far the radar sees up and down; without it 90deg, on board 60deg, or as the file says.",
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="List the trackers and stop.")] = False,
) -> None:
    """Track the aircraft in a file of radar plots, write one row per confirmed track and scan, and score the tracks.

    For recorded ADS-B traffic there is `wideberth tracks`.
    """
    if list_:
        _list()
        return
    if plots is None:
        raise InputError("give a file of radar plots (NPZ), or --list to see the trackers")
    if not out.parent.is_dir():
        raise InputError(f"folder '{out.parent}' does not exist: create it, or give another --out")
    if out.is_dir():
        raise InputError(f"--out '{out}' is a folder: give a file name")
    import math

    from rich.console import Console

    from wideberth.evaluation.plot_run import load_tracker, run_file, summary_of
    from wideberth.evaluation.track_file import write_tracks
    from wideberth.sensors.radar.plot_file import read_plot_file

    elevation = None
    if elevation_half_width is not None:
        elevation = (math.pi, quantity("--elevation-half-width", elevation_half_width, "angle"))
    make = load_tracker(tracker)
    file = read_plot_file(plots, elevation)
    seeds = file.seeds() if seed is None else (seed,)
    if not seeds:
        raise InputError(f"{file.name} has no plots")
    with _bar(f"{tracker} on {file.name}", len(seeds), Console(stderr=True)) as done:
        runs = run_file(file, make, seeds, done)
    rows = write_tracks(out, file, runs)
    summary = {**summary_of(file, tracker, runs), "rows": rows}
    page = None
    if report is not None:
        from wideberth.evaluation.tracking_report import write_tracking_report

        page = write_tracking_report(report, file, runs, summary)
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
        return
    console = Console()
    console.print(_table(summary))
    if summary["metrics"] is None:
        _say(console, f"{file.name} has no truth (truth_pos): nothing to score the tracks by")
    _say(console, f"{rows} rows written to {out}")
    if page is not None:
        _say(console, f"report: {page}")


def _list() -> None:
    from wideberth.evaluation.plot_run import load_tracker
    from wideberth.tracking import PLOT_TRACKERS

    for k, name in enumerate(PLOT_TRACKERS):
        try:
            words = (type(load_tracker(name)()).__doc__ or "").strip().splitlines()[0]
        except InputError as error:
            words = str(error)
        typer.echo(f"{name}{' (default)' if k == 0 else ''}: {words}")


@contextmanager
def _bar(name: str, total: int, console: "Console") -> "Iterator[Callable[[int], None]]":
    """Show how many runs are done, from two seconds on, and also while the first one compiles."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    progress = Progress(*columns, console=console, transient=True)
    task = progress.add_task(name, total=total)
    timer = threading.Timer(_BAR_AFTER_S, progress.start)
    if console.is_interactive:
        timer.start()
    try:
        yield lambda done: progress.update(task, completed=done)
    finally:
        timer.cancel()
        if timer.is_alive():
            timer.join()
        progress.stop()


def _table(summary: Mapping[str, Any]) -> "Table":
    """Return the numbers of all runs, and where there are several those of the worst of them."""
    from rich.table import Table

    from wideberth.evaluation.tracking_table import metric_rows

    seeds = summary["seeds"]
    title = f"{summary['tracker']} on {summary['file']}, "
    table = Table(title=title + (f"{len(seeds)} seeds" if len(seeds) > 1 else f"seed {seeds[0]}"), title_justify="left")
    table.add_column("what")
    table.add_column("all seeds" if len(seeds) > 1 else "value", justify="right")
    if len(seeds) > 1:
        table.add_column("worst seed", justify="right")
    table.add_column("unit")
    for row in metric_rows(summary):
        table.add_row(row.name, row.value, *([row.worst] if len(seeds) > 1 else []), row.unit)
    table.add_section()
    for name, count in {"rows written": summary["rows"], **summary["counters"]}.items():
        table.add_row(name, f"{count:,}", *([""] if len(seeds) > 1 else []), "")
    return table


def _say(console: "Console", text: str) -> None:
    console.print(text, highlight=False, markup=False, soft_wrap=True)
