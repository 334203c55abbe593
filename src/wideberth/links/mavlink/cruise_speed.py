"""The speed that an autopilot flies where its mission sets none: one of its parameters."""

from collections.abc import Callable
from typing import Any

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.mavlink.modes import VehicleKind
from wideberth.links.mavlink.traffic_reports import text_of

_PARAMETERS: dict[tuple[str, str], dict[str, float]] = {
    ("ardupilot", "plane"): {"AIRSPEED_CRUISE": 1.0, "TRIM_ARSPD_CM": 0.01},
    ("ardupilot", "copter"): {"WP_SPD": 1.0, "WPNAV_SPEED": 0.01},
    ("px4", "plane"): {"FW_AIRSPD_TRIM": 1.0},
    ("px4", "copter"): {"MPC_XY_CRUISE": 1.0},
}
DEFAULT_SPEED = {"plane": 15.0, "copter": 5.0}
"""Where no parameter says it, m/s."""

_EVERY_S, _ROUNDS = 1.0, 4


class CruiseSpeed:
    """Asks for the parameters of a kind of vehicle, old and new names alike, a few times.

    Attributes
    ----------
    value : float or None
        m/s; None until one is told.
    """

    def __init__(self, send: Callable[[Any], None]) -> None:
        self._send = send
        self.value: float | None = None
        self._rounds, self._due = 0, 0.0

    @property
    def is_over(self) -> bool:
        """Whether it is known, or was asked for often enough."""
        return self.value is not None or self._rounds > _ROUNDS

    def take(self, message: Any, kind: VehicleKind) -> None:
        """Take a PARAM_VALUE."""
        scale = _PARAMETERS.get((kind.family, kind.airframe), {}).get(text_of(message.param_id))
        if scale is not None and 0.5 < message.param_value * scale < 500.0:
            self.value = message.param_value * scale

    def step(self, target: tuple[int, int], kind: VehicleKind, t: float) -> None:
        """Ask, if it is time."""
        if self.is_over or t < self._due:
            return
        self._due = t + _EVERY_S
        self._rounds += 1
        for name in _PARAMETERS.get((kind.family, kind.airframe), ()):
            self._send(mavlink.MAVLink_param_request_read_message(*target, name.encode(), -1))
