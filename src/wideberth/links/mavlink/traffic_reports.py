"""Traffic that an autopilot tells of: its own ADS-B receiver, and Remote ID."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from wideberth.links.mavlink.dialect import mavlink
from wideberth.links.remote_id import remote_id_report
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo

_ECHO_S = 10.0  # how long an aircraft that we told of is not taken back
_KEPT_MAX = 2000
_AGE_MAX_S = 30
_EMITTERS = dict(enumerate(("A0", "A1", "A2", "A3", "A4", "A5", "A6", "A7", "B0", "B1", "B2", "B3", "B4")))
_EMITTERS |= {14: "B6", 15: "B7", 17: "C1", 18: "C2", 19: "C3"}


class TrafficReports:
    """Makes reports of ADSB_VEHICLE and OPEN_DRONE_ID messages.

    What we told the autopilot ourselves comes back as ADSB_VEHICLE: it is known by its address, and left out.

    Attributes
    ----------
    counts : Counter
    """

    def __init__(self, counts: Counter[str]) -> None:
        self.counts = counts
        self._reports: list[AdsbReport] = []
        self._told: dict[int, float] = {}
        self._names: dict[str, str] = {}
        self._takers: dict[str, Callable[[Any, float], None]] = {
            "ADSB_VEHICLE": self._adsb_vehicle,
            "OPEN_DRONE_ID_BASIC_ID": self._basic_id,
            "OPEN_DRONE_ID_LOCATION": self._location,
        }

    def take(self, message: Any, t: float) -> None:
        """Take a message that came at time `t`, s; others than traffic are ignored."""
        taker = self._takers.get(message.get_type())
        if taker is not None:
            taker(message, t)

    def tell(self, address: int, t: float) -> None:
        """Note that we have told the autopilot of an aircraft."""
        self._told[address] = t
        if len(self._told) > _KEPT_MAX:
            self._told = {a: when for a, when in self._told.items() if t - when < _ECHO_S}

    def drain(self) -> list[AdsbReport]:
        """Return the reports since the last call."""
        reports, self._reports = self._reports, []
        return reports

    def _add(self, report: AdsbReport) -> None:
        if len(self._reports) >= _KEPT_MAX:
            self.counts["traffic nobody took"] += 1
            return
        self._reports.append(report)

    def _adsb_vehicle(self, message: Any, t: float) -> None:
        address, flags = message.ICAO_address, message.flags
        if t - self._told.get(address, -math.inf) < _ECHO_S:
            self.counts["our own traffic came back"] += 1
            return
        latitude, longitude = message.lat * 1e-7, message.lon * 1e-7
        placed = flags & mavlink.ADSB_FLAGS_VALID_COORDS and abs(latitude) <= 90.0 and abs(longitude) <= 180.0
        if not placed or message.tslc > _AGE_MAX_S:
            self.counts["traffic without a position" if not placed else "traffic too old"] += 1
            return
        altitude = message.altitude * 1e-3 if flags & mavlink.ADSB_FLAGS_VALID_ALTITUDE else math.nan
        pressure = message.altitude_type == mavlink.ADSB_ALTITUDE_TYPE_PRESSURE_QNH
        north = east = climb = math.nan
        if flags & mavlink.ADSB_FLAGS_VALID_VELOCITY and flags & mavlink.ADSB_FLAGS_VALID_HEADING:
            speed, course = message.hor_velocity * 1e-2, math.radians(message.heading * 1e-2)
            north, east = speed * math.cos(course), speed * math.sin(course)
        if flags & mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID or (
            flags & mavlink.ADSB_FLAGS_VALID_VELOCITY and message.ver_velocity != 0
        ):
            climb = message.ver_velocity * 1e-2
        squawk = f"{message.squawk:04d}" if flags & mavlink.ADSB_FLAGS_VALID_SQUAWK else None
        callsign = text_of(message.callsign) if flags & mavlink.ADSB_FLAGS_VALID_CALLSIGN else None
        self._add(
            AdsbReport(
                t=t - message.tslc,
                address=("" if address < 1 << 24 else "~") + f"{address & 0xFFFFFF:06x}",
                latitude=math.radians(latitude),
                longitude=math.radians(longitude),
                pressure_altitude=altitude if pressure else math.nan,
                geometric_altitude=math.nan if pressure else altitude,
                velocity_north=north,
                velocity_east=east,
                climb_rate=climb,
                info=SourceInfo(callsign=callsign or None, category=_EMITTERS.get(message.emitter_type), squawk=squawk),
            )
        )

    def _basic_id(self, message: Any, t: float) -> None:
        source, name = _bytes_of(message.id_or_mac), text_of(message.uas_id)
        if any(source) and name and (len(self._names) < _KEPT_MAX or source.hex() in self._names):
            self._names[source.hex()] = name

    def _location(self, message: Any, t: float) -> None:
        source = _bytes_of(message.id_or_mac)
        if not any(source):
            # Without the sender's address it is the vehicle's own, on its way to be broadcast.
            self.counts["own Remote ID"] += 1
            return
        # The address stays the sender's, whether or not the drone has said its identity yet.
        report = remote_id_report(
            t,
            source.hex(),
            status=message.status,
            direction=message.direction,
            speed_horizontal=message.speed_horizontal,
            speed_vertical=message.speed_vertical,
            latitude=message.latitude,
            longitude=message.longitude,
            altitude_barometric=message.altitude_barometric,
            altitude_geodetic=message.altitude_geodetic,
            horizontal_accuracy=message.horizontal_accuracy,
            speed_accuracy=message.speed_accuracy,
            timestamp=message.timestamp,
        )
        if report is None or math.isnan(report.latitude):
            self.counts["traffic without a position"] += 1
            return
        info = dataclasses.replace(report.info, callsign=self._names.get(source.hex()))
        self._add(dataclasses.replace(report, info=info))


def text_of(value: Any) -> str:
    """Return a text field, which may come as text, bytes or numbers, up to its first zero."""
    if isinstance(value, str):
        text = value
    else:
        text = _bytes_of(value).decode("latin-1")
    return "".join(c for c in text.split("\0")[0] if c.isprintable()).strip()


def _bytes_of(value: Any) -> bytes:
    return bytes(value) if isinstance(value, bytes | bytearray) else bytes(int(v) & 0xFF for v in value)
