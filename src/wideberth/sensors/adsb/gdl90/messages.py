"""Messages of GDL90 as values, from bytes and to bytes.

Source: Garmin 560-1058-00, 3.1 (heartbeat), 3.4 (ownship report), 3.5.1 (traffic report), 3.8 (geometric altitude).
"""

import math
from dataclasses import dataclass

HEARTBEAT, OWNSHIP_REPORT, OWNSHIP_ALTITUDE, TRAFFIC_REPORT = 0, 10, 11, 20
TRUE_TRACK, MAGNETIC_HEADING, TRUE_HEADING = 1, 2, 3
_SEMICIRCLE = 180.0 / (1 << 23)
_HEARTBEAT_BYTES, _REPORT_BYTES, _ALTITUDE_BYTES = 7, 28, 5
_NO_ALTITUDE, _NO_SPEED, _NO_CLIMB, _NO_VFOM = 0xFFF, 0xFFF, 0x800, 0x7FFF


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """What the receiver says once a second.

    Attributes
    ----------
    position_valid, utc_valid : bool
    second_of_day : int
        UTC.
    uplinks, messages : int
        Received in the last second: from the ground, and of both lengths from aircraft.
    """

    position_valid: bool
    utc_valid: bool
    second_of_day: int
    uplinks: int = 0
    messages: int = 0


@dataclass(frozen=True, slots=True)
class TargetReport:
    """An ownship or traffic report; NaN where it says "no data".

    Attributes
    ----------
    address_type : int
        0 and 1: ADS-B with an ICAO or other address, 2 and 3: TIS-B with an ICAO address or a track number, 4: surface
        vehicle, 5: ground station.
    address : int
    latitude, longitude : float
        Degrees.
    pressure_altitude : float
        ft.
    speed, climb_rate, track : float
        kt, ft/min, degrees.
    track_type : int
        0: no track, `TRUE_TRACK`, `MAGNETIC_HEADING` or `TRUE_HEADING`.
    airborne, extrapolated, alert : bool
    nic, nacp : int
    category : int
        Number of the emitter category.
    callsign : str
    emergency : int
    """

    address_type: int
    address: int
    latitude: float = math.nan
    longitude: float = math.nan
    pressure_altitude: float = math.nan
    speed: float = math.nan
    climb_rate: float = math.nan
    track: float = math.nan
    track_type: int = TRUE_TRACK
    airborne: bool = True
    extrapolated: bool = False
    alert: bool = False
    nic: int = 0
    nacp: int = 0
    category: int = 0
    callsign: str = ""
    emergency: int = 0


@dataclass(frozen=True, slots=True)
class OwnshipAltitude:
    """Geometric altitude of the ownship, ft, its figure of merit, m (NaN where not known), and a warning."""

    altitude: float
    figure_of_merit: float = math.nan
    warning: bool = False


def decode_heartbeat(message: bytes) -> Heartbeat | None:
    """Return a heartbeat; None where the length is wrong."""
    if len(message) != _HEARTBEAT_BYTES:
        return None
    status_1, status_2 = message[1], message[2]
    second = (status_2 >> 7) << 16 | int.from_bytes(message[3:5], "little")
    counts = int.from_bytes(message[5:7], "big")
    return Heartbeat(bool(status_1 & 0x80), bool(status_2 & 1), second, counts >> 11, counts & 0x3FF)


def encode_heartbeat(heartbeat: Heartbeat) -> bytes:
    """Return the message of a heartbeat; counts too large are cut."""
    second = heartbeat.second_of_day % 86400
    status_2 = (second >> 16) << 7 | heartbeat.utc_valid
    counts = min(heartbeat.uplinks, 31) << 11 | min(heartbeat.messages, 1023)
    # Bit 0 of the first status byte: the receiver has initialized.
    head = bytes([HEARTBEAT, heartbeat.position_valid << 7 | 1, status_2])
    return head + (second & 0xFFFF).to_bytes(2, "little") + counts.to_bytes(2, "big")


def decode_target(message: bytes) -> TargetReport | None:
    """Return an ownship or traffic report; None where the length is wrong."""
    if len(message) != _REPORT_BYTES:
        return None
    number = int.from_bytes(message[1:], "big")

    def field(first: int, count: int) -> int:
        return number >> (8 * (_REPORT_BYTES - 1) - first - count) & ((1 << count) - 1)

    latitude, longitude = (_signed(field(start, 24), 24) for start in (32, 56))
    nic = field(96, 4)
    known = bool(nic or latitude or longitude)
    altitude, speed, climb = field(80, 12), field(104, 12), field(116, 12)
    misc = field(92, 4)
    return TargetReport(
        address_type=field(4, 4),
        address=field(8, 24),
        latitude=latitude * _SEMICIRCLE if known else math.nan,
        longitude=longitude * _SEMICIRCLE if known else math.nan,
        pressure_altitude=math.nan if altitude == _NO_ALTITUDE else 25.0 * altitude - 1000.0,
        speed=math.nan if speed == _NO_SPEED else float(speed),
        climb_rate=math.nan if climb == _NO_CLIMB else 64.0 * _signed(climb, 12),
        track=field(128, 8) * 360.0 / 256.0 if misc & 3 else math.nan,
        track_type=misc & 3,
        airborne=bool(misc & 8),
        extrapolated=bool(misc & 4),
        alert=field(0, 4) == 1,
        nic=nic,
        nacp=field(100, 4),
        category=field(136, 8),
        callsign=message[19:27].decode("latin-1").strip(" \0"),
        emergency=field(208, 4),
    )


def encode_target(report: TargetReport, number: int = TRAFFIC_REPORT) -> bytes:
    """Return the message of a traffic report or, with `number` `OWNSHIP_REPORT`, an ownship report.

    Values are rounded to what a message can hold, and held within it.

    Raises
    ------
    ValueError
        If address, latitude or longitude are none, or an infinite value is given.
    """
    if not (0 <= report.address < 1 << 24 and 0 <= report.address_type < 16):
        raise ValueError(f"address {report.address:x} of type {report.address_type} does not fit into a report")
    known = not (math.isnan(report.latitude) or math.isnan(report.longitude))
    if known and not (abs(report.latitude) <= 90.0 and abs(report.longitude) <= 180.0):
        raise ValueError(f"latitude {report.latitude}, longitude {report.longitude} are not on the Earth")
    values = (report.pressure_altitude, report.speed, report.climb_rate, report.track)
    if any(math.isinf(value) for value in values):
        raise ValueError(f"a report has no infinite values: {values}")
    place = (report.latitude, report.longitude) if known else (0.0, 0.0)
    altitude = _coded(report.pressure_altitude + 1000.0, 25.0, 0, _NO_ALTITUDE - 1, _NO_ALTITUDE)
    speed = _coded(report.speed, 1.0, 0, _NO_SPEED - 1, _NO_SPEED)
    climb = _coded(report.climb_rate, 64.0, -510, 510, -_NO_CLIMB) & 0xFFF
    track_type = 0 if math.isnan(report.track) else report.track_type & 3
    track = 0 if math.isnan(report.track) else round(report.track * 256.0 / 360.0) & 0xFF
    misc = report.airborne << 3 | report.extrapolated << 2 | track_type
    # A position needs a NIC: without one zero means "none".
    nic = report.nic & 15 if known else 0
    out = bytes([number, report.alert << 4 | report.address_type]) + report.address.to_bytes(3, "big")
    for angle in place:
        out += (min(round(angle / _SEMICIRCLE), (1 << 23) - 1) & 0xFFFFFF).to_bytes(3, "big")
    out += (altitude << 4 | misc).to_bytes(2, "big") + bytes([nic << 4 | report.nacp & 15])
    out += (speed << 12 | climb).to_bytes(3, "big") + bytes([track, report.category & 0xFF])
    callsign = report.callsign.upper().encode("ascii", "replace").replace(b"?", b" ")[:8].ljust(8)
    return out + callsign + bytes([(report.emergency & 15) << 4])


def decode_altitude(message: bytes) -> OwnshipAltitude | None:
    """Return the geometric altitude of the ownship; None where the length is wrong."""
    if len(message) != _ALTITUDE_BYTES:
        return None
    metrics = int.from_bytes(message[3:5], "big")
    merit = metrics & 0x7FFF
    return OwnshipAltitude(
        5.0 * _signed(int.from_bytes(message[1:3], "big"), 16),
        math.nan if merit == _NO_VFOM else float(merit),
        bool(metrics & 0x8000),
    )


def encode_altitude(altitude: OwnshipAltitude) -> bytes:
    """Return the message of a geometric altitude.

    Raises
    ------
    ValueError
        If the altitude is not finite.
    """
    if not math.isfinite(altitude.altitude):
        raise ValueError(f"altitude {altitude.altitude} is not finite")
    steps = _coded(altitude.altitude, 5.0, -(1 << 15), (1 << 15) - 1, 0)
    merit = _coded(altitude.figure_of_merit, 1.0, 0, 0x7EEE, _NO_VFOM)
    metrics = altitude.warning << 15 | merit
    return bytes([OWNSHIP_ALTITUDE]) + (steps & 0xFFFF).to_bytes(2, "big") + metrics.to_bytes(2, "big")


def _signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) else value


def _coded(value: float, step: float, least: int, most: int, none: int) -> int:
    """Return how many steps a value is, held within limits; the code for none where it is NaN."""
    if math.isnan(value):
        return none
    return int(min(max(round(max(min(value / step, 1e9), -1e9)), least), most))
