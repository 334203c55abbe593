"""Remote ID (ASTM F3411) as MAVLink's OPEN_DRONE_ID messages carry it: reports of other drones."""

import math
import zlib

from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import SourceInfo

GROUND, AIRBORNE, EMERGENCY, SYSTEM_FAILURE = 1, 2, 3, 4
NO_DIRECTION, NO_SPEED, NO_CLIMB, NO_ALTITUDE, NO_TIME = 36100, 25500, 6300, -1000.0, 65535.0
_HOUR = 3600.0
_LATEST = 30.0
"""A time stamp farther from the time of receipt, s, is not believed."""

_BEST_NACP, _BEST_NACV = 11, 4


def remote_id_report(
    t: float,
    identity: str,
    *,
    status: int,
    direction: int,
    speed_horizontal: int,
    speed_vertical: int,
    latitude: int,
    longitude: int,
    altitude_barometric: float,
    altitude_geodetic: float,
    horizontal_accuracy: int = 0,
    speed_accuracy: int = 0,
    timestamp: float = NO_TIME,
) -> AdsbReport | None:
    """Return the report of an OPEN_DRONE_ID_LOCATION message, whose fields the keywords are, as sent.

    Parameters
    ----------
    t : float
        Time of receipt, Unix s.
    identity : str
        `uas_id` of the drone's BASIC_ID message or, before that, its `id_or_mac` in hexadecimal.
    status : int
        MAV_ODID_STATUS.
    direction, speed_horizontal, speed_vertical : int
        Course over ground (0.01 deg), speed and climb (0.01 m/s).
    latitude, longitude : int
        1e-7 deg; both 0: not known.
    altitude_barometric, altitude_geodetic : float
        m, against 1013.25 hPa and above the WGS84 ellipsoid.
    horizontal_accuracy, speed_accuracy : int
        MAV_ODID_HOR_ACC and MAV_ODID_SPEED_ACC, which count as NACp and NACv do.
    timestamp : float
        s after the full hour, UTC.

    Returns
    -------
    AdsbReport or None
        None where it carries nothing that can be used, or a position off the Earth. The address is "~" and 24 bits of
        a check sum of the identity; the identity itself is the callsign.
    """
    known = (latitude, longitude) != (0, 0)
    if not math.isfinite(t) or (known and not (abs(latitude) <= 900_000_000 and abs(longitude) <= 1_800_000_000)):
        return None
    speed = 0.01 * speed_horizontal if 0 <= speed_horizontal < NO_SPEED else math.nan
    course = math.radians(0.01 * direction) if 0 <= direction <= 36000 else math.nan
    climb = 0.01 * speed_vertical if abs(speed_vertical) < NO_CLIMB else math.nan
    altitudes = [
        a if math.isfinite(a) and a > NO_ALTITUDE else math.nan for a in (altitude_barometric, altitude_geodetic)
    ]
    report = AdsbReport(
        _time(t, timestamp),
        f"~{zlib.crc32(identity.encode(errors='replace')) & 0xFFFFFF:06x}",
        math.radians(latitude * 1e-7) if known else math.nan,
        math.radians(longitude * 1e-7) if known else math.nan,
        altitudes[0],
        altitudes[1],
        speed * math.cos(course),
        speed * math.sin(course),
        climb,
        on_ground=status == GROUND,
        info=SourceInfo(
            callsign="".join(c for c in identity if c.isprintable()).strip() or None,
            category="B6",
            nacp=min(horizontal_accuracy, _BEST_NACP) if horizontal_accuracy > 0 else None,
            nacv=min(speed_accuracy, _BEST_NACV) if speed_accuracy > 0 else None,
            emergency="general emergency" if status == EMERGENCY else "none",
        ),
    )
    values = (report.latitude, *altitudes, report.velocity_north, climb)
    return None if all(math.isnan(value) for value in values) else report


def remote_id_fields(report: AdsbReport) -> dict[str, float | int]:
    """Return the fields of an OPEN_DRONE_ID_LOCATION message of a report, the inverse of `remote_id_report`.

    Raises
    ------
    ValueError
        If the report has an infinite value.
    """
    speed = math.hypot(report.velocity_north, report.velocity_east)
    course = math.degrees(math.atan2(report.velocity_east, report.velocity_north)) % 360.0
    place = (report.latitude, report.longitude)
    if any(math.isinf(v) for v in (*place, speed, report.climb_rate)):
        raise ValueError("a message has no infinite values")
    known = not any(math.isnan(v) for v in place)
    status = GROUND if report.on_ground else AIRBORNE
    if report.info.emergency not in (None, "none"):
        status = EMERGENCY
    return {
        "status": status,
        "direction": NO_DIRECTION if math.isnan(course) else round(100.0 * course) % 36000,
        "speed_horizontal": NO_SPEED if math.isnan(speed) else min(round(100.0 * speed), NO_SPEED - 75),
        "speed_vertical": NO_CLIMB
        if math.isnan(report.climb_rate)
        else min(max(round(100.0 * report.climb_rate), -6200), 6200),
        "latitude": round(math.degrees(place[0]) * 1e7) if known else 0,
        "longitude": round(math.degrees(place[1]) * 1e7) if known else 0,
        "altitude_barometric": NO_ALTITUDE if math.isnan(report.pressure_altitude) else report.pressure_altitude,
        "altitude_geodetic": NO_ALTITUDE if math.isnan(report.geometric_altitude) else report.geometric_altitude,
        "horizontal_accuracy": report.info.nacp or 0,
        "speed_accuracy": report.info.nacv or 0,
        "timestamp": report.t % _HOUR,
    }


def _time(t: float, timestamp: float) -> float:
    """Return the time of validity: that of the stamp where it fits to the time of receipt, and never after that."""
    if not 0.0 <= timestamp <= _HOUR:
        return t
    stamped = timestamp + _HOUR * round((t - timestamp) / _HOUR)
    return min(stamped, t) if abs(stamped - t) <= _LATEST else t
