"""The telemetry streams of the simulated autopilot."""

import math
from collections.abc import Callable
from typing import Any

from wideberth.frames import LocalFrame, euler_angles
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.telemetry import Home
from wideberth.types import Ownship

_RATES = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 4.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 4.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 1.0,
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: 2.0,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 0.2,
}  # Hz, until something else is asked for
_ESTIMATOR_GOOD = 0x3F  # attitude, velocities, positions
_ESTIMATOR_BLIND = 0x07 | mavlink.ESTIMATOR_CONST_POS_MODE


class SimulatedTelemetry:
    """Makes telemetry messages of a state, each at its rate.

    Parameters
    ----------
    frame : LocalFrame
    home : Home

    Attributes
    ----------
    has_gps : bool
        Without it there is no fix, and no estimate of the position.
    """

    def __init__(self, frame: LocalFrame, home: Home) -> None:
        self._frame, self._home = frame, home
        self.has_gps = True
        self._intervals = {message: 1.0 / rate for message, rate in _RATES.items()}
        self._due = dict.fromkeys(_RATES, -math.inf)
        self._makers: dict[int, Callable[[Ownship, float], Any]] = {
            mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: self._gps,
            mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: self._estimator,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: lambda own, boot: mavlink.MAVLink_system_time_message(
                round(own.t * 1e6), _milliseconds(boot)
            ),
            mavlink.MAVLINK_MSG_ID_VFR_HUD: self._hud,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: lambda own, boot: self._home_position(),
        }

    def set_interval(self, message: int, interval_us: float) -> bool:
        """Take a SET_MESSAGE_INTERVAL; return whether the message is known."""
        if message not in self._intervals or not math.isfinite(interval_us):
            return False
        self._intervals[message] = 1.0 / _RATES[message] if interval_us == 0.0 else max(interval_us * 1e-6, 0.01)
        if interval_us < 0.0:
            self._intervals[message] = math.inf
        self._due[message] = -math.inf
        return True

    def is_due(self, message: int, t: float) -> bool:
        """Return whether a message is due, and plan its next time."""
        due = self._due[message]
        if t < due - 1e-9:
            return False
        interval = self._intervals[message]
        self._due[message] = due + interval if due > t - interval else t + interval
        return True

    def messages(self, own: Ownship, boot: float) -> list[Any]:
        """Return the messages due of a state; `boot` is the time since boot, s."""
        return [
            made
            for message, make in self._makers.items()
            if self.is_due(message, own.t) and (made := make(own, boot)) is not None
        ]

    def one(self, message: int, own: Ownship, boot: float) -> Any | None:
        """Return one message at once, None where it is not known."""
        make = self._makers.get(message)
        return None if make is None else make(own, boot)

    def _global_position(self, own: Ownship, boot: float) -> Any | None:
        if not self.has_gps:
            return None
        latitude, longitude, altitude = self._frame.to_geodetic(own.position)
        velocity = self._frame.velocity_from_ned(latitude, longitude, own.velocity)
        _, _, yaw = euler_angles(own.attitude)
        return mavlink.MAVLink_global_position_int_message(
            _milliseconds(boot),
            round(math.degrees(latitude) * 1e7),
            round(math.degrees(longitude) * 1e7),
            round(float(altitude) * 1e3),
            round((float(altitude) - self._home.altitude) * 1e3),
            *(round(float(v) * 1e2) for v in velocity),
            round(math.degrees(yaw) % 360.0 * 1e2) % 36000,
        )

    def _attitude(self, own: Ownship, boot: float) -> Any:
        return mavlink.MAVLink_attitude_message(_milliseconds(boot), *euler_angles(own.attitude), 0.0, 0.0, 0.0)

    def _gps(self, own: Ownship, boot: float) -> Any:
        latitude, longitude, altitude = self._frame.to_geodetic(own.position)
        speed = math.hypot(own.velocity[0], own.velocity[1])
        course = math.degrees(math.atan2(own.velocity[1], own.velocity[0])) % 360.0
        return mavlink.MAVLink_gps_raw_int_message(
            round(boot * 1e6),
            3 if self.has_gps else 1,
            round(math.degrees(latitude) * 1e7),
            round(math.degrees(longitude) * 1e7),
            round(float(altitude) * 1e3),
            80,
            120,
            round(speed * 1e2),
            round(course * 1e2) % 36000,
            12 if self.has_gps else 0,
            round(float(altitude) * 1e3),
            1200,
            2000,
            200,
        )

    def _estimator(self, own: Ownship, boot: float) -> Any:
        flags = _ESTIMATOR_GOOD if self.has_gps else _ESTIMATOR_BLIND
        ratios = (0.1,) * 6
        return mavlink.MAVLink_estimator_status_message(round(boot * 1e6), flags, *ratios, 1.0, 1.5)

    def _hud(self, own: Ownship, boot: float) -> Any:
        speed = math.hypot(own.velocity[0], own.velocity[1])
        _, _, yaw = euler_angles(own.attitude)
        heading = round(math.degrees(yaw)) % 360
        return mavlink.MAVLink_vfr_hud_message(
            speed, speed, heading, 50, -float(own.position[2]), -float(own.velocity[2])
        )

    def _home_position(self) -> Any:
        home = self._home
        return mavlink.MAVLink_home_position_message(
            round(math.degrees(home.latitude) * 1e7),
            round(math.degrees(home.longitude) * 1e7),
            round(home.altitude * 1e3),
            0.0,
            0.0,
            0.0,
            (1.0, 0.0, 0.0, 0.0),
            0.0,
            0.0,
            0.0,
        )


def _milliseconds(boot: float) -> int:
    return round(boot * 1e3) % 2**32
