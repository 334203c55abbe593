"""What a report needs of a run, gathered from its snapshots and true states."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from wideberth.evaluation.metrics import NMAC_HORIZONTAL, NMAC_VERTICAL
from wideberth.recording import RecordedStep
from wideberth.simulation.truth import Truth
from wideberth.types import AlertLevel, Maneuver, SensorHealth, Snapshot

FloatArray = NDArray[np.float64]

# Positions of other aircraft are kept this often, s: enough to draw, and 200 aircraft for an hour fit in memory.
SPACING = 0.5
# Aircraft that come nearer than this, at one time, are shown by themselves, m.
NEAR_HORIZONTAL = 5000.0
NEAR_VERTICAL = 500.0


@dataclass
class Path:
    """Where an aircraft was; rows of t, north, east, down, and for tracks the upper triangle of the covariance.

    The covariance is that of the position, as nn, ne, ee, dd, m2; empty for true paths.
    """

    rows: list[tuple[float, float, float, float]] = field(default_factory=list)
    covariances: list[tuple[float, float, float, float]] = field(default_factory=list)

    @property
    def t(self) -> FloatArray:
        """Times (n,), s."""
        return np.array([row[0] for row in self.rows])

    @property
    def positions(self) -> FloatArray:
        """Local NED positions (n, 3), m."""
        return np.array([row[1:] for row in self.rows]).reshape(-1, 3)


@dataclass
class ManeuverSpan:
    """A maneuver and when it was flown, s, and where it began."""

    maneuver: Maneuver
    t_start: float
    t_end: float
    position: FloatArray


@dataclass
class FlightLog:
    """A run in the form of a report's pictures.

    Attributes
    ----------
    own : Path
        Of the ownship, every step.
    truths, tracks : dict of str to Path
        Of each aircraft, true and estimated, every `SPACING` seconds.
    levels : dict of str to list of (time, AlertLevel)
        Changes of each threat's level; `alert_levels` those of the worst.
    maneuvers : list of ManeuverSpan
    events : list of (time, text)
    sensors : dict of str to SensorHealth
        At the end.
    stage_times : list of dict
        CPU seconds of each step.
    labels : dict of str to str
        What to call each aircraft.
    """

    own: Path = field(default_factory=Path)
    truths: dict[str, Path] = field(default_factory=dict)
    tracks: dict[str, Path] = field(default_factory=dict)
    levels: dict[str, list[tuple[float, AlertLevel]]] = field(default_factory=dict)
    alert_levels: list[tuple[float, AlertLevel]] = field(default_factory=list)
    maneuvers: list[ManeuverSpan] = field(default_factory=list)
    events: list[tuple[float, str]] = field(default_factory=list)
    sensors: dict[str, SensorHealth] = field(default_factory=dict)
    stage_times: list[dict[str, float]] = field(default_factory=list)
    labels: dict[str, str] = field(default_factory=dict)
    _next: float = float("-inf")
    _flying: bool = False

    @classmethod
    def of(cls, steps: Iterable[RecordedStep]) -> "FlightLog":
        """Gather recorded steps."""
        log = cls()
        for step in steps:
            log.add(step.snapshot, step.truth)
        return log

    def add(self, snapshot: Snapshot, truth: Truth | None) -> None:
        """Take in one step."""
        t = snapshot.t
        n, e, d = (float(x) for x in snapshot.ownship.position)
        self.own.rows.append((t, n, e, d))
        self.events += [(t, text) for text in snapshot.events]
        self.sensors.update(snapshot.sensors)
        self.stage_times.append(dict(snapshot.stage_times))
        self._add_maneuver(t, snapshot)
        _note_change(self.alert_levels, t, snapshot.alert_state)
        levels = {threat.track_id: threat.level for threat in snapshot.threats}
        for name in self.levels.keys() | levels.keys():
            _note_change(self.levels.setdefault(name, []), t, levels.get(name, AlertLevel.CLEAR))
        if t < self._next:
            return
        self._next = t + SPACING - 1e-6
        if truth is not None:
            for name, p in zip(truth.ids, truth.positions.tolist(), strict=True):
                self.truths.setdefault(name, Path()).rows.append((t, p[0], p[1], p[2]))
        for track in snapshot.tracks:
            if track.is_ownship:
                continue
            self.labels[track.id] = track.label
            path = self.tracks.setdefault(track.id, Path())
            p, c = track.position.tolist(), track.covariance
            path.rows.append((t, p[0], p[1], p[2]))
            path.covariances.append((float(c[0, 0]), float(c[0, 1]), float(c[1, 1]), float(c[2, 2])))

    def _add_maneuver(self, t: float, snapshot: Snapshot) -> None:
        maneuver, last = snapshot.maneuver, self.maneuvers[-1] if self.maneuvers else None
        if self._flying and last is not None:
            last.t_end = t
        if maneuver is not None and not (self._flying and last is not None and last.maneuver.t == maneuver.t):
            self.maneuvers.append(ManeuverSpan(maneuver, t, t, np.array(snapshot.ownship.position)))
        self._flying = maneuver is not None

    def label(self, name: str) -> str:
        """Return what to call an aircraft: its callsign where known, else its address in capitals."""
        return self.labels.get(name, name.upper())

    def aircraft(self) -> dict[str, Path]:
        """Return the path of each aircraft: the true one where any is known, else the estimated one."""
        return self.truths or self.tracks


def _note_change(changes: list[tuple[float, AlertLevel]], t: float, level: AlertLevel) -> None:
    if not changes or changes[-1][1] != level:
        changes.append((t, level))


@dataclass(frozen=True)
class Encounter:
    """An aircraft that came near, on the times of its path.

    Attributes
    ----------
    id, label : str
    t : ndarray, shape (n,)
    positions : ndarray, shape (n, 3)
        Of the aircraft, local NED, m.
    own : ndarray, shape (n, 3)
        Of the ownship at these times.
    horizontal, above : ndarray, shape (n,)
        Horizontal separation, and how much the aircraft is above the ownship, m.
    closest : int
        Row of the least max(horizontal / 500 ft, vertical / 100 ft).
    """

    id: str
    label: str
    t: FloatArray
    positions: FloatArray
    own: FloatArray
    horizontal: FloatArray
    above: FloatArray
    closest: int

    @property
    def ratio(self) -> float:
        """The larger of horizontal / 500 ft and vertical / 100 ft at the closest approach."""
        return float(
            max(self.horizontal[self.closest] / NMAC_HORIZONTAL, abs(self.above[self.closest]) / NMAC_VERTICAL)
        )


def encounters(log: FlightLog, horizontal: float = NEAR_HORIZONTAL, vertical: float = NEAR_VERTICAL) -> list[Encounter]:
    """Return the aircraft that came within the distances (m) of the ownship at one time, the closest first."""
    own_t, own = log.own.t, log.own.positions
    found = []
    for name, path in log.aircraft().items():
        t, positions = path.t, path.positions
        at = np.column_stack([np.interp(t, own_t, own[:, k]) for k in range(3)])
        apart = np.hypot(*(positions - at)[:, :2].T)
        above = at[:, 2] - positions[:, 2]
        if np.any((apart <= horizontal) & (np.abs(above) <= vertical)):
            ratios = np.stack([apart / NMAC_HORIZONTAL, np.abs(above) / NMAC_VERTICAL])
            # As the scores do: of equally close instants, the one where the smaller ratio is least.
            closest = int(np.lexsort((ratios.min(axis=0), ratios.max(axis=0).round(6)))[0])
            found.append(Encounter(name, log.label(name), t, positions, at, apart, above, closest))
    return sorted(found, key=lambda encounter: encounter.ratio)
