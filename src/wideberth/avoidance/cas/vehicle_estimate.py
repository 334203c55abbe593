"""What is known of another vehicle from its messages, and where it is predicted to be (CAS thesis, 4.1.2, 6.2.2)."""

import math
from typing import NamedTuple

import numpy as np

from wideberth.avoidance.cas import pair_kernels as pair
from wideberth.avoidance.cas import prediction_kernels as kernels
from wideberth.avoidance.cas.config import PredictionConfig
from wideberth.avoidance.cas.vehicle_message import Health
from wideberth.types import FloatArray

_AT_ONCE = 1e-9  # s


class ReceivedState(NamedTuple):
    """The numbers of a message, checked. All times are by the sender's clock, here and in the estimate.

    Attributes
    ----------
    time : float
        s.
    measured : ndarray, shape (3, 3)
        Rows position, velocity, acceleration, NED; NaN where not received.
    position_sigma : float
        m.
    waypoints : ndarray, shape (n, 4)
        Time, north, east, down; none where not received.
    z_wanted : float
    cooperates : bool
    avoidance_rate : float
        NaN where it does not avoid.
    health : Health
    """

    time: float
    measured: FloatArray
    position_sigma: float
    waypoints: FloatArray
    z_wanted: float
    cooperates: bool
    avoidance_rate: float
    health: Health


class PredictedPass(NamedTuple):
    """How a vehicle is predicted to pass.

    Attributes
    ----------
    t_star, d_star : float
        Time and distance of the closest point, s and m.
    position, velocity : ndarray, shape (3,)
        Of a vehicle in straight flight that passes at that time in that place, NED: what controllers are shown.
    variance : float
        Of the relative position then, on each axis, m2; 0 where no filter knows it.
    strays : bool
        Whether it does not fly to the waypoints that it has sent.
    """

    t_star: float
    d_star: float
    position: FloatArray
    velocity: FloatArray
    variance: float
    strays: bool


class VehicleEstimate:
    """One other vehicle.

    Parameters
    ----------
    config : PredictionConfig
    smoothing : float
        Weight of a new position against the one predicted, where no filter decides it.
    first : ReceivedState
    """

    def __init__(self, config: PredictionConfig, smoothing: float, first: ReceivedState) -> None:
        self._config, self._smoothing = config, smoothing
        self._filters = config.kind in {"kalman", "kalman_acceleration"}
        self._accelerates = config.kind in {"constant_acceleration", "kalman_acceleration"}
        self._noise_factors = {
            Health.NOMINAL: 1.0,
            Health.DEGRADED: config.degraded_noise_factor,
            Health.FAILED: config.failed_noise_factor,
        }
        self._x, self._c = np.zeros((3, kernels.STATES)), np.zeros((3, kernels.STATES, kernels.STATES))
        self._phi, self._q = np.zeros((2, kernels.STATES, kernels.STATES))
        self.last = first
        known = np.isfinite(first.measured)
        self._x[:, :3] = np.where(known, first.measured, 0.0).T
        sigmas = (first.position_sigma, config.unknown_velocity_mps, config.unknown_acceleration_mps2)
        received = (first.position_sigma, config.velocity_sigma_mps, config.acceleration_sigma_mps2)
        for state in range(3 if self._accelerates else 2):
            self._c[:, state, state] = np.where(known[state], received[state], sigmas[state]) ** 2

    def position_at(self, t: float) -> FloatArray:
        """Return the mean position (3,) at a time, NED, without looking at waypoints."""
        return self._at(t)[0][:, 0]

    def velocity(self) -> FloatArray:
        """Return the velocity (3,) at the newest message, NED."""
        return self._x[:, 1].copy()

    def take(self, state: ReceivedState) -> None:
        """Take in the state of a newer message."""
        dt, c = state.time - self.last.time, self._config
        before = self.last.measured
        if self._filters:
            kernels.filter_message(
                self._x, self._c, dt, self._density(self._accelerates), self._accelerates, state.measured,
                np.array([state.position_sigma, c.velocity_sigma_mps, c.acceleration_sigma_mps2]) ** 2,
                self._phi, self._q,
            )  # fmt: skip
        else:
            position, velocity, acceleration = state.measured
            expected = self.position_at(state.time)
            received = np.isfinite(velocity).all()
            known = velocity if received else _limited((position - before[0]) / dt, c.speed_limit_mps)
            if self._accelerates and not np.isfinite(acceleration).all():
                acceleration = _limited((known - self._x[:, 1]) / dt, c.acceleration_limit_mps2)
            self._x[:, 0] = expected + self._smoothing * (position - expected)
            self._x[:, 1] = known
            self._x[:, 2] = acceleration if self._accelerates else 0.0
        self.last = state

    def predict(self, now: float, own: FloatArray, own_path: FloatArray | None = None) -> PredictedPass:
        """Return how it passes an own vehicle.

        Parameters
        ----------
        now : float
            By the sender's clock, as the times of the path, s.
        own : ndarray, shape (6,)
            Position and velocity, NED.
        own_path : ndarray, shape (n, 4), optional
            The own waypoints: time, north, east, down; straight flight where absent.
        """
        c = self._config
        x, _ = self._at(now)
        p, v = own[:3] - x[:, 0], own[3:] - x[:, 1]
        waypoints = self.last.waypoints[self.last.waypoints[:, 0] > now]
        if not c.intent or math.isfinite(self.last.avoidance_rate):
            waypoints = waypoints[:0]
        strays = bool(len(waypoints)) and not self._flies_to(waypoints[0], now, x)
        if strays:
            waypoints = waypoints[:0]
        at = p.copy()
        if len(waypoints) or (c.intent and own_path is not None):
            own_nodes = self._nodes(now, own[:3], own[3:], own_path if own_path is not None else waypoints[:0])
            nodes = self._nodes(now, x[:, 0], x[:, 1], waypoints)
            t, d = kernels.paths_closest_point(own_nodes, nodes, c.lookahead_s, at)
        elif self._accelerates:
            a = -x[:, 2]
            hold = max(c.acceleration_hold_s - (now - self.last.time), 0.0)
            t, d = kernels.accelerated_closest_point(
                p[0], p[1], p[2], v[0], v[1], v[2], a[0], a[1], a[2], hold, c.lookahead_s
            )
            flown = min(t, hold)
            at = p + v * t + a * flown * (t - 0.5 * flown)
        else:
            t, d = pair.closest_point(*p, *v)
            at = p + v * t
        if t > _AT_ONCE:
            # The straight course that is closest at that time in that place: its velocity has no part along the miss.
            v = (at - p) / t
            if d > 0.0:
                v = v - at * (v @ at) / (d * d)
            p = at - v * t
        variance = 0.0
        if self._filters:
            variance = float(self._at(now + t)[1][:, 0, 0].max()) + c.own_position_sigma_m**2
        return PredictedPass(float(t), float(d), own[:3] - p, own[3:] - v, variance, strays)

    def _at(self, t: float) -> tuple[FloatArray, FloatArray]:
        """Return state (3, 4) and covariance (3, 4, 4) at a time."""
        x, c = self._x.copy(), self._c.copy()
        dt = max(t - self.last.time, 0.0)
        hold = min(dt, self._config.acceleration_hold_s) if self._accelerates else dt
        for step, accelerates in ((hold, self._accelerates), (dt - hold, False)):
            if step > 0.0:
                kernels.filter_matrices(step, self._density(accelerates), accelerates, self._phi, self._q)
                kernels.predict_vehicle(x, c, self._phi, self._q)
            if self._accelerates and dt > hold:
                x[:, 2] = 0.0
        return x, c

    def _flies_to(self, waypoint: FloatArray, now: float, x: FloatArray) -> bool:
        """Return whether the velocity is about the one that leads to a waypoint in time."""
        leading = (waypoint[1:] - x[:, 0]) / (waypoint[0] - now)
        return bool(np.linalg.norm(leading - x[:, 1]) <= self._config.intent_tolerance_mps)

    def _density(self, accelerates: bool) -> float:
        """Return the process noise, widened by the vehicle's health."""
        c = self._config
        density = c.jerk_density_m2ps5 if accelerates else c.acceleration_density_m2ps3
        return density * self._noise_factors[self.last.health] ** 2

    def _nodes(self, now: float, position: FloatArray, velocity: FloatArray, waypoints: FloatArray) -> FloatArray:
        """Return times from now and places (n, 4): the waypoints ahead, else straight flight until the look-ahead."""
        later = waypoints[waypoints[:, 0] > now]
        ahead = np.column_stack([later[:, 0] - now, later[:, 1:]])
        if not len(later):
            until = self._config.lookahead_s
            ahead = np.array([[until, *(position + velocity * until)]])
        return np.vstack([[0.0, *position], ahead])


def _limited(vector: FloatArray, largest: float) -> FloatArray:
    """Return a vector, shortened to a length."""
    length = float(np.linalg.norm(vector))
    return vector * (largest / length) if length > largest else vector
