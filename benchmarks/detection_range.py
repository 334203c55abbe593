"""Minimum detection ranges: CPU time of an evaluation in a batch, as in the thesis, table 2.4 (30,000 samples)."""

from typing import Any

import numpy as np

from benchmarks.timing import cpu_seconds
from wideberth.analysis.detection_range import COLLISION_AVOIDANCE, METHODS, minimum_detection_range, simulate_cpa
from wideberth.analysis.encounter_angle import required_range
from wideberth.units import KNOT

SAMPLES = 30_000
THESIS = {"tgvv": 1.77e-2, "gvv": 2.01e-5, "tt": 1.19e-6, "gt": 2.27e-6}  # s, table 2.4
BEARINGS, SPEEDS = 360, 10


def measure() -> dict[str, float]:
    """Return microseconds of each method, with the ratio to the thesis, of a simulation and of a bearing."""
    random = np.random.default_rng(4)
    # Around the nominal values, so that both cases of both methods occur.
    arguments: dict[str, Any] = {
        name: value * random.uniform(0.5, 1.5, SAMPLES) for name, value in COLLISION_AVOIDANCE.items()
    }
    arguments["turn_angle"] = COLLISION_AVOIDANCE["turn_angle"] * random.uniform(1 / 3, 1.0, SAMPLES)
    speed = random.uniform(5.0, 300.0, SAMPLES) * KNOT
    numbers = {}
    for method in METHODS:
        seconds = cpu_seconds(lambda m=method: minimum_detection_range(method=m, ownship_speed=speed, **arguments))  # type: ignore[misc]
        numbers[f"{method}_microseconds"] = seconds / SAMPLES * 1e6
        numbers[f"{method}_ratio_to_thesis"] = THESIS[method] / (seconds / SAMPLES)
    distance = minimum_detection_range(method="tgvv", ownship_speed=speed, **arguments).distance
    without_radius: dict[str, Any] = {name: value for name, value in arguments.items() if name != "safety_radius"}
    seconds = cpu_seconds(lambda: simulate_cpa(distance, ownship_speed=speed, **without_radius))
    numbers["simulation_microseconds"] = seconds / SAMPLES * 1e6
    bearings = np.radians(np.arange(BEARINGS))[:, None]
    nominal: dict[str, Any] = {**COLLISION_AVOIDANCE, "intruder_speed": np.linspace(10.0, 200.0, SPEEDS) * KNOT}
    seconds = cpu_seconds(lambda: required_range(bearings, ownship_speed=25.0 * KNOT, **nominal), repeats=3)
    numbers["any_bearing_microseconds"] = seconds / (BEARINGS * SPEEDS) * 1e6
    return numbers
