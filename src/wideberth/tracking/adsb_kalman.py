"""The Kalman filter for ADS-B traffic: scans in, tracks out (ADS-B paper, section "ADS-B Signal Processing")."""

import math
from collections import Counter
from collections.abc import Sequence

from wideberth.tracking.adsb_aircraft import AdsbAircraft, AircraftFilter, Outcome, Report, apply
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.tracking.filter_bank import FilterBank
from wideberth.types import Scan, SourceInfo, Track, TrackStatus

_FUTURE_SECONDS = 0.5
"""Reports this far ahead of the clock are still believed."""

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

    def __init__(self, config: AdsbKalmanConfig) -> None:
        self._config = config
        self._bank = FilterBank(config)
        self._aircraft: dict[str, AdsbAircraft] = {}
        self._t = -math.inf
        self._counters: Counter[str] = Counter()
        self._nis = {name: [0, 0.0] for name in ("position", "altitude", "climb rate")}

    @property
    def counters(self) -> dict[str, int]:
        """Counts of reports by what became of them; zero counts are left out."""
        return {key: n for key, n in self._counters.items() if n}

    @property
    def nis(self) -> dict[str, tuple[int, float]]:
        """Number and mean of the normalised innovations squared of accepted measurements.

        Expected: 2 for the position (two degrees of freedom), 1 for altitude and climb rate; less with errors that are
        correlated in time.
        """
        return {name: (int(n), total / n if n else math.nan) for name, (n, total) in self._nis.items()}

    def step(self, t: float, scans: Sequence[Scan]) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return all tracks at its end.

        Parameters
        ----------
        t : float
            Time, s. Steps may have any length; a time far before the last one drops all tracks.
        scans : sequence of Scan
            Those of kind ``"adsb"`` are used.

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
        for report, address, info, sensor in self._rows(t, scans):
            aircraft = self._aircraft.get(address)
            if aircraft is None:
                aircraft = self._aircraft[address] = AdsbAircraft(address, self._bank, self._config)
            if info is not aircraft.info and info != aircraft.info:
                aircraft.set_info(info)
            aircraft.sensor = sensor
            aircraft.heard = max(aircraft.heard, report.t)
            outcomes, replaced = aircraft.handle(report)
            self._account(outcomes, replaced, events)
        self._t = max(t, self._t)
        return self._tracks(t, events), tuple(events)

    def _account(self, outcomes: list[Outcome], replaced: list[Outcome], events: list[str]) -> None:
        apply(self._counters, outcomes, 1)
        apply(self._counters, replaced, -1)
        told = {event for outcome in replaced for event in outcome.events}
        for outcome in outcomes:
            events.extend(event for event in outcome.events if event not in told)
        for sign, group in ((1, outcomes), (-1, replaced)):
            for outcome in group:
                for sums, value in zip(self._nis.values(), outcome.nis, strict=True):
                    if value == value:
                        sums[0] += sign
                        sums[1] += sign * value

    def _rows(self, t: float, scans: Sequence[Scan]) -> list[tuple[Report, str, SourceInfo, str]]:
        """Return the usable reports of all scans in the order of validity."""
        rows = []
        c = self._config
        oldest = min(t, self._t if math.isfinite(self._t) else t - c.lost_after_s) - c.late_max_s
        for scan in scans:
            if scan.kind != "adsb":
                self._counters["scan of another kind"] += 1
                continue
            if len(scan.source_ids) == 0:
                continue
            variances = scan.R.diagonal(axis1=1, axis2=2).tolist()
            sources = scan.sources or (_BLANK,) * len(scan.source_ids)
            for z, r, time, address, info in zip(
                scan.z.tolist(), variances, scan.t_valid.tolist(), scan.source_ids, sources, strict=True
            ):
                self._counters["reports"] += 1
                if not math.isfinite(time):
                    self._counters["time not finite"] += 1
                elif time > t + _FUTURE_SECONDS:
                    self._counters["time in the future"] += 1
                elif time < oldest:
                    self._counters["too late"] += 1
                elif any(math.isinf(value) for value in z):
                    self._counters["value not finite"] += 1
                elif not all(v > 0.0 for v, value in zip(r, z, strict=True) if value == value):
                    self._counters["variance not positive"] += 1
                else:
                    sigma = c.whole_second_sigma_s if time == math.floor(time) else c.time_sigma_s
                    report = Report(time, round(time / c.step_s), tuple(z), tuple(r), sigma)
                    rows.append((report, address, info, scan.sensor))
        rows.sort(key=lambda row: row[0].t)
        return rows

    def _tracks(self, t: float, events: list[str]) -> tuple[Track, ...]:
        c = self._config
        alive = [(a, f) for a in self._aircraft.values() for f in a.filters]
        tracks: list[Track] = []
        if alive:
            output = self._bank.output([f.slot for _, f in alive], t)
            for (a, f), position, velocity, acceleration, covariance, spread in zip(alive, *output, strict=True):
                age = t - f.t_position
                confirmed = f.accepted >= c.confirm_positions
                if spread > a.bound or age > (c.lost_after_s if confirmed else c.tentative_lost_after_s):
                    self._lose(a, f, t, float(spread), events)
                    continue
                status = TrackStatus.TENTATIVE
                if confirmed:
                    status = TrackStatus.COASTING if age > c.coast_after_s else TrackStatus.CONFIRMED
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

    def _lose(self, a: AdsbAircraft, f: AircraftFilter, t: float, spread: float, events: list[str]) -> None:
        why = f", uncertainty above {a.bound:.0f} m" if spread > a.bound else ""
        events.append(f"track {a.name(f.number)} lost: no position for {t - f.t_position:.0f} s{why}")
        self._counters["track lost"] += 1
        a.drop(f, t)
