"""The corridor as one step: scans in, decision out. No clock, no I/O, no globals."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from wideberth.navigation_watch import NavigationWatch
from wideberth.sensor_watch import SensorWatch
from wideberth.tracking.lost_traffic import LostTraffic
from wideberth.tracking.own_tracks import OwnTracks
from wideberth.types import AlertLevel, Maneuver, Mission, Ownship, Scan, Snapshot, Threat, Track
from wideberth.units import FOOT, NAUTICAL_MILE

LOST_RANGE, LOST_HEIGHT = 5 * NAUTICAL_MILE, 2000 * FOOT  # a lost aircraft this near leaves the alert unknown
LEVEL_HOLD = 3.0  # s that a threat must look better before its level falls


class Tracker(Protocol):
    """What the pipeline needs of a tracker."""

    @property
    def counters(self) -> Mapping[str, int]:
        """What happened how often, rejections by cause among them."""

    def step(
        self, t: float, scans: Sequence[Scan], ownship: Ownship | None = None
    ) -> tuple[tuple[Track, ...], tuple[str, ...]]:
        """Return the tracks at time `t` and what happened, in words; `ownship` tells its own track from the others."""


class Detector(Protocol):
    """What the pipeline needs of a conflict detector.

    One with a true attribute `judges_path` takes the path being flown as well: ``assess(t, ownship, tracks, path)``.
    """

    def assess(self, t: float, ownship: Ownship, tracks: Sequence[Track]) -> tuple[Threat, ...]:
        """Return one threat for every track."""


class Planner(Protocol):
    """What the pipeline needs of avoidance."""

    def decide(
        self, t: float, ownship: Ownship, tracks: Sequence[Track], threats: Sequence[Threat], mission: Mission
    ) -> tuple[Maneuver | None, tuple[str, ...]]:
        """Return the path to fly instead of the mission (None: the mission) and what was decided, in words."""


class AlertFilter:
    """Hysteresis on levels: they rise at once, and fall when the threat has looked better for `hold` seconds."""

    def __init__(self, hold: float) -> None:
        self._hold = hold
        self._held: dict[str, tuple[AlertLevel, float]] = {}

    def step(self, t: float, threats: Sequence[Threat]) -> tuple[Threat, ...]:
        """Return the threats with their levels held."""
        filtered = []
        held: dict[str, tuple[AlertLevel, float]] = {}
        for threat in threats:
            level, since = self._held.get(threat.track_id, (threat.level, t))
            if threat.level >= level or t - since >= self._hold:
                level, since = threat.level, t
            held[threat.track_id] = (level, since)
            filtered.append(threat if level is threat.level else _with_level(threat, level))
        self._held = held
        return tuple(filtered)


def _is_near(ownship: Ownship, track: Track) -> bool:
    """Return whether a lost aircraft may still matter: then the sky is not known to be clear."""
    north, east, down = track.position - ownship.position
    return math.hypot(north, east) < LOST_RANGE and abs(down) < LOST_HEIGHT


def _with_level(threat: Threat, level: AlertLevel) -> Threat:
    return Threat(
        threat.track_id,
        threat.t_cpa,
        threat.horizontal_miss,
        threat.vertical_miss,
        threat.time_to_loss,
        threat.interval,
        threat.probability,
        level,
    )


class Pipeline:
    """Sensor scans to decisions.

    Parameters
    ----------
    tracker, detector : Tracker, Detector
    planner : Planner or None
        None: nothing is avoided, everything else happens.
    lost_memory : float
        How long a lost aircraft is remembered, s.
    counter : callable
        Returns CPU seconds; the stage times are its only use.
    watch : SensorWatch, optional
        By default no sensor is missed that says nothing, and nothing needs to be watched.
    """

    def __init__(
        self,
        tracker: Tracker,
        detector: Detector,
        planner: Planner | None,
        lost_memory: float,
        counter: Callable[[], float],
        watch: SensorWatch | None = None,
    ) -> None:
        self._tracker = tracker
        self._planner = planner
        self._lost = LostTraffic(lost_memory)
        self._own = OwnTracks()
        self._receivers: set[str] = set()
        self._navigation = NavigationWatch()
        self._levels = AlertFilter(LEVEL_HOLD)
        self._assess: Callable[..., tuple[Threat, ...]] = detector.assess
        self._judges_path = bool(getattr(detector, "judges_path", False))
        self._maneuver: Maneuver | None = None
        self._counter = counter
        self._watch = watch if watch is not None else SensorWatch({}, 0.0)

    @property
    def counters(self) -> dict[str, int]:
        """The tracker's counters."""
        return dict(self._tracker.counters)

    def step(self, t: float, ownship: Ownship, scans: Sequence[Scan], mission: Mission) -> Snapshot:
        """Take one step.

        Parameters
        ----------
        t : float
            Now, s; later than at the step before.
        ownship : Ownship
            The latest telemetry; its `t` is when it was true.
        scans : sequence of Scan
            What the sensors gave since the step before.
        mission : Mission
            With its progress.

        Returns
        -------
        Snapshot
        """
        c0 = self._counter()
        ownship, told = self._navigation.step(t, ownship)
        sure = ownship.state == "ok"
        found, events = self._tracker.step(t, scans, ownship if sure else None)
        radars = [scan.sensor_position for scan in scans if scan.kind.startswith("radar")]
        self._receivers.update(scan.sensor for scan in scans if scan.kind == "adsb")
        tracks = self._own.step(found, ownship.position, sure, radars, self._receivers)
        # Not all trackers merge tracks.
        absorbed: Mapping[str, str] = getattr(self._tracker, "absorbed", {})
        lost = self._lost.step(t, tracks, absorbed)
        # A radar on the ground sees the ownship as well: nobody has to avoid himself.
        others = tuple(track for track in (*tracks, *lost) if not track.is_ownship)
        c1 = self._counter()
        flown = mission if self._maneuver is None else self._maneuver
        threats = self._levels.step(t, self._assess(t, ownship, others, *((flown,) if self._judges_path else ())))
        c2 = self._counter()
        maneuver, decisions = None, tuple[str, ...]()
        if self._planner is not None:
            maneuver, decisions = self._planner.decide(t, ownship, others, threats, mission)
        self._maneuver = maneuver
        c3 = self._counter()
        sensors, sound, states = self._watch.step(t, ownship, scans)
        alert = max((threat.level for threat in threats), default=AlertLevel.CLEAR)
        if mission.assumed or not (sound and sure) or any(_is_near(ownship, track) for track in lost):
            alert = max(alert, AlertLevel.UNKNOWN)
        return Snapshot(
            t=t,
            ownship=ownship,
            tracks=(*tracks, *lost),
            threats=threats,
            maneuver=maneuver,
            alert_state=alert,
            mission_index=mission.index,
            sensors=sensors,
            stage_times={"tracking": c1 - c0, "conflict": c2 - c1, "avoidance": c3 - c2},
            events=(*told, *states, *events, *decisions),
        )
