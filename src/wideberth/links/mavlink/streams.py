"""What is asked for so that telemetry comes often enough, and the heartbeat and clock questions that go out."""

from collections.abc import Callable
from typing import Any

from wideberth.links.mavlink.config import MavlinkConfig
from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.telemetry import Telemetry

_HEARTBEAT_S, _TIMESYNC_S, _TIMESYNC_SOON_S, _ASK_S = 1.0, 1.0, 0.2, 4.0
_SLOW = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 2.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 2.0,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 2.0,
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT: 1.0,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: 2.0,
    mavlink.MAVLINK_MSG_ID_TERRAIN_REPORT: 1.0,
}  # Hz
_OLD_STREAMS = (
    mavlink.MAV_DATA_STREAM_POSITION,
    mavlink.MAV_DATA_STREAM_EXTRA1,
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS,
)


class Streams:
    """Keeps telemetry flowing.

    Parameters
    ----------
    send : callable
        Takes a message.
    config : MavlinkConfig
    telemetry : Telemetry
    """

    def __init__(self, send: Callable[[Any], None], config: MavlinkConfig, telemetry: Telemetry) -> None:
        self._send, self._config, self._telemetry = send, config, telemetry
        self._t_heartbeat = self._t_sync = self._t_asked = float("-inf")
        self._rounds = 0

    def restart(self) -> None:
        """Ask anew: the autopilot has forgotten."""
        self._t_asked, self._rounds = float("-inf"), 0

    def step(self, target: tuple[int, int] | None, t: float) -> None:
        """Send what is due."""
        if t - self._t_heartbeat >= _HEARTBEAT_S or t < self._t_heartbeat:
            self._t_heartbeat = t
            self._send(
                mavlink.MAVLink_heartbeat_message(
                    mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
                    mavlink.MAV_AUTOPILOT_INVALID,
                    0,
                    0,
                    mavlink.MAV_STATE_ACTIVE,
                    3,
                )
            )
        if target is None:
            return
        pause = _TIMESYNC_SOON_S if self._telemetry.clock.in_doubt else _TIMESYNC_S
        if t - self._t_sync >= pause or t < self._t_sync:
            self._t_sync = t
            self._send(mavlink.MAVLink_timesync_message(0, round(t * 1e9)))
        slow = self._telemetry.rate(t) < 0.6 * self._config.telemetry_rate_hz
        if (slow or self._telemetry.home is None) and not 0.0 <= t - self._t_asked < _ASK_S:
            self._t_asked = t
            self._rounds += 1
            self._ask(target, slow)

    def _ask(self, target: tuple[int, int], slow: bool) -> None:
        if self._telemetry.home is None:
            self._command(target, mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0.0)
            # Older ones know only this.
            self._command(target, mavlink.MAV_CMD_GET_HOME_POSITION, 0.0, 0.0)
        if not slow:
            return
        rate = self._config.telemetry_rate_hz
        for message in (mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, mavlink.MAVLINK_MSG_ID_ATTITUDE):
            self._command(target, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message, 1e6 / rate)
        for message, hertz in _SLOW.items():
            self._command(target, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message, 1e6 / hertz)
        if self._rounds > 1:
            for stream in _OLD_STREAMS:
                self._send(mavlink.MAVLink_request_data_stream_message(*target, stream, round(rate), 1))

    def _command(self, target: tuple[int, int], command: int, param1: float, param2: float) -> None:
        self._send(mavlink.MAVLink_command_long_message(*target, command, 0, param1, param2, 0, 0, 0, 0, 0))
