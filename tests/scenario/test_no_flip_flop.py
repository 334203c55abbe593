"""Commitment: over random encounters maneuvers do not flip from one side to the other."""

import math
import os
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import pytest

from wideberth.avoidance.config import LocalLevelConfig
from wideberth.avoidance.local_level import LocalLevelPlanner
from wideberth.conflict.config import DetectionConfig
from wideberth.conflict.detector import AdsbDetector
from wideberth.evaluation.reversals import ReversalCounter
from wideberth.pipeline import Pipeline
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.sensors.adsb.simulated import SimulatedAdsb
from wideberth.simulation.modelled_sensors import ModelledSensor
from wideberth.simulation.truth import Truth
from wideberth.simulation.world import SimWorld
from wideberth.tracking.adsb_kalman import AdsbKalmanTracker
from wideberth.tracking.config import AdsbKalmanConfig
from wideberth.types import FloatArray, Mission
from wideberth.units import FOOT, KNOT
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import PointMass

ENCOUNTERS = 1000 if os.environ.get("WIDEBERTH_FULL_COUNTS") else 190
DURATION = 150  # s
SPEED = 80 * KNOT
ALTITUDE = 900.0
NEAR = 2500.0  # m: no intruder begins nearer, and so none begins inside the SARP volume
ADDRESSES = ("a00001", "a00002")


class StraightTraffic:
    def __init__(self, positions: FloatArray, velocities: FloatArray) -> None:
        self.ids = ADDRESSES[: len(positions)]
        self.positions, self.velocities = positions, velocities

    def truth(self, t: float) -> Truth:
        return Truth(t, self.ids, self.positions + t * self.velocities, self.velocities)


@dataclass
class Outcome:
    reversals: int
    maneuvers: int
    nmac: bool
    least: float  # of max(d_h / 500 ft, |d_v| / 100 ft)
    told: list[str]


def encounter(seed: int) -> StraightTraffic:
    """One intruder, or two with odd seeds: on courses that pass within 500 ft of the ownship's mission, +-160 ft."""
    rng = np.random.default_rng([seed, 0xF11F])
    positions: list[FloatArray] = []
    velocities: list[FloatArray] = []
    while len(positions) < 1 + seed % 2:
        t_cpa = rng.uniform(50.0, 75.0)
        speed, course = rng.uniform(39, 250) * KNOT, rng.uniform(-math.pi, math.pi)
        velocity = np.array([speed * math.cos(course), speed * math.sin(course), 0.0])
        relative = velocity[:2] - [SPEED, 0.0]
        aside = rng.uniform(-500, 500) * FOOT * np.array([-relative[1], relative[0]]) / np.hypot(*relative)
        meeting = np.array([SPEED * t_cpa + aside[0], aside[1], -ALTITUDE + rng.uniform(-160, 160) * FOOT])
        start = meeting - t_cpa * velocity
        if math.hypot(start[0], start[1]) > NEAR:
            positions.append(start)
            velocities.append(velocity)
    return StraightTraffic(np.array(positions), np.array(velocities))


def fly(seed: int, avoidance: dict[str, Any] | None = None) -> Outcome:
    traffic = encounter(seed)
    mission = Mission(np.array([[0.0, 0.0, -ALTITUDE], [14e3, 0.0, -ALTITUDE]]), np.full(2, SPEED), 0.0)
    vehicle = PointMass(PointMassConfig())
    least = math.inf

    def observe(t: float, position: FloatArray, velocity: FloatArray, truth: Truth) -> None:
        nonlocal least
        for other in truth.positions.tolist():
            horizontal = math.hypot(other[0] - position[0], other[1] - position[1])
            least = min(least, max(horizontal / (500 * FOOT), abs(other[2] - position[2]) / (100 * FOOT)))

    sensor = SimulatedAdsb(AdsbErrorConfig(), seed, traffic.ids)
    world = SimWorld(mission, vehicle, traffic, [ModelledSensor(sensor, traffic)], observe)
    pipeline = Pipeline(
        AdsbKalmanTracker(AdsbKalmanConfig()),
        AdsbDetector(DetectionConfig()),
        LocalLevelPlanner(LocalLevelConfig(**(avoidance or {})), vehicle.params),
        60.0,
        lambda: 0.0,
    )
    counter = ReversalCounter()
    chosen: set[float] = set()
    told = []
    for t in range(DURATION + 1):
        ownship, scans = world.sense(float(t))
        snapshot = pipeline.step(float(t), ownship, scans, world.mission)
        world.actuate(float(t), snapshot.maneuver)
        reversal = counter.update(snapshot)
        if snapshot.maneuver is not None:
            chosen.add(snapshot.maneuver.t)
        told += [f"{t} s: {event}{' <- reversal' if reversal else ''}" for event in snapshot.events]
        others = traffic.truth(float(t))
        gone = np.einsum("ij,ij->i", others.positions - ownship.position, others.velocities - ownship.velocity) > 0
        if t > 50 and snapshot.maneuver is None and gone.all():
            break
    return Outcome(counter.count, len(chosen), least < 1.0, least, told)


@pytest.mark.skipif(bool(vars(numba.config)["DISABLE_JIT"]), reason="takes hours without the compiler")
def test_maneuvers_do_not_flip():
    """Fewer than 1 in 100 encounters with a reversal, and no near mid-air collision.

    Measured over 1,000 (`make experiments`): 6 with one reversal each (all of two intruders, five where the second is
    first heard a second or two after the maneuver against the first began), 95 % Wilson interval 0.3 % to 1.3 %; none
    collided (upper bound 0.38 %), and the least of max(d_h / 500 ft, |d_v| / 100 ft) was 4.98. The first 190 decide
    that fewer than 3 in 100 reverse, at 95 %. The seeds are fixed: the bounds are on these encounters.
    """
    reversed_, collided = [], []
    flown = 0
    for seed in range(ENCOUNTERS):
        outcome = fly(seed)
        flown += outcome.maneuvers > 0
        if outcome.reversals:
            reversed_.append((seed, outcome.told))
        if outcome.nmac:
            collided.append((seed, outcome.least, outcome.told))
    assert len(reversed_) < ENCOUNTERS / 100, reversed_
    assert not collided, collided
    assert flown > 0.99 * ENCOUNTERS
