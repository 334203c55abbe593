"""`wideberth montecarlo`: an experiment's encounters, on one core or a cluster, to be gone on with at any time."""

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wideberth.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from wideberth.evaluation.montecarlo.driver import Outcome
    from wideberth.evaluation.montecarlo.driver import Progress as State

_INTERRUPTED = 130
_SAY_EVERY_S = 60.0


def montecarlo(
    experiment: Annotated[
        str,
        typer.Argument(help="Experiment file (TOML) or its name in ./experiments; or a scenario.", show_default=False),
    ],
    out: Annotated[
        Path,
        typer.Option(help="Folder for the rows (Parquet), summary.json and report.html.", show_default=False),
    ],
    encounters: Annotated[
        int | None, typer.Option(help="Encounters for each number of intruders, or runs, instead of the file's.")
    ] = None,
    intruders: Annotated[
        int | None, typer.Option(help="One number of intruders, instead of all of the experiment's.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Blocks run at once; without it one for each CPU. Results do not depend on it.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed instead of the experiment's.")] = None,
    no_avoidance: Annotated[bool, typer.Option("--no-avoidance", help="See, but avoid nothing.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run that is in the folder.")] = False,
    shard: Annotated[
        str | None,
        typer.Option(metavar="i/N", help="Run only part i of N; all parts may run at the same time into one folder."),
    ] = None,
    engine: Annotated[str, typer.Option(help="local: threads; dask: workers of a dask scheduler.")] = "local",
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Address of the dask scheduler, such as tcp://10.0.0.1:8786; without it workers are started."
        ),
    ] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set one key of the experiment; repeatable.")
    ] = None,
    sensitivity: Annotated[
        int, typer.Option(help="Encounters for each value of NACp and of message loss in a sensitivity study.")
    ] = 0,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the report.")] = True,
) -> None:
    """Run an experiment's random encounters, each with and without avoidance, and report.

    A scenario instead of an experiment is flown --encounters times, with noise and what its table montecarlo draws.

    A run that was interrupted or killed goes on with --resume; rows do not depend on how often that happened, nor on
    workers, parts or engine.
    """
    from rich.console import Console

    from wideberth.evaluation.montecarlo.driver import Request, run_montecarlo
    from wideberth.evaluation.montecarlo.experiment import load_experiment
    from wideberth.evaluation.montecarlo.manifest import MANIFEST
    from wideberth.evaluation.montecarlo.plan import Part, find_experiment, parse_part
    from wideberth.evaluation.scenario_runs.study import is_scenario

    overrides = list(set_ or ())
    path = find_experiment(experiment)
    if is_scenario(path):
        if intruders is not None or shard is not None or engine != "local" or scheduler is not None or sensitivity:
            raise InputError("--intruders, --shard, --engine, --scheduler and --sensitivity are for experiments")
        _fly_scenario(
            path, overrides, out, seed, encounters, workers, both=not no_avoidance, resume=resume, page=report
        )
        return
    request = Request(
        experiment=load_experiment(path, overrides),
        out=out,
        seed=seed,
        encounters=encounters,
        intruders=intruders,
        avoid=not no_avoidance,
        resume=resume,
        part=Part() if shard is None else parse_part(shard),
        engine=engine,
        workers=workers,
        scheduler=scheduler,
        sensitivity=sensitivity,
        report=report,
        settings={"experiment_path": str(path), "overrides": overrides},
    )
    command = ["wideberth", "montecarlo", experiment, "--out", str(out)]
    options = {
        "--encounters": encounters,
        "--intruders": intruders,
        "--workers": workers,
        "--seed": seed,
        "--engine": engine if engine != "local" else None,
        "--scheduler": scheduler,
        "--sensitivity": sensitivity or None,
    }
    for name, value in options.items():
        command += [] if value is None else [name, str(value)]
    for override in overrides:
        command += ["--set", override]
    command += ["--no-avoidance"] * no_avoidance + ["--no-report"] * (not report)
    go_on = shlex.join([*command, "--resume"])
    console = Console()
    try:
        with _Bar(request.experiment.name, Console(stderr=True)) as bar:
            outcome = run_montecarlo(request, bar.update)
    except KeyboardInterrupt:
        if not (out / MANIFEST).exists():
            raise
        _interrupted(go_on if shard is None else f"{go_on} --shard {shard}")
    if outcome.stopped:
        _interrupted(go_on if shard is None else f"{go_on} --shard {shard}")
    if outcome.summary is None:
        _say(
            console,
            f"done here; still missing in {out}: {outcome.missing_encounters} encounters in {outcome.missing_blocks} "
            f"blocks\nonce the other parts have ended, this runs what they left and sums up:\n  {go_on}",
        )
        return
    console.print(_table(request.experiment.name, outcome.summary))
    _say_where(console, outcome, out)


def _fly_scenario(
    path: Path,
    overrides: list[str],
    out: Path,
    seed: int | None,
    runs: int | None,
    workers: int | None,
    *,
    both: bool,
    resume: bool,
    page: bool,
) -> None:
    import json

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from wideberth.config import apply_override, build_scenario, read_toml
    from wideberth.evaluation.report_shell import write_files
    from wideberth.evaluation.scenario_runs.study import Study, run_study
    from wideberth.evaluation.scenario_runs.summary import summarise, write_page

    tables = read_toml(path)
    for override in overrides:
        apply_override(tables, override)
    checked = build_scenario(tables, source=str(path), folder=path.parent)
    study = Study(
        tables=tables,
        source=str(path),
        folder=str(path.parent),
        seed=checked.seed if seed is None else seed,
        runs=checked.montecarlo.runs if runs is None else runs,
        both=both,
    )
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    try:
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task(checked.name, total=study.runs)
            rows = run_study(
                study, out, workers, resume=resume, progress=lambda done, _: bar.update(task, completed=done)
            )
    except KeyboardInterrupt:
        _interrupted(f"the same command with --resume (rows in {out})")
    summary = summarise(study, rows)
    write_files(out, {"summary.json": json.dumps(summary, indent=2, allow_nan=False) + "\n"})
    console = Console()
    console.print(_scenario_table(checked.name, summary))
    _say(console, f"rows:    {out / 'runs.jsonl'}\nsummary: {out / 'summary.json'}")
    if page:
        _say(console, f"report:  {write_page(out, study, rows, summary)}")


def _scenario_table(name: str, summary: dict[str, Any]) -> Any:
    """Return the closing table of a scenario: events, paths and times, without and with avoidance."""
    from rich.table import Table

    from wideberth.evaluation.scenario_runs.summary import EVENTS

    ways = [way for way in ("without", "with") if way in summary]
    table = Table(title=f"{name}: {summary['runs']} runs")
    table.add_column("runs with")
    for way in ways:
        table.add_column(f"{way} avoidance", justify="right")
    for key, (_, words) in EVENTS.items():
        cells = []
        for way in ways:
            entry = summary["events"][key][way]
            low, high = entry["interval"]
            cells.append(f"{entry['runs']} ({100 * low:.1f} to {100 * high:.1f} %)")
        table.add_row(words, *cells)
    ratio = [summary[way]["path_ratio"] for way in ways]
    cycle = [summary[way].get("step_time_ms") for way in ways]
    table.add_section()
    table.add_row("missions completed", *(str(summary[way]["missions_completed"]) for way in ways))
    table.add_row("reversals, all runs", *(str(summary[way].get("reversals", "-")) for way in ways))
    table.add_row(
        "path flown / mission, mean and max", *("-" if r is None else f"{r['mean']:.3f}, {r['max']:.3f}" for r in ratio)
    )
    table.add_row("step, mean and max, ms", *("-" if c is None else f"{c['mean']:.2f}, {c['max']:.1f}" for c in cycle))
    return table


def _interrupted(command: str) -> None:
    typer.echo(f"wideberth: interrupted; what is done is kept, go on with: {command}", err=True)
    raise typer.Exit(_INTERRUPTED)


class _Bar:
    """The progress: encounters done, encounters per second, time left; a bar, or a line a minute where none can be."""

    def __init__(self, name: str, console: "Console") -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self._name = name
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[encounters]}"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            # Blocks end seconds apart, and those with many intruders take longer.
            speed_estimate_period=60.0,
        )
        self._task = self._progress.add_task(name, total=None, encounters="")
        self._began: tuple[float, int] | None = None
        self._said = time.monotonic()

    def __enter__(self) -> "_Bar":
        if self._progress.console.is_interactive:
            self._progress.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self._progress.console.is_interactive:
            self._progress.stop()

    def update(self, state: "State") -> None:
        """Show how far the run has come."""
        description = f"{self._name}: {state.doing}"
        if not state.rows_total:
            self._progress.update(self._task, description=description)
            return
        now = time.monotonic()
        if self._began is None and state.doing == "running":
            # What was there before does not count towards the speed.
            self._progress.reset(self._task, total=state.rows_total, completed=state.rows, encounters="")
            self._began = now, state.encounters
        text = f"{state.encounters:,}/{state.encounters_total:,} encounters"
        if self._began is not None and state.encounters > self._began[1]:
            text += f", {(state.encounters - self._began[1]) / max(now - self._began[0], 1e-3):,.0f}/s"
        self._progress.update(
            self._task, description=description, total=state.rows_total, completed=state.rows, encounters=text
        )
        if not self._progress.console.is_interactive and now > self._said + _SAY_EVERY_S:
            self._said = now
            left = self._progress.tasks[0].time_remaining
            text += "" if left is None else f", {left:,.0f} s left"
            typer.echo(f"{description}: {text}", err=True)


def _table(name: str, summary: dict[str, Any]) -> Any:
    """Return the closing table, a column for each number of intruders."""
    from rich.table import Table

    avoidance = summary.get("settings", {}).get("avoidance", True)
    sets = list(summary["by_intruders"])
    heads = [str(entry["intruders"]) for entry in sets]
    if len(sets) > 1 and isinstance(summary.get("pooled"), dict):
        sets.append(summary["pooled"])
        heads.append("all")
    table = Table(title=f"{name}: {'with' if avoidance else 'without'} avoidance")
    table.add_column("intruders")
    for head in heads:
        table.add_column(head, justify="right")
    for title, key, digits in (
        ("encounters", "encounters", 0),
        ("true events", "true_events", 0),
        ("P_cd", "p_cd", 4),
        ("P_fa", "p_fa", 5),
        ("violations", "violations", 0),
        ("losses of self-separation", "loss_of_self_separation", 0),
        ("NMAC risk ratio", "nmac_risk_ratio", 4),
    ):
        table.add_row(title, *(_number(entry.get(key), digits) for entry in sets))
    cycles = [entry.get("cycle_time_ms") or {} for entry in sets]
    table.add_row("decision cycle, ms", *(_number(cycle.get("mean"), 2) for cycle in cycles))
    return table


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"


def _say_where(console: "Console", outcome: "Outcome", out: Path) -> None:
    _say(console, f"rows:    {out}/rows_*.parquet\nsummary: {outcome.summary_path}")
    if outcome.report_path is not None:
        _say(console, f"report:  {outcome.report_path}")


def _say(console: "Console", text: str) -> None:
    """Print text as it is, without wrapping."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
