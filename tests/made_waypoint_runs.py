"""Closed-loop runs of the A* and chain planners: the ownship flies its mission through intruders seen exactly."""

import math
from dataclasses import dataclass

import numpy as np

from wideberth.avoidance.keep_out.kernels import path_enters
from wideberth.avoidance.keep_out.volumes import keep_out_arrays
from wideberth.avoidance.waypoint_paths.waypoint_manager import AStarChainPlanner
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import SimWorld
from wideberth.types import Maneuver, Mission, Track, TrackStatus
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass, parameters

SPEED = 13.0
SMALL_WING = PointMassConfig(
    speed_min_mps=9.0,
    speed_max_mps=17.0,
    bank_max_deg=45.0,
    climb_rate_max_mps=4.0,
    sink_rate_max_mps=4.0,
    waypoint_capture_m=60.0,
)

# Thesis scenario 1; the intruders' starts are read from its d_cpa (errata, "A*/chain planner").
SCENARIO_1 = (
    np.array([[-400.0, 0.0, -200.0], [500.0, 0.0, -200.0]]),
    [([530.0, 67.5, -200.0], [-17.0, 0.0, 0.0]), ([100.0, 475.3, -200.0], [0.0, -15.0, 0.0])],
)
# Like scenario 2: four intruders with its d_cpa of about 80, 240, 0 and 40 m; the last two are on a collision course.
SCENARIO_2 = (
    np.array([[-300.0, 0.0, -200.0], [500.0, 0.0, -200.0]]),
    [
        ([500.0, 79.9, -250.0], [-15.0, 0.0, 0.0]),
        ([300.0, -240.3, -200.0], [11.0, 0.0, 0.0]),
        ([100.0, 400.0, -200.0], [0.0, -13.0, 0.0]),
        ([640.0, -40.0, -200.0], [-12.0, 0.0, 0.0]),
    ],
)


class Straight:
    """Intruders in straight flight: a list of (position, velocity) at time 0."""

    def __init__(self, intruders):
        self._p = np.array([p for p, _ in intruders], float).reshape(-1, 3)
        self._v = np.array([v for _, v in intruders], float).reshape(-1, 3)

    def truth(self, t):
        ids = tuple(f"i{k}" for k in range(len(self._p)))
        return Truth(t, ids, self._p + self._v * t, self._v)


def tracks_of(truth, noise=(0.0, 0.0), rng=None):
    rng = rng or np.random.default_rng(0)
    return [
        Track(
            name,
            truth.t,
            p + rng.normal(0.0, noise[0], 3),
            v + rng.normal(0.0, noise[1], 3),
            np.zeros(3),
            np.zeros((9, 9)),
            TrackStatus.CONFIRMED,
            truth.t,
        )
        for name, p, v in zip(truth.ids, truth.positions, truth.velocities, strict=True)
    ]


@dataclass
class Flown:
    violated: float  # s in anybody's cylinder
    least: float  # smallest max(d / d_s, h / (h_s / 2))
    ratio: float  # flown length against the mission's
    places: np.ndarray  # (n, 3)
    maneuvers: list[Maneuver]  # one after the other
    done: bool
    counters: dict
    events: list[str]


def fly(scenario, planner=AStarChainPlanner, vehicle=SMALL_WING, speed=SPEED, noise=(0.0, 0.0), seed=0, longest=250.0,
        see=tracks_of, **config):  # fmt: skip
    waypoints, intruders = scenario
    settings = planner.Config(**config)
    part = planner(settings, parameters(vehicle))
    mission = Mission(np.array(waypoints, float), np.full(len(waypoints), speed), 0.0)
    traffic = Straight(intruders)
    world = SimWorld(mission, PointMass(vehicle), traffic, [])
    rng = np.random.default_rng(seed)
    violated, least, places, maneuvers, events = 0.0, math.inf, [], [], []
    step = 0
    while not world.done and step * 0.1 < longest:
        t = 0.1 * step
        own, _ = world.sense(t)
        truth = traffic.truth(t)
        offset = truth.positions - own.position
        scaled = np.hypot(offset[:, 0], offset[:, 1]) / settings.separation_radius_m
        if not settings.constant_altitude:
            scaled = np.maximum(scaled, np.abs(offset[:, 2]) / (0.5 * settings.separation_height_m))
        if len(scaled):
            least = min(least, float(scaled.min()))
            violated += 0.1 * float(scaled.min() < 1.0)
        maneuver, said = part.decide(t, own, see(truth, noise, rng), (), world.mission)
        if maneuver is not None and (not maneuvers or maneuvers[-1] is not maneuver):
            maneuvers.append(maneuver)
        events += said
        world.actuate(t, maneuver)
        places.append(own.position.copy())
        step += 1
    direct = np.linalg.norm(np.diff(mission.waypoints, axis=0), axis=1).sum()
    return Flown(
        violated, least, world.path_length / direct, np.array(places), maneuvers, world.done, dict(part.counters),
        events,
    )  # fmt: skip


def random_encounter(k):
    """A mission of 1500 m and one to four intruders that come within 100 m and 40 m of it."""
    rng = np.random.default_rng([7, k])
    intruders = []
    for _ in range(int(rng.integers(1, 5))):
        t_meet, speed, course = rng.uniform(25, 70), rng.uniform(8, 20), rng.uniform(-np.pi, np.pi)
        meet = np.array([SPEED * t_meet, 0.0, -200.0]) + np.array([*rng.uniform(-100, 100, 2), rng.uniform(-40, 40)])
        velocity = np.array([speed * np.cos(course), speed * np.sin(course), rng.choice([0.0, 0.0, 1.5, -1.5])])
        start = meet - velocity * t_meet
        distance = np.hypot(*start[:2])
        if distance < 350.0:  # no encounter begins with a collision
            start[:2] *= 500.0 / max(distance, 1.0)
        intruders.append((start, velocity))
    return np.array([[0.0, 0.0, -200.0], [1500.0, 0.0, -200.0]]), intruders


def enters(points, volumes):
    """Whether a path (n, 3) enters one of the keep-out volumes."""
    return path_enters(np.ascontiguousarray(points, float), len(points), *keep_out_arrays(volumes, 0.0)) >= 0
