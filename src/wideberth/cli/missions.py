"""`wideberth missions`: search a recording for missions that run into its traffic."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console


def missions(
    source: Annotated[
        str, typer.Argument(help="Recorded traffic: a file, or - for standard input.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(help="Folder for the missions and missions.json.", show_default=False)],
    count: Annotated[int, typer.Option(min=0, help="Missions wanted that pass the filter.")] = 50,
    outside: Annotated[int, typer.Option(min=0, help="Missions wanted beside them that do not pass it.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Another seed finds other missions.")] = 0,
    min_aircraft: Annotated[int, typer.Option(min=1, help="Aircraft crossed within 2 nmi and 1000 ft.")] = 5,
    min_losses: Annotated[int, typer.Option(min=0, help="Aircraft that the volume is lost with.")] = 3,
    volume: Annotated[str, typer.Option(help="Well-clear preset that is to be lost.")] = "sarp",
    speed_mps: Annotated[float, typer.Option(help="Ground speed of the ownship (80 kt).")] = 41.156,
    duration_min_s: Annotated[float, typer.Option(help="Shortest mission.")] = 300.0,
    duration_max_s: Annotated[float, typer.Option(help="Longest mission.")] = 850.0,
    altitude_min_m: Annotated[float, typer.Option(help="Lowest mission altitude.")] = 300.0,
    altitude_max_m: Annotated[float, typer.Option(help="Highest mission altitude.")] = 1500.0,
    receiver_range_m: Annotated[float, typer.Option(help="Range of the ownship's receiver.")] = 185_200.0,
    max_tries: Annotated[int, typer.Option(min=1, help="Candidates after which the search ends.")] = 200_000,
    traffic_format: Annotated[str, typer.Option(help="Format of the traffic.")] = "auto",
) -> None:
    """Search straight missions that cross real traffic and, without avoidance, lose well clear.

    A mission is kept for the conflicts that it meets without avoidance, whatever avoidance makes of it. The filter: no
    loss in the first 60 s, and every aircraft in conflict seen, fresh and moving, at least 25 s before its loss.
    Altitudes are those of the recording (pressure altitudes, as a rule).
    """
    import math

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.table import Table

    from wideberth.errors import InputError
    from wideberth.evaluation.mission_search import SampledTraffic, SearchSettings, search_missions
    from wideberth.evaluation.mission_set import INDEX, write_mission_set
    from wideberth.sensors.adsb.sources import describe, open_traffic

    try:
        settings = SearchSettings(
            volume=volume,
            min_aircraft=min_aircraft,
            min_losses=min_losses,
            speed=speed_mps,
            duration_min=duration_min_s,
            duration_max=duration_max_s,
            altitude_min=altitude_min_m,
            altitude_max=altitude_max_m,
            receiver_range=receiver_range_m,
            max_tries=max_tries,
        )
    except ValueError as error:
        raise InputError(str(error)) from None
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file: give a folder for --out")
    console = Console()
    traffic_source = open_traffic(source, traffic_format)
    if traffic_source.live:
        traffic_source.close()
        raise InputError(f"'{source}' is live: missions are searched in a recording")
    with console.status(f"reading {source}"):
        reports = traffic_source.poll(math.inf)
        counters = describe(traffic_source.counters)
        traffic_source.close()
    _say(console, f"{source}: {counters}")
    try:
        traffic = SampledTraffic(reports, settings)
    except ValueError as error:
        raise InputError(f"no missions in '{source}': {error}") from None
    columns = (TextColumn("missions"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[tries]} tries"))
    with Progress(*columns, TimeElapsedColumn(), console=console) as bar:
        task = bar.add_task("", total=count, tries=0)
        result = search_missions(
            traffic,
            settings,
            count,
            seed,
            outside=outside,
            progress=lambda found, tries: bar.update(task, completed=found, tries=tries),
        )
        bar.update(task, completed=sum(m.passes for m in result.missions), tries=result.tries)
    try:
        named = write_mission_set(out, result, settings, source, seed)
    except OSError as error:
        raise InputError(f"cannot write to {out}: {error.strerror or error}") from None
    table = Table(title="Missions found")
    for title in ("mission", "min", "km", "crossed", f"lost {volume}", "first after s", "filter"):
        table.add_column(title, justify="left" if title in ("mission", "filter") else "right")
    for name, mission in named:
        lost = mission.losses(volume)
        table.add_row(
            name,
            f"{mission.duration / 60:.1f}",
            f"{mission.duration * mission.speed / 1000:.1f}",
            str(sum(math.isfinite(m.t_cross) for m in mission.meetings)),
            str(len(lost)),
            f"{min(lost.values()):.0f}" if lost else "-",
            "passed" if mission.passes else "not passed",
        )
    console.print(table)
    passed = sum(m.passes for m in result.missions)
    _say(console, f"index: {out / INDEX}")
    _say(console, f"not kept: {describe(dict(result.rejected)) or 'none'}")
    if passed < count or len(result.missions) - passed < outside:
        _say(
            console,
            f"only {passed} of {count} missions that pass and {len(result.missions) - passed} of {outside} that do not"
            f" in {result.tries} tries: ask for fewer, lower --min-aircraft or --min-losses, or raise --max-tries",
        )
        if not result.missions:
            raise typer.Exit(1)


def _say(console: "Console", text: str) -> None:
    """Print a line as it is, without wrapping."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
