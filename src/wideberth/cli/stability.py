"""`wideberth stability`: how much communication delay two vehicles that avoid each other tolerate."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

TIMES = ("0.5s", "1s", "2s", "5s", "10s", "20s")


def stability(
    time: Annotated[
        list[str] | None, typer.Option("--time", metavar="T", help="Time to the closest point, such as 5s; repeatable.")
    ] = None,
    lag: Annotated[str, typer.Option(help="Lag of the vertical velocity behind its command.")] = "0.4s",
    pade: Annotated[
        list[int] | None, typer.Option(help="Order of a Padé approximation to show beside the exact limit; repeatable.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for report.html and its pictures.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the largest communication delay at which the vertical avoidance loop is stable.

    The report draws the gain along a pass, the eigenvalues of each law, and the delay against the time to the closest
    point (CAS thesis, figures 5.6 and 5.10, tables 5.1 to 5.3).
    """
    from wideberth.analysis.stability import LAWS, largest_stable_delay

    tau = quantity("--lag", lag, "time")
    times = [quantity("--time", text, "time") for text in time or TIMES]
    orders: list[int | None] = [*(pade or ()), None]
    rows = []
    try:
        for t in times:
            delays = {
                law: {
                    "exact" if order is None else f"pade_{order}": float(largest_stable_delay(t, tau, law, order))
                    for order in orders
                }
                for law in LAWS[:3]
            }
            rows.append({"t_star_s": t, "lag_s": tau, "largest_stable_delay_s": delays})
    except ValueError as error:
        raise InputError(str(error)) from None
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
    else:
        from rich.console import Console

        Console().print(_table(rows, tau))
    if out is not None:
        from wideberth.evaluation.stability_report import write_stability_report

        if out.exists() and not out.is_dir():
            raise InputError(f"--out {out} is a file: give a folder")
        typer.echo(f"report: {write_stability_report(out, tau)}", err=as_json)


def _table(rows: list[dict[str, object]], tau: float) -> "Table":
    from rich.table import Table

    from wideberth.evaluation.stability_report import LAW_WORDS

    table = Table(title=f"largest stable delay, s, with a lag of {tau:g} s", title_justify="left")
    table.add_column("t*, s", justify="right")
    first = rows[0]["largest_stable_delay_s"]
    assert isinstance(first, dict)
    for law, delays in first.items():
        for name in delays:
            table.add_column(f"{LAW_WORDS[law]}, {name.replace('_', ' ')}", justify="right")
    for row in rows:
        found = row["largest_stable_delay_s"]
        assert isinstance(found, dict)
        table.add_row(
            f"{row['t_star_s']:g}", *(f"{delay:.4g}" for delays in found.values() for delay in delays.values())
        )
    return table
