"""The `wideberth` command: it only knows its subcommands; what they need is imported when they run."""

import importlib
from typing import Annotated

import typer

from wideberth.cli.errors import guarded

# Each is a module of this package with a function of the same name; the command has dashes for underscores.
COMMANDS = (
    "run",
    "fly",
    "replay",
    "compare",
    "movie",
    "track",
    "tracks",
    "missions",
    "montecarlo",
    "config",
    "tlos",
    "range",
    "size",
    "stability",
    "cas",
    "send_radar",
    "send_traffic",
    "simulate_vehicle",
    "warmup",
)

# Each is a module of this package with its own `app` of subcommands.
GROUPS = ("radar",)

app = typer.Typer(
    name="wideberth",
    help="Detect and avoid for small drones, from raw sensor data to the waypoints an autopilot flies.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"wideberth {version('wideberth')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


for _name in COMMANDS:
    app.command(_name.replace("_", "-"))(guarded(getattr(importlib.import_module(f"wideberth.cli.{_name}"), _name)))


for _name in GROUPS:
    app.add_typer(importlib.import_module(f"wideberth.cli.{_name}").app, name=_name)


def main() -> None:
    """Run the command line."""
    app(prog_name="wideberth")
