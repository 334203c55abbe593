"""Our Kalman filter against filterpy's with the same 12 states: 40 aircraft, 10 Hz, 1 report a second."""

import numpy as np
from filterpy.kalman import KalmanFilter

from benchmarks.timing import cpu_seconds
from benchmarks.traffic import SIGMA, MadeTraffic
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.filter_bank import FilterBank
from wideberth.tracking.motion import axis_model
from wideberth.types import FloatArray, Scan

AIRCRAFT, SECONDS, STEP = 40, 10, 0.1
JERK_NOISE, START_VARIANCE = 1.0, 1e4
# The constant-jerk model as printed, so that both filters are the same.
PRINTED = AdsbKalmanConfig(
    acceleration_time_constant_s=None, jerk_time_constant_s=None, jerk_noise_m2_per_s7=JERK_NOISE, step_s=STEP
)


def with_filterpy(scans: list[Scan]) -> dict[str, FloatArray]:
    """Return the last position of each aircraft: prediction at 10 Hz, update with position and climb rate."""
    phi, noise = axis_model(STEP, JERK_NOISE, np.inf, np.inf)
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
                track.P *= START_VARIANCE
                track.x[[0, 4, 8]] = z[:3, None]
            filters[name].update(z[[0, 1, 2, 5]])
    return {name: track.x[[0, 4, 8], 0] for name, track in filters.items()}


def with_ours(scans: list[Scan]) -> dict[str, FloatArray]:
    """Do the same with the tracker's own filters."""
    bank = FilterBank(PRINTED)
    slots: dict[str, int] = {}
    variances = (SIGMA**2).tolist()
    for scan in scans:
        step = round(scan.t / STEP)
        for z, name in zip(scan.z, scan.source_ids, strict=True):
            if name not in slots:
                slot = slots[name] = bank.allocate()
                bank.x[slot, :, 0], bank.p[slot], bank.last[slot] = z[:3], START_VARIANCE * np.eye(4), step
        k = len(scan.source_ids)
        if k:
            heard = [slots[name] for name in scan.source_ids]
            bank.update(heard, [step] * k, scan.z.tolist(), [variances] * k, [(True, True, True, False)] * k, [0.0] * k)
        position, *_ = bank.output(list(slots.values()), scan.t)
    return dict(zip(slots, position, strict=True))


def measure() -> dict[str, float]:
    """Return CPU microseconds for an aircraft and second: filters alone both ways, and the whole tracker."""
    traffic = MadeTraffic(AIRCRAFT, 600.0)
    times = [round((k + 1) * STEP, 6) for k in range(int(SECONDS / STEP))]
    scans = [traffic.sense(t, np.zeros(3)) for t in times]
    theirs = with_filterpy(scans)
    for name, position in with_ours(scans).items():
        np.testing.assert_allclose(position, theirs[name], atol=1e-3)

    def tracker() -> None:
        whole = AdsbKalmanTracker(AdsbKalmanConfig())
        for t, scan in zip(times, scans, strict=True):
            tracks, _ = whole.step(t, [scan])
        if len(tracks) != AIRCRAFT:
            raise RuntimeError(f"{len(tracks)} tracks of {AIRCRAFT} aircraft")

    ours_seconds = cpu_seconds(lambda: with_ours(scans))
    filterpy_seconds = cpu_seconds(lambda: with_filterpy(scans), repeats=3)
    unit = AIRCRAFT * SECONDS / 1e6
    return {
        "filter_microseconds": ours_seconds / unit,
        "filterpy_microseconds": filterpy_seconds / unit,
        "ratio_to_filterpy": filterpy_seconds / ours_seconds,
        "whole_tracker_microseconds": cpu_seconds(tracker) / unit,
    }
