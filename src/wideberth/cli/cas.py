"""`wideberth cas`: helicopters that avoid each other cooperatively, flown from a file."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from wideberth.simulation.fleet_config import FleetConfig


def cas(
    scenario: Annotated[Path, typer.Argument(help="TOML file of a fleet, such as scenarios/cas_figure_4_21.toml.")],
    out: Annotated[Path | None, typer.Option(help="Folder for report.html, its pictures and cas.json.")] = None,
    processes: Annotated[
        bool, typer.Option("--processes", help="A process for each vehicle (2 to 10), messages by UDP on loopback.")
    ] = False,
    speed_up: Annotated[float, typer.Option(min=0.1, max=100.0, help="Times real time, with --processes.")] = 1.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Fly a fleet of helicopters that avoid each other by messages, and say how near they came.

    docs/cas.md explains the controllers and the keys of the file.
    """
    from wideberth.simulation.fleet_config import load_fleet

    fly_and_show(load_fleet(scenario), out, processes=processes, speed_up=speed_up, as_json=as_json)


def fly_and_show(
    config: "FleetConfig",
    out: Path | None,
    *,
    processes: bool = False,
    speed_up: float = 1.0,
    as_json: bool = False,
    report: bool = True,
) -> None:
    """Fly a fleet, print what came of it, and write its report, or only cas.json without `report`.

    The other parameters are those of `cas`.
    """
    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file: give a folder")
    from wideberth.evaluation.cas_report import summary_of, write_cas_report, write_cas_summary
    from wideberth.simulation.fleet import fly_fleet

    if processes:
        from wideberth.live.fleet_processes import fly_as_processes

        run, counts = fly_as_processes(config, speed_up=speed_up)
    else:
        run, counts = fly_fleet(config), {}
    summary = summary_of(config, run) | ({"processes": counts} if processes else {})
    page = None
    if out is not None:
        page = write_cas_report(out, config, run, summary) if report else write_cas_summary(out, summary)
    if as_json:
        typer.echo(json.dumps(summary, indent=2, allow_nan=False))
        return
    from rich.console import Console

    console = Console()
    console.print(_table(summary))
    console.print(summary["verdict"], highlight=False, markup=False, style="bold", soft_wrap=True)
    if processes:
        text = ", ".join(f"{name} {count}" for name, count in counts.items())
        console.print(f"processes: {text}", highlight=False, markup=False, soft_wrap=True)
    if page is not None:
        console.print(f"{'report' if report else 'summary'}: {page}", highlight=False, markup=False, soft_wrap=True)


def _table(summary: dict[str, Any]) -> "Table":
    from rich.table import Table

    table = Table(title=f"{summary['name']} (distances in m)", title_justify="left")
    table.add_column("vehicle", justify="right", no_wrap=True)
    for name in ("controller", "least", "up", "down", "aside", "late", "avoidances"):
        table.add_column(name, justify="left" if name == "controller" else "right", no_wrap=True)
    for k, one in enumerate(summary["vehicles"]):
        table.add_row(
            str(k),
            one["controller"],
            f"{one['least_separation_m']:.3f}",
            *(f"{one[name]:.2f}" for name in ("drift_up_m", "drift_down_m", "aside_m", "late_m")),
            str(one["avoidances"]),
        )
    return table
