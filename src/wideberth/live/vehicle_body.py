"""The bodies that the simulated autopilot flies: our models of a plane and a copter."""

import math
from typing import Protocol

import numpy as np

from wideberth.links.mavlink.simulated_autopilot import FlightTarget
from wideberth.types import FloatArray, Ownship
from wideberth.vehicles import kernels
from wideberth.vehicles.config import MultirotorConfig, PointMassConfig
from wideberth.vehicles.guidance_kernels import K_ORBIT, orbit_course
from wideberth.vehicles.multirotor import Multirotor
from wideberth.vehicles.point_mass import PointMass

_TOWARDS_PER_S = 0.5  # m/s of a copter for each metre off its target
_ORBIT_RADII = 1.5  # a plane waits on a circle of so many radii of its tightest turn


class Body(Protocol):
    """Something that flies as an autopilot wants it."""

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put it at a position (3,) with a velocity (3,), local NED."""

    def fly(self, target: FlightTarget, dt: float) -> None:
        """Fly towards a target for `dt` seconds."""

    def ownship(self, t: float) -> Ownship:
        """Return its true state at time `t`."""


class PlaneBody:
    """A plane as a point mass: follows lines, and waits on a circle.

    Parameters
    ----------
    vehicle : PointMass
        Or another model of a plane with the same methods.
    """

    def __init__(self, vehicle: PointMass) -> None:
        self._vehicle = vehicle
        self._command = np.zeros(3)

    @classmethod
    def of(cls, config: PointMassConfig, wind: FloatArray | None = None) -> "PlaneBody":
        """Return a plane of a configuration, in a wind (3,), NED, m/s."""
        return cls(PointMass(config, wind))

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put it at a position (3,) with a velocity (3,), local NED."""
        self._vehicle.place(position, velocity)

    def fly(self, target: FlightTarget, dt: float) -> None:
        """Fly towards a target for `dt` seconds."""
        vehicle, x = self._vehicle, self._vehicle.state
        if target.holds:
            self._circle(target.end)
        else:
            points, speeds = np.vstack([target.start, target.end]), np.full(2, max(target.speed, 1.0))
            kernels.follow_path(x, points, speeds, 1, vehicle.params, vehicle.wind, self._command)
        vehicle.step(self._command, dt)

    def ownship(self, t: float) -> Ownship:
        """Return its true state at time `t`."""
        return self._vehicle.ownship(t)

    def _circle(self, center: FloatArray) -> None:
        config, x = self._vehicle.config, self._vehicle.state
        speed = 0.5 * (config.speed_min_mps + config.speed_max_mps)
        radius = _ORBIT_RADII * kernels.turn_radius(speed, math.radians(config.bank_max_deg))
        away = x[:2] - center[:2]
        distance = math.hypot(away[0], away[1])
        course = orbit_course(distance, math.atan2(away[1], away[0]), radius, 1.0, K_ORBIT)
        climb = config.altitude_gain_per_s * (x[2] - center[2])
        self._command[:] = speed, course, kernels.clip(climb, -config.sink_rate_max_mps, config.climb_rate_max_mps)


class CopterBody:
    """A multirotor in a wind (3,), NED, m/s: flies along lines, comes to rest at its target."""

    def __init__(self, config: MultirotorConfig, wind: FloatArray | None = None) -> None:
        self._vehicle = Multirotor(config, wind)
        self._config = config

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put it at a position (3,) with a velocity (3,), local NED."""
        self._vehicle.place(position, velocity)

    def fly(self, target: FlightTarget, dt: float) -> None:
        """Fly towards a target for `dt` seconds."""
        if target.holds:
            self._vehicle.hover(target.end, dt)
            return
        here = self._vehicle.body[:3]
        if target.velocity is not None:
            wanted = target.velocity + _TOWARDS_PER_S * (target.end - here)
        else:
            wanted = self._along(target, here)
        yaw = math.atan2(wanted[1], wanted[0]) if math.hypot(wanted[0], wanted[1]) > 0.5 else self._vehicle.state[4]
        self._vehicle.fly_velocity(wanted, float(yaw), dt)

    def ownship(self, t: float) -> Ownship:
        """Return its true state at time `t`."""
        return self._vehicle.ownship(t)

    def _along(self, target: FlightTarget, here: FloatArray) -> FloatArray:
        """Return the velocity that goes along a line to its end, back onto it where it is off."""
        leg, left = target.end - target.start, target.end - here
        length = math.sqrt(float(leg @ leg))
        if length < 0.1:
            return np.asarray(_TOWARDS_PER_S * left)
        unit = leg / length
        along = float(left @ unit)
        off = left - along * unit
        # Slow enough to stop at the end: v^2 = 2 a d.
        most = math.sqrt(2.0 * 0.5 * self._config.acceleration_max_mps2 * abs(along))
        speed = math.copysign(min(target.speed, most + 0.3), along)
        return np.asarray(speed * unit + _TOWARDS_PER_S * off)
