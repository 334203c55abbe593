"""GDL90 messages of reports, for senders."""

import math

from wideberth.sensors.adsb.gdl90 import messages as m
from wideberth.sensors.adsb.gdl90.framing import frame
from wideberth.sensors.adsb.message_fields import EMERGENCIES
from wideberth.sensors.adsb.quality import emitter_number
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT


def target_of(report: AdsbReport) -> m.TargetReport:
    """Return the target report of a report; its altitude is the pressure altitude, else the geometric one."""
    info = report.info
    north, east = report.velocity_north, report.velocity_east
    moving = math.isfinite(north) and math.isfinite(east)
    pressure = report.pressure_altitude
    known = math.isfinite(report.latitude) and math.isfinite(report.longitude)
    emergency = info.emergency if info.emergency in EMERGENCIES else "none"
    address = report.address.split("#")[0]
    return m.TargetReport(
        address_type=1 if address.startswith("~") else 0,
        address=int(address.lstrip("~"), 16),
        latitude=math.degrees(report.latitude) if known else math.nan,
        longitude=math.degrees(report.longitude) if known else math.nan,
        pressure_altitude=(report.geometric_altitude if math.isnan(pressure) else pressure) / FOOT,
        speed=math.hypot(north, east) / KNOT if moving else math.nan,
        climb_rate=report.climb_rate / FOOT_PER_MINUTE,
        track=math.degrees(math.atan2(east, north)) % 360.0 if moving else math.nan,
        airborne=not report.on_ground,
        nic=info.nic or 0,
        nacp=info.nacp or 0,
        category=emitter_number(info.category),
        callsign=info.callsign or "",
        emergency=EMERGENCIES.index(emergency),
    )


def encode(report: AdsbReport) -> bytes:
    """Return the framed traffic report of a report."""
    return frame(m.encode_target(target_of(report)))


def heartbeat(t: float) -> bytes:
    """Return the framed heartbeat at a time, Unix s, of a receiver that has no position of its own."""
    return frame(m.encode_heartbeat(m.Heartbeat(False, True, int(t % 86400.0))))
