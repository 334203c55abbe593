"""Files of radar plots and tracks that are made, with errors that are known."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from wideberth.part_config import PartConfig
from wideberth.plots import Plots
from wideberth.sensors.radar.plot_file import PlotTruth
from wideberth.tracking.track_table import TrackTable

POSITION_SIGMA, VELOCITY_SIGMA, ACCELERATION_SIGMA = 1.0, 0.2, 0.5
SIGMA = np.repeat([POSITION_SIGMA, VELOCITY_SIGMA, ACCELERATION_SIGMA], 3)


def made_truth(n_scans: int = 150, onboard: bool = False) -> PlotTruth:
    """Two aircraft 200 m apart; the second leaves for the last tenth. Without a radar on board the first is ours."""
    t = 0.1 * np.arange(n_scans)[:, None, None]
    velocity = np.broadcast_to(np.array([[10.0, 0.0, 0.0], [-8.0, 3.0, 1.0]]), (n_scans, 2, 3)).copy()
    position = np.array([[-100.0, 0.0, -200.0], [150.0, 120.0, -180.0]]) + t * velocity
    visible = np.ones((n_scans, 2), dtype=np.bool_)
    visible[n_scans - n_scans // 10 :, 1] = False
    return PlotTruth(position, velocity, visible, -1 if onboard else 0)


def made_arrays(truth: PlotTruth, seeds: int = 2, onboard: bool = False) -> dict[str, Any]:
    """The arrays of a file of plots without noise: each visible target in each scan, and some clutter."""
    n_scans = len(truth.position)
    neu = np.array([1.0, 1.0, -1.0])
    rng = np.random.default_rng(5)
    own = np.linspace([-50.0, -30.0, 150.0], [60.0, 10.0, 160.0], n_scans)
    rows = []
    for seed in range(seeds):
        for k in range(n_scans):
            for target in np.flatnonzero(truth.visible[k]):
                relative = truth.position[k, target] * neu - (own[k] if onboard else 0.0)
                r = float(np.linalg.norm(relative))
                rows.append((seed, k, r, np.arctan2(relative[1], relative[0]), np.arcsin(relative[2] / r)))
            if k % 7 == seed:
                rows.append((seed, k, rng.uniform(50, 500), rng.uniform(-3, 3), rng.uniform(0, 1)))
    columns = np.array(rows).T
    t = 0.1 * np.arange(n_scans)
    arrays: dict[str, Any] = {
        "meas_seed": columns[0].astype(np.int32),
        "meas_scan": columns[1].astype(np.int32),
        "meas_time": t[columns[1].astype(int)],
        "meas_range": columns[2],
        "meas_az": columns[3],
        "meas_el": columns[4],
        "time": t,
        "sigma": np.array([0.4, 0.017, 0.017]),
        "p_d": 0.9,
        "r_max": 600.0,
        "dt": 0.1,
        "truth_pos": truth.position * neu,
        "truth_vel": truth.velocity * neu,
        "truth_visible": truth.visible,
        "ownship_id": truth.ownship,
    }
    if onboard:
        arrays |= {"own_pos": own, "own_vel": np.gradient(own, t, axis=0), "own_att": np.zeros((n_scans, 3))}
    return arrays


def save(path: Path, arrays: dict[str, Any], *, without: tuple[str, ...] = (), **changed: Any) -> Path:
    """Write a file of plots with some arrays left out or changed."""
    np.savez(path, **{name: array for name, array in {**arrays, **changed}.items() if name not in without})
    return path


def table_of(rows: list[tuple[int, int, Any]], P: Any = None, ownship: tuple[int, ...] = ()) -> TrackTable:
    """A table of rows (scan, track, position and velocity), sorted by scan."""
    rows = sorted(rows, key=lambda row: row[0])
    n = len(rows)
    x = np.zeros((n, 9))
    for k, (_, _, state) in enumerate(rows):
        x[k, : len(state)] = state
    return TrackTable(
        scan=np.array([row[0] for row in rows], dtype=np.int32),
        track_id=np.array([row[1] for row in rows], dtype=np.int64),
        x=x,
        P=np.tile(np.eye(9) if P is None else P, (n, 1, 1)),
        existence=np.ones(n),
        is_ownship=np.array([row[1] in ownship for row in rows], dtype=np.bool_),
    )


def made_table(truth: PlotTruth, rng: np.random.Generator, from_scan: int = 0) -> TrackTable:
    """A track for each visible target from `from_scan` on, with white errors that its covariance tells of rightly."""
    scan, target = np.nonzero(truth.visible)
    kept = scan >= from_scan
    scan, target = scan[kept], target[kept]
    x = np.zeros((len(scan), 9))
    x[:, :3], x[:, 3:6] = truth.position[scan, target], truth.velocity[scan, target]
    x += rng.normal(size=x.shape) * SIGMA
    return TrackTable(
        scan=scan.astype(np.int32),
        track_id=target.astype(np.int64) + 1,
        x=x,
        P=np.tile(np.diag(SIGMA**2), (len(scan), 1, 1)),
        existence=np.ones(len(scan)),
        is_ownship=target == truth.ownship,
    )


class MadeTracker:
    """Tracks made from the truth, which a test gives beforehand."""

    Config = PartConfig
    truth: ClassVar[PlotTruth]
    seen: ClassVar[list[Plots]] = []

    def __init__(self, config: PartConfig) -> None:
        self.config = config

    def run(self, plots: Plots) -> TrackTable:
        self.seen.append(plots)
        table = made_table(self.truth, np.random.default_rng(len(plots.z)), from_scan=5)
        kept = table.scan < plots.n_scans
        return TrackTable(
            scan=table.scan[kept],
            track_id=table.track_id[kept],
            x=table.x[kept],
            P=table.P[kept],
            existence=table.existence[kept],
            is_ownship=table.is_ownship[kept],
            counters={"plots that are not finite": int((~np.isfinite(plots.z[:, :3]).all(axis=1)).sum())},
        )


class NoTracks:
    """A tracker that never confirms anything."""

    Config = PartConfig

    def __init__(self, config: PartConfig) -> None:
        self.config = config

    def run(self, plots: Plots) -> TrackTable:
        return table_of([])
