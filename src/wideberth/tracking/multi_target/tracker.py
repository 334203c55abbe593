"""The default tracker of radar plots: scans of any number of sensors in, tracks out, nothing to tune."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, Bank, copied_bank, predict_tracks
from wideberth.tracking.multi_target.buffers_kernels import (
    BIRTHS_DEFERRED,
    CONFIRMED_NOW,
    LARGE_CLUSTERS,
    LEFT_VIEW,
    LOST,
    MERGED,
    NOT_SCANNED,
    PLOTS_NOT_FINITE,
    PLOTS_OUT_OF_RANGE,
    PLOTS_SHED,
    TOO_UNCERTAIN,
)
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.file_run import run_file
from wideberth.tracking.multi_target.history import History
from wideberth.tracking.multi_target.intake import ReadyScan, SensorLog, ready, scan_fault
from wideberth.tracking.multi_target.life_kernels import drop_unscanned
from wideberth.tracking.multi_target.scan_kernels import report_tracks
from wideberth.tracking.multi_target.state import TrackerState
from wideberth.tracking.ownship import telemetry_covariance
from wideberth.tracking.ownship_kernels import FLAG
from wideberth.tracking.track_table import TrackTable
from wideberth.types import Ownship, Scan, Track, TrackStatus

FloatArray = NDArray[np.float64]

_FUTURE_S = 0.5
"""Scans this far ahead of the clock are still believed."""

_EVENTS = {
    CONFIRMED_NOW: "track {} confirmed",
    LOST: "track {} lost: no longer seen",
    LEFT_VIEW: "track {} lost: outside every field of view",
    MERGED: "track {} ended: the same aircraft as another",
    TOO_UNCERTAIN: "track {} lost: too uncertain",
    NOT_SCANNED: "track {} lost: no scan for too long",
}

_COUNTERS = {
    PLOTS_NOT_FINITE: "plot not finite",
    PLOTS_OUT_OF_RANGE: "plot out of range",
    PLOTS_SHED: "plot shed",
    BIRTHS_DEFERRED: "birth deferred",
    LARGE_CLUSTERS: "cluster shared out",
}


class MultiTargetTracker:
    """Tracks aircraft that do not say who they are, by the plots of one or more radars.

    Load is shed in this order, and counted: of the plots of a scan that no track explains, more than `window_plots`
    are thinned evenly over the range; of pairs for new tracks no more than `consensus_budget` are fitted; a track
    chooses among its eight nearest plots; clusters with more than `event_limit` joint events are shared out.

    Parameters
    ----------
    config : MultiTargetConfig
    """

    Config = MultiTargetConfig
    hears = frozenset({"radar", "radar_cone", "adsb"})

    def __init__(self, config: MultiTargetConfig) -> None:
        self._config = config
        self._counters: Counter[str] = Counter()
        self._reset()

    def _reset(self) -> None:
        self._state = TrackerState(self._config)
        self._history = History(self._config.late_max_s)
        self._logs: dict[str, SensorLog] = {}
        self._t = -math.inf
        self._t_own = -math.inf
        self._told: set[tuple[int, int]] = set()

    @property
    def counters(self) -> dict[str, int]:
        """Counts of what was left out or shed, by cause; zero counts are left out."""
        counted = Counter(self._counters)
        for place, words in _COUNTERS.items():
            counted[words] += int(self._state.counts[place])
        return {words: n for words, n in counted.items() if n}

    def run(self, plots: Plots) -> TrackTable:
        """Track a whole file of one sensor's plots, from scratch, in one compiled call.

        Parameters
        ----------
        plots : Plots

        Returns
        -------
        TrackTable
            The confirmed tracks inside the field of view, after each scan.
        """
        return run_file(self._config, plots, _COUNTERS)

    def step(
        self, t: float, scans: Sequence[Scan], ownship: Ownship | None = None
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return all tracks at its end.

        Parameters
        ----------
        t : float
            Time, s. A time before the last one by more than `late_max_s` drops all tracks.
        scans : sequence of Scan
            Those of kind ``"radar"`` are used, in order of validity; each has its own pose and detection model.
        ownship : Ownship, optional
            Telemetry, to know the ownship's own track by.

        Returns
        -------
        tracks : tuple of Track
            Predicted to `t`, in the order of their numbers; also the tentative ones.
        events : tuple of str
            What happened, in words.

        Raises
        ------
        ValueError
            If the time is not finite.
        """
        if not math.isfinite(t):
            raise ValueError(f"time {t} is not finite")
        events: list[str] = []
        if t < self._t - self._config.late_max_s:
            n = int(self._state.bank.size[0])
            events.append(f"time went back by {self._t - t:.1f} s: {n} tracks dropped")
            self._counters["time went back"] += 1
            self._reset()
        self._t = max(self._t, t)
        usable = (scan for scan in scans if self._is_radar(scan, events))
        for scan in sorted(usable, key=lambda s: (s.t, s.sensor)):
            self._take_in(t, scan, events)
        drop_unscanned(self._state.bank, self._t, self._config.silent_s, self._state.scratch)
        self._tell(events)
        self._identify(ownship)
        return self._tracks(t), tuple(events)

    def _is_radar(self, scan: Scan, events: list[str]) -> bool:
        if scan.kind != "radar":
            self._counters["scan of another kind"] += 1
            return False
        fault = scan_fault(scan)
        if fault is not None:
            self._reject(scan, fault, events)
        return fault is None

    def _reject(self, scan: Scan, reason: str, events: list[str]) -> None:
        self._counters[reason] += 1
        events.append(f"scan of {scan.sensor} rejected: {reason}")

    def _take_in(self, t: float, scan: Scan, events: list[str]) -> None:
        c, state = self._config, self._state
        if scan.t > t + _FUTURE_S:
            self._reject(scan, "scan time in the future", events)
            return
        if scan.t < state.t - c.late_max_s:
            self._reject(scan, "scan too late", events)
            return
        log = self._logs.setdefault(scan.sensor, SensorLog(len(self._logs)))
        if log.is_repeat(scan.t, scan.z):
            self._reject(scan, "scan repeated", events)
            return
        if not log.moves_to(scan.t, scan.sensor_position, c.sensor_speed_max_mps):
            self._reject(scan, "sensor jumped", events)
            return
        prepared = ready(scan, log, c)
        if prepared.t >= state.t:
            self._history.before(state, prepared)
            state.take_in(prepared)
            self._tell(events)
        elif self._history.insert(state, prepared, lambda s: self._again(s, events)):
            self._counters["scan late, put in order"] += 1
        else:
            self._reject(scan, "scan too late", events)

    def _again(self, scan: ReadyScan, events: list[str]) -> None:
        self._state.take_in(scan)
        self._tell(events)

    def _tell(self, events: list[str]) -> None:
        """Put the kernels' events into words, each once even if scans are run again."""
        s = self._state.scratch
        for code, identity in s.events[: s.event_count[0]].tolist():
            if (code, identity) not in self._told:
                self._told.add((code, identity))
                events.append(_EVENTS[code].format(identity))
            if code not in (CONFIRMED_NOW,):
                self._told.discard((CONFIRMED_NOW, identity))
        s.event_count[0] = 0
        if len(self._told) > 1000:
            oldest = int(self._state.bank.size[1]) - 500
            self._told = {(code, identity) for code, identity in self._told if identity >= oldest}

    def _identify(self, ownship: Ownship | None) -> None:
        now = self._state.t
        dt = now - self._t_own
        if not dt > 0.0:
            return
        telemetry, covariance = np.full(6, math.nan), np.full((6, 6), math.nan)
        if ownship is not None and abs(now - ownship.t) <= self._config.ownship.stale_after_s:
            age = now - ownship.t
            telemetry = np.concatenate([ownship.position + age * ownship.velocity, ownship.velocity])
            covariance = telemetry_covariance(self._config.ownship, ownship.covariance, abs(age))
        self._state.identify_ownship(dt if math.isfinite(self._t_own) else 0.0, telemetry, covariance)
        self._t_own = now

    def _tracks(self, t: float) -> tuple[Track, ...]:
        state = self._state
        n = int(state.bank.size[0])
        if n == 0:
            return ()
        bank = copied_bank(state.bank, n)
        if t > state.t:
            predict_tracks(bank, t, state.motion, state.scratch.motion)
        x, p = np.empty((n, 9)), np.empty((n, 9, 9))
        report_tracks(bank, state.motion, x, p, state.scratch)
        names = list(self._logs)
        return tuple(self._track(bank, i, t, x[i], p[i], names) for i in np.argsort(bank.identity).tolist())

    def _track(self, bank: Bank, i: int, t: float, x: FloatArray, p: FloatArray, names: list[str]) -> Track:
        status = TrackStatus.TENTATIVE
        if bank.status[i] == CONFIRMED:
            coasting = bank.inside[i] == 0 or t - bank.updated[i] > self._config.coast_after_s
            status = TrackStatus.COASTING if coasting else TrackStatus.CONFIRMED
        fed = int(bank.fed[i])
        return Track(
            id=str(int(bank.identity[i])),
            t=max(t, float(bank.t[0])),
            position=x[:3],
            velocity=x[3:6],
            acceleration=x[6:],
            covariance=p,
            status=status,
            t_last_update=float(bank.updated[i]),
            existence=float(bank.existence[i]),
            is_ownship=bool(bank.own[i, FLAG] != 0.0),
            sources=tuple(name for k, name in enumerate(names) if fed >> min(k, 62) & 1),
        )
