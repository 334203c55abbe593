"""`wideberth fly`: the corridor in the air, with an autopilot and real inputs."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

import typer

from wideberth.errors import InputError

_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def fly(
    config: Annotated[
        Path,
        typer.Argument(help="Scenario file (TOML) with the tables autopilot and inputs.", show_default=False),
    ],
    command: Annotated[
        bool,
        typer.Option(
            "--command", help="Command the vehicle. Without it everything is shown and told, and nothing flown."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder for recording.mcap and summary.json; by default a new one in flights/."
        ),
    ] = None,
    json_: Annotated[
        bool, typer.Option("--json", help="Write the status to standard output, an object a second.")
    ] = False,
    duration: Annotated[
        float | None, typer.Option("--duration", metavar="S", help="End after so many seconds; by default never.")
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Set one key, such as avoidance.buffer=1.2; repeatable.")
    ] = None,
) -> None:
    """Fly: detect traffic and, with --command, avoid it.

    SIGTERM and Ctrl-C give control back to the autopilot's own mission, and end it.
    """
    import asyncio
    import os
    import sys

    if duration is not None and not duration > 0.0:
        raise InputError(f"--duration {duration:g}: give a positive number of seconds")
    for name in _THREADS:
        # A second thread would take its time from the loop's core.
        os.environ[name] = "1"

    from wideberth.live.session import prepare, read_flight, serve
    from wideberth.live.status_writer import StatusWriter

    folder = out if out is not None else Path("flights") / datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    how: Literal["json", "screen", "lines"] = "json" if json_ else "screen" if sys.stderr.isatty() else "lines"
    with StatusWriter(how) as writer:
        flight = prepare(read_flight(config, set_ or (), command=command), folder, writer.show)
        summary = asyncio.run(serve(flight, duration))
    live = summary["live"]
    typer.echo(
        f"{summary['steps']} steps, {live['missed_steps']} missed; summary: {folder / 'summary.json'};"
        f" recording: {folder / live['recording'] if live['recording'] else 'none, as there was no step'}",
        err=True,
    )
    if writer.stuck:
        # Nobody reads standard output: to flush it would wait for ever.
        os._exit(0)
