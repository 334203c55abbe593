"""The world that the pipeline senses and acts on; here the simulated one, with a flown ownship and true traffic."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from wideberth.simulation.truth import Truth
from wideberth.types import FloatArray, Maneuver, Mission, Ownship, Scan
from wideberth.vehicles import kernels
from wideberth.vehicles.mission_path import MissionPath
from wideberth.vehicles.point_mass import PointMass

SUB_STEP = 0.1  # s, of motion and of scoring, whatever the pipeline's step


class World(Protocol):
    """What the pipeline senses and acts on: a simulation, a recording, the real one."""

    @property
    def mission(self) -> Mission:
        """The mission with its progress."""

    @property
    def done(self) -> bool:
        """Whether the mission is completed, or nothing more will come."""

    def sense(self, t: float) -> tuple[Ownship, list[Scan]]:
        """Return the ownship and the sensors' scans at time `t`, s; times must rise."""

    def actuate(self, t: float, maneuver: Maneuver | None) -> None:
        """Fly a maneuver from time `t` on; None: fly the mission."""


class TruthSource(Protocol):
    """True states of the traffic: simulated or recorded."""

    def truth(self, t: float) -> Truth:
        """Return the states at time `t`, s."""


class Sensor(Protocol):
    """A sensor in the simulated world."""

    def sense(self, t: float, ownship: Ownship) -> Sequence[Scan]:
        """Return what it saw since the last call, in no or several scans; `ownship` is the true one at `t`."""


class Navigation(Protocol):
    """What the ownship's own navigation makes of its true state."""

    def sense(self, ownship: Ownship) -> Ownship:
        """Return the latest telemetry when the ownship truly is as given."""


Observer = Callable[[float, FloatArray, FloatArray, Truth], None]


class SimWorld:
    """A simulated world: the ownship flies its mission, or the maneuvers it is given, through traffic.

    The ownship starts at the mission's first waypoint, flying towards the second. A maneuver's waypoints are flown by
    straight-line following from where it was given, each at its time as far as the speed limits allow. Afterwards the
    ownship rejoins the mission's leg it was on. Mission waypoints count as passed only where the ownship flew past them
    (within the vehicle's capture distance), also during a maneuver; a missed one is flown back to.

    Parameters
    ----------
    mission : Mission
    vehicle : PointMass
    traffic : TruthSource
    sensors : sequence of Sensor
    observer : callable, optional
        Told time, the ownship's true position and velocity, and the truth, at the start and after every sub-step of at
        most 0.1 s: ``observer(t, position, velocity, truth)``.
    navigation : Navigation, optional
        What the pipeline is told; guidance flies by the true state. By default the pipeline is told that too.
    path : MissionPath, optional
        The mission's lines and arcs; by default its straight legs are flown, turns anticipated. After a maneuver they
        are flown straight up to the next waypoint, from where the path goes on.
    """

    def __init__(
        self,
        mission: Mission,
        vehicle: PointMass,
        traffic: TruthSource,
        sensors: Sequence[Sensor],
        observer: Observer | None = None,
        navigation: Navigation | None = None,
        path: MissionPath | None = None,
    ) -> None:
        self.vehicle = vehicle
        self._path = path
        self._on_path = path is not None
        self.traffic = traffic
        self._sensors = tuple(sensors)
        self._observer = observer
        self._navigation = navigation
        self._waypoints = np.ascontiguousarray(mission.waypoints, float)
        self._speeds = np.ascontiguousarray(mission.speeds, float)
        if self._waypoints.ndim != 2 or self._waypoints.shape[1:] != (3,) or len(self._waypoints) < 2:
            raise ValueError(f"a mission needs at least two waypoints (n, 3), not {self._waypoints.shape}")
        if not (np.all(np.isfinite(self._waypoints)) and np.all(self._speeds > 0)):
            raise ValueError("the mission's waypoints must be finite and its speeds positive")
        self._mission = mission
        self._index = max(mission.index, 1)
        self._t = mission.t_start
        self._path_length = 0.0
        self._command = np.zeros(3)
        if path is not None:
            path.join(self._index)
        self._maneuver: Maneuver | None = None
        self._maneuver_params = vehicle.params.copy()
        self._maneuver_params[kernels.P_CAPTURE] = math.inf
        self._maneuver_waypoints = np.empty((0, 3))
        self._maneuver_speeds = np.empty(0)
        self._maneuver_index = 0
        self._place()
        self._observe()

    @property
    def mission(self) -> Mission:
        """The mission with its progress."""
        if self._mission.index != self._index:
            self._mission = dataclasses.replace(self._mission, index=self._index)
        return self._mission

    @property
    def done(self) -> bool:
        """Whether the last waypoint is reached, with all before it."""
        return self._index >= len(self._waypoints)

    @property
    def time(self) -> float:
        """Time up to which the world has moved, s."""
        return self._t

    @property
    def path_length(self) -> float:
        """Length of the ownship's true path up to now, m."""
        return self._path_length

    def truth(self, t: float) -> Truth:
        """Return the true states of the traffic at time `t`, s."""
        return self.traffic.truth(t)

    def sense(self, t: float) -> tuple[Ownship, list[Scan]]:
        """Fly up to time `t`, s, and return the ownship and what its sensors saw.

        Raises
        ------
        ValueError
            If `t` lies before the last time, or before the mission's start.
        """
        if not t >= self._t:
            raise ValueError(f"time cannot run back from {self._t:.3f} s to {t:.3f} s")
        start = self._t
        n = math.ceil((t - start) / SUB_STEP - 1e-6)
        for k in range(1, n + 1):
            self._fly(t if k == n else start + (t - start) * k / n)
        self._t = t
        ownship = self.vehicle.ownship(t)
        scans = [scan for sensor in self._sensors for scan in sensor.sense(t, ownship)]
        return (self._navigation.sense(ownship) if self._navigation else ownship), scans

    def actuate(self, t: float, maneuver: Maneuver | None) -> None:
        """Fly `maneuver` from time `t` on, at most while it is valid; None: fly the mission.

        A maneuver that is given again goes on where it is.

        Raises
        ------
        ValueError
            If the maneuver has no waypoint, or waypoints and times that do not fit or are not finite.
        """
        if maneuver is None or (self._maneuver is not None and _same(maneuver, self._maneuver)):
            self._maneuver = maneuver
            return
        waypoints, times = np.asarray(maneuver.waypoints, float), np.asarray(maneuver.times, float)
        if waypoints.ndim != 2 or waypoints.shape[1:] != (3,) or not len(waypoints) or times.shape != (len(waypoints),):
            raise ValueError(f"a maneuver needs waypoints (n, 3) with n times, not {waypoints.shape} and {times.shape}")
        if not (np.all(np.isfinite(waypoints)) and np.all(np.isfinite(times))):
            raise ValueError("the maneuver's waypoints and times must be finite")
        self._maneuver = maneuver
        # From here to its first waypoint is a leg too, so that the waypoint can be flown past but not circled.
        self._maneuver_waypoints = np.vstack([self.vehicle.state[:3], waypoints])
        self._maneuver_speeds = np.full(len(waypoints) + 1, self.vehicle.config.speed_min_mps)
        self._maneuver_index = 1

    def _place(self) -> None:
        """Put the ownship at the mission's start, flying along its first leg within its limits."""
        vehicle = self.vehicle
        end = kernels.leg_end(self._waypoints, 0)
        target = end if end > 0 else 1
        leg = self._waypoints[target] - self._waypoints[0]
        length = math.hypot(leg[0], leg[1])
        north, east = (leg[0] / length, leg[1] / length) if length > 0 else (1.0, 0.0)
        speed = self._speeds[target]
        climb = -leg[2] / length * speed if length > 0 else 0.0
        climb = min(max(climb, -vehicle.config.sink_rate_max_mps), vehicle.config.climb_rate_max_mps)
        vehicle.place(self._waypoints[0], np.array([speed * north, speed * east, vehicle.wind[2] - climb]))
        low, high = vehicle.config.speed_min_mps, vehicle.config.speed_max_mps
        vehicle.state[kernels.AIRSPEED] = min(max(vehicle.state[kernels.AIRSPEED], low), high)

    def _fly(self, t: float) -> None:
        vehicle, x = self.vehicle, self.vehicle.state
        maneuver = self._maneuver
        if maneuver is not None and self._t >= maneuver.valid_until:
            maneuver = self._maneuver = None
        command = self._command
        if maneuver is None:
            command = self._fly_mission()
        else:
            self._on_path = False
            self._follow(maneuver)
            n = len(self._waypoints)
            while self._index < n and kernels.waypoint_passed(
                x, self._waypoints, self._index, vehicle.params, vehicle.wind
            ):
                self._index += 1
        before = x[:3].tolist()
        vehicle.step(command, t - self._t)
        self._path_length += math.dist(before, x[:3].tolist())
        self._t = t
        self._observe()

    def _fly_mission(self) -> FloatArray:
        """Return the command that flies the mission, and note what of it is passed."""
        vehicle = self.vehicle
        if self._path is not None and self._on_path:
            command, self._index = self._path.command(vehicle)
            return command
        before = self._index
        self._index = kernels.follow_path(
            vehicle.state, self._waypoints, self._speeds, before, vehicle.params, vehicle.wind, self._command
        )
        if self._path is not None and self._index > before:
            self._on_path = True
            self._path.join(self._index)
        return self._command

    def _follow(self, maneuver: Maneuver) -> None:
        vehicle, config = self.vehicle, self.vehicle.config
        i = self._maneuver_index
        if i <= len(maneuver.waypoints):
            drift = math.hypot(vehicle.wind[0], vehicle.wind[1])
            self._maneuver_speeds[i] = kernels.speed_to_arrive(
                self._t,
                vehicle.state,
                self._maneuver_waypoints[i],
                float(maneuver.times[i - 1]),
                max(config.speed_min_mps - drift, 1.0),
                config.speed_max_mps + drift,
            )
        self._maneuver_index = kernels.follow_path(
            vehicle.state,
            self._maneuver_waypoints,
            self._maneuver_speeds,
            i,
            self._maneuver_params,
            vehicle.wind,
            self._command,
        )

    def _observe(self) -> None:
        if self._observer is not None:
            state = self.vehicle.state
            self._observer(self._t, state[:3].copy(), self.vehicle.velocity, self.traffic.truth(self._t))


def _same(a: Maneuver, b: Maneuver) -> bool:
    return a is b or (a.t == b.t and np.array_equal(a.waypoints, b.waypoints) and np.array_equal(a.times, b.times))
