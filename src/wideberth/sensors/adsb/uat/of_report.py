"""Raw UAT lines of reports, for senders."""

import math

from wideberth.sensors.adsb.message_fields import EMERGENCIES
from wideberth.sensors.adsb.quality import emitter_number
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.sensors.adsb.uat import messages as m
from wideberth.units import FOOT, FOOT_PER_MINUTE, KNOT


def message_of(report: AdsbReport) -> m.UatMessage:
    """Return the ADS-B message of a report."""
    info = report.info
    known = math.isfinite(report.latitude) and math.isfinite(report.longitude)
    emergency = info.emergency if info.emergency in EMERGENCIES else "none"
    address = report.address.split("#")[0]
    north, east = report.velocity_north / KNOT, report.velocity_east / KNOT
    fast = max(abs(north), abs(east)) > 1022.0
    state = m.ON_GROUND if report.on_ground else m.SUPERSONIC if fast else m.AIRBORNE
    return m.UatMessage(
        qualifier=m.OTHER if address.startswith("~") else m.ICAO,
        address=int(address.lstrip("~"), 16),
        latitude=math.degrees(report.latitude) if known else math.nan,
        longitude=math.degrees(report.longitude) if known else math.nan,
        nic=info.nic or 0,
        pressure_altitude=report.pressure_altitude / FOOT,
        geometric_altitude=report.geometric_altitude / FOOT,
        state=state,
        velocity_north=north,
        velocity_east=east,
        climb_rate=report.climb_rate / FOOT_PER_MINUTE,
        ground_speed=math.hypot(north, east),
        ground_track=math.degrees(math.atan2(east, north)) % 360.0,
        status=m.ModeStatus(
            category=emitter_number(info.category),
            callsign=info.callsign or "",
            emergency=EMERGENCIES.index(emergency),
            sil=info.sil or 0,
            sda=info.sda or 0,
            nacp=info.nacp or 0,
            nacv=info.nacv or 0,
            acas_operational=bool(info.tcas_equipped),
            acas_active=bool(info.tcas_advisory),
            ident=bool(info.ident),
            receives=bool(info.adsb_in),
        ),
    )


def encode(report: AdsbReport) -> bytes:
    """Return the line of a report, as dump978 writes it on port 30978."""
    return f"-{m.encode(message_of(report)).hex()};t={report.t:.3f};\n".encode()
