"""CPU time of one pipeline step, scans to decision, with more and more aircraft."""

import time

import numpy as np

from benchmarks.traffic import MadeTraffic
from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner
from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detector import AdsbDetector
from wideberth.pipeline import Pipeline
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import Mission, Ownship
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass

AIRCRAFT = (1, 10, 40, 200)
STEP, WARM_SECONDS, SECONDS = 0.1, 10, 60
ALTITUDE, SPEED = 600.0, 41.0


def measure(aircraft: int) -> dict[str, float]:
    """Return the CPU milliseconds of a step over 60 s of flight through `aircraft` others, and how busy the sky was."""
    planner = LocalLevelPlanner(LocalLevelConfig(), PointMass(PointMassConfig()).params)
    pipeline = Pipeline(
        AdsbKalmanTracker(AdsbKalmanConfig()), AdsbDetector(DetectionConfig()), planner, 120.0, time.process_time
    )
    traffic = MadeTraffic(aircraft, ALTITUDE)
    mission = Mission(np.array([[0, 0, -ALTITUDE], [10_000, 0, -ALTITUDE]], float), np.full(2, SPEED), 0.0)
    spent, maneuvers = [], 0
    for k in range(int((WARM_SECONDS + SECONDS) / STEP)):
        t = round((k + 1) * STEP, 6)
        scan = traffic.scan(t, STEP)
        ownship = Ownship(t, np.array([SPEED * t, 0.0, -ALTITUDE]), np.array([SPEED, 0.0, 0.0]))
        start = time.process_time()
        snapshot = pipeline.step(t, ownship, [scan], mission)
        if t > WARM_SECONDS:
            spent.append(time.process_time() - start)
            maneuvers += snapshot.maneuver is not None
    milliseconds = np.array(spent) * 1e3
    return {
        "mean_ms": float(milliseconds.mean()),
        "p95_ms": float(np.percentile(milliseconds, 95)),
        "max_ms": float(milliseconds.max()),
        "tracks": float(len(snapshot.tracks)),
        "share_with_maneuver": maneuvers / len(spent),
    }
