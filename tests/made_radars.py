"""Networks of radars, the aircraft they see, and what registration makes of them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.nearest_tracker import NearestTracker
from wideberth.simulation.radar_network import RadarSite, simulate_plots
from wideberth.tracking.bias_correction import prior_sigma
from wideberth.tracking.config import RadarNetworkConfig, RegistrationConfig
from wideberth.tracking.radar_network import RadarNetwork
from wideberth.tracking.registration import Registration
from wideberth.types import DetectionModel, FloatArray, Scan, Track, TrackStatus

DETECTION = DetectionModel(np.array([0.0, 4000.0]), np.array([0.9, 0.9]))
CELL = DetectionModel(np.array([0.0, 700.0, 900.0]), np.array([0.95, 0.9, 0.0]))
NAMES = ("west", "east", "north")
PLACES = (np.zeros(3), np.array([0.0, 600.0, 0.0]), np.array([600.0, 300.0, 0.0]))


def wandering(t: FloatArray, seed: int, k: int) -> tuple[FloatArray, FloatArray]:
    """Positions and velocities (n, k, 3) of aircraft in slow turns within 1.5 km."""
    rng = np.random.default_rng([seed, 1])
    start = rng.uniform([-1500.0, -1500.0, -400.0], [1500.0, 1500.0, -60.0], (k, 3))
    course, speed, rate = rng.uniform(0.0, 2 * np.pi, k), rng.uniform(10.0, 40.0, k), rng.uniform(-0.03, 0.03, k)
    angle = course + rate * t[:, None]
    velocity = np.stack([speed * np.cos(angle), speed * np.sin(angle), np.zeros_like(angle)], axis=-1)
    step = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(t)[:, None, None]
    return start + np.concatenate([np.zeros((1, k, 3)), np.cumsum(step, axis=0)]), velocity


def known_track(name: str, t: float, position: FloatArray, velocity: FloatArray, sigma: float, rng) -> Track:
    """A track with white errors as stated."""
    covariance = np.diag([sigma**2] * 3 + [1.0] * 6)
    noise = rng.normal(0.0, [sigma] * 3 + [1.0] * 3)
    return Track(name, t, position + noise[:3], velocity + noise[3:], np.zeros(3), covariance, TrackStatus.CONFIRMED, t)


def sites_with(
    biases: Sequence[FloatArray],
    *,
    flat: tuple[int, ...] = (),
    detection: DetectionModel = DETECTION,
    clutter: float = 2.0,
) -> list[RadarSite]:
    """Radars with different rates and phases, those in `flat` without elevation."""
    return [
        RadarSite(
            NAMES[i],
            PLACES[i],
            detection,
            (5.0, 0.01, math.nan if i in flat else 0.015, 1.0),
            period_s=(0.5, 0.7, 0.6)[i],
            phase_s=0.1 * i,
            clutter=clutter,
            bias=bias,
        )
        for i, bias in enumerate(biases)
    ]


def drawn_biases(config: RegistrationConfig, seed: int, n: int) -> list[FloatArray]:
    """Biases as the prior says."""
    rng = np.random.default_rng([seed, 2])
    return [rng.normal(0.0, prior_sigma(config)) for _ in range(n)]


@dataclass(frozen=True)
class Registered:
    registration: Registration
    error: FloatArray
    covariance: FloatArray
    events: list[str]

    @property
    def nees(self) -> float:
        return float(self.error @ np.linalg.solve(self.covariance, self.error))


def registered(
    config: RegistrationConfig,
    sites: Sequence[RadarSite],
    seed: int,
    *,
    aircraft: int = 4,
    duration: float = 40.0,
    reference_sigma: float | None = None,
    with_tracks: bool = True,
) -> Registered:
    """Run a registration alone, with tracks that have white errors as stated."""
    t = np.arange(0.0, duration + 0.01, 0.25)
    positions, velocities = wandering(t, seed, aircraft)
    scans = simulate_plots(sites, t, positions, velocities, seed)
    rng = np.random.default_rng([seed, 3])
    registration = Registration(config)
    events: list[str] = []
    tracks: list[Track] = []
    for i, now in enumerate(t):
        references = []
        if reference_sigma is not None:
            references = [known_track("own", now, positions[i, 0], velocities[i, 0], reference_sigma, rng)]
        events += registration.step(now, scans[i], tracks if with_tracks else (), references)
        tracks = [known_track(str(k), now, positions[i, k], velocities[i, k], 5.0, rng) for k in range(aircraft)]
    return finished(registration, sites, t[-1], events)


def finished(registration: Registration, sites: Sequence[RadarSite], t: float, events: list[str]) -> Registered:
    """Compare the biases that are estimated with the true ones."""
    estimates = [registration.estimate(name) for name in registration.sensors]
    true = {site.name: site.bias_at(t) for site in sites}
    which = np.flatnonzero(np.concatenate([e.prior_sigma for e in estimates]) > 0.0)
    error = np.concatenate([e.value - true[e.sensor] for e in estimates])[which]
    return Registered(registration, error, registration.covariance[np.ix_(which, which)], events)


@dataclass
class Flown:
    """What came of a network: events with their times, and for each aircraft the ids near it, errors, duplicates."""

    network: RadarNetwork | None
    events: list[tuple[float, str]]
    ids: list[list[str]]
    duplicates: int
    seen: int
    errors: list[FloatArray]
    nees: list[float]

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(np.square(self.errors)[:, :2].sum(axis=1))))

    def said(self, words: str) -> list[float]:
        return [t for t, event in self.events if words in event]


def fly(
    sites: Sequence[RadarSite],
    t: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    seed: int,
    *,
    config: RadarNetworkConfig | None,
    change: Callable[[float, list[Scan]], list[Scan]] = lambda t, scans: scans,
) -> Flown:
    """Run a network (without a config: the tracker alone) over true aircraft."""
    tracker = NearestTracker()
    network = RadarNetwork(config, tracker) if config else None
    flown = Flown(network, [], [[] for _ in range(positions.shape[1])], 0, 0, [], [])
    for i, scans in enumerate(simulate_plots(sites, t, positions, velocities, seed)):
        tracks, events = (network or tracker).step(t[i], change(t[i], scans))
        flown.events += [(float(t[i]), event) for event in events]
        confirmed = [track for track in tracks if track.status == TrackStatus.CONFIRMED]
        for k in range(positions.shape[1]):
            errors = {track.id: track.position - positions[i, k] for track in confirmed}
            near = {name: e for name, e in errors.items() if np.linalg.norm(e) < 100.0}
            if not near:
                continue
            flown.seen += 1
            flown.duplicates += len(near) > 1
            name = min(near, key=lambda name: float(np.linalg.norm(near[name])))
            flown.errors.append(near[name])
            covariance = next(track.covariance[:3, :3] for track in confirmed if track.id == name)
            flown.nees.append(float(near[name] @ np.linalg.solve(covariance, near[name])))
            if not flown.ids[k] or flown.ids[k][-1] != name:
                flown.ids[k].append(name)
    return flown


def crossing(seed: int, duration: float = 60.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, positions and velocities of three aircraft that fly straight through the cells of west and east."""
    t = np.arange(0.0, duration + 0.01, 0.25)
    north = np.array([-250.0, 50.0, 300.0]) + np.random.default_rng([seed, 4]).uniform(-20.0, 20.0, 3)
    velocity = np.tile([[0.0, 25.0, 0.0], [0.0, -22.0, 0.0], [0.0, 28.0, 0.0]], (len(t), 1, 1))
    start = np.stack([north, [-500.0, 1100.0, -700.0], [-100.0, -150.0, -80.0]], axis=1)
    return t, start + velocity * t[:, None, None], velocity


def cells(azimuth_bias: float, **east) -> list[RadarSite]:
    """Two radars 600 m apart whose cells overlap; east measures azimuths that are too large."""
    sigma = (3.0, 0.015, 0.02, 0.5)
    bias = np.zeros(10)
    bias[2] = azimuth_bias
    return [
        RadarSite("west", PLACES[0], CELL, sigma, clutter=1.0),
        RadarSite("east", PLACES[1], CELL, sigma, phase_s=0.2, clutter=1.0, bias=bias, **east),
    ]
