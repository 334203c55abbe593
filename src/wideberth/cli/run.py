"""`wideberth run`: one scenario from start to report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from wideberth.errors import InputError


def run(
    out: Annotated[Path, typer.Option(help="Folder for summary.json, recording.mcap, report.html and pictures.")],
    scenario: Annotated[
        Path | None, typer.Argument(help="Scenario file (TOML), also of a fleet: scenarios/cas_*.toml.")
    ] = None,
    encounter: Annotated[
        str | None,
        typer.Option(
            help="Instead of a scenario, an encounter of a Monte Carlo experiment: EXPERIMENT:K-ID, K intruders, "
            "number ID."
        ),
    ] = None,
    traffic: Annotated[
        str | None,
        typer.Option(
            help="Recorded or live traffic instead of the scenario's: a file, - for standard input, beast://host:port, "
            "avr://host:port, sbs://host:port or uat://host:port, or gdl90://host:port to listen there."
        ),
    ] = None,
    traffic_format: Annotated[
        str,
        typer.Option(
            help="Format of a file: auto, trajectories, frames, beast, beast-gps, beast-12mhz, avr, avr-untimed, sbs, "
            "uat or gdl90."
        ),
    ] = "auto",
    mission: Annotated[
        Path | None,
        typer.Option(
            help="Mission instead of the scenario's: CSV with columns lat_deg, lon_deg (WGS84), altitude_m (pressure "
            "altitude for recorded traffic), speed_mps (ground speed on the leg that ends there), start_time_s (Unix)."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed instead of the scenario's.")] = None,
    no_avoidance: Annotated[bool, typer.Option("--no-avoidance", help="See, but avoid nothing.")] = False,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="Set one key, such as avoidance.buffer=1.2; repeatable.")
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the report and the pictures.")] = True,
) -> None:
    """Fly a scenario and report: conflicts seen, maneuvers flown, separations kept.

    A fleet of helicopters that avoid each other is flown as by `wideberth cas`, with cas.json for a summary.
    """
    import numba
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from wideberth import kernel_modules
    from wideberth.config import apply_override, build_scenario, read_toml
    from wideberth.run import run_scenario
    from wideberth.simulation.fleet_config import build_fleet, is_fleet, without_avoidance
    from wideberth.simulation.mission import read_mission_file
    from wideberth.types import Snapshot

    console = Console()
    if (scenario is None) == (encounter is None):
        raise InputError("give either a SCENARIO or --encounter EXPERIMENT:K-ID")
    if scenario is not None:
        tables, source, folder = read_toml(scenario), str(scenario), scenario.parent
    else:
        if traffic is not None or mission is not None or traffic_format != "auto":
            raise InputError("--encounter brings its own traffic and mission")
        tables, source, folder = _encounter(str(encounter), seed, set_ or ()), str(encounter), Path()
        seed, set_ = None, None
    fleet = is_fleet(tables)
    if fleet and (traffic is not None or mission is not None or traffic_format != "auto"):
        raise InputError(f"{source}: the vehicles of a fleet are all the traffic there is, and have no mission")
    if traffic is not None:
        tables["traffic"] = _recorded(tables.get("traffic"), traffic, traffic_format)
    elif traffic_format != "auto":
        tables.setdefault("traffic", {})["format"] = traffic_format
    if mission is not None:
        config, messages = read_mission_file(mission)
        for message in messages:
            console.print(f"[yellow]{mission}: {message}[/]")
        tables["mission"] = config.model_dump(exclude_none=True)
        tables.pop("origin", None)
    if seed is not None:
        tables["seed"] = seed
    if no_avoidance and fleet:
        without_avoidance(tables)
    elif no_avoidance:
        tables["avoid"] = False
    for override in set_ or ():
        apply_override(tables, override)
    if fleet:
        from wideberth.cli.cas import fly_and_show

        fly_and_show(build_fleet(tables, source), out, report=report)
        return
    checked = build_scenario(tables, source=source, folder=folder)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f} s flown"),
        TextColumn("{task.fields[state]}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    ) as bar:
        task = bar.add_task(f"{checked.name}: compiling kernels", total=1.0, state="")
        if not vars(numba.config)["DISABLE_JIT"]:
            # Before the first step, so that no step waits for the compiler.
            for name in kernel_modules.loaded():
                kernel_modules.warm_up(name)
        bar.update(task, description=checked.name)

        def progress(elapsed: float, planned: float, snapshot: Snapshot) -> None:
            state = snapshot.maneuver.reason if snapshot.maneuver else ""
            bar.update(task, completed=elapsed, total=max(planned, elapsed), state=state[:60])

        summary = run_scenario(checked, out, progress, report)
    console.print(_table(summary))
    for note in summary["notes"]:
        console.print(f"note: {note}")
    console.print(f"summary:   {out / 'summary.json'}\nrecording: {out / 'recording.mcap'}")
    if report:
        console.print(f"report:    {out / 'report.html'}")


def _encounter(address: str, seed: int | None, overrides: Sequence[str]) -> dict[str, Any]:
    """Return the tables of an encounter's scenario."""
    from wideberth.evaluation.montecarlo.experiment import load_experiment
    from wideberth.evaluation.montecarlo.full_tier import encounter_scenario
    from wideberth.evaluation.montecarlo.plan import find_experiment

    name, _, key = address.rpartition(":")
    intruders, _, number = key.partition("-")
    if not (name and intruders.isdecimal() and number.isdecimal()):
        raise InputError(f"--encounter {address}: write EXPERIMENT:K-ID, such as adsb_collision:3-1234")
    experiment = load_experiment(find_experiment(name), overrides)
    chosen = experiment.seed if seed is None else seed
    return encounter_scenario(experiment, chosen, int(intruders), int(number)).resolved()


def _recorded(table: Any, traffic: str, traffic_format: str) -> dict[str, Any]:
    """Return the traffic table for a source from the command line, keeping what the scenario says of recordings."""
    kept = dict(table) if isinstance(table, dict) and table.get("kind") == "recorded" else {"kind": "recorded"}
    is_file = traffic != "-" and "://" not in traffic
    kept["path"] = str(Path(traffic).absolute()) if is_file else traffic
    kept["format"] = traffic_format
    return kept


def _table(summary: dict[str, Any]) -> Any:
    """Return the closing table."""
    from rich.table import Table

    def number(value: Any, unit: str = "", digits: int = 0) -> str:
        return "unknown" if value is None else f"{value:,.{digits}f}{unit}"

    table = Table(title=f"{summary['scenario']}: {'with' if summary['avoidance'] else 'without'} avoidance")
    table.add_column("what")
    table.add_column("value", justify="right")
    rows = [
        ("intruders", number(summary["intruders"])),
        ("near mid-air collisions (500 ft, 100 ft)", number(summary["nmac_count"])),
        (f"losses of well clear ({summary['well_clear_volume']})", number(summary["loss_of_well_clear_count"])),
        ("violations of the collision volume", number(summary["violation_count"])),
        ("least separation, horizontal", number(summary["min_horizontal_separation_m"], " m")),
        ("least separation, vertical, then", number(summary["min_vertical_separation_m"], " m")),
        ("alerts", number(summary["alerts"])),
        ("maneuvers (reversals)", f"{summary['maneuvers']} ({summary['reversals']})"),
        ("path flown", number(summary["path_length_m"] / 1e3, " km", 1)),
        ("mission path", number(summary["mission_path_length_m"] / 1e3, " km", 1)),
        ("mission completed", "yes" if summary["mission_completed"] else "NO"),
        ("time of a step, mean / p95 / max", _step_times(summary["step_time_ms"])),
        ("reports lost or rejected", number(sum(sum(causes.values()) for causes in summary["rejections"].values()))),
    ]
    for row in rows:
        table.add_row(*row)
    return table


def _step_times(times: dict[str, float | None]) -> str:
    return " / ".join("-" if times[key] is None else f"{times[key]:.2f}" for key in ("mean", "p95", "max")) + " ms"
