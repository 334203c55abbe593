"""A file of plots through the tracker: checked, compiled, and put into a table."""

import math
from collections import Counter
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.tracking.multi_target.bank_kernels import grown_bank
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.intake import ROTATION_TOLERANCE, SensorLog, detection_table, pose_fault
from wideberth.tracking.multi_target.scan_kernels import Table, make_table, run_scans
from wideberth.tracking.multi_target.state import TrackerState
from wideberth.tracking.ownship import telemetry_covariance
from wideberth.tracking.track_table import TrackTable
from wideberth.types import DetectionModel

FloatArray = NDArray[np.float64]

_ROWS_PER_SCAN = 8


def run_file(config: MultiTargetConfig, plots: Plots, words: Mapping[int, str]) -> TrackTable:
    """Return the confirmed tracks of a file of plots.

    Scans that are late are rejected: in a file of one sensor time does not go back.

    Parameters
    ----------
    config : MultiTargetConfig
    plots : Plots
    words : mapping of int to str
        Names of the kernels' counters.

    Returns
    -------
    TrackTable
    """
    counters: Counter[str] = Counter()
    use, velocity = _usable(config, plots, counters)
    state = TrackerState(config)
    largest = int(np.diff(plots.first).max(initial=0))
    state.reserve(1, largest)
    n = plots.n_scans
    table = make_table(_ROWS_PER_SCAN * n + 2 * config.window_plots)
    model = DetectionModel(np.array([plots.range_max]), np.array([plots.detection_probability]))
    ranges, probabilities = detection_table(model, config)
    variance = plots.variances()
    covariance = telemetry_covariance(config.ownship)
    scan, rows = 0, 0
    while True:
        scan, rows = run_scans(
            state.bank,
            state.window,
            state.motion,
            state.rules,
            state.clutter,
            plots.first,
            plots.t,
            use,
            plots.z,
            variance,
            plots.sensor_position,
            velocity,
            plots.sensor_attitude,
            np.array(plots.field_of_view, dtype=np.float64),
            ranges,
            probabilities,
            plots.ownship,
            covariance,
            state.test,
            scan,
            rows,
            table,
            state.counts,
            state.scratch,
        )
        if scan == n:
            break
        births = min(config.window_plots, largest)
        if state.bank.size[0] + births > len(state.bank.mu):
            state.bank = grown_bank(state.bank)
            state.reserve(1, largest)
        else:
            table = _grown(table, rows)
    for place, name in words.items():
        counters[name] += int(state.counts[place])
    updated = table.nis_dof[:rows] > 0.0
    return TrackTable(
        scan=table.scan[:rows].astype(np.int32),
        track_id=table.identity[:rows].copy(),
        x=table.x[:rows].copy(),
        P=table.p[:rows].copy(),
        existence=table.existence[:rows].copy(),
        is_ownship=table.ownship[:rows].copy(),
        counters={name: count for name, count in counters.items() if count},
        nis=table.nis[:rows][updated],
        nis_dof=table.nis_dof[:rows][updated],
    )


def _usable(config: MultiTargetConfig, plots: Plots, counters: Counter[str]) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which scans can be used, and the sensor's velocity in each."""
    n = plots.n_scans
    use, velocity = np.ones(n, np.bool_), np.zeros((n, 3))
    last, log = -math.inf, SensorLog(0)
    still = bool((plots.sensor_position == plots.sensor_position[:1]).all())
    faults = _pose_faults(plots.sensor_position, plots.sensor_attitude)
    times = plots.t.tolist()
    for k, t in enumerate(times):
        reason = faults.get(k)
        if not math.isfinite(t):
            reason = "scan time not finite"
        elif t < last:
            reason = "scan too late"
        elif t == last and log.is_repeat(t, plots.z[plots.first[k] : plots.first[k + 1]]):
            reason = "scan repeated"
        elif reason is None and not still:
            if not log.moves_to(t, plots.sensor_position[k], config.sensor_speed_max_mps):
                reason = "sensor jumped"
            velocity[k] = log.velocity
        if reason is not None:
            use[k] = False
            counters[reason] += 1
            continue
        if k + 1 < n and times[k + 1] == t:
            log.is_repeat(t, plots.z[plots.first[k] : plots.first[k + 1]])
        last = t
    return use, velocity


def _pose_faults(position: FloatArray, attitude: FloatArray) -> dict[int, str]:
    """Return what is wrong with the pose of each scan where something is."""
    square = np.einsum("kij,klj->kil", attitude, attitude)
    sound = np.isfinite(position).all(axis=1) & (np.abs(square - np.eye(3)).max(axis=(1, 2)) <= ROTATION_TOLERANCE)
    sound &= np.linalg.det(np.where(sound[:, None, None], attitude, np.eye(3))) > 0.0
    faults = {int(k): pose_fault(position[k], attitude[k]) for k in np.flatnonzero(~sound)}
    return {k: fault for k, fault in faults.items() if fault is not None}


def _grown(table: Table, rows: int) -> Table:
    larger = make_table(2 * len(table.scan))
    for new, old in zip(larger, table, strict=True):
        new[:rows] = old[:rows]
    return larger
