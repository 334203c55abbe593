"""How well avoidance does among recorded traffic: missions found in a recording, flown without and with it.

Run as ``python -m experiments.real_traffic_missions`` from the project's root; ``--help`` lists the options.
"""

import argparse
import json
import multiprocessing
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from experiments.loss_causes import Flight, FlightLog
from experiments.mission_results import NAMES, VOLUMES, markdown, summarise
from wideberth import __version__, kernel_modules
from wideberth.assembly import MARGIN, LoadedRecording, load_recording
from wideberth.config import ScenarioConfig, apply_override, build_scenario, read_toml
from wideberth.errors import InputError
from wideberth.evaluation.mission_search import SampledTraffic, SearchResult, SearchSettings, search_missions
from wideberth.evaluation.mission_set import write_mission_set
from wideberth.run import OVERTIME, run_scenario
from wideberth.simulation.config import RecordedTrafficConfig
from wideberth.simulation.mission import read_mission_file
from wideberth.simulation.recorded import RecordedTraffic

ROOT = Path(__file__).resolve().parents[1]
SCENARIO = ROOT / "scenarios" / "real_traffic.toml"
RESULTS = ROOT / "docs" / "results"
TRAFFIC = "../shared/data/adsb/trajectories_213_aircraft.json.gz"


def main(arguments: Sequence[str]) -> int:
    """Search, fly, and write the results; return the exit status."""
    options = parse(arguments)
    console = Console(stderr=True)
    try:
        results = evaluate(options, console)
    except InputError as error:
        console.print(str(error), style="red", markup=False)
        return 2
    page = markdown(results)
    options.out.mkdir(parents=True, exist_ok=True)
    target = options.out / "real_traffic_missions"
    target.with_suffix(".json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    target.with_suffix(".md").write_text(page, encoding="utf-8")
    print(page)
    console.print(f"written: {target}.json, {target}.md", soft_wrap=True)
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(prog="python -m experiments.real_traffic_missions", description=__doc__)
    parser.add_argument("--traffic", default=TRAFFIC, help="the recording (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=20261124, help="of the search (default: %(default)s)")
    parser.add_argument("--count", type=int, default=50, help="missions that pass the filter (default: %(default)s)")
    parser.add_argument("--outside", type=int, default=10, help="missions that do not (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the results (default: docs/results)")
    parser.add_argument("--missions-out", type=Path, default=Path("out/real_traffic_missions"), help="of the missions")
    parser.add_argument(
        "--set", action="append", default=[], help="override a key of the scenario, as in wideberth run"
    )
    options = parser.parse_args(arguments)
    if options.count < 0 or options.outside < 0 or options.count + options.outside == 0 or options.workers < 1:
        parser.error("give a positive number of missions and of workers")
    return options


def evaluate(options: argparse.Namespace, console: Console) -> dict[str, Any]:
    """Return the results of the whole evaluation."""
    with console.status("reading the recording"):
        recording = load_recording(options.traffic)
    found, names = search(options, recording, console)
    flown = fly_all([options.missions_out / f"{name}.csv" for name in names], options, recording, console)
    for mission, entry in zip(flown, found.missions, strict=True):
        mission["passes"] = entry.passes
    return {
        "traffic": Path(options.traffic).name,
        "seed": options.seed,
        "command": command(options),
        "tries": found.tries,
        "overrides": options.set,
        "wideberth": __version__,
        "sets": {
            "filter": summarise([mission for mission in flown if mission["passes"]]),
            "outside": summarise([mission for mission in flown if not mission["passes"]]),
        },
        "missions": flown,
    }


def command(options: argparse.Namespace) -> str:
    """Return the command that gives the same results, without what does not matter to them."""
    words = ["python", "-m", "experiments.real_traffic_missions"]
    if options.traffic != TRAFFIC:
        words += ["--traffic", Path(options.traffic).name]
    words += ["--seed", str(options.seed), "--count", str(options.count), "--outside", str(options.outside)]
    for override in options.set:
        words += ["--set", override]
    return shlex.join(words)


def search(options: argparse.Namespace, recording: LoadedRecording, console: Console) -> tuple[SearchResult, list[str]]:
    """Search missions and write each as a file that `wideberth run --mission` takes; return them and their names."""
    settings = SearchSettings()
    try:
        traffic = SampledTraffic(list(recording.reports), settings)
    except ValueError as error:
        raise InputError(f"no missions in '{options.traffic}': {error}") from None
    columns = (TextColumn("search"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[tries]} tries"))
    with Progress(*columns, TimeElapsedColumn(), console=console) as bar:
        task = bar.add_task("", total=options.count, tries=0)
        result = search_missions(
            traffic,
            settings,
            options.count,
            options.seed,
            outside=options.outside,
            progress=lambda passed, tries: bar.update(task, completed=passed, tries=tries),
        )
        bar.update(task, completed=sum(mission.passes for mission in result.missions), tries=result.tries)
    if len(result.missions) < options.count + options.outside:
        console.print(f"only {len(result.missions)} missions in {result.tries} tries", style="yellow")
    named = write_mission_set(options.missions_out, result, settings, Path(options.traffic).name, options.seed)
    return result, [name for name, _ in named]


def fly_all(
    files: Sequence[Path], options: argparse.Namespace, recording: LoadedRecording, console: Console
) -> list[dict[str, Any]]:
    """Fly every mission without and with avoidance, in processes that share the recording."""
    global _recording
    _recording = recording
    with console.status("compiling kernels"):  # once, and not within the first flight's step times
        for name in kernel_modules.names():
            kernel_modules.warm_up(name)
    columns = (TextColumn("flights"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    flown = []
    with (
        Progress(*columns, console=console) as bar,
        multiprocessing.get_context("fork").Pool(options.workers) as pool,
    ):
        task = bar.add_task("", total=len(files))
        for mission in pool.imap(partial(fly_mission, overrides=tuple(options.set)), files):
            flown.append(mission)
            bar.advance(task)
    return flown


_recording: LoadedRecording | None = None  # handed to the workers by the fork, not by pickling


def fly_mission(file: Path, overrides: tuple[str, ...]) -> dict[str, Any]:
    """Return what a mission file came to, without and with avoidance, and the causes of what went wrong with it."""
    assert _recording is not None
    truth: RecordedTraffic | None = None
    result: dict[str, Any] = {"id": file.stem}
    flight: Flight | None = None
    summary: dict[str, Any] = {}
    for way in ("without", "with"):
        scenario = build(file, way == "with", overrides)
        log = FlightLog()
        summary = run_scenario(scenario, None, log.observe, loaded=_recording)
        if truth is None:
            truth = recorded_truth(scenario, _recording, log.times[0], log.times[-1])
        flight = Flight.of(log, truth)
        result[way] = score(summary, flight)
    assert flight is not None
    result["start_time_s"] = summary["start_time_s"]
    recording_end = max(report.t for report in _recording.reports)
    # Nothing is known of the traffic then, and no loss can be counted.
    result["flown_after_recording_s"] = max(0.0, round(float(flight.times[-1]) - recording_end, 1))
    result["failures"] = failures(summary, flight, result, recording_end)
    return result


def build(file: Path, avoid: bool, overrides: Sequence[str]) -> ScenarioConfig:
    """Return the scenario of a mission."""
    tables = read_toml(SCENARIO)
    config, _ = read_mission_file(file)
    tables["mission"] = config.model_dump(exclude_none=True)
    tables["avoid"] = avoid
    for override in overrides:
        apply_override(tables, override)
    return build_scenario(tables, source=str(SCENARIO), folder=SCENARIO.parent)


def recorded_truth(
    scenario: ScenarioConfig, recording: LoadedRecording, start: float, planned_end: float
) -> RecordedTraffic:
    """Return the true states around a flight, from the same reports as in the run."""
    assert isinstance(scenario.traffic, RecordedTrafficConfig)
    first, last = start - MARGIN, start + 2.0 * (planned_end - start) + OVERTIME + MARGIN
    window = (report for report in recording.reports if first <= report.t <= last)
    return RecordedTraffic(window, scenario.frame(), scenario.traffic.max_gap_s)


def lost(summary: dict[str, Any], volume: str) -> dict[str, float]:
    """Return when each aircraft lost a volume first, Unix s."""
    rows = summary["per_intruder"]
    return {row["id"]: row["first_loss_time_s"][volume] for row in rows if volume in row["first_loss_time_s"]}


def score(summary: dict[str, Any], flight: Flight) -> dict[str, Any]:
    """Return what counts of a run."""
    losses = {volume: sorted(lost(summary, volume)) for volume in VOLUMES}
    losses["sarp_miss_filter"] = flight.filtered_losses("sarp", losses["sarp"])
    return {
        "lost": losses,
        "completed": summary["mission_completed"],
        "maneuvers": summary["maneuvers"],
        "least_bad_maneuvers": summary["least_bad_maneuvers"],
        "reversals": summary["reversals"],
        "alerts": summary["alerts"],
        "detour_ratio": round(summary["path_length_m"] / summary["mission_path_length_m"], 4),
        "duration_s": summary["duration_s"],
        "step_ms": {key: round(value, 4) for key, value in summary["step_time_ms"].items()},
    }


def failures(
    summary: dict[str, Any], flight: Flight, result: dict[str, Any], recording_end: float
) -> list[dict[str, Any]]:
    """Return each aircraft that well clear was lost with, and a mission not completed, with the causes."""
    start = summary["start_time_s"]
    rows = {row["id"]: row for row in summary["per_intruder"]}
    found = []
    for address, t_loss in sorted(lost(summary, "sarp").items(), key=lambda item: item[1]):
        row = rows[address]
        volumes = [v for v in VOLUMES if address in result["with"]["lost"][v]]
        what = f"{NAMES[volumes[0]]} lost"
        if volumes == ["sarp"] and address not in result["with"]["lost"]["sarp_miss_filter"]:
            what += " (not with miss filter)"
        diagnosis = flight.diagnose(address, t_loss)
        if address not in result["without"]["lost"]["sarp"]:
            diagnosis["causes"].append("met only because of the detour")
        found.append(
            {
                "what": what,
                "aircraft": address,
                "callsign": row["callsign"],
                "after_s": round(t_loss - start, 1),
                "closest": [round(row["horizontal_separation_m"], 1), round(row["vertical_separation_m"], 1)],
                **diagnosis,
            }
        )
    if not summary["mission_completed"]:
        elapsed = summary["duration_s"]
        in_maneuver = sum(ids is not None for ids in flight.log.avoided) / max(1, len(flight.log.avoided))
        causes = ["the time for the mission was up", f"{100 * in_maneuver:.0f} % of the flight was avoidance"]
        if (after := start + elapsed - recording_end) > 0:
            causes.append(f"the recording had ended {after:.0f} s before")
        found.append({"what": "not completed", "aircraft": None, "after_s": round(elapsed, 1), "causes": causes})
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
