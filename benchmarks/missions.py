"""Missions over the ground radar from its plots to their ends, beside BlueSky's modified voltage potential.

BlueSky is given the true states, without a sensor, and flies the same missions among the same aircraft with the same
limits of speed and bank. Intruders fly straight on; the seeds are apart from those of docs/results/ground_radar.md.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks import bluesky_encounters
from benchmarks.bluesky_missions import FlownMission, Limits, Mission, fly_apart
from experiments.ground_radar_runs import Job, fly, scenario_of
from wideberth.assembly import build_traffic
from wideberth.config import ScenarioConfig
from wideberth.simulation.config import CylinderConfig
from wideberth.vehicles.config import PointMassConfig

FIRST_SEED = 30001
RANDOM = 100
SCENARIO_SEEDS = 5  # BlueSky's flights of a scenario are all alike


def measure() -> dict[str, float | str]:
    """Return violations, path lengths and times of missions, ours by radar and BlueSky's by the truth."""
    results: dict[str, float | str] = {}
    fly(Job("gbr_2", "gbr_2", (), 0, True))  # what is only done once should not count
    for scenario, seeds in (("gbr_1", SCENARIO_SEEDS), ("gbr_2", SCENARIO_SEEDS), ("gbr_random", RANDOM)):
        jobs = [Job(scenario, scenario, (), seed, True) for seed in range(FIRST_SEED, FIRST_SEED + seeds)]
        results |= {f"{scenario}_{name}": number for name, number in ours([fly(job) for job in jobs]).items()}
        if bluesky_encounters.installed_version() is not None:
            told = theirs(jobs if scenario == "gbr_random" else jobs[:1])
            results |= {f"{scenario}_bluesky_{name}": number for name, number in told.items()}
    if bluesky_encounters.installed_version() is None:
        results["bluesky"] = "not installed: make bench installs it"
    return results


def ours(rows: Sequence[dict[str, Any]]) -> dict[str, float | str]:
    """Return what came of our flights, given their rows."""
    flown = [
        FlownMission(row["completed"], row["violations"] > 0, row["path_ratio"], row["real_time_factor"])
        for row in rows
    ]
    return summary_of(flown) | {
        "cycle_ms_mean": float(np.mean([row["cycle_ms"]["mean"] for row in rows])),
        "cycle_ms_worst": max(row["cycle_ms"]["max"] for row in rows),
    }


def theirs(jobs: Sequence[Job]) -> dict[str, float | str]:
    """Return what BlueSky makes of the same missions."""
    scenarios = [scenario_of(job) for job in jobs]
    try:
        flown = fly_apart([mission_of(scenario) for scenario in scenarios], limits_of(scenarios[0]))
    except RuntimeError as error:
        return {"failed": str(error)}
    return summary_of(flown)


def summary_of(flown: Sequence[FlownMission]) -> dict[str, float | str]:
    """Return what came of flights."""
    return {
        "flights": float(len(flown)),
        "violating": float(sum(one.violated for one in flown)),
        "not_completed": float(sum(not one.completed for one in flown)),
        "path_ratio_mean": float(np.mean([one.path_ratio for one in flown])),
        "path_ratio_max": max(one.path_ratio for one in flown),
        "times_real_time": float(np.median([one.times_real_time for one in flown])),
    }


def mission_of(scenario: ScenarioConfig) -> Mission:
    """Return a scenario's leg and the true states of its aircraft as it starts, from the leg's beginning."""
    assert scenario.mission is not None
    frame = scenario.frame()
    mission = scenario.mission.mission(frame)
    truth = build_traffic(scenario, mission, frame, 3600.0).truth.truth(mission.t_start)
    begin, end = mission.waypoints[0], mission.waypoints[-1]
    states = np.hstack([truth.positions - begin * (1.0, 1.0, 0.0), truth.velocities])
    states[:, [2, 5]] *= -1.0
    return Mission(float(end[0] - begin[0]), float(mission.speeds[-1]), -float(begin[2]), states.tolist())


def limits_of(scenario: ScenarioConfig) -> Limits:
    """Return the limits of a scenario's ownship, and the volume to keep clear of."""
    vehicle, volume = scenario.ownship.config, scenario.evaluation.collision_volume
    assert isinstance(vehicle, PointMassConfig) and isinstance(volume, CylinderConfig)
    return Limits(
        vehicle.speed_min_mps,
        vehicle.speed_max_mps,
        vehicle.bank_max_deg,
        vehicle.waypoint_capture_m,
        volume.radius_m,
        volume.half_height_m,
        scenario.step_s,
    )
