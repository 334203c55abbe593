"""A radar among simulated aircraft: when it looks and from where.

What it then sees is `plot_model`'s or, at the level of samples, `sampled_look`'s.
"""

import math
import zlib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wideberth.argument_checks import POSITIVE, checked
from wideberth.frames import rotation_ned_body
from wideberth.sensors.radar.config import SimulatedRadarConfig
from wideberth.sensors.radar.coverage import plot_probability
from wideberth.sensors.radar.plot_model import PlotModel
from wideberth.sensors.radar.sampled_look import SampledLook
from wideberth.sensors.radar.sweeps.receiver import Samples
from wideberth.types import DetectionModel, FloatArray, Ownship, Scan, SensorHealth

_RATE_WINDOW = 10.0
"""Seconds over which the rate of scans is counted."""

_RANGES = 16
"""Ranges at which the probability of detection is stated."""

_ON_TIME = 1e-6
"""Looks this little later than a step, s, belong to it: times are sums of tenths."""

States = tuple[FloatArray, FloatArray]
"""Positions and velocities, both (k, 3), NED, m and m/s."""


@dataclass(frozen=True, slots=True)
class RawLook:
    """The samples of one look, and what they are of.

    Attributes
    ----------
    samples : ndarray, shape (averages, channels, samples_per_sweep)
        V.
    position, attitude : ndarray, shape (3,) and (3, 3)
        Of the radar as told, NED, m, and C_ned_sensor.
    positions, velocities : ndarray, shape (k, 3)
        Of all aircraft, with a radar on the ground the ownship last, NED, m and m/s; NaN for those not there.
    visible : ndarray of bool, shape (k,)
        Whether they are in view.
    """

    samples: Samples
    position: FloatArray
    attitude: FloatArray
    positions: FloatArray
    velocities: FloatArray
    visible: NDArray[np.bool_]


class SimulatedRadar:
    """A radar of one or more units, on the ground or on the ownship, that looks at its own rate.

    The noise of each look of a unit is its own counter-based stream, keyed by seed, name and number of the look:
    neither other sensors nor the length of the steps change it.

    Parameters
    ----------
    config : SimulatedRadarConfig
    seed : int
    rcs_m2 : sequence of float
        Of the k aircraft.
    ownship_rcs_m2 : float
        Of the ownship, which a radar on the ground sees as well.
    name : str
        Its units are ``name`` or, of several, ``name/1``, ``name/2``, ...

    Raises
    ------
    ValueError
        If a cross-section is not finite and positive.
    """

    Config = SimulatedRadarConfig
    name = "radar"

    def __init__(
        self,
        config: SimulatedRadarConfig,
        seed: int,
        rcs_m2: Sequence[float],
        ownship_rcs_m2: float,
        name: str = "radar",
    ) -> None:
        self._config = config
        self._on_ground = config.mount == "ground"
        rcs = checked("rcs_m2", np.array([*rcs_m2, ownship_rcs_m2]), POSITIVE)
        self._rcs = rcs if self._on_ground else rcs[:-1]
        self._names = config.unit_names(name)
        self._streams = [np.random.Philox(key=[seed, zlib.crc32(unit.encode())]) for unit in self._names]
        self._unused: list[Any] = [stream.state for stream in self._streams]
        self._generators = [np.random.Generator(stream) for stream in self._streams]
        height = math.radians(config.boresight_elevation_deg)
        self._mountings = [
            rotation_ned_body(0.0, height, math.radians(azimuth)) for azimuth in config.boresight_azimuths_deg
        ]
        angles = (config.pose_error_roll_deg, config.pose_error_pitch_deg, config.pose_error_heading_deg)
        self._turned = rotation_ned_body(*(math.radians(angle) for angle in angles))
        self._moved = np.array([config.pose_error_north_m, config.pose_error_east_m, -config.pose_error_up_m])
        self._model = PlotModel(config)
        sampled = config.level == "samples"
        self._sampled = [SampledLook(config, self._model, unit) for unit in self._names] if sampled else []
        self._detection = stated_detection(config)
        self._start = math.nan
        self._looks = 0
        self._given: deque[float] = deque()

    def sense(self, t: float, states: Callable[[float], States], ownship: Ownship) -> list[Scan]:
        """Return the scans of all units since the last call.

        Parameters
        ----------
        t : float
            Time, s; the first call is the first look.
        states : callable
            Gives the true states of the k aircraft, always the same ones in the same order, at a time; NaN for those
            that are not there.
        ownship : Ownship
            The true one at `t`.

        Returns
        -------
        list of Scan
            In the order of time; nothing while the radar is silent.

        Raises
        ------
        ValueError
            If the time is not finite, or the states are not those of k aircraft.
        """
        if not math.isfinite(t):
            raise ValueError(f"time {t} is not finite")
        if math.isnan(self._start):
            self._start = t
        scans: list[Scan] = []
        while (when := self._start + self._looks * self._config.update_interval_s) <= t + _ON_TIME:
            if not self._is_silent(when - self._start):
                scans += self._look(t if abs(when - t) <= _ON_TIME else when, t, states, ownship)
            self._looks += 1
        return scans

    def raw_look(self, t: float, states: Callable[[float], States], ownship: Ownship) -> RawLook:
        """Return the samples of the next look of the first unit, at `t`; its faults but those of its pose stay away.

        Parameters
        ----------
        t, states, ownship
            As in `sense`.

        Raises
        ------
        ValueError
            If the radar is at the level of plots, or as in `sense`.
        """
        if not self._sampled:
            raise ValueError('samples are of a radar with level = "samples"')
        positions, velocities, own_position = self._aircraft(t, t, states, ownship)
        pose = self._pose(0, own_position, ownship)
        away, relative = self._seen(positions, velocities, pose)
        samples = self._sampled[0].samples(self._random(0), away, relative, self._rcs)
        self._looks += 1
        return RawLook(samples, pose[0], pose[2], positions, velocities, self._sampled[0].visible(away))

    def _is_silent(self, age: float) -> bool:
        c = self._config
        until = math.inf if c.silent_until_s is None else c.silent_until_s
        return c.silent_from_s is not None and c.silent_from_s <= age + _ON_TIME and age + _ON_TIME < until

    def _burst(self, age: float) -> int:
        c = self._config
        if c.burst_at_s is None or not c.burst_at_s <= age + _ON_TIME < c.burst_at_s + c.burst_s:
            return 0
        return c.burst_plots

    def _look(self, when: float, t: float, states: Callable[[float], States], ownship: Ownship) -> list[Scan]:
        positions, velocities, own_position = self._aircraft(when, t, states, ownship)
        self._given.append(when)
        while self._given[0] < when - _RATE_WINDOW + _ON_TIME:
            self._given.popleft()
        rate = len(self._given) / max(self._config.update_interval_s, min(_RATE_WINDOW, when - self._start))
        return [
            self._scan(unit, when, t, positions, velocities, own_position, ownship, rate)
            for unit in range(len(self._names))
        ]

    def _aircraft(
        self, when: float, t: float, states: Callable[[float], States], ownship: Ownship
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions and velocities of all that the radar may see, and the ownship's position, at a look."""
        positions, velocities = states(when)
        # Between steps the ownship's path is not known; it flies straight for less than a step.
        own_position = ownship.position - (t - when) * ownship.velocity
        if self._on_ground:
            positions = np.concatenate([positions, own_position[None]])
            velocities = np.concatenate([velocities, ownship.velocity[None]])
        if positions.shape != (len(self._rcs), 3) or velocities.shape != positions.shape:
            raise ValueError(f"states {positions.shape}, {velocities.shape} of {len(self._rcs)} aircraft are wanted")
        return positions, velocities, own_position

    def _pose(self, unit: int, own_position: FloatArray, ownship: Ownship) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the told place of a unit, its velocity and its attitude C_ned_sensor."""
        c = self._config
        if self._on_ground:
            return np.array([c.north_m, c.east_m, -c.altitude_m]), np.zeros(3), self._mountings[unit]
        return own_position, ownship.velocity, ownship.attitude @ self._mountings[unit]

    def _seen(
        self, positions: FloatArray, velocities: FloatArray, pose: tuple[FloatArray, FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities relative to the radar, in its axes as they really are."""
        place, carrier, attitude = pose
        looking = attitude @ self._turned
        return (positions - (place + self._moved)) @ looking, (velocities - carrier) @ looking

    def _random(self, unit: int) -> np.random.Generator:
        # A new stream for each look; to put the counter of a known one is much faster than to make one.
        state = self._unused[unit]
        state["state"]["counter"] = np.array([0, 0, self._looks, 0], np.uint64)
        self._streams[unit].state = state
        return self._generators[unit]

    def _scan(
        self,
        unit: int,
        when: float,
        t: float,
        positions: FloatArray,
        velocities: FloatArray,
        own_position: FloatArray,
        ownship: Ownship,
        rate: float,
    ) -> Scan:
        c = self._config
        pose = self._pose(unit, own_position, ownship)
        away, relative = self._seen(positions, velocities, pose)
        random = self._random(unit)
        burst = self._burst(when - self._start)
        rejects: Mapping[str, int] = {}
        state = "ok"
        if self._sampled:
            sampled = self._sampled[unit]
            z, variance = sampled.look(when, random, away, relative, self._rcs, burst)
            rejects, state = sampled.rejects, sampled.state
        else:
            distance = np.sqrt((away * away).sum(axis=1))
            rates = (relative * away).sum(axis=1) / np.maximum(distance, 1e-9)
            z, variance = self._model.look(random, away, rates, self._rcs, burst)
        z[:, 0] *= c.range_scale
        r = np.zeros((len(z), 16))
        r[:, ::5] = variance
        return Scan(
            t=when,
            t_received=t,
            sensor=self._names[unit],
            kind=c.scan_kind,
            z=z,
            R=r.reshape(-1, 4, 4),
            t_valid=np.full(len(z), when),
            sensor_position=pose[0].copy(),
            sensor_attitude=pose[2].copy(),
            field_of_view=self._model.field_of_view,
            detection=self._detection,
            health=SensorHealth(age=t - when, rate=rate, rejects=rejects, state=state),
        )


def stated_detection(config: SimulatedRadarConfig) -> DetectionModel:
    """Return how probably a radar sees its reference aircraft in one scan, averaged over the field of view.

    Parameters
    ----------
    config : SimulatedRadarConfig

    Returns
    -------
    DetectionModel
    """
    ranges = np.linspace(config.range_min_m, config.range_limit, _RANGES)
    # Even in solid angle, the middles of a grid; the field of view is symmetric.
    part = (np.arange(8) + 0.5) / 8.0
    azimuth = 0.5 * math.radians(config.azimuth_fov_deg) * part
    elevation = np.arcsin(math.sin(0.5 * math.radians(config.elevation_fov_deg)) * part)
    p = plot_probability(
        ranges[:, None, None],
        config.reference_rcs_m2,
        -config.reference_closing_speed_mps,
        config,
        azimuth=azimuth[:, None],
        elevation=elevation,
        loss_db=config.plot_model.processing_loss_db,
    )
    return DetectionModel(ranges, np.minimum(p.mean(axis=(1, 2)), config.stated_probability_max))
