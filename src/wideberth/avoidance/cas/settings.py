"""From a controller's configuration to the settings of the kernels, and one decision from Python."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.avoidance.cas import maneuver_kernels as m
from wideberth.avoidance.cas import pair_kernels as k
from wideberth.avoidance.cas.config import CasConfig

CONTROLLERS = {
    "none": k.NONE,
    "bang_bang": k.BANG_BANG,
    "continuous": k.CONTINUOUS,
    "interval": k.INTERVAL,
    "altitudes": k.ALTITUDES,
    "horizontal": k.MANEUVERS,
    "speed": k.MANEUVERS,
    "combined": k.MANEUVERS,
    "least_deviation": k.MANEUVERS,
    "roundabout": k.MANEUVERS,
}
KINDS = {
    "horizontal": m.RIGHT | m.LEFT,
    "speed": m.SPEED,
    "combined": m.RIGHT | m.LEFT | m.SPEED | m.VERTICAL | m.COMBINED,
    "least_deviation": m.RIGHT | m.LEFT | m.SPEED | m.VERTICAL,
    "roundabout": m.RIGHT,
}
"""What each of these controllers may change."""
LAWS = {"full": k.FULL, "shared": k.SHARED, "shared_corrected": k.SHARED_CORRECTED}
COMPENSATIONS = {"none": k.UNCOMPENSATED, "estimate": k.ESTIMATE, "timestamp": k.TIMESTAMP}
REASONS = ("none", "current trajectory", "return trajectory", "held", "inside", "forced")
"""Why a vehicle avoids, by the kernels' numbers."""


class Decision(NamedTuple):
    """What a controller decided.

    Attributes
    ----------
    avoid : bool
    rate : float
        Velocity down to fly, m/s: guidance's where it does not avoid.
    reason : str
        One of `REASONS`.
    t_star, d_star : float
        Time and distance of the closest point on the current course, s and m.
    """

    avoid: bool
    rate: float
    reason: str
    t_star: float
    d_star: float


def settings(config: CasConfig) -> FloatArray:
    """Return the settings (N_SETTINGS,) of the kernels."""
    p = np.zeros(k.N_SETTINGS)
    p[k.P_SEPARATION] = config.separation_m + config.margin_m
    p[k.P_HALF_HEIGHT] = 0.0 if config.half_height_m is None else config.half_height_m + config.margin_m
    p[k.P_UP], p[k.P_DOWN] = -config.climb_rate_max_mps, config.sink_rate_max_mps
    p[k.P_RETURN_UP], p[k.P_RETURN_DOWN] = -config.return_climb_rate_max_mps, config.return_sink_rate_max_mps
    p[k.P_LAG], p[k.P_GAIN] = config.lag_s, config.guidance_gain_per_s
    p[k.P_HYSTERESIS] = config.hysteresis_m
    p[k.P_T_STAR_MIN] = math.inf if config.t_star_min_s is None else config.t_star_min_s
    p[k.P_LAW] = LAWS[config.law]
    p[k.P_COOPERATES] = config.other_cooperates
    p[k.P_LOWEST] = -config.altitude_min_m
    p[k.P_FORCE], p[k.P_DISABLE] = config.force, config.disable
    p[k.P_COMPENSATION], p[k.P_DELAY] = COMPENSATIONS[config.delay_compensation], config.delay_estimate_s
    p[k.P_RETURN_TIME] = math.inf if config.return_time_max_s is None else config.return_time_max_s
    p[k.P_TIE_BREAK] = config.tie_break
    p[k.P_RISE_TIME] = config.direction_at == "rise_time"
    p[k.P_LEAVE_INSIDE] = config.leave_inside
    p[k.P_SMOOTHING], p[k.P_STALE] = config.smoothing, config.stale_s
    p[k.P_MARGIN_GROWTH] = config.margin_growth_mps
    p[k.P_KINDS] = KINDS.get(config.controller, 0)
    p[k.P_LEVEL_LAG], p[k.P_SPEED_MAX] = config.level_lag_s, config.speed_max_mps
    p[k.P_CONTROLLER] = CONTROLLERS[config.controller]
    return p


class PairController:
    """A controller of one vehicle against one other, which remembers whether it avoids.

    Parameters
    ----------
    config : CasConfig
        With the controller ``bang_bang`` or ``continuous``.
    first : bool
        Whether this vehicle climbs where both are level.

    Raises
    ------
    ValueError
        For another controller.
    """

    def __init__(self, config: CasConfig, *, first: bool) -> None:
        if config.controller not in {"bang_bang", "continuous"}:
            raise ValueError(f"controller '{config.controller}' is for fleets: use bang_bang or continuous for a pair")
        self._p, self._first = settings(config), np.array([float(first)])
        self._reason, self._command, self._closest = np.zeros(1, np.int64), np.zeros(1), np.zeros((1, 2))

    def decide(self, own: ArrayLike, other: ArrayLike, z_wanted: float) -> Decision:
        """Return the decision for two states, and remember it.

        Parameters
        ----------
        own, other : array_like, shape (6,)
            Position and velocity, local NED, m and m/s; `other` already moved on by its delay.
        z_wanted : float
            Position down that guidance wants, m.

        Raises
        ------
        ValueError
            If a state has another shape or is not finite.
        """
        states = []
        for name, state in (("own", own), ("other", other)):
            array = checked(name, state, FINITE)
            if array.shape != (6,):
                raise ValueError(f"{name} must be (6,), position and velocity, not {array.shape}")
            states.append(np.ascontiguousarray(array[None, :]))
        wanted = checked("z_wanted", [z_wanted], FINITE)
        k.decide_pairs(states[0], states[1], wanted, self._first, self._p, self._reason, self._command, self._closest)
        reason = int(self._reason[0])
        return Decision(reason != k.NO_REASON, float(self._command[0]), REASONS[reason], *map(float, self._closest[0]))
