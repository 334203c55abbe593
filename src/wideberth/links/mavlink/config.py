"""Configuration of the link to an autopilot."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from wideberth.part_config import PartConfig

Identifier = Annotated[int, Field(ge=1, le=255)]


class MavlinkConfig(PartConfig):
    """An autopilot over MAVLink (autopilot.Autopilot); docs/mavlink.md says what is sent when.

    Attributes
    ----------
    kind : str
        ``mavlink``.
    connection : str
        ``udp:host:port`` (listen), ``udpout:host:port``, ``tcp:host:port`` or ``serial:/dev/ttyUSB0:57600``.
    command : bool
        Whether anything is commanded; without it the link only listens and tells.
    system_id, component_id : int
        Who we are. Not 255: an autopilot watches the heartbeat of that ground station and acts on its loss.
    target_system : int or None
        System of the autopilot; None takes the first that is heard.
    method : str
        ``guided`` (set-points), ``mission`` (the maneuver is inserted into the mission), or ``auto``: guided where the
        autopilot is ArduPilot or PX4, else mission.
    approval : str
        ``none``, or ``window``: a human approves each maneuver by MAV_CMD_USER_1 (param1 1: yes, 0: no) in time.
    approval_window_s : float
    unanswered : str
        What an approval that nobody answered in time means: ``refuse`` or ``fly``.
    floor_agl_m : float
        No point is commanded lower than this above the ground (terrain where the autopilot tells it, else home).
    cruise_speed_mps : float or None
        Ground speed of legs whose speed the mission does not set; None asks the autopilot, else takes 15 m/s (plane)
        or 5 m/s.
    waypoint_capture_m : float
        A mission waypoint passed within this distance during a maneuver is not flown back to.
    telemetry_rate_hz : float
        Asked for position and attitude.
    link_lost_s : float
        Without a heartbeat for so long the link is lost.
    retry_s : float
        Wait for an answer, before a request is sent again.
    retries : int
    mission_check_s : float
        How often the mission is downloaded again, as another ground station may have changed it; 0: never.
    position_sigma_m, height_sigma_m, velocity_sigma_mps : float
        Standard deviations where the autopilot tells none.
    send_traffic : bool
        Whether tracks go out as ADSB_VEHICLE.
    signing_key : str or None
        64 hexadecimal digits, or a pass phrase as ground stations take it (its SHA-256 is the key).
    signing_link_id : int
    allow_unsigned : bool
        Whether unsigned messages are accepted beside a key.
    """

    kind: Literal["mavlink"] = "mavlink"
    connection: str = "udp:127.0.0.1:14550"
    command: bool = False
    system_id: Identifier = 245
    component_id: Identifier = 196
    target_system: Identifier | None = None
    method: Literal["auto", "guided", "mission"] = "auto"
    approval: Literal["none", "window"] = "none"
    approval_window_s: float = Field(default=10.0, gt=0)
    unanswered: Literal["refuse", "fly"] = "refuse"
    floor_agl_m: float = Field(default=30.0, ge=0)
    cruise_speed_mps: float | None = Field(default=None, gt=0)
    waypoint_capture_m: float = Field(default=500.0, gt=0)
    telemetry_rate_hz: float = Field(default=10.0, ge=2, le=50)
    link_lost_s: float = Field(default=3.0, ge=1.5)
    retry_s: float = Field(default=0.7, gt=0.05)
    retries: int = Field(default=6, ge=1)
    mission_check_s: float = Field(default=60.0, ge=0)
    position_sigma_m: float = Field(default=3.0, gt=0)
    height_sigma_m: float = Field(default=5.0, gt=0)
    velocity_sigma_mps: float = Field(default=0.3, gt=0)
    send_traffic: bool = True
    signing_key: str | None = None
    signing_link_id: int = Field(default=0, ge=0, le=255)
    allow_unsigned: bool = False

    @field_validator("connection")
    @classmethod
    def _known_connection(cls, value: str) -> str:
        scheme, _, rest = value.partition(":")
        address, _, number = rest.rpartition(":")
        if scheme not in {"udp", "udpin", "udpout", "tcp", "serial"} or not address or not number.isdecimal():
            raise ValueError(
                f"connection '{value}': write udp:127.0.0.1:14550, udpout:host:port, tcp:host:port"
                " or serial:/dev/ttyUSB0:57600"
            )
        return value

    @model_validator(mode="after")
    def _not_the_vehicle(self) -> Self:
        if self.target_system == self.system_id and self.component_id == 1:
            raise ValueError("component_id 1 of the vehicle's own system_id is the autopilot: take another")
        return self
