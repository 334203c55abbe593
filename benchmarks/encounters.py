"""Complete encounters a second: error model, filter, detection at 10 Hz, planning and dynamics; beside BlueSky's.

Ours fly each encounter twice, without and with avoidance; BlueSky flies it once, with avoidance, and knows true states.
"""

from pathlib import Path

from benchmarks import bluesky_encounters
from benchmarks.bluesky_encounters import Encounter, Way
from benchmarks.timing import cpu_seconds
from wideberth.evaluation.montecarlo import tiers
from wideberth.evaluation.montecarlo.experiment import Experiment, load_experiment

EXPERIMENT = Path(__file__).resolve().parents[1] / "experiments" / "adsb_collision.toml"
ENCOUNTERS = {1: 1000, 5: 200}  # by the number of intruders: whole rounds of the 20 starting points
COMPARED = 40  # BlueSky takes a second for each of them at its small step
WAYS = {
    "1_s": Way(1.0, until_passed=True),  # its fastest setting
    "50_ms": Way(0.05, until_passed=True),  # its default
    "1_s_to_180_s": Way(1.0, until_passed=False),
    "50_ms_to_180_s": Way(0.05, until_passed=False),
}


def measure() -> dict[str, float | str]:
    """Return encounters per CPU second on one core, ours and BlueSky's, and the ratios on the same encounters."""
    experiment = load_experiment(EXPERIMENT)
    tiers.prepare(experiment)
    results: dict[str, float | str] = {}
    for intruders, count in ENCOUNTERS.items():
        seconds = seconds_of(experiment, intruders, count)
        results[f"encounters_with_{intruders}_per_cpu_second"] = count / seconds
    return results | beside_bluesky(experiment)


def seconds_of(experiment: Experiment, intruders: int, count: int) -> float:
    """Return the CPU seconds of the first encounters of an experiment."""
    return cpu_seconds(
        lambda: tiers.run_block(experiment, experiment.seed, intruders, 0, count, avoid=True), repeats=3, shortest=0.5
    )


def beside_bluesky(experiment: Experiment) -> dict[str, float | str]:
    """Return what BlueSky makes of the first encounters with one intruder, and how much faster ours are."""
    if bluesky_encounters.installed_version() is None:
        return {"bluesky": "not installed: make bench installs it"}
    rows = tiers.run_block(experiment, experiment.seed, 1, 0, COMPARED, avoid=True)
    encounters = [Encounter(*(row[name] for name in Encounter._fields)) for row in rows.to_pylist()]
    ours_seconds = seconds_of(experiment, 1, COMPARED)
    try:
        flown = bluesky_encounters.fly_apart(encounters, list(WAYS.values()))
    except RuntimeError as error:
        return {"bluesky": f"failed: {error}"}
    results: dict[str, float | str] = {
        "compared_encounters": COMPARED,
        "compared_per_cpu_second": COMPARED / ours_seconds,
        "simulated_s_mean": sum(rows["duration_s"].to_pylist()) / COMPARED,
    }
    for (name, way), theirs in zip(WAYS.items(), flown, strict=True):
        results[f"bluesky_{name}_per_cpu_second"] = COMPARED / theirs.cpu_s
        results[f"ratio_to_bluesky_{name}"] = theirs.cpu_s / ours_seconds
        if way.until_passed:
            results[f"bluesky_{name}_simulated_s_mean"] = theirs.simulated_s / COMPARED
    return results
