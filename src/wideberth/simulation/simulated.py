"""Simulated traffic: straight courses, legs, waypoints flown by the point mass, and aircraft flown by JSBSim."""

import math

import numpy as np

from wideberth.frames import LocalFrame
from wideberth.simulation.config import IntruderConfig, SimulatedTrafficConfig, path_arrays
from wideberth.simulation.jsbsim_flight import Flight, JsbsimFlight
from wideberth.simulation.legs import Leg, LegFlight
from wideberth.simulation.truth import Truth
from wideberth.types import FloatArray
from wideberth.vehicles import kernels
from wideberth.vehicles.config import PointMassConfig
from wideberth.vehicles.point_mass import parameters

STEP = 0.1  # s, of the intruders' motion
CAPTURE = 1e6  # m: an intruder never flies back to a waypoint
_CHUNK = 600  # steps flown ahead at once


class SimulatedTraffic:
    """The true states of simulated intruders at any time.

    Intruders on waypoints are flown as point masses that may fly a third slower and faster than their waypoints say and
    keep the last leg's course afterwards; others fly the legs that they have, and then keep course, speed and climb.

    Parameters
    ----------
    config : SimulatedTrafficConfig
    frame : LocalFrame
    t_start : float
        Time at which the intruders are where the configuration puts them, s.
    wind : ndarray, shape (3,), optional
        NED, m/s. Speeds and courses are over ground: only the flight between waypoints feels it.

    Attributes
    ----------
    ids : tuple of str
        Addresses, in the order of the configuration.
    callsigns : tuple of (str or None)
        In the same order.
    rcs_m2 : tuple of float
        In the same order.
    broadcasting : ndarray of int64, shape (n,)
        Which of them have ADS-B.
    ownship_rcs_m2 : float
    """

    def __init__(
        self,
        config: SimulatedTrafficConfig,
        frame: LocalFrame,
        t_start: float = 0.0,
        wind: FloatArray | None = None,
    ) -> None:
        self.ids = tuple(i.address for i in config.intruders)
        self.callsigns = tuple(i.callsign for i in config.intruders)
        self.rcs_m2 = tuple(i.rcs_m2 for i in config.intruders)
        self.broadcasting = np.flatnonzero([i.broadcasts for i in config.intruders])
        self.ownship_rcs_m2 = config.ownship_rcs_m2
        self._t_start = t_start
        air = np.zeros(3) if wind is None else np.asarray(wind, float)
        self._flights = [_flight(i, frame, air) for i in config.intruders]
        self._last = Truth.empty(math.nan)

    def truth(self, t: float) -> Truth:
        """Return the states of all intruders at time `t`, s (before the start: where they would have come from)."""
        if not self.ids:
            return Truth.empty(t)
        # Sensors, scores and recording ask for the same instant.
        if self._last.t != t:
            flown = [flight.state(t - self._t_start) for flight in self._flights]
            states = np.concatenate(flown).reshape(len(flown), 6)
            self._last = Truth(t, self.ids, states[:, :3], states[:, 3:])
        return self._last


class _StraightFlight:
    def __init__(self, position: FloatArray, velocity: FloatArray) -> None:
        self._position, self._velocity = position, velocity

    def state(self, t: float) -> FloatArray:
        return np.concatenate([self._position + t * self._velocity, self._velocity])


class _PathFlight:
    """A path flown ahead in chunks; linear between its steps, so that it does not depend on when it is asked."""

    def __init__(self, waypoints: FloatArray, speeds: FloatArray, wind: FloatArray) -> None:
        self._waypoints, self._speeds, self._wind = waypoints, speeds, wind
        self._index = 1
        self._params = parameters(
            PointMassConfig(
                speed_min_mps=max(1.0, 2 / 3 * float(speeds.min()) - float(np.linalg.norm(wind))),
                speed_max_mps=4 / 3 * float(speeds.max()) + float(np.linalg.norm(wind)) + 1.0,
                climb_rate_max_mps=min(15.0, 0.3 * float(speeds.min())),
                sink_rate_max_mps=min(15.0, 0.3 * float(speeds.min())),
                bank_max_deg=30.0,
                waypoint_capture_m=CAPTURE,
            )
        )
        course = waypoints[1] - waypoints[0]
        length = math.hypot(course[0], course[1])
        direction = course / length if length > 0 else np.array([1.0, 0.0, 0.0])
        climb = min(
            max(-direction[2] * speeds[1], -self._params[kernels.P_SINK_MAX]), self._params[kernels.P_CLIMB_MAX]
        )
        air = np.array([speeds[1] * direction[0], speeds[1] * direction[1], 0.0]) - wind
        self._x = np.zeros(kernels.N_STATES)
        self._x[:3] = waypoints[0]
        self._x[kernels.AIRSPEED] = math.sqrt(air[0] ** 2 + air[1] ** 2 + climb**2)
        self._x[kernels.HEADING] = math.atan2(air[1], air[0])
        self._x[kernels.CLIMB] = climb
        self._states = np.empty((0, 6))
        self._append(self._x[None, :])

    def state(self, t: float) -> FloatArray:
        steps = t / STEP
        if steps <= 0:
            first: FloatArray = self._states[0].copy()
            first[:3] += t * first[3:]
            return first
        while steps >= len(self._states) - 1:
            out = np.empty((_CHUNK, kernels.N_STATES))
            self._index = kernels.fly_path(
                self._x, self._waypoints, self._speeds, self._index, self._params, self._wind, STEP, _CHUNK, out
            )
            self._x = out[-1].copy()
            self._append(out)
        k = int(steps)
        state: FloatArray = self._states[k] + (steps - k) * (self._states[k + 1] - self._states[k])
        return state

    def _append(self, states: FloatArray) -> None:
        new = np.empty((len(states), 6))
        new[:, :3] = states[:, :3]
        for row, x in zip(new, states, strict=True):
            kernels.ground_velocity(x, self._wind, row[3:])
        self._states = np.concatenate([self._states, new])


def _flight(config: IntruderConfig, frame: LocalFrame, wind: FloatArray) -> Flight:
    flight = _described(config, frame, wind)
    return flight if config.aircraft is None else JsbsimFlight(config.aircraft, flight, frame, wind)


def _described(config: IntruderConfig, frame: LocalFrame, wind: FloatArray) -> Flight:
    if config.waypoints:
        return _path(config, frame, wind)
    return _legs(config, frame) if config.legs else _line(config, frame)


def _legs(config: IntruderConfig, frame: LocalFrame) -> LegFlight:
    assert config.position is not None  # the configuration has checked it
    north, east, down = config.velocity()
    ground = math.hypot(north, east)
    legs = [
        Leg(
            leg.duration_s,
            leg.acceleration_mps2,
            math.radians(leg.turn_rate_dps),
            math.radians(leg.path_angle_rate_dps),
        )
        for leg in config.legs
    ]
    start = config.position.ned(frame)
    course = math.radians(config.course_deg or 0.0)
    return LegFlight(start, math.hypot(ground, down), course, math.atan2(-down, ground), legs)


def _line(config: IntruderConfig, frame: LocalFrame) -> _StraightFlight:
    assert config.position is not None  # the configuration has checked it
    return _StraightFlight(config.position.ned(frame), config.velocity())


def _path(config: IntruderConfig, frame: LocalFrame, wind: FloatArray) -> _PathFlight:
    waypoints, speeds = path_arrays(config.waypoints, config.speed_mps, frame)
    return _PathFlight(waypoints, speeds, wind)
