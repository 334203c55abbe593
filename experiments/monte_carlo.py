"""The two Monte Carlo experiments in full, and with what the paper leaves open read otherwise.

Run as ``python -m experiments.monte_carlo`` from the project's root; ``--help`` lists the options.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from experiments.monte_carlo_page import markdown
from wideberth import __version__
from wideberth.errors import InputError
from wideberth.evaluation.montecarlo.driver import Progress as State
from wideberth.evaluation.montecarlo.driver import Request, run_montecarlo
from wideberth.evaluation.montecarlo.experiment import load_experiment

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"
FRESH_SEED = 20261126
LISTED = 20  # of what entered the volume


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run of an experiment.

    Attributes
    ----------
    title : str
    overrides : tuple of str
        As for ``--set``.
    seed, encounters : int or None
        As for `driver.Request`.
    """

    title: str
    overrides: tuple[str, ...] = ()
    seed: int | None = None
    encounters: int | None = None


# The alarm of the collision set is set for each altitude error, as whoever knows a sensor's errors would.
BIAS = ("errors.altitude=bias", "scoring.alarm_probability=0.006", "scoring.early_alarm_probability=0.18")
PRINTED_COLLISION = (
    *("avoidance.map=collision_38", "avoidance.trigger_sigmas=1.0", "avoidance.beyond_s=0.0"),
    *("avoidance.trigger_lookahead_s=15.0", "avoidance.climb_share=1.0"),
)
RUNS = {
    "adsb_collision": (
        Run(title="as in the file"),
        Run(title="fresh seed", seed=FRESH_SEED),
        Run(title="constant altitude error", overrides=BIAS),
        Run(title="constant altitude error, fresh seed", overrides=BIAS, seed=FRESH_SEED),
        Run(title="position error begins at zero", overrides=("errors.start=zero",), encounters=4000),
        Run(title="both of these", overrides=(*BIAS, "errors.start=zero"), encounters=4000),
        Run(title="planner as printed", overrides=PRINTED_COLLISION, encounters=4000),
    ),
    "adsb_self_separation": (
        Run(title="as in the file"),
        Run(title="fresh seed", seed=FRESH_SEED),
        Run(title="constant altitude error", overrides=("errors.altitude=bias",)),
        Run(title="position error begins at zero", overrides=("errors.start=zero",)),
        Run(title="planner as printed", overrides=("avoidance.map=self_separation_150",), encounters=400),
    ),
}


def main(arguments: Sequence[str]) -> int:
    """Run, and write the results; return the exit status."""
    options = parse(arguments)
    console = Console(stderr=True)
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        for name in options.experiments:
            runs = [fly(name, number, run, options, console) for number, run in enumerate(RUNS[name])]
            results = {"experiment": name, "wideberth": __version__, "runs": runs}
            page = markdown(results)
            target = options.out / name
            text = json.dumps(results, indent=1, allow_nan=False) + "\n"
            target.with_suffix(".json").write_text(text, encoding="utf-8")
            target.with_suffix(".md").write_text(page, encoding="utf-8")
            print(page)
            console.print(f"written: {target}.json, {target}.md", soft_wrap=True)
    except InputError as error:
        console.print(str(error), style="red", markup=False)
        return 2
    except KeyboardInterrupt:
        console.print(f"interrupted; remove {options.work} and run again", style="red", soft_wrap=True)
        return 130
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(prog="python -m experiments.monte_carlo", description=__doc__)
    parser.add_argument("experiments", nargs="*", default=list(RUNS), metavar="EXPERIMENT", help=" or ".join(RUNS))
    parser.add_argument("--encounters", type=int, help="for each number of intruders, instead of the full count")
    parser.add_argument("--workers", type=int, help="threads (default: one for each CPU)")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the results (default: docs/results)")
    parser.add_argument("--work", type=Path, default=Path("out/monte_carlo"), help="folder of the rows and reports")
    options = parser.parse_args(arguments)
    for name in options.experiments:
        if name not in RUNS:
            parser.error(f"unknown experiment '{name}', there are: {', '.join(RUNS)}")
    return options


def fly(name: str, number: int, run: Run, options: argparse.Namespace, console: Console) -> dict[str, Any]:
    """Run one, and return what is kept of its summary."""
    path = ROOT / "experiments" / f"{name}.toml"
    encounters = options.encounters or run.encounters
    request = Request(
        experiment=load_experiment(path, run.overrides),
        out=options.work / name / str(number),
        seed=run.seed,
        encounters=encounters,
        workers=options.workers,
        settings={"experiment_path": f"experiments/{name}.toml", "overrides": list(run.overrides)},
    )
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(f"{name}, {run.title}", total=None)

        def watch(state: State) -> None:
            bar.update(task, completed=state.rows, total=state.rows_total or None)

        outcome = run_montecarlo(request, watch)
    if outcome.stopped or outcome.summary is None:
        raise KeyboardInterrupt
    command = f"wideberth montecarlo {name} --out out/{name}"
    command += f" --seed {run.seed}" if run.seed is not None else ""
    command += f" --encounters {encounters}" if encounters is not None else ""
    command += "".join(f" --set {override}" for override in run.overrides)
    return {"title": run.title, "command": command, **kept(outcome.summary, whole=number == 0)}


def kept(summary: dict[str, Any], whole: bool) -> dict[str, Any]:
    """Return the numbers of a summary that are kept: all of the first run, the pooled ones of the others."""
    keys = ["pooled", "criteria", "block_times"]
    if whole:
        keys += ["by_intruders", "ideal_detector", "notes"]
    result = {key: summary[key] for key in keys}
    result["detectors"] = [
        {key: value for key, value in detector.items() if whole or key not in ("curve", "by_intruders")}
        for detector in summary["detectors"]
    ]
    entered = summary["worst_encounters"]["entered"]
    result["entered_count"], result["entered"] = len(entered), entered[:LISTED]
    ideal = summary["ideal_detector"]
    result["ideal_p_fa"] = ideal["p_fa_at_our_p_cd"]
    result["p_fa_ratio"] = ideal["our_p_fa_ratio"]
    return result


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
