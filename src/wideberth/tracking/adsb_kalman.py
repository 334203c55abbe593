"""The Kalman filter for ADS-B traffic: scans in, tracks out (ADS-B paper, section "ADS-B Signal Processing")."""

import math
from collections import Counter
from collections.abc import Collection, Sequence

import numpy as np

from wideberth.tracking.adsb_aircraft import AdsbAircraft
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.filter_bank import FilterBank
from wideberth.tracking.kernels import ACCEPTED
from wideberth.tracking.report_checks import report_faults
from wideberth.tracking.report_history import ACCEPTED_OUTCOME, AircraftFilter, Outcome, Report, Update
from wideberth.types import Ownship, Scan, SourceInfo, Track, TrackStatus

_FORGET_SECONDS = 900.0
"""An address without track and without reports for this long is forgotten."""

_BLANK = SourceInfo()


class AdsbKalmanTracker:
    """Tracks cooperative aircraft by their addresses.

    Parameters
    ----------
    config : AdsbKalmanConfig

    Attributes
    ----------
    counters : dict of str to int
        Reports by what became of them, in words.
    """

    Config = AdsbKalmanConfig
    hears = frozenset({"adsb"})

    def __init__(self, config: AdsbKalmanConfig) -> None:
        self._config = config
        self._bank = FilterBank(config)
        self._aircraft: dict[str, AdsbAircraft] = {}
        self._t = -math.inf
        self._counters: Counter[str] = Counter()
        self._nis_count = np.zeros(4, np.int64)
        self._nis_sum = np.zeros(4)

    @property
    def counters(self) -> dict[str, int]:
        """Counts of reports by what became of them; zero counts are left out."""
        return {key: n for key, n in self._counters.items() if n}

    @property
    def nis(self) -> dict[str, tuple[int, float]]:
        """Number and mean of the normalised innovations squared of accepted measurements.

        Expected: 2 for position and velocity (two degrees of freedom), 1 for altitude and climb rate; less with errors
        that are correlated in time. Reports that were run again because a late one came are not in it.
        """
        names = ("position", "altitude", "climb rate", "velocity")
        sums = zip(names, self._nis_count.tolist(), self._nis_sum.tolist(), strict=True)
        return {name: (n, total / n if n else math.nan) for name, n, total in sums}

    def step(
        self, t: float, scans: Sequence[Scan], ownship: Ownship | None = None
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return all tracks at its end.

        Parameters
        ----------
        t : float
            Time, s. Steps may have any length; a time far before the last one drops all tracks.
        scans : sequence of Scan
            Those of kind ``"adsb"`` are used.
        ownship : Ownship, optional
            Not used: what the ownship itself sends is not among the reports.

        Returns
        -------
        tracks : tuple of Track
            Predicted to `t`, in the order of their start; `t_last_update` is the time of the last accepted position.
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
            n = sum(len(a.filters) for a in self._aircraft.values())
            events.append(f"time went back by {self._t - t:.0f} s: {n} tracks dropped")
            self._counters["time went back"] += 1
            self._aircraft.clear()
            self._bank = FilterBank(self._config)
            self._t = -math.inf
        self._take_in(self._rows(t, scans), events)
        self._t = max(t, self._t)
        return self._tracks(t, events), tuple(events)

    def _take_in(self, rows: list[tuple[Report, str, SourceInfo, str]], events: list[str]) -> None:
        """Use reports in the order given: those of aircraft that behave in one call, the others one by one."""
        batch: list[tuple[AdsbAircraft, Update, Report]] = []
        queued: set[str] = set()
        for report, address, info, sensor in rows:
            aircraft = self._aircraft.get(address)
            if aircraft is None:
                aircraft = self._aircraft[address] = AdsbAircraft(address, self._bank, self._config)
            if info is not aircraft.info and info != aircraft.info:
                aircraft.set_info(info)
            aircraft.sensor = sensor
            if report.t > aircraft.heard:
                aircraft.heard = report.t
            if address in queued:
                self._update(batch, events)
                batch, queued = [], set()
            if aircraft.in_order(report):
                self._lose_invalid(aircraft, report.t, events)
                update = aircraft.before(report)
                if isinstance(update, Outcome):
                    self._account(update, events)
                else:
                    batch.append((aircraft, update, report))
                    queued.add(address)
            else:
                self._run_again(aircraft, report, events)
        self._update(batch, events)

    def _update(self, batch: list[tuple[AdsbAircraft, Update, Report]], events: list[str]) -> None:
        if not batch:
            return
        bank = self._bank
        slots = [update.filter.slot for _, update, _ in batch]
        _, steps, z, r, time_sigma = zip(*(report for _, _, report in batch), strict=True)
        codes, nis = bank.update(slots, steps, z, r, [update.use for _, update, _ in batch], time_sigma)
        x, p = bank.x[slots], bank.p[slots]
        accepted = codes == ACCEPTED
        self._nis_count += accepted.sum(axis=0)
        self._nis_sum += np.where(accepted, nis, 0.0).sum(axis=0)
        for (aircraft, update, report), code, xi, pi in zip(batch, codes.tolist(), x, p, strict=True):
            outcome = aircraft.after(update.filter, report, code, xi, pi)
            if outcome is ACCEPTED_OUTCOME:
                self._counters["position accepted"] += 1
            else:
                self._account(outcome, events)

    def _run_again(self, aircraft: AdsbAircraft, report: Report, events: list[str]) -> None:
        outcomes, replaced = aircraft.handle(report)
        told = {event for outcome in replaced for event in outcome.events}
        for outcome in outcomes:
            self._account(outcome, events, told)
        for outcome in replaced:
            for key in outcome.counts:
                self._counters[key] -= 1
        self._counters["late, put in order" if len(outcomes) > 1 else "late"] += 1

    def _account(self, outcome: Outcome, events: list[str], told: Collection[str] = ()) -> None:
        for key in outcome.counts:
            self._counters[key] += 1
        events.extend(event for event in outcome.events if event not in told)

    def _rows(self, t: float, scans: Sequence[Scan]) -> list[tuple[Report, str, SourceInfo, str]]:
        """Return the usable reports of all scans in the order of validity."""
        rows: list[tuple[Report, str, SourceInfo, str]] = []
        c = self._config
        oldest = min(t, self._t if math.isfinite(self._t) else t - c.lost_after_s) - c.late_max_s
        for scan in scans:
            if scan.kind != "adsb":
                self._counters["scan of another kind"] += 1
                continue
            k = len(scan.source_ids)
            if k == 0:
                continue
            self._counters["reports"] += k
            times = scan.t_valid
            variances = scan.R.diagonal(axis1=1, axis2=2)
            good = np.ones(k, np.bool_)
            for key, bad in report_faults(scan, t, oldest):
                if bad.any():
                    self._counters[key] += int(np.count_nonzero(bad & good))
                    good &= ~bad
            steps = np.rint(np.where(good, times, 0.0) / c.step_s).astype(np.int64)
            sigmas = np.where(np.floor(times) == times, c.whole_second_sigma_s, c.time_sigma_s)
            reports = map(Report, times.tolist(), steps.tolist(), scan.z.tolist(), variances.tolist(), sigmas.tolist())
            infos = scan.sources or (_BLANK,) * k
            rows.extend(
                (report, address, info, scan.sensor)
                for report, address, info, use in zip(reports, scan.source_ids, infos, good.tolist(), strict=True)
                if use
            )
        rows.sort(key=_validity)
        return rows

    def _tracks(self, t: float, events: list[str]) -> tuple[Track, ...]:
        c = self._config
        alive = [(a, f) for a in self._aircraft.values() for f in a.filters]
        tracks: list[Track] = []
        if alive:
            output = self._bank.output([f.slot for _, f in alive], t)
            for (a, f), position, velocity, acceleration, covariance, spread in zip(alive, *output, strict=True):
                if self._lose_if_invalid(a, f, t, float(spread), events):
                    continue
                status = TrackStatus.TENTATIVE
                if f.accepted >= c.confirm_positions:
                    coasting = t - f.t_position > c.coast_after_s
                    status = TrackStatus.COASTING if coasting else TrackStatus.CONFIRMED
                tracks.append(
                    Track(
                        a.address if f.number == 1 else f"{a.address}#{f.number}",
                        t,
                        position,
                        velocity,
                        acceleration,
                        covariance,
                        status,
                        f.t_position,
                        min(1.0, f.accepted / c.confirm_positions),
                        False,
                        (a.sensor,),
                        a.info,
                    )
                )
        for address in [k for k, a in self._aircraft.items() if not a.filters and a.heard < t - _FORGET_SECONDS]:
            del self._aircraft[address]
        return tuple(tracks)

    def _lose_invalid(self, a: AdsbAircraft, t: float, events: list[str]) -> None:
        """Before a report is used: drop the filters that it finds invalid, however long the steps of the clock are."""
        for f in list(a.filters):
            if t - f.t_position > self._config.coast_after_s:
                spread = self._bank.output([f.slot], t)[-1]
                self._lose_if_invalid(a, f, t, float(spread[0]), events)

    def _lose_if_invalid(self, a: AdsbAircraft, f: AircraftFilter, t: float, spread: float, events: list[str]) -> bool:
        c = self._config
        longest = c.lost_after_s if f.accepted >= c.confirm_positions else c.tentative_lost_after_s
        if spread <= a.bound and t - f.t_position <= longest:
            return False
        why = f", uncertainty above {a.bound:.0f} m" if spread > a.bound else ""
        events.append(f"track {a.name(f.number)} lost: no position for {t - f.t_position:.0f} s{why}")
        self._counters["track lost"] += 1
        a.drop(f, t)
        return True


def _validity(row: tuple[Report, str, SourceInfo, str]) -> float:
    return row[0].t
