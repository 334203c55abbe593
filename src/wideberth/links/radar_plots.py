"""From decoded plots of a radar on the wire to a scan: checks, noise, pose, and how the radar does."""

import math
from collections import Counter, deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wideberth.frames import LocalFrame, rotation_ned_body
from wideberth.links.config import RadarClockConfig, RadarUnitConfig
from wideberth.links.message_time import time_of_validity
from wideberth.types import DetectionModel, FloatArray, Ownship, Scan, SensorHealth

OwnshipAt = Callable[[float], Ownship | None]

RATE_WINDOW = 10.0
"""Seconds over which the rate of scans is counted."""

_LEAST_SIGMA = np.array([1e-3, 1e-5, 1e-5, 1e-3])
"""m, rad, rad, m/s: smaller standard deviations are raised to these."""

_ROUNDING = 1e-6
"""By how much, rad, a 32-bit angle may exceed its end."""

_ANGLE_BEYOND = 0.35
"""Up to so much past a quarter turn, rad, an elevation is one beyond the zenith that errors took there."""


class RadarUnit:
    """One radar on the wire.

    Parameters
    ----------
    config : RadarUnitConfig
    clock : RadarClockConfig
    frame : LocalFrame, optional
        Needed by a radar that is given by latitude and longitude; it may be set later.
    ownship : callable, optional
        Gives the ownship's state at a time (None where unknown), for a radar that is mounted on it.

    Attributes
    ----------
    name : str
    frame : LocalFrame or None
    counters : Counter
        Scans, plots and what was noted of them.
    rejects : Counter
        Packets and plots that were left out, by cause.
    """

    def __init__(
        self,
        config: RadarUnitConfig,
        clock: RadarClockConfig,
        frame: LocalFrame | None = None,
        ownship: OwnshipAt | None = None,
    ) -> None:
        self.name = config.name
        self.frame = frame
        self.counters: Counter[str] = Counter()
        self.rejects: Counter[str] = Counter()
        self._config, self._clock, self._ownship = config, clock, ownship
        self._sigma = np.array(
            [
                config.range_sigma_m,
                math.radians(config.azimuth_sigma_deg),
                math.radians(config.elevation_sigma_deg),
                config.range_rate_sigma_mps,
            ]
        )
        angles = (config.boresight_roll_deg, config.boresight_elevation_deg, config.boresight_azimuth_deg)
        self._mounting = rotation_ned_body(*(math.radians(angle) for angle in angles))
        self._field = (0.5 * math.radians(config.azimuth_fov_deg), 0.5 * math.radians(config.elevation_fov_deg))
        self._detection = None
        if config.detection_ranges_m:
            self._detection = DetectionModel(
                np.array(config.detection_ranges_m), np.array(config.detection_probabilities)
            )
        self._t_last = -math.inf
        self._t_receipt = -math.inf
        self._refused_since = ""
        self._given: deque[float] = deque()

    def time(self, t_message: float, t: float) -> float | None:
        """Return the time of validity of a message, s; None, counted, where its time cannot be believed.

        Parameters
        ----------
        t_message : float
            What it says, s; NaN where it says nothing.
        t : float
            Of receipt, s.
        """
        found = time_of_validity(t_message, t, self._clock)
        if isinstance(found, str):
            self.refuse(found)
            return None
        return found

    def in_order(self, t_valid: float) -> bool:
        """Return whether a time is later than that of the last scan; one that is not is counted."""
        if t_valid > self._t_last:
            return True
        self.refuse("time not after the last scan's")
        return False

    def scan(
        self,
        t_valid: float,
        t: float,
        z: FloatArray,
        sigma: FloatArray,
        snr: FloatArray | None = None,
        *,
        cone: bool = False,
        t_plots: FloatArray | None = None,
    ) -> Scan | None:
        """Return the scan of some plots; None, counted, where the radar's place is not known.

        Parameters
        ----------
        t_valid, t : float
            Times of validity, which must rise, and of receipt, s.
        z, sigma : ndarray, shape (k, 4)
            As in `Scan`, and standard deviations, NaN where the plot states none.
        snr : ndarray, shape (k,), optional
            dB; NaN where unknown.
        cone : bool
            Whether the angles are a line array's.
        t_plots : ndarray, shape (k,), optional
            Time of each plot, s; by default `t_valid`.
        """
        if not self.in_order(t_valid):
            return None
        pose = self._pose(t_valid)
        if pose is None:
            return None
        z, sigma = z.astype(np.float64), sigma.astype(np.float64)
        keep = self._sound(z, sigma, cone=cone)
        if len(keep) > self._config.max_plots:
            self.rejects["plots beyond the most in a scan"] += len(keep) - self._config.max_plots
            strength = np.full(len(z), np.nan) if snr is None else np.asarray(snr, float)
            order = np.lexsort((z[keep, 0], -np.nan_to_num(strength[keep], nan=-math.inf)))
            keep = np.sort(keep[order[: self._config.max_plots]])
        times = np.full(len(z), t_valid) if t_plots is None else t_plots
        z, sigma, times = z[keep], sigma[keep], times[keep]
        sigma = np.maximum(np.where(np.isnan(sigma), self._sigma, sigma), _LEAST_SIGMA)
        r = np.zeros((len(z), 4, 4))
        r[:, range(4), range(4)] = np.where(np.isnan(z), np.nan, sigma**2)
        outside = np.abs(z[:, 1]) > self._field[0] + 3.0 * sigma[:, 1]
        outside |= np.abs(z[:, 2]) > self._field[1] + 3.0 * sigma[:, 2]
        if outside.any():
            self.counters["plots outside the field of view (kept)"] += int(np.count_nonzero(outside))
        self._t_last, self._t_receipt, self._refused_since = t_valid, t, ""
        self._given.append(t)
        self.counters["scans"] += 1
        self.counters["plots"] += len(z)
        return Scan(
            t=t_valid,
            t_received=t,
            sensor=self.name,
            kind="radar_cone" if cone else "radar",
            z=z,
            R=r,
            t_valid=times,
            sensor_position=pose[0],
            sensor_attitude=pose[1],
            field_of_view=self._field,
            detection=self._detection,
            health=self.health(t),
        )

    def health(self, t: float) -> SensorHealth:
        """Return age of the last scan, scans a second, rejects and state at time `t`, s.

        States: "ok", "nothing heard yet", "silent for 3 s", "all refused: cause".
        """
        while self._given and self._given[0] < t - RATE_WINDOW:
            self._given.popleft()
        age = max(t - self._t_last, 0.0)
        silent = t - self._t_receipt > self._config.silent_intervals * self._config.update_interval_s
        if self._refused_since and silent:
            state = f"all refused: {self._refused_since}"
        elif math.isinf(age):
            state = "nothing heard yet"
        else:
            state = f"silent for {t - self._t_receipt:.0f} s" if silent else "ok"
        return SensorHealth(age, len(self._given) / RATE_WINDOW, dict(self.rejects), state)

    def refuse(self, cause: str) -> None:
        """Count a packet that is left out."""
        self.rejects[cause] += 1
        self._refused_since = cause

    def _sound(self, z: FloatArray, sigma: FloatArray, *, cone: bool) -> NDArray[np.int64]:
        """Return which plots can be used, and bring their angles into their ranges, in place."""
        with np.errstate(invalid="ignore"):
            over = (np.abs(z[:, 2]) > 0.5 * math.pi) & (np.abs(z[:, 2]) <= 0.5 * math.pi + _ANGLE_BEYOND)
            z[over, 1] += math.pi
            z[over, 2] = np.copysign(math.pi, z[over, 2]) - z[over, 2]
            if cone:
                at_end = np.abs(z[:, 1]) <= 0.5 * math.pi + _ROUNDING
                z[at_end, 1] = np.clip(z[at_end, 1], -0.5 * math.pi, 0.5 * math.pi)
            else:
                whole = (np.abs(z[:, 1]) <= 2.0 * math.pi + _ROUNDING) | over
                z[whole, 1] = np.mod(z[whole, 1] + math.pi, 2.0 * math.pi) - math.pi
            causes = (
                ("plot without range or angle", ~np.isfinite(z[:, :2]).all(axis=1)),
                ("plot not finite", np.isinf(z).any(axis=1) | np.isinf(sigma).any(axis=1)),
                ("range not positive", z[:, 0] <= 0.0),
                ("plot beyond range_max_m", z[:, 0] > self._config.range_max_m),
                ("angle impossible", np.abs(z[:, 1]) > (0.5 * math.pi if cone else math.pi)),
                ("angle impossible", np.abs(z[:, 2]) > 0.5 * math.pi),
                ("range rate impossible", np.abs(z[:, 3]) > 1e4),
                ("standard deviation not positive", (sigma <= 0.0).any(axis=1)),
            )
        good = np.ones(len(z), bool)
        for cause, bad in causes:
            count = int(np.count_nonzero(good & bad))
            if count:
                self.rejects[cause] += count
            good &= ~bad
        return np.flatnonzero(good)

    def _pose(self, t: float) -> tuple[FloatArray, FloatArray] | None:
        """Return the radar's place, NED, m, and C_ned_sensor; None, counted, where it is not known."""
        c = self._config
        if c.mount == "ownship":
            own = self._ownship(t) if self._ownship else None
            if own is None:
                self.refuse("ownship's state not known")
                return None
            return own.position + (t - own.t) * own.velocity, own.attitude @ self._mounting
        if c.latitude_deg is None or c.longitude_deg is None:
            return np.array([c.north_m, c.east_m, -c.altitude_m]), self._mounting
        if self.frame is None:
            self.refuse("local frame not known")
            return None
        place = math.radians(c.latitude_deg), math.radians(c.longitude_deg)
        north = self.frame.velocity_to_ned(*place, np.array([1.0, 0.0, 0.0]))
        # North at the radar is not the local frame's: meridians converge.
        turned = rotation_ned_body(0.0, 0.0, math.atan2(north[1], north[0]))
        return self.frame.to_ned(*place, c.altitude_m), turned @ self._mounting


def unit_of(units: dict[int | None, RadarUnit], radar_id: int) -> RadarUnit | None:
    """Return the radar with a number, or the one that takes any; None if there is no such."""
    return units.get(radar_id, units.get(None))


def joint_health(units: list[RadarUnit], rejects: Counter[str], t: float) -> SensorHealth:
    """Return the health of an input's radars, one or more: of the one that does worst, with the rejects of all."""
    each = [unit.health(t) for unit in units]
    worst = max(each, key=lambda health: (health.state != "ok", health.age))
    total = sum((Counter(health.rejects) for health in each), Counter(rejects))
    return SensorHealth(worst.age, worst.rate, dict(total), worst.state)
