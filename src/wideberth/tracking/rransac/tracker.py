"""R-RANSAC and ER-RANSAC as trackers: scans in, tracks out."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.tracking.rransac.config import ErRransacConfig, RransacArticleConfig, RransacConfig
from wideberth.tracking.rransac.scan_kernels import run_scans, step_scan, write_track
from wideberth.tracking.rransac.settings import settings_of
from wideberth.tracking.rransac.state_kernels import (
    ALIVE,
    GOOD,
    HITS,
    ID,
    IS_OWN,
    N_COUNTS,
    SEEN,
    SPAN,
    make_clock,
    make_tracks,
    make_window,
    make_work,
)
from wideberth.tracking.track_table import TrackTable
from wideberth.types import Ownship, Scan, Track, TrackStatus

FloatArray = NDArray[np.float64]

_COUNTERS = (
    "plot not finite",
    "plot with range not positive",
    "plot beyond the cap for births",
    "plot not at the known altitude",
    "scan repeated",
    "scan late",
    "scan without time or pose",
    "started anew",
    "tracks born",
    "tracks without inliers",
    "tracks merged",
    "tracks pruned",
    "tracks diverged",
    "fits",
    "fits failed",
)
_SPARE_TRACKS = 16  # births before merging and pruning
_SCANS_AT_ONCE = 4096


class RransacTracker:
    """R-RANSAC with a linear model (thesis algorithm 2, section 4.2), and with its presets what repairs it.

    Parameters
    ----------
    config : RransacConfig

    Attributes
    ----------
    counters : dict of str to int
        What was left out, and what became of tracks, in words.
    """

    Config: type[RransacConfig] = RransacConfig
    hears = frozenset({"radar"})

    def __init__(self, config: RransacConfig) -> None:
        self._config = config
        self._settings = settings_of(config)
        self._counts = np.zeros(N_COUNTS, np.int64)
        self._strange_scans = 0
        self._reset()

    def _reset(self) -> None:
        s = self._settings
        self._capacity = s.tracks + _SPARE_TRACKS
        self._window = make_window(s.window, s.plots)
        self._tracks = make_tracks(self._capacity, s.window)
        self._clock = make_clock()
        self._work = make_work(self._capacity, s.window, s.plots)
        self._heard: dict[str, float] = {}

    @property
    def counters(self) -> dict[str, int]:
        """Counts by cause; zero counts are left out."""
        counts = dict(zip(_COUNTERS, self._counts.tolist(), strict=True))
        counts["scan of another kind"] = self._strange_scans
        return {key: n for key, n in counts.items() if n}

    def step(
        self, t: float, scans: Sequence[Scan], ownship: Ownship | None = None
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return the tracks at its end.

        Parameters
        ----------
        t : float
            Time, s.
        scans : sequence of Scan
            Those of kind ``"radar"`` and ``"radar_cone"`` are used, each as one scan of the algorithm. The radar units
            of one array should be put together to one scan: with several, a track outside a unit's view counts as
            missed by it. The second kind says, as the setting `azimuth` does, what the azimuth is.
        ownship : Ownship, optional
            Telemetry, to tell the ownship's track among those of a ground radar.

        Returns
        -------
        tracks : tuple of Track
            All stored tracks, predicted to `t`; those that are not good are tentative.
        events : tuple of str
            What happened, in words.

        Raises
        ------
        ValueError
            If the time is not finite.
        """
        if not math.isfinite(t):
            raise ValueError(f"time {t} is not finite")
        before = self._counts.copy()
        own = np.full(6, np.nan)
        if ownship is not None:
            own = np.concatenate([ownship.position, ownship.velocity])
        for scan in scans:
            if scan.kind not in ("radar", "radar_cone"):
                self._strange_scans += 1
                continue
            self._take(scan, own)
        events = self._events(before)
        return self._answer(t), events

    def _take(self, scan: Scan, own: FloatArray) -> None:
        z = np.ascontiguousarray(scan.z, dtype=np.float64)
        if z.ndim != 2 or z.shape[1] != 4:
            raise ValueError(f"z of a radar scan must have shape (k, 4), got {z.shape}")
        sigma = np.full(3, np.nan)
        if len(scan.R):
            variance = np.asarray(scan.R, dtype=np.float64).diagonal(axis1=1, axis2=2)[:, :3]
            sound = np.isfinite(variance) & (variance > 0.0)
            total = np.where(sound, variance, 0.0).sum(axis=0)
            n = sound.sum(axis=0)
            sigma = np.sqrt(np.divide(total, n, out=np.full(3, np.nan), where=n > 0))
        most = scan.detection.ranges[-1] if scan.detection is not None else math.inf
        # Another sensor may look at the same time; the same sensor may not.
        again = self._heard.get(scan.sensor, math.nan) != scan.t
        self._heard[scan.sensor] = scan.t
        cone = self._settings.cone_azimuth or scan.kind == "radar_cone"
        step_scan(
            self._settings._replace(cone_azimuth=cone),
            self._window,
            self._tracks,
            self._clock,
            self._work,
            float(scan.t),
            np.ascontiguousarray(scan.sensor_position, dtype=np.float64),
            np.ascontiguousarray(scan.sensor_attitude, dtype=np.float64),
            self._sigma(sigma),
            np.array(scan.field_of_view, dtype=np.float64),
            float(most),
            own,
            again,
            z,
            self._counts,
        )

    def _sigma(self, sigma: FloatArray) -> FloatArray:
        sound = np.isfinite(sigma[:3]) & (sigma[:3] > 0.0)
        return np.where(sound, sigma[:3], self._settings.sigma)

    def _events(self, before: NDArray[np.int64]) -> tuple[str, ...]:
        told = (0, 1, 3, 4, 5, 6, 7, 12)
        changed = self._counts - before
        return tuple(f"{_COUNTERS[k]}: {changed[k]}" for k in told if changed[k])

    def _answer(self, t: float) -> tuple[Track, ...]:
        tracks: list[Track] = []
        s, stored = self._settings, self._tracks
        alive = np.flatnonzero(stored.integers[:, ALIVE])
        for i in alive[np.argsort(stored.integers[alive, ID])].tolist():
            x, p = np.empty(9), np.empty((9, 9))
            write_track(s, stored, i, t - float(self._clock.t[0]), self._work, x, p)
            row = stored.integers[i]
            status = TrackStatus.TENTATIVE
            if row[GOOD]:
                fresh = stored.t_update[i] >= self._clock.t[0] and (row[SEEN] or not s.visible_only)
                status = TrackStatus.CONFIRMED if fresh else TrackStatus.COASTING
            tracks.append(
                Track(
                    id=str(row[ID] + 1),
                    t=t,
                    position=x[:3],
                    velocity=x[3:6],
                    acceleration=x[6:],
                    covariance=p,
                    status=status,
                    t_last_update=float(stored.t_update[i]),
                    existence=min(1.0, float(row[HITS]) / max(float(row[SPAN]), 1.0)),
                    is_ownship=bool(row[IS_OWN]),
                    sources=tuple(self._heard),
                )
            )
        return tuple(tracks)

    def run(self, plots: Plots) -> TrackTable:
        """Run over a whole file of plots in compiled calls of many scans, from an empty tracker.

        Parameters
        ----------
        plots : Plots

        Returns
        -------
        TrackTable
            The good tracks of each scan.
        """
        self._reset()
        self._counts[:] = 0
        parts = [self._run_part(plots, k) for k in range(0, max(plots.n_scans, 1), _SCANS_AT_ONCE)]
        scan, track_id, x, p, probability, own, nis = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return TrackTable(
            scan=scan.astype(np.int32),
            track_id=track_id,
            x=x,
            P=p,
            existence=probability,
            is_ownship=own.astype(np.bool_),
            counters=self.counters,
            nis=nis[np.isfinite(nis)],
            nis_dof=np.full(np.isfinite(nis).sum(), float(self._settings.dimensions)),
        )

    def _run_part(self, plots: Plots, start: int) -> tuple[NDArray[Any], ...]:
        stop = min(start + _SCANS_AT_ONCE, plots.n_scans)
        n = (stop - start) * self._settings.tracks
        scan, track_id = np.empty(n, np.int64), np.empty(n, np.int64)
        x, p = np.empty((n, 9)), np.empty((n, 9, 9))
        probability, own, nis = np.empty(n), np.empty(n, np.uint8), np.empty(n)
        rows = run_scans(
            self._settings,
            self._window,
            self._tracks,
            self._clock,
            self._work,
            plots.first[start : stop + 1],
            plots.z,
            plots.t[start:stop],
            plots.sensor_position[start:stop],
            plots.sensor_attitude[start:stop],
            self._sigma(plots.sigma),
            np.array(plots.field_of_view, dtype=np.float64),
            float(plots.range_max),
            float(plots.detection_probability),
            plots.ownship[start:stop],
            self._counts,
            scan,
            track_id,
            x,
            p,
            probability,
            own,
            nis,
        )
        return tuple(column[:rows] for column in (scan + start, track_id, x, p, probability, own, nis))


class RransacArticleTracker(RransacTracker):
    """R-RANSAC with position and velocity, the states that the article prints (section III.B)."""

    Config = RransacArticleConfig


class ErRransacTracker(RransacTracker):
    """ER-RANSAC (thesis 3.2.3): the turning model, and hypotheses by Gauss-Newton or a hybrid of 6.2.2."""

    Config = ErRransacConfig
