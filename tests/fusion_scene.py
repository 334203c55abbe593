"""Aircraft seen by a ground radar and heard by ADS-B: the scenes of the fusion tests."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.adsb.simulated import SimulatedAdsb
from wideberth.simulation.radar_plots import radar_plots, radar_scan
from wideberth.tracking.multi_target.config import MultiTargetConfig
from wideberth.tracking.multi_target.tracker import MultiTargetTracker
from wideberth.types import Scan, Track, TrackStatus

FloatArray = NDArray[np.float64]
STEP = 0.1


@dataclass
class Scene:
    """Straight flights, the plots of a radar at the origin, and the reports of some of the aircraft.

    `equipped` are the aircraft with ADS-B, `addresses` theirs (one each by default).
    """

    place: FloatArray
    velocity: FloatArray
    seconds: float
    equipped: tuple[int, ...] = ()
    seed: int = 1
    adsb: AdsbErrorConfig = field(default_factory=AdsbErrorConfig)
    radar: dict[str, Any] = field(default_factory=dict)
    echoes: tuple[int, ...] | None = None
    addresses: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        n = round(self.seconds / STEP)
        t = STEP * np.arange(n)
        self.t = t
        self.truth = self.place[None] + t[:, None, None] * self.velocity[None]
        self.speeds = np.tile(self.velocity, (n, 1, 1))
        rules = {"clutter_max": 3, "detection_probability": 0.9, **self.radar}
        seen = list(range(len(self.place))) if self.echoes is None else list(self.echoes)
        self.plots, _ = radar_plots(
            np.random.default_rng(self.seed), self.truth[:, seen], self.speeds[:, seen], **rules
        )
        names = self.addresses or tuple(f"a{k:05x}" for k in self.equipped)
        self.receiver = SimulatedAdsb(self.adsb, self.seed, names, [f"CALL{k}" for k in self.equipped])

    def reports(self, k: int) -> Scan:
        """The reports since the last step."""
        own = list(self.equipped)
        return self.receiver.sense(float(self.t[k]), self.truth[k, own], self.speeds[k, own], np.zeros(3))


@dataclass
class Log:
    """What a tracker said of a scene: all tracks of all steps, and events with their times."""

    tracks: list[tuple[Track, ...]] = field(default_factory=list)
    events: list[tuple[float, str]] = field(default_factory=list)

    def confirmed(self, k: int) -> list[Track]:
        return [x for x in self.tracks[k] if x.status is not TrackStatus.TENTATIVE]

    def told(self, words: str) -> list[str]:
        return [e for _, e in self.events if words in e]


def follow(scene: Scene, tracker: MultiTargetTracker | None = None, radar=None, adsb=None, change=None) -> Log:
    """Step through a scene; `radar(t)` and `adsb(t)` say whether that sensor works, `change(scan)` alters reports."""
    part = tracker or MultiTargetTracker(MultiTargetConfig())
    log = Log()
    for k, t in enumerate(scene.t.tolist()):
        scans = []
        if radar is None or radar(t):
            scans.append(radar_scan(scene.plots, k))
        reports = scene.reports(k)
        if adsb is None or adsb(t):
            scans.append(reports if change is None else change(reports))
        tracks, events = part.step(t, scans)
        log.tracks.append(tracks)
        log.events.extend((t, e) for e in events)
    return log


def nearest(tracks: list[Track], place: FloatArray) -> Track:
    return min(tracks, key=lambda x: float(np.linalg.norm(x.position - place)))


def errors_of(
    log: Log, scene: Scene, aircraft: int, begin: int, end: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return errors (n, 6) of the confirmed track nearest to an aircraft, and NEES a degree of freedom of position."""
    e, nees = [], []
    for k in range(begin, len(scene.t) if end is None else end):
        track = nearest(log.confirmed(k), scene.truth[k, aircraft])
        x = np.concatenate([track.position - scene.truth[k, aircraft], track.velocity - scene.speeds[k, aircraft]])
        e.append(x)
        nees.append(x[:3] @ np.linalg.solve(track.covariance[:3, :3], x[:3]) / 3.0)
    return np.array(e), np.array(nees)
