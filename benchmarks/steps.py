"""CPU time of one pipeline step, scans to decision, with more and more aircraft."""

import time

import numpy as np

from benchmarks.traffic import MadeTraffic
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner
from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detector import AdsbDetector
from wideberth.pipeline import Pipeline
from wideberth.simulation.modelled_sensors import ReceivedTraffic
from wideberth.simulation.world import SimWorld
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import Mission
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass

AIRCRAFT = (1, 10, 40, 200)
STEP, WARM_SECONDS, SECONDS = 0.1, 10.0, 170.0
ALTITUDE, SPEED = 1200.0, 41.0
STAGES = ("tracking", "conflict", "avoidance")


def measure(aircraft: int) -> dict[str, float]:
    """Return the CPU milliseconds of a step over 170 s of flight through `aircraft` others, and how busy it was.

    The ownship flies what it is told to. One aircraft comes head on, so that no run is without a maneuver.
    """
    vehicle = PointMass(PointMassConfig())
    planner = LocalLevelPlanner(LocalLevelConfig(), vehicle.params)
    pipeline = Pipeline(
        AdsbKalmanTracker(AdsbKalmanConfig()), AdsbDetector(DetectionConfig()), planner, 120.0, time.process_time
    )
    traffic = MadeTraffic(aircraft, ALTITUDE)
    waypoints = np.array([[0, 0, -ALTITUDE], [20_000, 0, -ALTITUDE]], float)
    world = SimWorld(Mission(waypoints, np.full(2, SPEED), 0.0), vehicle, traffic, [ReceivedTraffic(traffic)])
    spent, maneuvers = [], 0
    stages = dict.fromkeys(STAGES, 0.0)
    for k in range(round((WARM_SECONDS + SECONDS) / STEP)):
        t = round((k + 1) * STEP, 6)
        ownship, scans = world.sense(t)
        mission = world.mission
        start = time.process_time()
        snapshot = pipeline.step(t, ownship, scans, mission)
        if t > WARM_SECONDS:
            spent.append(time.process_time() - start)
            maneuvers += snapshot.maneuver is not None
            for stage in STAGES:
                stages[stage] += snapshot.stage_times[stage]
        world.actuate(t, snapshot.maneuver)
    milliseconds = np.array(spent) * 1e3
    return {
        "mean_ms": float(milliseconds.mean()),
        "median_ms": float(np.median(milliseconds)),
        "p95_ms": float(np.percentile(milliseconds, 95)),
        "max_ms": float(milliseconds.max()),
        **{f"mean_{stage}_ms": stages[stage] / len(spent) * 1e3 for stage in STAGES},
        "tracks": float(len(snapshot.tracks)),
        "share_with_maneuver": maneuvers / len(spent),
    }
