"""A radar among simulated aircraft: when it looks and from where; what it then sees is `plot_model`'s."""

import math
import zlib
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from wideberth.argument_checks import POSITIVE, checked
from wideberth.frames import rotation_ned_body
from wideberth.sensors.radar.config import RadarConfig, SimulatedRadarConfig
from wideberth.sensors.radar.coverage import scan_detection_probability
from wideberth.sensors.radar.plot_model import PlotModel
from wideberth.types import DetectionModel, FloatArray, Ownship, Scan, SensorHealth

_RATE_WINDOW = 10.0
"""Seconds over which the rate of scans is counted."""

_RANGES = 16
"""Ranges at which the probability of detection is stated."""

_ON_TIME = 1e-6
"""Looks this little later than a step, s, belong to it: times are sums of tenths."""

States = tuple[FloatArray, FloatArray]
"""Positions and velocities, both (k, 3), NED, m and m/s."""


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
        self._keys = [[seed, zlib.crc32(unit.encode())] for unit in self._names]
        height = math.radians(config.boresight_elevation_deg)
        self._mountings = [
            rotation_ned_body(0.0, height, math.radians(azimuth)) for azimuth in config.boresight_azimuths_deg
        ]
        angles = (config.pose_error_roll_deg, config.pose_error_pitch_deg, config.pose_error_heading_deg)
        self._turned = rotation_ned_body(*(math.radians(angle) for angle in angles))
        self._moved = np.array([config.pose_error_north_m, config.pose_error_east_m, -config.pose_error_up_m])
        self._model = PlotModel(config)
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
        positions, velocities = states(when)
        # Between steps the ownship's path is not known; it flies straight for less than a step.
        own_position = ownship.position - (t - when) * ownship.velocity
        if self._on_ground:
            positions = np.vstack([positions, own_position])
            velocities = np.vstack([velocities, ownship.velocity])
        if positions.shape != (len(self._rcs), 3) or velocities.shape != positions.shape:
            raise ValueError(f"states {positions.shape}, {velocities.shape} of {len(self._rcs)} aircraft are wanted")
        self._given.append(when)
        while self._given[0] < when - _RATE_WINDOW + _ON_TIME:
            self._given.popleft()
        rate = len(self._given) / max(self._config.update_interval_s, min(_RATE_WINDOW, when - self._start))
        return [
            self._scan(unit, when, t, positions, velocities, own_position, ownship, rate)
            for unit in range(len(self._names))
        ]

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
        place, carrier, attitude = np.array([c.north_m, c.east_m, -c.altitude_m]), np.zeros(3), self._mountings[unit]
        if not self._on_ground:
            place, carrier, attitude = own_position, ownship.velocity, ownship.attitude @ attitude
        away = positions - (place + self._moved)
        distance = np.sqrt((away**2).sum(axis=1))
        rates = ((velocities - carrier) * away).sum(axis=1) / np.maximum(distance, 1e-9)
        random = np.random.Generator(np.random.Philox(key=self._keys[unit], counter=[0, 0, self._looks, 0]))
        z, variance = self._model.look(
            random, away @ (attitude @ self._turned), rates, self._rcs, self._burst(when - self._start)
        )
        z[:, 0] *= c.range_scale
        r = np.zeros((len(z), 4, 4))
        r[:, range(4), range(4)] = variance
        return Scan(
            t=when,
            t_received=t,
            sensor=self._names[unit],
            kind=c.scan_kind,
            z=z,
            R=r,
            t_valid=np.full(len(z), when),
            sensor_position=place.copy(),
            sensor_attitude=attitude.copy(),
            field_of_view=self._model.field_of_view,
            detection=self._detection,
            health=SensorHealth(age=t - when, rate=rate, rejects={}),
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
    lossy: RadarConfig = config.model_copy(
        update={"losses_db": config.losses_db + config.plot_model.processing_loss_db}
    )
    ranges = np.linspace(config.range_min_m, config.range_limit, _RANGES)
    # Even in solid angle, the middles of a grid; the field of view is symmetric.
    part = (np.arange(8) + 0.5) / 8.0
    azimuth = 0.5 * math.radians(config.azimuth_fov_deg) * part
    elevation = np.arcsin(math.sin(0.5 * math.radians(config.elevation_fov_deg)) * part)
    p = scan_detection_probability(
        ranges[:, None, None],
        config.reference_rcs_m2,
        config.reference_closing_speed_mps,
        lossy,
        azimuth=azimuth[:, None],
        elevation=elevation,
    )
    return DetectionModel(ranges, np.minimum(p.mean(axis=(1, 2)), config.stated_probability_max))
