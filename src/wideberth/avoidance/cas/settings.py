"""From a controller's configuration to the settings of the kernels, and one decision from Python."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from wideberth.argument_checks import FINITE, FloatArray, checked
from wideberth.avoidance.cas import maneuver_kernels as m
from wideberth.avoidance.cas import pair_kernels as k
from wideberth.avoidance.cas import threshold_kernels as t
from wideberth.avoidance.cas.config import CasConfig
from wideberth.avoidance.cas.probability_table import load_table
from wideberth.errors import InputError

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
THRESHOLDS = {
    "deterministic": t.DETERMINISTIC,
    "probability": t.PROBABILITY,
    "table": t.TABLE,
    "guaranteed": t.GUARANTEED,
}
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


def settings(config: CasConfig, *, predicted: bool = False) -> FloatArray:
    """Return the settings (N_SETTINGS,) of the kernels.

    Parameters
    ----------
    config : CasConfig
    predicted : bool
        Whether the other vehicles' states come from a `TrafficPicture`, which knows all kinds of prediction.

    Raises
    ------
    InputError
        If another prediction is configured than the states as received and nobody predicts, or the table of conflict
        probabilities does not fit.
    """
    if not predicted and not config.prediction.as_received:
        raise InputError(
            "prediction: states are taken as received here; use kind = 'constant_velocity' without intent, "
            "or wideberth.avoidance.cas.vehicle_controller.VehicleController"
        )
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
    p[k.P_HIGHEST] = -math.inf if config.altitude_max_m is None else -config.altitude_max_m
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
    _set_threshold(config, p)
    return p


def alert_widths(probability: float) -> FloatArray:
    """Return by how many sigmas beyond the separation d the mean may pass, so that a miss below d is that probable.

    Parameters
    ----------
    probability : float
        At most 0.5.

    Returns
    -------
    ndarray, shape (N_DISTANCES,)
        At sigma / (d + sigma) from 0 to 1. P = Phi((d - m) / sigma) - Phi((-d - m) / sigma), solved for the larger m
        (errata, "Conflict probability"); -d / sigma, which is m = 0, where even that is less probable.
    """
    share = np.linspace(0.0, 1.0, t.N_DISTANCES)[1:-1]
    d = (1.0 - share) / share  # in sigmas
    low, high = -d, np.full(len(d), -float(ndtri(probability)))
    for _ in range(60):
        middle = 0.5 * (low + high)
        probable = ndtr(-middle) - ndtr(-2.0 * d - middle) >= probability
        low, high = np.where(probable, middle, low), np.where(probable, high, middle)
    return np.concatenate([[-ndtri(probability)], low, low[-1:]])


def _set_threshold(config: CasConfig, p: FloatArray) -> None:
    c = config.threshold
    p[t.P_THRESHOLD] = THRESHOLDS[c.kind]
    p[t.P_VARIANCE], p[t.P_RATE_VARIANCE] = c.relative_position_sigma_m**2, c.relative_velocity_sigma_mps**2
    p[t.P_DENSITY] = c.acceleration_density_m2ps3
    p[t.P_POSITION_BOUND], p[t.P_VELOCITY_BOUND] = c.position_bound_m, c.velocity_bound_mps
    p[t.P_ACCELERATION_BOUND] = c.acceleration_bound_mps2 + c.turn_rate_bound_radps * config.speed_max_mps
    p[t.P_LOOKAHEAD], p[t.P_ALERT_PROBABILITY] = c.lookahead_s, c.alert_probability
    p[t.P_HYPOTHESIS_TEST] = c.start == "hypothesis_test"
    p[t.P_FALSE_ALARM], p[t.P_MISSED] = c.false_alarm_probability, c.missed_probability
    p[t.P_TABLE_TIME] = p[t.P_TABLE_SPEED] = 1.0
    if c.kind == "probability":
        p[t.P_DISTANCES :] = alert_widths(c.alert_probability)
    elif c.table_file is not None:
        table = load_table(c.table_file)
        separation = config.separation_m + config.margin_m
        if not math.isclose(table.model.separation_m, separation, rel_tol=1e-9):
            raise InputError(
                f"{c.table_file}: made for a separation of {table.model.separation_m:g} m, "
                f"not for separation_m plus margin_m, {separation:g} m"
            )
        p[t.P_TABLE_TIME], p[t.P_TABLE_SPEED] = table.model.time_max_s, table.model.speed_max_mps
        times, _, speeds = table.model.axes()
        distances = table.alert_distances(c.alert_probability) / separation
        # On the kernels' own grid.
        by_speed = np.array([np.interp(np.linspace(0.0, speeds[-1], t.TABLE_SPEEDS), speeds, row) for row in distances])
        at = np.linspace(0.0, times[-1], t.TABLE_TIMES)
        p[t.P_DISTANCES :] = np.array([np.interp(at, times, column) for column in by_speed.T]).T.ravel()


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
        self._cooperates = config.other_cooperates
        self._reason, self._command, self._closest = np.zeros(1, np.int64), np.zeros(1), np.zeros((1, 2))

    def decide(
        self, own: ArrayLike, other: ArrayLike, z_wanted: float, other_cooperates: bool | None = None
    ) -> Decision:
        """Return the decision for two states, and remember it.

        Parameters
        ----------
        own, other : array_like, shape (6,)
            Position and velocity, local NED, m and m/s; `other` already moved on by its delay.
        z_wanted : float
            Position down that guidance wants, m.
        other_cooperates : bool, optional
            Belief now; the configuration's where absent.

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
        self._p[k.P_COOPERATES] = self._cooperates if other_cooperates is None else other_cooperates
        k.decide_pairs(states[0], states[1], wanted, self._first, self._p, self._reason, self._command, self._closest)
        reason = int(self._reason[0])
        return Decision(reason != k.NO_REASON, float(self._command[0]), REASONS[reason], *map(float, self._closest[0]))
