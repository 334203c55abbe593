"""`wideberth montecarlo`: an experiment's encounters, on one core or a cluster, to be gone on with at any time."""

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from wideberth.evaluation.montecarlo.driver import Outcome
    from wideberth.evaluation.montecarlo.driver import Progress as State

_INTERRUPTED = 130
_SAY_EVERY_S = 60.0


def montecarlo(
    experiment: Annotated[
        str, typer.Argument(help="Experiment file (TOML), or its name in ./experiments.", show_default=False)
    ],
    out: Annotated[
        Path,
        typer.Option(help="Folder for the rows (Parquet), summary.json and report.html.", show_default=False),
    ],
    encounters: Annotated[
        int | None, typer.Option(help="Encounters for each number of intruders, instead of the experiment's.")
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

    A run that was interrupted or killed goes on with --resume; rows do not depend on how often that happened, nor on
    workers, parts or engine.
    """
    from rich.console import Console

    from wideberth.evaluation.montecarlo.driver import Request, run_montecarlo
    from wideberth.evaluation.montecarlo.experiment import load_experiment
    from wideberth.evaluation.montecarlo.manifest import MANIFEST
    from wideberth.evaluation.montecarlo.plan import Part, find_experiment, parse_part

    overrides = list(set_ or ())
    path = find_experiment(experiment)
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
