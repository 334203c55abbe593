"""SBS (BaseStation) lines of reports, as dump1090 sends them on port 30003: the opposite of `sbs`."""

import math
from datetime import UTC, datetime

from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT


def encode(report: AdsbReport) -> bytes:
    """Return the lines of a report: identification (MSG,1), airborne position (MSG,3) and velocity (MSG,4).

    What the report lacks is left out; the time is the report's, UTC.
    """
    stamp = datetime.fromtimestamp(report.t, UTC).strftime("%Y/%m/%d,%H:%M:%S.%f")[:-3]
    head = f"1,1,{report.address.split('#')[0].upper()},1,{stamp},{stamp}"
    out = []
    if report.info.callsign:
        out.append(f"MSG,1,{head},{report.info.callsign},,,,,,,,,,,")
    ground = "-1" if report.on_ground else "0"
    altitude = report.pressure_altitude if not math.isnan(report.pressure_altitude) else report.geometric_altitude
    height = _text(altitude / FOOT, 0)
    if math.isfinite(report.latitude) and math.isfinite(report.longitude):
        place = f"{math.degrees(report.latitude):.6f},{math.degrees(report.longitude):.6f}"
        out.append(f"MSG,3,{head},,{height},,,{place},,,,,,{ground}")
    north, east = report.velocity_north, report.velocity_east
    if math.isfinite(north) and math.isfinite(east):
        track = math.degrees(math.atan2(east, north)) % 360.0
        climb = _text(report.climb_rate / FOOT_PER_MINUTE, 0)
        out.append(f"MSG,4,{head},,,{math.hypot(north, east) / KNOT:.1f},{track:.2f},,,{climb},,,,,{ground}")
    return "".join(line + "\r\n" for line in out).encode("ascii", "replace")


def _text(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else ""
