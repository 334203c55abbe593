"""ADS-B reports of made aircraft, for flights on loopback."""

from wideberth.frames import LocalFrame
from wideberth.sensors.adsb.report import AdsbReport
from wideberth.types import FloatArray, SourceInfo


def made_report(
    t: float, address: int, callsign: str, frame: LocalFrame, position: FloatArray, velocity: FloatArray
) -> AdsbReport:
    """Return the report of an aircraft in level flight: time, Unix s; position and velocity (3,), NED."""
    latitude, longitude, altitude = (float(x) for x in frame.to_geodetic(position))
    return AdsbReport(
        t, f"{address:06x}", latitude, longitude, pressure_altitude=altitude,
        velocity_north=float(velocity[0]), velocity_east=float(velocity[1]), climb_rate=0.0,
        info=SourceInfo(callsign=callsign, nic=8, nacp=9),
    )  # fmt: skip
