"""The simplest tracker that shows what registration is worth: nearest neighbour, constant velocity, M of N."""

import itertools
from collections.abc import Sequence

import numpy as np

from wideberth.tracking import motion_kernels, radar_kernels, update_kernels
from wideberth.types import FloatArray, Scan, Track, TrackStatus

CV = motion_kernels.CONSTANT_VELOCITY


class _Kept:
    def __init__(self, name: str, t: float, x: FloatArray, p: FloatArray, sensor: str) -> None:
        self.name, self.t, self.x, self.p, self.seen = name, t, x, p, t
        self.hits, self.sensors = 1, {sensor: t}


class NearestTracker:
    """Each plot updates the track with the smallest innovation within the gate, or starts one."""

    def __init__(self, *, q: float = 1.0, gate: float = 16.0, lost_after: float = 4.0, confirm: int = 4) -> None:
        self._q, self._gate, self._lost_after, self._confirm = np.full(3, q), gate, lost_after, confirm
        self._numbers = itertools.count(1)
        self._kept: list[_Kept] = []

    def step(self, t: float, scans: Sequence[Scan]) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        for scan in sorted(scans, key=lambda s: s.t):
            used: set[str] = set()
            for z, r, when in zip(scan.z, scan.R, scan.t_valid, strict=True):
                self._plot(scan, z, r.diagonal(), when, used)
        # A track with one or two plots dies sooner: clutter.
        self._kept = [k for k in self._kept if t - k.seen <= (self._lost_after if k.hits >= self._confirm else 1.5)]
        return tuple(self._track(t, k) for k in self._kept), ()

    def _predict(self, kept: _Kept, t: float) -> None:
        motion_kernels.predict(CV, t - kept.t, self._q, kept.x, kept.p, np.zeros((6, 6)), np.zeros((6, 6)))
        kept.t = t

    def _plot(self, scan: Scan, z: FloatArray, variance: FloatArray, t: float, used: set[str]) -> None:
        best, nearest = None, self._gate
        seen, plot, slopes = np.zeros(3), np.zeros(3), np.zeros((3, 3))
        for kept in self._kept:
            if kept.name in used or t < kept.t - 1.0:
                continue
            self._predict(kept, max(t, kept.t))
            radar_kernels.to_sensor(scan.sensor_position, scan.sensor_attitude, kept.x, seen)
            radar_kernels.to_plot(seen, plot)
            radar_kernels.plot_jacobian(seen, scan.sensor_attitude, slopes)
            h = np.zeros((3, 6))
            h[:, :3] = slopes
            innovation = z[:3] - plot
            innovation[1] = radar_kernels.wrap(innovation[1])
            x, p = kept.x.copy(), kept.p.copy()
            nis, _ = update_kernels.update(6, 3, x, p, h, innovation, variance[:3].copy(), np.zeros((2, 6)))
            if nis < nearest:
                best, nearest = (kept, x, p), nis
        if best is not None:
            kept, kept.x, kept.p = best
            kept.seen, kept.hits = t, kept.hits + 1
            kept.sensors[scan.sensor] = t
            used.add(kept.name)
            return
        position, covariance = np.zeros(3), np.zeros((3, 3))
        elevation = 0.0 if np.isnan(z[2]) else z[2]
        radar_kernels.to_position(scan.sensor_position, scan.sensor_attitude, z[0], z[1], elevation, position)
        sigma = np.sqrt(np.nan_to_num(variance[:3], nan=0.01))
        radar_kernels.plot_covariance(scan.sensor_attitude, z[0], z[1], elevation, sigma, covariance)
        p = np.diag([0.0, 0.0, 0.0, 900.0, 900.0, 25.0])
        p[:3, :3] = covariance
        name = str(next(self._numbers))
        self._kept.append(_Kept(name, t, np.concatenate([position, np.zeros(3)]), p, scan.sensor))
        used.add(name)

    def _track(self, t: float, kept: _Kept) -> Track:
        x, p = kept.x.copy(), kept.p.copy()
        dt = t - kept.t
        motion_kernels.predict(CV, dt, self._q, x, p, np.zeros((6, 6)), np.zeros((6, 6)))
        covariance = np.eye(9)
        covariance[:6, :6] = p
        status = TrackStatus.TENTATIVE
        if kept.hits >= self._confirm:
            status = TrackStatus.CONFIRMED if t - kept.seen < 1.5 else TrackStatus.COASTING
        sources = tuple(s for s, when in kept.sensors.items() if t - when < 2.0)
        return Track(kept.name, t, x[:3], x[3:], np.zeros(3), covariance, status, kept.seen, 1.0, False, sources)
