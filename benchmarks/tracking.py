"""The tracker against filterpy's Kalman filter with the same 12 states: 40 aircraft, 10 Hz, 1 report a second."""

import numpy as np
from filterpy.kalman import KalmanFilter

from benchmarks.timing import cpu_seconds
from benchmarks.traffic import SIGMA, MadeTraffic
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.motion import axis_model
from wideberth.types import Scan

AIRCRAFT, SECONDS, STEP = 40, 10, 0.1


def with_filterpy(scans: list[Scan]) -> dict[str, KalmanFilter]:
    """Run one 12-state filter for each aircraft: prediction at 10 Hz, update with position and climb rate."""
    phi, noise = axis_model(STEP, 1.0, np.inf, np.inf)
    measured = [0, 4, 8, 9]
    filters: dict[str, KalmanFilter] = {}
    for scan in scans:
        for track in filters.values():
            track.predict()
        for z, name in zip(scan.z, scan.source_ids, strict=True):
            if name not in filters:
                track = filters[name] = KalmanFilter(dim_x=12, dim_z=4)
                track.F, track.Q = np.kron(np.eye(3), phi), np.kron(np.eye(3), noise)
                track.H = np.eye(12)[measured]
                track.R = np.diag(SIGMA[[0, 1, 2, 5]] ** 2)
                track.P *= 100.0
                track.x[[0, 4, 8]] = z[:3, None]
            filters[name].update(z[[0, 1, 2, 5]])
    return filters


def measure() -> dict[str, float]:
    """Return CPU microseconds for an aircraft and second of both ways, and the ratio."""
    traffic = MadeTraffic(AIRCRAFT, 600.0)
    times = [round((k + 1) * STEP, 6) for k in range(int(SECONDS / STEP))]
    scans = [traffic.scan(t, STEP) for t in times]

    def ours() -> None:
        tracker = AdsbKalmanTracker(AdsbKalmanConfig())
        for t, scan in zip(times, scans, strict=True):
            tracks, _ = tracker.step(t, [scan])
        if len(tracks) != AIRCRAFT:
            raise RuntimeError(f"{len(tracks)} tracks of {AIRCRAFT} aircraft")

    ours_seconds = cpu_seconds(ours)
    filterpy_seconds = cpu_seconds(lambda: with_filterpy(scans), repeats=3)
    return {
        "microseconds_per_aircraft_second": ours_seconds / (AIRCRAFT * SECONDS) * 1e6,
        "filterpy_microseconds_per_aircraft_second": filterpy_seconds / (AIRCRAFT * SECONDS) * 1e6,
        "ratio_to_filterpy": filterpy_seconds / ours_seconds,
    }
