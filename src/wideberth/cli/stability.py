"""`wideberth stability`: how much communication delay two vehicles that avoid each other tolerate."""

import json
import math
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
    position: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="First less second vehicle, z down, such as 25ft,5ft,-11ft: one encounter."),
    ] = None,
    velocity: Annotated[
        str | None, typer.Option(metavar="VX,VY", help="Its horizontal velocity relative to the second: -5ft/s,0ft/s.")
    ] = None,
    separation: Annotated[str, typer.Option(help="Radius of the protected sphere, of that encounter.")] = "12ft",
    out: Annotated[Path | None, typer.Option(help="Folder for report.html and its pictures.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the largest communication delay at which the vertical avoidance loop is stable.

    With --position and --velocity the loop is linearised about that encounter: the gains, and the eigenvalues of each
    law, also as printed. The report draws the gain along a pass, the eigenvalues of each law, and the delay against the
    distance and the time to the closest point (CAS thesis, figures 5.6 and 5.10, tables 5.1 to 5.3).
    """
    tau = quantity("--lag", lag, "time")
    if (position is None) != (velocity is None):
        raise InputError("an encounter needs both --position and --velocity")
    if position is not None and velocity is not None:
        if time or pade:
            raise InputError("--time and --pade are not for an encounter: --position and --velocity say its time")
        _show_encounter(
            _vector("--position", position, "length", 3),
            _vector("--velocity", velocity, "speed", 2),
            quantity("--separation", separation, "length"),
            tau,
            as_json,
        )
    else:
        _show_delays([quantity("--time", text, "time") for text in time or TIMES], pade or [], tau, as_json)
    if out is not None:
        from wideberth.evaluation.stability_report import write_stability_report

        if out.exists() and not out.is_dir():
            raise InputError(f"--out {out} is a file: give a folder")
        typer.echo(f"report: {write_stability_report(out, tau)}", err=as_json)


def _show_delays(times: list[float], pade: list[int], tau: float, as_json: bool) -> None:
    """Print the largest stable delay by time to the closest point and law."""
    from wideberth.analysis.stability import LAWS, largest_stable_delay

    orders: list[int | None] = [*pade, None]
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
        return
    from rich.console import Console

    Console().print(_table(rows, tau))


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


def _vector(option: str, text: str, dimension: str, count: int) -> list[float]:
    parts = text.split(",")
    if len(parts) != count:
        raise InputError(f"{option} {text}: give {count} values with their units, separated by commas")
    return [quantity(option, part.strip(), dimension) for part in parts]


def _show_encounter(position: list[float], velocity: list[float], separation: float, tau: float, as_json: bool) -> None:
    """Print the loop linearised about an encounter."""
    from wideberth.analysis.stability import encounter_stability

    try:
        found = encounter_stability(position, [*velocity, 0.0], separation, tau)
    except ValueError as error:
        raise InputError(f"--position, --velocity: {error}") from None
    laws = {
        law: {
            "eigenvalues_1_per_s": [[float(x.real), float(x.imag)] for x in found.eigenvalues[law]],
            "as_printed_1_per_s": [[float(x.real), float(x.imag)] for x in found.as_printed[law]],
            "largest_stable_delay_s": delay if math.isfinite(delay) else None,
        }
        for law, delay in found.largest_stable_delay.items()
    }
    gains = dict(zip("IJK", map(float, found.gains.position), strict=True))
    if as_json:
        numbers = {
            "vertical_velocity_mps": found.vertical_velocity,
            "gains_1_per_s": gains,
            "velocity_gains": dict(zip("LM", map(float, found.gains.velocity), strict=True)),
            "laws": laws,
        }
        typer.echo(json.dumps(numbers, indent=2))
        return
    from rich.console import Console
    from rich.table import Table

    from wideberth.evaluation.stability_report import LAW_WORDS, roots_in_words

    console = Console()
    console.print(
        f"the first passes above at {separation:g} m with {found.vertical_velocity:.4g} m/s down against the second; "
        + ", ".join(f"{name} = {gain:.4g} 1/s" for name, gain in gains.items())
        + ", "
        + ", ".join(f"{name} = {gain:.4g}" for name, gain in zip("LM", found.gains.velocity, strict=True)),
        highlight=False,
        soft_wrap=True,
    )
    table = Table(title="eight more eigenvalues, of x and y, are 0", title_justify="left")
    for name in ("law", "eigenvalues, 1/s", "as printed, 1/s", "largest stable delay, s"):
        table.add_column(name)
    for law, one in laws.items():
        delay = one["largest_stable_delay_s"]
        table.add_row(
            LAW_WORDS[law],
            roots_in_words(found.eigenvalues[law]),
            roots_in_words(found.as_printed[law]) if law != "shared_corrected" else "–",
            "any" if delay is None else f"{delay:.4g}",
        )
    console.print(table)
