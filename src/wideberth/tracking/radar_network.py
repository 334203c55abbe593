"""A network of radars in front of one tracker: registration, handover from cell to cell, and radars that fail.

After figure 3b of the ground-based system's paper (section II): radars stand like the cells of a telephone network, and
an aircraft is followed by those that are near. Handover is then no act of its own: the tracker has one picture, each
track is fed by whichever radar sees it, and what has to hold is that the radars agree on where it is. That is what
registration is for.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wideberth.tracking import radar_kernels
from wideberth.tracking.bias_correction import BiasEstimate
from wideberth.tracking.config import RadarNetworkConfig
from wideberth.tracking.radar_looks import aircraft_of, look_of, match
from wideberth.tracking.registration import Registration
from wideberth.tracking.registration_kernels import AZIMUTH, BIASES, ELEVATION, RANGE
from wideberth.types import FloatArray, Scan, Track, TrackStatus

_NAMES: tuple[tuple[str, float, str], ...] = (
    ("range", 1.0, "m"),
    ("range scale", 100.0, "%"),
    ("azimuth", math.degrees(1.0), "deg"),
    ("elevation", math.degrees(1.0), "deg"),
    ("roll", math.degrees(1.0), "deg"),
    ("pitch", math.degrees(1.0), "deg"),
    ("place north", 1.0, "m"),
    ("place east", 1.0, "m"),
    ("place down", 1.0, "m"),
    ("clock", 1.0, "s"),
)
_SURE = 3.0
_SIGNIFICANT = 3.0
_GATE = 16.0
_NONE = np.zeros(BIASES)
_CERTAIN = np.zeros((BIASES, BIASES))


class Tracker(Protocol):
    """What makes tracks of scans."""

    def step(self, t: float, scans: Sequence[Scan]) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step, and return all tracks at time `t` and what happened, in words."""


@dataclass(frozen=True, slots=True)
class RadarState:
    """How a radar of the network does.

    Attributes
    ----------
    name : str
    state : str
        ``"ok"``, ``"silent"`` (no scans), ``"blind"`` (scans without the aircraft that are there) or ``"alarm"`` (a
        bias beyond its limit).
    age : float
        Since its last scan, s.
    scans, plots, tracks : int
        Scans and plots so far, and tracks that it serves now.
    bias : BiasEstimate
    """

    name: str
    state: str
    age: float
    scans: int
    plots: int
    tracks: int
    bias: BiasEstimate


@dataclass(slots=True)
class _Radar:
    last: Scan
    heard: float
    scans: int = 0
    plots: int = 0
    silent: bool = False
    blind: bool = False
    alarms: set[int] = dataclasses.field(default_factory=set)
    expected: float = 0.0
    comparisons: int = 0
    said: dict[int, tuple[float, float]] = dataclasses.field(default_factory=dict)


class RadarNetwork:
    """Corrects the scans of all radars, feeds the tracker, and says what goes on in the network.

    Parameters
    ----------
    config : RadarNetworkConfig
    tracker : Tracker
        Gets all scans, those of radars without their biases.

    Attributes
    ----------
    registration : Registration
    counters : Counter of str
        Scans, handovers and faults, in words; those of the registration are its own.
    """

    Config = RadarNetworkConfig

    def __init__(self, config: RadarNetworkConfig, tracker: Tracker) -> None:
        self._config = config
        self._tracker = tracker
        self.registration = Registration(config.registration)
        self.counters: Counter[str] = Counter()
        self._radars: dict[str, _Radar] = {}
        self._tracks: tuple[Track, ...] = ()
        self._serving: dict[str, str] = {}
        self._seen: dict[str, dict[str, float]] = {}
        self._outside: set[str] = set()

    def step(
        self, t: float, scans: Sequence[Scan], references: Sequence[Track] = ()
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Take in the scans of a step and return all tracks at its end.

        Parameters
        ----------
        t : float
            Time, s.
        scans : sequence of Scan
            As the radars give them; scans of other kinds go to the tracker as they are.
        references : sequence of Track
            Aircraft that say where they are, with the covariance of that.

        Returns
        -------
        tracks : tuple of Track
            Those of the tracker; to the covariance of each is added what the biases of the radar which serves it leave
            in its position.
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
        usable = [scan for scan in scans if self._usable(scan, events)]
        self._hear(t, usable, events)
        events += self.registration.step(t, usable, self._tracks, references)
        # A radar alone has nobody to disagree with: its biases move all tracks, they do not scatter them.
        several = len(self._radars) > 1
        corrected = [self.registration.correct(scan, inflate=several) for scan in usable]
        tracks, told = self._tracker.step(t, corrected)
        events += told
        if any(track.id not in self._seen for track in tracks) or len(tracks) != len(self._seen):
            alive = {track.id for track in tracks}
            self._seen = {name: self._seen.get(name, {}) for name in alive}
            self._serving = {name: radar for name, radar in self._serving.items() if name in alive}
            self._outside &= alive
        self._tracks = tracks
        self._feed(corrected, events)
        self._hand_over(t, events)
        self._find_silent(t, events)
        self._judge_biases(events)
        return tuple(self._with_biases(track) for track in tracks), tuple(events)

    def covering(self, position: FloatArray) -> tuple[str, ...]:
        """Return the radars that may see an aircraft, by field of view and range, the nearest first.

        Parameters
        ----------
        position : ndarray, shape (3,)
            NED, m.

        Returns
        -------
        tuple of str
        """
        found: list[tuple[float, str]] = []
        for name, radar in self._radars.items():
            distance, probability = _chance(radar.last, position)
            if probability > 0.0 and not radar.silent:
                found.append((distance, name))
        return tuple(name for _, name in sorted(found))

    def serving(self, track_id: str) -> str | None:
        """Return the radar that feeds a track, or None.

        Parameters
        ----------
        track_id : str

        Returns
        -------
        str or None
        """
        return self._serving.get(track_id)

    def status(self, t: float) -> dict[str, RadarState]:
        """Return how all radars do.

        Parameters
        ----------
        t : float
            Now, s.

        Returns
        -------
        dict of str to RadarState
        """
        served = Counter(self._serving.values())
        states: dict[str, RadarState] = {}
        for name, r in self._radars.items():
            state = "silent" if r.silent else "blind" if r.blind else "alarm" if r.alarms else "ok"
            bias = self.registration.estimate(name)
            states[name] = RadarState(name, state, t - r.heard, r.scans, r.plots, served[name], bias)
        return states

    def _usable(self, scan: Scan, events: list[str]) -> bool:
        if scan.kind != "radar":
            return True
        values = (scan.t, scan.sensor_position, scan.sensor_attitude)
        if all(np.isfinite(v).all() for v in values):
            return True
        self.counters["scan: time or pose not finite"] += 1
        events.append(f"radar {scan.sensor}: a scan whose time or pose is not finite is not used")
        return False

    def _hear(self, t: float, scans: Sequence[Scan], events: list[str]) -> None:
        for scan in scans:
            if scan.kind != "radar":
                continue
            radar = self._radars.get(scan.sensor)
            if radar is None:
                radar = self._radars[scan.sensor] = _Radar(scan, t)
                events.append(f"radar {scan.sensor} joins the network")
            if radar.silent:
                events.append(f"radar {scan.sensor} is back after {t - radar.heard:.1f} s")
            radar.last, radar.heard, radar.silent = scan, t, False
            radar.scans += 1
            radar.plots += len(scan.z)

    def _feed(self, corrected: Sequence[Scan], events: list[str]) -> None:
        """Find which radar sees which track, and radars that do not see what is there."""
        aircraft = aircraft_of(self._tracks, self.counters)
        aircraft.p[:, [0, 1, 2], [0, 1, 2]] += self._config.near_track_m**2 / _GATE
        for scan in corrected:
            if scan.kind != "radar":
                continue
            look = look_of(0, scan, Counter())
            found = match(look, _NONE, _CERTAIN, aircraft, 0.0, 0.0, _GATE)
            fed = {aircraft.ids[k] for k in found.track if k >= 0}
            for name in fed:
                self._seen[name][scan.sensor] = max(scan.t, self._seen[name].get(scan.sensor, -math.inf))
            radar = self._radars[scan.sensor]
            if fed:
                radar.expected = 0.0
                if radar.blind:
                    radar.blind = False
                    events.append(f"radar {scan.sensor} sees aircraft again")
                continue
            for k, name in enumerate(aircraft.ids):
                others = (when for sensor, when in self._seen[name].items() if sensor != scan.sensor)
                if any(scan.t - when < self._config.handover_after_s for when in others):
                    radar.expected += _chance(scan, aircraft.x[k, :3])[1]
            if radar.expected >= self._config.blind_after_expected and not radar.blind:
                radar.blind = True
                self.counters["radar blind"] += 1
                events.append(
                    f"radar {scan.sensor} is blind: {radar.expected:.0f} plots of tracked aircraft expected, none came"
                )

    def _hand_over(self, t: float, events: list[str]) -> None:
        late = self._config.handover_after_s
        for track in self._tracks:
            if track.status == TrackStatus.TENTATIVE:
                continue
            seen = self._seen[track.id]
            latest = max(seen, key=lambda sensor: seen[sensor], default=None)
            before = self._serving.get(track.id)
            if latest is not None and (before is None or t - seen[before] > late >= t - seen[latest]):
                self._serving[track.id] = latest
                if before is not None and before != latest:
                    self.counters["handover"] += 1
                    events.append(f"track {track.label} handed over from radar {before} to radar {latest}")
            if before is not None and not self.covering(track.position):
                if track.id not in self._outside:
                    self._outside.add(track.id)
                    events.append(f"track {track.label} is outside of all radars, last seen by radar {before}")
            else:
                self._outside.discard(track.id)

    def _find_silent(self, t: float, events: list[str]) -> None:
        for name, radar in self._radars.items():
            if not radar.silent and t - radar.heard > self._config.silent_after_s:
                radar.silent = True
                self.counters["radar silent"] += 1
                served = sum(1 for r in self._serving.values() if r == name)
                events.append(f"radar {name} is silent for {t - radar.heard:.1f} s, it served {served} tracks")

    def _judge_biases(self, events: list[str]) -> None:
        c = self._config
        limits = {
            RANGE: c.range_limit_m,
            AZIMUTH: math.radians(c.azimuth_limit_deg),
            ELEVATION: math.radians(c.elevation_limit_deg),
        }
        for name, radar in self._radars.items():
            bias = self.registration.estimate(name)
            if bias.comparisons < radar.comparisons:
                radar.said.clear()
            radar.comparisons = bias.comparisons
            for k in np.flatnonzero(bias.prior_sigma > 0.0).tolist():
                value, sigma = float(bias.value[k]), float(bias.sigma[k])
                what, unit, symbol = _NAMES[k]
                words = f"{what} off by {value * unit:.2f} +- {sigma * unit:.2f} {symbol}"
                before, spread = radar.said.get(k, (0.0, 0.0))
                known = sigma <= c.known_share * bias.prior_sigma[k] and abs(value) > _SIGNIFICANT * sigma
                if known and (k not in radar.said or abs(value - before) > 2.0 * _SURE * spread):
                    radar.said[k] = (value, sigma)
                    events.append(f"radar {name}: {words}, corrected")
                beyond = abs(value) - _SURE * sigma > limits.get(k, math.inf)
                if beyond and k not in radar.alarms:
                    radar.alarms.add(k)
                    self.counters["alarm"] += 1
                    events.append(f"radar {name}: ALARM, {words}, more than {limits[k] * unit:g} {symbol}")
                elif k in radar.alarms and abs(value) < limits[k]:
                    radar.alarms.discard(k)
                    events.append(f"radar {name}: {what} within its limit again")

    def _with_biases(self, track: Track) -> Track:
        radar = self._serving.get(track.id)
        if radar is None:
            return track
        covariance = track.covariance.copy()
        covariance[:3, :3] += self.registration.position_covariance(radar, track.position, track.velocity)
        return dataclasses.replace(track, covariance=covariance)


def _chance(scan: Scan, position: FloatArray) -> tuple[float, float]:
    """Return distance (m) of a place from a radar and the probability that it sees an aircraft there."""
    seen, plot = np.zeros(3), np.zeros(3)
    radar_kernels.to_sensor(scan.sensor_position, scan.sensor_attitude, np.asarray(position, float), seen)
    radar_kernels.to_plot(seen, plot)
    inside = abs(plot[1]) <= scan.field_of_view[0] and abs(plot[2]) <= scan.field_of_view[1]
    if not inside:
        return float(plot[0]), 0.0
    if scan.detection is None:
        return float(plot[0]), 1.0
    detection = scan.detection
    return float(plot[0]), float(np.interp(plot[0], detection.ranges, detection.probabilities, right=0.0))
