"""`wideberth range`: how far away an intruder must be detected, by each of the four methods."""

import json
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

_TITLES = {
    "tgvv": "TGVV (bank with its lag)",
    "gvv": "GVV (bank at once)",
    "tt": "TT (turn time)",
    "gt": "GT (tangent circles)",
}
_DIMENSIONS = {
    "ownship_speed": "speed",
    "intruder_speed": "speed",
    "safety_radius": "length",
    "max_bank": "angle",
    "computation_time": "time",
    "turn_angle": "angle",
    "max_bank_rate": "angular rate",
    "roll_time_constant": "time",
}


SWEEPS = "2.7, 2.8, 2.9, 2.10, 2.11, 2.12, pilot-delay"


def range(  # the command's name
    context: typer.Context,
    ownship_speed: Annotated[str, typer.Option(help="Speed of the ownship.")] = "25kt",
    intruder_speed: Annotated[str, typer.Option(help="Speed of the intruder, head-on.")] = "150kt",
    safety_radius: Annotated[str, typer.Option(help="Distance that is to be kept.")] = "500ft",
    max_bank: Annotated[str, typer.Option(help="Largest bank angle of the turn.")] = "30deg",
    computation_time: Annotated[
        str, typer.Option(help="From detection to the begin of the turn, a pilot's delay included.")
    ] = "5s",
    turn_angle: Annotated[str, typer.Option(help="By how much the ownship turns.")] = "90deg",
    max_bank_rate: Annotated[str, typer.Option(help="Largest rate of the bank angle.")] = "30deg/s",
    roll_time_constant: Annotated[str, typer.Option(help="Time constant of the roll rate.")] = "0.5s",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, in SI units.")] = False,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="NAME", help=f"Draw a figure of the thesis instead: {SWEEPS}, or all. Needs --out."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the figure's report, picture, CSV and JSON.", show_default=False)
    ] = None,
    from_: Annotated[
        str | None,
        typer.Option("--from", metavar="TEXT", help="Start of the sweep: a speed, in 2.8 and pilot-delay a time."),
    ] = None,
    to: Annotated[str | None, typer.Option("--to", metavar="TEXT", help="End of the sweep.")] = None,
    points: Annotated[int, typer.Option(min=2, max=20_001, help="How many points of a sweep.")] = 201,
) -> None:
    """Print the minimum detection range of a turn away from a head-on intruder, by four methods; or sweep it.

    By default the nominal case of the thesis (table 2.3). The closest point of approach is what detection at that range
    leads to when the bank lags as it does. Quantities carry their unit: kt, m/s; ft, m, nmi; deg, rad; deg/s; s.

    --sweep draws a figure of the thesis, section 2.2: 2.7 range, 2.8 distance against time, 2.9 closest approach, 2.10
    error, 2.11 time to maneuver, 2.12 self-separation; pilot-delay: what a pilot's delay costs. Options given replace
    the thesis's fixed values.
    """
    given = {
        "ownship_speed": ownship_speed,
        "intruder_speed": intruder_speed,
        "safety_radius": safety_radius,
        "max_bank": max_bank,
        "computation_time": computation_time,
        "turn_angle": turn_angle,
        "max_bank_rate": max_bank_rate,
        "roll_time_constant": roll_time_constant,
    }
    values: dict[str, Any] = {
        name: quantity(f"--{name.replace('_', '-')}", text, _DIMENSIONS[name]) for name, text in given.items()
    }
    named = {name for name in (*given, "out", "from_", "to", "points") if _is_given(context, name)}
    if sweep is not None:
        if as_json:
            raise InputError("--json: a sweep writes its JSON into --out")
        _sweep(sweep, {name: values[name] for name in given if name in named}, out, from_, to, points)
        return
    for name in ("out", "from_", "to", "points"):
        if name in named:
            raise InputError(f"--{name.rstrip('_')} belongs to --sweep; give a figure: {SWEEPS}, or all")
    _print_ranges(given, values, as_json)


def _is_given(context: typer.Context, name: str) -> bool:
    """Return whether an option stands on the command line, or has its default."""
    source = context.get_parameter_source(name)
    return source is not None and source.name != "DEFAULT"


def _sweep(
    name: str, given: dict[str, float], out: Path | None, start: str | None, stop: str | None, points: int
) -> None:
    """Write the report of a figure, or of all."""
    from wideberth.analysis.thesis_claims import claims
    from wideberth.analysis.thesis_figures import FIGURES, sweep

    if name != "all" and name not in FIGURES:
        raise InputError(f"--sweep {name}: there is no such figure; give {SWEEPS}, or all")
    if out is None:
        raise InputError("--sweep needs --out, a folder for its report")
    if name == "all" and (start is not None or stop is not None):
        raise InputError("--from and --to: give one figure, not all, for not all sweep the same")
    figure = FIGURES.get(name)
    if figure is not None and figure.swept is not None and figure.swept in given:
        raise InputError(f"--{figure.swept.replace('_', '-')}: figure {name} sweeps it; give --from and --to")
    low = None if figure is None or start is None else quantity("--from", start, figure.dimension)
    high = None if figure is None or stop is None else quantity("--to", stop, figure.dimension)
    if low is not None and high is not None and not low < high:
        raise InputError(f"--from {start}: must be below --to {stop}")
    made = []
    try:
        for key in FIGURES if name == "all" else (name,):
            fixed = {k: v for k, v in given.items() if k != FIGURES[key].swept}
            made.append(sweep(key, fixed, start=low, stop=high, points=points))
    except ValueError as error:
        raise InputError(str(error)) from None

    from wideberth.evaluation.range_report import gap_words, write_report

    for numbers in made:
        path = write_report(out, numbers)
        stated = claims(numbers)
        held = (
            f", {sum(claim.holds for claim in stated)} of {len(stated)} statements of the thesis hold" if stated else ""
        )
        typer.echo(f"{numbers.name}: {path}{held}")
        for words in gap_words(numbers):
            typer.echo(f"  {words}")


def _print_ranges(given: dict[str, str], values: dict[str, Any], as_json: bool) -> None:
    """Print what the four methods say about one encounter."""
    from wideberth.analysis.detection_range import Method, minimum_detection_range, simulate_cpa
    from wideberth.units import FOOT

    flown = {name: value for name, value in values.items() if name != "safety_radius"}
    rows = []
    try:
        for method in get_args(Method):
            answer = minimum_detection_range(method=method, **values)
            approach = simulate_cpa(answer.distance, **flown)
            rows.append((method, answer, approach))
    except ValueError as error:
        raise InputError(str(error)) from None
    if as_json:
        listed = [
            {
                "method": method,
                "distance_m": answer.distance,
                "maneuver_time_s": answer.maneuver_time,
                "case": answer.case,
                "cpa_m": approach.cpa,
                "t_cpa_s": approach.t_cpa,
            }
            for method, answer, approach in rows
        ]
        typer.echo(json.dumps(listed, indent=2, default=str))
        return

    from rich.console import Console
    from rich.table import Table

    table = Table(title="Minimum detection range, head-on")
    for head in ("method", "range, ft", "range, m", "closest, ft", "after, s", "case"):
        table.add_column(head, justify="left" if head == "method" else "right")
    for method, answer, approach in rows:
        table.add_row(
            _TITLES[method],
            f"{answer.distance / FOOT:,.1f}",
            f"{answer.distance:,.1f}",
            f"{approach.cpa / FOOT:.1f}",
            f"{approach.t_cpa:.2f}",
            "" if answer.case is None else str(answer.case),
        )
    console = Console()
    console.print(table)
    console.print(
        ", ".join(f"{name.replace('_', ' ')} {text}" for name, text in given.items()), highlight=False, soft_wrap=True
    )
