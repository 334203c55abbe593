"""Made-up runs for tests of recordings, metrics and reports: no filter, no planner, just plausible values."""

from collections.abc import Iterator

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.simulation.truth import Truth
from wideberth.types import (
    AlertLevel,
    Maneuver,
    Mission,
    Ownship,
    Scan,
    SensorHealth,
    Snapshot,
    SourceInfo,
    Threat,
    Track,
    TrackStatus,
)

FRAME = LocalFrame(np.radians(48.7), np.radians(2.3))
T_START = 1633600000.25
MISSION = Mission(
    np.array([[0.0, 0.0, -600.0], [4000.0, 500.0, -600.0], [8000.0, 0.0, -700.0]]),
    np.array([40.0, 40.0, 41.0]),
    T_START,
)
DT = 0.1


def _starts(aircraft: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The first aircraft meets the ownship head-on, the others fly somewhere near."""
    positions = np.column_stack([rng.uniform(-9000, 12000, (aircraft, 2)), rng.uniform(-1200, -300, aircraft)])
    course = rng.uniform(0, 2 * np.pi, aircraft)
    velocities = np.column_stack([60 * np.cos(course), 60 * np.sin(course), rng.normal(0, 1, aircraft)])
    if aircraft:
        positions[0], velocities[0] = [6500.0, 350.0, -620.0], [-55.0, -4.0, 0.0]
    return positions, velocities


def made_steps(count: int, aircraft: int, seed: int = 7) -> Iterator[tuple[Snapshot, list[Scan], Truth]]:
    """Yield (snapshot, scans, truth): the ownship flies north and turns right about the first aircraft at 50 s."""
    rng = np.random.default_rng(seed)
    start, velocity = _starts(aircraft, rng)
    ids = tuple(f"{0x3A0000 + k:06x}" for k in range(aircraft))
    infos = [SourceInfo(callsign=f"TEST{k:02d}" if k % 3 else None, nacp=9, nic=8, nacv=2) for k in range(aircraft)]
    own = MISSION.waypoints[0].copy()
    maneuver: Maneuver | None = None
    root = rng.normal(size=(9, 9))
    for k in range(count):
        elapsed = k * DT
        t = T_START + elapsed
        turn = 0.6 if 40 <= elapsed < 75 else (-0.55 if 75 <= elapsed < 110 else 0.12)
        own_velocity = 40 * np.array([np.cos(turn), np.sin(turn), -0.02 if 40 <= elapsed < 60 else 0.0])
        own = own + own_velocity * DT
        ownship = Ownship(t, own, own_velocity)
        positions = start + velocity * elapsed
        distance = np.linalg.norm(positions - own, axis=1)
        covariance = root @ root.T + np.diag([900.0, 900, 400, 16, 16, 4, 1, 1, 1])
        covariance = (covariance + covariance.T) / 2
        tracks = tuple(
            Track(
                ids[i],
                t,
                positions[i] + rng.normal(0, 20, 3),
                velocity[i] + rng.normal(0, 1, 3),
                rng.normal(0, 0.1, 3),
                covariance * (1 + 0.01 * rng.random()),
                TrackStatus.CONFIRMED,
                t - 0.3,
                sources=("adsb",),
                info=infos[i],
            )
            for i in range(aircraft)
        )
        threats = tuple(
            Threat(ids[i], 20.0, float(distance[i]), 50.0, float("nan"), (float("nan"),) * 2, 0.1, _level(distance[i]))
            for i in range(aircraft)
            if distance[i] < 4000
        )
        events: tuple[str, ...] = ()
        if k == 400:
            waypoints = own + np.array([[200.0, 137.0, -5.0], [400.0, 270.0, -10.0]])
            reason = "intruder 3A0000 25 s ahead, miss 120 m, turn right 34 deg"
            maneuver = Maneuver(t, waypoints, t + np.array([6.0, 12.0]), reason, t + 20, (ids[0],))
            events = (f"maneuver: {reason}",)
        if k == 750:
            maneuver, events = None, ("clear of 3A0000, return to the mission",)
        scans = [
            Scan(
                t,
                t,
                "adsb",
                "adsb",
                np.column_stack([positions, velocity])[k % 3 :: 3]
                + rng.normal(0, 20, (len(range(k % 3, aircraft, 3)), 6)),
                np.tile(np.diag([400.0, 400, 100, 9, 9, 1]), (len(range(k % 3, aircraft, 3)), 1, 1)),
                np.full(len(range(k % 3, aircraft, 3)), t - 0.2),
                ids[k % 3 :: 3],
                tuple(infos[k % 3 :: 3]),
            )
        ]
        yield (
            Snapshot(
                t,
                ownship,
                tracks,
                threats,
                maneuver,
                max((threat.level for threat in threats), default=AlertLevel.CLEAR),
                1,
                {"adsb": SensorHealth(0.1, 2.0 * aircraft, {"out of range": k // 7, "frozen position": k // 50})},
                {"tracking": 2e-4, "conflict": 1e-4 * (1 + rng.random())},
                events,
            ),
            scans,
            Truth(t, ids, positions, np.tile(velocity, 1)),
        )


def _level(distance: float) -> AlertLevel:
    limits = ((1200, AlertLevel.WARNING), (2200, AlertLevel.CORRECTIVE), (3200, AlertLevel.PREVENTIVE))
    return next((level for limit, level in limits if distance < limit), AlertLevel.CLEAR)
