"""`wideberth replay`: a recording run again, and its report."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from wideberth.config import ScenarioConfig
    from wideberth.recording import Recording

DIFFERENT = 1


def replay(
    recording: Annotated[Path, typer.Argument(help="A recording.mcap, whole or torn.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write the report again, into this folder.")
    ] = None,
) -> None:
    """Run a recording's inputs through the pipeline again and compare every decision, bit for bit.

    Exits with 1 where one differs.
    """
    import time

    from rich.console import Console
    from rich.progress import Progress

    from wideberth.assembly import build_pipeline
    from wideberth.config import build_scenario
    from wideberth.evaluation.replay_check import replay as run_again
    from wideberth.recording import read_recording

    console = Console(highlight=False, markup=False, soft_wrap=True)
    recorded = read_recording(recording)
    console.print(f"{recording}: {recorded.message}")
    scenario = build_scenario(recorded.scenario, source=f"the scenario in {recording}")
    pipeline = build_pipeline(scenario, time.process_time, live=recorded.live)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("replay", total=recorded.step_count)
        result = run_again(recorded, pipeline, lambda count: progress.update(task, completed=count))
    if out is not None:
        _write_report(out, recorded, scenario)
        console.print(f"report: {out / 'report.html'}")
    if result.identical:
        console.print(f"identical: {result.steps} steps")
        return
    assert result.t is not None
    after = result.t - recorded.t_start
    console.print(
        f"different at {after:.3f} s (step {result.steps} of {recorded.step_count}): {result.field}\n"
        f"  recorded {result.recorded}\n  replayed {result.replayed}"
    )
    raise typer.Exit(DIFFERENT)


def _write_report(out: Path, recorded: "Recording", scenario: "ScenarioConfig") -> None:
    import json

    from wideberth.errors import InputError
    from wideberth.evaluation.report import write_report

    summary = recorded.summary if recorded.summary is not None else _score(recorded, scenario)
    write_report(out, recorded, summary)
    try:
        (out / "summary.json").write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write the summary into {out}: {error.strerror or error}") from error


def _score(recorded: "Recording", scenario: "ScenarioConfig") -> dict[str, Any]:
    """Score a run that did not end: from the recorded true states, with the ownship where it knew itself to be."""
    from wideberth.evaluation.metrics import RunMetrics

    metrics = RunMetrics.of(scenario.evaluation)
    index = 0
    for step in recorded.steps():
        metrics.update(step.t, step.ownship.position, step.ownship.velocity, step.truth)
        metrics.observe(step.snapshot)
        index = step.snapshot.mission_index
    summary = metrics.summary(
        seed=scenario.seed,
        mission=recorded.mission,
        mission_completed=recorded.mission is not None and index >= len(recorded.mission.waypoints),
    )
    summary["notes"].append("scored again from an unfinished recording, at the pipeline's steps")
    return summary
