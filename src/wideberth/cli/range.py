"""`wideberth range`: how far away an intruder must be detected, by each of the four methods."""

import json
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


def range(  # the command's name
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
) -> None:
    """Print the minimum detection range of a turn away from a head-on intruder, by four methods.

    By default the nominal case of the thesis (table 2.3). The closest point of approach is what detection at that range
    leads to when the bank lags as it does. Quantities carry their unit: kt, m/s; ft, m, nmi; deg, rad; deg/s; s.
    """
    from wideberth.analysis.detection_range import Method, minimum_detection_range, simulate_cpa
    from wideberth.units import FOOT

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
