"""The default tracker: scans of any number of radars and ADS-B receivers in, tracks out, nothing to tune."""

import dataclasses
import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wideberth.plots import Plots
from wideberth.tracking.multi_target.bank_kernels import CONFIRMED, copied_bank, predict_tracks
from wideberth.tracking.multi_target.buffers_kernels import CONFIRMED_NOW, MERGED
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.file_run import run_file
from wideberth.tracking.multi_target.flat_views import FlatViews
from wideberth.tracking.multi_target.hearing_kernels import LATE, SECOND_USER
from wideberth.tracking.multi_target.history import History, Item
from wideberth.tracking.multi_target.identity_kernels import ONE_WITH
from wideberth.tracking.multi_target.intake import RADAR_KINDS, SensorLog, ready, scan_fault
from wideberth.tracking.multi_target.life_kernels import drop_unscanned
from wideberth.tracking.multi_target.own_reports import OwnReports
from wideberth.tracking.multi_target.renumbering import Numbers, keep_numbers, numbers_of
from wideberth.tracking.multi_target.reports import AddressBook, ReadyReports, report_scan_fault
from wideberth.tracking.multi_target.scan_kernels import report_tracks
from wideberth.tracking.multi_target.state import TrackerState
from wideberth.tracking.multi_target.words import COUNTERS, EVENTS, REPORT_COUNTERS, REPORT_EVENTS
from wideberth.tracking.ownship import telemetry_covariance
from wideberth.tracking.ownship_kernels import FLAG
from wideberth.tracking.track_table import TrackTable
from wideberth.types import Ownship, Scan, SourceInfo, Track, TrackStatus

FloatArray = NDArray[np.float64]

_FUTURE_S = 0.5
"""Scans this far ahead of the clock are still believed."""

_NOTHING_SAID = SourceInfo()


class MultiTargetTracker:
    """Tracks aircraft by the plots of radars and by the ADS-B reports of those that say who they are.

    Load is shed in this order, and counted: of the plots of a scan that no track explains, more than `window_plots`
    are thinned evenly over the range; of pairs for new tracks no more than `consensus_budget` are fitted; a track
    chooses among its eight nearest plots; clusters with more than `event_limit` joint events are shared out. Addresses
    beyond `reports.addresses_max` are left out.

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
        self._flat = FlatViews()
        self._t = -math.inf
        self._t_own = -math.inf
        self._t_own_heard = -math.inf
        self._told: set[tuple[int, ...]] = set()
        self._told_of_reports: dict[tuple[int, int], tuple[int, int]] = {}
        self._told_late: set[str] = set()
        self._book = AddressBook(self._config.reports)
        self._own_reports = OwnReports(self._config.reports)
        self._absorbed: dict[str, str] = {}

    @property
    def counters(self) -> dict[str, int]:
        """Counts of what was left out or shed, by cause; zero counts are left out."""
        counted = Counter(self._counters)
        for place, words in COUNTERS.items():
            counted[words] += int(self._state.counts[place])
        for place, words in REPORT_COUNTERS.items():
            counted[words] += int(self._state.fusion.counts[place])
        return {words: n for words, n in counted.items() if n}

    @property
    def absorbed(self) -> dict[str, str]:
        """Confirmed tracks that ended in the last step as they were the same aircraft as another: which that is."""
        final = {}
        for ended, goes_on in self._absorbed.items():
            # Late scans run again may have merged two tracks both ways round.
            seen = {ended}
            while goes_on in self._absorbed and goes_on not in seen:
                seen.add(goes_on)
                goes_on = self._absorbed[goes_on]
            final[ended] = goes_on
        return final

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
        return run_file(self._config, plots, COUNTERS)

    def step(
        self, t: float, scans: Sequence[Scan], ownship: Ownship | None = None
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return all tracks at its end.

        Parameters
        ----------
        t : float
            Time, s. A time before the last one by more than `late_max_s` drops all tracks.
        scans : sequence of Scan
            Those of kind ``"radar"``, ``"radar_cone"`` and ``"adsb"`` are used, in order of validity; each radar has
            its own pose and detection model, each report its own time.
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
        self._absorbed = {}
        if t < self._t - self._config.late_max_s:
            n = int(self._state.bank.size[0])
            events.append(f"time went back by {self._t - t:.1f} s: {n} tracks dropped")
            self._counters["time went back"] += 1
            self._reset()
        before, self._t = self._t, max(self._t, t)
        usable = [scan for scan in scans if self._is_usable(scan, events)]
        items: list[Scan | ReadyReports] = [scan for scan in usable if scan.kind != "adsb"]
        oldest = (min(t, before) if math.isfinite(before) else t) - self._config.reports.late_max_s
        for scan in usable:
            if scan.kind == "adsb":
                items.extend(self._book.ready(scan, t, oldest, self._counters))
        for item in sorted(items, key=_order):
            if isinstance(item, ReadyReports):
                self._hear(item, events)
            else:
                self._take_in(t, item, events)
        state = self._state
        drop_unscanned(state.bank, self._t, self._config.silent_s, state.scratch)
        state.fusion.drop_silent(state.bank, self._t)
        self._tell(events)
        for place in self._book.forget(self._t, state.fusion.heard.alive, state.fusion.heard.other):
            state.fusion.clear(place)
        self._identify(ownship, events)
        return self._tracks(t), tuple(events)

    def _is_usable(self, scan: Scan, events: list[str]) -> bool:
        if scan.kind != "adsb" and scan.kind not in RADAR_KINDS:
            self._counters["scan of another kind"] += 1
            return False
        fault = report_scan_fault(scan) if scan.kind == "adsb" else scan_fault(scan)
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
        if c.known_altitude_m is None:
            self._flat.note(log.index, scan)
        if not self._use(ready(scan, log, c), "scan", events):
            self._reject(scan, "scan too late", events)

    def _hear(self, reports: ReadyReports, events: list[str]) -> None:
        self._state.fusion.reserve(len(self._book.addresses))
        if not self._use(reports, "reports", events):
            # Too late for that: the kernels take them from here back to their time.
            self._counters["reports late"] += 1
            self._use(dataclasses.replace(reports, t=self._state.t), "reports", events)

    def _use(self, item: Item, name: str, events: list[str]) -> bool:
        """Take in a scan or reports in order, late ones by going back; return False where that is not possible."""
        state = self._state
        if item.t >= state.t:
            self._history.before(state, item)
            self._process(item, events)
            return True
        if item.t < state.t - self._config.late_max_s:
            return False
        known = numbers_of(state)
        if self._history.insert(state, item, lambda each: self._process(each, events, known)):
            self._counters[f"{name} late, put in order"] += 1
            return True
        return False

    def _process(self, item: Item, events: list[str], known: Numbers | None = None) -> None:
        if isinstance(item, ReadyReports):
            users, outcome = self._state.hear(item)
            for place, info in zip(users.tolist(), item.infos, strict=True):
                self._book.infos[place] = info
            for row in set(item.rows[outcome == SECOND_USER].tolist()):
                self._make_second_place(row)
            for name in sorted({self._book.name(k) for k in users[outcome == LATE].tolist()} - self._told_late):
                self._told_late.add(name)
                events.append(f"some reports of {name} come seconds late: they are not used")
        else:
            self._state.take_in(item)
        if known is not None:
            keep_numbers(self._state, known)
        self._tell(events)

    def _make_second_place(self, row: int) -> None:
        """Make a place for the second aircraft that uses an address."""
        fusion = self._state.fusion
        place = self._book.place(f"{self._book.addresses[row]}#2", self._t)
        if place is not None and fusion.heard.other[row] < 0:
            fusion.reserve(len(self._book.addresses))
            fusion.heard.other[row] = place
            fusion.heard.bias[place], fusion.heard.mine[place] = fusion.heard.bias[row], fusion.heard.mine[row]
            self._book.infos[place] = self._book.infos[row]

    def _tell(self, events: list[str]) -> None:
        """Put the kernels' events into words, each once even if scans are run again."""
        s, fusion = self._state.scratch, self._state.fusion
        for code, identity, other in s.events[: s.event_count[0]].tolist():
            if code == MERGED:
                self._absorbed[str(identity)] = str(other)
            if (code, identity) not in self._told:
                self._told.add((code, identity))
                events.append(EVENTS[code].format(identity, other))
            if code not in (CONFIRMED_NOW,):
                self._told.discard((CONFIRMED_NOW, identity))
        s.event_count[0] = 0
        for code, track, place, other in fusion.events[: fusion.event_count[0]].tolist():
            if code == ONE_WITH:
                self._absorbed[str(other)] = str(track)
            # What is taken back may be told again.
            if self._told_of_reports.get((track, place)) != (code, other):
                self._told_of_reports[track, place] = (code, other)
                events.append(REPORT_EVENTS[code].format(track=track, other=other, name=self._book.name(place)))
        fusion.event_count[0] = 0
        oldest = int(self._state.bank.size[1]) - 500
        if len(self._told) > 1000:
            self._told = {key for key in self._told if key[1] >= oldest}
        if len(self._told_of_reports) > 1000:
            self._told_of_reports = {key: what for key, what in self._told_of_reports.items() if key[0] >= oldest}

    def _identify(self, ownship: Ownship | None, events: list[str]) -> None:
        """Look which track is the ownship: of those of radars at the time of the last scan, of the others now."""
        now = float(self._state.bank.t[0])
        dt = now - self._t_own
        if dt > 0.0:
            self._state.identify_ownship(dt if math.isfinite(dt) else 0.0, *self._telemetry(ownship, now))
            self._t_own = now
        dt = self._t - self._t_own_heard
        if dt > 0.0:
            if self._state.fusion.size:
                parts = self._telemetry(ownship, self._t)
                place = self._state.identify_heard_ownship(self._t, dt if math.isfinite(dt) else 0.0, *parts)
                events.extend(self._own_reports.tell(place, self._state.fusion.heard, self._book.name))
            self._t_own_heard = self._t

    def _telemetry(self, ownship: Ownship | None, t: float) -> tuple[FloatArray, FloatArray]:
        """Return the ownship's position and velocity at `t`, and their covariance; NaN if none is recent."""
        c = self._config.ownship
        if ownship is None or abs(t - ownship.t) > c.stale_after_s:
            return np.full(6, math.nan), np.full((6, 6), math.nan)
        age = t - ownship.t
        telemetry = np.concatenate([ownship.position + age * ownship.velocity, ownship.velocity])
        return telemetry, telemetry_covariance(c, ownship.covariance, abs(age))

    def _tracks(self, t: float) -> tuple[Track, ...]:
        state = self._state
        n = int(state.bank.size[0])
        numbered: list[tuple[int, Track]] = []
        if n:
            bank = state.bank
            if t > bank.t[0]:
                bank = copied_bank(bank, n)
                predict_tracks(bank, t, state.motion, state.scratch.motion)
            x, p = np.empty((n, 9)), np.empty((n, 9, 9))
            report_tracks(bank, state.motion, x, p, state.scratch)
            names = list(self._logs)
            columns = (
                bank.identity,
                bank.address,
                bank.inside,
                bank.updated,
                bank.existence,
                bank.fed,
                bank.status,
                bank.own[:, FLAG],
                bank.home,
            )
            rows = zip(*(column[:n].tolist() for column in columns), strict=True)
            at = max(t, float(bank.t[0]))
            numbered.extend((row[0], self._track(t, at, x[i], p[i], names, *row)) for i, row in enumerate(rows))
        numbered.extend(self._heard_tracks(t))
        return tuple(track for _, track in sorted(numbered, key=lambda pair: pair[0]))

    def _track(
        self,
        t: float,
        at: float,
        x: FloatArray,
        p: FloatArray,
        names: list[str],
        identity: int,
        place: int,
        inside: int,
        updated: float,
        existence: float,
        fed: int,
        status: int,
        own: float,
        home: int,
    ) -> Track:
        c, heard = self._config, self._state.fusion.heard
        coasting = inside == 0 or t - updated > c.coast_after_s
        sources = tuple(name for k, name in enumerate(names) if fed >> min(k, 62) & 1)
        info = _NOTHING_SAID
        if place >= 0:
            coasting = coasting and t - heard.heard[place] > c.reports.coast_after_s
            updated = max(updated, float(heard.heard[place]))
            sources, info = (*sources, *self._receivers(place)), self._book.infos[place]
        life = TrackStatus.TENTATIVE
        if status == CONFIRMED:
            life = TrackStatus.COASTING if coasting else TrackStatus.CONFIRMED
        return Track(
            id=str(identity),
            t=at,
            position=x[:3],
            velocity=x[3:6],
            acceleration=x[6:],
            covariance=p if place >= 0 else self._flat.widened(fed, home, x, p),
            status=life,
            t_last_update=updated,
            existence=existence,
            is_ownship=own != 0.0,
            sources=sources,
            info=info,
        )

    def _receivers(self, place: int) -> tuple[str, ...]:
        fed = int(self._state.fusion.heard.fed[place])
        return tuple(name for k, name in enumerate(self._book.sensors) if fed >> min(k, 62) & 1)

    def _heard_tracks(self, t: float) -> list[tuple[int, Track]]:
        """Return the tracks that only reports feed, with their numbers."""
        state, c = self._state, self._config
        fusion, heard = state.fusion, state.fusion.heard
        places = fusion.alone(state.bank)
        if not len(places):
            return []
        x, p = fusion.estimates(places, t, state.scratch)
        tracks = []
        for k, place in enumerate(places.tolist()):
            number, last = int(heard.number[place]), float(heard.heard[place])
            status = TrackStatus.TENTATIVE
            if heard.status[place] == CONFIRMED:
                status = TrackStatus.COASTING if t - last > c.reports.coast_after_s else TrackStatus.CONFIRMED
            track = Track(
                id=str(number),
                t=max(t, float(heard.t[place])),
                position=x[k, :3],
                velocity=x[k, 3:6],
                acceleration=x[k, 6:],
                covariance=p[k],
                status=status,
                t_last_update=last,
                is_ownship=bool(heard.own[place, FLAG] != 0.0),
                existence=min(c.existence_max, float(heard.reports[place]) / c.reports.confirm_positions),
                sources=self._receivers(place),
                info=self._book.infos[place],
            )
            tracks.append((number, track))
        return tracks


def _order(item: Scan | ReadyReports) -> tuple[float, str]:
    return item.t, item.sensor if isinstance(item, Scan) else ""
