"""ADS-B reports of simulated traffic, with the errors, losses and timing of the ADS-B paper's model."""

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wideberth.sensors.adsb import kernels
from wideberth.sensors.adsb.accuracy import (
    NORMAL_95_ONE_SIDED,
    SDA_PROBABILITY,
    SIL_PROBABILITY,
    measurement_covariance,
    nic_bound,
    position_sigma,
    velocity_sigma,
)
from wideberth.sensors.adsb.broadcast_noise import ROW_UNIFORMS, BroadcastNoise, CounterNoise, StreamNoise
from wideberth.sensors.adsb.config import AdsbErrorConfig
from wideberth.types import FloatArray, Scan, SensorHealth, SourceInfo
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT, NAUTICAL_MILE

_RATE_WINDOW = 10.0
"""Seconds over which the rate of messages is counted."""


def error_parameters(config: AdsbErrorConfig) -> FloatArray:
    """Return the parameters of the kernels, SI, from the settings and the categories in them.

    Parameters
    ----------
    config : AdsbErrorConfig

    Returns
    -------
    ndarray, shape (kernels.PARAMETER_COUNT,)
    """
    sil = SIL_PROBABILITY[config.sil]
    per_hour = config.interval_s / 3600.0
    values = {
        kernels.POSITION_SIGMA: position_sigma(config.nacp),
        kernels.CORRELATION_TIME: config.correlation_time_s,
        kernels.VELOCITY_SIGMA: velocity_sigma(config.nacv),
        kernels.ALTITUDE_SIGMA: config.altitude_sigma_ft * FOOT,
        kernels.ALTITUDE_IS_BIAS: float(config.altitude_error == "bias"),
        kernels.CLIMB_SIGMA: config.climb_rate_sigma_ft_per_min * FOOT_PER_MINUTE,
        kernels.CLIMB_REGIME: config.climb_rate_regime_ft_per_min * FOOT_PER_MINUTE,
        kernels.CLIMB_FRACTION: config.climb_rate_fraction_95 / NORMAL_95_ONE_SIDED,
        kernels.POSITION_STEP: config.position_resolution_m,
        kernels.ALTITUDE_STEP: config.altitude_resolution_ft * FOOT,
        kernels.VELOCITY_STEP: config.velocity_resolution_kt * KNOT,
        kernels.CLIMB_STEP: config.climb_rate_resolution_ft_per_min * FOOT_PER_MINUTE,
        kernels.LATENCY: config.latency_s,
        kernels.UNCOMPENSATED: config.uncompensated_latency_s,
        kernels.LOSS: config.loss,
        kernels.RANGE: config.range_nmi * NAUTICAL_MILE,
        kernels.SIL_PROBABILITY: config.gross_error_scale * (sil if config.sil_per == "sample" else sil * per_hour),
        kernels.SDA_PROBABILITY: config.gross_error_scale * SDA_PROBABILITY[config.sda] * per_hour,
        kernels.FAULT_DURATION: config.gross_error_duration_s,
        kernels.NIC_BOUND: nic_bound(config.nic),
        kernels.GROSS_MAXIMUM: config.gross_error_max_nic_bounds,
        kernels.SWAP_PROBABILITY: config.velocity_swap_probability,
    }
    return np.array([values[i] for i in range(kernels.PARAMETER_COUNT)])


class SimulatedAdsb:
    """An ADS-B receiver among simulated aircraft.

    Each aircraft broadcasts at its own phase within the interval. Its noise comes from its own stream and advances by
    one row a broadcast, received or not: neither the other aircraft nor the length of the steps changes it. With the
    table `encounter` the noise is that of an encounter of a Monte Carlo set.

    Parameters
    ----------
    config : AdsbErrorConfig
    seed : int
    addresses : sequence of str
        Of the n aircraft, six hexadecimal digits.
    callsigns : sequence of (str or None), optional
        What each aircraft calls itself.

    Raises
    ------
    ValueError
        If there are not as many callsigns as addresses.

    Attributes
    ----------
    counters : dict of str to int
        Broadcasts by what became of them.
    """

    Config = AdsbErrorConfig
    name = "adsb"

    def __init__(
        self,
        config: AdsbErrorConfig,
        seed: int,
        addresses: Sequence[str],
        callsigns: Sequence[str | None] | None = None,
    ) -> None:
        self._config = config
        self._addresses = tuple(addresses)
        names = (None,) * len(self._addresses) if callsigns is None else tuple(callsigns)
        if len(names) != len(self._addresses):
            raise ValueError(f"{len(names)} callsigns for {len(self._addresses)} addresses: give one for each")
        self._params = error_parameters(config)
        n = len(self._addresses)
        key = config.encounter
        self._noise: BroadcastNoise = (
            StreamNoise(seed, self._addresses) if key is None else CounterNoise(seed, key.intruders, key.number)
        )
        self._phase = np.empty(n)
        self._error = np.zeros((n, 2))
        self._altitude_bias = np.empty(n)
        for i in range(n):
            phase, start = self._noise.start(i)
            self._phase[i] = phase * config.interval_s
            if config.start == "stationary":
                self._error[i] = self._params[kernels.POSITION_SIGMA] * start[:2]
            self._altitude_bias[i] = self._params[kernels.ALTITUDE_SIGMA] * start[2]
        self._error_time = np.full(n, math.nan)
        self._fault = np.zeros((n, 3))
        self._fault[:, 0] = -math.inf
        self._normals, self._uniforms = np.empty((n, kernels.NORMALS)), np.empty((n, ROW_UNIFORMS))
        self._sent = np.zeros(n, np.int64)
        self._base = np.zeros(n)
        self._next = np.empty(n)
        self._t = math.nan
        self._positions = np.full((n, 3), math.nan)
        self._velocities = np.zeros((n, 3))
        quality = SourceInfo(nacp=config.nacp, nacv=config.nacv, nic=config.nic, sil=config.sil, sda=config.sda)
        self._infos = tuple(replace(quality, callsign=name) for name in names)
        self._counters: Counter[str] = Counter()
        self._received: deque[float] = deque()

    @property
    def counters(self) -> dict[str, int]:
        """Counts of broadcasts by what became of them."""
        return dict(self._counters)

    def health(self, t: float) -> SensorHealth:
        """Return age (s) and rate (1/s) of the messages received, and what was not received, at time `t`."""
        age = t - self._received[-1] if self._received else math.inf
        recent = sum(1 for time in self._received if t - _RATE_WINDOW < time <= t)
        rejects = {key: n for key, n in self._counters.items() if key in ("lost", "out of range")}
        return SensorHealth(age=age, rate=recent / _RATE_WINDOW, rejects=rejects)

    def sense(self, t: float, positions: ArrayLike, velocities: ArrayLike, own_position: ArrayLike) -> Scan:
        """Return the reports received since the last call.

        Parameters
        ----------
        t : float
            Time, s; the first call takes the last interval before it as listened to.
        positions, velocities : array_like, shape (n, 3)
            True states at `t`, local NED, m and m/s, in the order of the addresses; NaN for aircraft not there.
        own_position : array_like, shape (3,)
            Of the receiver, local NED, m.

        Returns
        -------
        Scan
            Of kind ``"adsb"``, in the order of time.

        Raises
        ------
        ValueError
            If the time goes back or the shapes do not fit the addresses.
        """
        p1, v1, own = (np.ascontiguousarray(a, np.float64) for a in (positions, velocities, own_position))
        n = len(self._addresses)
        if p1.shape != (n, 3) or v1.shape != (n, 3) or own.shape != (3,):
            raise ValueError(f"give positions and velocities of shape ({n}, 3) and an own position of shape (3,)")
        if not (math.isfinite(t) and not t < self._t):
            raise ValueError(f"time {t} is not finite or before the last one, {self._t}")
        if math.isnan(self._t):
            self._begin(t)
        rows = []
        while len(due := np.flatnonzero(self._next <= t)):
            rows.append(self._messages(due, t, p1, v1, own))
        self._t, self._positions, self._velocities = t, p1.copy(), v1.copy()
        times = np.concatenate([row[0] for row in rows]) if rows else np.empty(0)
        order = np.argsort(times, kind="stable")
        times = times[order]
        z = np.concatenate([row[1] for row in rows])[order] if rows else np.empty((0, 6))
        index = np.concatenate([row[2] for row in rows])[order] if rows else np.empty(0, np.int64)
        self._received.extend(times.tolist())
        while self._received and self._received[0] < t - _RATE_WINDOW and len(self._received) > 1:
            self._received.popleft()
        infos = tuple(self._infos[i] for i in index)
        return Scan(
            t=t,
            t_received=t,
            sensor=self.name,
            kind="adsb",
            z=z,
            R=measurement_covariance(infos, self._config.noise, z[:, 5]),
            t_valid=times,
            source_ids=tuple(self._addresses[i] for i in index),
            sources=infos,
            sensor_position=own.copy(),
            health=self.health(t),
        )

    def _begin(self, t: float) -> None:
        interval = self._config.interval_s
        self._t = t - interval
        first = np.ceil((self._t - self._phase) / interval)
        self._base = self._phase + first * interval
        self._error_time[:] = self._base - self._config.interval_jitter_s
        for i in range(len(self._addresses)):
            self._schedule(i)

    def _schedule(self, i: int) -> None:
        """Draw the noise of an aircraft's next broadcast, and with it its time."""
        self._normals[i], self._uniforms[i] = self._noise.row(i, int(self._sent[i]))
        uniform = self._uniforms[i, kernels.UNIFORMS]
        jitter = (2.0 * uniform - 1.0) * self._config.interval_jitter_s
        self._next[i] = self._base[i] + self._sent[i] * self._config.interval_s + jitter

    def _messages(
        self, index: NDArray[np.int64], t: float, p1: FloatArray, v1: FloatArray, own: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
        """Make one broadcast of each aircraft in `index`; return times, reports and aircraft of those received."""
        k = len(index)
        times = self._next[index]
        z, flags = np.empty((k, 6)), np.empty(k, np.int64)
        kernels.broadcast_reports(
            index,
            times,
            self._t,
            t,
            self._positions,
            self._velocities,
            p1,
            v1,
            own,
            self._error,
            self._error_time,
            self._altitude_bias,
            self._fault,
            self._normals[index],
            self._uniforms[index],
            self._params,
            z,
            flags,
        )
        self._sent[index] += 1
        for i in index:
            self._schedule(i)
        there = np.isfinite(z).all(axis=1)
        received = there & (flags & kernels.RECEIVED > 0)
        for key, flag in (
            ("received", kernels.RECEIVED),
            ("lost", kernels.LOST),
            ("out of range", kernels.OUT_OF_RANGE),
            ("gross errors", kernels.GROSS),
            ("velocities swapped", kernels.SWAPPED),
        ):
            self._counters[key] += int(np.count_nonzero(there & (flags & flag > 0)))
        self._counters["broadcasts"] += int(np.count_nonzero(there))
        return times[received], z[received], index[received]
