"""`wideberth movie`: a recording as a movie."""

from pathlib import Path
from typing import Annotated

import typer


def movie(
    recording: Annotated[Path, typer.Argument(help="A recording.mcap, whole or torn.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option(
            help="File, .mp4 (needs the extra wideberth[movie]) or .gif; without it a .gif beside the recording.",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[float, typer.Option(help="Recorded seconds in a second of the movie.")] = 10.0,
    frame_rate: Annotated[float, typer.Option(help="Pictures a second of the movie.")] = 20.0,
    from_: Annotated[
        float | None, typer.Option("--from", metavar="SECONDS", help="Begin so long after the recording's start.")
    ] = None,
    to: Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="End so long after its start.")] = None,
) -> None:
    """Draw a recording as a movie: the map with everybody's recent path, heights, alerts and decisions."""
    from rich.console import Console
    from rich.progress import Progress

    from wideberth.evaluation.movie import MovieSettings, write_movie
    from wideberth.recording import read_recording

    settings = MovieSettings(speed, frame_rate, from_, to)
    recorded = read_recording(recording)
    target = recording.with_suffix(".gif") if out is None else out
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("pictures", total=None)
        count = write_movie(
            target, recorded, settings, lambda done, total: bar.update(task, completed=done, total=total)
        )
    console = Console(highlight=False, markup=False, soft_wrap=True)
    if not recorded.complete:
        console.print(f"the recording is not whole: {recorded.message}")
    console.print(f"{count} pictures, {count / frame_rate:.1f} s: {target}")
