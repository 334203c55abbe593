"""The helicopter of the CAS thesis: first-order velocity loops, waypoints with hover, stop and landing."""

import math

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import FINITE, POSITIVE, checked
from wideberth.frames import rotation_ned_body
from wideberth.types import FloatArray, Ownship
from wideberth.vehicles import rotorcraft_kernels as kernels
from wideberth.vehicles.config import RotorcraftConfig

MODES = {"hover": kernels.HOVER, "stop": kernels.STOP, "land": kernels.LAND}


class Rotorcraft:
    """A helicopter that is commanded by its velocity, NED.

    Parameters
    ----------
    config : RotorcraftConfig
    heading : float
        rad; it is held.

    Attributes
    ----------
    params : ndarray
        Parameters for the kernels (indices ``Q_...`` of `wideberth.vehicles.rotorcraft_kernels`).
    state : ndarray, shape (6,)
        Position and velocity, local NED, m and m/s.
    """

    Config = RotorcraftConfig

    def __init__(self, config: RotorcraftConfig, heading: float = 0.0) -> None:
        self.config = config
        self.heading = heading
        self.params = parameters(config)
        self.state = np.zeros(6)

    def place(self, position: ArrayLike, velocity: ArrayLike) -> None:
        """Put the vehicle at a position (3,) with a velocity (3,), NED.

        Raises
        ------
        ValueError
            If a value is not finite.
        """
        self.state[:3], self.state[3:] = checked("position", position, FINITE), checked("velocity", velocity, FINITE)

    def step(self, command: ArrayLike, dt: float) -> None:
        """Advance by `dt` seconds under a commanded velocity (3,), NED, m/s.

        Raises
        ------
        ValueError
            If the command is not finite, or `dt` not positive.
        """
        command = checked("command", command, FINITE)
        kernels.rotorcraft_step(self.state, command, self.heading, self.params, float(checked("dt", dt, POSITIVE)))

    def guide(self, target: ArrayLike, speed: float, mode: str = "hover") -> FloatArray:
        """Return the command (3,), m/s, that flies to a target.

        Parameters
        ----------
        target : array_like, shape (3,)
            Local NED, m.
        speed : float
            m/s, horizontal.
        mode : str
            ``hover`` at the target, ``stop`` at once, or ``land`` at the target.

        Raises
        ------
        ValueError
            If there is no such mode, or a value is not finite.
        """
        if mode not in MODES:
            raise ValueError(f"there is no mode '{mode}' (known: {', '.join(MODES)})")
        out = np.empty(3)
        place, pace = checked("target", target, FINITE), float(checked("speed", speed, POSITIVE))
        kernels.guide(self.state, place, pace, MODES[mode], self.params, out)
        return out

    @property
    def landed(self) -> bool:
        """Whether it stands on the ground, within 5 cm."""
        return bool(self.state[2] >= self.params[kernels.Q_GROUND] - 0.05)

    @property
    def velocity(self) -> FloatArray:
        """Velocity (3,), NED, m/s."""
        return self.state[3:].copy()

    def ownship(self, t: float) -> Ownship:
        """Return the state as an ownship at time `t`, level and without error."""
        return Ownship(t, self.state[:3].copy(), self.velocity, rotation_ned_body(0.0, 0.0, self.heading))


def parameters(config: RotorcraftConfig) -> FloatArray:
    """Return the kernels' parameter array of a configuration."""
    q = np.empty(kernels.N_PARAMS)
    q[kernels.Q_TAU_LEVEL] = config.level_time_constant_s
    q[kernels.Q_TAU_VERTICAL] = config.vertical_time_constant_s
    q[kernels.Q_SPEED_MAX] = config.speed_max_mps
    q[kernels.Q_CLIMB_MAX] = config.climb_rate_max_mps
    q[kernels.Q_SINK_MAX] = config.sink_rate_max_mps
    q[kernels.Q_COUPLING] = config.coupling * _peak_factor(
        config.level_time_constant_s / config.vertical_time_constant_s
    )
    q[kernels.Q_POSITION_GAIN] = config.position_gain_per_s
    q[kernels.Q_ALTITUDE_GAIN] = config.altitude_gain_per_s
    q[kernels.Q_GROUND] = -config.ground_altitude_m
    return q


def _peak_factor(ratio: float) -> float:
    """Return the acceleration coupling per peak velocity, for lateral over vertical time constant.

    The step's response a/(b - a) (exp(-a t) - exp(-b t)) has the peak (a/b)^(b/(b - a)), 1/e for equal lags.
    """
    if abs(ratio - 1.0) < 1e-4:
        return math.e
    return float(ratio ** (-1.0 / (1.0 - ratio)))
