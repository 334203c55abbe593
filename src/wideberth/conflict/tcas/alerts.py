"""Whether an intruder is worth an advisory: range, altitude and miss-distance tests."""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wideberth.conflict.tcas.thresholds import AlertThresholds, TcasThresholds
from wideberth.units import NAUTICAL_MILE

# Inside DMOD an opening range alerts only below this product of range and range rate, m2/s. Ours: the source says no
# more than "not moving away fast enough"; version 7.1 has a like value for each level.
_DIVERGENCE = 0.00278 * NAUTICAL_MILE**2


class TcasAlert(enum.IntEnum):
    """What TCAS says of an intruder."""

    NONE = 0
    TRAFFIC = 1
    RESOLUTION = 2


@dataclass(frozen=True, slots=True)
class Geometry:
    """An intruder as TCAS sees it: slant range, and altitude by its transponder.

    Attributes
    ----------
    slant_range, range_rate : float
        m; m/s, negative closing.
    height, height_rate : float
        Of the own aircraft above the intruder, m and m/s.
    miss : float
        Horizontal distance at the closest point of straight flight, m.
    """

    slant_range: float
    range_rate: float
    height: float
    height_rate: float
    miss: float

    @property
    def time_to_closest(self) -> float:
        """Range over closing rate, s; 0 where the range opens."""
        return -self.slant_range / self.range_rate if self.range_rate < 0.0 else 0.0


def geometry(
    own_position: ArrayLike, own_velocity: ArrayLike, intruder_position: ArrayLike, intruder_velocity: ArrayLike
) -> Geometry:
    """Return the geometry of a pair.

    Parameters
    ----------
    own_position, own_velocity, intruder_position, intruder_velocity : array_like, shape (3,)
        Local NED, m and m/s.

    Raises
    ------
    ValueError
        If a state has another shape or is not finite.
    """
    states = [np.asarray(s, float) for s in (own_position, own_velocity, intruder_position, intruder_velocity)]
    if any(state.shape != (3,) or not np.isfinite(state).all() for state in states):
        raise ValueError("positions and velocities must be three finite numbers each")
    p, v = states[2] - states[0], states[3] - states[1]
    distance = float(np.linalg.norm(p))
    rate = float(p @ v) / distance if distance > 0.0 else -float(np.linalg.norm(v))
    closing = float(p[:2] @ v[:2])
    speed = float(v[:2] @ v[:2])
    t = max(-closing / speed, 0.0) if speed > 0.0 else 0.0
    miss = float(np.hypot(*(p[:2] + v[:2] * t)))
    return Geometry(distance, rate, float(p[2]), float(v[2]), miss)


def range_test(g: Geometry, limits: AlertThresholds) -> bool:
    """Return whether the range comes within DMOD soon: modified tau, inside DMOD unless it opens fast enough."""
    if g.slant_range <= limits.dmod:
        return g.slant_range * g.range_rate <= _DIVERGENCE
    if g.range_rate >= 0.0:
        return False
    return (limits.dmod**2 - g.slant_range**2) / (g.slant_range * g.range_rate) <= limits.tau


def altitude_test(g: Geometry, limits: AlertThresholds) -> bool:
    """Return whether the altitudes come close: now and at the closest point, or equal soon (CAS thesis, 3.4)."""
    t = min(g.time_to_closest, limits.tau)
    at_closest = g.height + g.height_rate * t
    if abs(g.height) < limits.zthr:
        return abs(at_closest) < limits.zthr or at_closest * g.height < 0.0
    if g.height * g.height_rate >= 0.0:
        return False
    soon = -g.height / g.height_rate <= limits.tau
    return soon and (abs(at_closest) < limits.zthr or at_closest * g.height < 0.0)


def tcas_alert(g: Geometry, thresholds: TcasThresholds) -> TcasAlert:
    """Return what the tests say of an intruder at one time, without memory."""
    ra = thresholds.ra
    if ra is not None and g.miss <= thresholds.hmd and range_test(g, ra) and altitude_test(g, ra):
        return TcasAlert.RESOLUTION
    if range_test(g, thresholds.ta) and altitude_test(g, thresholds.ta):
        return TcasAlert.TRAFFIC
    return TcasAlert.NONE
