"""The 5-DOF point mass: speed, heading by bank, climb; each with a first-order lag and limits."""

import math

import numpy as np

from wideberth.frames import rotation_ned_body
from wideberth.types import FloatArray, Ownship
from wideberth.vehicles import kernels
from wideberth.vehicles.config import FixedWingConfig, MultirotorConfig, PointMassConfig


class PointMass:
    """A point mass that is commanded by airspeed, course and climb rate.

    Parameters
    ----------
    config : PointMassConfig
    wind : ndarray, shape (3,), optional
        Constant wind, NED, m/s; none by default.

    Attributes
    ----------
    params : ndarray
        Parameters for the kernels (indices ``P_...`` of `wideberth.vehicles.kernels`), for flying a mission.
    state : ndarray, shape (7,)
        North, east, down, airspeed, heading, bank, climb rate; SI, rad.
    """

    Config = PointMassConfig

    def __init__(self, config: PointMassConfig, wind: FloatArray | None = None) -> None:
        self.config = config
        self.params = parameters(config)
        self.wind = np.zeros(3) if wind is None else np.asarray(wind, float)
        self.state = np.zeros(kernels.N_STATES)
        self.state[kernels.AIRSPEED] = config.speed_min_mps

    def place(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the vehicle at a position (3,) with a velocity over ground (3,), NED, wings level."""
        air = np.asarray(velocity, float) - self.wind
        self.state[:3] = position
        self.state[kernels.AIRSPEED] = math.sqrt(float(air @ air))
        self.state[kernels.HEADING] = math.atan2(air[1], air[0])
        self.state[kernels.BANK] = 0.0
        self.state[kernels.CLIMB] = -air[2]

    def step(self, command: FloatArray, dt: float) -> None:
        """Advance by `dt` seconds under a command (3,): airspeed, course, climb rate; m/s, rad, m/s."""
        kernels.point_mass_step(self.state, command, self.wind, self.params, dt)

    @property
    def velocity(self) -> FloatArray:
        """Velocity over ground (3,), NED, m/s."""
        out = np.empty(3)
        kernels.ground_velocity(self.state, self.wind, out)
        return out

    def ownship(self, t: float) -> Ownship:
        """Return the state as an ownship at time `t`, without error."""
        x = self.state
        pitch = math.asin(kernels.clip(x[kernels.CLIMB] / max(x[kernels.AIRSPEED], 1.0), -1.0, 1.0))
        attitude = rotation_ned_body(x[kernels.BANK], pitch, x[kernels.HEADING])
        return Ownship(t, x[:3].copy(), self.velocity, attitude)


def parameters(config: PointMassConfig | FixedWingConfig | MultirotorConfig) -> FloatArray:
    """Return the kernels' parameter array of a configuration."""
    p = np.empty(kernels.N_PARAMS)
    p[kernels.P_TAU_SPEED] = config.speed_time_constant_s
    p[kernels.P_ACCEL_MAX] = config.acceleration_max_mps2
    p[kernels.P_SPEED_MIN] = config.speed_min_mps
    p[kernels.P_SPEED_MAX] = config.speed_max_mps
    p[kernels.P_TAU_BANK] = config.bank_time_constant_s
    p[kernels.P_BANK_MAX] = math.radians(config.bank_max_deg)
    p[kernels.P_BANK_RATE_MAX] = math.radians(config.bank_rate_max_deg_s)
    p[kernels.P_COURSE_GAIN] = config.course_gain_per_s
    p[kernels.P_TAU_CLIMB] = config.climb_time_constant_s
    p[kernels.P_CLIMB_MAX] = config.climb_rate_max_mps
    p[kernels.P_SINK_MAX] = config.sink_rate_max_mps
    p[kernels.P_VERTICAL_ACCEL_MAX] = config.vertical_acceleration_max_mps2
    p[kernels.P_CHI_INF] = math.radians(config.chi_inf_deg)
    p[kernels.P_PATH_GAIN] = config.path_gain_per_s
    p[kernels.P_ALTITUDE_GAIN] = config.altitude_gain_per_s
    p[kernels.P_CAPTURE] = config.waypoint_capture_m
    return p
