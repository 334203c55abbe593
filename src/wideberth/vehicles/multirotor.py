"""A multirotor flown by a velocity loop: takes the place of the point mass."""

import math

import numpy as np

from wideberth.frames import rotation_ned_body
from wideberth.types import FloatArray, Ownship
from wideberth.vehicles import kernels
from wideberth.vehicles import multirotor_kernels as mk
from wideberth.vehicles.config import MultirotorConfig
from wideberth.vehicles.point_mass import parameters


class Multirotor:
    """A multirotor that is commanded by airspeed, course and climb rate, as a point mass, or by a velocity.

    Parameters
    ----------
    config : MultirotorConfig
    wind : ndarray, shape (3,), optional
        Constant wind, NED, m/s; none by default.

    Attributes
    ----------
    params : ndarray
        The point mass that stands for it in planning and guidance (indices ``P_...`` of `wideberth.vehicles.kernels`).
    state : ndarray, shape (7,)
        What a point mass would say; its bank is the one of a coordinated turn at the present turn rate. Heading is
        where it flies to through the air; where it stands, where it looks.
    body : ndarray, shape (10,)
        State of `multirotor_kernels`.
    """

    Config = MultirotorConfig

    def __init__(self, config: MultirotorConfig, wind: FloatArray | None = None) -> None:
        self.config = config
        self.params = parameters(config)
        self.wind = np.zeros(3) if wind is None else np.asarray(wind, float)
        q = np.empty(mk.N_ROTOR_PARAMS)
        q[mk.Q_TAU_ATTITUDE], q[mk.Q_TAU_THRUST] = config.attitude_time_constant_s, config.thrust_time_constant_s
        q[mk.Q_DRAG], q[mk.Q_TILT_MAX] = config.drag_per_s, math.radians(config.tilt_max_deg)
        q[mk.Q_TILT_RATE_MAX] = math.radians(config.tilt_rate_max_deg_s)
        q[mk.Q_THRUST_MAX] = config.thrust_max_weights
        q[mk.Q_YAW_RATE_MAX] = math.radians(config.yaw_rate_max_deg_s)
        q[mk.Q_VELOCITY_GAIN] = 1.0 / config.speed_time_constant_s
        q[mk.Q_VELOCITY_INTEGRAL] = 0.15 / config.speed_time_constant_s**2
        q[mk.Q_ACCEL_MAX] = config.acceleration_max_mps2
        self._parameters = q
        self._integrals = np.zeros(3)
        self._command = np.zeros(4)
        self.body = np.zeros(mk.N_ROTOR)
        self.state = np.zeros(kernels.N_STATES)
        self.place(np.zeros(3), self.wind + 0.0)

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put it at a position (3,), flying with a velocity over ground (3,), NED, in balance with its drag."""
        if not (np.all(np.isfinite(position)) and np.all(np.isfinite(velocity))):
            raise ValueError(f"position {position} and velocity {velocity} must be finite")
        body, ground = self.body, np.asarray(velocity, float)
        body[:3], body[3:6] = position, ground
        air = ground - self.wind
        body[mk.YAW] = math.atan2(ground[1], ground[0])
        drag = self._parameters[mk.Q_DRAG] * air
        self._integrals[:] = 0.0
        self._command[:3], self._command[3] = ground, body[mk.YAW]
        wanted = np.empty(4)
        mk.velocity_loop(body, self._command, self.wind, self._parameters, 0.0, self._integrals, wanted)
        body[mk.ROLL], body[mk.PITCH] = wanted[:2]
        up = kernels.GRAVITY - drag[2]
        body[mk.THRUST] = up / (math.cos(wanted[0]) * math.cos(wanted[1]))
        self._report(0.0)

    def step(self, command: FloatArray, dt: float) -> None:
        """Advance by `dt` seconds under a command (3,) or (4,): airspeed (m/s), course (rad), climb rate (m/s).

        A fourth number, the bank fed forward for a fixed wing, is not used. What it cannot do is limited.

        Raises
        ------
        ValueError
            If the command is not finite, or has another shape, or `dt` is negative or not finite.
        """
        given = np.asarray(command, float)
        if given.shape not in ((3,), (4,)) or not np.all(np.isfinite(given)):
            raise ValueError(f"a command is airspeed, course, climb rate and perhaps bank, all finite; not {command}")
        config = self.config
        climb = kernels.clip(given[2], -config.sink_rate_max_mps, config.climb_rate_max_mps)
        speed = kernels.clip(given[0], config.speed_min_mps, config.speed_max_mps)
        level = math.sqrt(max(speed * speed - climb * climb, 0.0))
        # The ground speed along the course that this airspeed gives; the wind across is held out.
        along = self.wind[0] * math.cos(given[1]) + self.wind[1] * math.sin(given[1])
        across = self.wind[1] * math.cos(given[1]) - self.wind[0] * math.sin(given[1])
        ground = math.sqrt(max(level * level - across * across, 0.0)) + along
        north, east = ground * math.cos(given[1]), ground * math.sin(given[1])
        self.fly_velocity(np.array([north, east, self.wind[2] - climb]), given[1], dt)

    def fly_velocity(self, velocity: FloatArray, yaw: float, dt: float) -> None:
        """Advance by `dt` seconds towards a velocity over ground (3,), NED, m/s, and a yaw, rad.

        Raises
        ------
        ValueError
            If anything is not finite, or `dt` is negative.
        """
        if not (np.all(np.isfinite(velocity)) and math.isfinite(yaw) and 0.0 <= dt < math.inf):
            raise ValueError(f"velocity {velocity}, yaw {yaw} and dt {dt} must be finite, and dt not negative")
        if dt == 0.0:
            return
        config, wanted = self.config, np.array(velocity, float)
        # Limited through the air, as its limits are: wind carries it along.
        air = wanted[:2] - self.wind[:2]
        fast = math.hypot(air[0], air[1]) / config.speed_max_mps
        wanted[:2] = self.wind[:2] + (air / fast if fast > 1.0 else air)
        wanted[2] = kernels.clip(wanted[2], -config.climb_rate_max_mps, config.sink_rate_max_mps)
        self._command[:3], self._command[3] = wanted, yaw
        n = math.ceil(dt / config.step_s - 1e-9)
        mk.fly_multirotor(self.body, self._command, self.wind, self._parameters, dt / n, n, self._integrals)
        self._report(dt)

    def hover(self, position: FloatArray, dt: float) -> None:
        """Advance by `dt` seconds towards a position (3,), NED, m, to stay there."""
        error = np.asarray(position, float) - self.body[:3]
        gain = 0.35 / self.config.speed_time_constant_s
        # Slower than it can brake: v^2 = 2 a d.
        distance = math.sqrt(float(error @ error))
        speed = min(gain * distance, math.sqrt(self.config.acceleration_max_mps2 * distance), self.config.speed_max_mps)
        self.fly_velocity(error * (speed / max(distance, 1e-9)), float(self.body[mk.YAW]), dt)

    @property
    def velocity(self) -> FloatArray:
        """Velocity over ground (3,), NED, m/s."""
        return self.body[3:6].copy()

    def ownship(self, t: float) -> Ownship:
        """Return the state as an ownship at time `t`, without error."""
        body = self.body
        attitude = rotation_ned_body(body[mk.ROLL], body[mk.PITCH], body[mk.YAW])
        return Ownship(t, body[:3].copy(), self.velocity, attitude)

    def _report(self, dt: float) -> None:
        """Write what a point mass would say into `state`."""
        state, air = self.state, self.body[3:6] - self.wind
        before = state[kernels.HEADING]
        state[:3] = self.body[:3]
        state[kernels.AIRSPEED] = math.sqrt(float(air @ air))
        level = math.hypot(air[0], air[1])
        state[kernels.HEADING] = math.atan2(air[1], air[0]) if level > 0.1 else self.body[mk.YAW]
        turn = math.remainder(state[kernels.HEADING] - before, 2.0 * math.pi) / dt if dt > 0.0 else 0.0
        bank = math.atan(turn * level / kernels.GRAVITY)
        most = math.radians(self.config.bank_max_deg)
        state[kernels.BANK] = kernels.clip(bank, -most, most)
        state[kernels.CLIMB] = -air[2]
