"""What the decoders make of messages: one geodetic report of one aircraft."""

import math
from dataclasses import dataclass, field
from typing import Protocol

from wideberth.types import SensorHealth, SourceInfo


@dataclass(frozen=True, slots=True)
class AdsbReport:
    """A report of one aircraft at one time; NaN where the message does not carry the element.

    Attributes
    ----------
    t : float
        Time of receipt, Unix s.
    address : str
        ICAO 24-bit address, six lower-case hexadecimal digits.
    latitude, longitude : float
        WGS84, rad. Finite only where this message carried a position.
    pressure_altitude, geometric_altitude : float
        m.
    velocity_north, velocity_east : float
        Ground velocity, m/s, in the frame at the aircraft.
    climb_rate : float
        m/s, positive up.
    on_ground : bool
    info : SourceInfo
        What is known of the aircraft so far.
    """

    t: float
    address: str
    latitude: float = math.nan
    longitude: float = math.nan
    pressure_altitude: float = math.nan
    geometric_altitude: float = math.nan
    velocity_north: float = math.nan
    velocity_east: float = math.nan
    climb_rate: float = math.nan
    on_ground: bool = False
    info: SourceInfo = field(default_factory=SourceInfo)


class TrafficSource(Protocol):
    """Anything that gives reports in the order of receipt: a file, standard input, a live receiver."""

    name: str
    live: bool

    def poll(self, t: float) -> list[AdsbReport]:
        """Return all reports received up to time `t` (Unix s) and not returned before."""

    @property
    def exhausted(self) -> bool:
        """Whether nothing will ever come again (never, for a live source)."""

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages by kind and of rejections by cause (keys in words, such as ``"crc failed"``)."""

    def health(self, t: float) -> SensorHealth:
        """Return age, rate, rejects and state at time `t`."""

    def close(self) -> None:
        """Release files and sockets."""
