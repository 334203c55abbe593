"""`wideberth size`: from which directions and speeds of intruder a sensor protects an aircraft."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wideberth.cli.errors import quantity
from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from wideberth.analysis.sizing_answer import Intruder
    from wideberth.analysis.sizing_config import AircraftConfig
    from wideberth.evaluation.sizing_tables import Sizing


def size(
    sensor: Annotated[
        str | None,
        typer.Argument(help="Sensor: a TOML file, or a name in sizing/. Else the thesis's radar (table 5.1)."),
    ] = None,
    aircraft: Annotated[
        str | None,
        typer.Argument(help="Aircraft: a TOML file, or a name in sizing/. Else a small fixed wing at 25 kt."),
    ] = None,
    speed: Annotated[
        list[str] | None,
        typer.Option(metavar="[NAME:]SPEED", help="Speed of an intruder, such as 60kt or 'Cessna:126kt'. Repeatable."),
    ] = None,
    rcs_m2: Annotated[float, typer.Option("--rcs-m2", help="Radar cross-section of the intruders.")] = 1.0,
    ownship_speed: Annotated[
        str | None, typer.Option(help="Speed of the aircraft, instead of its cruise speed.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for report.html, its pictures and size.json.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="List the sensors and aircraft in sizing/.")] = False,
) -> None:
    """Say from which directions and speeds of intruder a sensor protects an aircraft, and what would cure the rest.

    Protected means: the sensor has a confirmed track from so far away that one maneuver keeps every intruder of that
    speed and bearing outside the safety radius. docs/sizing.md explains it.
    """
    if list_:
        _list()
        return

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    if not (math.isfinite(rcs_m2) and rcs_m2 > 0.0):
        raise InputError(f"--rcs-m2 {rcs_m2:g}: must be positive")
    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file: give a folder")
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("required and available ranges", total=2 if out is None else 3)
        sizing = _asked(sensor, aircraft, speed, rcs_m2, ownship_speed)
        bar.update(task, advance=1, description="reach and summary")

        from wideberth.evaluation.sizing_summary import summary

        printed = json.dumps(summary(sizing, by_bearing=False), indent=2, allow_nan=False) if as_json else ""
        page = None
        if out is not None:
            from wideberth.evaluation.sizing_report import write_sizing_report

            bar.update(task, advance=1, description="report")
            page = write_sizing_report(out, sizing, summary(sizing, by_bearing=True))
    if as_json:
        typer.echo(printed)
        return
    console = Console()
    for one in _tables(sizing):
        console.print(one)
    console.print(sizing.words, highlight=False, markup=False, style="bold", soft_wrap=True)
    if page is not None:
        console.print(f"report: {page}", highlight=False, markup=False, soft_wrap=True)


def _asked(
    sensor: str | None, aircraft: str | None, speeds: list[str] | None, rcs: float, ownship_speed: str | None
) -> "Sizing":
    """Return the answer to what the command line asks."""
    from wideberth.analysis.escapes import range_by_escapes
    from wideberth.analysis.ground_sizing import ground_protection
    from wideberth.analysis.sizing_answer import INTRUDERS, size_sensor
    from wideberth.analysis.sizing_config import (
        AircraftConfig,
        GroundRadarConfig,
        find_sizing_file,
        load_aircraft,
        load_sensor,
    )
    from wideberth.evaluation.sizing_tables import Sizing
    from wideberth.sensors.radar.config import RadarConfig

    intruders = tuple(_intruder(text) for text in speeds) if speeds else INTRUDERS
    path = None if sensor is None else find_sizing_file(sensor)
    sensor_name = "radar_table_5_1" if path is None else path.stem
    looks = RadarConfig() if path is None else load_sensor(path)
    flies = AircraftConfig(name="small fixed wing") if aircraft is None else load_aircraft(find_sizing_file(aircraft))
    if ownship_speed is not None:
        flies = _faster(flies, ownship_speed)
    if isinstance(looks, GroundRadarConfig):
        at = [one.speed for one in intruders]
        volumes = ground_protection(looks, flies, at, required_range=range_by_escapes, rcs=rcs)
        return Sizing(sensor_name, looks, flies, intruders, rcs, volumes)
    answer = size_sensor(looks, flies, intruders, required_range=range_by_escapes, rcs=rcs)
    return Sizing(sensor_name, looks, flies, intruders, rcs, answer)


def _intruder(text: str) -> "Intruder":
    from wideberth.analysis.sizing_answer import Intruder

    name, colon, word = text.rpartition(":")
    if colon and not name.strip():
        raise InputError(f"--speed '{text}': the name is missing: give NAME:SPEED, or only the speed")
    speed = quantity("--speed", word.strip() or text, "speed")
    if not (math.isfinite(speed) and speed > 0.0):
        raise InputError(f"--speed {word}: must be positive")
    return Intruder(name.strip() or word.strip(), speed)


def _faster(aircraft: "AircraftConfig", text: str) -> "AircraftConfig":
    speed = quantity("--ownship-speed", text, "speed")
    if not max(aircraft.speed_min_mps, 1e-9) <= speed <= aircraft.speed_max_mps:
        raise InputError(
            f"--ownship-speed {text}: {aircraft.name} flies {aircraft.speed_min_mps:g} to {aircraft.speed_max_mps:g}"
            " m/s (speed_min_mps, speed_max_mps)"
        )
    return aircraft.model_copy(update={"speed_cruise_mps": speed})


def _tables(sizing: "Sizing") -> list["Table"]:
    from rich.markup import escape
    from rich.table import Table

    from wideberth.analysis.sizing_answer import SizingAnswer
    from wideberth.evaluation.sizing_tables import cure_rows, escape_rows, protection_rows, reach_rows

    answers = [
        (f"Reach of {sizing.sensor_name}; tracks by closing speed less what is seen", reach_rows(sizing)),
        (f"Range that {sizing.aircraft.name} needs head-on", escape_rows(sizing)),
        (f"Protection by {sizing.sensor_name}, intruders of {sizing.rcs:g} m²", protection_rows(sizing)),
    ]
    if isinstance(sizing.answer, SizingAnswer):
        answers.append(("What would protect from the others", cure_rows(sizing.answer)))
    found = []
    for title, (head, rows) in answers:
        table = Table(title=title, title_justify="left")
        for text in head:
            words = text in ("intruder", "escape", "protected\nfrom")
            table.add_column(escape(text), justify="left" if words else "right")
        for row in rows:
            table.add_row(*(escape(text) for text in row))
        if rows:
            found.append(table)
    return found


def _list() -> None:
    """Print the files of the folder with the comment that each begins with."""
    from wideberth.analysis.sizing_config import FOLDER

    files = sorted(FOLDER.glob("*.toml"))
    if not files:
        raise InputError(f"there is no {FOLDER} folder with TOML files here; give the paths of your own")
    for file in files:
        first = file.read_text(encoding="utf-8", errors="replace").partition("\n")[0]
        typer.echo(f"{file.stem:20} {first.lstrip('# ').strip()}")
