"""Datagrams of ASTERIX: plots become scans, system tracks and ADS-B reports become reports."""

import math
from collections import Counter, deque
from typing import Any

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.links.asterix import blocks as b
from wideberth.links.asterix.plots import decode_plot
from wideberth.links.asterix.reports import AsterixReports
from wideberth.links.config import AsterixConfig, RadarUnitConfig
from wideberth.links.radar_plots import RATE_WINDOW, OwnshipAt, RadarUnit, joint_health, unit_of
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import Scan, SensorHealth

_NORTH_MARK = 1
_MOST_WAITING = 10_000
"""Reports that nobody has taken, beyond which the oldest are dropped."""

_SILENT_AFTER = 10.0
"""Seconds without a report after which a source of reports alone is called silent."""


class _Turn:
    """The plots of a radar since its last scan: measurements, standard deviations, times."""

    def __init__(self) -> None:
        self.z: list[list[float]] = []
        self.sigma: list[list[float]] = []
        self.t: list[float] = []
        self.t_first = math.nan


class AsterixReader:
    """Turns datagrams of categories 048 and 034 into scans, and of 062 and 021 into reports.

    Parameters
    ----------
    config : AsterixConfig
    frame : LocalFrame, optional
        Needed for radars given by latitude and longitude; it may be set later (`frame`).
    ownship : callable, optional
        As of `RadarUdpReader`.

    Raises
    ------
    InputError
        If libasterix is not installed.

    Notes
    -----
    System tracks (category 062) enter as reports of position, not as plots, for what they are: estimates of another
    tracker, whose errors are alike from one to the next. As plots they would be averaged as if each were a new
    measurement, and would soon be believed far better than they are; a report's position error is taken to vary slowly
    (from its NACp), just as that of an ADS-B report, and there the accuracy that the track states (I062/500) goes in.
    """

    def __init__(
        self, config: AsterixConfig, frame: LocalFrame | None = None, ownship: OwnshipAt | None = None
    ) -> None:
        self._config = config
        self._specifications = b.Specifications()
        self._units = {unit.radar_id: RadarUnit(unit, config.clock, frame, ownship) for unit in config.units}
        self._settings = {self._units[unit.radar_id]: unit for unit in config.units}
        self._turns = {unit: _Turn() for unit in self._units.values()}
        self._traffic = AsterixReports(config.clock, accept_test_targets=config.accept_test_targets)
        self._reports: deque[AdsbReport] = deque(maxlen=_MOST_WAITING)
        self._rejects: Counter[str] = Counter()
        self._datagrams = self._lost = 0
        self._frame = frame
        self._arrivals: deque[float] = deque(maxlen=_MOST_WAITING)

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame."""
        return self._frame

    @frame.setter
    def frame(self, frame: LocalFrame | None) -> None:
        self._frame = frame
        for unit in self._units.values():
            unit.frame = frame

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the radars."""
        return tuple(unit.name for unit in self._units.values())

    @property
    def addresses(self) -> tuple[str, ...]:
        """The addresses of all reports."""
        return self._traffic.addresses

    @property
    def rejects(self) -> dict[str, int]:
        """Blocks, records and plots left out, by cause."""
        each = [unit.rejects for unit in self._units.values()]
        return dict(sum(each, self._rejects + Counter(self._traffic.rejects)))

    @property
    def counters(self) -> dict[str, int]:
        """Counts of datagrams, scans, plots, reports, and of what was left out, by cause."""
        counts = sum((unit.counters for unit in self._units.values()), Counter())
        reports = self._traffic.counters
        lost = {"reports nobody took": self._lost} if self._lost else {}
        return {"datagrams": self._datagrams, **counts, **reports, **self.rejects, **lost}

    def health(self, t: float) -> SensorHealth:
        """Return how the radars do at time `t`, s: the one that does worst, with the rejects of all.

        Without radars it is how the reports do: "nothing heard yet", "ok", "silent for 12 s".
        """
        if self._units:
            return joint_health(list(self._units.values()), self._rejects + Counter(self._traffic.rejects), t)
        age = max(t - self._arrivals[-1], 0.0) if self._arrivals else math.inf
        rate = sum(arrival >= t - RATE_WINDOW for arrival in self._arrivals) / RATE_WINDOW
        state = "ok" if age <= _SILENT_AFTER else f"silent for {age:.0f} s"
        return SensorHealth(age, rate, self.rejects, state if self._arrivals else "nothing heard yet")

    def reports(self) -> list[AdsbReport]:
        """Return the reports of system tracks and aircraft since the last call."""
        found = list(self._reports)
        self._reports.clear()
        return found

    def feed(self, data: bytes, t: float) -> list[Scan]:
        """Return the scans that a datagram completes.

        Parameters
        ----------
        data : bytes
            One whole datagram; an empty one only lets time pass, which ends scans of turns without a north mark.
        t : float
            Time of receipt, s.
        """
        self._datagrams += bool(data)
        if not math.isfinite(t):
            self._rejects["time of receipt not a number"] += 1
            return []
        scans: list[Scan | None] = []
        heard: dict[RadarUnit, float] = {}
        for category, record in self._specifications.records(data, self._rejects):
            if category in (21, 62):
                for report in self._traffic.read(category, record, t):
                    self._lost += len(self._reports) == _MOST_WAITING
                    self._reports.append(report)
                    self._arrivals.append(t)
                continue
            unit = unit_of(self._units, b.source(record))
            if unit is None:
                self._rejects["another radar's"] += 1
            elif category == 48:
                when = self._plot(unit, record, t)
                if when is not None:
                    heard[unit] = when
            elif b.code(record, "000") == _NORTH_MARK:
                when = unit.time(b.unix_time(b.number(record, "030"), t), t)
                if self._config.scan == "rotation":
                    scans.append(self._end(unit, when, t))
                elif when is not None:
                    heard[unit] = when
            else:
                unit.counters["service messages (not used)"] += 1
        if self._config.scan == "packet":
            scans += [self._end(unit, when, t) for unit, when in heard.items()]
        else:
            for unit, turn in self._turns.items():
                if t - turn.t_first >= self._settings[unit].update_interval_s:
                    scans.append(self._end(unit, None, t))
        return [scan for scan in scans if scan is not None]

    def _plot(self, unit: RadarUnit, record: Any, t: float) -> float | None:
        """Keep a plot that can be used; return its time, s, or None, counted, where that is not believed."""
        t_valid = unit.time(b.unix_time(b.number(record, "140"), t), t)
        if t_valid is None:
            return None
        settings: RadarUnitConfig = self._settings[unit]
        plot = decode_plot(record, settings, self._config)
        if isinstance(plot, str):
            unit.rejects[plot] += 1
            return t_valid
        turn = self._turns[unit]
        if len(turn.t) >= 4 * settings.max_plots:
            unit.rejects["plots beyond the most in a scan"] += 1
            return t_valid
        turn.t_first = t if math.isnan(turn.t_first) else turn.t_first
        turn.z.append(plot[0])
        turn.sigma.append(plot[1])
        turn.t.append(t_valid)
        return t_valid

    def _end(self, unit: RadarUnit, t_end: float | None, t: float) -> Scan | None:
        """Return the scan of the plots since the last; its time is that of the last plot or, without any, `t_end`."""
        turn, self._turns[unit] = self._turns[unit], _Turn()
        if not turn.t and t_end is None:
            return None
        t_valid = max(turn.t) if turn.t else t_end
        assert t_valid is not None
        z, sigma = (np.array(rows, float).reshape(-1, 4) for rows in (turn.z, turn.sigma))
        return unit.scan(t_valid, t, z, sigma, t_plots=np.array(turn.t, float))
