"""An autopilot's telemetry as the ownship's state: WGS84 and AMSL in, the local frame out."""

import math
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wideberth.frames import LocalFrame, rotation_ned_body
from wideberth.links.mavlink.boot_clock import BootClock
from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.types import FloatArray, Ownship

_ATTITUDE_AGE_S = 1.0
_QUALITY_AGE_S = 5.0
_NO_FIX = 3  # GPS fix types below this are no position in space
_GEOID_MAX = 1e5  # m; higher is no altitude
_POSITION_FLAGS = mavlink.ESTIMATOR_POS_HORIZ_ABS | mavlink.ESTIMATOR_POS_VERT_ABS


class Home(NamedTuple):
    """Home: WGS84, rad, and its altitude above mean sea level, m."""

    latitude: float
    longitude: float
    altitude: float


class Telemetry:
    """Turns telemetry messages into the ownship's state.

    Altitudes stay apart: the local frame's *down* is minus the altitude above mean sea level (AMSL); heights above home
    and above the ground are only used for `ground` and `height_above_ground`.

    Parameters
    ----------
    config : MavlinkConfig
    frame : LocalFrame, optional
        By default made about home, or about the first global position if that comes first.

    Attributes
    ----------
    frame : LocalFrame or None
    home : Home or None
    clock : BootClock
    counts : Counter
        What was left out, in words.
    """

    def __init__(self, config: MavlinkConfig, frame: LocalFrame | None) -> None:
        self._config = config
        self.frame = frame
        self.home: Home | None = None
        self.clock = BootClock()
        self.counts: Counter[str] = Counter()
        self.t_received = -math.inf
        self._receipts: deque[float] = deque(maxlen=64)
        self._state: tuple[float, FloatArray, FloatArray] | None = None
        self._attitude: tuple[float, FloatArray] | None = None
        self._accuracy: dict[str, tuple[float, float]] = {}
        self._fix: tuple[float, int] | None = None
        self._estimator: tuple[float, bool] | None = None
        self._relative_altitude = math.nan
        self._terrain: tuple[float, float] | None = None
        self._origin: Home | None = None
        self._airspeed = math.nan
        self._utc_error = math.nan
        self._takers: dict[str, Callable[[Any, float], None]] = {
            "GLOBAL_POSITION_INT": self._global_position,
            "GLOBAL_POSITION_INT_COV": self._covariance_of_global,
            "LOCAL_POSITION_NED": self._local_position,
            "LOCAL_POSITION_NED_COV": self._covariance_of_local,
            "ATTITUDE": self._euler,
            "ATTITUDE_QUATERNION": self._quaternion,
            "ESTIMATOR_STATUS": self._estimator_status,
            "EKF_STATUS_REPORT": self._ekf_status,
            "GPS_RAW_INT": self._gps,
            "HOME_POSITION": self._home_position,
            "GPS_GLOBAL_ORIGIN": self._global_origin,
            "TERRAIN_REPORT": self._terrain_report,
            "ALTITUDE": self._altitudes,
            "VFR_HUD": self._hud,
            "SYSTEM_TIME": self._system_time,
        }

    def take(self, message: Any, t: float) -> None:
        """Take a message that came at time `t`, s; others than telemetry are ignored."""
        taker = self._takers.get(message.get_type())
        if taker is not None:
            taker(message, t)

    def restart(self) -> None:
        """Forget what an autopilot that has rebooted said."""
        self._state = self._attitude = self._fix = self._estimator = self._terrain = None
        self._accuracy.clear()

    def ownship(self, t: float) -> Ownship | None:
        """Return the latest state; None before the first. Its `t` is when it was true."""
        if self._state is None:
            return None
        when, position, velocity = self._state
        attitude = np.eye(3)
        if self._attitude is not None and abs(self._attitude[0] - when) <= _ATTITUDE_AGE_S:
            attitude = self._attitude[1]
        elif float(np.hypot(velocity[0], velocity[1])) > 1.0:
            attitude = rotation_ned_body(0.0, 0.0, math.atan2(velocity[1], velocity[0]))
        return Ownship(when, position, velocity, attitude, self._covariance(t), self.state(t))

    def state(self, t: float) -> str:
        """Return "ok", or in words why the position is not to be relied on."""
        if self._fix is not None and t - self._fix[0] <= _QUALITY_AGE_S and self._fix[1] < _NO_FIX:
            return "autopilot has no GPS fix"
        if self._estimator is not None and t - self._estimator[0] <= _QUALITY_AGE_S and not self._estimator[1]:
            return "autopilot's estimator has no absolute position"
        return "ok"

    @property
    def airspeed(self) -> float:
        """The last airspeed told, m/s; NaN before."""
        return self._airspeed

    @property
    def utc_error(self) -> float:
        """By how much our time is ahead of the autopilot's UTC, s; NaN where it has told none."""
        return self._utc_error

    def home_by_height(self) -> Home | None:
        """Return a home below the present position, by the height above it that telemetry tells; for want of a better.

        None where that is not known either.
        """
        if self._state is None or self.frame is None or not math.isfinite(self._relative_altitude):
            return None
        latitude, longitude, altitude = self.frame.to_geodetic(self._state[1])
        return Home(float(latitude), float(longitude), float(altitude) - self._relative_altitude)

    def rate(self, t: float) -> float:
        """Return positions a second over the last 3 s."""
        return sum(1 for when in self._receipts if 0.0 <= t - when <= 3.0) / 3.0

    @property
    def ground(self) -> float:
        """Altitude of the ground, AMSL, m: the higher of home and the terrain told last; NaN where neither is known."""
        known = [self._terrain[1]] if self._terrain is not None else []
        if self.home is not None:
            known.append(self.home.altitude)
        elif self._state is not None and math.isfinite(self._relative_altitude):
            known.append(-float(self._state[1][2]) - self._relative_altitude)
        return max(known, default=math.nan)

    @property
    def height_above_ground(self) -> float:
        """Height above `ground`, m; NaN where it is not known."""
        return math.nan if self._state is None else -float(self._state[1][2]) - self.ground

    def _place(self, latitude: float, longitude: float, altitude: float) -> FloatArray | None:
        """Return a place (deg, deg, m) in the local frame, which the first place makes; None for no place."""
        valid = abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and abs(altitude) < _GEOID_MAX
        if not valid or (latitude == 0.0 and longitude == 0.0):
            self.counts["position is none"] += 1
            return None
        lat, lon = math.radians(latitude), math.radians(longitude)
        if self.frame is None:
            home = self.home
            self.frame = LocalFrame(lat, lon) if home is None else LocalFrame(home.latitude, home.longitude)
        return self.frame.to_ned(lat, lon, altitude)

    def _global_position(self, message: Any, t: float) -> None:
        boot = message.time_boot_ms * 1e-3
        if self.clock.is_late(boot):
            self.counts["position out of order"] += 1
            return
        latitude, longitude = message.lat * 1e-7, message.lon * 1e-7
        position = self._place(latitude, longitude, message.alt * 1e-3)
        if position is None or self.frame is None:
            return
        velocity = self.frame.velocity_to_ned(
            math.radians(latitude),
            math.radians(longitude),
            np.array([message.vx, message.vy, message.vz]) * 1e-2,
        )
        self._state = (self.clock.time_of(boot, t), position, velocity)
        self._relative_altitude = message.relative_alt * 1e-3
        self.t_received = t
        self._receipts.append(t)

    def _local_position(self, message: Any, t: float) -> None:
        # Only where no global position comes: its origin must be known.
        if self._origin is None or t - self.t_received < 1.0:
            return
        boot = message.time_boot_ms * 1e-3
        local = np.array([message.x, message.y, message.z, message.vx, message.vy, message.vz])
        if self.clock.is_late(boot) or not np.all(np.isfinite(local)) or np.abs(local).max() > 1e6:
            self.counts["position out of order"] += 1
            return
        origin = self._origin
        if self.frame is None:
            self.frame = LocalFrame(origin.latitude, origin.longitude)
        start = self.frame.to_ned(origin.latitude, origin.longitude, origin.altitude)
        self._state = (self.clock.time_of(boot, t), start + local[:3], local[3:].copy())
        self._relative_altitude = -float(local[2])

    def _euler(self, message: Any, t: float) -> None:
        angles = (message.roll, message.pitch, message.yaw)
        if all(map(math.isfinite, angles)):
            self._turn(message, rotation_ned_body(*angles), t)

    def _quaternion(self, message: Any, t: float) -> None:
        q = np.array([message.q1, message.q2, message.q3, message.q4])
        norm = float(np.sqrt(q @ q)) if np.all(np.isfinite(q)) else 0.0
        if not 0.5 < norm < 2.0:
            self.counts["attitude is none"] += 1
            return
        self._turn(message, rotation_of(q / norm), t)

    def _turn(self, message: Any, rotation: FloatArray, t: float) -> None:
        when = self.clock.time_of(message.time_boot_ms * 1e-3, t)
        if self._attitude is None or not -3.0 < when - self._attitude[0] < 0.0:
            self._attitude = (when, rotation)

    def _estimator_status(self, message: Any, t: float) -> None:
        self._judge("estimator", message.pos_horiz_accuracy, message.pos_vert_accuracy, math.nan, t)
        has_position = message.flags & _POSITION_FLAGS == _POSITION_FLAGS
        self._estimator = (t, has_position and not message.flags & mavlink.ESTIMATOR_CONST_POS_MODE)

    def _ekf_status(self, message: Any, t: float) -> None:
        has_position = message.flags & _POSITION_FLAGS == _POSITION_FLAGS
        self._estimator = (t, has_position and not message.flags & mavlink.ESTIMATOR_CONST_POS_MODE)

    def _gps(self, message: Any, t: float) -> None:
        self._fix = (t, message.fix_type)
        self._judge("gps", message.h_acc * 1e-3, message.v_acc * 1e-3, message.vel_acc * 1e-3, t)

    def _covariance_of_global(self, message: Any, t: float) -> None:
        self._judge_matrix(message.covariance, 6, t)

    def _covariance_of_local(self, message: Any, t: float) -> None:
        self._judge_matrix(message.covariance, 9, t)

    def _judge_matrix(self, covariance: Any, states: int, t: float) -> None:
        # GLOBAL_POSITION_INT_COV has all 36 elements, LOCAL_POSITION_NED_COV the upper triangle of 9 by 9.
        if states == 6:
            diagonal = [covariance[7 * k] for k in range(6)]
        else:
            at, diagonal = 0, []
            for k in range(6):
                diagonal.append(covariance[at])
                at += states - k
        if not all(0.0 < value < 1e8 for value in diagonal):
            self.counts["covariance is none"] += 1
            return
        horizontal = math.sqrt(max(diagonal[0], diagonal[1]))
        self._judge("covariance", horizontal, math.sqrt(diagonal[2]), math.sqrt(max(diagonal[3:])), t)

    def _judge(self, source: str, horizontal: float, vertical: float, velocity: float, t: float) -> None:
        for name, value in (("horizontal", horizontal), ("vertical", vertical), ("velocity", velocity)):
            if math.isfinite(value) and 0.0 < value < 1e4:
                self._accuracy[f"{source} {name}"] = (t, value)

    def _sigma(self, name: str, t: float, default: float) -> float:
        # The covariance itself, else the estimator's word, else the receiver's.
        for source in ("covariance", "estimator", "gps"):
            told = self._accuracy.get(f"{source} {name}")
            if told is not None and t - told[0] <= _QUALITY_AGE_S:
                return told[1]
        return default

    def _covariance(self, t: float) -> FloatArray:
        config = self._config
        horizontal = self._sigma("horizontal", t, config.position_sigma_m)
        vertical = self._sigma("vertical", t, config.height_sigma_m)
        velocity = self._sigma("velocity", t, config.velocity_sigma_mps)
        return np.diag(np.array([horizontal, horizontal, vertical, velocity, velocity, velocity]) ** 2)

    def _home_position(self, message: Any, t: float) -> None:
        latitude, longitude, altitude = message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3
        if self._place(latitude, longitude, altitude) is not None:
            self.home = Home(math.radians(latitude), math.radians(longitude), altitude)

    def _global_origin(self, message: Any, t: float) -> None:
        latitude, longitude, altitude = message.latitude * 1e-7, message.longitude * 1e-7, message.altitude * 1e-3
        if self._place(latitude, longitude, altitude) is not None:
            self._origin = Home(math.radians(latitude), math.radians(longitude), altitude)

    def _terrain_report(self, message: Any, t: float) -> None:
        if message.loaded > 0 and math.isfinite(message.terrain_height) and abs(message.terrain_height) < _GEOID_MAX:
            self._terrain = (t, float(message.terrain_height))

    def _altitudes(self, message: Any, t: float) -> None:
        terrain = message.altitude_terrain
        if math.isfinite(terrain) and -1000.0 < terrain < _GEOID_MAX:
            self._terrain = (t, float(terrain))

    def _hud(self, message: Any, t: float) -> None:
        if math.isfinite(message.airspeed):
            self._airspeed = float(message.airspeed)

    def _system_time(self, message: Any, t: float) -> None:
        if message.time_unix_usec > 1_000_000_000_000_000:
            true = self.clock.time_of(message.time_boot_ms * 1e-3, t)
            self._utc_error = true - message.time_unix_usec * 1e-6


def rotation_of(q: FloatArray) -> FloatArray:
    """Return the rotation C_ned_body (3, 3) of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
