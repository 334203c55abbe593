"""A fixed wing as a rigid body, flown by its autopilot: takes the place of the point mass."""

import math

import numpy as np

from wideberth.frames import rotation_ned_body
from wideberth.types import FloatArray, Ownship
from wideberth.vehicles import autopilot_kernels as ak
from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles import kernels
from wideberth.vehicles.aircraft import AIRCRAFT
from wideberth.vehicles.autopilot_gains import gains
from wideberth.vehicles.config import FixedWingConfig
from wideberth.vehicles.gusts import DrydenGusts
from wideberth.vehicles.point_mass import parameters
from wideberth.vehicles.trim import quaternion, trim


class FixedWing:
    """A fixed wing that is commanded by airspeed, course and climb rate.

    Parameters
    ----------
    config : FixedWingConfig
    wind : ndarray, shape (3,), optional
        Steady wind, NED, m/s; none by default. Gusts come on top.

    Attributes
    ----------
    params : ndarray
        The point mass that stands for this aircraft in planning and guidance (indices ``P_...`` of
        `wideberth.vehicles.kernels`).
    state : ndarray, shape (7,)
        What a point mass would say: north, east, down, airspeed, heading, bank, climb rate; of the motion through the
        steady wind. Written by `step`; the motion itself is `body`.
    body : ndarray, shape (13,)
        State of `fixed_wing_kernels`.
    controls : ndarray, shape (4,)
        Elevator, aileron, rudder, throttle.
    gains : ndarray
        Of the autopilot (indices ``K_...``).
    """

    Config = FixedWingConfig

    def __init__(self, config: FixedWingConfig, wind: FloatArray | None = None) -> None:
        self.config = config
        self.params = parameters(config)
        self.wind = np.zeros(3) if wind is None else np.asarray(wind, float)
        aircraft = AIRCRAFT[config.aircraft]
        self.gains = gains(aircraft, config)
        self._aircraft = aircraft.array(config.air_density_kgm3)
        self._gusts = DrydenGusts(config.turbulence, config.gust_seed)
        self._memory = np.zeros(ak.N_MEMORY)
        self._command = np.zeros(4)
        self.body = np.zeros(fk.N_BODY)
        self.controls = np.zeros(fk.N_CONTROLS)
        self.state = np.zeros(kernels.N_STATES)
        self.place(np.zeros(3), np.array([aircraft.design_speed, 0.0, 0.0]) + self.wind)

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the aircraft at a position (3,), trimmed, with a velocity over ground (3,), NED, within its limits."""
        air = np.asarray(velocity, float) - self.wind
        if not (np.all(np.isfinite(position)) and np.all(np.isfinite(air))):
            raise ValueError(f"position {position} and velocity {velocity} must be finite")
        config = self.config
        speed = kernels.clip(math.sqrt(float(air @ air)), config.speed_min_mps, config.speed_max_mps)
        climb = kernels.clip(-float(air[2]), -config.sink_rate_max_mps, config.climb_rate_max_mps)
        flight = trim(self._aircraft, speed, math.asin(climb / speed))
        heading = math.atan2(air[1], air[0])
        body = self.body
        body[:] = flight.state
        body[:3] = position
        # Trimmed at yaw 0, where sideslip turns the course a little away from it.
        north, east, _ = fk.body_to_ned(body, body[fk.U], body[fk.V], body[fk.W])
        body[fk.E0 : fk.E3 + 1] = quaternion(flight.roll, flight.pitch, heading - math.atan2(east, north))
        body[fk.U : fk.W + 1] += fk.ned_to_body(body, self.wind[0], self.wind[1], self.wind[2])
        self.controls[:] = flight.controls
        self._memory[:] = 0.0
        self._memory[ak.M_BANK_WANTED] = flight.roll
        self._memory[ak.M_CLIMB_WANTED] = climb - self.wind[2]
        self._memory[ak.M_SPEED_WANTED] = speed
        self._report()

    def step(self, command: FloatArray, dt: float) -> None:
        """Advance by `dt` seconds under a command: airspeed (m/s), course (rad), climb rate (m/s), bank fed forward.

        Parameters
        ----------
        command : ndarray, shape (3,) or (4,)
            Without a bank none is fed forward. What the aircraft cannot do is limited.
        dt : float

        Raises
        ------
        ValueError
            If the command is not finite, or has another shape, or `dt` is negative or not finite.
        """
        given = np.asarray(command, float)
        if given.shape not in ((3,), (4,)) or not np.all(np.isfinite(given)):
            raise ValueError(f"a command is airspeed, course, climb rate and perhaps bank, all finite; not {command}")
        if not 0.0 <= dt < math.inf:
            raise ValueError(f"dt {dt} must be finite and not negative")
        if dt == 0.0:
            return
        self._command[3] = 0.0
        self._command[: len(given)] = given
        # The climb rate wanted is through the air, as the point mass has it; the autopilot holds it over ground.
        self._command[2] -= self.wind[2]
        n = math.ceil(dt / self.config.step_s - 1e-9)
        ak.fly_fixed_wing(
            self.body,
            self._command,
            self.wind,
            self._aircraft,
            self.gains,
            dt / n,
            n,
            self._memory,
            self.controls,
            self._gusts.parameters,
            self._gusts.state,
            self._gusts.normals(n),
        )
        self._report()

    @property
    def velocity(self) -> FloatArray:
        """Velocity over ground (3,), NED, m/s."""
        body = self.body
        return np.array(fk.body_to_ned(body, body[fk.U], body[fk.V], body[fk.W]))

    def ownship(self, t: float) -> Ownship:
        """Return the state as an ownship at time `t`, without error."""
        attitude = rotation_ned_body(*fk.euler_angles(self.body))
        return Ownship(t, self.body[:3].copy(), self.velocity, attitude)

    def _report(self) -> None:
        """Write what a point mass would say into `state`."""
        state, air = self.state, self.velocity - self.wind
        state[:3] = self.body[:3]
        state[kernels.AIRSPEED] = math.sqrt(float(air @ air))
        state[kernels.HEADING] = math.atan2(air[1], air[0])
        state[kernels.BANK] = fk.euler_angles(self.body)[0]
        state[kernels.CLIMB] = -air[2]
