"""Closed-loop runs of the vertical planners: the ownship flies its mission through intruders seen exactly."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.made_waypoint_runs import SMALL_WING, SPEED, Straight, tracks_of
from wideberth.avoidance.vertical.planner import VerticalPlanner
from wideberth.simulation.world import SimWorld
from wideberth.types import FloatArray, Maneuver, Mission
from wideberth.vehicles.point_mass import PointMass, parameters

WAY = np.array([[0.0, 0.0, -200.0], [1400.0, 0.0, -200.0]])


@dataclass
class Flown:
    least: float  # smallest miss in times of the zone's size
    places: FloatArray  # (n, 3)
    maneuvers: list[Maneuver]  # one after the other
    done: bool
    counters: dict[str, int]
    events: list[str]

    @property
    def lowest(self) -> float:
        return float(-self.places[:, 2].max())

    @property
    def highest(self) -> float:
        return float(-self.places[:, 2].min())


def fly(kind: type[VerticalPlanner], intruders: Any, way: Any = WAY, vehicle: Any = SMALL_WING, **config: Any) -> Flown:
    settings = kind.Config(**config)
    part = kind(settings, parameters(vehicle))
    mission = Mission(np.array(way, float), np.full(len(way), SPEED), 0.0)
    traffic = Straight(intruders)
    world = SimWorld(mission, PointMass(vehicle), traffic, [])
    least, places = math.inf, []
    maneuvers: list[Maneuver] = []
    events: list[str] = []
    step = 0
    while not world.done and step < 2500:
        t = 0.1 * step
        own, _ = world.sense(t)
        truth = traffic.truth(t)
        for offset in truth.positions - own.position:
            if settings.zone == "sphere":
                miss = float(np.linalg.norm(offset)) / settings.separation_m
            else:
                level = math.hypot(offset[0], offset[1])
                miss = max(level / settings.separation_m, abs(offset[2]) / settings.half_height_m)
            least = min(least, miss)
        maneuver, said = part.decide(t, own, tracks_of(truth), (), world.mission)
        if maneuver is not None and (not maneuvers or maneuvers[-1] is not maneuver):
            maneuvers.append(maneuver)
        events += said
        world.actuate(t, maneuver)
        places.append(own.position.copy())
        step += 1
    return Flown(least, np.array(places), maneuvers, world.done, dict(part.counters), events)


def encounter(rng: np.random.Generator, kind: str) -> tuple[FloatArray, FloatArray]:
    """An intruder in straight flight that comes within 80 m and 25 m of the ownship on its mission."""
    at = rng.uniform(45.0, 60.0)
    course = {"head_on": 180.0, "crossing": rng.choice([-120.0, -90.0, -60.0, 60.0, 90.0, 120.0]), "overtaking": 0.0}
    angle = math.radians(float(course[kind]) + rng.uniform(-10.0, 10.0))
    speed = rng.uniform(19.0, 30.0) if kind == "overtaking" else rng.uniform(14.0, 25.0)
    velocity = np.array([speed * math.cos(angle), speed * math.sin(angle), rng.choice([0.0, rng.uniform(-1.0, 1.0)])])
    meets = np.array([SPEED * at, 0.0, -200.0]) + np.array([*rng.uniform(-80, 80, 2), rng.uniform(-25, 25)])
    return meets - velocity * at, velocity
