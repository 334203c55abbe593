"""`wideberth tlos`: the time that a detection range leaves until loss of separation and until collision."""

import csv
import json
import math
import sys
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from wideberth.analysis.time_to_loss import TimesToLoss

# ADS-B paper, figure 3. The cruise speeds are not printed; these give its over-taking columns (errata).
OWNSHIPS = ("RQ-11B Raven:43kt:15m/s", "ScanEagle:80kt:31m/s", "DJI Phantom 1:19kt:9m/s")
INTRUDERS = (
    "F-35:1042kt",
    "Boeing 747:533kt",
    "Cessna TTX:240kt",
    "Cessna SkyHawk:126kt",
    "ScanEagle:80kt",
    "RQ-11B Raven:43kt",
)
RANGE, SEPARATION, COLLISION = "10nmi", "4000ft", "500m"
_FIELDS = (
    "ownship",
    "intruder",
    "scenario",
    "ownship_speed_mps",
    "intruder_speed_mps",
    "closing_speed_mps",
    "time_to_loss_of_separation_s",
    "time_to_collision_s",
)


class Aircraft(NamedTuple):
    """An aircraft as given: speeds in m/s, and the words that they were given in."""

    name: str
    max_speed: float
    cruise_speed: float
    words: tuple[str, ...]


def tlos(
    ownship: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME:MAX[:CRUISE]",
            help="Ownship with its maximum and cruise speed, such as 'ScanEagle:80kt:31m/s'. May be repeated; instead"
            " of those of the figure.",
        ),
    ] = None,
    intruder: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME:MAX", help="Intruder with its maximum speed. May be repeated; instead of those of the figure."
        ),
    ] = None,
    range_: Annotated[str, typer.Option("--range", help="Range at which the intruder is detected.")] = RANGE,
    separation: Annotated[str, typer.Option(help="Distance that is loss of separation.")] = SEPARATION,
    collision: Annotated[str, typer.Option(help="Distance that is a collision.")] = COLLISION,
    exact: Annotated[
        bool, typer.Option("--exact", help="Speeds as given, not rounded to whole m/s as in the figure.")
    ] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print comma-separated values.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the times to loss of separation and to collision, by default figure 3 of the ADS-B paper.

    Head-on both aircraft fly at their maximum speed; overtaken, the ownship flies at its cruise speed. Quantities carry
    their unit: kt, m/s, km/h, ft/s; nmi, km, m, ft.
    """
    if as_csv and as_json:
        raise InputError("--csv and --json: give one of them")
    owns = [_aircraft("--ownship", text, exact, cruise=True) for text in ownship or OWNSHIPS]
    intruders = [_aircraft("--intruder", text, exact, cruise=False) for text in intruder or INTRUDERS]
    distances = {
        name: _distance(name, text)
        for name, text in (("--range", range_), ("--separation", separation), ("--collision", collision))
    }
    for name, text in (("--separation", separation), ("--collision", collision)):
        if distances[name] >= distances["--range"]:
            raise InputError(f"{name} {text} must be below --range {range_}: nothing is left to fly")

    import numpy as np

    from wideberth.analysis.time_to_loss import times_to_loss

    times = times_to_loss(
        [own.max_speed for own in owns],
        [own.cruise_speed for own in owns],
        np.array([other.max_speed for other in intruders])[:, None],
        detection_range=distances["--range"],
        separation=distances["--separation"],
        collision=distances["--collision"],
    )
    if as_csv or as_json:
        _print_rows(_rows(owns, intruders, times), as_json)
        return

    from rich.console import Console

    console = Console()
    console.print(_table(owns, intruders, times))
    notes = [
        f"In each cell: seconds from detection at {range_} to loss of separation ({separation}) / to collision"
        f" ({collision}); -: never.",
        "Overtaking, the ownship flies at its cruise speed, else all at their maximum.",
        "Speeds as given."
        if exact
        else "Speeds are rounded to whole m/s, as in the figure; --exact takes them as given.",
    ]
    if collision == COLLISION:
        notes.append("The paper says 500 ft for a collision; its numbers are those of 500 m (--collision 500ft).")
    figure = not exact and not ownship and not intruder
    if figure and (range_, separation, collision) == (RANGE, SEPARATION, COLLISION):
        notes.append(
            "It differs in two numbers: 32.2 s to collision, F-35 and ScanEagle head-on (a misprint for 31.2), and"
            " 188.0 s to loss, Cessna TTX overtaking ScanEagle."
        )
    for note in notes:
        console.print(note, highlight=False, markup=False, soft_wrap=True)


def _aircraft(option: str, text: str, exact: bool, *, cruise: bool) -> Aircraft:
    """Return the aircraft that an option's text gives, its speeds rounded to whole m/s unless they are to be exact."""
    name, *words = (part.strip() for part in text.split(":"))
    if not name or not 1 <= len(words) <= (2 if cruise else 1):
        form = (
            "NAME:MAX or NAME:MAX:CRUISE, such as 'ScanEagle:80kt:31m/s'"
            if cruise
            else "NAME:MAX, such as 'F-35:1042kt'"
        )
        raise InputError(f"{option} '{text}': give {form}")
    speeds = [quantity(f"{option} '{text}'", word, "speed") for word in words]
    for word, speed in zip(words, speeds, strict=True):
        if not (math.isfinite(speed) and speed > 0):
            raise InputError(f"{option} '{text}': the speed {word} must be positive")
    if speeds[-1] > speeds[0]:
        raise InputError(f"{option} '{text}': the cruise speed is above the maximum: give the maximum first")
    if not exact:
        speeds = [float(round(speed)) for speed in speeds]
    return Aircraft(name, speeds[0], speeds[-1], tuple(words))


def _distance(option: str, text: str) -> float:
    distance = quantity(option, text, "length")
    if not (math.isfinite(distance) and distance > 0):
        raise InputError(f"{option} {text}: must be positive")
    return distance


def _table(owns: list[Aircraft], intruders: list[Aircraft], times: "TimesToLoss") -> "Table":
    """Return the figure's table; each intruder has a row for each scenario."""
    from rich.markup import escape
    from rich.table import Table

    from wideberth.analysis.time_to_loss import SCENARIOS

    table = Table(title="Time to loss of separation / time to collision, s")
    table.add_column("intruder")
    table.add_column("scenario")
    for own in owns:
        given = own.words[0] if len(own.words) == 1 else f"{own.words[0]},\ncruise {own.words[1]}"
        table.add_column(escape(f"{own.name}\n{given}"), justify="right")
    for i, other in enumerate(intruders):
        for k, scenario in enumerate(SCENARIOS):
            cells = [
                f"{_tenths(loss)}/{_tenths(touch)}" if math.isfinite(loss) else "-"
                for loss, touch in zip(times.to_loss_of_separation[i, :, k], times.to_collision[i, :, k], strict=True)
            ]
            table.add_row(escape(other.words[0] if k else other.name), scenario, *cells, end_section=k == 1)
    return table


def _rows(owns: list[Aircraft], intruders: list[Aircraft], times: "TimesToLoss") -> list[dict[str, str | float | None]]:
    from wideberth.analysis.time_to_loss import SCENARIOS

    return [
        dict(
            zip(
                _FIELDS,
                (
                    own.name,
                    other.name,
                    scenario,
                    own.cruise_speed if k else own.max_speed,
                    other.max_speed,
                    float(times.closing_speed[i, j, k]),
                    _finite(times.to_loss_of_separation[i, j, k]),
                    _finite(times.to_collision[i, j, k]),
                ),
                strict=True,
            )
        )
        for i, other in enumerate(intruders)
        for j, own in enumerate(owns)
        for k, scenario in enumerate(SCENARIOS)
    ]


def _tenths(value: float) -> str:
    """Return a time with one decimal, halves up as in the figure."""
    return f"{math.floor(10 * value + 0.5) / 10:.1f}"


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _print_rows(rows: list[dict[str, str | float | None]], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
        return
    writer = csv.DictWriter(sys.stdout, _FIELDS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
